/* Scripts of the viewer: a text whose lines are events, in the order in which they happen. One
 * thread.
 *
 *   move X Y                     the cursor, in pixels of the window
 *   press BUTTON [+MODIFIER...]  left, right or middle; +shift, +control, +alt
 *   release BUTTON [+MODIFIER...]
 *   drag BUTTON X Y X2 Y2 STEPS [+MODIFIER...]   move, press, move in so many steps, release
 *   wheel STEPS [+MODIFIER...]   away from the user; may be negative or broken
 *   key KEY [+MODIFIER...]       pressed and released: a character, or escape, enter, tab,
 *                                backspace, delete, left, right, up, down, home, end, page-up,
 *                                page-down, f1, space
 *   hold KEY [+MODIFIER...]      pressed alone; `let KEY` releases it
 *   type TEXT                    characters, one by one
 *   resize WIDTH HEIGHT
 *   drop FILE                    a file dropped on the window
 *   minimise, restore, close
 *   wait                         until the picture is whole
 *   sleep MILLISECONDS
 *   screenshot FILE              of the window
 *   picture FILE                 the whole picture, as `triptych render` writes it
 *   random COUNT SEED            so many events by chance, the same for the same seed
 *   status FILE                  what the gauges say, as JSON
 *   click PART LABEL             a control of the panel, so far along it, 0 to 1
 *
 * TEXT and FILE are the rest of the line. `#` at the beginning of a line makes it a comment. */
#ifndef TRIP_VIEW_SCRIPT_H
#define TRIP_VIEW_SCRIPT_H

#include <stddef.h>

#include "event.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct trip_script {
    trip_event *events;
    size_t count;
} trip_script;

/* 0, or a reported failure that names the line; *out is then empty. `name` is for messages. */
int trip_script_parse(trip_script *out, const char *name, const char *text, size_t bytes);
/* The same of a file. */
int trip_script_load(trip_script *out, const char *path);
void trip_script_free(trip_script *s);

#ifdef __cplusplus
}
#endif

#endif
