/* The command line of `triptych accuracy`, checked, defaults filled in. */
#ifndef TRIP_ACCURACY_OPTIONS_H
#define TRIP_ACCURACY_OPTIONS_H

#include <stdbool.h>
#include <stdint.h>

enum { ACCURACY_DATA_MAX = 8, ACCURACY_COMPARED_PROGRAMS_MAX = 4 };

typedef struct accuracy_options {
    const char *data[ACCURACY_DATA_MAX]; /* the first is swept, the others kept otherwise */
    int data_count;
    const char *
        program[ACCURACY_COMPARED_PROGRAMS_MAX]; /* commands of programs that draw the same views */
    int program_count;
    bool no_programs; /* nor VTK, which stands there of itself where it is installed */
    const char *output;
    const char *source;   /* the volume that the data were made of; NULL: not known */
    const char *tf;       /* NULL: the function kept in the data set */
    const char *settings; /* patterns joined by commas; NULL: all */
    int width, height, views, repeat, samples;
    double tolerance, budget_seconds;
    bool shading, ladder, force, quiet, list, pictures;
    unsigned threads; /* 0: one a processor */
    uint64_t memory_bytes;
} accuracy_options;

/* 0, or TRIP_USAGE once reported; --help prints and exits. */
int accuracy_options_parse(accuracy_options *o, int argc, char **argv);

#endif
