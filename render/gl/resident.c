#include "gl/resident.h"

#include <inttypes.h>

#include "gl/loading.h"
#include "gl/shared.h"
#include "renderer.h"
#include "report.h"

enum { MAX_COORDINATE = 65536, AXES = 3 };

const trip_list *trip_gl_resident_base(const trip_dataset *data, const trip_list *list)
{
    const trip_list *base = NULL;
    for (int axis = AXES - 1; axis >= 0 && !base; axis--)
        base = trip_dataset_along(data, list, axis);
    return base;
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
        r->order_counts[list->axis] += list->records;
        if (trip_gl_resident_base(data, list) != list)
            continue;
        r->lists[i].vertex_first = r->vertex_count;
        r->vertex_count += list->records;
    }
    for (unsigned i = 0; i < data->list_count; i++)
        if (is_splatted(&data->lists[i]))
            r->lists[i].vertex_first =
                r->lists[trip_gl_resident_base(data, &data->lists[i])->index].vertex_first;
}

static int check_size(const trip_gl_resident *r, size_t block_bytes)
{
    const trip_dataset *data = r->data;
    for (unsigned i = 0; i < data->list_count; i++)
        for (int a = 0; a < AXES; a++)
            if (is_splatted(&data->lists[i]) && data->lists[i].dims[a] > MAX_COORDINATE)
                return trip_fail(TRIP_ERROR, "gl", data->path,
                                 "indexed lists are limited to %d voxels along each axis; use "
                                 "replicated lists",
                                 MAX_COORDINATE);
    uint64_t max = r->vertex_count;
    for (int a = 0; a < AXES; a++)
        max = r->order_counts[a] > max ? r->order_counts[a] : max;
    if (max <= block_bytes / sizeof(trip_gl_vertex) && max <= INT32_MAX)
        return TRIP_OK;
    return trip_fail(TRIP_ERROR, "gl", data->path,
                     "indexed lists of %" PRIu64
                     " splats exceed this driver's buffer limit of %zu bytes; "
                     "use replicated lists",
                     max, block_bytes);
}

static int no_memory(const trip_gl_resident *r)
{
    return trip_fail(TRIP_ERROR, "gl", r->data->path,
                     "indexed lists hold the whole data set, %" PRIu64
                     " splats, which does not fit the memory given; raise --memory or use "
                     "replicated lists",
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
    return trip_fail(TRIP_ERROR, "gl", r->data->path,
                     "indexed lists do not fit the memory of the GPU; use replicated lists");
}

static int make_arrays(trip_gl_resident *r)
{
    int status = make_array(r, &r->vertices, r->vertex_count, sizeof(trip_gl_vertex));
    for (int a = 0; a < AXES && !status; a++)
        status = make_array(r, &r->order[a], r->order_counts[a], sizeof(uint32_t));
    if (!status && r->planes >> TRIP_PLANE_NORMALS & 1)
        status = make_array(r, &r->normals, r->vertex_count, sizeof(uint32_t));
    return status;
}

static int begin_loading(trip_gl_resident *r, size_t block_bytes)
{
    r->lists = trip_budget_take(r->budget, r->list_count * sizeof *r->lists);
    if (!r->lists)
        return no_memory(r);
    lay_out(r);
    int status = check_size(r, block_bytes);
    if (!status)
        status = make_arrays(r);
    return status ? status : trip_gl_loading_create(&r->loading, r);
}

static bool holds(const trip_gl_resident *r, const trip_dataset *data, unsigned planes)
{
    return r->data == data && r->checksum == data->header.header_checksum && r->planes == planes;
}

int trip_gl_resident_begin(trip_gl_resident *r, const trip_dataset *data, unsigned planes,
                           size_t block_bytes)
{
    int status = TRIP_OK;
    if (!holds(r, data, planes)) {
        trip_gl_resident_release(r);
        r->data = data;
        r->checksum = data->header.header_checksum;
        r->planes = planes;
        r->list_count = data->list_count;
        status = begin_loading(r, block_bytes);
    }
    if (!status && r->loading)
        status = trip_gl_loading_open(r->loading);
    if (status)
        trip_gl_resident_release(r);
    return status;
}

int trip_gl_resident_load(trip_gl_resident *r)
{
    if (!r->loading)
        return TRIP_FRAME_DONE;
    int status = trip_gl_loading_step(r->loading);
    if (status == TRIP_FRAME_DONE) {
        trip_gl_loading_destroy(r->loading);
        r->loading = NULL;
    }
    if (status < 0)
        trip_gl_resident_release(r);
    return status;
}

void trip_gl_resident_await(trip_gl_resident *r, uint64_t timeout_ns)
{
    if (r->loading)
        trip_gl_loading_await(r->loading, timeout_ns);
}

void trip_gl_resident_pause(trip_gl_resident *r)
{
    if (r->loading)
        trip_gl_loading_close(r->loading);
}

void trip_gl_resident_bind(const trip_gl_resident *r, int axis)
{
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, TRIP_GL_VERTICES, r->vertices);
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, TRIP_GL_ORDER, r->order[axis]);
    if (r->normals)
        glBindBufferBase(GL_SHADER_STORAGE_BUFFER, TRIP_GL_NORMALS, r->normals);
}

void trip_gl_resident_release(trip_gl_resident *r)
{
    trip_gl_loading_destroy(r->loading);
    glDeleteBuffers(1, &r->vertices);
    glDeleteBuffers(1, &r->normals);
    glDeleteBuffers(AXES, r->order);
    trip_budget_discharge(r->budget, r->bytes);
    trip_budget_release(r->budget, r->lists, r->list_count * sizeof *r->lists);
    *r = (trip_gl_resident){ .budget = r->budget };
}
