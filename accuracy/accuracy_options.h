/* Parses and checks the command line of `triptych accuracy`, and fills in the defaults. Main thread
 * only. */
#ifndef TRIP_ACCURACY_OPTIONS_H
#define TRIP_ACCURACY_OPTIONS_H

#include <stdbool.h>
#include <stdint.h>

enum { ACCURACY_DATA_MAX = 8, ACCURACY_COMPARED_PROGRAMS_MAX = 4 };

typedef struct accuracy_options {
    const char *data[ACCURACY_DATA_MAX]; /* [0]: the data set with all settings; the others are
                                            stored differently */
    int data_count;
    const char *
        program[ACCURACY_COMPARED_PROGRAMS_MAX]; /* commands of programs that draw the same views */
    int program_count;
    int no_programs; /* leaves out VTK, which is measured by default if it is installed */
    const char *output;
    const char *source;   /* volume that the data set was made of, or NULL */
    const char *tf;       /* NULL selects the transfer function in the data set */
    const char *settings; /* patterns joined by commas */
    bool usual;           /* --settings was not given */
    int width, height, views, repeat;
    double tolerance, budget_seconds;
    bool tolerance_given;
    bool shading;
    int no_shading, steps, force, list, pictures;
    unsigned threads; /* 0 selects one per processor */
    uint64_t memory_bytes;
} accuracy_options;

/* Returns 0, or TRIP_USAGE after reporting an error. --help prints the help and exits. */
int accuracy_options_parse(accuracy_options *o, int argc, char **argv);

#endif
