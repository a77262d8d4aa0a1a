#include "flight.h"

#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "budget.h"
#include "command_line.h"
#include "library.h"
#include "report.h"

enum { MAX_CONTEXTS = 16, REPORT_BYTES = 4096 };

typedef struct flying {
    const flight *f;
    const volatile sig_atomic_t *signalled; /* the flag of the calling thread */
    pthread_mutex_t lock;
    pthread_cond_t turn; /* signals a change of `then` or `status` */
    /* Guarded by lock: the next frame to draw, the next frame for then(), the first failure, and
     * its message. */
    int next, then, status;
    bool final; /* the failure is from then(), so the frame must not be drawn again */
    char line[REPORT_BYTES];
} flying;

/* A thread and its context. */
typedef struct pilot {
    flying *all;
    pthread_t thread;
    triptych *t;
    float *rgba, *depth;
} pilot;

static void fail(flying *all, int status, const char *line)
{
    pthread_mutex_lock(&all->lock);
    if (!all->status) {
        all->status = status;
        snprintf(all->line, sizeof all->line, "%s", line);
    }
    pthread_cond_broadcast(&all->turn);
    pthread_mutex_unlock(&all->lock);
}

static uint64_t memory_of_each(const flight *f)
{
    uint64_t all = f->o->resources.memory_bytes ? f->o->resources.memory_bytes
                                                : trip_memory_available_bytes() / 4;
    return all / (uint64_t)f->contexts;
}

static int open_data(pilot *p)
{
    const flight *f = p->all->f;
    const render_options *o = f->o;
    int status = triptych_create(&p->t);
    triptych_resources resources = o->resources;
    resources.memory_bytes = memory_of_each(f);
    resources.keep_pages = 1;
    resources.name = o->input;
    if (!status)
        status = placed_input_open(f->placed, p->t, f->data, &resources);
    if (!status && !f->placed->count)
        status = library_add(p->t, o->more, o->more_count, o->heat);
    if (!status)
        status = triptych_set_transfer_function(p->t, &o->function);
    if (!status)
        status = triptych_new_picture(p->t, o->view.view.width, o->view.view.height, 4, &p->rgba);
    if (!status && o->depth)
        status = triptych_new_picture(p->t, o->view.view.width, o->view.view.height, 1, &p->depth);
    return status ? status : draw_settings_use(p->t, &o->settings);
}

static int draw(pilot *p)
{
    enum { LOOK_NS = 20000000 };
    int status = triptych_begin(p->t);
    while (!status && (status = triptych_step(p->t, UINT64_MAX)) == TRIPTYCH_STEP_WAITS)
        status = triptych_await(p->t, LOOK_NS);
    if (!status)
        status = p->depth ? triptych_picture_and_depth(p->t, p->rgba, p->depth)
                          : triptych_picture(p->t, p->rgba);
    triptych_end(p->t);
    return status;
}

static void pass_remark(void *user, const char *line)
{
    static const char warning[] = "triptych: warning: ";
    (void)user;
    if (!strncmp(line, warning, strlen(warning)) ||
        (command_line_is_note(line) && !command_line_quiet()))
        trip_report_line(line);
}

/* Only the first frame's context prints warnings and notes; the other frames have the same ones. */
static int draw_frame(pilot *p, int frame)
{
    const flight *f = p->all->f;
    triptych_set_messages(p->t, frame ? NULL : pass_remark, NULL);
    int status = sequence_set_frame(f->sequence, p->t, frame, true);
    if (!status)
        status = draw(p);
    return status ? status : f->write(f->user, p->t, frame, p->rgba, p->depth);
}

/* Returns the next frame to draw, or -1 if there is none. */
static int take_frame(flying *all)
{
    pthread_mutex_lock(&all->lock);
    bool more = !all->status && all->next < all->f->sequence->frames;
    int frame = more ? all->next++ : -1;
    pthread_mutex_unlock(&all->lock);
    return frame;
}

/* Calls then() for a frame after all earlier frames, unless an earlier frame failed. */
static int go_on(pilot *p, int frame)
{
    flying *all = p->all;
    int status = 0;
    pthread_mutex_lock(&all->lock);
    while (!all->status && all->then < frame)
        pthread_cond_wait(&all->turn, &all->lock);
    bool failed = all->then < frame;
    if (!failed)
        status = all->f->then(all->f->user, p->t, frame, p->rgba);
    all->then += !failed && !status;
    all->final |= status != 0;
    pthread_cond_broadcast(&all->turn);
    pthread_mutex_unlock(&all->lock);
    return status;
}

static void *fly(void *argument)
{
    pilot *p = argument;
    trip_held_report held;
    int status, frame;
    trip_scope_heed(p->all->signalled);
    trip_report_hold(&held);
    status = open_data(p);
    while (!status && (frame = take_frame(p->all)) >= 0) {
        status = draw_frame(p, frame);
        if (!status)
            status = go_on(p, frame);
    }
    if (status < 0)
        fail(p->all, status, held.status ? held.line : p->t ? triptych_error(p->t) : "");
    trip_report_release(&held);
    triptych_destroy(p->t);
    return NULL;
}

int flight_draw(const flight *f, int *done)
{
    flying all = { .f = f, .signalled = trip_scope_signal() };
    pilot pilots[MAX_CONTEXTS] = { { 0 } };
    int count = 0;
    pthread_mutex_init(&all.lock, NULL);
    pthread_cond_init(&all.turn, NULL);
    for (int i = 0; i < f->contexts && i < MAX_CONTEXTS; i++) {
        pilots[count].all = &all;
        count += pthread_create(&pilots[count].thread, NULL, fly, &pilots[count]) == 0;
    }
    for (int i = 0; i < count; i++)
        pthread_join(pilots[i].thread, NULL);
    pthread_cond_destroy(&all.turn);
    pthread_mutex_destroy(&all.lock);
    *done = all.then;
    if (count && !all.status)
        return 0;
    if (!all.final && all.status != TRIP_INTERRUPTED)
        return 1;
    if (*all.line)
        trip_report_line(all.line);
    return all.status;
}
