/* The panel of controls, the overlays of the picture, messages and the list of keys, drawn by Dear
 * ImGui and OpenGL. Only the window's thread may call these functions, with its GL context current.
 */
#ifndef TRIP_VIEW_PANEL_H
#define TRIP_VIEW_PANEL_H

#include "viewer.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct trip_panel trip_panel;

/* Multiplies the size of texts and controls by `scale`. Returns 0, or a reported failure. */
int trip_panel_create(trip_panel **out, double scale);
void trip_panel_destroy(trip_panel *p);

/* Passes on pointer, button, wheel, key and text events. */
void trip_panel_event(trip_panel *p, const trip_event *e);
/* Return whether the panel, not the picture, takes pointer or key events. */
bool trip_panel_has_pointer(const trip_panel *p);
bool trip_panel_has_keys(const trip_panel *p);

/* Draws the panel over the window's contents, `seconds` after the last frame. */
void trip_panel_draw(trip_panel *p, trip_viewer *v, double seconds);

/* Sets `box` to the left, top, right and bottom of the control with this label. Returns false if
 * there is none. The next frames scroll a hidden control into view. */
bool trip_panel_find(trip_panel *p, const char *label, double box[4]);

enum { TRIP_PANEL_LABELS = 256 };
/* Writes the labels of the controls of the last picture, and returns their number. The labels stay
 * valid until the next picture. */
int trip_panel_labels(const trip_panel *p, const char *labels[TRIP_PANEL_LABELS]);

#ifdef __cplusplus
}
#endif

#endif
