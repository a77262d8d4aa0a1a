/* A transfer function that comes through a pipe, as from a shell's <(command): a pipe can be read
 * only once, and drawing a volume loads the function when it is bricked and when it is drawn. */
#ifndef TRIP_CLI_PIPED_TF_H
#define TRIP_CLI_PIPED_TF_H

#include "triptych.h"

/* Zeroed at first. */
typedef struct piped_tf {
    char path[32]; /* of its copy in memory; "": there is none */
    int fd;
} piped_tf;

/* Where *name is a pipe, reads it and makes *name the path of a copy, which holds until release.
 * Other names, and NULL, stay as they are. 0, or a reported failure. */
int piped_tf_keep(piped_tf *p, triptych *t, const char **name);
void piped_tf_release(piped_tf *p);

#endif
