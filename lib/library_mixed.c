/* Volumes beside Gaussian scenes in one picture (render/mixed/mixture.h). Each volume is a context
 * of its own. It has the view, lights and clips of the picture, moved into its own space. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "clock.h"
#include "gaussian_frame.h"
#include "gaussian_set.h"
#include "library_context.h"
#include "mixture.h"
#include "normalise.h"
#include "placed_stream.h"
#include "report.h"

typedef struct volume {
    triptych *t;
    trip_affine place, inverse;
    double scale;
    char *function;             /* of the scene file; NULL: the function of the picture */
    trip_view_object object;    /* placed in world space */
    trip_depth_range depths;    /* in the begun frame */
    triptych_frame_stats drawn; /* over the slabs of the begun frame */
} volume;

struct trip_mixed {
    volume volumes[TRIP_MIXTURE_VOLUMES_MAX];
    unsigned count;
    bool leads; /* the first object is a volume */

    /* The begun frame. */
    double cuts[TRIP_MIXTURE_CUTS_MAX];
    unsigned cut_count;
    unsigned slab, next; /* slab 0 ends at cuts[0], the last one is open; the next volume in it */
    bool drawing;        /* the frame of volume `next` is begun */
    trip_mixture mixture;
    float *picture, *distances;
};

static const char *name_of(const triptych_object *o)
{
    return o->name ? o->name : o->path;
}

/* ---- opening ---- */

static void pass_line(void *user, const char *line)
{
    const triptych *t = user;
    if (t->take)
        t->take(t->take_user, line);
}

/* Repeats the failure of a volume's context in the picture's. Its line was passed on already. */
static int keep_error(triptych *t, const volume *v, int status)
{
    if (status >= 0)
        return status;
    pthread_mutex_lock(&t->lock);
    if (!*t->error)
        snprintf(t->error, sizeof t->error, "%s", v->t->error);
    pthread_mutex_unlock(&t->lock);
    return status;
}

static int place(volume *v, const triptych_object *o)
{
    trip_gaussian_transform made;
    if (!trip_gaussian_transform_make(&made, o->matrix) || !made.even)
        return trip_fail(TRIP_USAGE, "render", name_of(o),
                         "its matrix must move, turn and scale it evenly, without mirroring");
    memcpy(v->place.m, o->matrix, sizeof v->place.m);
    v->scale = made.scale;
    return trip_affine_invert(&v->place, &v->inverse)
               ? 0
               : trip_fail(TRIP_USAGE, "render", name_of(o), "its matrix is singular");
}

/* Describes the volume in world space. */
static int describe(triptych *t, volume *v)
{
    triptych_info info;
    int status = triptych_get_info(v->t, &info);
    if (status)
        return keep_error(t, v, status);
    const trip_view_object own = trip_view_object_of(v->t->session.data, v->t->session.text);
    v->object = (trip_view_object){
        .index_to_world = trip_affine_identity(),
        .up = trip_normalize(trip_affine_vector(&v->place, own.up)),
        .front = trip_normalize(trip_affine_vector(&v->place, own.front)),
    };
    for (int i = 0; i < 8; i++) {
        const trip_vec3 at = trip_affine_point(&v->place, trip_v3(i & 1 ? info.hi[0] : info.lo[0],
                                                                  i & 2 ? info.hi[1] : info.lo[1],
                                                                  i & 4 ? info.hi[2] : info.lo[2]));
        for (int a = 0; a < 3; a++) {
            const double x = trip_component(at, a);
            v->object.lo[a] = i ? fmin(v->object.lo[a], x) : x;
            v->object.hi[a] = i ? fmax(v->object.hi[a], x) : x;
        }
    }
    return 0;
}

static int open_volume(triptych *t, volume *v, const triptych_object *o, uint64_t memory_bytes)
{
    triptych_resources r = t->resources;
    r.memory_bytes = memory_bytes;
    r.keep_pages = 1; /* slabs share bricks */
    r.choose_later = 1;
    r.choices_folder = NULL;
    r.name = name_of(o);
    int status = place(v, o);
    if (!status && o->function && !(v->function = strdup(o->function)))
        status = trip_fail(TRIP_ERROR, "render", name_of(o), "out of memory");
    if (!status && triptych_create(&v->t))
        status = trip_fail(TRIP_ERROR, "render", name_of(o), "out of memory");
    if (status)
        return status;
    triptych_set_messages(v->t, pass_line, t);
    status = triptych_open(v->t, o->path, &r);
    if (!status)
        status = triptych_set_transfer_function(
            v->t, &(triptych_transfer_function){ .name = v->function });
    return status ? keep_error(t, v, status) : describe(t, v);
}

/* Returns the share of the memory for each volume and for the scenes with the picture. */
static int share_memory(uint64_t memory_bytes, unsigned shares, uint64_t *share)
{
    trip_budget *all = NULL;
    const int status = trip_budget_create(&all, memory_bytes);
    *share = status ? 0 : trip_budget_limit_bytes(all) / shares;
    trip_budget_destroy(all);
    return status;
}

int trip_context_open_mixed(triptych *t, const triptych_object *objects, unsigned count,
                            uint64_t memory_bytes)
{
    triptych_object *scenes = calloc(count, sizeof *scenes);
    bool *is_scene = calloc(count, sizeof *is_scene);
    unsigned scene_count = 0;
    uint64_t share = 0;
    int status = 0;
    t->mixed = calloc(1, sizeof *t->mixed);
    if (!scenes || !is_scene || !t->mixed)
        status = trip_fail(TRIP_ERROR, "render", t->name, "out of memory");
    for (unsigned i = 0; i < count && !status; i++) {
        is_scene[i] = trip_gaussian_set_is(objects[i].path);
        if (is_scene[i])
            scenes[scene_count++] = objects[i];
        else if (i - scene_count >= TRIP_MIXTURE_VOLUMES_MAX)
            status =
                trip_fail(TRIP_USAGE, "render", t->name,
                          "places more than %d volumes in one picture", TRIP_MIXTURE_VOLUMES_MAX);
        if (!i && !status)
            t->mixed->leads = !is_scene[i];
    }
    if (!status)
        status = share_memory(memory_bytes, count - scene_count + 1, &share);
    if (!status)
        status = trip_context_open_scenes(t, scenes, scene_count, share);
    for (unsigned i = 0; i < count && !status; i++)
        if (!is_scene[i])
            status = open_volume(t, &t->mixed->volumes[t->mixed->count++], &objects[i], share);
    free(scenes);
    free(is_scene);
    return status;
}

void trip_context_close_mixed(triptych *t)
{
    if (!t->mixed)
        return;
    for (unsigned i = 0; i < t->mixed->count; i++) {
        triptych_destroy(t->mixed->volumes[i].t);
        free(t->mixed->volumes[i].function);
    }
    free(t->mixed);
    t->mixed = NULL;
}

void trip_context_cancel_mixed(triptych *t)
{
    for (unsigned i = 0; t->mixed && i < t->mixed->count; i++)
        if (t->mixed->volumes[i].t)
            triptych_cancel(t->mixed->volumes[i].t);
}

int trip_context_use_mixed_function(triptych *t, const triptych_transfer_function *f)
{
    int status = 0;
    t->scene_opacity = f->opacity_scale;
    for (unsigned i = 0; i < t->mixed->count && !status; i++) {
        const volume *v = &t->mixed->volumes[i];
        triptych_transfer_function own = *f;
        if (v->function) {
            own.name = v->function;
            own.text = NULL;
        }
        status = keep_error(t, v, triptych_set_transfer_function(v->t, &own));
    }
    return status;
}

unsigned trip_context_count_mixed(const triptych *t)
{
    return t->mixed ? t->mixed->count : 0;
}

void trip_context_add_mixed(const triptych *t, trip_view_object *object)
{
    for (unsigned i = 0; i < t->mixed->count; i++) {
        const trip_view_object *o = &t->mixed->volumes[i].object;
        for (int a = 0; a < 3; a++) {
            object->lo[a] = fmin(object->lo[a], o->lo[a]);
            object->hi[a] = fmax(object->hi[a], o->hi[a]);
        }
        if (!i && t->mixed->leads) {
            object->up = o->up;
            object->front = o->front;
        }
    }
}

/* ---- frames ---- */

/* Sets the light in the space of a volume. */
static void move_light(const volume *v, triptych_light *light)
{
    const trip_vec3 toward = trip_v3(light->toward[0], light->toward[1], light->toward[2]);
    trip_vec3 moved = toward;
    if (light->kind == TRIPTYCH_LIGHT_POINT)
        moved = trip_affine_point(&v->inverse, toward);
    else if (light->kind == TRIPTYCH_LIGHT_DIRECTION)
        moved = trip_affine_vector(&v->inverse, toward);
    light->toward[0] = moved.x;
    light->toward[1] = moved.y;
    light->toward[2] = moved.z;
}

static int use_settings(triptych *t, const volume *v, int side)
{
    draw_settings s = t->given;
    s.scene = (triptych_scene_settings){ 0 };
    s.all.normalise = s.all.count_exactly = 0;
    s.all.samples = side > 1 ? 1 : s.all.samples;
    s.has_background = 1;
    memset(s.background, 0, sizeof s.background);
    if (!s.clip.box_of_voxels) { /* `cut` has the planes of world space */
        s.clip.box = 0;
        s.clip.planes = 0;
    }
    move_light(v, &s.light);
    return keep_error(t, v, draw_settings_use(v->t, &s));
}

static int use_view(triptych *t, const volume *v, int side)
{
    const trip_camera_params *p = &t->turned;
    const trip_vec3 eye = trip_affine_point(&v->inverse, p->eye);
    const trip_vec3 look = trip_affine_point(&v->inverse, p->look);
    const trip_vec3 up = trip_normalize(trip_affine_vector(&v->inverse, p->up));
    const double e[3] = { eye.x, eye.y, eye.z }, l[3] = { look.x, look.y, look.z };
    const double u[3] = { up.x, up.y, up.z };
    return keep_error(t, v,
                      triptych_set_view(v->t, &(triptych_view){
                                                  .width = p->width * side,
                                                  .height = p->height * side,
                                                  .eye = e,
                                                  .look = l,
                                                  .up = u,
                                                  .fov_degrees = p->fov_degrees,
                                                  .ortho_height = p->ortho_height / v->scale,
                                              }));
}

/* Returns the depths of the centres of all scenes. */
static trip_depth_range depths_of_scenes(const triptych *t)
{
    trip_depth_range all = { INFINITY, -INFINITY };
    for (unsigned i = 0; i < t->placed_count; i++) {
        const trip_placed_set *p = &t->placed[i];
        const trip_file_gaussian_header *h = &p->set->header;
        for (int k = 0; k < 8; k++) {
            double at[3];
            for (int a = 0; a < 3; a++) {
                at[a] = p->placement.m[a][3];
                for (int b = 0; b < 3; b++)
                    at[a] +=
                        p->placement.m[a][b] * (k >> b & 1 ? h->centre_hi[b] : h->centre_lo[b]);
            }
            const trip_depth_range r = trip_mixture_depths(&t->camera, at, at);
            all = (trip_depth_range){ fmin(all.lo, r.lo), fmax(all.hi, r.hi) };
        }
    }
    if (all.lo >= all.hi) { /* one depth is a range too */
        all.lo -= 1e-6 * fabs(all.lo);
        all.hi += 1e-6 * fabs(all.hi);
    }
    return all;
}

static int take_memory(triptych *t)
{
    struct trip_mixed *m = t->mixed;
    trip_budget *budget = t->session.budget;
    trip_mixture *x = &m->mixture;
    const size_t pixels = (size_t)t->camera.width * (size_t)t->camera.height;
    const bool far = t->given.all.depth;
    x->count = pixels;
    x->pixels = trip_budget_take(budget, pixels * sizeof *x->pixels);
    x->distances = far ? trip_budget_take(budget, pixels * sizeof *x->distances) : NULL;
    m->picture = trip_budget_take(budget, pixels * 4 * sizeof(float));
    m->distances = trip_budget_take(budget, pixels * sizeof(float));
    return x->pixels && (x->distances || !far) && m->picture && m->distances
               ? 0
               : trip_fail(TRIP_ERROR, "render", "memory",
                           "the pictures of several objects do not fit; raise --memory or lower "
                           "--size");
}

int trip_context_begin_mixed(triptych *t, int side)
{
    struct trip_mixed *m = t->mixed;
    trip_depth_range depths[TRIP_MIXTURE_VOLUMES_MAX];
    int status = take_memory(t);
    for (unsigned i = 0; i < m->count && !status; i++) {
        volume *v = &m->volumes[i];
        status = use_settings(t, v, side);
        if (!status)
            status = use_view(t, v, side);
        v->depths = depths[i] = trip_mixture_depths(&t->camera, v->object.lo, v->object.hi);
        v->drawn = (triptych_frame_stats){ 0 };
    }
    if (status)
        return status;
    m->cut_count = trip_mixture_cut(depths, m->count, depths_of_scenes(t), m->cuts);
    m->slab = m->next = 0;
    m->drawing = false;
    trip_mixture_begin(&m->mixture);
    return 0;
}

static trip_depth_range slab_of(const struct trip_mixed *m)
{
    return (trip_depth_range){ m->slab ? m->cuts[m->slab - 1] : -INFINITY,
                               m->slab < m->cut_count ? m->cuts[m->slab] : INFINITY };
}

/* Returns the half-spaces of the picture's clip and of a slab, in the space of a volume. The first
 * slab with volumes needs no plane in front, and the last slab none behind. */
static trip_clip clip_of(const triptych *t, const volume *v, trip_depth_range slab)
{
    const struct trip_mixed *m = t->mixed;
    const trip_camera *c = &t->camera;
    const double eye = trip_dot(c->forward, c->eye);
    trip_clip clip = trip_context_clip(t);
    v->t->slab_cuts = (m->slab > 1) + (m->slab + 1 < m->cut_count);
    if (m->slab > 1)
        trip_clip_add(&clip, c->forward, -eye - slab.lo);
    if (m->slab + 1 < m->cut_count)
        trip_clip_add(&clip, trip_scale(c->forward, -1), eye + slab.hi);
    return trip_clip_before(&clip, &v->place);
}

/* Adds the costs of a slab. */
static void note_stats(volume *v)
{
    triptych_frame_stats s;
    if (triptych_get_frame_stats(v->t, &s))
        return;
    const triptych_frame_stats before = v->drawn;
    v->drawn = s;
    v->drawn.ms += before.ms;
    v->drawn.plan_ms += before.plan_ms;
    v->drawn.wait_ms += before.wait_ms;
    v->drawn.draw_ms += before.draw_ms;
    v->drawn.merge_ms += before.merge_ms;
    v->drawn.splats += before.splats;
    v->drawn.bytes_read += before.bytes_read;
    v->drawn.reads += before.reads;
}

static bool meets(const struct trip_mixed *m, const volume *v, trip_depth_range slab)
{
    return m->slab && m->slab < m->cut_count && trip_mixture_meet(v->depths, slab);
}

static void end_volume(struct trip_mixed *m)
{
    if (!m->drawing)
        return;
    triptych_end(m->volumes[m->next].t);
    m->volumes[m->next].t->cut.count = 0;
    m->drawing = false;
}

/* Draws a part of the next volume of the slab, if it reaches into it. Returns 0 at its end. */
static int draw_next(triptych *t, trip_depth_range slab, uint64_t deadline_ns)
{
    struct trip_mixed *m = t->mixed;
    volume *v = &m->volumes[m->next];
    int status = 0;
    if (!meets(m, v, slab)) {
        m->next++;
        return 0;
    }
    if (!m->drawing) {
        v->t->cut = clip_of(t, v, slab);
        status = triptych_begin(v->t);
        m->drawing = !status;
    }
    if (!status)
        status = triptych_step(v->t, deadline_ns);
    if (status > 0)
        return status;
    if (!status)
        status = m->mixture.distances ? triptych_picture_and_depth(v->t, m->picture, m->distances)
                                      : triptych_picture(v->t, m->picture);
    if (!status)
        trip_mixture_add(&m->mixture, m->picture, m->distances, v->scale);
    end_volume(m);
    if (!status)
        note_stats(v);
    m->next++;
    return keep_error(t, v, status);
}

/* Draws the Gaussians up to the end of the slab, and composites it. */
static int end_slab(triptych *t, trip_depth_range slab, uint64_t deadline_ns)
{
    struct trip_mixed *m = t->mixed;
    int status = TRIP_FRAME_DONE;
    if (t->scene_frame)
        status = trip_gaussian_frame_step_to(t->scene_frame, slab.hi, deadline_ns);
    if (status != TRIP_FRAME_DONE)
        return status;
    if (t->scene_frame)
        status = trip_gaussian_frame_picture(t->scene_frame, m->picture, m->distances);
    if (status)
        return status;
    trip_mixture_end_slab(&m->mixture, &t->camera, slab, t->scene_frame ? m->picture : NULL,
                          m->distances);
    m->slab++;
    m->next = 0;
    return 0;
}

int trip_context_step_mixed(triptych *t, uint64_t deadline_ns)
{
    struct trip_mixed *m = t->mixed;
    int status = 0;
    while (!status && m->slab <= m->cut_count) {
        const trip_depth_range slab = slab_of(m);
        status =
            m->next < m->count ? draw_next(t, slab, deadline_ns) : end_slab(t, slab, deadline_ns);
        if (!status && trip_interrupted())
            status = trip_fail(TRIP_INTERRUPTED, "render", t->name, "interrupted");
        if (!status && t->show)
            trip_context_show_stage(t, "splat", m->slab, m->cut_count + 1);
        if (!status && m->slab <= m->cut_count && trip_now_ns() >= deadline_ns)
            return TRIP_FRAME_MORE;
    }
    return status;
}

int trip_context_take_mixed(triptych *t, float *rgba, float *depth)
{
    trip_mixture_picture(&t->mixed->mixture, rgba);
    if (depth)
        trip_mixture_write_distances(&t->mixed->mixture, depth);
    if (!t->given.all.normalise)
        trip_put_behind(rgba, t->mixed->mixture.count, t->settings.background);
    return 0;
}

void trip_context_await_mixed(const triptych *t, uint64_t timeout_ns)
{
    const struct trip_mixed *m = t->mixed;
    if (m->drawing)
        triptych_await(m->volumes[m->next].t, timeout_ns);
}

void trip_context_end_mixed(triptych *t)
{
    struct trip_mixed *m = t->mixed;
    end_volume(m);
    trip_budget *budget = t->session.budget;
    trip_mixture *x = &m->mixture;
    trip_budget_release(budget, x->pixels, x->count * sizeof *x->pixels);
    trip_budget_release(budget, x->distances, x->count * sizeof *x->distances);
    trip_budget_release(budget, m->picture, x->count * 4 * sizeof(float));
    trip_budget_release(budget, m->distances, x->count * sizeof(float));
    *x = (trip_mixture){ 0 };
    m->picture = m->distances = NULL;
}

/* The number of splats stays the number of Gaussians. */
void trip_context_add_mixed_stats(const triptych *t, triptych_frame_stats *stats)
{
    for (unsigned i = 0; i < t->mixed->count; i++) {
        const triptych_frame_stats *s = &t->mixed->volumes[i].drawn;
        stats->wait_ms += s->wait_ms;
        stats->draw_ms += s->draw_ms;
        stats->merge_ms += s->merge_ms;
        stats->bytes_read += s->bytes_read;
        stats->reads += s->reads;
        stats->memory_bytes += s->memory_bytes;
        stats->peak_memory_bytes += s->peak_memory_bytes;
    }
}

void trip_context_explain_mixed(const triptych *t, FILE *out)
{
    const struct trip_mixed *m = t->mixed;
    for (unsigned i = 0; i < m->count; i++)
        fprintf(out, "volume      %s: view depth %.6g to %.6g\n", m->volumes[i].t->name,
                m->volumes[i].depths.lo, m->volumes[i].depths.hi);
    fprintf(out, "slabs       %u between planes of equal view depth\n",
            m->cut_count ? m->cut_count - 1 : 0);
}
