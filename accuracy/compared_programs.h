/* Another program that draws the same views, in a process of its own: VTK's ray caster by
 * accuracy/vtk_worker.py, whose first lines describe what is written to it and read from it. One
 * thread. */
#ifndef TRIP_ACCURACY_COMPARED_PROGRAMS_H
#define TRIP_ACCURACY_COMPARED_PROGRAMS_H

#include <stdio.h>

#include "accuracy_options.h"
#include "triptych.h"
#include "views.h"

enum { ACCURACY_COMPARED_PROGRAMS_TEXT = 128 };

typedef struct accuracy_program {
    const char *command; /* the caller's */
    int process, socket;
    char name[ACCURACY_COMPARED_PROGRAMS_TEXT],
        about[ACCURACY_COMPARED_PROGRAMS_TEXT]; /* as it says */
    char *line;                                 /* last read */
    size_t line_bytes;
    FILE *answers;
} accuracy_program;

/* Starts its command by sh and describes the volume to it: the options' source, in the world of the
 * data set that `t` has open, and its function. Where that cannot be, TRIP_ERROR with `why` set and
 * nothing reported, as in what follows. accuracy_program_end() follows in any case. */
int accuracy_program_start(accuracy_program *b, const accuracy_options *o, triptych *t,
                           char why[256]);
/* Draws a view; *ms is what the program says that it took. */
int accuracy_program_draw(accuracy_program *b, const accuracy_view *view, double *ms,
                          char why[256]);
/* The same, and gives its picture, premultiplied; by way of a file in `folder`, which is removed.
 */
int accuracy_program_picture(accuracy_program *b, const accuracy_view *view, const char *folder,
                             float *rgba, double *ms, char why[256]);
void accuracy_program_end(accuracy_program *b);

#endif
