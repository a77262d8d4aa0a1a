/* The command line of `triptych bench`, checked, the table's defaults filled in. */
#ifndef TRIP_BENCH_OPTIONS_H
#define TRIP_BENCH_OPTIONS_H

#include "bench_progress.h"
#include "reader.h"
#include "renderer_choice.h"
#include "settings.h"

enum { BENCH_LIST_MAX = 16 };

typedef struct bench_options {
    const char *table; /* always one of bench_tables[] */
    const char *input; /* NULL: the included volume */
    bool in_short;     /* no table was named: one that takes less than a minute */
    const char *tf;    /* file or preset; NULL: the function kept in the data set */
    int sizes[BENCH_LIST_MAX][2], size_count;
    trip_renderer_kind renderers[BENCH_LIST_MAX];
    int renderer_count;
    int threads[BENCH_LIST_MAX], thread_count; /* 0: one a processor */
    int repeat, views;
    const char *field;        /* what is sampled finer and finer, a name of trip_fields */
    int finest;               /* up to so many voxels along each axis */
    const char *plot;         /* an SVG of it is written here; NULL: none */
    double seconds;           /* that a flight takes */
    double frames_per_second; /* of it, wanted */
    trip_settings settings;
    trip_engine engine;
    uint64_t memory_bytes; /* 0: the default */
    bool draw_occluded;    /* bricks behind what is opaque */
    bool no_counts;        /* times only */
    bool json;
    bench_progress *progress; /* no option: where it is shown how far the table is; may be NULL */
} bench_options;

/* The tables there are, a line each. */
#define BENCH_TABLES                                                                               \
    "  orders     the list methods of Hofsetz & Max 2005, Tables 1 and 2\n"                        \
    "  submit     the forms of submission of Hofsetz, Max & Bastos 2008, Table 3\n"                \
    "  stream     reading and drawing against the disk's bandwidth\n"                              \
    "  renderers  the renderers there are, over views round the object\n"                          \
    "  popping    how much pixels jump where the axis of most weight changes\n"                    \
    "  levels     how far coarse levels are from the finest; what an object sampled finer takes\n" \
    "  flight     the viewer's drawing while the eye turns, approaches and flies through\n"        \
    "  ewa        how far EWA's affine approximation is from the exact form, and its time\n"       \
    "  variants   what the papers' fixed sprites, weights of vertices and others change\n"

/* 0, or TRIP_USAGE once reported; --help prints and exits. */
int bench_options_parse(bench_options *o, int argc, char **argv);

#endif
