/* Runs another program that draws the same views, in a process of its own.
 * accuracy/vtk_worker.py is such a program, for VTK's ray caster. Its first lines describe the
 * protocol. One thread. */
#ifndef TRIP_ACCURACY_COMPARED_PROGRAMS_H
#define TRIP_ACCURACY_COMPARED_PROGRAMS_H

#include <stdio.h>

#include "accuracy_options.h"
#include "triptych.h"
#include "views.h"

enum { ACCURACY_COMPARED_PROGRAMS_TEXT = 128 };

typedef struct accuracy_program {
    const char *command; /* owned by the caller */
    int process, socket;
    char name[ACCURACY_COMPARED_PROGRAMS_TEXT],
        about[ACCURACY_COMPARED_PROGRAMS_TEXT]; /* from the program's first answer */
    char *line;                                 /* the last line received */
    size_t line_bytes;
    FILE *answers;
} accuracy_program;

/* Starts the command by sh. Sends it the source volume, its position in the world of the data set
 * that `t` has open, and the transfer function. On failure, all functions here return TRIP_ERROR
 * and set `why` without reporting anything. The caller calls accuracy_program_end() in any case. */
int accuracy_program_start(accuracy_program *b, const accuracy_options *o, triptych *t,
                           char why[256]);
/* Draws a view. *ms is the time that the program reports. */
int accuracy_program_draw(accuracy_program *b, const accuracy_view *view, double *ms,
                          char why[256]);
/* Draws a view and returns its picture, premultiplied. The picture comes through a file in
 * `folder`, which is removed. */
int accuracy_program_picture(accuracy_program *b, const accuracy_view *view, const char *folder,
                             float *rgba, double *ms, char why[256]);
void accuracy_program_end(accuracy_program *b);

#endif
