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

/* A line for each table. */
#define BENCH_TABLES                                                                               \
    "  renderers  speed of each renderer, in views around the object\n"                            \
    "  stream     reading and drawing from disk, beside the speed of the disk\n"                   \
    "  flight     frame times of the viewer in a flight through the object\n"                      \
    "  levels     error of each coarse level; cost of finer and finer volumes\n"                   \
    "  popping    jumps of pixels while the list of highest weight changes\n"                      \
    "  ewa        error and time of the affine EWA footprints\n"                                   \
    "  orders     ordering methods of Hofsetz & Max 2005, Tables 1 and 2\n"                        \
    "  submit     forms of submission of Hofsetz, Max & Bastos 2008, Table 3\n"                    \
    "  variants   changes of the picture by the shortcuts of the papers\n"

/* 0, or TRIP_USAGE once reported; --help prints and exits. */
int bench_options_parse(bench_options *o, int argc, char **argv);

#endif
