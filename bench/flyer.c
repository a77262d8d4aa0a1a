#include "flyer.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "clock.h"
#include "report.h"

/* Called by the drawing thread. */
static void wake(void *user)
{
    flyer *f = user;
    pthread_mutex_lock(&f->lock);
    f->woke = true;
    pthread_cond_signal(&f->woken);
    pthread_mutex_unlock(&f->lock);
}

/* Sleeps until wake() is called or until that time. */
static void sleep_until(flyer *f, double ms)
{
    const struct timespec t = { .tv_sec = (time_t)(ms / 1e3),
                                .tv_nsec = (long)(fmod(ms, 1e3) * 1e6) };
    pthread_mutex_lock(&f->lock);
    while (!f->woke && pthread_cond_timedwait(&f->woken, &f->lock, &t) == 0)
        ;
    f->woke = false;
    pthread_mutex_unlock(&f->lock);
}

/* ---- the path ---- */

/* Moves the eye by one step of a part with `steps` steps. */
static void move(trip_navigation *n, const double *middle, double size, int part, int steps)
{
    const double share = 1.0 / steps;
    switch (part) {
    case 0:
        trip_navigation_orbit(n, 150 * share, 25 * sin(share));
        break;
    case 1:
        trip_navigation_orbit(n, 40 * share, 0);
        trip_navigation_dolly(n, pow(0.3, share), middle);
        break;
    case 2:
        trip_navigation_fly(n, size * share, 0, 0);
        trip_navigation_turn(n, 30 * share, 0);
        break;
    default:
        trip_navigation_turn(n, 120 * share, 10 * share);
        trip_navigation_fly(n, -1.5 * size * share, 0, 0);
    }
}

static bool take_steps(flyer *f, double seconds)
{
    const triptych_info *info = &f->opened.info;
    const int part_steps = (int)ceil(seconds * FLYER_STEPS_PER_SECOND / FLYER_PARTS);
    double middle[3], size = 0;
    f->steps = part_steps * FLYER_PARTS;
    f->navigation = calloc((size_t)f->steps, sizeof *f->navigation);
    f->wanted_ms = calloc((size_t)f->steps, sizeof *f->wanted_ms);
    if (!f->navigation || !f->wanted_ms)
        return false;
    for (int a = 0; a < 3; a++) {
        middle[a] = (info->lo[a] + info->hi[a]) / 2;
        size = fmax(size, info->hi[a] - info->lo[a]);
    }
    trip_navigation n = f->opened.navigation;
    for (int i = 0; i < f->steps; i++) {
        move(&n, middle, size, i / part_steps, part_steps);
        f->navigation[i] = n;
    }
    return true;
}

/* ---- pictures ---- */

static int step_of(const flyer *f, const trip_navigation *n)
{
    int i = f->step_count - 1;
    while (i >= 0 && memcmp(n, &f->navigation[i], sizeof *n) != 0)
        i--;
    return i;
}

static bool has_room(flyer *f)
{
    if (f->picture_count < f->picture_room)
        return true;
    const int room = f->picture_room ? 2 * f->picture_room : 256;
    flyer_picture *more = realloc(f->pictures, (size_t)room * sizeof *more);
    if (!more)
        return false;
    f->pictures = more;
    f->picture_room = room;
    return true;
}

/* Returns the newest step that had come at that time. */
static int latest_at(const flyer *f, double ms)
{
    int i = f->step_count - 1;
    while (i > 0 && f->wanted_ms[i] > ms)
        i--;
    return i;
}

/* Keeps a copy of the picture if it is complete. */
static void look(void *user, const trip_picture *p)
{
    flyer *f = user;
    f->number = p->number;
    if (!p->whole)
        return;
    const size_t bytes = (size_t)p->width * (size_t)p->height * 4;
    free(f->last);
    f->last = malloc(bytes);
    if (f->last)
        memcpy(f->last, p->rgba, bytes);
}

static void note_picture(void *user, const trip_picture *p)
{
    flyer *f = user;
    const double ms = trip_now_ms();
    const int step = step_of(f, &p->navigation);
    look(f, p); /* also keeps the picture of the last step */
    if (step < 0 || !has_room(f))
        return;
    const flyer_picture *before = f->picture_count ? &f->pictures[f->picture_count - 1] : NULL;
    f->pictures[f->picture_count] =
        (flyer_picture){ .ms = ms - f->begun_ms,
                         .step = step,
                         .latest = before ? latest_at(f, f->begun_ms + before->ms) : step,
                         .age_ms = ms - f->wanted_ms[step],
                         .scale = (double)p->width / p->full_width };
    f->picture_count++;
}

/* ---- the flight ---- */

/* Waits until the picture is complete. *first_ms is the time to the first picture, *whole_ms to the
 * complete one. */
static int await_rest(flyer *f, double *first_ms, double *whole_ms)
{
    const double begun = trip_now_ms();
    const uint64_t number = f->number;
    *first_ms = 0;
    for (;;) {
        const trip_frames_status s = trip_frames_get_status(f->frames);
        trip_frames_use_picture(f->frames, f->number, look, f);
        if (*first_ms == 0 && f->number != number)
            *first_ms = trip_now_ms() - begun;
        if (s.failed)
            return trip_fail(TRIP_ERROR, "bench", f->wanted.input, "%s", s.message);
        if (trip_interrupted())
            return trip_fail(TRIP_INTERRUPTED, "bench", "flight", "interrupted");
        if (s.rests && s.exact)
            break;
        sleep_until(f, trip_now_ms() + 50);
    }
    trip_frames_use_picture(f->frames, f->number, look, f);
    *whole_ms = trip_now_ms() - begun;
    return f->last ? 0 : trip_fail(TRIP_ERROR, "bench", "flight", "out of memory for a picture");
}

static void want_step(flyer *f)
{
    f->wanted.navigation = f->navigation[f->step_count];
    f->wanted.has_navigation = true;
    f->wanted_ms[f->step_count++] = trip_now_ms();
    trip_frames_want(f->frames, &f->wanted);
}

/* Steps come at fixed times, independent of the drawing thread. */
static int move_all(flyer *f)
{
    f->begun_ms = trip_now_ms();
    while (f->step_count < f->steps) {
        const double next = f->begun_ms + f->step_count * 1e3 / FLYER_STEPS_PER_SECOND;
        if (trip_interrupted())
            return trip_fail(TRIP_INTERRUPTED, "bench", "flight", "interrupted");
        if (trip_now_ms() >= next)
            want_step(f);
        else
            sleep_until(f, next);
        trip_frames_use_picture(f->frames, f->number, note_picture, f);
    }
    return 0;
}

static int start(flyer *f, const trip_frames_params *params)
{
    trip_frames_params with = *params;
    pthread_condattr_t monotonic;
    pthread_condattr_init(&monotonic);
    pthread_condattr_setclock(&monotonic, CLOCK_MONOTONIC);
    pthread_mutex_init(&f->lock, NULL);
    pthread_cond_init(&f->woken, &monotonic);
    pthread_condattr_destroy(&monotonic);
    with.wake = wake;
    with.wake_user = f;
    f->frames = trip_frames_start(&with);
    return f->frames ? 0
                     : trip_fail(TRIP_ERROR, "bench", "flight",
                                 "cannot start the drawing thread; out of memory or threads");
}

int flyer_fly(flyer *f, const trip_frames_params *params, const trip_wanted *wanted, double seconds)
{
    double first;
    *f = (flyer){ .wanted = *wanted };
    int status = start(f, params);
    if (status)
        return status;
    trip_frames_want(f->frames, &f->wanted);
    status = await_rest(f, &f->first_ms, &f->first_whole_ms);
    if (!status && (!trip_frames_take_opened(f->frames, &f->opened) || !take_steps(f, seconds)))
        status = trip_fail(TRIP_ERROR, "bench", "flight", "out of memory");
    if (!status)
        status = move_all(f);
    return status ? status : await_rest(f, &first, &f->rest_ms);
}

void flyer_land(flyer *f)
{
    trip_frames_stop(f->frames);
    f->frames = NULL;
}

void flyer_release(flyer *f)
{
    flyer_land(f);
    trip_opened_free(&f->opened);
    free(f->navigation);
    free(f->wanted_ms);
    free(f->pictures);
    free(f->last);
    pthread_cond_destroy(&f->woken);
    pthread_mutex_destroy(&f->lock);
}
