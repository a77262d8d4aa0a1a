#include "triptych.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "brick.h"
#include "context.h"
#include "cpu/cpu_renderer.h"
#include "report.h"
#include "view.h"

enum { MOST_THREADS = 256, USUAL_SIZE = 1024 };

/* ---- contexts ---- */

/* The first failure of a call is the one that it returns. */
static void keep_failure(void *user, int status, const char *line)
{
    triptych *t = user;
    (void)status;
    pthread_mutex_lock(&t->lock);
    if (!*t->error)
        snprintf(t->error, sizeof t->error, "%s", line);
    pthread_mutex_unlock(&t->lock);
    if (t->take)
        t->take(t->take_user, line);
}

static void pass_line(const char *line, void *user)
{
    triptych *t = user;
    if (t->take)
        t->take(t->take_user, line);
}

int triptych_create(triptych **out)
{
    triptych *t = calloc(1, sizeof *t);
    *out = t;
    if (!t)
        return TRIPTYCH_ERROR;
    t->scope = (trip_scope){ .failed = keep_failure, .sink = pass_line, .user = t };
    pthread_mutex_init(&t->lock, NULL);
    t->settings = trip_settings_default();
    return TRIPTYCH_OK;
}

const char *triptych_error(const triptych *t)
{
    return t->error;
}

const char *triptych_version(void)
{
    return TRIP_VERSION;
}

void triptych_set_messages(triptych *t, void (*take)(void *user, const char *line), void *user)
{
    t->take = take;
    t->take_user = user;
}

void triptych_set_progress(triptych *t, void (*tell)(void *user, uint64_t splats, uint64_t total),
                           void *user)
{
    t->progress = tell;
    t->progress_user = user;
}

void triptych_cancel(triptych *t)
{
    trip_scope_cancel(&t->scope);
}

/* Every call works in the context's scope; leave() with what enter() returned. */
static trip_scope *enter(triptych *t)
{
    *t->error = 0;
    return trip_scope_enter(&t->scope);
}

/* A call that is not about a frame that is begun: what was cancelled before is forgotten. */
static trip_scope *enter_anew(triptych *t)
{
    if (!t->begun)
        trip_scope_renew(&t->scope);
    return enter(t);
}

static int leave(trip_scope *before, int status)
{
    trip_scope_enter(before);
    return status;
}

/* What cannot be done while a frame is begun, or without a data set. */
static int check_idle(const triptych *t, bool needs_data)
{
    if (t->begun)
        return trip_fail(TRIP_USAGE, "render", "frame", "one is begun: end it first");
    if (needs_data && !t->open)
        return trip_fail(TRIP_USAGE, "render", "", "no data set is open");
    return 0;
}

/* ---- data ---- */

static void drop_reader(triptych *t)
{
    trip_reader_destroy(t->reader);
    t->reader = NULL;
}

static void close_data(triptych *t)
{
    drop_reader(t);
    if (t->renderer)
        t->renderer->ops->destroy(t->renderer);
    t->renderer = NULL;
    session_close(&t->session);
    free(t->name);
    t->name = NULL;
    t->open = t->has_function = t->has_view = false;
}

void triptych_close(triptych *t)
{
    triptych_end(t);
    trip_scope *before = enter_anew(t);
    close_data(t);
    leave(before, 0);
}

void triptych_destroy(triptych *t)
{
    if (!t)
        return;
    triptych_close(t);
    trip_image_close(&t->pictures);
    pthread_mutex_destroy(&t->lock);
    free(t);
}

static int check_resources(const triptych_resources *r)
{
    bool known = r->renderer >= TRIPTYCH_RENDERER_AUTO &&
                 r->renderer <= TRIPTYCH_RENDERER_REFERENCE && r->engine >= TRIPTYCH_ENGINE_AUTO &&
                 r->engine <= TRIPTYCH_ENGINE_NULL;
    return known ? 0
                 : trip_fail(TRIP_USAGE, "render", "resources",
                             "there is no such renderer or engine");
}

int triptych_open(triptych *t, const char *path, const triptych_resources *resources)
{
    trip_scope *before = enter_anew(t);
    const triptych_resources wanted = resources ? *resources : (triptych_resources){ 0 };
    int status = check_idle(t, false);
    if (!status)
        status = check_resources(&wanted);
    if (status)
        return leave(before, status);
    close_data(t);
    t->resources = wanted;
    t->name = strdup(wanted.name ? wanted.name : path);
    status = t->name ? session_open_data(&t->session, path, wanted.memory_bytes)
                     : trip_fail(TRIP_ERROR, "render", path, "out of memory");
    t->open = status == 0;
    if (!t->open)
        close_data(t);
    t->session.input = t->name;
    t->resources.name = NULL;
    return leave(before, status);
}

static uint64_t kept_voxels(const trip_dataset *d)
{
    const trip_list *list = trip_dataset_find(d, 0, 0, TRIP_KIND_VOXELS);
    return list ? list->records : 0;
}

static void box_of(const trip_dataset *d, triptych_info *out)
{
    double ends[2][3];
    trip_dataset_kept_bounds(d, ends[0], ends[1]);
    for (int corner = 0; corner < 8; corner++) {
        trip_vec3 p = trip_affine_point(
            &d->index_to_world,
            trip_v3(ends[corner & 1][0], ends[corner >> 1 & 1][1], ends[corner >> 2][2]));
        for (int a = 0; a < 3; a++) {
            double x = trip_component(p, a);
            out->lo[a] = corner && out->lo[a] < x ? out->lo[a] : x;
            out->hi[a] = corner && out->hi[a] > x ? out->hi[a] : x;
        }
    }
}

int triptych_get_info(triptych *t, triptych_info *out)
{
    trip_scope *before = enter(t);
    const trip_dataset *d = t->session.data;
    memset(out, 0, sizeof *out);
    if (!t->open)
        return leave(before, trip_fail(TRIP_USAGE, "render", "", "no data set is open"));
    for (int a = 0; a < 3; a++)
        out->dims[a] = (int64_t)d->header.dims[a];
    memcpy(out->index_to_world, d->index_to_world.m, sizeof out->index_to_world);
    box_of(d, out);
    out->value_min = d->header.value_min;
    out->value_max = d->header.value_max;
    out->kept = kept_voxels(d);
    out->bytes = d->bytes;
    for (unsigned i = 0; i < d->list_count; i++)
        out->lists += d->lists[i].kind == TRIP_KIND_VOXELS;
    out->normals = d->header.planes >> TRIP_PLANE_NORMALS & 1;
    return leave(before, 0);
}

int triptych_brick(triptych *t, const char *volume, const char *data_set,
                   const char *const *functions, const triptych_resources *resources)
{
    trip_scope *before = enter_anew(t);
    const triptych_resources r = resources ? *resources : (triptych_resources){ 0 };
    trip_brick_summary summary;
    size_t count = 0;
    while (functions && functions[count])
        count++;
    int status = check_idle(t, false);
    if (!status)
        status = trip_brick(
            &(trip_brick_params){ .input = volume,
                                  .output = data_set,
                                  .functions = functions,
                                  .function_count = count,
                                  .automatic = true,
                                  .replace = true,
                                  .memory_bytes = r.memory_bytes,
                                  .threads = r.threads < MOST_THREADS ? r.threads : MOST_THREADS },
            &summary);
    return leave(before, status);
}

/* ---- what is drawn ---- */

static int use_function(triptych *t, const triptych_function *f)
{
    bool missing = false;
    const session_look look = { .tf = f->name,
                                .opacity_scale = f->opacity_scale,
                                .window = f->window,
                                .level = f->level,
                                .missing = f->left_out ? &missing : NULL };
    int status = session_use_function(&t->session, &look);
    if (f->left_out)
        *f->left_out = missing;
    t->has_function |= !status && !missing;
    return status;
}

static int check_function(const triptych_function *f)
{
    bool finite = isfinite(f->opacity_scale) && isfinite(f->window) && isfinite(f->level);
    return finite && f->opacity_scale >= 0 && f->window >= 0
               ? 0
               : trip_fail(TRIP_USAGE, "render", "function",
                           "opacity scale and window are finite and not below 0");
}

int triptych_set_function(triptych *t, const triptych_function *function)
{
    trip_scope *before = enter_anew(t);
    const triptych_function usual = { 0 };
    const triptych_function *f = function ? function : &usual;
    int status = check_idle(t, true);
    if (!status)
        status = check_function(f);
    return leave(before, status ? status : use_function(t, f));
}

triptych_settings triptych_default_settings(void)
{
    const trip_settings s = trip_settings_default();
    return (triptych_settings){
        .method = (triptych_method)s.method,
        .traversal = (triptych_traversal)s.traversal,
        .target = (triptych_target)s.target,
        .shading = s.shading,
        .headlight = s.headlight,
        .light = { s.light_direction.x, s.light_direction.y, s.light_direction.z },
        .h = s.h,
        .kernel_radius = s.kernel_radius,
        .background = { s.background[0], s.background[1], s.background[2], s.background[3] },
    };
}

static const char *fault_of_settings(const triptych_settings *s)
{
    trip_vec3 light = trip_v3(s->light[0], s->light[1], s->light[2]);
    double length = trip_length(light);
    if (s->method < TRIPTYCH_MERGE || s->method > TRIPTYCH_AXIS ||
        s->traversal < TRIPTYCH_OUTWARD || s->traversal > TRIPTYCH_ASCENDING ||
        s->target < TRIPTYCH_RGBA32F || s->target > TRIPTYCH_RGBA8)
        return "there is no such method, traversal or target";
    if (!(s->h >= 0 && s->h < 1))
        return "h lies between 0 and below 1";
    if (!(s->kernel_radius >= 0.1 && s->kernel_radius <= 100))
        return "the kernel radius lies between 0.1 and 100 voxels";
    if (s->shading && !s->headlight && !(length > 0 && isfinite(length)))
        return "the direction to the light is zero or not finite";
    for (int i = 0; i < 4; i++)
        if (!(s->background[i] >= 0 && s->background[i] <= 1))
            return "components of the background lie between 0 and 1";
    return NULL;
}

int triptych_set_settings(triptych *t, const triptych_settings *s)
{
    trip_scope *before = enter_anew(t);
    const char *fault = fault_of_settings(s);
    int status = check_idle(t, false);
    if (!status && fault)
        status = trip_fail(TRIP_USAGE, "render", "settings", "%s", fault);
    if (status)
        return leave(before, status);
    t->settings = (trip_settings){
        .method = (trip_method)s->method,
        .traversal = (trip_traversal)s->traversal,
        .target = (trip_target)s->target,
        .indexed = s->indexed,
        .triangles = s->triangles,
        .shading = s->shading,
        .headlight = s->headlight,
        .h = s->h,
        .kernel_radius = s->kernel_radius,
        .background = { s->background[0], s->background[1], s->background[2], s->background[3] },
    };
    if (!s->headlight)
        t->settings.light_direction =
            trip_normalize(trip_v3(s->light[0], s->light[1], s->light[2]));
    return leave(before, 0);
}

static int find_view(triptych *t, const triptych_view *given)
{
    const triptych_resources *r = &t->resources;
    trip_engine engine = (trip_engine)r->engine;
    const session_reader wanted = {
        .engine = engine == TRIP_ENGINE_NULL ? TRIP_ENGINE_AUTO : engine,
        .threads = (int)(r->threads < MOST_THREADS ? r->threads : MOST_THREADS),
    };
    triptych_view view = *given;
    trip_found_view found;
    view.width = view.width ? view.width : USUAL_SIZE;
    view.height = view.height ? view.height : USUAL_SIZE;
    int status = t->has_function ? 0 : use_function(t, &(triptych_function){ 0 });
    if (!status)
        status = trip_view_find(&found, &view, &t->session, t->settings.kernel_radius, &wanted);
    if (status)
        return status;
    t->view = t->turned = found.params;
    t->axis = found.axis;
    t->fit_splats = found.splats;
    t->has_view = true;
    return 0;
}

int triptych_set_view(triptych *t, const triptych_view *view)
{
    trip_scope *before = enter_anew(t);
    int status = check_idle(t, true);
    return leave(before, status ? status : find_view(t, view));
}

int triptych_turn(triptych *t, double degrees)
{
    trip_scope *before = enter_anew(t);
    int status = check_idle(t, true);
    if (!status && !isfinite(degrees))
        status = trip_fail(TRIP_USAGE, "render", "view", "the angle is not finite");
    if (!status && !t->has_view)
        status = find_view(t, &(triptych_view){ 0 });
    if (!status)
        t->turned = degrees != 0 ? trip_camera_turn(&t->view, t->axis, degrees) : t->view;
    return leave(before, status);
}

/* ---- frames ---- */

/* One that reads all the planes wanted. */
static int make_reader(triptych *t, unsigned planes)
{
    const triptych_resources *r = &t->resources;
    bool finds_hidden = !strcmp(t->renderer->ops->name, "cpu");
    bool draws_all = r->read_hidden || t->counting;
    const session_reader wanted = {
        .engine = (trip_engine)r->engine,
        .planes = planes,
        .threads = (int)(r->threads < MOST_THREADS ? r->threads : MOST_THREADS),
        .cache = r->keep_pages && !t->counting,
        .renderer = t->renderer,
        .skip = finds_hidden && !draws_all ? trip_cpu_covered : NULL,
        .skip_user = t->renderer,
    };
    if (t->reader && !(planes & ~t->planes))
        return 0;
    drop_reader(t);
    t->planes = planes;
    return session_make_reader(&t->session, &t->reader, &wanted);
}

void trip_context_count(triptych *t)
{
    drop_reader(t);
    t->counting = true;
}

static int prepare(triptych *t)
{
    session *s = &t->session;
    const triptych_resources *r = &t->resources;
    int status = check_idle(t, true);
    if (status)
        return status;
    if (!t->has_function)
        status = use_function(t, &(triptych_function){ 0 });
    if (!status && !t->has_view)
        status = find_view(t, &(triptych_view){ 0 });
    if (!status && !t->renderer)
        status = trip_renderer_create(&t->renderer, (trip_renderer_kind)r->renderer, r->threads,
                                      s->budget);
    if (!status)
        status = trip_camera_make(&t->camera, &t->turned, &s->data->index_to_world);
    if (!status)
        status = trip_plan_make(&t->plan, s->data, &t->camera, &t->settings, s->table, s->budget);
    t->begun = status == 0;
    return status;
}

int trip_context_prepare(triptych *t)
{
    trip_scope *before = enter_anew(t);
    return leave(before, prepare(t));
}

static int start(triptych *t)
{
    int status = make_reader(t, t->plan.planes);
    t->frame = (trip_frame){
        .data = t->session.data,
        .camera = &t->camera,
        .settings = &t->settings,
        .plan = &t->plan,
        .table = t->session.table,
        .count = t->counting,
        .progress = t->progress,
        .progress_user = t->progress_user,
    };
    t->drawn = status == 0;
    if (!status)
        status = trip_frame_begin(&t->drawing, t->renderer, t->reader, &t->frame);
    return status;
}

static void end(triptych *t)
{
    if (t->drawn)
        trip_frame_end(&t->drawing);
    if (t->begun)
        trip_plan_release(&t->plan, t->session.budget);
    t->begun = t->drawn = false;
}

int triptych_begin(triptych *t)
{
    trip_scope *before = enter_anew(t);
    int status = t->begun && !t->drawn ? 0 : prepare(t);
    if (status)
        return leave(before, status);
    status = start(t);
    if (status)
        end(t);
    return leave(before, status);
}

static int check_drawing(const triptych *t)
{
    return t->drawn ? 0 : trip_fail(TRIP_USAGE, "render", "frame", "none is begun");
}

int triptych_step(triptych *t, uint64_t deadline_ns)
{
    trip_scope *before = enter(t);
    int status = check_drawing(t);
    return leave(before, status ? status : trip_frame_step(&t->drawing, deadline_ns));
}

int triptych_await(triptych *t, uint64_t timeout_ns)
{
    trip_scope *before = enter(t);
    int status = check_drawing(t);
    if (!status)
        trip_frame_await(&t->drawing, timeout_ns);
    return leave(before, status);
}

int triptych_picture(triptych *t, float *rgba)
{
    trip_scope *before = enter(t);
    int status = check_drawing(t);
    return leave(before, status ? status : trip_frame_picture(&t->drawing, rgba, NULL));
}

void triptych_end(triptych *t)
{
    trip_scope *before = trip_scope_enter(&t->scope);
    end(t);
    leave(before, 0);
}

/* Whoever cancels is noticed even while the disk is waited for. */
int triptych_draw(triptych *t, float *rgba)
{
    enum { LOOK_NS = 20000000 };
    int status = triptych_begin(t);
    if (status)
        return status;
    while ((status = triptych_step(t, UINT64_MAX)) == TRIPTYCH_WAITS)
        triptych_await(t, LOOK_NS);
    if (!status)
        status = triptych_picture(t, rgba);
    triptych_end(t);
    return status;
}

int triptych_write(triptych *t, const char *path, int width, int height, const float *rgba)
{
    trip_scope *before = enter_anew(t);
    return leave(before, trip_image_write(&t->pictures, path, width, height, rgba, NULL));
}
