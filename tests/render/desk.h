/* A scene of three layers and all objects needed to draw one frame of it. Tests that draw a frame
 * step by step use it. */
#ifndef DESK_H
#define DESK_H

#include "scenes.h"
#include "test.h"

enum { SIZE = 40, PIXELS = SIZE * SIZE };

/* All objects needed to draw one frame. */
typedef struct desk {
    const scene *scene;
    trip_settings settings;
    trip_camera camera;
    trip_plan plan;
    trip_renderer *renderer;
    trip_reader *reader;
    trip_frame frame;
} desk;

static inline void make_scene(scene *s)
{
    scene_create(s, &(scene_params){ .dims = { 40, 30, 20 }, .tile_voxels = 16, .normals = true });
    scene_colour(s, 0, 65535, 1, 0.8, 0.6, 0.02);
}

/* Returns a view in which all three layers have weight. */
static inline trip_camera_params view_of(const scene *s)
{
    return scene_view(s, trip_v3(1, 1.2, 0.9), 60, 40, SIZE);
}

static inline void set_up_to(desk *d, const scene *s, const scene_renderer *kind,
                             trip_reader_params params, trip_classify classify)
{
    trip_camera_params view = view_of(s);
    *d = (desk){ .scene = s, .settings = trip_settings_default() };
    d->settings.h = 0.2;
    d->settings.classify = classify;
    assert_int_equal(trip_camera_make(&d->camera, &view, &s->data->index_to_world), 0);
    assert_int_equal(
        trip_plan_make(&d->plan, s->data, &d->camera, &d->settings, s->table, s->budget), 0);
    params.planes = d->plan.planes;
    assert_int_equal(trip_reader_create(&d->reader, s->data, &params, s->budget), 0);
    assert_int_equal(kind->create(&d->renderer, s->budget), 0);
    d->frame = (trip_frame){ .data = s->data,
                             .camera = &d->camera,
                             .settings = &d->settings,
                             .plan = &d->plan,
                             .table = s->table };
}

static inline void set_up(desk *d, const scene *s, const scene_renderer *kind,
                          trip_reader_params params)
{
    set_up_to(d, s, kind, params, TRIP_CLASSIFY_PRE);
}

static inline void put_away(desk *d)
{
    trip_reader_destroy(d->reader);
    d->renderer->ops->destroy(d->renderer);
    trip_plan_release(&d->plan, d->scene->budget);
}

static const trip_reader_params small_slots = { .slots = 2, .slot_bytes = 4096 };

static inline void draw_whole(desk *d, float *rgba)
{
    trip_frame_stats stats;
    assert_int_equal(trip_frame_draw(d->renderer, d->reader, &d->frame, rgba, NULL, &stats), 0);
}

#endif
