/* Binding numbers and record layouts shared by C and GLSL. Shaders include this file textually.
 * Vectors of a frame are in list axes: component 0 runs along the list, 1 along u and 2 along v. So
 * one shader serves all three lists. Pixel positions in the shaders are relative to the image's
 * centre (screen.xy), which keeps their precision. */
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
/* Indexed lists reuse this number. */
#define TRIP_GL_VERTICES 6
#define TRIP_GL_ORDER 7
/* Reused by `post`, which draws no splats. */
#define TRIP_GL_SUMS 7
#define TRIP_GL_POSITIONS 5
#define TRIP_GL_DRAW_CODES 4
#define TRIP_GL_DRAW_DEVIATIONS 1
#define TRIP_GL_BLURRED_SUMS 2
/* Reused for splats of grids with uneven spacing; indexed lists use the second number. */
#define TRIP_GL_VOXEL_POSITIONS 7
#define TRIP_GL_VOXEL_POSITIONS_INDEXED 0
/* Reused for Gaussian scenes. */
#define TRIP_GL_TILE_PLANES 0
#define TRIP_GL_TILE_CLOSED 1
#define TRIP_GL_TILE_SPLATS 2
#define TRIP_GL_TILE_CURVES 3
#define TRIP_GL_TILE_PAIRS 4
#define TRIP_GL_TILE_JOBS 5
/* Reused for surfels. */
#define TRIP_GL_SURFELS 0
#define TRIP_GL_SURFEL_PLACES 1
#define TRIP_GL_SURFEL_CELLS 2
/* Texture units. The layer of axis a uses unit a, its depths unit 3 + a. */
#define TRIP_GL_LAYER 0
#define TRIP_GL_LAYER_DEPTH 3
#define TRIP_GL_SHEET_CODES 6
#define TRIP_GL_SHEET_GRADIENTS 7
#define TRIP_GL_LIGHT_REACHED 8
#define TRIP_GL_LIGHT_OPEN 9
#define TRIP_GL_HEAT 10
#define TRIP_GL_SHEET_DEVIATIONS 11
#define TRIP_GL_SURFEL_DEPTHS 0
#define TRIP_GL_SURFEL_HOLDERS 1
/* Image units. */
#define TRIP_GL_IMAGE 0 /* a layer or a sheet */
#define TRIP_GL_IMAGE_DEPTH 1
#define TRIP_GL_IMAGE_DEVIATIONS 1
#define TRIP_GL_SURFEL_IMAGE_DEPTHS 0
#define TRIP_GL_SURFEL_IMAGE_FRONTS 1
#define TRIP_GL_SURFEL_IMAGE_NUMBERS 2
#define TRIP_GL_SURFEL_IMAGE_HOLDERS 3
#define TRIP_GL_SURFEL_IMAGE_BLOCKS 4
/* Outputs of a layer and of the merged picture. Depths exist only with settings.depth. */
#define TRIP_GL_OUT_COLOUR 0
#define TRIP_GL_OUT_DEPTH 1
/* Uniform locations. */
#define TRIP_GL_ROW 0
#define TRIP_GL_ROW_IN_BAND 1
#define TRIP_GL_PIECE 0
#define TRIP_GL_WAY 2
#define TRIP_GL_SHEET 0
#define TRIP_GL_SHEET_SIZE 1
#define TRIP_GL_SHEET_APART 2
#define TRIP_GL_SHEET_SCALE 3
#define TRIP_GL_TILE_GRID 0
#define TRIP_GL_TILE_PICTURE 1
#define TRIP_GL_TILE_TERMINATION 2
#define TRIP_GL_TILE_FIRST_JOB 3
#define TRIP_GL_SURFEL_PICTURE 0
#define TRIP_GL_SURFEL_FIRST 1
#define TRIP_GL_SURFEL_COUNT 2
#define TRIP_GL_SURFEL_STAGE 3
#define TRIP_GL_SURFEL_PITCH 4
/* Codes of missing voxels in a sheet, for whole codes and for exact draw codes. */
#define TRIP_GL_MISSING_WHOLE -1.0
#define TRIP_GL_MISSING_EXACT -3e38
/* Directions of rays, as in trip_way. */
#define TRIP_GL_WAY_ANY 0
#define TRIP_GL_WAY_UP 1
/* Side of a tile of a Gaussian scene in pixels, TRIP_TILE_PX, and its pixels. */
#define TRIP_GL_TILE_PX 16
#define TRIP_GL_TILE_PIXELS 256
/* The cell of a surfel that is not drawn, TRIP_SURFEL_NO_CELL, and vectors of a surfel. */
#define TRIP_GL_NO_CELL 0xffffffffu
#define TRIP_GL_SURFEL_LAYERS 5
/* Pixels along each side of a block of depths, level 0 of depth_pyramid.h. */
#define TRIP_GL_SURFEL_BLOCK 8
/* Invocations of a work group over surfels. */
#define TRIP_GL_SURFEL_GROUP 64
/* Invocations of a work group in the counting pass. */
#define TRIP_GL_COUNT_GROUP 64
/* Invocations along each side of a work group over a sheet or a picture. */
#define TRIP_GL_SQUARE_GROUP 8
/* Maximum number of segment ends drawn at once. */
#define TRIP_GL_ENDS_MAX 160
/* Rows of a blurred function, and the 4 in the formula of its deviations (blurred_function.h). */
#define TRIP_GL_BLURRED_ROWS 33
#define TRIP_GL_BLURRED_BEFORE 4
/* Offset of the deviations of squares without any. */
#define TRIP_GL_NO_DEVIATIONS 0xffffffffu
/* Number of steps between emission colours, TRIP_EMISSION_STEPS. */
#define TRIP_GL_EMISSION_STEPS 256

/* Constants of one list of a frame, or of a layer with the grid of level 0. R4 holds floats for
 * drawing, doubles for counting and weights. */
#define TRIP_GL_FRAME_FIELDS(R4)                                                                   \
    /* xyz: depth = forward . c. w: 1 / (pixels per sigma at depth 1). */                          \
    R4 forward;                                                                                    \
    /* xyz: pixel = to . c, divided by the depth in perspective. to_x.w:                           \
       trip_splat_frame.flatten. */                                                                \
    R4 to_x, to_y;                                                                                 \
    /* xyz: d ray / d (pixel times step), for rays of length 1 at the image's centre. ray_x.w:     \
       step. ray_y.w: (r . ray_x x ray_y)^2. */                                                    \
    R4 ray_x, ray_y;                                                                               \
    /* xyz: the ray at the image's centre. */                                                      \
    R4 ray_0;                                                                                      \
    /* |ray|^2 of a pixel is a . (1, x, y, x x) + b . (x y, y y). */                               \
    R4 ray2_a, ray2_b;                                                                             \
    /* |J ray|^2 / voxel_world^2 of a pixel, in the same form. */                                  \
    R4 world2_a, world2_b;                                                                         \
    /* As in trip_camera, in the data's axes. */                                                   \
    R4 camera_r0, camera_rx, camera_ry;                                                            \
    /* xyz: columns of J / voxel_world. */                                                         \
    R4 world_0, world_1, world_2;                                                                  \
    /* For 3-byte normals. xyz: columns of the map from steps to world space, divided by the       \
       gradient of full shading. compact_0.w: length of gradients with only their direction        \
       stored, divided by the same number. */                                                      \
    R4 compact_0, compact_1, compact_2;                                                            \
    /* If w is 0, xyz is the direction to the light in world space. If w is 1, xyz is the          \
       position of the light relative to the eye, in list axes. */                                 \
    R4 light;                                                                                      \
    /* xyz: direction to the eye in parallel views. w: gradient_full of the header, divided by     \
       the gradient of full shading. */                                                            \
    R4 to_eye;                                                                                     \
    /* xy: the image's centre in pixels. zw: width and height. */                                  \
    R4 screen;                                                                                     \
    /* sigma^2, cutoff^2, low_pass^2, amplitude * world units per voxel. */                        \
    R4 kernel;                                                                                     \
    /* x: exp(-cutoff^2 / 2), which is subtracted from every footprint. y: step of codes. z: 1     \
       / (2 erf(cutoff / sqrt 2)). */                                                              \
    R4 edge;                                                                                       \
    /* x: length of a voxel along the axis in lists of means, else 0. yz: lo and width of          \
       trip_mean_scale. */                                                                         \
    R4 means;                                                                                      \
    /* The one footprint of parallel views, or of FIXED: conic xx, xy, yy, amplitude. */           \
    R4 parallel;                                                                                   \
    /* Half extents of this footprint in x and y, its radius in index space (with FIXED at         \
       depth 1), its amplitude without the low-pass filter. */                                     \
    R4 parallel_size;                                                                              \
    /* xyz: scale from the list's grid to the grid of level 0, where weights are taken. w: the     \
       maximum scale. */                                                                           \
    R4 to_grid;                                                                                    \
    /* x: factor from forward . c to the depth of a layer, in voxels of level 0 along the ray      \
       at the image's centre. y: world units per voxel of level 0. */                              \
    R4 depth;                                                                                      \
    /* h, sqrt(1 + h^2), list axis, axis of view. */                                               \
    R4 weight;                                                                                     \
    /* r, g, b, a; not premultiplied. */                                                           \
    R4 background;                                                                                 \
    /* rgb: replaces all colours before lighting, unless w is 0. */                                \
    R4 debug_colour;

/* Constants of the effects of a list, or of a layer of sheets (render/light/effects.h,
 * render/light/emission.h). */
#define TRIP_GL_EFFECTS_FIELDS(R4)                                                                 \
    /* The eye's position in the list's grid, list axes: rounded to float, and the rest. */        \
    R4 eye_high, eye_low;                                                                          \
    /* index . (position in the list's grid, 1) is the position in index space of level 0. */      \
    R4 index_0, index_1, index_2;                                                                  \
    /* xyz . (unit vector in world space) is the bias in that direction, in index space. w:        \
       position of a point light. */                                                               \
    R4 aside_0, aside_1, aside_2;                                                                  \
    /* Lattice nodes per voxel: of the light that arrives, of openness, of heat. */                \
    R4 per_voxel;                                                                                  \
    /* cue . (position in index space, 1) is the amount of fading, from 0 to 1. */                 \
    R4 cue;                                                                                        \
    /* rgb: the background. w: its share at full fading. */                                        \
    R4 faded;                                                                                      \
    /* 1 - g^2, 1 + g^2, 2 g; w is 1 for a point light. */                                         \
    R4 phase;                                                                                      \
    /* heat . (position in index space, 1) is the position in the grid of heat. */                 \
    R4 heat_0, heat_1, heat_2;                                                                     \
    /* xyz: last voxel of the grid of heat. */                                                     \
    R4 heat_last;

/* Constants of a pass over the sheets of a list (render/sheet.h). Linear functions of a pixel are
 * xyz . (1, x, y), with (x, y) relative to the image's centre. Rays have the same lengths as in
 * trip_gl_frame. The reference ray is trip_gl_sheet_view.slope. */
#define TRIP_GL_SHEET_PASS_FIELDS(R4, I4)                                                          \
    /* xyz: movement of a ray along the list for each unit of depth. w: direction, 1 or -1. */     \
    R4 along;                                                                                      \
    /* xyz: movement along u and v relative to the reference ray. In parallel views: start         \
       relative to the reference ray. across_u.w: value of 1 in the sums. across_v.w:              \
       transmittance for early termination. */                                                     \
    R4 across_u, across_v;                                                                         \
    /* Parallel views: start along the list, relative to the ray at the image's centre. */         \
    R4 start;                                                                                      \
    /* xyz: columns of the map from differences of codes (list axes) to world space, divided by    \
       the gradient of full shading. */                                                            \
    R4 gradient_0, gradient_1, gradient_2;                                                         \
    /* xy: number of voxels along u and v. zw: the grid's last voxel, relative to the first one    \
       held. */                                                                                    \
    I4 extent;                                                                                     \
    /* x: number of clipping half-spaces. yz: the grid's first voxel, relative to the first one    \
       held. w: the kernel. */                                                                     \
    I4 clips;                                                                                      \
    /* Linear functions for each half-space: distance inside at depth 0, and its increase for      \
       each unit of depth. */                                                                      \
    R4 clip_start[14], clip_along[14];

/* The end of a segment, where rays cross a plane of samples.
 * - `step` is its distance along the list from the previous end. 0 means that no segment lies
 *   between them.
 * - A ray's u is base_u + first_u + its movement over the distance `along`; v is analogous.
 * - `before` and `behind` are the texture layers of the sheets around the plane, and `part` is its
 *   position between them, from 0 to 1. The outer layers hold the next sheets on each side; -1
 *   means that a sheet is missing.
 * - `sheet` is the coordinate of the plane along the list, relative to the grid's first sheet.
 * With uneven spacing the coordinates are positions (coordinates.h), and u and v are relative to
 * the grid's first voxel. */
#define TRIP_GL_SHEET_END_FIELDS(INT, FLOAT)                                                       \
    INT base_u, base_v, before, behind;                                                            \
    FLOAT first_u, first_v, along, step, part;                                                     \
    INT outer_before, outer_behind;                                                                \
    FLOAT sheet;

#ifdef TRIP_GLSL
#define TRIP_GL_VEC3 vec3
#define TRIP_GL_VEC4 vec4
#define TRIP_GL_INT int
#else
#include <stdint.h>
#define TRIP_GL_VEC3 trip_gl_vec3
#define TRIP_GL_VEC4 trip_gl_float4
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

/* A square of a run's block (trip_square of stream/block.h). The entry e of a draw position selects
 * voxel number e % 64 of square e / 64. */
struct trip_gl_square {
    TRIP_GL_UINT mask_low, mask_high;
    TRIP_GL_UINT codes, normals; /* byte offset of its first voxel */
    TRIP_GL_UINT min_width;      /* minimum and width of its codes, 16 bits each */
    TRIP_GL_UINT run;
    TRIP_GL_UINT corner; /* u and v in the tile, 16 bits each */
};

/* A square of a block to decode into a sheet. `codes` is the byte offset of its codes. `min_width`
 * holds the minimum and width of the codes, 16 bits each. `corner` holds u and v of the corner in
 * the sheet, 16 bits each. `deviations` is the byte offset of its deviations. */
struct trip_gl_sheet_square {
    TRIP_GL_UINT mask_low, mask_high;
    TRIP_GL_UINT codes;
    TRIP_GL_UINT min_width;
    TRIP_GL_UINT corner;
    TRIP_GL_UINT deviations;
};

/* The transfer function at a code. `entry` holds red, green, blue and the extinction of one voxel
 * length. `low` and `high` hold its integrals from code 0, 64 bits each: extinction times each
 * colour, and extinction. */
struct trip_gl_sum {
    TRIP_GL_UINT low[4], high[4];
    TRIP_GL_FLOAT entry[4];
};

/* A row of a blurred function. Its entries begin at `first`, `per_code` of them for each code.
 * `unit` is the value of 1 in its sums, for extinction per voxel length. `power` is the fourth
 * power of its deviation code, divided by 255. */
struct trip_gl_blurred_row {
    TRIP_GL_UINT first;
    TRIP_GL_FLOAT per_code, unit, power;
};

/* An entry of a row. `entry` holds extinction per world unit times red, green and blue, and
 * extinction. `low` and `high` hold the integrals of the row from code 0, as in trip_gl_sum. */
struct trip_gl_blurred_entry {
    TRIP_GL_UINT low[4], high[4];
    TRIP_GL_FLOAT entry[4];
};

/* Replaces the sums if segments have a closed form. render/classification/closed_form.h defines the
 * terms; k is per voxel length. */
struct trip_gl_closed {
    TRIP_GL_FLOAT scale, offset, ramp, unused;
    TRIP_GL_FLOAT k[4], q0[4], q1[4];
};

/* A projected Gaussian: trip_projected with u and v at the first pixel of a tile. `tile` holds the
 * tile's column and row, 16 bits each. */
struct trip_gl_projected {
    TRIP_GL_VEC4 uv;   /* u, v, across, across_shear */
    TRIP_GL_VEC4 rest; /* down, limit, opacity, z */
    TRIP_GL_VEC3 rgb;
    TRIP_GL_UINT tile;
};

/* The rest of a curved footprint: trip_curve with w, a and b at the same pixel. If a footprint is
 * not curved, its w is 1 and all other numbers are 0. */
struct trip_gl_curve {
    TRIP_GL_VEC4 w_a_b; /* w, a, b, turn */
    TRIP_GL_VEC4 steps; /* bend_x, bend_y, tilt, skew */
};

/* A projected surfel. surfel.glsl names its vectors. */
struct trip_gl_surfel {
    TRIP_GL_VEC4 at[TRIP_GL_SURFEL_LAYERS];
};

/* A tile to draw: its number in the band, its first pair, and their number. */
struct trip_gl_tile {
    TRIP_GL_UINT tile, first, count;
};

/* A run of a list to draw. In indexed lists draw position i is record first + step * i.
 *
 * The origin c of the run (sheet, tile) is relative to the eye and computed in double. It is stored
 * as base + base_low. `position` holds the products (to_x . c, to_y . c, forward . c), in pixels
 * from the image's centre. These floats keep their precision, however far the eye is.
 *
 * With uneven spacing, runs of lists that are not indexed store the origin's u, v and sheet in
 * `first`, `step` and `unused`. */
struct trip_gl_run {
    TRIP_GL_VEC3 base;
    TRIP_GL_INT first;
    TRIP_GL_VEC3 base_low;
    TRIP_GL_INT step;
    TRIP_GL_VEC3 position;
    TRIP_GL_INT unused;
};

#endif
