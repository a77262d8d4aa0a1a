/* State that the parts of the CPU renderer share: cpu_renderer.c (frames and layers), cpu_batch.c
 * (from a batch to splats), panes.c (from splats to pixels) and count.c. Only the renderer's thread
 * writes it, with three exceptions: a worker writes its own memory, the chunks that it fills and
 * the panes that it draws. */
#ifndef TRIP_CPU_STATE_H
#define TRIP_CPU_STATE_H

#include "cpu/kernels/isa.h"
#include "cpu/pool.h"
#include "cpu/splat_buffer.h"
#include "cpu/squares.h"

/* Bits of trip_cpu.states. */
enum trip_cpu_pane_state {
    TRIP_CPU_PANE_BEGUN = 1,  /* pixels hold the current layer */
    TRIP_CPU_PANE_MERGED = 2, /* the pane's sum holds earlier layers */
};

/* Memory of one thread. */
typedef struct trip_cpu_worker {
    trip_cpu_scratch scratch;
    trip_cpu_part parts[TRIP_CPU_CHUNK_RUNS]; /* parts of the current chunk */
    /* Copies of a square's bytes, for squares with unreadable bytes behind them or with undrawn
     * voxels. */
    unsigned char codes[2 * 64 + TRIP_CPU_READABLE];
    unsigned char normals[4 * 64 + TRIP_CPU_READABLE];
    trip_cpu_sorting sorting;
    /* Pixels of a pane for a picture, if the frame still needs its own pixels. */
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

typedef struct trip_cpu_sheets trip_cpu_sheets;

enum { TRIP_CPU_DEVICE = 64 };

typedef struct trip_cpu {
    trip_renderer base;
    trip_budget *budget;
    const trip_cpu_kernels *isa;      /* the chosen instruction set */
    const trip_cpu_kernels *kernels;  /* kernels of the frame, with depth if needed */
    trip_cpu_project_kernel *project; /* one of `kernels`, with or without effects */
    trip_cpu_pool *pool;
    bool draws_plain; /* the frame uses the plain kernels instead of `isa` */
    char device[TRIP_CPU_DEVICE], plain_device[TRIP_CPU_DEVICE];
    trip_cpu_worker *workers;
    size_t workers_bytes;

    trip_cpu_mask mask; /* the thread that blends a pane clears its bits */
    size_t panes_bytes; /* memory of the mask and the fields up to `portions` */
    unsigned channels;  /* channels per pixel in `pixels` and `sums` */
    float *pixels, *sums;
    float *open_sheets; /* one per pane; NULL if splats are not summed */
    bool has_open_sheets;
    uint8_t *states;
    uint8_t *layers; /* layers that may have weight in a pane, as trip_cpu_layer_bit() */
    trip_cpu_portion *portions;

    const trip_frame *frame;
    trip_cpu_view view;     /* of the current layer */
    trip_cpu_view *views;   /* of the layer's lists, indexed by trip_list.index */
    unsigned list_room;     /* length of `views`, `counted_views` and `stats` */
    bool in_layer;          /* a layer of view.axis and view.way is being drawn */
    trip_list_stats *stats; /* indexed by trip_list.index */
    /* For frames with `count` set: the frame and views with every code visible. */
    trip_frame counted_frame;
    trip_cpu_view *counted_views;
    trip_tf_entry *visible; /* 65536 entries; NULL until the first frame that counts */

    trip_cpu_buffer buffers[2];
    trip_cpu_buffer *filling, *blending;
    const trip_batch *batch;
    uint32_t first_chunk;     /* first chunk of project_job */
    double visible_per_voxel; /* running average */
    uint32_t portion_count;
    float *rgba, *depth;

    trip_cpu_sheets *sheets; /* NULL until the first frame with --classify post */
    /* The frame for `sheets`. Its kernel radius is the reach of a voxel's interpolation. */
    trip_frame sheet_frame;
    trip_settings sheet_settings;
    trip_cpu_job project_job, blend_job, pane_job;
} trip_cpu;

/* Returns the --memory value, in MiB, at which `bytes` more bytes fit the budget. A quarter of the
 * added memory goes to the reader. */
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
    return (int)(pane / r->mask.grid.across + r->mask.grid.first) * TRIP_CPU_PANE;
}

static inline size_t trip_cpu_pane_floats(const trip_cpu *r)
{
    return r->channels * TRIP_CPU_PANE_PIXELS;
}

static inline float *trip_cpu_pane_pixels(const trip_cpu *r, uint32_t pane)
{
    return r->pixels + pane * trip_cpu_pane_floats(r);
}

/* Returns the pane's open sheet, or NULL if splats are not summed. */
static inline float *trip_cpu_pane_sheet(const trip_cpu *r, uint32_t pane)
{
    return r->open_sheets ? r->open_sheets + pane * TRIP_CPU_SHEET_FLOATS(r->channels) : NULL;
}

/* Returns the bit of a layer. If a ray belongs only to the pass of its own direction
 * (trip_plan_layer.parted), each direction has a layer of its own. */
static inline unsigned trip_cpu_layer_bit(int axis, trip_way way)
{
    return 1u << (way == TRIP_WAY_DOWN ? 3 + axis : axis);
}

/* Returns whether only one layer has weight in a pane. Its weight is then 1 at every pixel. */
static inline bool trip_cpu_is_alone(const trip_cpu *r, uint32_t pane)
{
    return (r->layers[pane] & (r->layers[pane] - 1)) == 0;
}

#endif
