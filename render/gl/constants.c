#include "gl/constants.h"

#include <stdlib.h>

#include "gl/frame_block.h"
#include "report.h"

/* The blocks of the layers come first, then the blocks of the lists. */
enum { LAYER_BLOCKS = 3, TABLE_BYTES = 65536 * sizeof(trip_tf_entry) };

/* The buffer holds all blocks in float, then all blocks in double. */
static GLintptr offset_of(const trip_gl_constants *c, unsigned block, bool in_double)
{
    size_t small = trip_gl_ring_after(0, sizeof(trip_gl_frame_float));
    size_t large = trip_gl_ring_after(0, sizeof(trip_gl_frame_double));
    return (GLintptr)(in_double ? (LAYER_BLOCKS + c->room) * small + block * large : block * small);
}

static void bind(const trip_gl_constants *c, unsigned block, bool in_double)
{
    glBindBufferRange(GL_UNIFORM_BUFFER, TRIP_GL_FRAME, c->blocks, offset_of(c, block, in_double),
                      in_double ? sizeof(trip_gl_frame_double) : sizeof(trip_gl_frame_float));
}

void trip_gl_constants_bind_layer(const trip_gl_constants *c, int axis, bool in_double)
{
    bind(c, (unsigned)axis, in_double);
}

void trip_gl_constants_bind_list(const trip_gl_constants *c, unsigned list, bool in_double)
{
    bind(c, LAYER_BLOCKS + list, in_double);
}

static void upload(const trip_gl_constants *c, unsigned block, const trip_gl_frame_double *exact)
{
    trip_gl_frame_float rounded;
    trip_gl_frame_round(&rounded, exact);
    glNamedBufferSubData(c->blocks, offset_of(c, block, false), sizeof rounded, &rounded);
    glNamedBufferSubData(c->blocks, offset_of(c, block, true), sizeof *exact, exact);
}

/* Returns the cost of compositing one sheet over the whole picture. */
static uint32_t sheet_cost(const trip_camera *camera)
{
    int64_t pixels = (int64_t)camera->width * camera->height, cost = pixels / TRIP_GL_COST_PX + 1;
    return cost < TRIP_GL_PART_COST ? (uint32_t)cost : TRIP_GL_PART_COST;
}

static void fill_list(trip_gl_constants *c, const trip_frame *frame, const trip_list *list,
                      double point_size_px)
{
    trip_gl_placing *p = &c->lists[list->index];
    const trip_coordinates *coordinates = &frame->data->coordinates;
    const double ratio = trip_gl_frame_ratio(coordinates);
    trip_settings settings = *frame->settings;
    settings.kernel_radius *= coordinates->widest;
    const trip_camera *camera = &frame->plan->lists[list->index].camera;
    *p = (trip_gl_placing){
        .camera = camera,
        .coordinates = coordinates,
        .effects = trip_gl_frame_effects(frame, camera, list->axis),
        .axis = list->axis,
        .sheet_cost = trip_settings_sum_sheets(&settings) ? sheet_cost(frame->camera) : 0,
        .tile_voxels = (double)(1u << frame->data->header.tile_log2),
        .kernel_radius = settings.kernel_radius,
        .low_pass_px = trip_settings_low_pass_px(&settings),
        .quads = settings.triangles,
        .sprite_depth = trip_gl_frame_sprite_depth(&settings, camera, ratio, point_size_px),
        .near_depth = trip_gl_frame_near_depth(&settings, camera, ratio),
    };
    trip_gl_frame_make(&p->constants, frame, list);
    upload(c, LAYER_BLOCKS + list->index, &p->constants);
}

/* Ensures a capacity of `lists` lists. */
static int fit(trip_gl_constants *c, const trip_gl_context *context, unsigned lists)
{
    if (c->blocks && lists <= c->room)
        return TRIP_OK;
    trip_gl_placing *more = realloc(c->lists, lists * sizeof *more);
    if (!more)
        return trip_fail(TRIP_ERROR, "gl", "lists", "out of memory");
    c->lists = more;
    c->room = lists;
    glDeleteBuffers(1, &c->blocks);
    glCreateBuffers(1, &c->blocks);
    glNamedBufferStorage(c->blocks, offset_of(c, LAYER_BLOCKS + lists, true), NULL,
                         GL_DYNAMIC_STORAGE_BIT);
    int status = trip_gl_check(context, "constants");
    if (status)
        trip_gl_constants_release(c);
    return status;
}

static void fill_table(trip_gl_constants *c, const trip_tf_entry *table)
{
    if (!c->table) {
        glCreateBuffers(1, &c->table);
        glNamedBufferStorage(c->table, TABLE_BYTES, NULL, GL_DYNAMIC_STORAGE_BIT);
    }
    glNamedBufferSubData(c->table, 0, TABLE_BYTES, table);
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, TRIP_GL_TABLE, c->table);
}

int trip_gl_constants_fill(trip_gl_constants *c, const trip_gl_context *context,
                           const trip_frame *frame)
{
    const trip_dataset *data = frame->data;
    int status = fit(c, context, data->list_count);
    if (status)
        return status;
    for (int axis = 0; axis < LAYER_BLOCKS; axis++) {
        trip_gl_frame_double layer;
        trip_gl_frame_make_layer(&layer, frame, axis);
        upload(c, (unsigned)axis, &layer);
    }
    for (unsigned i = 0; i < data->list_count; i++)
        if (frame->plan->lists[i].drawn)
            fill_list(c, frame, &data->lists[i], trip_gl_context_limits(context)->point_size_px);
    fill_table(c, frame->table);
    return trip_gl_check(context, "constants");
}

void trip_gl_constants_release(trip_gl_constants *c)
{
    glDeleteBuffers(1, &c->blocks);
    glDeleteBuffers(1, &c->table);
    free(c->lists);
    *c = (trip_gl_constants){ 0 };
}
