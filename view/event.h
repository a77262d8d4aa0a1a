/* What comes to the window: from people by GLFW, or from a script, whose parser is script.h.
 * Positions are in pixels of the window's contents, from its upper left corner. */
#ifndef TRIP_VIEW_EVENT_H
#define TRIP_VIEW_EVENT_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Keys with a character are that, in lower case; the others: */
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

enum { TRIP_SHIFT = 1, TRIP_CONTROL = 2, TRIP_ALT = 4 }; /* held with it */

typedef enum trip_event_kind {
    /* As people make them: */
    TRIP_EVENT_MOVE,    /* to x, y */
    TRIP_EVENT_BUTTON,  /* code, down or not */
    TRIP_EVENT_WHEEL,   /* y steps, away from the user */
    TRIP_EVENT_KEY,     /* code, down or not */
    TRIP_EVENT_TEXT,    /* code: a character typed */
    TRIP_EVENT_RESIZE,  /* x, y: the window's contents; scripts: is resized */
    TRIP_EVENT_DROP,    /* text: a file dropped on it */
    TRIP_EVENT_ICONIFY, /* down: minimised; else shown again */
    TRIP_EVENT_CLOSE,
    /* Of scripts alone: */
    TRIP_EVENT_WAIT,       /* until the picture is whole, or drawing has failed */
    TRIP_EVENT_SLEEP,      /* x milliseconds */
    TRIP_EVENT_SCREENSHOT, /* text: a file for what the window shows */
    TRIP_EVENT_PICTURE,    /* text: a file for the whole picture, as `triptych render` writes it */
    TRIP_EVENT_RANDOM,     /* count events of the kinds above wait, by `seed` */
    TRIP_EVENT_STATUS,     /* text: a file for what the gauges say, as JSON */
    TRIP_EVENT_CLICK, /* text: the label of a control of the panel; x: how far along it, 0 to 1;
                         done as by hand, with the left button */
} trip_event_kind;

typedef struct trip_event {
    trip_event_kind kind;
    double x, y;
    int code;
    unsigned modifiers;
    bool down;
    uint64_t count, seed;
    char *text; /* the event's own, for free(); NULL */
} trip_event;

#ifdef __cplusplus
}
#endif

#endif
