#include "gl/resident.h"

#include <assert.h>
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

#include "dataset_normals.h"
#include "gl/shared.h"
#include "renderer.h"
#include "report.h"

static_assert(TRIP_RUN_RECORDS_MAX <= TRIP_FRAME_PIECE, "a run fits a piece");

enum { MAX_COORDINATE = 65536, AXES = 3 };

/* Returns the list with the vertices for `list`: itself in the form resident. Otherwise it is the Z
 * list of the same level and kind, or else Y, or X. */
static const trip_list *base_for(const trip_gl_resident *r, const trip_list *list)
{
    const trip_dataset *data = r->data;
    const trip_list *base = r->replicated ? list : NULL;
    for (int axis = AXES - 1; axis >= 0 && !base; axis--)
        base = trip_dataset_along(data, list, axis);
    return base;
}

/* Returns the number of the vertex array for lists along an axis. */
static int array_of(const trip_gl_resident *r, int axis)
{
    return r->replicated ? axis : 0;
}

static bool is_splatted(const trip_list *list)
{
    const trip_kind_info *kind = trip_kind_of(list->kind);
    return kind->splatted && !kind->coarse;
}

/* Assigns every list its range in the arrays. */
static void lay_out(trip_gl_resident *r)
{
    const trip_dataset *data = r->data;
    for (unsigned i = 0; i < data->list_count; i++) {
        const trip_list *list = &data->lists[i];
        if (!is_splatted(list))
            continue;
        r->lists[i].order_first = r->order_counts[list->axis];
        r->lists[i].vertex_first = r->replicated ? r->lists[i].order_first : r->vertex_count;
        r->order_counts[list->axis] += list->records;
        if (!r->replicated && base_for(r, list) == list)
            r->vertex_count += list->records;
    }
    for (unsigned i = 0; i < data->list_count; i++)
        if (is_splatted(&data->lists[i]))
            r->lists[i].vertex_first = r->lists[base_for(r, &data->lists[i])->index].vertex_first;
    for (int a = 0; a < AXES && r->replicated; a++)
        r->vertex_count =
            r->order_counts[a] > r->vertex_count ? r->order_counts[a] : r->vertex_count;
}

static int check_size(const trip_gl_resident *r, size_t block_bytes)
{
    const trip_dataset *data = r->data;
    for (unsigned i = 0; i < data->list_count; i++)
        for (int a = 0; a < AXES; a++)
            if (is_splatted(&data->lists[i]) && data->lists[i].dims[a] > MAX_COORDINATE)
                return trip_fail(
                    TRIP_ERROR, "gl", data->path,
                    "lists in GPU memory are limited to %d voxels along each axis; use "
                    "--submit replicated",
                    MAX_COORDINATE);
    uint64_t max = r->vertex_count;
    for (int a = 0; a < AXES; a++)
        max = r->order_counts[a] > max ? r->order_counts[a] : max;
    if (max <= block_bytes / sizeof(trip_gl_vertex) && max <= INT32_MAX)
        return TRIP_OK;
    return trip_fail(TRIP_ERROR, "gl", data->path,
                     "lists in GPU memory of %" PRIu64
                     " splats exceed this driver's buffer limit of %zu bytes; "
                     "use --submit replicated",
                     max, block_bytes);
}

static int no_memory(const trip_gl_resident *r)
{
    return trip_fail(TRIP_ERROR, "gl", r->data->path,
                     "lists in GPU memory hold the whole data set, %" PRIu64
                     " splats, which does not fit the memory given; raise --memory or use "
                     "--submit replicated",
                     r->vertex_count);
}

static int make_array(trip_gl_resident *r, GLuint *buffer, uint64_t count, size_t each_bytes)
{
    uint64_t bytes = (count ? count : 1) * each_bytes;
    if (!trip_budget_charge(r->budget, bytes))
        return no_memory(r);
    r->bytes += bytes;
    glCreateBuffers(1, buffer);
    glNamedBufferStorage(*buffer, (GLsizeiptr)bytes, NULL, GL_DYNAMIC_STORAGE_BIT);
    if (glGetError() == GL_NO_ERROR)
        return TRIP_OK;
    return trip_fail(
        TRIP_ERROR, "gl", r->data->path,
        "lists in GPU memory do not fit the memory of the GPU; use --submit replicated");
}

static int make_arrays(trip_gl_resident *r)
{
    int status = TRIP_OK;
    for (int a = 0; a < (r->replicated ? AXES : 1) && !status; a++) {
        const uint64_t count = r->replicated ? r->order_counts[a] : r->vertex_count;
        status = make_array(r, &r->vertices[a], count, sizeof(trip_gl_vertex));
        if (!status && r->planes >> TRIP_PLANE_NORMALS & 1)
            status = make_array(r, &r->normals[a], count, sizeof(uint32_t));
    }
    for (int a = 0; a < AXES && !status && !r->replicated; a++)
        status = make_array(r, &r->order[a], r->order_counts[a], sizeof(uint32_t));
    return status;
}

/* ---- loading ---- */

/* Loads list by list, in pieces of at most TRIP_FRAME_PIECE splats. The list with the vertices
 * comes first in each level. */
struct trip_gl_loading {
    trip_gl_resident *to;
    /* The current list has the level and kind of list number `base` and the axis (base's + turn) %
     * 3. */
    unsigned base;
    int turn;
    const trip_list *list; /* NULL before the list begins */
    uint64_t filled;       /* number of its records already loaded */
    /* Data of the current level, in the order of its base list. */
    trip_gl_vertex *vertices;
    size_t vertex_bytes;
    uint64_t *sheet_firsts; /* first record of every sheet of the base list, and the end */
    size_t sheet_bytes;
    /* The fields down to next_run are used only while the reader is open; `reader` is NULL
     * otherwise. */
    trip_reader *reader;
    trip_selection selection;
    trip_pass pass;
    /* If normals are computed: the lists with values along the axis of the base list. */
    trip_pass around;
    trip_selection *around_selections; /* room for all lists */
    trip_batch batch;
    bool in_batch;
    size_t next_run;
    /* The current piece. */
    uint32_t piece; /* number of records */
    uint32_t positions[TRIP_FRAME_PIECE], normals[TRIP_FRAME_PIECE];
    uint32_t voxels[TRIP_RUN_RECORDS_MAX];
};

static const trip_list *base_of(const trip_gl_loading *l)
{
    return &l->to->data->lists[l->base];
}

/* ---- positions ---- */

static void position_of(int axis, const trip_run *run, uint32_t voxel, uint32_t p[3])
{
    p[axis] = (uint32_t)run->sheet;
    p[(axis + 1) % 3] = (uint32_t)run->u + trip_voxel_u(voxel);
    p[(axis + 2) % 3] = (uint32_t)run->v + trip_voxel_v(voxel);
}

static uint64_t morton_of(int axis, const uint32_t p[3])
{
    return trip_morton(p[(axis + 1) % 3], p[(axis + 2) % 3]);
}

/* Returns the index of a voxel in the base list, or -1. Searches its sheet by Morton code. */
static int64_t find_vertex(const trip_gl_loading *l, const uint32_t p[3])
{
    const trip_list *base = base_of(l);
    if (p[base->axis] >= base->dims[base->axis])
        return -1;
    uint64_t lo = l->sheet_firsts[p[base->axis]], end = l->sheet_firsts[p[base->axis] + 1];
    uint64_t hi = end, wanted = morton_of(base->axis, p);
    while (lo < hi) {
        uint64_t middle = lo + (hi - lo) / 2;
        const trip_gl_vertex *v = &l->vertices[middle];
        const uint32_t at[3] = { v->xy & 0xffff, v->xy >> 16, v->zc & 0xffff };
        if (morton_of(base->axis, at) < wanted)
            lo = middle + 1;
        else
            hi = middle;
    }
    bool found = lo < end && l->vertices[lo].xy == (p[0] | p[1] << 16) &&
                 (l->vertices[lo].zc & 0xffff) == p[2];
    return found ? (int64_t)lo : -1;
}

static void add_vertices(trip_gl_loading *l, const trip_run *run)
{
    for (uint32_t k = 0; k < run->count; k++) {
        uint32_t p[3];
        position_of(l->list->axis, run, l->voxels[k], p);
        l->vertices[l->filled + k] =
            (trip_gl_vertex){ p[0] | p[1] << 16, p[2] | trip_voxel_code(l->voxels[k]) << 16 };
        l->positions[l->piece + k] = (uint32_t)(l->filled + k);
    }
    l->sheet_firsts[run->sheet + 1] = l->filled + run->count;
}

static int find_vertices(trip_gl_loading *l, const trip_run *run)
{
    const trip_list *base = base_of(l);
    for (uint32_t k = 0; k < run->count; k++) {
        uint32_t p[3];
        position_of(l->list->axis, run, l->voxels[k], p);
        int64_t at = find_vertex(l, p);
        if (at < 0)
            return trip_fail(TRIP_ERROR, "gl", l->to->data->path,
                             "voxel (%u, %u, %u) of list %c is not in list %c", p[0], p[1], p[2],
                             "xyz"[l->list->axis], "xyz"[base->axis]);
        l->positions[l->piece + k] = (uint32_t)at;
    }
    return TRIP_OK;
}

static int add_run(trip_gl_loading *l, const trip_run *run)
{
    const trip_block block = trip_block_of(&l->batch, run);
    int status = TRIP_OK;
    if (run->count > l->list->records - l->filled)
        return trip_fail(TRIP_ERROR, "gl", l->to->data->path,
                         "list %c contains more splats than its header states; brick the volume "
                         "again",
                         "xyz"[l->list->axis]);
    trip_block_voxels(&block, 0, run->count, l->voxels);
    if (l->list != base_of(l))
        status = find_vertices(l, run);
    else
        add_vertices(l, run);
    if (block.normals)
        trip_block_normals(&block, 0, run->count, l->normals + l->piece);
    l->piece += run->count;
    l->filled += run->count;
    return status;
}

/* ---- pieces ---- */

static void upload_part(GLuint buffer, uint64_t first, size_t count, size_t each_bytes,
                        const void *from)
{
    glNamedBufferSubData(buffer, (GLintptr)(first * each_bytes), (GLsizeiptr)(count * each_bytes),
                         from);
}

/* Uploads the current piece. */
static void upload(trip_gl_loading *l)
{
    const trip_gl_resident *to = l->to;
    const trip_gl_resident_list *at = &to->lists[l->list->index];
    uint64_t first = l->filled - l->piece, vertex = at->vertex_first + first;
    for (uint32_t k = 0; k < l->piece; k++)
        l->positions[k] += (uint32_t)at->vertex_first;
    const int array = array_of(to, l->list->axis);
    if (!to->replicated)
        upload_part(to->order[l->list->axis], at->order_first + first, l->piece,
                    sizeof *l->positions, l->positions);
    if (l->list != base_of(l))
        return;
    upload_part(to->vertices[array], vertex, l->piece, sizeof *l->vertices, l->vertices + first);
    if (to->normals[array])
        upload_part(to->normals[array], vertex, l->piece, sizeof *l->normals, l->normals);
}

static int load_piece(trip_gl_loading *l)
{
    const trip_batch *b = &l->batch;
    int status = TRIP_OK;
    l->piece = 0;
    do
        status = add_run(l, &b->runs[l->next_run++]);
    while (!status && l->next_run < b->run_count &&
           l->piece + b->runs[l->next_run].count <= TRIP_FRAME_PIECE);
    if (!status)
        upload(l);
    l->in_batch = !status && l->next_run < b->run_count;
    if (!l->in_batch)
        trip_reader_release(l->reader, &l->batch);
    return status;
}

/* ---- lists ---- */

/* Returns the first list not yet loaded, or NULL. */
static const trip_list *next_list(trip_gl_loading *l)
{
    const trip_dataset *data = l->to->data;
    for (; l->base < data->list_count; l->base++, l->turn = 0) {
        const trip_list *base = base_of(l), *list = NULL;
        if (!trip_kind_of(base->kind)->splatted || trip_kind_of(base->kind)->coarse ||
            base_for(l->to, base) != base)
            continue;
        const int turns = l->to->replicated ? 1 : AXES;
        for (; l->turn < turns && !list; l->turn += !list)
            list = trip_dataset_along(data, base, (base->axis + l->turn) % 3);
        if (list)
            return list;
    }
    return NULL;
}

static void *take_again(trip_budget *budget, void *memory, size_t *bytes, size_t wanted)
{
    trip_budget_release(budget, memory, *bytes);
    *bytes = wanted > 0 ? wanted : 1;
    return trip_budget_take(budget, *bytes);
}

static int make_room(trip_gl_loading *l)
{
    const trip_list *base = base_of(l);
    trip_budget *budget = l->to->budget;
    l->vertices = take_again(budget, l->vertices, &l->vertex_bytes,
                             (size_t)base->records * sizeof *l->vertices);
    l->sheet_firsts = take_again(budget, l->sheet_firsts, &l->sheet_bytes,
                                 (size_t)(base->dims[base->axis] + 1) * sizeof *l->sheet_firsts);
    if (l->vertices && l->sheet_firsts)
        return TRIP_OK;
    return trip_fail(TRIP_ERROR, "gl", l->to->data->path,
                     "lists in GPU memory do not fit the memory given; raise --memory or use "
                     "--submit replicated");
}

static void drop_around(trip_gl_loading *l)
{
    const size_t room = l->to->list_count * sizeof *l->around_selections;
    for (unsigned i = 0; i < l->around.selection_count; i++)
        trip_selection_destroy(&l->around_selections[i], l->to->budget);
    trip_budget_release(l->to->budget, l->around_selections, l->around_selections ? room : 0);
    l->around_selections = NULL;
    l->around = (trip_pass){ 0 };
}

/* Adds the lists with the values from which the normals of the base list are computed. */
static int add_around(trip_gl_loading *l, const trip_list *list)
{
    const trip_dataset *data = l->to->data;
    int status = TRIP_OK;
    if (list != base_of(l) || !data->computes_normals || !(l->to->planes >> TRIP_PLANE_NORMALS & 1))
        return TRIP_OK;
    l->around_selections =
        trip_budget_take(l->to->budget, l->to->list_count * sizeof *l->around_selections);
    if (!l->around_selections)
        return no_memory(l->to);
    l->around.selections = l->around_selections;
    for (unsigned i = 0; i < data->list_count && !status; i++) {
        const trip_list *of = &data->lists[i];
        trip_selection *s = &l->around_selections[l->around.selection_count];
        if (of->axis != list->axis || of->level != list->level ||
            !trip_dataset_has_gradients_of(data, of))
            continue;
        status = trip_selection_create_whole(s, data, of, false, l->to->budget);
        s->ahead = 1;
        l->around.selection_count += status == TRIP_OK;
    }
    l->pass.around = &l->around;
    return status;
}

static int begin_list(trip_gl_loading *l, const trip_list *list)
{
    int status = list == base_of(l) ? make_room(l) : TRIP_OK;
    trip_selection_destroy(&l->selection, l->to->budget);
    drop_around(l);
    if (!status)
        status =
            trip_selection_create_whole(&l->selection, l->to->data, list, false, l->to->budget);
    if (status)
        return status;
    l->pass = trip_pass_of(&l->selection);
    status = add_around(l, list);
    if (status)
        return status;
    l->list = list;
    l->filled = 0;
    return trip_reader_begin(l->reader, &l->pass);
}

static int end_list(trip_gl_loading *l)
{
    const trip_list *list = l->list;
    if (l->filled != list->records)
        return trip_fail(TRIP_ERROR, "gl", l->to->data->path,
                         "list %c contains fewer splats than its header states; brick the volume "
                         "again",
                         "xyz"[list->axis]);
    /* Empty sheets end where the sheet before them ends. */
    for (int64_t s = 0; s < list->dims[list->axis] && list == base_of(l); s++)
        if (l->sheet_firsts[s + 1] < l->sheet_firsts[s])
            l->sheet_firsts[s + 1] = l->sheet_firsts[s];
    l->list = NULL;
    l->turn++;
    return TRIP_OK;
}

/* Takes the next batch from the reader, or ends the list. */
static int next_batch(trip_gl_loading *l)
{
    if (!trip_reader_await(l->reader, 0))
        return TRIP_FRAME_WAITS;
    int status = trip_reader_next(l->reader, &l->batch);
    l->in_batch = status > 0;
    l->next_run = 0;
    if (status == 0)
        status = end_list(l);
    return status < 0 ? status : TRIP_FRAME_MORE;
}

static int step_loading(trip_gl_loading *l)
{
    int status;
    if (l->in_batch)
        status = load_piece(l);
    else if (l->list)
        return next_batch(l);
    else {
        const trip_list *list = next_list(l);
        if (!list)
            return TRIP_FRAME_DONE;
        status = begin_list(l, list);
    }
    return status < 0 ? status : TRIP_FRAME_MORE;
}

static void await_loading(trip_gl_loading *l, uint64_t timeout_ns)
{
    if (l->list && !l->in_batch)
        trip_reader_await(l->reader, timeout_ns);
}

/* ---- creation ---- */

static int create_loading(trip_gl_loading **out, trip_gl_resident *to)
{
    trip_gl_loading *l = trip_budget_take(to->budget, sizeof *l);
    *out = l;
    if (!l)
        return trip_fail(
            TRIP_ERROR, "gl", to->data->path,
            "the memory given does not suffice to load lists in GPU memory; raise --memory");
    l->to = to;
    return TRIP_OK;
}

static int open_loading(trip_gl_loading *l)
{
    const trip_gl_resident *to = l->to;
    return trip_reader_create(&l->reader, to->data,
                              &(trip_reader_params){ .planes = to->planes, .slots = 2 },
                              to->budget);
}

static void close_loading(trip_gl_loading *l)
{
    if (l->in_batch)
        trip_reader_release(l->reader, &l->batch);
    trip_reader_destroy(l->reader);
    trip_selection_destroy(&l->selection, l->to->budget);
    drop_around(l);
    l->reader = NULL;
    l->in_batch = false;
    l->list = NULL;
}

static void destroy_loading(trip_gl_loading *l)
{
    if (!l)
        return;
    trip_budget *budget = l->to->budget;
    close_loading(l);
    trip_budget_release(budget, l->vertices, l->vertex_bytes);
    trip_budget_release(budget, l->sheet_firsts, l->sheet_bytes);
    trip_budget_release(budget, l, sizeof *l);
}

/* ---- the arrays of a data set ---- */

static int begin_loading(trip_gl_resident *r, size_t block_bytes)
{
    r->lists = trip_budget_take(r->budget, r->list_count * sizeof *r->lists);
    if (!r->lists)
        return no_memory(r);
    lay_out(r);
    int status = check_size(r, block_bytes);
    if (!status)
        status = make_arrays(r);
    return status ? status : create_loading(&r->loading, r);
}

static bool holds(const trip_gl_resident *r, const trip_dataset *data, unsigned planes)
{
    return r->data == data && r->checksum == data->header.header_checksum && r->planes == planes;
}

int trip_gl_resident_begin(trip_gl_resident *r, const trip_dataset *data, unsigned planes,
                           bool replicated, size_t block_bytes)
{
    int status = TRIP_OK;
    if (!holds(r, data, planes) || r->replicated != replicated) {
        trip_gl_resident_release(r);
        r->data = data;
        r->checksum = data->header.header_checksum;
        r->planes = planes;
        r->replicated = replicated;
        r->list_count = data->list_count;
        status = begin_loading(r, block_bytes);
    }
    if (!status && r->loading)
        status = open_loading(r->loading);
    if (status)
        trip_gl_resident_release(r);
    return status;
}

int trip_gl_resident_load(trip_gl_resident *r)
{
    if (!r->loading)
        return TRIP_FRAME_DONE;
    int status = step_loading(r->loading);
    if (status == TRIP_FRAME_DONE) {
        destroy_loading(r->loading);
        r->loading = NULL;
    }
    if (status < 0)
        trip_gl_resident_release(r);
    return status;
}

void trip_gl_resident_await(trip_gl_resident *r, uint64_t timeout_ns)
{
    if (r->loading)
        await_loading(r->loading, timeout_ns);
}

void trip_gl_resident_pause(trip_gl_resident *r)
{
    if (r->loading)
        close_loading(r->loading);
}

void trip_gl_resident_bind(const trip_gl_resident *r, int axis)
{
    const int array = array_of(r, axis);
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, TRIP_GL_VERTICES, r->vertices[array]);
    if (!r->replicated)
        glBindBufferBase(GL_SHADER_STORAGE_BUFFER, TRIP_GL_ORDER, r->order[axis]);
    if (r->normals[array])
        glBindBufferBase(GL_SHADER_STORAGE_BUFFER, TRIP_GL_NORMALS, r->normals[array]);
}

void trip_gl_resident_release(trip_gl_resident *r)
{
    destroy_loading(r->loading);
    glDeleteBuffers(AXES, r->vertices);
    glDeleteBuffers(AXES, r->normals);
    glDeleteBuffers(AXES, r->order);
    trip_budget_discharge(r->budget, r->bytes);
    trip_budget_release(r->budget, r->lists, r->list_count * sizeof *r->lists);
    *r = (trip_gl_resident){ .budget = r->budget };
}
