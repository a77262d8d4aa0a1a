/* Wraps libtriptych for the commands. Messages go to the program's own log, and progress to a line
 * on the terminal. Main thread only. */
#ifndef TRIP_CLI_LIBRARY_H
#define TRIP_CLI_LIBRARY_H

#include <stdbool.h>

#include "draw_settings.h"
#include "progress.h"
#include "triptych_brick.h"

/* Creates a context. `progress` may be NULL and must outlive the context. Returns 0 or a reported
 * failure. */
int library_create(triptych **out, trip_progress *progress);

/* Adds data sets to the one that is open, and the data set of heat unless `heat` is NULL. */
int library_add(triptych *t, const char *const *paths, int count, const char *heat);
/* Fails if `heat` is neither NULL nor a usable data set of heat. Closes the open data set. */
int library_check_heat(triptych *t, const char *heat, const triptych_resources *resources);

/* Fails if an option does not apply to the input: a Gaussian scene or a volume. */
int library_check_kind(triptych *t, const char *input, const draw_settings *settings,
                       const triptych_resources *resources,
                       const triptych_transfer_function *function);
/* Fails: an option does not apply to Gaussian scenes. */
int library_fail_scene_option(const char *name);
/* Fails: an option does not apply to a scene file, or to inputs with places. */
int library_fail_objects_option(const char *name);
/* Fails if options for reading a volume were given for a Gaussian scene. */
int library_check_scene_options(const triptych_brick_options *options);
/* Fails if options that a cloud of points does not have were given for one. */
int library_check_cloud_options(const triptych_brick_options *options);
/* Fails if options for reading were given that do not apply to a file, by the result of
 * triptych_is_gaussians(). */
int library_check_file_options(const triptych_brick_options *options, int kind);
/* Whether an input is a Gaussian scene, or a scene file. */
bool library_is_scene(triptych *t, const char *input);
/* Fails: a command that needs volumes got such an input. */
int library_fail_scene(const char *input);

/* Switches the messages of the context off or on. */
void library_hush(triptych *t, bool quiet);
/* Sets the transfer function without printing warnings. Reports failures. */
int library_set_function_quietly(triptych *t, const triptych_transfer_function *function);

/* Looks at a volume's values without printing notes. A failure is printed and leaves a share of 0.
 */
void library_sample_values(triptych *t, const char *volume, const triptych_brick_options *options,
                           triptych_values *v);

/* Returns a string from the notes of the open data set; the caller frees it. Returns NULL if there
 * is none. */
char *library_note(triptych *t, const char *key);

#endif
