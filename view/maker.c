#include "maker.h"

#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "report.h"
#include "scope.h"

struct trip_maker {
    trip_maker_params params; /* read-only */
    pthread_t thread;
    bool started;     /* the thread must be joined; window's thread only */
    trip_scope scope; /* the thread's */
    triptych *t;      /* the thread's; others only call triptych_cancel() */
    char *input;      /* set before the thread starts */
    bool keep_all;

    pthread_mutex_t lock;
    /* Under lock: */
    trip_maker_status status;
    bool ended; /* and not yet taken */
    trip_made made;
};

static void show_progress(void *user, const char *stage, uint64_t done, uint64_t total)
{
    trip_maker *m = user;
    pthread_mutex_lock(&m->lock);
    snprintf(m->status.stage, sizeof m->status.stage, "%s", stage);
    m->status.done = total ? (double)done / (double)total : 0;
    pthread_mutex_unlock(&m->lock);
    m->params.wake(m->params.wake_user);
}

static void take_line(void *user, const char *line)
{
    (void)user, (void)line; /* drawing reports the same messages */
}

static void take_report(const char *line, void *user)
{
    take_line(user, line);
}

static void set_message(trip_maker *m, const char *line)
{
    static const char prefix[] = "triptych: ";
    const char *text = line + (strncmp(line, prefix, sizeof prefix - 1) ? 0 : sizeof prefix - 1);
    pthread_mutex_lock(&m->lock);
    snprintf(m->made.message, sizeof m->made.message, "%.500s", text);
    pthread_mutex_unlock(&m->lock);
}

static void take_failure(void *user, int status, const char *line)
{
    (void)status;
    set_message(user, line);
}

static void *run(void *user)
{
    trip_maker *m = user;
    trip_scope *before = trip_scope_enter(&m->scope);
    int status = m->params.make(m->params.user, m->t, m->input, m->keep_all);
    if (status && *triptych_error(m->t))
        set_message(m, triptych_error(m->t));
    trip_scope_enter(before);
    pthread_mutex_lock(&m->lock);
    m->made.made = status == 0;
    m->ended = true;
    pthread_mutex_unlock(&m->lock);
    m->params.wake(m->params.wake_user);
    return NULL;
}

trip_maker *trip_maker_create(const trip_maker_params *params)
{
    trip_maker *m = calloc(1, sizeof *m);
    if (!m)
        return NULL;
    m->params = *params;
    pthread_mutex_init(&m->lock, NULL);
    return m;
}

static void join(trip_maker *m)
{
    if (m->started)
        pthread_join(m->thread, NULL);
    m->started = false;
    triptych_destroy(m->t);
    m->t = NULL;
    free(m->input);
    m->input = NULL;
}

void trip_maker_destroy(trip_maker *m)
{
    if (!m)
        return;
    if (m->started) {
        trip_scope_cancel(&m->scope);
        triptych_cancel(m->t);
    }
    join(m);
    pthread_mutex_destroy(&m->lock);
    free(m);
}

bool trip_maker_start(trip_maker *m, unsigned document, const char *input, bool keep_all)
{
    if (trip_maker_get_status(m).busy)
        return false;
    join(m);
    m->scope = (trip_scope){ .failed = take_failure, .sink = take_report, .user = m };
    m->input = strdup(input);
    m->keep_all = keep_all;
    if (!m->input || triptych_create(&m->t))
        return false;
    triptych_set_messages(m->t, take_line, m);
    triptych_set_progress(m->t, show_progress, m);
    m->made = (trip_made){ .document = document, .keep_all = keep_all };
    m->ended = false;
    m->status = (trip_maker_status){ .busy = true, .document = document };
    m->started = pthread_create(&m->thread, NULL, run, m) == 0;
    if (!m->started)
        m->status.busy = false;
    return m->started;
}

trip_maker_status trip_maker_get_status(trip_maker *m)
{
    pthread_mutex_lock(&m->lock);
    trip_maker_status status = m->status;
    pthread_mutex_unlock(&m->lock);
    return status;
}

bool trip_maker_take(trip_maker *m, trip_made *out)
{
    pthread_mutex_lock(&m->lock);
    const bool ended = m->ended;
    *out = m->made;
    m->status.busy &= !ended;
    m->ended = false;
    pthread_mutex_unlock(&m->lock);
    return ended;
}
