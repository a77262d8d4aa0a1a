/* Input events of the window, from GLFW or from a script (script.h). Positions are in pixels from
 * the upper left corner of the window's contents. */
#ifndef TRIP_VIEW_EVENT_H
#define TRIP_VIEW_EVENT_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* A key with a character has the code of the character in lower case. These are the others. */
enum {
    TRIP_KEY_ESCAPE = 256,
    TRIP_KEY_ENTER,
    TRIP_KEY_TAB,
    TRIP_KEY_BACKSPACE,
    TRIP_KEY_DELETE,
    TRIP_KEY_LEFT,
    TRIP_KEY_RIGHT,
    TRIP_KEY_UP,
    TRIP_KEY_DOWN,
    TRIP_KEY_HOME,
    TRIP_KEY_END,
    TRIP_KEY_PAGE_UP,
    TRIP_KEY_PAGE_DOWN,
    TRIP_KEY_F1,
    TRIP_KEYS
};

enum { TRIP_BUTTON_LEFT, TRIP_BUTTON_RIGHT, TRIP_BUTTON_MIDDLE, TRIP_BUTTONS };

enum { TRIP_SHIFT = 1, TRIP_CONTROL = 2, TRIP_ALT = 4 }; /* modifier keys, as bits */

typedef enum trip_event_kind {
    /* from people or scripts: */
    TRIP_EVENT_MOVE,    /* pointer to x, y */
    TRIP_EVENT_BUTTON,  /* code, down or not */
    TRIP_EVENT_WHEEL,   /* y steps away from the user */
    TRIP_EVENT_KEY,     /* code, down or not */
    TRIP_EVENT_TEXT,    /* code is the typed character */
    TRIP_EVENT_RESIZE,  /* to x by y pixels of contents */
    TRIP_EVENT_DROP,    /* text is the path of the dropped file */
    TRIP_EVENT_ICONIFY, /* minimised if `down`, else restored */
    TRIP_EVENT_CLOSE,
    /* from scripts only: */
    TRIP_EVENT_WAIT,       /* until the picture is complete or drawing has failed */
    TRIP_EVENT_SLEEP,      /* x milliseconds */
    TRIP_EVENT_SCREENSHOT, /* text is the file for a picture of the window */
    TRIP_EVENT_PICTURE, /* text is the file for the complete picture, equal to `triptych render`'s
                         */
    TRIP_EVENT_RANDOM,  /* `count` random events of the kinds that people make, from `seed` */
    TRIP_EVENT_STATUS,  /* text is the file for the statistics, as JSON */
    TRIP_EVENT_SET,     /* text has options of settings (draw_settings_read_text()) */
    TRIP_EVENT_CLICK,   /* clicks a control of the panel with the left button: text is its label, x
                           the position along it, 0 to 1 */
} trip_event_kind;

typedef struct trip_event {
    trip_event_kind kind;
    double x, y;
    int code;
    unsigned modifiers;
    bool down;
    uint64_t count, seed;
    char *text; /* owned by the event, for free(); may be NULL */
} trip_event;

#ifdef __cplusplus
}
#endif

#endif
