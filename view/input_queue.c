#include "input_queue.h"

#include <stdlib.h>
#include <string.h>

enum { PICTURES_FROM_BUTTON_TO_KEY = 2 };

static bool grow(trip_input_queue *q)
{
    if (q->first + q->count < q->room)
        return true;
    if (q->first > 0) {
        memmove(q->events, q->events + q->first, q->count * sizeof *q->events);
        q->first = 0;
        return true;
    }
    const size_t room = q->room ? 2 * q->room : 64;
    trip_queued_event *events = realloc(q->events, room * sizeof *events);
    if (!events)
        return false;
    q->events = events;
    q->room = room;
    return true;
}

void trip_input_queue_push(trip_input_queue *q, const trip_event *e, double seconds)
{
    trip_queued_event one = { .event = *e, .seconds = seconds };
    if (e->text && !(one.event.text = strdup(e->text)))
        return;
    if (!grow(q)) {
        free(one.event.text);
        return;
    }
    q->events[q->first + q->count++] = one;
    if (e->kind == TRIP_EVENT_KEY && e->code >= 0 && e->code < TRIP_KEYS)
        q->down_keys[e->code] = e->down;
    if (e->kind == TRIP_EVENT_BUTTON && e->code >= 0 && e->code < TRIP_BUTTONS)
        q->down_buttons[e->code] = e->down;
}

void trip_input_queue_release_all(trip_input_queue *q, double seconds)
{
    for (int i = 0; i < TRIP_BUTTONS; i++)
        if (q->down_buttons[i])
            trip_input_queue_push(q, &(trip_event){ .kind = TRIP_EVENT_BUTTON, .code = i },
                                  seconds);
    for (int i = 0; i < TRIP_KEYS; i++)
        if (q->down_keys[i])
            trip_input_queue_push(q, &(trip_event){ .kind = TRIP_EVENT_KEY, .code = i }, seconds);
}

static bool is_known_key(const trip_event *e)
{
    return e->code >= 0 && e->code < TRIP_KEYS;
}

/* Returns whether the panel must see a picture before this event. */
static bool must_wait(const trip_input_queue *q, const trip_event *e)
{
    switch (e->kind) {
    case TRIP_EVENT_MOVE:
        return q->button || q->wheeled;
    case TRIP_EVENT_BUTTON:
        return q->moved || q->button || q->wheeled || q->typed;
    case TRIP_EVENT_WHEEL:
        return q->moved || q->button;
    case TRIP_EVENT_KEY: /* a key without a character follows the characters typed before */
        return q->until_keys > 0 || (is_known_key(e) && q->keys[e->code]) ||
               (e->code >= TRIP_KEY_ESCAPE && q->typed);
    case TRIP_EVENT_TEXT:
        return q->until_keys > 0;
    default:
        return false;
    }
}

static void note(trip_input_queue *q, const trip_event *e)
{
    q->moved |= e->kind == TRIP_EVENT_MOVE;
    q->wheeled |= e->kind == TRIP_EVENT_WHEEL;
    q->typed |= e->kind == TRIP_EVENT_TEXT;
    if (e->kind == TRIP_EVENT_KEY && is_known_key(e))
        q->keys[e->code] = true;
    if (e->kind == TRIP_EVENT_BUTTON) {
        q->button = true;
        q->until_keys = PICTURES_FROM_BUTTON_TO_KEY;
    }
}

bool trip_input_queue_next(trip_input_queue *q, trip_queued_event *out)
{
    if (!q->count || must_wait(q, &q->events[q->first].event))
        return false;
    *out = q->events[q->first++];
    q->count--;
    note(q, &out->event);
    return true;
}

void trip_input_queue_drawn(trip_input_queue *q)
{
    q->moved = q->wheeled = q->typed = q->button = false;
    memset(q->keys, 0, sizeof q->keys);
    q->until_keys -= q->until_keys > 0;
}

void trip_input_queue_free(trip_input_queue *q)
{
    for (size_t i = 0; i < q->count; i++)
        free(q->events[q->first + i].event.text);
    free(q->events);
    *q = (trip_input_queue){ 0 };
}
