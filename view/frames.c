#include "frames.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "frames_state.h"

static char *copy_text(const char *text, bool *fits)
{
    char *copy = text ? strdup(text) : NULL;
    *fits &= !text || copy;
    return copy;
}

bool trip_wanted_copy(trip_wanted *to, const trip_wanted *from)
{
    bool fits = true;
    *to = *from;
    to->input = copy_text(from->input, &fits);
    to->heat = copy_text(from->heat, &fits);
    to->function = copy_text(from->function, &fits);
    to->text = copy_text(from->text, &fits);
    return fits;
}

void trip_wanted_release(trip_wanted *w)
{
    free((char *)(uintptr_t)w->input);
    free((char *)(uintptr_t)w->heat);
    free((char *)(uintptr_t)w->function);
    free((char *)(uintptr_t)w->text);
    *w = (trip_wanted){ 0 };
}

void trip_opened_free(trip_opened *o)
{
    free(o->function);
    free(o->source);
    *o = (trip_opened){ 0 };
}

static void destroy(trip_frames *f)
{
    triptych_destroy(f->t);
    trip_wanted_release(&f->wanted);
    trip_opened_free(&f->opened);
    free(f->save);
    free(f->plan);
    pthread_mutex_destroy(&f->lock);
    pthread_mutex_destroy(&f->picture_lock);
    pthread_cond_destroy(&f->come);
    free(f);
}

trip_frames *trip_frames_start(const trip_frames_params *params)
{
    trip_frames *f = calloc(1, sizeof *f);
    if (!f)
        return NULL;
    f->params = *params;
    pthread_mutex_init(&f->lock, NULL);
    pthread_mutex_init(&f->picture_lock, NULL);
    pthread_cond_init(&f->come, NULL);
    trip_frames_prepare(f);
    if (triptych_create(&f->t) == 0 && pthread_create(&f->thread, NULL, trip_frames_run, f) == 0)
        return f;
    destroy(f);
    return NULL;
}

void trip_frames_stop(trip_frames *f)
{
    if (!f)
        return;
    pthread_mutex_lock(&f->lock);
    f->quit = true;
    pthread_cond_signal(&f->come);
    pthread_mutex_unlock(&f->lock);
    trip_scope_cancel(&f->scope);
    triptych_cancel(f->t);
    pthread_join(f->thread, NULL);
    destroy(f);
}

void trip_frames_want(trip_frames *f, const trip_wanted *wanted)
{
    trip_wanted copy;
    if (!trip_wanted_copy(&copy, wanted)) {
        trip_wanted_release(&copy);
        return; /* keep the old view */
    }
    pthread_mutex_lock(&f->lock);
    const bool ends = f->ends_early || f->wanted.document != copy.document;
    trip_wanted before = f->wanted;
    f->wanted = copy;
    f->wanted_count++;
    f->status.exact = f->status.rests = false;
    if (before.input && before.document != copy.document)
        trip_scope_cancel(&f->scope);
    if (ends)
        triptych_cancel(f->t);
    pthread_cond_signal(&f->come);
    pthread_mutex_unlock(&f->lock);
    trip_wanted_release(&before);
}

bool trip_frames_take_opened(trip_frames *f, trip_opened *out)
{
    pthread_mutex_lock(&f->lock);
    const bool has = f->has_opened;
    if (has) {
        *out = f->opened;
        f->opened = (trip_opened){ 0 };
        f->has_opened = false;
    }
    pthread_mutex_unlock(&f->lock);
    return has;
}

trip_frames_status trip_frames_get_status(trip_frames *f)
{
    pthread_mutex_lock(&f->lock);
    const trip_frames_status status = f->status;
    pthread_mutex_unlock(&f->lock);
    return status;
}

int trip_frames_get_times(trip_frames *f, int max, float *ms)
{
    pthread_mutex_lock(&f->lock);
    const uint64_t moving = f->status.moving;
    uint64_t count = moving < TRIP_FRAMES_TIMES ? moving : TRIP_FRAMES_TIMES;
    count = count < (uint64_t)max ? count : (uint64_t)max;
    for (uint64_t i = 0; i < count; i++)
        ms[i] = f->times[(moving - count + i) % TRIP_FRAMES_TIMES];
    pthread_mutex_unlock(&f->lock);
    return (int)count;
}

char *trip_frames_explain(trip_frames *f)
{
    pthread_mutex_lock(&f->lock);
    char *plan = f->plan ? strdup(f->plan) : NULL;
    pthread_mutex_unlock(&f->lock);
    return plan;
}

bool trip_frames_use_picture(trip_frames *f, uint64_t number,
                             void (*use)(void *user, const trip_picture *p), void *user)
{
    if (pthread_mutex_trylock(&f->picture_lock))
        return false;
    const bool other = f->picture.rgba && f->picture.number != number;
    if (other)
        use(user, &f->picture);
    pthread_mutex_unlock(&f->picture_lock);
    return other;
}

void trip_frames_save(trip_frames *f, const char *path)
{
    char *copy = strdup(path);
    pthread_mutex_lock(&f->lock);
    free(f->save);
    f->save = copy;
    f->status.rests = false;
    pthread_cond_signal(&f->come);
    pthread_mutex_unlock(&f->lock);
}

bool trip_frames_saving(trip_frames *f)
{
    pthread_mutex_lock(&f->lock);
    const bool saving = f->save;
    pthread_mutex_unlock(&f->lock);
    return saving;
}

void trip_frames_probe(trip_frames *f, double x, double y)
{
    pthread_mutex_lock(&f->lock);
    f->looks = true;
    f->position[0] = x;
    f->position[1] = y;
    pthread_cond_signal(&f->come);
    pthread_mutex_unlock(&f->lock);
}

trip_probed trip_frames_get_probed(trip_frames *f)
{
    pthread_mutex_lock(&f->lock);
    const trip_probed probed = f->probed;
    pthread_mutex_unlock(&f->lock);
    return probed;
}
