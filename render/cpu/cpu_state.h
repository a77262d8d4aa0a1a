/* What the parts of the CPU renderer share: cpu_renderer.c (frames and layers), batch.c (from a
 * batch to splats), panes.c (from splats to pixels) and count.c. Written by the renderer's thread
 * alone, but for each worker's memory, the chunks that it fills and the panes that it draws. */
#ifndef TRIP_CPU_STATE_H
#define TRIP_CPU_STATE_H

#include "cpu/kernels/isa.h"
#include "cpu/pool.h"
#include "cpu/splat_buffer.h"
#include "cpu/squares.h"

/* What has become of a pane's pixels. */
enum trip_cpu_pane_state {
    TRIP_CPU_PANE_BEGUN = 1,  /* in the layer being drawn */
    TRIP_CPU_PANE_MERGED = 2, /* the sum holds earlier layers */
};

/* One thread's own memory. */
typedef struct trip_cpu_worker {
    trip_cpu_scratch scratch;
    trip_cpu_part parts[TRIP_CPU_CHUNK_RUNS]; /* of the chunk at hand */
    /* A square's bytes, where those behind them may not be read. */
    unsigned char codes[2 * 64 + TRIP_CPU_READABLE];
    unsigned char normals[4 * 64 + TRIP_CPU_READABLE];
    trip_cpu_sorting sorting;
    /* Of a pane of a picture, where the frame goes on with its own. */
    _Alignas(64) float sum[TRIP_CHANNELS_MAX * TRIP_CPU_PANE_PIXELS];
    _Alignas(64) float layer[TRIP_CHANNELS_MAX * TRIP_CPU_PANE_PIXELS];
    _Alignas(64) trip_cpu_splat counted[TRIP_CPU_STAGED + 16];
} trip_cpu_worker;

/* A pane to blend, or a quarter of one. */
typedef struct trip_cpu_portion {
    uint32_t pane;
    unsigned quarters;
    uint32_t splats;
} trip_cpu_portion;

/* Of frames that classify after interpolation. */
typedef struct trip_cpu_sheets trip_cpu_sheets;

enum { TRIP_CPU_DEVICE = 64 };

typedef struct trip_cpu {
    trip_renderer base;
    trip_budget *budget;
    const trip_cpu_kernels *isa;      /* for layers of colour alone */
    const trip_cpu_kernels *kernels;  /* for the frame's layers */
    trip_cpu_project_kernel *project; /* of these, for its effects or without */
    trip_cpu_pool *pool;
    bool draws_plain; /* the frame, by plain kernels whatever `isa` is */
    char device[TRIP_CPU_DEVICE], plain_device[TRIP_CPU_DEVICE];
    trip_cpu_worker *workers;
    size_t workers_bytes;

    trip_cpu_mask mask; /* bits are cleared by the thread that blends the pane */
    size_t panes_bytes; /* of everything below and the mask, which grow with the image */
    unsigned channels;  /* that there is room for */
    float *pixels, *sums;
    float *open_sheets; /* of panes, where splats are summed; else NULL */
    bool has_open_sheets;
    uint8_t *states;
    uint8_t *layers; /* that may have weight in a pane, by trip_cpu_layer_bit() */
    trip_cpu_portion *portions;

    const trip_frame *frame;
    trip_cpu_view view;     /* of the layer being drawn */
    trip_cpu_view *views;   /* of its lists, by number in the data set */
    unsigned list_room;     /* of `views`, and of `counted_views` where that is there */
    bool in_layer;          /* of the view's axis, and of its way where the axis has two */
    trip_list_stats *stats; /* by number of the list, as many as `views` */
    /* Where the frame counts: the same with every voxel visible, whatever its code. */
    trip_frame counted_frame;
    trip_cpu_view *counted_views;
    trip_tf_entry *visible; /* 65536 entries; NULL until wanted */

    trip_cpu_buffer buffers[2];
    trip_cpu_buffer *filling, *blending;
    const trip_batch *batch;
    uint32_t first_chunk;     /* of the job */
    double visible_per_voxel; /* of late */
    uint32_t portion_count;
    float *rgba, *depth;

    trip_cpu_sheets *sheets; /* NULL until wanted */
    /* Of these frames: as the frame, with kernels that reach as far as voxels do in sheets. */
    trip_frame sheet_frame;
    trip_settings sheet_settings;
    trip_cpu_job project_job, blend_job, pane_job;
} trip_cpu;

/* What --memory has to be, in MiB, for so many bytes besides what is taken: a quarter of what is
 * added goes to what is read ahead. */
static inline unsigned long long trip_cpu_memory_mib(const trip_budget *budget, uint64_t bytes)
{
    uint64_t left = trip_budget_left_bytes(budget), more = bytes > left ? bytes - left : 0;
    return ((trip_budget_limit_bytes(budget) + more + more / 3) >> 20) + 1;
}

static inline uint32_t trip_cpu_pane_count(const trip_cpu *r)
{
    return r->mask.grid.across * r->mask.grid.down;
}

static inline int trip_cpu_pane_x(const trip_cpu *r, uint32_t pane)
{
    return (int)(pane % r->mask.grid.across) * TRIP_CPU_PANE;
}

static inline int trip_cpu_pane_y(const trip_cpu *r, uint32_t pane)
{
    return (int)(pane / r->mask.grid.across) * TRIP_CPU_PANE;
}

static inline size_t trip_cpu_pane_floats(const trip_cpu *r)
{
    return r->channels * TRIP_CPU_PANE_PIXELS;
}

static inline float *trip_cpu_pane_pixels(const trip_cpu *r, uint32_t pane)
{
    return r->pixels + pane * trip_cpu_pane_floats(r);
}

/* Its open sheet; NULL where splats are not summed. */
static inline float *trip_cpu_pane_sheet(const trip_cpu *r, uint32_t pane)
{
    return r->open_sheets ? r->open_sheets + pane * TRIP_CPU_SHEET_FLOATS(r->channels) : NULL;
}

/* Where a ray takes part in the pass of its own way alone (trip_plan_layer.parted), panes hold each
 * way's as a layer of its own. */
static inline unsigned trip_cpu_layer_bit(int axis, trip_way way)
{
    return 1u << (way == TRIP_WAY_DOWN ? 3 + axis : axis);
}

/* Whether one layer alone has weight in a pane, and so it is 1 all over. */
static inline bool trip_cpu_is_alone(const trip_cpu *r, uint32_t pane)
{
    return (r->layers[pane] & (r->layers[pane] - 1)) == 0;
}

#endif
