/* How the commands use libtriptych: messages go where the program's own do, progress to a line on
 * the terminal. Also what the notes of a data set say. Main thread only. */
#ifndef TRIP_CLI_LIBRARY_H
#define TRIP_CLI_LIBRARY_H

#include "progress.h"
#include "triptych.h"
#include "triptych_brick.h"

/* `progress`, which may be NULL, outlives the context. 0, or a reported failure. */
int library_create(triptych **out, trip_progress *progress);

/* Data sets that are drawn with the one that is open, and that of its heat, NULL: none. */
int library_add(triptych *t, const char *const *paths, int count, const char *heat);
/* Fails where `heat` is no data set of heat, NULL: it is none. Closes what is open. */
int library_check_heat(triptych *t, const char *heat, const triptych_resources *resources);

/* The function without its warnings; failures are reported. */
int library_set_function_quietly(triptych *t, const triptych_transfer_function *function);

/* A text among the notes of the data set that is open, for free(); NULL where there is none. */
char *library_note(triptych *t, const char *key);

#endif
