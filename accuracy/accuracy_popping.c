#include "accuracy_popping.h"

#include <math.h>
#include <stdio.h>

#include "report.h"

const accuracy_popping accuracy_poppings[ACCURACY_POPPINGS] = {
    { .name = "popping-post", .classify = TRIPTYCH_CLASSIFY_POST },
    { .name = "popping-pre", .classify = TRIPTYCH_CLASSIFY_PRE },
};

/* A camera that turns around the object, at a distance where the whole object is visible from every
 * side, and the settings that all pictures share. */
typedef struct orbit {
    accuracy_view view;
    triptych_info info;
    double distance;
    accuracy_contexts *contexts;
    draw_settings settings;
    float *rgba;
    measure_progress *progress; /* each setting is a step */
    int *begun;                 /* number of its steps */
    const char *name;
    const measure_popping_setting *last;
} orbit;

static int find_turn(triptych *t, orbit *out)
{
    const accuracy_options *o = out->contexts->options;
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

static int draw_step(void *user, const measure_popping_setting *of, double degrees)
{
    orbit *turn = user;
    double ms;
    if (of != turn->last) {
        measure_progress_step(turn->progress, turn->name);
        ++*turn->begun;
    }
    turn->last = of;
    turn->settings.all.method = of->method;
    turn->settings.all.h = of->method != TRIPTYCH_METHOD_MERGE ? 0
                           : of->h > 0                         ? of->h
                                                               : TRIPTYCH_ZERO;
    turn_to(turn, degrees);
    int status = accuracy_view_use(turn->contexts->contexts[0][TRIPTYCH_RENDERER_CPU], &turn->view);
    return status ? status
                  : accuracy_contexts_draw(turn->contexts, 0, TRIPTYCH_RENDERER_CPU,
                                           &turn->settings, turn->rgba, &ms);
}

/* Measures all settings. If a frame fails, its message becomes the reason for leaving out the
 * table. */
static int measure_rows(accuracy_popping *p, orbit *turn, size_t pixels)
{
    accuracy_contexts *contexts = turn->contexts;
    const size_t bytes = measure_popping_bytes(pixels);
    void *memory = trip_budget_take(contexts->budget, bytes);
    p->state = ACCURACY_LEFT_OUT;
    if (!memory) {
        snprintf(p->why, sizeof p->why,
                 "the changes need %zu bytes, which do not fit the memory; raise --memory", bytes);
        return 0;
    }
    int status = measure_popping_all(draw_step, turn, turn->rgba, pixels, memory,
                                     ACCURACY_POPPING_ROWS, p->rows);
    trip_budget_release(contexts->budget, memory, bytes);
    if (!status)
        p->state = ACCURACY_MEASURED;
    else if (status == TRIP_ERROR)
        snprintf(p->why, sizeof p->why, "%s", contexts->why[0][TRIPTYCH_RENDERER_CPU]);
    return status == TRIP_ERROR ? 0 : status;
}

int accuracy_popping_measure(accuracy_popping *p, accuracy_contexts *contexts,
                             const draw_settings *defaults, measure_progress *progress, float *rgba,
                             int *begun)
{
    const accuracy_options *o = contexts->options;
    triptych *t = contexts->contexts[0][TRIPTYCH_RENDERER_CPU];
    orbit turn = { .contexts = contexts,
                   .settings = accuracy_setting_fixed(defaults, p->classify),
                   .rgba = rgba,
                   .progress = progress,
                   .begun = begun,
                   .name = p->name };
    if (find_turn(t, &turn))
        return trip_fail(TRIP_ERROR, "accuracy", o->data[0], "cannot set a view: %s",
                         triptych_error(t));
    p->rows = cJSON_CreateArray();
    return measure_rows(p, &turn, (size_t)o->width * (size_t)o->height);
}
