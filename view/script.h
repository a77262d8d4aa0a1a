/* Scripts of the viewer: a text with one event per line, in order. One thread at a time.
 *
 *   move X Y                     the cursor, in pixels of the window
 *   press BUTTON [+MODIFIER...]  left, right or middle; +shift, +control, +alt
 *   release BUTTON [+MODIFIER...]
 *   drag BUTTON X Y X2 Y2 STEPS [+MODIFIER...]   moves, presses, moves in STEPS steps, releases
 *   wheel STEPS [+MODIFIER...]   away from the user; may be negative or fractional
 *   key KEY [+MODIFIER...]       presses and releases: a character, or escape, enter, tab,
 *                                backspace, delete, left, right, up, down, home, end, page-up,
 *                                page-down, f1, space
 *   hold KEY [+MODIFIER...]      presses only; `let KEY` releases
 *   type TEXT                    characters, one by one
 *   resize WIDTH HEIGHT
 *   drop FILE                    a file dropped on the window
 *   minimise, restore, close
 *   wait                         until the picture is complete
 *   sleep MILLISECONDS
 *   screenshot FILE              of the window
 *   picture FILE                 the full picture, as `triptych render` writes it
 *   random COUNT SEED            COUNT random events, equal for equal seeds
 *   status FILE                  the statistics, as JSON
 *   set --OPTION VALUE...        settings, as options of `triptych render`
 *   click PART LABEL             a control of the panel, at PART of its width, 0 to 1
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

/* Parses a script. Returns 0, or a reported failure that names the line; *out is then empty. `name`
 * appears in messages. */
int trip_script_parse(trip_script *out, const char *name, const char *text, size_t bytes);
/* Loads a script from a file, with the same results. */
int trip_script_load(trip_script *out, const char *path);
void trip_script_free(trip_script *s);

#ifdef __cplusplus
}
#endif

#endif
