#include "popping.h"

#include <math.h>
#include <stdio.h>

#include "report.h"

const accuracy_popping accuracy_poppings[ACCURACY_POPPINGS] = {
    { .name = "popping-post", .classify = TRIPTYCH_CLASSIFY_POST },
    { .name = "popping-pre", .classify = TRIPTYCH_CLASSIFY_PRE },
};

/* ---- the turn ---- */

/* A camera that turns around the object, at a distance where the whole object is visible from every
 * side. */
typedef struct orbit {
    accuracy_view view;
    triptych_info info;
    double distance;
} orbit;

static int find_turn(triptych *t, const accuracy_options *o, orbit *out)
{
    triptych_camera *c = &out->view.camera;
    out->view.name = "turned";
    int status = triptych_set_view(
        t, &(triptych_view){ .width = o->width, .height = o->height, .turntable = 1 });
    if (!status)
        status = triptych_get_camera(t, c);
    if (!status)
        status = triptych_get_info(t, &out->info);
    double squares = 0;
    for (int i = 0; i < 3 && !status; i++)
        squares += (c->look[i] - c->eye[i]) * (c->look[i] - c->eye[i]);
    out->distance = sqrt(squares);
    return status;
}

/* Transforms a direction of index space to world space. */
static void to_world(const triptych_info *info, const double index[3], double world[3])
{
    for (int i = 0; i < 3; i++)
        world[i] = info->index_to_world[i][0] * index[0] + info->index_to_world[i][1] * index[1] +
                   info->index_to_world[i][2] * index[2];
}

/* Sets the eye at an angle in index space, from X towards Y, slightly above. */
static void turn_to(orbit *turn, double degrees)
{
    const double angle = degrees * 3.14159265358979323846 / 180;
    const double toward_eye[3] = { cos(angle), sin(angle), 0.3 }, up[3] = { 0, 0, 1 };
    triptych_camera *c = &turn->view.camera;
    double way[3];
    to_world(&turn->info, toward_eye, way);
    to_world(&turn->info, up, c->up);
    const double length = sqrt(way[0] * way[0] + way[1] * way[1] + way[2] * way[2]);
    for (int i = 0; i < 3; i++)
        c->eye[i] = c->look[i] + way[i] * turn->distance / length;
}

/* ---- pictures of the turn ---- */

static int draw_steps(accuracy_contexts *contexts, triptych *t, const draw_settings *settings,
                      orbit *turn, float *rgba, bench_popping_changes *changes)
{
    int status = 0;
    double ms;
    for (int i = 0; i <= BENCH_POPPING_STEPS && !status; i++) {
        turn_to(turn, bench_popping_degrees(i));
        status = accuracy_view_use(t, &turn->view);
        if (!status)
            status =
                accuracy_contexts_draw(contexts, 0, TRIPTYCH_RENDERER_CPU, settings, rgba, &ms);
        if (!status)
            bench_popping_add(changes, i, rgba);
    }
    return status;
}

/* Measures all settings. If a frame fails, its message becomes the reason for leaving out the
 * table. */
static int measure_settings(accuracy_popping *p, accuracy_contexts *contexts, triptych *t,
                            const draw_settings *defaults, bench_progress *progress, orbit *turn,
                            float *rgba, bench_popping_changes *changes)
{
    int status = 0;
    for (int i = 0; i < ACCURACY_POPPING_ROWS && !status; i++) {
        const bench_popping_setting *one = &bench_popping_settings[i];
        draw_settings settings = *defaults;
        settings.all.classify = p->classify;
        settings.all.method = one->method;
        settings.all.h = one->method != TRIPTYCH_METHOD_MERGE ? 0
                         : one->h > 0                         ? one->h
                                                              : TRIPTYCH_ZERO;
        bench_progress_step(progress, p->name);
        status = draw_steps(contexts, t, &settings, turn, rgba, changes);
        if (!status)
            bench_popping_find(changes, one, &p->rows[i]);
    }
    p->state = status ? ACCURACY_LEFT_OUT : ACCURACY_MEASURED;
    if (status == TRIP_ERROR)
        snprintf(p->why, sizeof p->why, "%s", contexts->why[0][TRIPTYCH_RENDERER_CPU]);
    return status == TRIP_ERROR ? 0 : status;
}

int accuracy_popping_measure(accuracy_popping *p, accuracy_contexts *contexts,
                             const draw_settings *defaults, bench_progress *progress, float *rgba)
{
    const accuracy_options *o = contexts->options;
    triptych *t = contexts->contexts[0][TRIPTYCH_RENDERER_CPU];
    bench_popping_changes changes;
    orbit turn;
    if (find_turn(t, o, &turn))
        return trip_fail(TRIP_ERROR, "accuracy", o->data[0], "cannot set a view: %s",
                         triptych_error(t));
    const size_t pixels = (size_t)o->width * (size_t)o->height;
    if (!bench_popping_begin(&changes, contexts->budget, pixels)) {
        snprintf(p->why, sizeof p->why,
                 "the changes need %zu bytes, which do not fit the memory; raise --memory",
                 bench_popping_bytes(pixels));
        p->state = ACCURACY_LEFT_OUT;
        return 0;
    }
    int status = measure_settings(p, contexts, t, defaults, progress, &turn, rgba, &changes);
    bench_popping_end(&changes);
    return status;
}
