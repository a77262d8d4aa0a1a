/* Finds the visible point at a position of the picture, with one ray. */
#include "library_context.h"
#include "ray_probe.h"
#include "report.h"

/* In parallel views a ray starts in the plane of the eye. */
static trip_vec3 origin_of(const trip_camera *c, double x, double y)
{
    if (!c->ortho)
        return c->eye;
    return trip_add(c->eye, trip_add(trip_scale(c->rx, x), trip_scale(c->ry, y)));
}

static void put(double out[3], trip_vec3 v)
{
    out[0] = v.x;
    out[1] = v.y;
    out[2] = v.z;
}

static triptych_hit hit_of(const trip_ray_probe *probe, const trip_ray_hit *found)
{
    const trip_draw_codes *draw = &probe->draw;
    trip_vec3 position = trip_add(probe->origin, trip_scale(probe->direction, found->z));
    triptych_hit hit = { .opacity = found->opacity,
                         .value = draw->of_stored
                                      ? draw->lo + (draw->hi - draw->lo) * found->code / 65535
                                      : trip_codes_value(&draw->stored, found->code),
                         .depth = found->z * probe->world_per_z,
                         .depth_first = found->first_z * probe->world_per_z };
    for (int a = 0; a < 3; a++)
        hit.index[a] =
            trip_coordinates_index(&probe->data->coordinates, a, trip_component(position, a));
    put(hit.position, trip_affine_point(&probe->data->index_to_world, position));
    return hit;
}

/* Uses a temporary reader, which is destroyed before the reader of the frames is made. */
static int find_hit(triptych *t, trip_ray_probe *probe, triptych_hit *out)
{
    const triptych_resources *r = &t->resources;
    trip_engine engine = (trip_engine)r->engine;
    const session_reader wanted = {
        .engine = engine == TRIP_ENGINE_NULL ? TRIP_ENGINE_AUTO : engine,
        .threads = (int)trip_context_threads(r->threads),
    };
    trip_ray_hit found;
    int status = session_make_reader(&t->session, &probe->reader, &wanted);
    if (!status)
        status = trip_ray_probe_find(probe, &found);
    trip_reader_destroy(probe->reader);
    if (!status && found.opacity > 0)
        *out = hit_of(probe, &found);
    return status;
}

static int prepare(triptych *t, double x, double y, trip_camera *camera)
{
    int status = trip_context_check_idle(t, true);
    if (!status)
        status = trip_context_check_volume(t);
    if (!status && !(isfinite(x) && isfinite(y)))
        status = trip_fail(TRIP_USAGE, "render", "probe", "the position is not finite");
    if (!status && !t->has_view)
        status = trip_context_find_view(t, &(triptych_view){ 0 });
    if (!status)
        status = trip_camera_make(camera, &t->turned, &t->session.data->index_to_world);
    return status;
}

int triptych_probe(triptych *t, double x, double y, triptych_hit *out)
{
    trip_scope *before = trip_context_enter_anew(t);
    trip_camera camera;
    bool nearest = false;
    *out = (triptych_hit){ 0 };
    int status = prepare(t, x, y, &camera);
    if (!status)
        status = trip_context_takes_nearest(t, &nearest);
    if (status)
        return trip_context_leave(before, status);
    trip_ray_probe probe = { .data = t->session.data,
                             .budget = t->session.budget,
                             .table = session_table(&t->session, !nearest),
                             .draw = nearest ? trip_draw_codes_as_stored(&t->session.data->codes)
                                             : t->session.draw,
                             .nearest = nearest,
                             .origin = origin_of(&camera, x, y),
                             .direction = trip_camera_ray(&camera, x, y),
                             .world_per_z = trip_camera_ray_length(&camera, x, y),
                             .clip = trip_context_clip(t) };
    probe.clip = trip_clip_before(&probe.clip, &t->session.data->index_to_world);
    return trip_context_leave(before, find_hit(t, &probe, out));
}
