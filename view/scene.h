/* Controls of Gaussian scenes, for the window and the browser. The table of settings
 * (draw_settings.h) gives the choices, so that a new choice appears by itself. Pure functions. */
#ifndef TRIP_VIEW_SCENE_H
#define TRIP_VIEW_SCENE_H

#include <stddef.h>

#include "frames.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A setting with a few named values. */
typedef struct trip_scene_choice {
    int row;              /* of draw_settings_table */
    const char *label;    /* for people */
    const char *standard; /* name of the default, if no value of the row is the default; or NULL */
} trip_scene_choice;

enum { TRIP_SCENE_CHOICES = 4, TRIP_SCENE_ENTRIES = 16 };

extern const trip_scene_choice trip_scene_choices[TRIP_SCENE_CHOICES];

/* An entry of a choice. */
typedef struct trip_scene_entry {
    char label[32];
    const char *value; /* as the option takes it; "" selects the default */
} trip_scene_entry;

/* Writes the entries that the scene has, and returns their number: below 2 if there is no choice.
 * Sets *chosen to the entry of the settings. */
int trip_scene_entries(const trip_scene_choice *choice, const triptych_scene *scene,
                       const draw_settings *s, trip_scene_entry entries[TRIP_SCENE_ENTRIES],
                       int *chosen);
/* Sets the setting to an entry of trip_scene_entries(). */
void trip_scene_choose(const trip_scene_choice *choice, const trip_scene_entry *entry,
                       draw_settings *s);

/* Returns the name of the order that is chosen, or of the default. */
const char *trip_scene_order(const triptych_scene *scene, const draw_settings *s);
/* Writes a line about the scene: objects, count and order. With `status`, adds time and memory of
 * the last full picture. */
void trip_scene_say(const triptych_scene *scene, const draw_settings *s,
                    const trip_frames_status *status, char *text, size_t bytes);
/* Returns a description of a scene as of a volume. It has only the bounds that views fit. */
triptych_info trip_scene_bounds(const triptych_scene *scene);

#ifdef __cplusplus
}
#endif

#endif
