/* What the CPU renderer's inner loops share: a projected splat, the constants of a list, the pixels
 * of a pane, and the table of loops that each instruction set provides. The kernels are pure
 * functions of their arguments; threads give each its own scratch. isa.h chooses a table. */
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

/* A pixel is saturated when its transmittance is below trip_cpu_view.saturation, or where its layer
 * has no weight, or is of rays that go the other way: it takes no more splats, front to back. Until
 * then it is open.
 *
 * Edge in pixels of a pane, an aligned square of the picture (tiles are squares of a sheet). Its
 * pixels are kept as V-lane vectors of four columns times V / 4 rows (a stamp), so that a small
 * footprint meets few vectors and all of them aligned: stamp after stamp, row by row of stamps,
 * each a vector for every channel of layer.h; of alpha, 1 - alpha is kept. */
#define TRIP_CPU_PANE 32
#define TRIP_CPU_PANE_PIXELS (TRIP_CPU_PANE * TRIP_CPU_PANE)

/* Exponents are kept ready for the conversion to a float's bits: y stands for
 * 2^(y / TRIP_CPU_EXP_UNIT - 127). */
#define TRIP_CPU_EXP_UNIT 8388608.0

/* Splats whose largest optical depth is at most this are thin: short forms give their opacity. */
#define TRIP_CPU_THIN 0.3f

/* Opacities of thin splats in views with one stretch are u (c[0] + c[1] u + ... + c[4] u^4)^2. */
#define TRIP_CPU_TERMS 5

/* What is kept instead of c[] by a splat that is thick, near or in a view whose stretch varies; of
 * near splats (splat.h) alone, what `along` is at the image's corner and its change by x and y; of
 * those with rays of their own, in place of the edge, |c|^2 / sigma^2. */
enum { TRIP_CPU_MIN, TRIP_CPU_EDGE, TRIP_CPU_ALONG, TRIP_CPU_ALONG_X, TRIP_CPU_ALONG_Y };
enum { TRIP_CPU_AWAY2 = TRIP_CPU_EDGE };

/* One splat, ready to blend; 64 bytes, a cache line. With (x, y) a pixel's position from the corner
 * of the pane at hand (of the first that the splat lies in, until pane_blend() takes it up),
 *     a = l11 x + l21 y + l1,  b = l22 y + l2,  u = max(0, 1 - G (a^2 + b^2)),
 * G as in trip_cpu_rays: u = 1 - m / k^2 of splat.h, 1 at the centre and 0 outside the support. Its
 * opacity there is that of c[]; or its optical depth, times the stretch where it
 * varies, is what 2^(least + u cutoff) exceeds `edge` by, `cutoff` as in trip_cpu_view; and of near
 * splats front(p) of splat.h of that. Where sheets are summed its optical depth is the falloff
 * exp(-m / 2) - edge of splat.h times `peak`, likewise, and the colour is times `peak` too. */
typedef struct trip_cpu_splat {
    float l11, l21, l22, l1, l2;
    float r, g, b;
    union {
        float c[TRIP_CPU_TERMS];
        struct { /* where sheets are summed */
            float peak;
            int32_t sheet; /* of the list */
            float along[3];
        };
    };
    uint16_t x0, y0, x1, y1; /* pixels that contain the support, inclusive, inside the image */
    uint32_t panes;          /* those that it lies in, see below */
} trip_cpu_splat;

static_assert(sizeof(trip_cpu_splat) == 64, "one cache line");

/* trip_cpu_splat.panes: the number of the first pane (top left); whether the splat is near; whether
 * it also lies in the pane to the right of the first and in the one below it, or in more than these
 * two by two; and whether it is not thin, which near splats never count as. */
#define TRIP_CPU_PANES_NEAR (1u << 27)
#define TRIP_CPU_PANES_RIGHT_SHIFT 28
#define TRIP_CPU_PANES_BELOW_SHIFT 29
#define TRIP_CPU_PANES_MORE (1u << 30)
#define TRIP_CPU_PANES_THICK_SHIFT 31
#define TRIP_CPU_PANES_FIRST ((1u << 27) - 1)

/* Where the rays of a view are alike, their tables are not needed. */
typedef enum trip_cpu_rays {
    TRIP_CPU_PARALLEL,    /* G = 1, stretch constant; of affine views, near splats aside */
    TRIP_CPU_PERSPECTIVE, /* G(p) = 1 / |r(p)|^2, stretch constant: cubic voxels */
    TRIP_CPU_STRETCHED,   /* G(p) and stretch(p) */
} trip_cpu_rays;

/* Constants of one list of one frame, or of a layer: what panes begin and end with. */
typedef struct trip_cpu_view {
    const trip_frame *of;
    const trip_tf_entry *table; /* of 16-bit codes, set by trip_cpu_view_set_table() */
    const trip_list *list;      /* NULL: of a layer, by level 0's map */
    trip_splat_frame splat;     /* by the camera of the list */
    trip_cpu_rays rays;
    bool front_to_back, shading;
    bool flattens; /* kernels, along their gradients */
    bool sums;     /* splats are summed sheet by sheet */
    bool tinted;   /* all have one colour before they are lit: */
    float tint[3];
    const trip_coordinates *coordinates; /* of uneven spacing: splats are projected one by one; else
                                            NULL */
    bool stretch_varies;
    bool affine; /* by the affine map at the centre (splat.h): G and stretch are 1 but of near ones
                  */
    unsigned code_bytes, normal_bytes; /* of the list's codes, of the data set's normals */
    int axis, u_axis, v_axis;
    trip_way way;        /* of the rays that the layer is of; set once the view is made */
    float compact[3][3]; /* of 3-byte normals: from steps to world space, over gradient_full */
    float normal_full;   /* length of those of which the direction is kept, likewise; of 4-byte
                            normals the least */
    double stretch;      /* world units per index length; the cube root of |J| where it varies */
    /* |r|^2 and |J r|^2 / stretch^2 at (x, y) from the image's middle: 1, x, y, x^2, x y and y^2
     * times these. */
    float ray2[6], world2[6];
    float cutoff;            /* how far below its peak a support ends, in TRIP_CPU_EXP_UNIT */
    float early_termination; /* trip_cpu_saturation() */
    float thin;              /* the largest optical depth, stretch aside, of thin splats */
    int panes_across;
    double along_x[4], along_y[4], along_z[4]; /* X, Y, z of a voxel: [u, v, sheet, constant] */
    double forward_length;                     /* most that z changes by over an index length */
    double eye[3], light[3];                   /* [u, v, sheet]; of a light that is at a place */
    double world[3][3];  /* index_to_world's columns for u, v, sheet, over voxel_world */
    double depth_unit;   /* by which z is to be multiplied to be that of layers */
    trip_splat parallel; /* the footprint of all, in parallel views */
    float behind;        /* splats at this depth or less do not show */
    float near;          /* in parallel views: splats of less depth are near */
    trip_cpu_effects effects;
    trip_tf_entry byte_rows[256]; /* of the table, where codes take a byte */
    trip_code_range shown; /* rows of trip_cpu_rows() with extinction, where these are known to
                              follow one another without a gap; else none */
} trip_cpu_view;

/* What a list's codes show as, by code as it is stored: those of one byte have a table of their
 * own, 4 KiB that stay in the nearest cache, where the whole one's rows lie a page apart. */
static inline const trip_tf_entry *trip_cpu_rows(const trip_cpu_view *view)
{
    return view->code_bytes == 1 ? view->byte_rows : view->table;
}

/* Whether near splats have G and the stretch in index spaces of their own: in perspective, with
 * uneven spacing, but where splats are summed, which have no room for it. As the two unit vectors
 * across c and the one along it are at right angles, the ray of a pixel has there
 *     |r|^2 = (a^2 + b^2 + along^2) sigma^2 / |c|^2
 * with a and b before the low-pass, which adds to each of their squares no more than that of
 * TRIP_LOW_PASS_PX pixels' angle times |r c / sigma|^2. Without EWA all splats are taken for near.
 */
static inline bool trip_cpu_own_rays(const trip_cpu_view *view)
{
    return view->coordinates && !view->splat.camera.ortho && !view->sums;
}

/* A square of 8 x 8 voxels of a run, as its block (block.h) has it. */
typedef struct trip_cpu_square {
    int u, v, sheet;     /* of its corner */
    uint64_t mask;       /* which voxels are there, by Morton number */
    uint32_t min, width; /* of its codes, as trip_square has them */
    /* Of the first voxel; normals are read only with shading. TRIP_CPU_READABLE bytes behind those
     * of the square may be read too. */
    const unsigned char *codes, *normals;
} trip_cpu_square;

#define TRIP_CPU_READABLE 64

/* For each byte of a mask, the places of its bits in a square, u + 8 v, a byte each, the lowest
 * bit's first. */
extern const uint64_t trip_cpu_positions[256];
/* And their numbers. */
extern const uint64_t trip_cpu_bits_set[256];

/* Voxels waiting to be projected: one entry a lane, from any runs. */
#define TRIP_CPU_STAGED 320
typedef struct trip_cpu_staged {
    int32_t u[TRIP_CPU_STAGED + 16], v[TRIP_CPU_STAGED + 16], sheet[TRIP_CPU_STAGED + 16];
    int32_t code[TRIP_CPU_STAGED + 16]; /* a row of trip_cpu_rows() */
    int32_t normal[TRIP_CPU_STAGED + 16];
} trip_cpu_staged;

/* The same voxels on their way to splats: what one loop of the projection leaves to the next. */
typedef struct trip_cpu_lanes {
    /* The centre is (x + whole_x, y + whole_y). */
    float x[TRIP_CPU_STAGED], y[TRIP_CPU_STAGED];
    float whole_x[TRIP_CPU_STAGED], whole_y[TRIP_CPU_STAGED];
    float z[TRIP_CPU_STAGED];
    float l11[TRIP_CPU_STAGED], l21[TRIP_CPU_STAGED], l22[TRIP_CPU_STAGED];
    float l1[TRIP_CPU_STAGED], l2[TRIP_CPU_STAGED];
    float depth[TRIP_CPU_STAGED]; /* the largest optical depth, edge and all, stretch aside */
    float first[TRIP_CPU_STAGED], last[TRIP_CPU_STAGED]; /* two uint16 each */
    float panes[TRIP_CPU_STAGED];                        /* uint32 */
    /* Bits of a vector's lanes: those that are kept, and those to project one by one. */
    uint32_t kept[TRIP_CPU_STAGED / 4], scalar[TRIP_CPU_STAGED / 4];
    bool broken; /* set for good when the numbers of some splat are not finite */
} trip_cpu_lanes;

/* The bound of trip_weight_may_reach() for splats of a list, in the grid of level 0. */
typedef struct trip_cpu_reach {
    bool bounded;    /* else a ray's weight does not depend on it, and all are reached */
    bool inclusive;  /* the bound may be 0 */
    float h, across; /* and what a radius is multiplied by */
    float scale[3];  /* from the list's grid to that of level 0: u, v, sheet */
} trip_cpu_reach;

/* Splats that are sorted by stamps of a pane together, and bands of 64 stamps at most. */
#define TRIP_CPU_LOCAL 256
#define TRIP_CPU_BANDS 4

/* Stamps of a pane at most; floats of a pane's open sheet (sum_tmpl.h), of so many channels. */
#define TRIP_CPU_STAMPS_MAX 256
#define TRIP_CPU_SHEET_FLOATS(channels)                                                            \
    ((channels)*TRIP_CPU_PANE_PIXELS + 2 * (size_t)TRIP_CPU_STAMPS_MAX)

/* What a stamp's open sheet is where none is. */
#define TRIP_CPU_NO_SHEET UINT64_MAX

/* What one thread needs while it blends a pane. */
typedef struct trip_cpu_scratch {
    _Alignas(64) float early_termination[16];          /* of the view, in every lane */
    _Alignas(64) float rays[2 * TRIP_CPU_PANE_PIXELS]; /* by stamp: G[V], stretch[V] */
    _Alignas(64) trip_cpu_splat local[TRIP_CPU_LOCAL];
    float local_depths[TRIP_CPU_LOCAL]; /* of layers with depth */
    /* By band and 64 splats: first each splat's stamps, then each stamp's splats. */
    uint64_t touched[TRIP_CPU_BANDS][TRIP_CPU_LOCAL / 64][64];
    uint64_t any[TRIP_CPU_BANDS];        /* stamps that some splat may touch */
    uint64_t open[TRIP_CPU_BANDS];       /* ours with a pixel that is not saturated */
    uint64_t rays_known[TRIP_CPU_BANDS]; /* those whose `rays` are filled in */
    uint64_t thick[TRIP_CPU_LOCAL / 64]; /* which splats are not thin */
    uint32_t splats;
    int x, y;             /* of the pane's first pixel */
    float *pixels, *sums; /* of the pane; sums of its open sheet, where those are wanted */
    void (*blend)(struct trip_cpu_scratch *s); /* local[], in order */
    const trip_cpu_view *view;                 /* of the splats gathered, or of the layer */
    trip_cpu_staged staged;
    trip_cpu_lanes lanes;
} trip_cpu_scratch;

/* What a pane holds when all lists are drawn. */
typedef enum trip_cpu_content {
    TRIP_CPU_NOTHING,
    TRIP_CPU_LAYER, /* of the only list with weight there, as blended */
    TRIP_CPU_SUM,   /* of several lists, as merged */
} trip_cpu_content;

struct trip_cpu_region;

typedef uint32_t trip_cpu_project_kernel(const trip_cpu_view *view, const _Atomic uint64_t *open,
                                         const trip_cpu_staged *staged, uint32_t count,
                                         trip_cpu_lanes *lanes, trip_cpu_splat *out, float *depths);

/* Composites the segments of a group of slices into a pane's pixels. Returns which of its texels
 * are open, as trip_cpu_mask has them. */
typedef uint64_t trip_cpu_sheet_kernel(const trip_cpu_sheet_view *view, const trip_cpu_group *group,
                                       int x, int y, float *pixels);

/* Kernels are compiled for layers of colour alone and once more for layers with depth. Arguments
 * named `depths` are one float a splat, and nothing without depth. */
typedef struct trip_cpu_kernels {
    const char *isa;
    unsigned lanes, channels;
    const struct trip_cpu_kernels *with_depth; /* the same for layers with depth */

    /* Which squares of a region may be visible, by trip_cpu_mask's words: in Morton order, a bit
     * each, the first lowest. */
    uint64_t (*squares)(const trip_cpu_view *view, const struct trip_cpu_region *region,
                        const _Atomic uint64_t *open, trip_cpu_lanes *lanes);

    /* Adds the voxels of a square, of which there are some, to `staged` in draw order, leaving out
     * transparent ones; there is room for 64. Returns the new fill. */
    uint32_t (*stage)(const trip_cpu_view *view, const trip_cpu_square *square, bool reversed,
                      trip_cpu_staged *staged, uint32_t filled);
    /* Projects the first `count` staged voxels; those with pixels in the image become splats, in
     * order. With `open`, a word a pane as in trip_cpu_mask, those over saturated texels alone may
     * be left out; NULL: none are. `out` and `depths` have room for count + 1. Returns how many.
     */
    trip_cpu_project_kernel *project, *project_effects; /* the latter of frames with effects */

    /* Empties a pane's pixels: transparent where the list has weight, saturated elsewhere; `alone`
     * says that its weight is 1 all over the pane. */
    void (*pane_clear)(const trip_cpu_view *view, int x, int y, bool alone, float *pixels);
    /* Takes up a pane for blending; `quarters` says which of its 16 x 16 quarters to draw. `sums`:
     * of its open sheet, where sheets are summed. */
    void (*pane_begin)(const trip_cpu_view *view, trip_cpu_scratch *s, int x, int y,
                       unsigned quarters, float *pixels, float *sums);
    /* Blends splats[order[i]] in order, or splats[i] where order is NULL, that were projected with
     * this view. */
    void (*pane_blend)(const trip_cpu_view *view, trip_cpu_scratch *s, const trip_cpu_splat *splats,
                       const float *depths, const uint16_t *order, uint32_t count);
    /* Ends with every splat in the pixels, or in the open sheet. Returns which texels of the
     * quarters are open, as trip_cpu_mask has them. */
    uint64_t (*pane_end)(trip_cpu_scratch *s);
    /* Empties a pane's open sheet. */
    void (*sheet_clear)(float *sums);
    /* The pane's pixels with its open sheet composited, to `out`; both stay as they are. */
    void (*sheet_composite)(const trip_cpu_view *view, const float *pixels, const float *sums,
                            float *out);
    /* sum += w^2 layer, or sum = w^2 layer when it is the first. */
    void (*pane_merge)(const trip_cpu_view *view, int x, int y, const float *pixels, bool first,
                       float *sum);
    /* The finished picture of a pane into an image, from what the lists came to there; `depth` is
     * one float a pixel of the image, and nothing without depth. */
    void (*pane_finish)(const trip_cpu_view *view, int x, int y, trip_cpu_content content,
                        const float *pixels, float *rgba, float *depth);

    /* Which of the staged voxels are seen and have a support that rays with weight in the list may
     * reach: lanes->kept; and which are for trip_cpu_project_scalar() to decide: lanes->scalar. */
    void (*reaching)(const trip_cpu_view *view, const trip_cpu_reach *reach,
                     const trip_cpu_staged *staged, uint32_t count, trip_cpu_lanes *lanes);
    /* How many of so many splats that project() made have a pixel centre of the image in their
     * support where the list has weight. Uses `s` for itself. */
    uint32_t (*drawn)(const trip_cpu_view *view, trip_cpu_scratch *s, const trip_cpu_splat *splats,
                      uint32_t count);

    /* Of some of a raster's squares: what their cells lie between. The others have no cells. */
    void (*sheet_ranges)(const trip_cpu_voxels *raster, uint64_t squares,
                         trip_cpu_square_ranges *out);
    /* Which cells of the squares lie between two sheets on some code from `least` to `most`
     * (biased): none that lacks corners at both sheets, and none of other squares. */
    void (*sheet_cells)(const trip_cpu_voxels *from, const trip_cpu_voxels *to, uint64_t squares,
                        int16_t min, int16_t max, trip_cpu_cells *out);
    /* Gradients of the squares' voxels that are there. Beside the raster lie those to the left of
     * it and above, of the same sheet, and those of the sheets before and behind in index order.
     * Codes alone are read. */
    void (*sheet_gradients)(trip_cpu_voxels *raster, uint64_t squares, const trip_cpu_voxels *left,
                            const trip_cpu_voxels *above, const trip_cpu_voxels *sheet_before,
                            const trip_cpu_voxels *sheet_behind);
    /* The squares' voxels between two rasters, with gradients of those that are there or without;
     * `weights` is w << 16 | 2^14 - w, w that of `to`. A voxel is missing where either is. */
    void (*sheet_between)(const trip_cpu_voxels *from, const trip_cpu_voxels *to, uint64_t squares,
                          int32_t weights, bool gradients, trip_cpu_voxels *out);
    /* The latter where segments have a closed form (closed_form.h), and of frames with effects. */
    trip_cpu_sheet_kernel *sheet_pane, *sheet_pane_closed, *sheet_pane_effects;
} trip_cpu_kernels;

#endif
