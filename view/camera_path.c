#include "camera_path.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "clipping.h"
#include "geometry.h"
#include "report.h"

#define DEGREE (3.14159265358979323846 / 180)

void trip_camera_path_release(trip_camera_path *p)
{
    for (size_t i = 0; i < p->count; i++) {
        free(p->keys[i].function);
        free(p->keys[i].text);
    }
    free(p->keys);
    *p = (trip_camera_path){ 0 };
}

int trip_camera_path_add(trip_camera_path *p, double seconds, const trip_navigation *camera,
                         const char *text)
{
    bool later = !p->count || seconds > p->keys[p->count - 1].seconds;
    if (!later || p->count == TRIP_CAMERA_PATH_KEYS)
        return trip_fail(TRIP_USAGE, "path", "key",
                         later ? "too many keys" : "must be later than the key before");
    trip_path_key *keys = realloc(p->keys, (p->count + 1) * sizeof *keys);
    p->keys = keys ? keys : p->keys;
    char *copy = text && keys ? strdup(text) : NULL;
    if (!keys || (text && !copy))
        return trip_fail(TRIP_ERROR, "path", "key", "out of memory");
    keys[p->count++] = (trip_path_key){ .seconds = seconds, .camera = *camera, .text = copy };
    return 0;
}

/* ---- time ---- */

static double fps(const trip_camera_path *p)
{
    enum { DEFAULT_FPS = 30 };
    return p->frames_per_second > 0 ? p->frames_per_second : DEFAULT_FPS;
}

/* A loop requires two keys. */
static double loop(const trip_camera_path *p)
{
    return p->count > 1 ? p->loop_seconds : 0;
}

static double duration(const trip_camera_path *p)
{
    return p->count ? p->keys[p->count - 1].seconds - p->keys[0].seconds + loop(p) : 0;
}

int trip_camera_path_frames(const trip_camera_path *p)
{
    double steps = round(duration(p) * fps(p));
    if (p->count < 2)
        return (int)p->count;
    const int last = loop(p) > 0 ? 0 : 1; /* the first frame is not repeated */
    return steps < 1                         ? 1 + last
           : steps < TRIP_CAMERA_PATH_FRAMES ? (int)steps + last
                                             : TRIP_CAMERA_PATH_FRAMES;
}

double trip_camera_path_seconds(const trip_camera_path *p, int frame)
{
    int frames = trip_camera_path_frames(p), steps = loop(p) > 0 ? frames : frames - 1;
    if (frame >= steps)
        return p->keys[0].seconds + duration(p);
    return p->keys[0].seconds + duration(p) * frame / steps;
}

/* Returns the last key at or before the time, or the first key. */
static size_t key_before(const trip_camera_path *p, double seconds)
{
    size_t lo = 0, hi = p->count;
    while (hi - lo > 1) {
        size_t middle = (lo + hi) / 2;
        if (p->keys[middle].seconds <= seconds)
            lo = middle;
        else
            hi = middle;
    }
    return lo;
}

/* ---- splines ---- */

/* A time between two keys: share `s` of an interval of `step` seconds. `before` and `after` are the
 * neighbouring intervals, 0 at the ends of the path. */
typedef struct position {
    double s, step, before, after;
} position;

/* Returns the derivative at a key per interval (Catmull-Rom). Unequal intervals use the parabola
 * through three keys. The ends use the difference, so that two keys make a straight line. */
static double tangent(double back, double back_step, double ahead, double step)
{
    if (back_step == 0)
        return ahead;
    return (back / back_step * step + ahead / step * back_step) / (back_step + step) * step;
}

/* Evaluates the Hermite cubic from 0 to `change` with these derivatives at its ends. */
static double hermite(double change, double start, double end, double s)
{
    return ((start + end - 2 * change) * s + (3 * change - 2 * start - end)) * s * s + start * s;
}

/* Interpolates between v[1] and v[2]. */
static double spline(const double v[4], const position *at)
{
    double change = v[2] - v[1];
    double start = tangent(v[1] - v[0], at->before, change, at->step);
    double end = at->after == 0
                     ? change
                     : tangent(change, at->step, v[3] - v[2], at->after) / at->after * at->step;
    return v[1] + hermite(change, start, end, at->s);
}

/* ---- rotations ---- */

/* Columns: right, up, backward. */
typedef struct rotation {
    trip_vec3 x, y, z;
} rotation;

static rotation rotation_of(const trip_navigation *n)
{
    trip_navigation_axes a = trip_navigation_get_axes(n);
    return (rotation){ trip_v3(a.right[0], a.right[1], a.right[2]),
                       trip_v3(a.up[0], a.up[1], a.up[2]),
                       trip_v3(-a.forward[0], -a.forward[1], -a.forward[2]) };
}

/* Returns the rotation from a to b, as an axis times an angle of at most pi. */
static trip_vec3 turn_between(const rotation *a, const rotation *b)
{
    /* Uses the quaternion of b a^T, and computes its largest component first. */
    const double *p[3] = { &a->x.x, &a->y.x, &a->z.x }, *q[3] = { &b->x.x, &b->y.x, &b->z.x };
    double m[3][3] = { { 0 } }, w[4], v[4];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            for (int k = 0; k < 3; k++)
                m[i][j] += q[k][i] * p[k][j];
    double trace = m[0][0] + m[1][1] + m[2][2];
    int largest = 3;
    for (int i = 0; i < 3; i++)
        w[i] = 1 - trace + 2 * m[i][i];
    w[3] = 1 + trace;
    for (int i = 0; i < 3; i++)
        largest = w[i] > w[largest] ? i : largest;
    int i = largest, j = (i + 1) % 3, k = (i + 2) % 3;
    if (i == 3) {
        v[0] = m[2][1] - m[1][2];
        v[1] = m[0][2] - m[2][0];
        v[2] = m[1][0] - m[0][1];
    } else {
        v[i] = w[i];
        v[j] = m[i][j] + m[j][i];
        v[k] = m[i][k] + m[k][i];
    }
    v[3] = i == 3 ? w[3] : m[k][j] - m[j][k];
    double sign = v[3] < 0 ? -1 : 1;
    trip_vec3 axis = trip_scale(trip_v3(v[0], v[1], v[2]), sign);
    double length = trip_length(axis);
    return length > 0 ? trip_scale(axis, 2 * atan2(length, sign * v[3]) / length) : axis;
}

static trip_vec3 turned(trip_vec3 v, trip_vec3 turn)
{
    return trip_turned(v, trip_normalize(turn), trip_length(turn));
}

/* ---- the view ---- */

/* The point looked at, and the logarithms of the distance and of the picture's height. */
enum { LOOK, DISTANCE = 3, LENS, NUMBERS };

static void numbers_of(const trip_navigation *n, double out[NUMBERS])
{
    memcpy(out + LOOK, n->look, sizeof n->look);
    out[DISTANCE] = log(trip_navigation_distance(n));
    out[LENS] = log(n->ortho_height > 0 ? n->ortho_height : tan(n->fov_degrees / 2 * DEGREE));
}

/* Interpolates the rotation between keys i and i + 1 of four with the same spline as the numbers.
 */
static trip_vec3 spline_turn(const rotation r[4], const position *at)
{
    trip_vec3 turns[3], out;
    for (int i = 0; i < 3; i++)
        turns[i] = turn_between(&r[i], &r[i + 1]);
    double *to[3] = { &out.x, &out.y, &out.z };
    for (int c = 0; c < 3; c++) {
        double back = trip_component(turns[0], c), change = trip_component(turns[1], c);
        const double v[4] = { -back, 0, change, change + trip_component(turns[2], c) };
        *to[c] = spline(v, at);
    }
    return out;
}

static trip_navigation navigation_from(const double numbers[NUMBERS], const rotation *r,
                                       const trip_navigation *like)
{
    trip_navigation n = *like;
    double distance = exp(numbers[DISTANCE]);
    for (int c = 0; c < 3; c++) {
        n.look[c] = numbers[LOOK + c];
        n.eye[c] = n.look[c] + distance * trip_component(r->z, c);
        n.up[c] = trip_component(r->y, c);
    }
    if (n.ortho_height > 0)
        n.ortho_height = exp(numbers[LENS]);
    else
        n.fov_degrees = 2 * atan(exp(numbers[LENS])) / DEGREE;
    return n;
}

/* Returns a key by its number, also beyond the ends: a loop wraps around, and other paths repeat
 * the first and last key. */
typedef struct numbered_key {
    size_t at;
    double seconds;
} numbered_key;

static numbered_key key_numbered(const trip_camera_path *p, long number)
{
    const long count = (long)p->count;
    if (loop(p) > 0) {
        long round = number < 0 ? -1 : number >= count ? 1 : 0;
        size_t at = (size_t)(number - round * count);
        return (numbered_key){ at, p->keys[at].seconds + (double)round * duration(p) };
    }
    size_t at = (size_t)(number < 0 ? 0 : number < count ? number : count - 1);
    return (numbered_key){ at, p->keys[at].seconds };
}

trip_navigation trip_camera_path_view(const trip_camera_path *p, double seconds)
{
    const long k = (long)key_before(p, seconds);
    const trip_path_key *keys = p->keys;
    numbered_key near[4];
    size_t four[4];
    for (int i = 0; i < 4; i++) {
        near[i] = key_numbered(p, k - 1 + i);
        four[i] = near[i].at;
    }
    if (!(near[2].seconds > near[1].seconds) || seconds <= near[1].seconds)
        return keys[k].camera;
    if (seconds >= near[2].seconds)
        return keys[four[2]].camera;
    const double step = near[2].seconds - near[1].seconds;
    const position at = { .step = step,
                          .s = (seconds - near[1].seconds) / step,
                          .before = near[1].seconds - near[0].seconds,
                          .after = near[3].seconds - near[2].seconds };
    double numbers[4][NUMBERS], now[NUMBERS];
    rotation r[4];
    for (int i = 0; i < 4; i++) {
        numbers_of(&keys[four[i]].camera, numbers[i]);
        r[i] = rotation_of(&keys[four[i]].camera);
    }
    for (int i = 0; i < NUMBERS; i++) {
        const double v[4] = { numbers[0][i], numbers[1][i], numbers[2][i], numbers[3][i] };
        now[i] = spline(v, &at);
    }
    trip_vec3 turn = spline_turn(r, &at);
    const rotation turned_to = { turned(r[1].x, turn), turned(r[1].y, turn), turned(r[1].z, turn) };
    return navigation_from(now, &turned_to, &keys[k].camera);
}

/* Returns the next key and the share of the interval to it, or the same key at the end. */
static size_t next_key(const trip_camera_path *p, size_t k, double seconds, double *t)
{
    const numbered_key from = key_numbered(p, (long)k), to = key_numbered(p, (long)k + 1);
    *t = 0;
    if (!(to.seconds > from.seconds) || seconds <= from.seconds)
        return k;
    *t = seconds < to.seconds ? (seconds - from.seconds) / (to.seconds - from.seconds) : 1;
    return to.at;
}

/* Returns the key that sets the transfer function in force at a key, or -1 for the default. */
static int function_at(const trip_camera_path *p, size_t key)
{
    int k = (int)key;
    while (k >= 0 && !p->keys[k].function && !p->keys[k].text)
        k--;
    return k;
}

trip_path_mix trip_camera_path_mix(const trip_camera_path *p, double seconds)
{
    double t;
    const size_t k = key_before(p, seconds), next = next_key(p, k, seconds, &t);
    trip_path_mix mix = { .from = function_at(p, k), .to = function_at(p, next) };
    mix.t = mix.to != mix.from ? t : 0;
    return mix;
}

/* Returns the clipping in force at a key, or NULL if no key up to it sets any. */
static const triptych_clip *clip_at(const trip_camera_path *p, size_t key)
{
    for (const trip_path_key *k = p->keys + key; k >= p->keys; k--)
        if (k->has_clip)
            return &k->clip;
    return NULL;
}

bool trip_camera_path_clip(const trip_camera_path *p, double seconds, triptych_clip *clip)
{
    double t;
    const size_t k = key_before(p, seconds), next = next_key(p, k, seconds, &t);
    const triptych_clip *from = clip_at(p, k), *to = clip_at(p, next);
    if (from)
        *clip = to ? trip_clipping_mix(from, to, t) : *from;
    return from != NULL;
}
