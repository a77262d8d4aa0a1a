#include "tf_editor.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "new_file.h"
#include "report.h"

enum { MAX_POINTS = 65536 };

/* A ring of steps: undo uses the steps before `at`, redo the steps after it. */
struct trip_tf_editor {
    trip_tf *steps[TRIP_TF_EDITOR_STEPS + 1];
    size_t first, at, last; /* step numbers; modulo the ring's length, the slots */
    bool open, begun;       /* between begin and end; the first change made a step */
    uint64_t revision;
};

static trip_tf **position(trip_tf_editor *e, size_t step)
{
    return &e->steps[step % (TRIP_TF_EDITOR_STEPS + 1)];
}

static const trip_tf *now(const trip_tf_editor *e)
{
    return e->steps[e->at % (TRIP_TF_EDITOR_STEPS + 1)];
}

trip_tf_editor *trip_tf_editor_create(void)
{
    const trip_tf_point none = { 0 };
    trip_tf_editor *e = calloc(1, sizeof *e);
    if (e && trip_tf_from_points(&e->steps[0], &none, 1, false, 0)) {
        free(e);
        return NULL;
    }
    return e;
}

void trip_tf_editor_destroy(trip_tf_editor *e)
{
    for (int i = 0; e && i <= TRIP_TF_EDITOR_STEPS; i++)
        trip_tf_destroy(e->steps[i]);
    free(e);
}

static void forget(trip_tf_editor *e, size_t step)
{
    trip_tf_destroy(*position(e, step));
    *position(e, step) = NULL;
}

/* Replaces the transfer function by `tf` and takes ownership. */
static void take(trip_tf_editor *e, trip_tf *tf)
{
    while (e->last > e->at)
        forget(e, e->last--);
    if (e->open && e->begun) {
        forget(e, e->at);
    } else {
        e->last = ++e->at;
        if (e->last - e->first > TRIP_TF_EDITOR_STEPS)
            forget(e, e->first++);
    }
    *position(e, e->at) = tf;
    e->begun = true;
    e->revision++;
}

int trip_tf_editor_set_text(trip_tf_editor *e, const char *name, const char *text)
{
    trip_tf *tf = NULL;
    int status = trip_tf_parse(&tf, name, text, strlen(text));
    if (!status && trip_tf_is_normalised(tf)) {
        trip_tf_destroy(tf);
        return trip_fail(TRIP_ERROR, "transfer function", name,
                         "runs over the range of the data, not over data units");
    }
    if (!status)
        take(e, tf);
    return status;
}

char *trip_tf_editor_text(const trip_tf_editor *e)
{
    return trip_tf_to_text(now(e));
}

int trip_tf_editor_save(const trip_tf_editor *e, const char *path)
{
    char *text = trip_tf_editor_text(e);
    int status = text ? trip_new_file_of_text("write", path, text)
                      : trip_fail(TRIP_ERROR, "write", path, "out of memory");
    free(text);
    return status;
}

const trip_tf_point *trip_tf_editor_points(const trip_tf_editor *e, size_t *count)
{
    return trip_tf_points(now(e), count);
}

trip_rgba trip_tf_editor_evaluate(const trip_tf_editor *e, double value)
{
    return trip_tf_evaluate(now(e), value);
}

uint64_t trip_tf_editor_revision(const trip_tf_editor *e)
{
    return e->revision;
}

int trip_tf_editor_find(const trip_tf_editor *e, double value, double opacity, double value_reach,
                        double opacity_reach)
{
    size_t count;
    const trip_tf_point *points = trip_tf_editor_points(e, &count);
    double best = 1;
    int found = -1;
    for (size_t i = 0; i < count; i++) {
        double distance = hypot((points[i].value - value) / value_reach,
                                (points[i].colour.opacity - opacity) / opacity_reach);
        if (distance <= best) {
            best = distance;
            found = (int)i;
        }
    }
    return found;
}

void trip_tf_editor_begin(trip_tf_editor *e)
{
    e->open = true;
    e->begun = false;
}

void trip_tf_editor_end(trip_tf_editor *e)
{
    e->open = e->begun = false;
}

/* Copies the points with room for `more`, for free(). Returns NULL if memory is exhausted. */
static trip_tf_point *copy_points(const trip_tf_editor *e, size_t more, size_t *count)
{
    const trip_tf_point *points = trip_tf_editor_points(e, count);
    trip_tf_point *copy = malloc((*count + more) * sizeof *copy);
    if (copy)
        memcpy(copy, points, *count * sizeof *copy);
    return copy;
}

/* Makes the points the transfer function, and frees them. */
static void use_points(trip_tf_editor *e, trip_tf_point *points, size_t count)
{
    trip_tf *tf = NULL;
    if (trip_tf_from_points(&tf, points, count, false, trip_tf_unit_world(now(e))) == 0)
        take(e, tf);
    free(points);
}

static double clamp(double x, double lo, double hi)
{
    return fmin(fmax(x, lo), hi);
}

int trip_tf_editor_add(trip_tf_editor *e, double value, double opacity)
{
    size_t count, at = 0;
    trip_tf_point *points = isfinite(value) ? copy_points(e, 1, &count) : NULL;
    if (!points || count == MAX_POINTS) {
        free(points);
        return -1;
    }
    while (at < count && points[at].value <= value)
        at++;
    memmove(points + at + 1, points + at, (count - at) * sizeof *points);
    points[at] = (trip_tf_point){ value, trip_tf_editor_evaluate(e, value) };
    points[at].colour.opacity = clamp(opacity, 0, 1);
    use_points(e, points, count + 1);
    return (int)at;
}

static bool has_point(const trip_tf_editor *e, int point)
{
    size_t count;
    trip_tf_editor_points(e, &count);
    return point >= 0 && (size_t)point < count;
}

void trip_tf_editor_move(trip_tf_editor *e, int point, double value, double opacity)
{
    size_t count, i = (size_t)point;
    if (!has_point(e, point) || !isfinite(value))
        return;
    trip_tf_point *points = copy_points(e, 0, &count);
    if (!points)
        return;
    points[i].value = clamp(value, i > 0 ? points[i - 1].value : -INFINITY,
                            i + 1 < count ? points[i + 1].value : INFINITY);
    points[i].colour.opacity = clamp(opacity, 0, 1);
    use_points(e, points, count);
}

void trip_tf_editor_set_colour(trip_tf_editor *e, int point, double r, double g, double b)
{
    size_t count;
    trip_tf_point *points = has_point(e, point) ? copy_points(e, 0, &count) : NULL;
    if (!points)
        return;
    double opacity = points[point].colour.opacity;
    points[point].colour = (trip_rgba){ clamp(r, 0, 1), clamp(g, 0, 1), clamp(b, 0, 1), opacity };
    use_points(e, points, count);
}

void trip_tf_editor_remove(trip_tf_editor *e, int point)
{
    size_t count;
    trip_tf_point *points = has_point(e, point) ? copy_points(e, 0, &count) : NULL;
    if (points && count > 1) {
        memmove(points + point, points + point + 1, (count - (size_t)point - 1) * sizeof *points);
        use_points(e, points, count - 1);
    } else {
        free(points);
    }
}

void trip_tf_editor_stretch(trip_tf_editor *e, double from, double factor, double centre)
{
    size_t count;
    trip_tf_point *points = factor > 0 ? copy_points(e, 0, &count) : NULL;
    bool finite = points != NULL;
    for (size_t i = 0; points && i < count; i++) {
        points[i].value = centre + (points[i].value - from) * factor;
        finite &= isfinite(points[i].value);
    }
    if (finite)
        use_points(e, points, count);
    else
        free(points);
}

bool trip_tf_editor_can_undo(const trip_tf_editor *e)
{
    return e->at > e->first;
}

bool trip_tf_editor_can_redo(const trip_tf_editor *e)
{
    return e->at < e->last;
}

void trip_tf_editor_undo(trip_tf_editor *e)
{
    trip_tf_editor_end(e);
    if (trip_tf_editor_can_undo(e)) {
        e->at--;
        e->revision++;
    }
}

void trip_tf_editor_redo(trip_tf_editor *e)
{
    trip_tf_editor_end(e);
    if (trip_tf_editor_can_redo(e)) {
        e->at++;
        e->revision++;
    }
}
