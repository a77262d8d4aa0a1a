/* Copies a transfer function that comes through a pipe, for example from a shell's <(command). A
 * pipe can be read only once, but bricking and drawing both load the transfer function. Main thread
 * only. */
#ifndef TRIP_CLI_PIPED_TF_H
#define TRIP_CLI_PIPED_TF_H

#include "triptych.h"

/* Zeroed before its first use. */
typedef struct piped_tf {
    char path[32]; /* of the copy in memory; "" if there is none */
    int fd;
} piped_tf;

/* If *name is a pipe, reads it and sets *name to the path of a copy, valid until release. Other
 * names and NULL stay. Returns 0 or a reported failure. */
int piped_tf_keep(piped_tf *p, triptych *t, const char **name);
void piped_tf_release(piped_tf *p);

#endif
