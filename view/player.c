#include "player.h"

#include "report.h"

/* splitmix64, a random generator of 64 bits. */
static uint64_t draw(uint64_t *state)
{
    uint64_t z = *state += UINT64_C(0x9e3779b97f4a7c15);
    z = (z ^ z >> 30) * UINT64_C(0xbf58476d1ce4e5b9);
    z = (z ^ z >> 27) * UINT64_C(0x94d049bb133111eb);
    return z ^ z >> 31;
}

static int below(uint64_t *state, int n)
{
    return (int)(draw(state) % (uint64_t)n);
}

/* All keys but the ones that end the viewer or write files. */
static int random_key(uint64_t *state)
{
    static const int keys[] = { 'w', 'a', 's', 'd', 'f',          'x',           'y',
                                'z', '1', '2', '3', '4',          '5',           '6',
                                '0', 'o', '[', ']', 'b',          't',           'c',
                                '?', ' ', 'k', ';', TRIP_KEY_TAB, TRIP_KEY_LEFT, TRIP_KEY_PAGE_UP };
    return keys[below(state, (int)(sizeof keys / sizeof *keys))];
}

static trip_event random_motion(uint64_t *state, int width, int height)
{
    return (trip_event){ .kind = TRIP_EVENT_MOVE,
                         .x = below(state, width + 40) - 20,
                         .y = below(state, height + 40) - 20 };
}

trip_event trip_player_random(uint64_t *state, int width, int height)
{
    const int kind = below(state, 100);
    const unsigned modifiers = below(state, 4) ? 0 : (unsigned)below(state, 8);
    if (kind < 45)
        return random_motion(state, width, height);
    if (kind < 65)
        return (trip_event){ .kind = TRIP_EVENT_BUTTON,
                             .code = below(state, TRIP_BUTTONS),
                             .modifiers = modifiers,
                             .down = below(state, 2) };
    if (kind < 75)
        return (trip_event){ .kind = TRIP_EVENT_WHEEL, .y = below(state, 7) - 3 };
    if (kind < 92)
        return (trip_event){ .kind = TRIP_EVENT_KEY,
                             .code = random_key(state),
                             .modifiers = modifiers,
                             .down = below(state, 2) };
    if (kind < 95)
        return (trip_event){ .kind = TRIP_EVENT_TEXT, .code = 32 + below(state, 95) };
    if (kind < 98)
        return (trip_event){ .kind = TRIP_EVENT_RESIZE,
                             .x = 60 + below(state, 700),
                             .y = 40 + below(state, 500) };
    return (trip_event){ .kind = TRIP_EVENT_ICONIFY, .down = below(state, 2) };
}

/* At the end, restores the window and releases all keys and buttons. */
static int play_random(trip_player *p, const trip_player_window *w, const trip_event *e)
{
    if (p->phase == 0) {
        p->state = e->seed;
        p->left = e->count;
        p->phase = 1;
    }
    if (p->left > 0) {
        const trip_event chance = trip_player_random(&p->state, p->width, p->height);
        p->left--;
        w->send(w->user, &chance);
        return 1;
    }
    w->send(w->user, &(trip_event){ .kind = TRIP_EVENT_ICONIFY });
    for (int button = 0; button < TRIP_BUTTONS; button++)
        w->send(w->user, &(trip_event){ .kind = TRIP_EVENT_BUTTON, .code = button });
    for (int key = 0; key < TRIP_KEYS; key++)
        w->send(w->user, &(trip_event){ .kind = TRIP_EVENT_KEY, .code = key });
    return 0;
}

static bool is_late(const trip_player *p, double seconds, double max)
{
    return seconds - p->since > max;
}

/* Returns whether a control is in sight and has not moved since the last picture. */
static bool lies_still(trip_player *p, const trip_player_window *w, const trip_event *e)
{
    double box[4];
    if (!w->find(w->user, e->text, box))
        return false;
    const double x = box[0] + (box[2] - box[0]) * e->x, y = (box[1] + box[3]) / 2;
    const bool still = x == p->position[0] && y == p->position[1];
    p->position[0] = x;
    p->position[1] = y;
    return still;
}

/* The window presses and releases in separate pictures. */
static int play_click(trip_player *p, const trip_player_window *w, const trip_event *e,
                      double seconds)
{
    if (!lies_still(p, w, e))
        return is_late(p, seconds, 10) ? trip_fail(TRIP_ERROR, "script", e->text,
                                                   "the panel has no control with this label")
                                       : 1;
    w->send(w->user,
            &(trip_event){ .kind = TRIP_EVENT_MOVE, .x = p->position[0], .y = p->position[1] });
    for (int down = 1; down >= 0; down--)
        w->send(w->user,
                &(trip_event){ .kind = TRIP_EVENT_BUTTON, .code = TRIP_BUTTON_LEFT, .down = down });
    return 0;
}

static int play_resize(trip_player *p, const trip_player_window *w, const trip_event *e,
                       double seconds)
{
    if (p->phase++ == 0) {
        w->send(w->user, e);
        return 1;
    }
    return !w->has_size(w->user, (int)e->x, (int)e->y) && !is_late(p, seconds, 5);
}

static int play(trip_player *p, const trip_player_window *w, const trip_event *e, double seconds)
{
    switch (e->kind) {
    case TRIP_EVENT_WAIT:
        return !w->rests(w->user);
    case TRIP_EVENT_SLEEP:
        return !is_late(p, seconds, e->x * 1e-3);
    case TRIP_EVENT_SCREENSHOT:
        w->shoot(w->user, e->text);
        return 0;
    case TRIP_EVENT_PICTURE:
        if (p->phase++ == 0)
            w->save(w->user, e->text);
        return w->rests(w->user) ? w->saved(w->user) : 1;
    case TRIP_EVENT_STATUS:
        return w->report(w->user, e->text);
    case TRIP_EVENT_RANDOM:
        return play_random(p, w, e);
    case TRIP_EVENT_CLICK:
        return play_click(p, w, e, seconds);
    case TRIP_EVENT_RESIZE:
        return play_resize(p, w, e, seconds);
    default:
        w->send(w->user, e);
        return 0;
    }
}

int trip_player_step(trip_player *p, const trip_player_window *w, double seconds)
{
    if (p->next >= p->script.count)
        return 0;
    const trip_event *e = &p->script.events[p->next];
    if (p->phase == 0 && p->since == 0)
        p->since = seconds;
    const int status = play(p, w, e, seconds);
    if (status < 0)
        return status;
    if (status == 0) {
        p->next++;
        p->phase = 0;
        p->since = 0;
        p->position[0] = p->position[1] = -1;
    }
    return 1;
}
