/* Events of the window that wait for their turn. A slow picture may collect a whole click: the
 * pointer moves to a control, presses and releases. Dear ImGui compares only the states of the
 * pointer and the keys between two pictures. So the queue hands out an event only if a picture has
 * shown the panel each event before it that matters. The window's thread only. */
#ifndef TRIP_VIEW_INPUT_QUEUE_H
#define TRIP_VIEW_INPUT_QUEUE_H

#include <stddef.h>

#include "event.h"

typedef struct trip_queued_event {
    trip_event event; /* owns its text */
    double seconds;   /* time of its arrival */
} trip_queued_event;

/* Zeroed at first. */
typedef struct trip_input_queue {
    trip_queued_event *events; /* [first] to [first + count - 1] wait */
    size_t first, count, room;
    /* Events handed out since the last picture: */
    bool moved, wheeled, typed;
    bool keys[TRIP_KEYS];
    /* Pictures until keys may follow a button. The first picture gives a text field the focus. The
     * second one tells the window. */
    int until_keys;
    bool button; /* a button changed since the last picture */
    /* Keys and buttons that are down after the last event of the queue: */
    bool down_keys[TRIP_KEYS], down_buttons[TRIP_BUTTONS];
} trip_input_queue;

/* Appends a copy of an event. Drops it if memory is exhausted. */
void trip_input_queue_push(trip_input_queue *q, const trip_event *e, double seconds);
/* Appends a release for each key and button that is down. */
void trip_input_queue_release_all(trip_input_queue *q, double seconds);

/* Hands out the next event. The caller frees its text. Returns false if the queue is empty, or if a
 * picture must be drawn before the next event. */
bool trip_input_queue_next(trip_input_queue *q, trip_queued_event *out);
/* Notes that a picture was drawn, or that the window draws no pictures. */
void trip_input_queue_drawn(trip_input_queue *q);

void trip_input_queue_free(trip_input_queue *q);

#endif
