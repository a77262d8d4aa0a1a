#include "gl/lattices.h"

#include <assert.h>
#include <string.h>

#include "effects.h"
#include "emission.h"
#include "gl/frame_block.h"
#include "gl/ring.h"
#include "report.h"

/* Bytes of a lattice that are copied at once. At least one layer of nodes is copied. */
enum { PART_BYTES = 4 << 20 };

static_assert((int)TRIP_GL_EMISSION_STEPS == (int)TRIP_EMISSION_STEPS, "shared.h");

bool trip_gl_lattices_wanted(const trip_frame *frame)
{
    return trip_effects_some(&frame->settings->effects);
}

/* ---- lattices ---- */

static uint64_t bytes_of(const trip_gl_lattice *l)
{
    return (uint64_t)l->nodes[0] * (uint64_t)l->nodes[1] * (uint64_t)l->nodes[2] * sizeof(float);
}

static void drop(trip_gl_lattices *e, trip_gl_lattice *l)
{
    glDeleteTextures(1, &l->texture);
    trip_budget_discharge(e->budget, bytes_of(l));
    *l = (trip_gl_lattice){ 0 };
}

static int no_memory(const trip_light_grid *grid, const char *whose)
{
    return trip_fail(TRIP_ERROR, "gl", "light",
                     "a grid of %d x %d x %d nodes does not fit the memory %s; %slower "
                     "--light-cells",
                     grid->nodes[0], grid->nodes[1], grid->nodes[2], whose,
                     strcmp(whose, "given") ? "" : "raise --memory or ");
}

/* Allocates the texture for a grid. NULL frees it. */
static int take(trip_gl_lattices *e, trip_gl_lattice *l, const trip_light_grid *grid)
{
    if (l->texture && !(grid && !memcmp(l->nodes, grid->nodes, sizeof l->nodes)))
        drop(e, l);
    if (!grid || l->texture)
        return TRIP_OK;
    memcpy(l->nodes, grid->nodes, sizeof l->nodes);
    if (!trip_budget_charge(e->budget, bytes_of(l))) {
        *l = (trip_gl_lattice){ 0 };
        return no_memory(grid, "given");
    }
    glCreateTextures(GL_TEXTURE_3D, 1, &l->texture);
    glTextureStorage3D(l->texture, 1, GL_R32F, l->nodes[0], l->nodes[1], l->nodes[2]);
    if (glGetError() != GL_NO_ERROR) {
        drop(e, l);
        return no_memory(grid, "of the driver");
    }
    glTextureParameteri(l->texture, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTextureParameteri(l->texture, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    return TRIP_OK;
}

/* The source of a lattice's values. `grid` is NULL if the frame does not use it. */
typedef struct source {
    const trip_light_map *map;
    const trip_light_grid *grid;
} source;

static void find_sources(const trip_frame *frame, source out[TRIP_GL_LATTICES])
{
    const trip_effects *e = &frame->settings->effects;
    const trip_light_map *light = trip_effects_light(e) ? frame->light : NULL;
    const trip_light_map *heat = e->emission ? trip_emission_map(frame->emission) : NULL;
    out[TRIP_GL_REACHED_LATTICE] = (source){ light, light ? trip_light_map_reached(light) : NULL };
    out[TRIP_GL_OPEN_LATTICE] = (source){ light, light ? trip_light_map_open(light) : NULL };
    out[TRIP_GL_HEAT_LATTICE] = (source){ heat, heat ? trip_light_map_gathered(heat) : NULL };
}

static void upload_part(trip_gl_lattice *l, const trip_light_grid *grid)
{
    const size_t layer = (size_t)l->nodes[0] * (size_t)l->nodes[1];
    const size_t max = PART_BYTES / (layer * sizeof(float));
    const int left = l->nodes[2] - l->layers, count = max < 1 ? 1 : (int)max;
    const int layers = left < count ? left : count;
    glTextureSubImage3D(l->texture, 0, 0, 0, l->layers, l->nodes[0], l->nodes[1], layers, GL_RED,
                        GL_FLOAT, grid->at + (size_t)l->layers * layer);
    l->layers += layers;
}

int trip_gl_lattices_load(trip_gl_lattices *e, const trip_gl_context *context,
                          const trip_frame *frame)
{
    source sources[TRIP_GL_LATTICES];
    if (!trip_gl_lattices_wanted(frame))
        return TRIP_FRAME_DONE;
    find_sources(frame, sources);
    for (int i = 0; i < TRIP_GL_LATTICES; i++) {
        trip_gl_lattice *l = &e->lattices[i];
        if (!l->texture)
            continue;
        const uint64_t made_ns = trip_light_map_made_ns(sources[i].map);
        if (l->made_ns != made_ns)
            l->layers = 0;
        l->made_ns = made_ns;
        if (l->layers == l->nodes[2])
            continue;
        upload_part(l, sources[i].grid);
        const int status = trip_gl_check(context, "light");
        return status ? status : TRIP_FRAME_MORE;
    }
    return TRIP_FRAME_DONE;
}

void trip_gl_lattices_bind(const trip_gl_lattices *e)
{
    static const GLuint units[] = { [TRIP_GL_REACHED_LATTICE] = TRIP_GL_LIGHT_REACHED,
                                    [TRIP_GL_OPEN_LATTICE] = TRIP_GL_LIGHT_OPEN,
                                    [TRIP_GL_HEAT_LATTICE] = TRIP_GL_HEAT };
    for (int i = 0; i < TRIP_GL_LATTICES; i++)
        if (e->lattices[i].texture)
            glBindTextureUnit(units[i], e->lattices[i].texture);
    if (e->lattices[TRIP_GL_HEAT_LATTICE].texture)
        glBindBufferBase(GL_UNIFORM_BUFFER, TRIP_GL_HEAT_COLOURS, e->colours);
}

/* ---- constants ---- */

static trip_gl_float4 row(double x, double y, double z, double w)
{
    return (trip_gl_float4){ { (float)x, (float)y, (float)z, (float)w } };
}

/* Sets the map from the list's grid (list axes) to the index space of level 0, and the eye's
 * position in the list's grid. */
static void set_positions(trip_gl_effects_block *b, const trip_frame *frame, const trip_list *list,
                          int axis)
{
    const trip_plan_list *planned = list ? &frame->plan->lists[list->index] : NULL;
    const trip_camera *camera = planned ? &planned->camera : frame->camera;
    trip_gl_float4 *rows[3] = { &b->index_0, &b->index_1, &b->index_2 };
    for (int i = 0; i < 3; i++) {
        const int a = (axis + i) % 3;
        const double eye = trip_component(camera->eye, a);
        b->eye_high.v[i] = (float)eye;
        b->eye_low.v[i] = trip_gl_frame_rest(eye);
        *rows[a] = row(0, 0, 0, planned ? planned->grid.offset[a] : 0);
        rows[a]->v[i] = planned ? (float)planned->grid.scale[a] : 1;
    }
}

static float nodes_per_voxel(const trip_light_grid *grid)
{
    return grid ? (float)(1 / grid->spacing) : 0;
}

static void set_cue(trip_gl_effects_block *b, const trip_effects_view *view)
{
    const double *rgb = view->cue_rgb;
    b->cue = row(view->cue[0], view->cue[1], view->cue[2], view->cue[3]);
    b->faded = row(rgb[0], rgb[1], rgb[2], view->effects.cueing);
}

static void set_light(trip_gl_effects_block *b, const trip_effects_view *view)
{
    const double g = view->effects.anisotropy;
    trip_gl_float4 *rows[3] = { &b->aside_0, &b->aside_1, &b->aside_2 };
    for (int a = 0; a < 3; a++) {
        const double *to = view->to_index.m[a];
        *rows[a] = row(view->bias * to[0], view->bias * to[1], view->bias * to[2],
                       trip_component(view->light, a));
    }
    b->phase = row(1 - g * g, 1 + g * g, 2 * g, view->point_light);
}

static void set_heat(trip_gl_effects_block *b, const trip_emission *emission)
{
    const trip_emission_view view = trip_emission_view_of(emission);
    trip_gl_float4 *rows[3] = { &b->heat_0, &b->heat_1, &b->heat_2 };
    for (int a = 0; a < 3; a++) {
        const double *to = view.to_heat.m[a];
        *rows[a] = row(to[0], to[1], to[2], to[3]);
        b->heat_last.v[a] = (float)view.last[a];
    }
}

trip_gl_effects_block trip_gl_effects_block_of(const trip_frame *frame, const trip_list *list,
                                               int axis)
{
    trip_gl_effects_block b = { 0 };
    source sources[TRIP_GL_LATTICES];
    find_sources(frame, sources);
    set_positions(&b, frame, list, list ? list->axis : axis);
    for (int i = 0; i < TRIP_GL_LATTICES; i++)
        b.per_voxel.v[i] = nodes_per_voxel(sources[i].grid);
    const trip_effects_view view =
        trip_effects_view_make(frame->settings, frame->camera, frame->data->header.dims);
    set_cue(&b, &view);
    if (trip_effects_light(&view.effects))
        set_light(&b, &view);
    if (frame->settings->effects.emission)
        set_heat(&b, frame->emission);
    return b;
}

static GLintptr offset_of(unsigned block)
{
    return (GLintptr)(block * trip_gl_ring_after(0, sizeof(trip_gl_effects_block)));
}

static void fit(trip_gl_lattices *e, unsigned blocks)
{
    if (e->blocks && blocks <= e->room)
        return;
    glDeleteBuffers(1, &e->blocks);
    glCreateBuffers(1, &e->blocks);
    glNamedBufferStorage(e->blocks, offset_of(blocks), NULL, GL_DYNAMIC_STORAGE_BIT);
    e->room = blocks;
}

static void fill_block(const trip_gl_lattices *e, const trip_frame *frame, const trip_list *list,
                       unsigned number)
{
    const trip_gl_effects_block b = trip_gl_effects_block_of(frame, list, (int)number);
    glNamedBufferSubData(e->blocks, offset_of(number), sizeof b, &b);
}

static void fill_blocks(trip_gl_lattices *e, const trip_frame *frame)
{
    const trip_dataset *data = frame->data;
    const bool post = frame->settings->classify == TRIP_CLASSIFY_POST;
    const unsigned count = post ? 3 : data->list_count;
    fit(e, count);
    for (unsigned i = 0; i < count; i++)
        if (post || frame->plan->lists[i].drawn)
            fill_block(e, frame, post ? NULL : &data->lists[i], i);
}

static void fill_colours(trip_gl_lattices *e, const trip_frame *frame)
{
    const GLsizeiptr bytes = (TRIP_EMISSION_STEPS + 1) * 4 * sizeof(float);
    if (!e->colours) {
        glCreateBuffers(1, &e->colours);
        glNamedBufferStorage(e->colours, bytes, NULL, GL_DYNAMIC_STORAGE_BIT);
    }
    glNamedBufferSubData(e->colours, 0, bytes, trip_emission_view_of(frame->emission).rgb);
}

int trip_gl_lattices_begin(trip_gl_lattices *e, const trip_gl_context *context,
                           const trip_frame *frame)
{
    source sources[TRIP_GL_LATTICES];
    int status = TRIP_OK;
    if (!trip_gl_lattices_wanted(frame)) {
        trip_gl_lattices_release(e);
        return TRIP_OK;
    }
    find_sources(frame, sources);
    for (int i = 0; i < TRIP_GL_LATTICES && !status; i++)
        status = take(e, &e->lattices[i], sources[i].grid);
    if (status)
        return status;
    fill_blocks(e, frame);
    if (frame->settings->effects.emission)
        fill_colours(e, frame);
    return trip_gl_check(context, "light");
}

void trip_gl_lattices_bind_block(const trip_gl_lattices *e, unsigned number)
{
    glBindBufferRange(GL_UNIFORM_BUFFER, TRIP_GL_EFFECTS, e->blocks, offset_of(number),
                      sizeof(trip_gl_effects_block));
}

void trip_gl_lattices_release(trip_gl_lattices *e)
{
    for (int i = 0; i < TRIP_GL_LATTICES; i++)
        if (e->lattices[i].texture)
            drop(e, &e->lattices[i]);
    glDeleteBuffers(1, &e->blocks);
    glDeleteBuffers(1, &e->colours);
    *e = (trip_gl_lattices){ .budget = e->budget };
}
