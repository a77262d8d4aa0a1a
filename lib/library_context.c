/* Contexts, their data sets, and pictures (triptych.h). */
#include "triptych.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <xxhash.h>

#include "camera.h"
#include "library_context.h"
#include "dataset_level.h"
#include "gaussian_set.h"
#include "report.h"

/* ---- contexts ---- */

/* triptych_error() has the first failure of a call. */
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

/* Returns whether the line is a note that was passed on before. */
static bool is_noted(triptych *t, const char *line)
{
    static const char prefix[] = "triptych: note: ";
    bool found = false;
    if (strncmp(line, prefix, strlen(prefix)) != 0)
        return false;
    const uint64_t hash = XXH64(line, strlen(line), 0);
    pthread_mutex_lock(&t->lock);
    for (int i = 0; i < TRIP_CONTEXT_NOTES; i++)
        found = found || t->noted[i] == hash;
    if (!found) {
        memmove(t->noted, t->noted + 1, sizeof t->noted - sizeof *t->noted);
        t->noted[TRIP_CONTEXT_NOTES - 1] = hash;
    }
    pthread_mutex_unlock(&t->lock);
    return found;
}

/* Passes on each note once. */
static void pass_line(const char *line, void *user)
{
    triptych *t = user;
    if (t->take && !is_noted(t, line))
        t->take(t->take_user, line);
}

int triptych_create_version(triptych **out, unsigned header_version)
{
    triptych *t = *out = NULL;
    if (header_version != TRIPTYCH_HEADER_VERSION)
        return TRIPTYCH_USAGE;
    *out = t = calloc(1, sizeof *t);
    if (!t)
        return TRIPTYCH_ERROR;
    t->scope = (trip_scope){
        .failed = keep_failure, .sink = pass_line, .user = t, .signalled = trip_scope_signal()
    };
    pthread_mutex_init(&t->lock, NULL);
    t->settings = trip_settings_of(&t->given);
    t->kelvin[1] = TRIP_HOTTEST_KELVIN;
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

void triptych_set_progress(triptych *t,
                           void (*show)(void *user, const char *stage, uint64_t done,
                                        uint64_t total),
                           void *user)
{
    t->show = show;
    t->show_user = user;
}

void trip_context_show_stage(void *user, const char *stage, uint64_t done, uint64_t total)
{
    const triptych *t = user;
    t->show(t->show_user, stage, done, total);
}

void triptych_cancel(triptych *t)
{
    trip_scope_cancel(&t->scope);
    trip_context_cancel_mixed(t);
}

trip_scope *trip_context_enter(triptych *t)
{
    *t->error = 0;
    trip_scope_report_anew(&t->scope);
    return trip_scope_enter(&t->scope);
}

trip_scope *trip_context_enter_anew(triptych *t)
{
    if (!t->begun)
        trip_scope_renew(&t->scope);
    return trip_context_enter(t);
}

int trip_context_leave(trip_scope *before, int status)
{
    trip_scope_enter(before);
    return status;
}

int trip_context_check_open(const triptych *t)
{
    return t->open ? 0 : trip_fail(TRIP_USAGE, "render", "", "no data set is open");
}

int trip_context_check_idle(const triptych *t, bool needs_data)
{
    if (t->begun)
        return trip_fail(TRIP_USAGE, "render", "frame", "a frame is begun; end it first");
    return needs_data ? trip_context_check_open(t) : 0;
}

int trip_context_check_list(const triptych *t, unsigned number)
{
    int status = trip_context_check_volume(t);
    if (!status && number >= t->session.data->list_count)
        return trip_fail(TRIP_USAGE, "render", t->name,
                         "has %u lists, numbered from 0; there is no list %u",
                         t->session.data->list_count, number);
    return status;
}

/* ---- pictures ---- */

static void release_picture(triptych *t, trip_context_picture **position)
{
    trip_context_picture *p = *position;
    trip_budget_release(t->session.budget, p->pixels, p->bytes);
    *position = p->next;
    free(p);
}

static int take_picture(triptych *t, int width, int height, int channels, float **pixels)
{
    trip_context_picture *p = calloc(1, sizeof *p);
    if (!p)
        return trip_fail(TRIP_ERROR, "render", "picture", "out of memory");
    p->bytes = (size_t)width * (size_t)height * (size_t)channels * sizeof(float);
    p->pixels = trip_budget_take(t->session.budget, p->bytes);
    if (!p->pixels) {
        free(p);
        return trip_fail(
            TRIP_ERROR, "render", t->name,
            "a picture of %d x %d pixels does not fit in memory; raise --memory or lower --size",
            width, height);
    }
    p->next = t->pictures;
    t->pictures = p;
    *pixels = p->pixels;
    return 0;
}

int triptych_new_picture(triptych *t, int width, int height, int channels, float **pixels)
{
    trip_scope *before = trip_context_enter_anew(t);
    int status = trip_context_check_open(t);
    *pixels = NULL;
    if (!status &&
        (width < 1 || height < 1 || width > TRIP_PICTURE_MAX_PX || height > TRIP_PICTURE_MAX_PX))
        status = trip_fail(TRIP_USAGE, "render", "picture",
                           "the width and height must be 1 to %d pixels", TRIP_PICTURE_MAX_PX);
    if (!status && channels != 1 && channels != 4)
        status = trip_fail(TRIP_USAGE, "render", "picture",
                           "the number of channels must be 4, or 1 for distances");
    if (!status)
        status = take_picture(t, width, height, channels, pixels);
    return trip_context_leave(before, status);
}

void triptych_release_picture(triptych *t, float *pixels)
{
    for (trip_context_picture **p = &t->pictures; *p; p = &(*p)->next)
        if ((*p)->pixels == pixels) {
            release_picture(t, p);
            return;
        }
}

int triptych_prepare_write(triptych *t, const char *path, const char *depth_path)
{
    trip_scope *before = trip_context_enter_anew(t);
    int status = trip_image_check_path(path, NULL);
    if (!status && depth_path)
        status = trip_image_check_path(depth_path, &(trip_image_params){ .distances = true });
    if (!status)
        status = trip_image_prepare(&t->files, path);
    if (!status && depth_path)
        status = trip_image_prepare(&t->files, depth_path);
    return trip_context_leave(before, status);
}

int triptych_write(triptych *t, const char *path, int width, int height, const float *rgba)
{
    trip_scope *before = trip_context_enter_anew(t);
    int status = t->settings.background[3] < 1 ? trip_image_check_transparent(path) : 0;
    if (!status)
        status = trip_image_write(&t->files, path, width, height, rgba, NULL);
    return trip_context_leave(before, status);
}

int triptych_write_depth(triptych *t, const char *path, int width, int height, const float *depth)
{
    trip_scope *before = trip_context_enter_anew(t);
    const trip_image_params params = { .distances = true };
    return trip_context_leave(before,
                              trip_image_write(&t->files, path, width, height, depth, &params));
}

/* ---- data ---- */

static void close_data(triptych *t)
{
    while (t->pictures)
        release_picture(t, &t->pictures);
    trip_context_drop_stats(t);
    trip_context_drop_renderer(t);
    trip_field_destroy(t->source);
    t->source = NULL;
    trip_context_drop_level(t);
    trip_context_drop_heat(t);
    trip_context_close_scene(t);
    trip_context_close_mixed(t);
    session_close(&t->session);
    free(t->name);
    t->name = NULL;
    t->open = t->has_function = t->has_view = t->levels_warned = t->kernel_warned = false;
    t->nearest_noted = false;
}

void triptych_close(triptych *t)
{
    triptych_end(t);
    trip_scope *before = trip_context_enter_anew(t);
    close_data(t);
    trip_context_leave(before, 0);
}

void triptych_destroy(triptych *t)
{
    if (!t)
        return;
    triptych_close(t);
    trip_image_close(&t->files);
    pthread_mutex_destroy(&t->lock);
    free(t->choices_folder);
    free(t);
}

static int check_resources(const triptych_resources *r)
{
    bool known = r->renderer >= TRIPTYCH_RENDERER_AUTO &&
                 r->renderer <= TRIPTYCH_RENDERER_INTEGRAL && r->engine >= TRIPTYCH_ENGINE_AUTO &&
                 r->engine <= TRIPTYCH_ENGINE_NULL;
    return known ? 0 : trip_fail(TRIP_USAGE, "render", "resources", "unknown renderer or engine");
}

/* Returns whether the objects are more than scenes and one volume that stays where it is. */
static bool places_volumes(const triptych_object *objects, unsigned count)
{
    static const triptych_object unplaced = { .matrix = TRIPTYCH_UNPLACED };
    const bool placed =
        count > 1 || memcmp(objects->matrix, unplaced.matrix, sizeof unplaced.matrix) != 0;
    bool volumes = false;
    for (unsigned i = 0; i < count; i++)
        volumes |= !trip_gaussian_set_is(objects[i].path);
    return volumes && placed;
}

/* Opens one volume, or one or more objects. */
static int open_objects(triptych *t, const triptych_object *objects, unsigned count,
                        const triptych_resources *resources)
{
    const char *path = objects->path;
    trip_scope *before = trip_context_enter_anew(t);
    const triptych_resources wanted = resources ? *resources : (triptych_resources){ 0 };
    int status = trip_context_check_idle(t, false);
    if (!status)
        status = check_resources(&wanted);
    if (status)
        return trip_context_leave(before, status);
    close_data(t);
    t->resources = wanted;
    t->name = strdup(wanted.name ? wanted.name : path);
    free(t->choices_folder);
    t->choices_folder = wanted.choices_folder ? strdup(wanted.choices_folder) : NULL;
    t->choices_read = 0;
    if (!t->name)
        status = trip_fail(TRIP_ERROR, "render", path, "out of memory");
    else if (places_volumes(objects, count))
        status = trip_context_open_mixed(t, objects, count, wanted.memory_bytes);
    else if (count > 1 || trip_gaussian_set_is(path))
        status = trip_context_open_scenes(t, objects, count, wanted.memory_bytes);
    else
        status = session_open_data(&t->session, path, wanted.memory_bytes);
    t->open = status == 0;
    if (!t->open)
        close_data(t);
    t->session.input = t->name;
    t->resources.name = t->resources.choices_folder = NULL;
    return trip_context_leave(before, status);
}

int triptych_open(triptych *t, const char *path, const triptych_resources *resources)
{
    return open_objects(t, &(triptych_object){ .path = path, .matrix = TRIPTYCH_UNPLACED }, 1,
                        resources);
}

int triptych_open_objects(triptych *t, const triptych_object *objects, unsigned count,
                          const triptych_resources *resources)
{
    trip_scope *before = trip_context_enter_anew(t);
    int status = trip_context_check_idle(t, false);
    if (!status && (count < 1 || count > TRIPTYCH_OBJECTS_MAX))
        status = trip_fail(TRIP_USAGE, "render", "objects", "must be 1 to %d, not %u",
                           TRIPTYCH_OBJECTS_MAX, count);
    trip_context_leave(before, status);
    return status ? status : open_objects(t, objects, count, resources);
}

int triptych_add(triptych *t, const char *path)
{
    trip_scope *before = trip_context_enter_anew(t);
    int status = trip_context_check_idle(t, true);
    if (!status)
        status = trip_context_check_volume(t);
    if (status)
        return trip_context_leave(before, status);
    trip_context_drop_stats(t);
    trip_context_drop_renderer(t);
    trip_context_drop_level(t);
    status = session_add_data(&t->session, path);
    if (!status)
        t->has_function = t->has_view = false;
    return trip_context_leave(before, status);
}

/* Returns the position of a voxel's upper or lower edge along an axis. */
static double edge_of(const trip_coordinates *c, int axis, int64_t voxel, bool upper)
{
    const double half = 0.5 * trip_coordinates_width(c, axis, voxel);
    return trip_coordinates_at(c, axis, voxel) + (upper ? half : -half);
}

/* Finds the edges of voxels `first` to `last`, and their bounding box in world space. */
static void find_box(const trip_dataset *d, triptych_info *out)
{
    const trip_affine *m = &d->index_to_world;
    for (int a = 0; a < 3; a++)
        for (int end = 0; end < 2; end++) {
            out->edges[end][a] =
                edge_of(&d->coordinates, a, end ? out->last[a] : out->first[a], end);
            out->grid_edges[end][a] =
                edge_of(&d->coordinates, a, end ? (int64_t)d->header.dims[a] - 1 : 0, end);
        }
    for (int corner = 0; corner < 8; corner++) {
        double p[3];
        for (int a = 0; a < 3; a++)
            p[a] = out->edges[corner >> a & 1][a];
        trip_vec3 world = trip_affine_point(m, trip_v3(p[0], p[1], p[2]));
        for (int a = 0; a < 3; a++) {
            double x = trip_component(world, a);
            out->lo[a] = corner ? fmin(out->lo[a], x) : x;
            out->hi[a] = corner ? fmax(out->hi[a], x) : x;
        }
    }
}

static void describe_kept(const trip_dataset *d, triptych_info *out)
{
    double ends[2][3];
    trip_dataset_kept_bounds(d, ends[0], ends[1]);
    for (int a = 0; a < 3; a++) {
        out->first[a] = (int64_t)ends[0][a];
        out->last[a] = (int64_t)ends[1][a];
    }
    find_box(d, out);
}

static void describe_spacing(const trip_dataset *d, triptych_info *out)
{
    const double(*m)[4] = d->index_to_world.m;
    for (int a = 0; a < 3; a++) {
        const double length = trip_length(trip_v3(m[0][a], m[1][a], m[2][a]));
        const double *x = d->coordinates.along[a];
        double min = 1, max = 1;
        for (int64_t i = 1; x && i < d->coordinates.voxels[a]; i++) {
            min = fmin(min, x[i] - x[i - 1]);
            max = fmax(max, x[i] - x[i - 1]);
        }
        out->spacing_min[a] = min * length;
        out->spacing_max[a] = max * length;
    }
}

static void describe_codes(const trip_dataset *d, triptych_info *out)
{
    const trip_codes *c = &d->codes;
    out->codes = trip_codes_even(c) ? "even" : trip_codes_ids(c) ? "ids" : "knots";
    out->ids = trip_codes_ids(c) ? c->entries : 0;
    out->code_step_min = out->code_step_max = (c->hi - c->lo) / (TRIP_CODES - 1);
    for (uint32_t i = 0; i + 1 < c->entries; i++) {
        const double step = ldexp(c->table[i + 1] - c->table[i], -(int)c->step_log2);
        out->code_step_min = i > 0 ? fmin(out->code_step_min, step) : step;
        out->code_step_max = i > 0 ? fmax(out->code_step_max, step) : step;
    }
}

static triptych_info info_of(const trip_dataset *d)
{
    const trip_file_header *h = &d->header;
    triptych_info info = {
        .value_min = h->value_min,
        .value_max = h->value_max,
        .typical_min = h->typical_min,
        .typical_max = h->typical_max,
        .code_lo = h->code_lo,
        .code_hi = h->code_hi,
        .voxels = h->voxels,
        .kept = h->kept,
        .halo = h->halo,
        .bytes = d->bytes,
        .index_bytes = h->index_bytes,
        .checksum = h->header_checksum,
        .format_version = h->version,
        .lists = d->list_count,
        .code_bytes = h->code_bytes,
        .normal_bytes = d->computes_normals ? 0 : h->normal_bytes,
        .gradient_full = d->computes_normals ? 0 : h->gradient_full,
        .tile_voxels = 1u << h->tile_log2,
        .slab_sheets = h->slab_sheets,
        .page_bytes = 1u << h->page_log2,
        .notes = d->text,
    };
    for (int a = 0; a < 3; a++) {
        info.dims[a] = (int64_t)h->dims[a];
        info.gradient_step[a] = h->gradient_step[a];
    }
    memcpy(info.index_to_world, d->index_to_world.m, sizeof info.index_to_world);
    describe_codes(d, &info);
    describe_kept(d, &info);
    describe_spacing(d, &info);
    return info;
}

int triptych_get_info(triptych *t, triptych_info *out)
{
    trip_scope *before = trip_context_enter(t);
    int status = trip_context_check_volume(t);
    *out = status ? (triptych_info){ 0 } : info_of(t->session.data);
    return trip_context_leave(before, status);
}

static triptych_list list_of(const trip_list *l)
{
    const trip_kind_info *kind = trip_kind_of(l->kind);
    triptych_list list = {
        .path = l->path,
        .axis = l->axis,
        .level = l->level,
        .kind = kind->name,
        .drawn = kind->splatted,
        .dims = { l->dims[0], l->dims[1], l->dims[2] },
        .sheet_first = l->sheet_first,
        .sheet_step = l->sheet_step,
        .records = l->records,
        .slabs = l->slab_count,
        .bricks = l->brick_count,
    };
    memcpy(list.index_to_world, l->index_to_world.m, sizeof list.index_to_world);
    for (int plane = 0; plane < TRIP_PLANES; plane++)
        list.bytes += l->plane_bytes[plane];
    list.deviation_bytes = l->plane_bytes[TRIP_PLANE_DEVIATIONS];
    return list;
}

int triptych_get_list(triptych *t, unsigned number, triptych_list *out)
{
    trip_scope *before = trip_context_enter(t);
    int status = trip_context_check_list(t, number);
    *out = status ? (triptych_list){ 0 } : list_of(&t->session.data->lists[number]);
    return trip_context_leave(before, status);
}

int triptych_count_levels(triptych *t, triptych_classify classify, unsigned *levels)
{
    trip_scope *before = trip_context_enter(t);
    const trip_kind kind = classify == TRIPTYCH_CLASSIFY_PRE ? TRIP_KIND_MEANS : TRIP_KIND_VALUES;
    int status = trip_context_check_volume(t);
    *levels = status ? 0 : trip_dataset_levels(t->session.data, kind);
    return trip_context_leave(before, status);
}

static int verify_parts(const session *s)
{
    int status = 0;
    for (unsigned i = 0; i < s->part_count && !status; i++)
        status = trip_dataset_verify(s->parts[i], s->budget);
    return status;
}

int triptych_verify(triptych *t)
{
    trip_scope *before = trip_context_enter_anew(t);
    int status = trip_context_check_idle(t, true);
    if (!status)
        status = t->scene ? trip_context_verify_scenes(t) : verify_parts(&t->session);
    return trip_context_leave(before, status);
}
