/* A transfer function while it is edited: its points in data units, and what undoes each change.
 * The curve between them is that of common/transfer_function.h. One thread. */
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

enum { TRIP_TF_EDITOR_STEPS = 256 }; /* that can be undone */

/* With one transparent point at 0. NULL without memory. */
trip_tf_editor *trip_tf_editor_create(void);
void trip_tf_editor_destroy(trip_tf_editor *e);

/* Takes a function as `.tf` text in data units, as triptych_convert() gives it of any preset, file
 * or data set; `name` is for messages. A reported failure changes nothing. */
int trip_tf_editor_set_text(trip_tf_editor *e, const char *name, const char *text);
/* The function as that text, for triptych_transfer_function.text; for free(). NULL without memory.
 */
char *trip_tf_editor_text(const trip_tf_editor *e);
/* Writes that text to a file, in place of one that is there. 0, or a reported failure. */
int trip_tf_editor_save(const trip_tf_editor *e, const char *path);

/* By ascending value; until the next change. */
const trip_tf_point *trip_tf_editor_points(const trip_tf_editor *e, size_t *count);
trip_rgba trip_tf_editor_evaluate(const trip_tf_editor *e, double value);
/* Grows with every change, undone ones too. */
uint64_t trip_tf_editor_revision(const trip_tf_editor *e);

/* The point nearest to (value, opacity) with distances in units of the two reaches, if that is at
 * most 1; else -1. */
int trip_tf_editor_find(const trip_tf_editor *e, double value, double opacity, double value_reach,
                        double opacity_reach);

/* Each of these is one step to undo, but for those between begin and end, which are one together.
 * Opacities and colours are clamped to 0 to 1. */
void trip_tf_editor_begin(trip_tf_editor *e);
void trip_tf_editor_end(trip_tf_editor *e);
/* A point there, of the colour that the function has at the value; returns its number, -1 where the
 * value is not finite or there are 65536. */
int trip_tf_editor_add(trip_tf_editor *e, double value, double opacity);
/* Not beyond the neighbouring points. */
void trip_tf_editor_move(trip_tf_editor *e, int point, double value, double opacity);
void trip_tf_editor_set_colour(trip_tf_editor *e, int point, double r, double g, double b);
/* Never the last one. */
void trip_tf_editor_remove(trip_tf_editor *e, int point);
/* All values become centre + (value - from) * factor, factor > 0: shifted and stretched. */
void trip_tf_editor_stretch(trip_tf_editor *e, double from, double factor, double centre);

bool trip_tf_editor_can_undo(const trip_tf_editor *e);
bool trip_tf_editor_can_redo(const trip_tf_editor *e);
void trip_tf_editor_undo(trip_tf_editor *e);
void trip_tf_editor_redo(trip_tf_editor *e);

#ifdef __cplusplus
}
#endif

#endif
