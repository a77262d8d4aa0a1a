/* Binding numbers and record layouts shared by C and GLSL: shaders include this file textually.
 * Vectors of a frame are in list axes: component 0 runs along the list, 1 along u, 2 along v, so
 * that one shader serves all three lists. Pixel positions in the shaders are taken from
 * the image's centre (screen.xy), which keeps their last bits. */
#ifndef TRIP_GL_SHARED_H
#define TRIP_GL_SHARED_H

/* Uniform blocks. */
#define TRIP_GL_FRAME 0
#define TRIP_GL_SHEET_PASS 1
#define TRIP_GL_SHEET_ENDS 2
#define TRIP_GL_EFFECTS 3
#define TRIP_GL_HEAT_COLOURS 4
/* Storage blocks. */
#define TRIP_GL_VOXELS 0
#define TRIP_GL_NORMALS 1
#define TRIP_GL_RUNS 2
#define TRIP_GL_RUN_OF 3
#define TRIP_GL_TABLE 4
#define TRIP_GL_COUNTS 5
#define TRIP_GL_SQUARES 6
/* The same number, for indexed lists. */
#define TRIP_GL_VERTICES 6
#define TRIP_GL_ORDER 7
/* Likewise, for frames that classify after interpolation. */
#define TRIP_GL_SUMS 7
#define TRIP_GL_POSITIONS 5
/* Likewise, for splats of grids with uneven spacing, and where these are indexed. */
#define TRIP_GL_VOXEL_POSITIONS 7
#define TRIP_GL_VOXEL_POSITIONS_INDEXED 0
/* Texture units: the layer of axis a is unit a, its depths unit 3 + a. */
#define TRIP_GL_LAYER 0
#define TRIP_GL_LAYER_DEPTH 3
#define TRIP_GL_SHEET_CODES 6
#define TRIP_GL_SHEET_GRADIENTS 7
#define TRIP_GL_LIGHT_REACHED 8
#define TRIP_GL_LIGHT_OPEN 9
#define TRIP_GL_HEAT 10
/* Image units. */
#define TRIP_GL_IMAGE 0 /* of a layer, or a sheet */
#define TRIP_GL_IMAGE_DEPTH 1
/* Of a layer, and of the merged image: colour and opacity, and depths with settings.depth. */
#define TRIP_GL_OUT_COLOUR 0
#define TRIP_GL_OUT_DEPTH 1
/* Locations of uniforms. */
#define TRIP_GL_ROW 0
#define TRIP_GL_ROW_IN_BAND 1
#define TRIP_GL_PIECE 0
#define TRIP_GL_WAY 2
#define TRIP_GL_SHEET 0
#define TRIP_GL_SHEET_SIZE 1
#define TRIP_GL_SHEET_APART 2
/* Ways of rays, as trip_way has them. */
#define TRIP_GL_WAY_ANY 0
#define TRIP_GL_WAY_UP 1
/* Invocations of a counting work group. */
#define TRIP_GL_COUNT_GROUP 64
/* Of those over a sheet or an image, each way. */
#define TRIP_GL_SQUARE_GROUP 8
/* Ends of segments that are drawn at a time, at most. */
#define TRIP_GL_ENDS_MAX 160
/* Steps between the colours of emission, TRIP_EMISSION_STEPS. */
#define TRIP_GL_EMISSION_STEPS 256

/* Constants of one list of a frame, or of a layer by level 0's map; R is float for drawing, double
 * for counting and weights. */
#define TRIP_GL_FRAME_FIELDS(R4)                                                                   \
    R4 forward;        /* xyz: depth = forward . c; w: pixels to a sigma at depth 1, inverted */   \
    R4 to_x, to_y;     /* xyz: pixel = to . c (/ depth in perspective); w of the first: how much   \
                          kernels are flattened, trip_splat_frame.flatten */                       \
    R4 ray_x, ray_y;   /* xyz: d ray / d (pixel times step), rays of length 1 at the image's       \
                          centre; w: step, and (r . ray_x x ray_y)^2 */                            \
    R4 ray_0;          /* xyz: the ray at the image's centre */                                    \
    R4 ray2_a, ray2_b; /* |ray|^2 of a pixel: a . (1, x, y, x x) + b . (x y, y y) */               \
    R4 world2_a, world2_b;              /* |J ray|^2 / voxel_world^2 alike */                      \
    R4 camera_r0, camera_rx, camera_ry; /* as in trip_camera, in the data's axes */                \
    R4 world_0, world_1, world_2;       /* xyz: columns of J / voxel_world */                      \
    R4 compact_0, compact_1,                                                                       \
        compact_2; /* 3-byte normals: xyz: columns of the map from steps to                        \
                      world space, over full shading; w of the first: length of                    \
                      those of which the direction alone is kept, likewise */                      \
    R4 light;  /* xyz: towards the light, world space; with w its place from the eye, list axes */ \
    R4 to_eye; /* xyz: towards the eye in parallel views; w: gradient_full of the header           \
                  over that at full shading */                                                     \
    R4 screen; /* xy: the image's centre, pixels; zw: width, height */                             \
    R4 kernel; /* sigma^2, cutoff^2, low_pass^2, amplitude * world units per voxel */              \
    R4 edge;   /* x: what every footprint is lowered by, exp(-cutoff^2 / 2); y: step of codes;     \
                  z: 1 / (2 erf(cutoff / sqrt 2)) */                                               \
    R4 means;  /* of lists of means: x: the length of a voxel along the axis, else 0; yz: lo and   \
                  width of trip_mean_scale */                                                      \
    R4 parallel; /* the one footprint of a parallel view, or of FIXED: conic xx, xy, yy, amplitude \
                  */                                                                               \
    R4 parallel_size; /* its half extents in x and y, its radius in index space (FIXED: at depth   \
                         1), its amplitude without low-pass */                                     \
    R4 to_grid;       /* xyz: from the list's grid to that of level 0, where weights are taken;    \
                         w: the largest of them */                                                 \
    R4 depth;      /* x: of a layer's depth over forward . c, the first in voxels of level 0 along \
                      the ray at the image's centre; y: world units a voxel of level 0 */          \
    R4 weight;     /* h, sqrt(1 + h^2), list axis, axis of view */                                 \
    R4 background; /* r, g, b, a; not premultiplied */                                             \
    R4 tint;       /* rgb: of all that is drawn, before it is lit, where w is not 0 */

/* Constants of the effects of a list, or of a layer of sheets (render/effects.h,
 * render/emission.h). */
#define TRIP_GL_EFFECTS_FIELDS(R4)                                                                 \
    R4 eye_high, eye_low; /* its place in the list's grid, list axes: floats, and the rest */      \
    R4 index_0, index_1, index_2; /* xyz . a place there + w: in index space of level 0 */         \
    R4 aside_0, aside_1, aside_2; /* xyz . a unit vector of the world: the bias along it, in index \
                                     space; w: the place of a light that is at one */              \
    R4 per_voxel;                 /* nodes: of the light that reaches, of openness, of heat */     \
    R4 cue;   /* xyz . a place in index space + w: how far it has faded, from 0 to 1 */            \
    R4 faded; /* rgb: what into, the background; w: how much of it at 1 */                         \
    R4 phase; /* 1 - g^2, 1 + g^2, 2 g; 1: the light is at a place */                              \
    R4 heat_0, heat_1, heat_2; /* xyz . a place in index space + w: in that of heat */             \
    R4 heat_last;              /* xyz: its last voxel */

/* Constants of a pass over the sheets of a list (render/sheet.h). Linear functions of a pixel are
 * xyz . (1, x, y) from the image's centre; lengths of rays are those of trip_gl_frame. */
#define TRIP_GL_SHEET_PASS_FIELDS(R4, I4)                                                          \
    R4 along;              /* how far a ray goes along the list; w: which way, 1 or -1 */          \
    R4 across_u, across_v; /* and farther along u and v than slope_ref says; in parallel views how \
                              far apart rays start. w: 1 of the sums; the transmittance below      \
                              which a pixel is saturated */                                        \
    R4 start;              /* parallel views: where rays start along the list, from the one at the \
                              image's centre */                                                    \
    R4 gradient_0, gradient_1, gradient_2; /* xyz: columns of the map from differences of codes,   \
                                              list axes, to world space, over full shading */      \
    I4 extent; /* voxels of u and v from the first on; the grid's last, from that */               \
    I4 clips;  /* x: half-spaces that rays are cut to: how far inside they begin, and how much     \
                  that grows by as far as `along` and `across` say; y, z: the grid's first voxels  \
                  from the sheets' first; w: the kernel */                                         \
    R4 clip_start[14], clip_along[14];

/* The end of a segment: where rays pass a slice. `step` is how far along the list it is from the
 * end before; 0: no segment lies between them. A ray's u is base + first + what it moves along
 * `along`; the sheets before and behind the slice lie in two layers, and `part` is the place
 * between them; those beyond the two lie in the outer layers (-1: there is none); `sheet` is where
 * it is along the list, from the grid's first sheet. With uneven spacing these are places
 * (coordinates.h), and u and v are from the grid's first voxel. */
#define TRIP_GL_SHEET_END_FIELDS(INT, FLOAT)                                                       \
    INT base_u, base_v, before, behind;                                                            \
    FLOAT first_u, first_v, along, step, part;                                                     \
    INT outer_before, outer_behind;                                                                \
    FLOAT sheet;

#ifdef TRIP_GLSL
#define TRIP_GL_VEC3 vec3
#define TRIP_GL_INT int
#else
#include <stdint.h>
#define TRIP_GL_VEC3 trip_gl_vec3
#define TRIP_GL_INT int32_t
typedef struct trip_gl_vec3 {
    float x, y, z;
} trip_gl_vec3;
typedef struct trip_gl_float4 {
    float v[4];
} trip_gl_float4;
typedef struct trip_gl_double4 {
    double v[4];
} trip_gl_double4;
typedef struct trip_gl_frame_float {
    TRIP_GL_FRAME_FIELDS(trip_gl_float4)
} trip_gl_frame_float;
typedef struct trip_gl_frame_double {
    TRIP_GL_FRAME_FIELDS(trip_gl_double4)
} trip_gl_frame_double;
typedef struct trip_gl_effects_block {
    TRIP_GL_EFFECTS_FIELDS(trip_gl_float4)
} trip_gl_effects_block;
typedef struct trip_gl_int4 {
    int32_t v[4];
} trip_gl_int4;
typedef struct trip_gl_sheet_pass {
    TRIP_GL_SHEET_PASS_FIELDS(trip_gl_float4, trip_gl_int4)
} trip_gl_sheet_pass;
typedef struct trip_gl_sheet_end {
    TRIP_GL_SHEET_END_FIELDS(int32_t, float)
} trip_gl_sheet_end;
#endif

#ifdef TRIP_GLSL
#define TRIP_GL_UINT uint
#define TRIP_GL_FLOAT float
#else
#define TRIP_GL_UINT uint32_t
#define TRIP_GL_FLOAT float
#endif

/* A square of a run's block (trip_square of stream/block.h); draw position i is number i % 64 of
 * the voxels of square i / 64, by the entry of its position. */
struct trip_gl_square {
    TRIP_GL_UINT mask_low, mask_high;
    TRIP_GL_UINT codes, normals; /* bytes up to those of its first voxel */
    TRIP_GL_UINT min_width;      /* of its codes, 16 bits each */
    TRIP_GL_UINT run;
    TRIP_GL_UINT corner; /* u and v in the tile, 16 bits each */
};

/* A square of a block to put into a sheet: where its codes begin, in bytes, the least of them and
 * their width, and u and v of its corner in the sheet, 16 bits each. */
struct trip_gl_sheet_square {
    TRIP_GL_UINT mask_low, mask_high;
    TRIP_GL_UINT codes;
    TRIP_GL_UINT min_width;
    TRIP_GL_UINT corner;
};

/* The transfer function at a code: red, green, blue and extinction, here of a voxel's length; and
 * its integrals from code 0 on, of extinction times the colours and of extinction, 64 bits each. */
struct trip_gl_sum {
    TRIP_GL_UINT low[4], high[4];
    TRIP_GL_FLOAT entry[4];
};

/* In place of these where segments have a closed form, which names its terms
 * (render/closed_form.h); of a voxel's length. */
struct trip_gl_closed {
    TRIP_GL_FLOAT scale, offset, ramp, unused;
    TRIP_GL_FLOAT k[4], q0[4], q1[4];
};

/* A run of a list to draw; of indexed lists draw position i is record first + step * i. Its origin
 * (sheet, tile), formed in double: from the eye as base + base_low, and as the products (to_x . c,
 * to_y . c, forward . c), pixels from the image's centre, whose floats keep their precision however
 * far the eye is. With uneven spacing runs of lists that are not indexed have their origin's u, v
 * and sheet in `first`, `step` and `unused`. */
struct trip_gl_run {
    TRIP_GL_VEC3 base;
    TRIP_GL_INT first;
    TRIP_GL_VEC3 base_low;
    TRIP_GL_INT step;
    TRIP_GL_VEC3 position;
    TRIP_GL_INT unused;
};

#endif
