#include "gl/queue.h"

#include "renderer.h"
#include "report.h"

/* Interval between checks for cancellation during a wait. */
static const GLuint64 look_ns = 1000000;

static int wait_failed(void)
{
    return trip_fail(TRIP_ERROR, "gl", "queue", "waiting for the GPU failed: OpenGL error %#x",
                     glGetError());
}

/* Waits for the oldest part in progress. Returns GL_TIMEOUT_EXPIRED if it does not finish within
 * `ns`. */
static GLenum look_at_oldest(trip_gl_queue *q, GLuint64 ns)
{
    GLsync *fence = &q->fences[(q->done + 1) % TRIP_GL_QUEUE_PARTS];
    GLenum result = glClientWaitSync(*fence, 0, ns);
    if (result == GL_TIMEOUT_EXPIRED)
        return result;
    glDeleteSync(*fence);
    *fence = NULL;
    q->done++;
    return result;
}

int trip_gl_queue_is_done(trip_gl_queue *q, uint64_t part, bool wait)
{
    while (q->done < part) {
        GLenum result = look_at_oldest(q, wait ? look_ns : 0);
        if (result == GL_WAIT_FAILED)
            return wait_failed();
        if (result == GL_TIMEOUT_EXPIRED && !wait)
            return 0;
        int status = result == GL_TIMEOUT_EXPIRED ? trip_frame_poll() : TRIP_OK;
        if (status)
            return status;
    }
    return 1;
}

/* Returns the number of the part that must finish before another can end; 0 if none. */
static uint64_t before_next(const trip_gl_queue *q)
{
    return q->ended < TRIP_GL_QUEUE_PARTS ? 0 : q->ended - (TRIP_GL_QUEUE_PARTS - 1);
}

int trip_gl_queue_has_room(trip_gl_queue *q)
{
    return trip_gl_queue_is_done(q, before_next(q), false);
}

int trip_gl_queue_end_part(trip_gl_queue *q)
{
    int status = trip_gl_queue_is_done(q, before_next(q), true);
    if (status < 0)
        return status;
    q->fences[++q->ended % TRIP_GL_QUEUE_PARTS] = glFenceSync(GL_SYNC_GPU_COMMANDS_COMPLETE, 0);
    glFlush();
    return trip_frame_poll();
}

void trip_gl_queue_await(trip_gl_queue *q, uint64_t timeout_ns)
{
    if (q->done < q->ended)
        look_at_oldest(q, timeout_ns);
}

void trip_gl_queue_leave(trip_gl_queue *q)
{
    GLsync *fence = &q->fences[q->ended % TRIP_GL_QUEUE_PARTS];
    if (q->done == q->ended)
        fence = &q->fences[++q->ended % TRIP_GL_QUEUE_PARTS];
    else
        glDeleteSync(*fence);
    *fence = glFenceSync(GL_SYNC_GPU_COMMANDS_COMPLETE, 0);
    glFlush();
}

void trip_gl_queue_drain(trip_gl_queue *q)
{
    glFinish();
    for (int i = 0; i < TRIP_GL_QUEUE_PARTS; i++) {
        glDeleteSync(q->fences[i]);
        q->fences[i] = NULL;
    }
    q->done = q->ended;
}
