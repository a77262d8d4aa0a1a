/* What lies over and beside the picture: the panel of controls, marks for orientation, messages and
 * the list of keys, by Dear ImGui, which draws by OpenGL. On the window's thread, with its GL
 * context current. */
#ifndef TRIP_VIEW_PANEL_H
#define TRIP_VIEW_PANEL_H

#include "viewer.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct trip_panel trip_panel;

/* Texts and controls are `scale` times as large. 0, or a reported failure. */
int trip_panel_create(trip_panel **out, double scale);
void trip_panel_destroy(trip_panel *p);

/* Pointer, buttons, wheel, keys and text. */
void trip_panel_event(trip_panel *p, const trip_event *e);
/* Whether such input is the panel's, and not for the picture. */
bool trip_panel_has_pointer(const trip_panel *p);
bool trip_panel_has_keys(const trip_panel *p);

/* A frame of it, over what the window shows; `seconds` after the last one. */
void trip_panel_draw(trip_panel *p, trip_viewer *v, double seconds);

/* Where the control of this label lies: left, top, right, bottom. False where there is none; one
 * that is out of sight is moved into it by the next frames. */
bool trip_panel_find(trip_panel *p, const char *label, double box[4]);

#ifdef __cplusplus
}
#endif

#endif
