/* A transfer function being edited: its points in data units, and the steps to undo.
 * common/transfer_function.h defines the curve between the points. One thread at a time may use an
 * editor. */
#ifndef TRIP_VIEW_FUNCTION_EDITOR_H
#define TRIP_VIEW_FUNCTION_EDITOR_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "transfer_function.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct trip_tf_editor trip_tf_editor;

enum { TRIP_TF_EDITOR_STEPS = 256 }; /* maximum number of steps to undo */

/* Creates an editor with one transparent point at value 0. Returns NULL if memory is exhausted. */
trip_tf_editor *trip_tf_editor_create(void);
void trip_tf_editor_destroy(trip_tf_editor *e);

/* Loads a transfer function from `.tf` text in data units, as triptych_convert() writes it. `name`
 * appears in messages. A reported failure changes nothing. */
int trip_tf_editor_set_text(trip_tf_editor *e, const char *name, const char *text);
/* Returns the transfer function as `.tf` text, for free(), or NULL if memory is exhausted. */
char *trip_tf_editor_text(const trip_tf_editor *e);
/* Writes that text to a file and replaces an existing one. Returns 0, or a reported failure. */
int trip_tf_editor_save(const trip_tf_editor *e, const char *path);

/* Returns the points by ascending value, valid until the next change. */
const trip_tf_point *trip_tf_editor_points(const trip_tf_editor *e, size_t *count);
trip_rgba trip_tf_editor_evaluate(const trip_tf_editor *e, double value);
/* Returns a number that ascends with every change, including undo and redo. */
uint64_t trip_tf_editor_revision(const trip_tf_editor *e);

/* Returns the point nearest to (value, opacity), or -1 if its distance exceeds 1. Distances are in
 * units of the two reaches. */
int trip_tf_editor_find(const trip_tf_editor *e, double value, double opacity, double value_reach,
                        double opacity_reach);

/* Each change below is one step to undo. All changes between begin and end are one step together.
 * Opacities and colours are clamped to 0..1. */
void trip_tf_editor_begin(trip_tf_editor *e);
void trip_tf_editor_end(trip_tf_editor *e);
/* Adds a point with the transfer function's colour at `value`. Returns its number, or -1 if the
 * value is not finite or there are 65536 points. */
int trip_tf_editor_add(trip_tf_editor *e, double value, double opacity);
/* Moves a point, at most up to its neighbours. */
void trip_tf_editor_move(trip_tf_editor *e, int point, double value, double opacity);
void trip_tf_editor_set_colour(trip_tf_editor *e, int point, double r, double g, double b);
/* Removes a point, except the only one. */
void trip_tf_editor_remove(trip_tf_editor *e, int point);
/* Maps all values to centre + (value - from) * factor, with factor > 0. */
void trip_tf_editor_stretch(trip_tf_editor *e, double from, double factor, double centre);

bool trip_tf_editor_can_undo(const trip_tf_editor *e);
bool trip_tf_editor_can_redo(const trip_tf_editor *e);
void trip_tf_editor_undo(trip_tf_editor *e);
void trip_tf_editor_redo(trip_tf_editor *e);

#ifdef __cplusplus
}
#endif

#endif
