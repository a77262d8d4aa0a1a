#include "flusher.h"

#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <stdlib.h>
#include <unistd.h>

enum { THREADS = 2 };

struct trip_flusher {
    pthread_mutex_t lock;
    pthread_cond_t work, done;
    trip_flush_job *first, **last; /* guarded by lock */
    bool stop;                     /* guarded by lock */
    unsigned thread_count;
    pthread_t threads[THREADS];
};

static bool use_page_cache(int fd)
{
    int flags = fcntl(fd, F_GETFL);
    return flags >= 0 && (flags & O_DIRECT) && fcntl(fd, F_SETFL, flags & ~O_DIRECT) == 0;
}

int trip_flusher_write(int fd, const void *data, size_t bytes, uint64_t offset)
{
    const unsigned char *p = data;
    while (bytes > 0) {
        ssize_t n = pwrite(fd, p, bytes, (off_t)offset);
        if (n < 0 && (errno == EINTR || (errno == EINVAL && use_page_cache(fd))))
            continue;
        if (n <= 0)
            return n < 0 ? errno : ENOSPC;
        p += n;
        offset += (uint64_t)n;
        bytes -= (size_t)n;
        if (bytes > 0)
            use_page_cache(fd); /* the rest may no longer be aligned */
    }
    return 0;
}

static trip_flush_job *take(trip_flusher *f)
{
    pthread_mutex_lock(&f->lock);
    while (!f->first && !f->stop)
        pthread_cond_wait(&f->work, &f->lock);
    trip_flush_job *job = f->first;
    if (job && !(f->first = job->next))
        f->last = &f->first;
    pthread_mutex_unlock(&f->lock);
    return job;
}

static int do_job(const trip_flush_job *job)
{
    if (job->data)
        return trip_flusher_write(job->fd, job->data, job->bytes, job->offset);
    return fsync(job->fd) < 0 ? errno : 0;
}

static void *work(void *flusher)
{
    trip_flusher *f = flusher;
    trip_flush_job *job;
    while ((job = take(f))) {
        job->error = do_job(job);
        pthread_mutex_lock(&f->lock);
        job->pending = false;
        pthread_cond_broadcast(&f->done);
        pthread_mutex_unlock(&f->lock);
    }
    return NULL;
}

int trip_flusher_create(trip_flusher **out)
{
    trip_flusher *f = *out = calloc(1, sizeof *f);
    if (!f)
        return ENOMEM;
    pthread_mutex_init(&f->lock, NULL);
    pthread_cond_init(&f->work, NULL);
    pthread_cond_init(&f->done, NULL);
    f->last = &f->first;
    int error = 0;
    for (; f->thread_count < THREADS && error == 0; f->thread_count += error == 0)
        error = pthread_create(&f->threads[f->thread_count], NULL, work, f);
    if (f->thread_count > 0)
        return 0;
    trip_flusher_destroy(f);
    *out = NULL;
    return error;
}

void trip_flusher_destroy(trip_flusher *f)
{
    if (!f)
        return;
    pthread_mutex_lock(&f->lock);
    f->stop = true;
    pthread_cond_broadcast(&f->work);
    pthread_mutex_unlock(&f->lock);
    for (unsigned i = 0; i < f->thread_count; i++)
        pthread_join(f->threads[i], NULL);
    pthread_cond_destroy(&f->done);
    pthread_cond_destroy(&f->work);
    pthread_mutex_destroy(&f->lock);
    free(f);
}

void trip_flusher_submit(trip_flusher *f, trip_flush_job *job)
{
    job->next = NULL;
    job->error = 0;
    pthread_mutex_lock(&f->lock);
    job->pending = true;
    *f->last = job;
    f->last = &job->next;
    pthread_cond_signal(&f->work);
    pthread_mutex_unlock(&f->lock);
}

int trip_flusher_wait(trip_flusher *f, trip_flush_job *job)
{
    pthread_mutex_lock(&f->lock);
    while (job->pending)
        pthread_cond_wait(&f->done, &f->lock);
    pthread_mutex_unlock(&f->lock);
    return job->error;
}
