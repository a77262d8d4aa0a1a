#include "gl/resident.h"

#include <inttypes.h>
#include <stdlib.h>

#include "gl/shared.h"
#include "renderer.h"
#include "report.h"

enum { MAX_COORDINATE = 65536, Z = 2 };

/* As the shaders read it: x, y, z and code in 16 bits each. */
typedef struct vertex {
    uint32_t xy, zc;
} vertex;

/* What is put together in memory before it goes to GL. */
typedef struct arrays {
    trip_budget *budget;
    const trip_dataset *data;
    uint64_t splats;
    vertex *vertices; /* by place in the list along Z */
    uint32_t *normals;
    uint64_t *sheet_firsts; /* of every sheet along Z, and the end */
    uint32_t *order;        /* of the list being loaded */
    uint64_t filled;
    uint32_t run_voxels[TRIP_RUN_RECORDS_MAX], run_normals[TRIP_RUN_RECORDS_MAX];
} arrays;

typedef int fill_run(arrays *a, int axis, const trip_run *run, const uint32_t *voxels,
                     const uint32_t *normals);

static size_t sheet_bytes(const arrays *a)
{
    return (size_t)(a->data->header.dims[Z] + 1) * sizeof *a->sheet_firsts;
}

static void release_arrays(arrays *a)
{
    size_t n = (size_t)a->splats;
    trip_budget_release(a->budget, a->vertices, n * sizeof *a->vertices);
    trip_budget_release(a->budget, a->normals, n * sizeof *a->normals);
    trip_budget_release(a->budget, a->order, n * sizeof *a->order);
    trip_budget_release(a->budget, a->sheet_firsts, sheet_bytes(a));
}

static int take_arrays(arrays *a, bool normals)
{
    size_t n = (size_t)a->splats;
    a->vertices = trip_budget_take(a->budget, n * sizeof *a->vertices);
    a->order = trip_budget_take(a->budget, n * sizeof *a->order);
    a->sheet_firsts = trip_budget_take(a->budget, sheet_bytes(a));
    if (normals)
        a->normals = trip_budget_take(a->budget, n * sizeof *a->normals);
    if (a->vertices && a->order && a->sheet_firsts && (a->normals || !normals))
        return TRIP_OK;
    return trip_fail(TRIP_ERROR, "gl", a->data->path,
                     "indexed lists hold the whole data set, %" PRIu64
                     " splats, which does not fit the memory given; raise --memory or use "
                     "replicated lists",
                     a->splats);
}

/* Coordinates of a record, by axis. */
static void place_of(int axis, const trip_run *run, uint32_t voxel, uint32_t p[3])
{
    p[axis] = (uint32_t)run->sheet;
    p[(axis + 1) % 3] = (uint32_t)run->u + trip_voxel_u(voxel);
    p[(axis + 2) % 3] = (uint32_t)run->v + trip_voxel_v(voxel);
}

static int overfull(const arrays *a, int axis)
{
    return trip_fail(TRIP_ERROR, "gl", a->data->path, "list %c holds more splats than it says",
                     "xyz"[axis]);
}

static int fill_vertices(arrays *a, int axis, const trip_run *run, const uint32_t *voxels,
                         const uint32_t *normals)
{
    if (run->count > a->splats - a->filled)
        return overfull(a, axis);
    for (uint32_t k = 0; k < run->count; k++) {
        uint32_t p[3];
        place_of(axis, run, voxels[k], p);
        a->vertices[a->filled + k] =
            (vertex){ p[0] | p[1] << 16, p[2] | trip_voxel_code(voxels[k]) << 16 };
        if (a->normals)
            a->normals[a->filled + k] = normals[k];
        a->order[a->filled + k] = (uint32_t)(a->filled + k);
    }
    a->filled += run->count;
    a->sheet_firsts[run->sheet + 1] = a->filled;
    return TRIP_OK;
}

/* Sheets without splats end where the one before them does. */
static void close_sheets(arrays *a)
{
    for (uint64_t z = 0; z < a->data->header.dims[Z]; z++)
        if (a->sheet_firsts[z + 1] < a->sheet_firsts[z])
            a->sheet_firsts[z + 1] = a->sheet_firsts[z];
}

/* The place of a voxel in the list along Z, by its Morton code in its sheet; -1 when not there. */
static int64_t find_vertex(const arrays *a, const uint32_t p[3])
{
    uint64_t lo = a->sheet_firsts[p[2]], end = a->sheet_firsts[p[2] + 1], hi = end;
    uint64_t wanted = trip_morton(p[0], p[1]);
    while (lo < hi) {
        uint64_t middle = lo + (hi - lo) / 2;
        uint32_t xy = a->vertices[middle].xy;
        if (trip_morton(xy & 0xffff, xy >> 16) < wanted)
            lo = middle + 1;
        else
            hi = middle;
    }
    bool found = lo < end && a->vertices[lo].xy == (p[0] | p[1] << 16);
    return found ? (int64_t)lo : -1;
}

static int fill_order(arrays *a, int axis, const trip_run *run, const uint32_t *voxels,
                      const uint32_t *normals)
{
    (void)normals;
    if (run->count > a->splats - a->filled)
        return overfull(a, axis);
    for (uint32_t k = 0; k < run->count; k++) {
        uint32_t p[3];
        place_of(axis, run, voxels[k], p);
        int64_t at = p[Z] < a->data->header.dims[Z] ? find_vertex(a, p) : -1;
        if (at < 0)
            return trip_fail(TRIP_ERROR, "gl", a->data->path,
                             "voxel (%u, %u, %u) of list %c is not in list z", p[0], p[1], p[2],
                             "xyz"[axis]);
        a->order[a->filled++] = (uint32_t)at;
    }
    return TRIP_OK;
}

static int read_batches(arrays *a, trip_reader *reader, int axis, fill_run *fill)
{
    trip_batch batch;
    int status;
    while ((status = trip_reader_next(reader, &batch)) > 0) {
        status = TRIP_OK;
        for (size_t i = 0; i < batch.run_count && !status; i++) {
            const trip_run *run = &batch.runs[i];
            const trip_block block = trip_block_of(&batch, run);
            trip_block_voxels(&block, 0, run->count, a->run_voxels);
            if (block.normals)
                trip_block_normals(&block, 0, run->count, a->run_normals);
            status = fill(a, axis, run, a->run_voxels, a->run_normals);
        }
        trip_reader_release(reader, &batch);
        if (!status)
            status = trip_frame_poll();
        if (status)
            return status;
    }
    return status;
}

/* Passes the whole list along `axis` to `fill`, in file order. */
static int read_list(arrays *a, trip_reader *reader, int axis, fill_run *fill)
{
    trip_selection all;
    const trip_list *list = trip_dataset_find(a->data, axis, 0, TRIP_KIND_VOXELS);
    int status = trip_selection_create_whole(&all, a->data, list, false, a->budget);
    if (status)
        return status;
    trip_pass pass = trip_pass_of(&all);
    a->filled = 0;
    status = trip_reader_begin(reader, &pass);
    if (!status)
        status = read_batches(a, reader, axis, fill);
    trip_selection_destroy(&all, a->budget);
    if (!status && a->filled != a->splats)
        return trip_fail(TRIP_ERROR, "gl", a->data->path, "list %c holds fewer splats than it says",
                         "xyz"[axis]);
    return status;
}

static int upload(trip_gl_resident *r, GLuint *buffer, const void *bytes, size_t size)
{
    if (!trip_budget_charge(r->budget, size))
        return trip_fail(TRIP_ERROR, "gl", r->data->path,
                         "indexed lists do not fit the memory given; raise --memory or use "
                         "replicated lists");
    r->bytes += size;
    glCreateBuffers(1, buffer);
    glNamedBufferStorage(*buffer, (GLsizeiptr)size, bytes, 0);
    if (glGetError() == GL_NO_ERROR)
        return TRIP_OK;
    return trip_fail(TRIP_ERROR, "gl", r->data->path,
                     "indexed lists do not fit the memory of the GPU; use replicated lists");
}

static int load_lists(trip_gl_resident *r, arrays *a, trip_reader *reader)
{
    static const int axes[3] = { Z, 0, 1 };
    size_t n = (size_t)a->splats;
    int status = TRIP_OK;
    for (int i = 0; i < 3 && !status; i++) {
        int axis = axes[i];
        status = read_list(a, reader, axis, axis == Z ? fill_vertices : fill_order);
        if (axis == Z)
            close_sheets(a);
        if (!status)
            status = upload(r, &r->order[axis], a->order, n * sizeof *a->order);
    }
    if (!status)
        status = upload(r, &r->vertices, a->vertices, n * sizeof *a->vertices);
    if (!status && a->normals)
        status = upload(r, &r->normals, a->normals, n * sizeof *a->normals);
    return status;
}

static int check_size(const trip_dataset *data, size_t block_bytes)
{
    const trip_file_header *header = &data->header;
    for (unsigned i = 0; i < data->list_count; i++)
        if (data->lists[i].level > 0 && trip_kind_of(data->lists[i].kind)->splatted)
            return trip_fail(TRIP_ERROR, "gl", data->path,
                             "indexed lists are of one level, and the data set has several; use "
                             "replicated lists");
    for (int i = 0; i < 3; i++)
        if (header->dims[i] > MAX_COORDINATE)
            return trip_fail(TRIP_ERROR, "gl", data->path,
                             "indexed lists take up to %d voxels either way; use replicated lists",
                             MAX_COORDINATE);
    if (header->kept > block_bytes / sizeof(vertex))
        return trip_fail(TRIP_ERROR, "gl", data->path,
                         "indexed lists of %" PRIu64
                         " splats exceed the %zu bytes of a buffer of this driver; "
                         "use replicated lists",
                         header->kept, block_bytes);
    return TRIP_OK;
}

int trip_gl_resident_load(trip_gl_resident *r, const trip_dataset *data, unsigned planes,
                          size_t block_bytes)
{
    if (r->data == data && r->checksum == data->header.header_checksum && r->planes == planes)
        return TRIP_OK;
    trip_gl_resident_release(r);
    r->data = data;
    arrays a = { .budget = r->budget, .data = data, .splats = data->header.kept };
    trip_reader *reader = NULL;
    int status = check_size(data, block_bytes);
    if (!status)
        status = take_arrays(&a, planes & 1u << TRIP_PLANE_NORMALS);
    if (!status)
        status = trip_reader_create(
            &reader, data, &(trip_reader_params){ .planes = planes, .slots = 2 }, r->budget);
    if (!status)
        status = load_lists(r, &a, reader);
    trip_reader_destroy(reader);
    release_arrays(&a);
    if (status) {
        trip_gl_resident_release(r);
        return status;
    }
    r->checksum = data->header.header_checksum;
    r->planes = planes;
    return TRIP_OK;
}

void trip_gl_resident_bind(trip_gl_resident *r, int axis)
{
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, TRIP_GL_VERTICES, r->vertices);
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, TRIP_GL_ORDER, r->order[axis]);
    if (r->normals)
        glBindBufferBase(GL_SHADER_STORAGE_BUFFER, TRIP_GL_NORMALS, r->normals);
}

void trip_gl_resident_release(trip_gl_resident *r)
{
    glDeleteBuffers(1, &r->vertices);
    glDeleteBuffers(1, &r->normals);
    glDeleteBuffers(3, r->order);
    trip_budget_discharge(r->budget, r->bytes);
    *r = (trip_gl_resident){ .budget = r->budget };
}
