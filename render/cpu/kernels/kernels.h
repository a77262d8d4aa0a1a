/* Data and functions of the CPU renderer's inner loops: projected splats, the constants of a list,
 * the pixels of a pane, and the kernels per instruction set. The kernels are pure functions of
 * their arguments, so any thread may call them with its own scratch. isa.h chooses a table. */
#ifndef TRIP_CPU_KERNELS_H
#define TRIP_CPU_KERNELS_H

#include <assert.h>
#include <stdatomic.h>
#include <stdint.h>

#include "cpu/kernels/kernel_sheets.h"
#include "layer.h"
#include "renderer.h"
#include "splat.h"
#include "weight.h"

/* A pixel is terminated in three cases:
 * - its transmittance is below trip_cpu_view.early_termination;
 * - its layer has no weight there;
 * - the layer draws only rays in the opposite direction.
 *
 * All other pixels are open. A terminated pixel takes no more splats, front to back.
 *
 * A pane is an aligned square of the picture; TRIP_CPU_PANE is its edge in pixels. A stamp is a
 * V-lane vector of four columns times V / 4 rows of it, so that a small footprint meets few
 * vectors, all of them aligned. A pane stores its stamps row by row. A stamp stores one vector for
 * each channel of layer.h, with 1 - alpha instead of alpha. */
#define TRIP_CPU_PANE 32
#define TRIP_CPU_PANE_PIXELS (TRIP_CPU_PANE * TRIP_CPU_PANE)

/* Exponents are stored in the form of a float's bits: y means 2^(y / TRIP_CPU_EXP_UNIT - 127). */
#define TRIP_CPU_EXP_UNIT 8388608.0

/* A splat is thin if its largest optical depth is at most this. Short polynomials give the opacity
 * of thin splats. */
#define TRIP_CPU_THIN 0.3f

/* Number of terms in the opacity of thin splats in views with a constant stretch: u (c[0] + c[1] u
 * + ... + c[4] u^4)^2. */
#define TRIP_CPU_TERMS 5

/* Other contents of c[]. They apply to splats that are thick, near (splat.h) or in a view with a
 * varying stretch.
 * - MIN, EDGE: see trip_cpu_splat.
 * - ALONG, ALONG_X, ALONG_Y: `along` at the image's corner, and its change per pixel in x and y.
 *   Only for near splats.
 * - AWAY2: |c|^2 / sigma^2 in place of EDGE, for near splats with trip_cpu_own_rays(). */
enum { TRIP_CPU_MIN, TRIP_CPU_EDGE, TRIP_CPU_ALONG, TRIP_CPU_ALONG_X, TRIP_CPU_ALONG_Y };
enum { TRIP_CPU_AWAY2 = TRIP_CPU_EDGE };

/* One splat, ready to blend. It has 64 bytes, a cache line. Let (x, y) be a pixel's position from
 * the corner of a pane: the first pane of the splat, or after pane_blend() the current pane. Then
 *     a = l11 x + l21 y + l1,  b = l22 y + l2,  u = max(0, 1 - G (a^2 + b^2)),
 * with G from trip_cpu_rays. So u = 1 - m / k^2 of splat.h, which is 1 at the centre and 0 outside
 * the support. `cutoff` is the field of trip_cpu_view.
 * - Thin splats in views with a constant stretch: c[] gives the opacity, see TRIP_CPU_TERMS.
 * - Other splats: the optical depth is 2^(c[MIN] + u cutoff) - c[EDGE], with the exponent in the
 *   form of TRIP_CPU_EXP_UNIT. The stretch multiplies it if it varies. Near splats multiply it by
 *   front(p) of splat.h.
 * - Summed sheets: the optical depth is `peak` (exp(-m / 2) - edge), with m and edge of splat.h.
 *   The same factors apply. r, g and b are multiplied by `peak`. */
typedef struct trip_cpu_splat {
    float l11, l21, l22, l1, l2;
    float r, g, b;
    union {
        float c[TRIP_CPU_TERMS];
        struct { /* for summed sheets */
            float peak;
            int32_t sheet; /* index in the list */
            float along[3];
        };
    };
    uint16_t x0, y0, x1, y1; /* pixels that contain the support, inclusive, inside the image */
    uint32_t panes;          /* panes of the support, see TRIP_CPU_PANES_* */
} trip_cpu_splat;

static_assert(sizeof(trip_cpu_splat) == 64, "one cache line");

/* Bits of trip_cpu_splat.panes:
 * - FIRST: the number of the first pane, top left.
 * - NEAR: the splat is near.
 * - RIGHT, BELOW: the support reaches the pane to the right of the first, and the pane below it.
 * - MORE: the support reaches beyond these two by two panes.
 * - THICK: the splat is not thin. Near splats always have this bit. */
#define TRIP_CPU_PANES_NEAR (1u << 27)
#define TRIP_CPU_PANES_RIGHT_SHIFT 28
#define TRIP_CPU_PANES_BELOW_SHIFT 29
#define TRIP_CPU_PANES_MORE (1u << 30)
#define TRIP_CPU_PANES_THICK_SHIFT 31
#define TRIP_CPU_PANES_FIRST ((1u << 27) - 1)

/* The tables of G and stretch that the pixels of a view need. Constant values need no table. */
typedef enum trip_cpu_rays {
    TRIP_CPU_PARALLEL,    /* G = 1, constant stretch; also affine views, except near splats */
    TRIP_CPU_PERSPECTIVE, /* G(p) = 1 / |r(p)|^2, constant stretch: cubic voxels */
    TRIP_CPU_STRETCHED,   /* G(p) and stretch(p) */
} trip_cpu_rays;

/* Constants of one list of a frame, or of a layer. Panes are cleared, drawn and finished with them.
 */
typedef struct trip_cpu_view {
    const trip_frame *of;
    const trip_tf_entry *table; /* indexed by 16-bit code; set by trip_cpu_view_set_table() */
    const trip_list *list;      /* NULL for a layer, which uses the index space of level 0 */
    trip_splat_frame splat;     /* with the list's camera */
    trip_cpu_rays rays;
    bool front_to_back, shading;
    bool flattens;         /* kernels are flattened along the gradients */
    bool sums;             /* splats are summed sheet by sheet */
    bool has_debug_colour; /* `debug_colour` replaces all colours before lighting */
    float debug_colour[3];
    /* NULL with even spacing. With uneven spacing splats are projected one by one. */
    const trip_coordinates *coordinates;
    bool stretch_varies;
    bool affine; /* affine footprints (splat.h): G and stretch are 1 except for near splats */
    unsigned code_bytes, normal_bytes; /* of a code in the list, of a normal in the data set */
    int axis, u_axis, v_axis;
    trip_way way;        /* direction of the layer's rays; set after the view is made */
    float compact[3][3]; /* 3-byte normals: steps to world space, divided by gradient_full */
    float normal_full;   /* length / gradient_full of normals stored as a direction; for 4-byte
                            normals, its minimum */
    double stretch;      /* world units per index length; the cube root of |J| if it varies */
    /* Coefficients of 1, x, y, x^2, x y and y^2 in |r|^2 and in |J r|^2 / stretch^2. (x, y) is in
     * pixels from the image's middle. */
    float ray2[6], world2[6];
    float cutoff;            /* drop of the exponent from the peak to the edge of the support, in
                                TRIP_CPU_EXP_UNIT */
    float early_termination; /* trip_cpu_early_termination() */
    float thin;              /* the largest optical depth of thin splats, without the stretch */
    int panes_across;
    /* X, Y and z of a voxel are linear in [u, v, sheet, 1] with these coefficients. */
    double along_x[4], along_y[4], along_z[4];
    double forward_length;   /* maximum change of z per index length */
    double eye[3], light[3]; /* [u, v, sheet]; `light` is the position of a point light */
    double world[3][3];      /* columns of index_to_world for u, v, sheet, divided by voxel_world */
    double depth_unit;       /* factor from z to the depth of layers */
    trip_splat parallel;     /* parallel views: the footprint of every splat */
    float behind;            /* splats at this depth or less are not visible */
    float near;              /* parallel views: splats at a smaller depth are near */
    trip_cpu_effects effects;
    trip_tf_entry byte_rows[256]; /* rows of `table` for codes of one byte */
    trip_code_range shown; /* rows of trip_cpu_rows() with extinction, if they are contiguous;
                              otherwise an empty range */
} trip_cpu_view;

/* Returns the transfer function's rows, indexed by code as stored in the list. Codes of one byte
 * have a table of 4 KiB, which stays in the nearest cache. In the full table their rows lie a page
 * apart. */
static inline const trip_tf_entry *trip_cpu_rows(const trip_cpu_view *view)
{
    return view->code_bytes == 1 ? view->byte_rows : view->table;
}

/* Returns whether near splats have G and the stretch of an index space of their own. This holds in
 * perspective with uneven spacing, unless sheets are summed: a summed splat has no room for the
 * values. Let e1, e2 and c be as in splat.h. They are orthogonal, so in the splat's index space the
 * ray of a pixel has
 *     |r|^2 = (a^2 + b^2 + along^2) sigma^2 / |c|^2.
 * Here a and b are the values before the low-pass filter. The filter adds to a^2 and b^2 at most
 * the squared angle of low_pass_px pixels times |r c / sigma|^2. Without EWA all splats count
 * as near. */
static inline bool trip_cpu_own_rays(const trip_cpu_view *view)
{
    return view->coordinates && !view->splat.camera.ortho && !view->sums;
}

/* A square of 8 x 8 voxels of a run, as stored in its block (block.h). */
typedef struct trip_cpu_square {
    int u, v, sheet;     /* of the first voxel */
    uint64_t mask;       /* bit n: the voxel with Morton number n is present */
    uint32_t min, width; /* of the codes, as in trip_square */
    /* Data of the first voxel present. `normals` is read only if the view shades or flattens. The
     * memory must be readable for TRIP_CPU_READABLE bytes past the square's data. */
    const unsigned char *codes, *normals;
} trip_cpu_square;

#define TRIP_CPU_READABLE 64

/* For each byte of a mask: the positions of its set bits in a square, u + 8 v, one byte each,
 * lowest bit first. */
extern const uint64_t trip_cpu_positions[256];
/* For each byte of a mask: the numbers of its set bits, one byte each, lowest bit first. */
extern const uint64_t trip_cpu_bits_set[256];

/* Voxels that wait for projection, from any runs; one entry per lane. */
#define TRIP_CPU_STAGED 320
typedef struct trip_cpu_staged {
    int32_t u[TRIP_CPU_STAGED + 16], v[TRIP_CPU_STAGED + 16], sheet[TRIP_CPU_STAGED + 16];
    int32_t code[TRIP_CPU_STAGED + 16]; /* a row of trip_cpu_rows() */
    int32_t normal[TRIP_CPU_STAGED + 16];
} trip_cpu_staged;

/* Intermediate results for the staged voxels, which the loops of the projection hand on. */
typedef struct trip_cpu_lanes {
    /* The centre is (x + whole_x, y + whole_y). */
    float x[TRIP_CPU_STAGED], y[TRIP_CPU_STAGED];
    float whole_x[TRIP_CPU_STAGED], whole_y[TRIP_CPU_STAGED];
    float z[TRIP_CPU_STAGED];
    float l11[TRIP_CPU_STAGED], l21[TRIP_CPU_STAGED], l22[TRIP_CPU_STAGED];
    float l1[TRIP_CPU_STAGED], l2[TRIP_CPU_STAGED];
    float depth[TRIP_CPU_STAGED]; /* the largest optical depth before `edge` is subtracted, without
                                     the stretch */
    float first[TRIP_CPU_STAGED], last[TRIP_CPU_STAGED]; /* two uint16 each */
    float panes[TRIP_CPU_STAGED];                        /* uint32 */
    /* Lanes of each vector, a bit each: lanes that are kept, and lanes to project one by one. */
    uint32_t kept[TRIP_CPU_STAGED / 4], scalar[TRIP_CPU_STAGED / 4];
    bool broken; /* set, and never reset, when numbers of a splat are not finite */
} trip_cpu_lanes;

/* Constants of the bound in trip_weight_may_reach() for the splats of a list, in the grid of level
 * 0. */
typedef struct trip_cpu_reach {
    bool bounded; /* false if the weight is the same for all rays, so that every splat is reached */
    bool inclusive;  /* the bound may be 0 */
    float h, across; /* `across` is the factor of the radius */
    float scale[3];  /* from the list's grid to the grid of level 0: u, v, sheet */
} trip_cpu_reach;

/* Number of splats sorted together by the stamps of a pane, and maximum number of bands of 64
 * stamps. */
#define TRIP_CPU_LOCAL 256
#define TRIP_CPU_BANDS 4

/* Maximum number of stamps in a pane, and floats in a pane's open sheet (sum_tmpl.h) with
 * `channels` channels. */
#define TRIP_CPU_STAMPS_MAX 256
#define TRIP_CPU_SHEET_FLOATS(channels)                                                            \
    ((channels)*TRIP_CPU_PANE_PIXELS + 2 * (size_t)TRIP_CPU_STAMPS_MAX)

/* The open sheet of a stamp that has none. */
#define TRIP_CPU_NO_SHEET UINT64_MAX

/* Working memory of one thread that blends a pane. */
typedef struct trip_cpu_scratch {
    _Alignas(64) float early_termination[16];          /* the view's value in every lane */
    _Alignas(64) float rays[2 * TRIP_CPU_PANE_PIXELS]; /* by stamp: G[V], stretch[V] */
    _Alignas(64) trip_cpu_splat local[TRIP_CPU_LOCAL];
    float local_depths[TRIP_CPU_LOCAL]; /* only in layers with depth */
    /* By band and group of 64 splats: the stamps of each splat, and after transposing the splats of
     * each stamp. */
    uint64_t touched[TRIP_CPU_BANDS][TRIP_CPU_LOCAL / 64][64];
    uint64_t any[TRIP_CPU_BANDS];        /* stamps that a splat may touch */
    uint64_t open[TRIP_CPU_BANDS];       /* this thread's stamps with an open pixel */
    uint64_t rays_known[TRIP_CPU_BANDS]; /* stamps with valid `rays` */
    uint64_t thick[TRIP_CPU_LOCAL / 64]; /* splats that are not thin */
    uint32_t splats;
    int x, y;             /* first pixel of the pane */
    float *pixels, *sums; /* of the pane; sums of the open sheet if sheets are summed */
    void (*blend)(struct trip_cpu_scratch *s); /* blends local[] in order */
    const trip_cpu_view *view;                 /* view of the gathered splats, or of the layer */
    trip_cpu_staged staged;
    trip_cpu_lanes lanes;
} trip_cpu_scratch;

/* The contents of a pane after all lists are drawn. */
typedef enum trip_cpu_content {
    TRIP_CPU_NOTHING,
    TRIP_CPU_LAYER, /* the blended layer of the only list with weight there */
    TRIP_CPU_SUM,   /* the sum of several lists */
} trip_cpu_content;

struct trip_cpu_region;

typedef uint32_t trip_cpu_project_kernel(const trip_cpu_view *view, const _Atomic uint64_t *open,
                                         const trip_cpu_staged *staged, uint32_t count,
                                         trip_cpu_lanes *lanes, trip_cpu_splat *out, float *depths);

/* Composites the segments of a group of sample planes into a pane's pixels. Returns the pane's open
 * texels as a word of trip_cpu_mask. */
typedef uint64_t trip_cpu_sheet_kernel(const trip_cpu_sheet_view *view, const trip_cpu_group *group,
                                       int x, int y, float *pixels);

/* Parts of voxels. */
enum { TRIP_CPU_PART_CODES = 1, TRIP_CPU_PART_GRADIENTS = 2 };

/* The kernels of one instruction set. They are compiled once for layers without depth and once for
 * layers with depth. Arguments named `depths` hold one float per splat, and are unused without
 * depth. */
typedef struct trip_cpu_kernels {
    const char *isa;
    unsigned lanes, channels;
    const struct trip_cpu_kernels *with_depth; /* NULL in the table for layers with depth */

    /* Returns the squares of a region that may be visible: bit n is the square with Morton number
     * n. `open` holds the words of trip_cpu_mask. */
    uint64_t (*squares)(const trip_cpu_view *view, const struct trip_cpu_region *region,
                        const _Atomic uint64_t *open, trip_cpu_lanes *lanes);

    /* Adds the visible voxels of a square to `staged` in draw order, and leaves out transparent
     * ones. The square must have a voxel, and `staged` room for 64. Returns the new number of
     * staged voxels. */
    uint32_t (*stage)(const trip_cpu_view *view, const trip_cpu_square *square, bool reversed,
                      trip_cpu_staged *staged, uint32_t filled);
    /* Projects the first `count` staged voxels. Voxels with pixels in the image become splats, in
     * order. `open` holds the words of trip_cpu_mask. Splats that lie only over terminated texels
     * may then be left out. NULL keeps them. `out` and `depths` must have room for count + 1.
     * Returns the number of splats. project_effects is for frames with effects. */
    trip_cpu_project_kernel *project, *project_effects;

    /* Clears a pane's pixels: transparent where the list has weight, terminated elsewhere. `alone`
     * means that its weight is 1 in the whole pane. */
    void (*pane_clear)(const trip_cpu_view *view, int x, int y, bool alone, float *pixels);
    /* Begins to blend into a pane. `quarters` has a bit for each of its 16 x 16 quarters to draw.
     * `sums` is the pane's open sheet if sheets are summed. */
    void (*pane_begin)(const trip_cpu_view *view, trip_cpu_scratch *s, int x, int y,
                       unsigned quarters, float *pixels, float *sums);
    /* Blends splats[order[i]] in order, or splats[i] if `order` is NULL. They were projected with
     * this view. */
    void (*pane_blend)(const trip_cpu_view *view, trip_cpu_scratch *s, const trip_cpu_splat *splats,
                       const float *depths, const uint16_t *order, uint32_t count);
    /* Ends blending: every splat is then in the pixels or in the open sheet. Returns the open
     * texels of the quarters as a word of trip_cpu_mask. */
    uint64_t (*pane_end)(trip_cpu_scratch *s);
    void (*sheet_clear)(float *sums);
    /* Writes the pane's pixels with its open sheet composited to `out`. Neither input changes. */
    void (*sheet_composite)(const trip_cpu_view *view, const float *pixels, const float *sums,
                            float *out);
    /* sum += w^2 layer, or sum = w^2 layer for the first layer. */
    void (*pane_merge)(const trip_cpu_view *view, int x, int y, const float *pixels, bool first,
                       float *sum);
    /* Writes the finished picture of a pane to an image. `depth` has one float per pixel of the
     * image, and is unused without depth. */
    void (*pane_finish)(const trip_cpu_view *view, int x, int y, trip_cpu_content content,
                        const float *pixels, float *rgba, float *depth);

    /* Sets lanes->kept to the staged voxels in front of the eye with a support that rays with
     * weight in the list may reach. Sets lanes->scalar to the voxels that trip_cpu_project_scalar()
     * must decide. */
    void (*reaching)(const trip_cpu_view *view, const trip_cpu_reach *reach,
                     const trip_cpu_staged *staged, uint32_t count, trip_cpu_lanes *lanes);
    /* Returns the number of splats with a pixel centre of the image in their support where the list
     * has weight. `splats` come from project(). Overwrites `s`. */
    uint32_t (*drawn)(const trip_cpu_view *view, trip_cpu_scratch *s, const trip_cpu_splat *splats,
                      uint32_t count);

    /* Writes the codes of a square's records, biased, to the voxels of `mask`. `to` is the square's
     * first voxel in a raster. Writes no other voxel. Any codes may follow the records' codes. */
    void (*sheet_decode)(const uint16_t codes[64 + 32], uint64_t mask, int16_t *to);
    /* Computes the ranges of codes of the given squares in a raster. All other squares get an empty
     * range. */
    void (*sheet_ranges)(const trip_cpu_voxels *raster, uint64_t squares,
                         trip_cpu_square_ranges *out);
    /* Finds the cells of the squares that take a biased code in [`min`, `max`] between two sheets.
     * Cells that lack corners at both sheets are left out, and cells of other squares. */
    void (*sheet_cells)(const trip_cpu_voxels *from, const trip_cpu_voxels *to, uint64_t squares,
                        int16_t min, int16_t max, trip_cpu_cells *out);
    /* Computes the gradients of the squares' voxels that are present. `left` and `above` are the
     * neighbouring rasters of the same sheet; `sheet_before` and `sheet_behind` follow index order.
     * Only `raster` needs gradients; the kernel reads the codes of the other rasters. */
    void (*sheet_gradients)(trip_cpu_voxels *raster, uint64_t squares, const trip_cpu_voxels *left,
                            const trip_cpu_voxels *above, const trip_cpu_voxels *sheet_before,
                            const trip_cpu_voxels *sheet_behind);
    /* Interpolates the squares' voxels between two rasters: codes, gradients or both. `weights` is
     * w << 16 | 2^14 - w, where w is the weight of `to`. A voxel is missing if it is missing in
     * either raster. */
    void (*sheet_between)(const trip_cpu_voxels *from, const trip_cpu_voxels *to, uint64_t squares,
                          int32_t weights, unsigned parts, trip_cpu_voxels *out);
    /* Does the work of sheet_gradients() for outlines (sheet.h, `Nearest value`). */
    void (*sheet_outlines)(trip_cpu_voxels *raster, uint64_t squares, const trip_cpu_voxels *left,
                           const trip_cpu_voxels *above, const trip_cpu_voxels *sheet_before,
                           const trip_cpu_voxels *sheet_behind);
    /* Does the work of sheet_between() for deviations. */
    void (*sheet_deviations_between)(const int16_t *from, const int16_t *to, uint64_t squares,
                                     int32_t weights, int16_t *out);
    /* Finds the row of the blurred function, 0 to 32, that suffices for all voxels of each square.
     * Other squares get 0. */
    void (*sheet_rows)(const int16_t *deviations, uint64_t squares, uint8_t out[64]);
    /* sheet_pane_closed is for segments in closed form (closed_form.h), sheet_pane_effects for
     * frames with effects, sheet_pane_nearest for the nearest value, and sheet_pane_blurred for
     * blurred functions, with or without effects. */
    trip_cpu_sheet_kernel *sheet_pane, *sheet_pane_closed, *sheet_pane_effects, *sheet_pane_nearest,
        *sheet_pane_blurred;
} trip_cpu_kernels;

#endif
