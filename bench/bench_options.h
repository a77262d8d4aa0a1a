/* Parses and checks the command line of `triptych bench`, and fills in the defaults of the table.
 * Main thread only. */
#ifndef TRIP_BENCH_OPTIONS_H
#define TRIP_BENCH_OPTIONS_H

#include "progress_line.h"
#include "reader.h"
#include "renderer_choice.h"
#include "settings.h"

enum { BENCH_LIST_MAX = 16 };
enum { BENCH_CLASSIFY_AUTO, BENCH_CLASSIFY_PRE, BENCH_CLASSIFY_POST };

typedef struct bench_options {
    const char *table; /* a name of tables[] in bench.c */
    const char *input; /* NULL selects the included volume */
    bool in_short;     /* no table was named; run a table in less than a minute */
    const char *tf;    /* file or preset; NULL selects the transfer function in the data set */
    int sizes[BENCH_LIST_MAX][2], size_count;
    trip_renderer_kind renderers[BENCH_LIST_MAX];
    int renderer_count;
    int threads[BENCH_LIST_MAX], thread_count; /* 0 selects one per processor */
    int repeat, views;
    const char *field;        /* object for levels without a data set, a name of trip_fields */
    int finest;               /* maximum voxels along each axis */
    const char *plot;         /* path of an SVG file for the table, or NULL */
    double seconds;           /* length of a flight */
    double frames_per_second; /* target of a flight */
    int classify;             /* BENCH_CLASSIFY_... */
    bool usual;  /* no option changes the drawing: renderers measures the default too */
    bool chosen; /* --renderer was given */
    trip_settings settings;
    trip_engine engine;
    uint64_t memory_bytes; /* 0 selects the default */
    int draw_occluded;     /* whether bricks behind opaque ones are drawn */
    int no_counts;         /* measures only times */
    int json;
    measure_progress *progress; /* shows the progress of the table; not an option; may be NULL */
} bench_options;

/* One line for each table. */
#define BENCH_TABLES                                                                               \
    "  renderers  speed of each renderer, in views around the object\n"                            \
    "  stream     reading and drawing from disk, beside the speed of the disk\n"                   \
    "  flight     frame times of the viewer in a flight through the object\n"                      \
    "  levels     error of each coarse level; cost of finer and finer volumes\n"                   \
    "  popping    jumps of pixels while the list of highest weight changes\n"                      \
    "  ewa        error and time of the affine EWA footprints\n"                                   \
    "  orders     ordering methods of Hofsetz & Max 2005, Tables 1 and 2; the orders\n"            \
    "             of a Gaussian scene, and lists beside a sort in each frame\n"                    \
    "  surfels    selection of visible surfels of Guennebaud et al. 2004, Tables 1, 2\n"           \
    "  submit     forms of submission of Hofsetz, Max & Bastos 2008, Tables 3, 4\n"                \
    "  variants   changes of the picture by the shortcuts of the papers\n"

/* Sets the classification that `render` chooses by itself, unless --classify was given.
 * `needs_splats` tells whether the data set can only be drawn as splats. */
void bench_options_choose(bench_options *o, bool needs_splats);
/* Writes the options of `triptych render` that draw like the table. A table may vary some of them
 * from row to row, and leave out the size and the renderer here. */
void bench_options_write(const bench_options *o, char *text, size_t bytes);
/* Returns 0, or TRIP_USAGE after reporting an error. --help prints the help and exits. */
int bench_options_parse(bench_options *o, int argc, char **argv);

#endif
