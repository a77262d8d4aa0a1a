/* trip_gl_create(): the picture by OpenGL. Splats are drawn in list order and blended into one
 * layer per list, pixels where the list has no weight masked by the stencil; a full-screen pass
 * merges the layers. The shaders (shaders/) mirror the reference; nothing is computed here but a
 * frame's constants and the places of runs. */
#include "renderer.h"

#include <epoxy/gl.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "gl/batch.h"
#include "gl/context.h"
#include "gl/frame_block.h"
#include "gl/resident.h"
#include "gl/ring.h"
#include "gl/slots.h"
#include "gl/target.h"
#include "gl/variant.h"
#include "report.h"
#include "weight.h"

enum {
    TABLE_BYTES = 65536 * sizeof(trip_tf_entry),
    COUNTS = 12, /* low and high half of projected and drawn, per axis */
    QUADS_PER_DRAW = 65536,
    QUAD_VERTICES = 4,
    QUAD_INDICES = 6,
    GROUPS_PER_ROW = 32768, /* of a counting dispatch; 65535 may be asked for */
};

typedef struct gl_renderer {
    trip_renderer base;
    trip_budget *budget;
    trip_gl_context *context;
    trip_gl_variants variants;
    trip_gl_target target;
    trip_gl_ring ring;
    trip_gl_slots slots; /* of a reader that reads into GL memory */
    bool copies;         /* readers are given none: batches are copied */
    trip_gl_batch batch;
    trip_gl_resident resident; /* submission form "indexed" only */
    GLuint vertex_array, quad_indices;
    GLuint constants, table, counts;
    const trip_frame *frame;
    trip_gl_placing *lists;  /* of the frame, by number in the data set */
    unsigned constants_room; /* blocks of constants: 3 of layers, and one for each list */
    int axis;                /* of the layer being drawn */
    unsigned layers;         /* bit a: the layer of axis a was begun */
    bool masked;             /* the layer being drawn, by the stencil */
    /* At most two steps of so many splats wait for the GPU, so that an interruption soon ends. */
    uint32_t step;
    uint32_t in_step;  /* splats drawn since the last step ended */
    trip_gl_slot pace; /* the fence behind the last step; no memory */
    uint64_t quads;    /* splats of the frame drawn as quads though sprites were asked for */
    trip_list_stats stats[3];
    char device[320];
} gl_renderer;

static const char *device(const trip_renderer *base)
{
    return ((const gl_renderer *)base)->device;
}

static void destroy(trip_renderer *base)
{
    gl_renderer *r = (gl_renderer *)base;
    if (r->context && trip_gl_context_use(r->context) == TRIP_OK) {
        trip_gl_variants_release(&r->variants);
        trip_gl_target_release(&r->target);
        trip_gl_ring_release(&r->ring);
        trip_gl_slots_release(&r->slots);
        trip_gl_resident_release(&r->resident);
        if (r->pace.fence)
            glDeleteSync(r->pace.fence);
    }
    trip_gl_batch_release(&r->batch);
    free(r->lists);
    trip_gl_context_destroy(r->context); /* and with it what is left */
    free(r);
}

/* Blocks of constants: those of the layers, then those of the lists. */
enum { LIST_BLOCKS = 3 };

/* Offsets in the buffer of constants: the blocks in float, then in double. */
static GLintptr constants_offset(const gl_renderer *r, unsigned block, bool in_double)
{
    size_t small = trip_gl_ring_after(0, sizeof(trip_gl_frame_float));
    size_t large = trip_gl_ring_after(0, sizeof(trip_gl_frame_double));
    return (GLintptr)(in_double ? r->constants_room * small + block * large : block * small);
}

static void bind_constants(const gl_renderer *r, unsigned block, bool in_double)
{
    glBindBufferRange(GL_UNIFORM_BUFFER, TRIP_GL_FRAME, r->constants,
                      constants_offset(r, block, in_double),
                      in_double ? sizeof(trip_gl_frame_double) : sizeof(trip_gl_frame_float));
}

static void upload_block(gl_renderer *r, unsigned block, const trip_gl_frame_double *constants)
{
    trip_gl_frame_float rounded;
    trip_gl_frame_round(&rounded, constants);
    glNamedBufferSubData(r->constants, constants_offset(r, block, false), sizeof rounded, &rounded);
    glNamedBufferSubData(r->constants, constants_offset(r, block, true), sizeof *constants,
                         constants);
}

static void place_list(gl_renderer *r, const trip_list *list)
{
    const trip_frame *frame = r->frame;
    trip_gl_placing *p = &r->lists[list->index];
    const trip_camera *camera = &frame->plan->lists[list->index].camera;
    *p = (trip_gl_placing){
        .camera = camera,
        .effects = trip_gl_frame_effects(frame, camera, list->axis),
        .axis = list->axis,
        .tile_voxels = (double)(1u << frame->data->header.tile_log2),
        .quads = frame->settings->triangles,
        .sprite_depth = trip_gl_frame_sprite_depth(
            frame->settings, camera, trip_gl_context_limits(r->context)->point_size_px),
    };
    trip_gl_frame_make(&p->constants, frame, list);
    upload_block(r, LIST_BLOCKS + list->index, &p->constants);
}

static void upload_constants(gl_renderer *r)
{
    const trip_dataset *data = r->frame->data;
    for (int axis = 0; axis < 3; axis++) {
        trip_gl_frame_double layer;
        trip_gl_frame_make_layer(&layer, r->frame, axis);
        upload_block(r, (unsigned)axis, &layer);
    }
    for (unsigned i = 0; i < data->list_count; i++)
        if (r->frame->plan->lists[i].drawn)
            place_list(r, &data->lists[i]);
    glNamedBufferSubData(r->table, 0, TABLE_BYTES, r->frame->table);
}

/* Room for the constants of so many lists. */
static int fit_constants(gl_renderer *r, unsigned lists)
{
    if (r->constants && LIST_BLOCKS + lists <= r->constants_room)
        return TRIP_OK;
    trip_gl_placing *more = realloc(r->lists, lists * sizeof *more);
    if (!more)
        return trip_fail(TRIP_ERROR, "gl", "lists", "out of memory");
    r->lists = more;
    r->constants_room = LIST_BLOCKS + lists;
    glDeleteBuffers(1, &r->constants);
    glCreateBuffers(1, &r->constants);
    glNamedBufferStorage(r->constants, constants_offset(r, r->constants_room, true), NULL,
                         GL_DYNAMIC_STORAGE_BIT);
    return trip_gl_check(r->context, "constants");
}

/* What is drawn at once takes a tenth of a second or so where processors draw: a whole pass over
 * the image is done in strips of so many pixels, and splats so many of whose pixels. */
enum { PIXELS_AT_ONCE = 1 << 23, STRIP_PIXELS = 1 << 20 };

/* As many splats as cover PIXELS_AT_ONCE by the size of one in the volume's middle. */
static uint32_t splats_at_once(const trip_frame *frame)
{
    const trip_camera *c = frame->camera;
    const uint64_t *dims = frame->data->header.dims;
    trip_vec3 middle = { 0.5 * (double)dims[0], 0.5 * (double)dims[1], 0.5 * (double)dims[2] };
    double depth = c->ortho ? 1 : trip_dot(c->forward, trip_sub(middle, c->eye));
    double edge = 2 * frame->settings->kernel_radius / fmax(depth, 1e-30);
    double area = edge / trip_length(c->rx) * (edge / trip_length(c->ry));
    area = fmax(1, fmin(area, (double)c->width * c->height));
    return (uint32_t)fmax(16, PIXELS_AT_ONCE / area);
}

/* A pass over the image, strip by strip. */
static int draw_screen(const gl_renderer *r)
{
    int status = TRIP_OK, width = r->target.width, height = r->target.height;
    int rows = STRIP_PIXELS / width + 1;
    glEnable(GL_SCISSOR_TEST);
    for (int y = 0; y < height && !status; y += rows) {
        glScissor(0, y, width, rows);
        glDrawArrays(GL_TRIANGLES, 0, 3);
        if (rows < height)
            status = trip_gl_await();
    }
    glDisable(GL_SCISSOR_TEST);
    return status;
}

static int check_size(const gl_renderer *r, const trip_camera *camera)
{
    int most = trip_gl_context_limits(r->context)->image_px;
    if (camera->width <= most && camera->height <= most)
        return TRIP_OK;
    return trip_fail(TRIP_ERROR, "gl", "image",
                     "%d x %d px exceed the %d px either way that this driver can draw; "
                     "use another renderer or a smaller size",
                     camera->width, camera->height, most);
}

static int begin_frame(trip_renderer *base, const trip_frame *frame)
{
    gl_renderer *r = (gl_renderer *)base;
    const trip_camera *camera = frame->camera;
    int status = check_size(r, camera);
    if (!status && frame->settings->depth)
        status =
            trip_fail(TRIP_USAGE, "render", "depth", "OpenGL draws none; use the CPU renderer");
    if (!status)
        status = trip_gl_context_use(r->context);
    if (!status)
        status = trip_gl_target_resize(&r->target, camera->width, camera->height,
                                       frame->settings->target);
    if (!status)
        status = fit_constants(r, frame->data->list_count);
    if (!status && frame->settings->indexed)
        status = trip_gl_resident_load(&r->resident, frame->data, frame->plan->planes,
                                       trip_gl_context_limits(r->context)->storage_block_bytes);
    if (status)
        return status;
    r->base.resident = frame->settings->indexed;
    r->frame = frame;
    r->layers = 0;
    r->quads = 0;
    memset(r->stats, 0, sizeof r->stats);
    upload_constants(r);
    if (frame->count) {
        static const GLuint zero = 0;
        glClearNamedBufferData(r->counts, GL_R32UI, GL_RED_INTEGER, GL_UNSIGNED_INT, &zero);
    }
    return trip_gl_check(r->context, "frame");
}

static int use_program(gl_renderer *r, trip_gl_pass pass, unsigned effects)
{
    GLuint program = 0;
    trip_gl_variant variant = { pass, r->frame->settings->method, effects,
                                pass == TRIP_GL_PASS_MERGE ? r->layers : 0 };
    int status = trip_gl_variants_get(&r->variants, variant, &program);
    if (!status)
        glUseProgram(program);
    return status;
}

/* Sets the stencil to 1 where the layer has weight, and has only those pixels drawn from now on. */
static int mask_region(gl_renderer *r, int axis)
{
    int status = use_program(r, TRIP_GL_PASS_REGION, 0);
    if (status)
        return status;
    bind_constants(r, (unsigned)axis, true);
    glEnable(GL_STENCIL_TEST);
    glStencilFunc(GL_ALWAYS, 1, 1);
    glStencilOp(GL_KEEP, GL_KEEP, GL_REPLACE);
    glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
    status = draw_screen(r);
    glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    glStencilFunc(GL_EQUAL, 1, 1);
    glStencilOp(GL_KEEP, GL_KEEP, GL_KEEP);
    return status;
}

static int begin_layer(trip_renderer *base, int axis)
{
    gl_renderer *r = (gl_renderer *)base;
    const trip_frame *frame = r->frame;
    bool whole =
        trip_weight_is_everywhere(frame->settings, frame->camera, frame->plan->axis_of_view, axis);
    int status = trip_gl_context_use(r->context);
    if (!status)
        status = trip_gl_target_begin_layer(&r->target, axis, !whole);
    glDisable(GL_BLEND);
    glDisable(GL_STENCIL_TEST);
    glBindVertexArray(r->vertex_array);
    if (!status && !whole)
        status = mask_region(r, axis);
    if (status)
        return status;
    r->layers |= 1u << axis;
    r->axis = axis;
    r->masked = !whole;
    r->step = splats_at_once(frame);
    r->in_step = 0;
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, TRIP_GL_TABLE, r->table);
    if (frame->settings->indexed)
        trip_gl_resident_bind(&r->resident, axis);
    return trip_gl_check(r->context, "layer");
}

static void bind_part(const trip_gl_slot *slot, GLuint binding, trip_gl_part part)
{
    if (part.bytes)
        glBindBufferRange(GL_SHADER_STORAGE_BUFFER, binding, slot->buffer, (GLintptr)part.offset,
                          (GLsizeiptr)part.bytes);
}

static void bind_batch(const trip_gl_batch *b)
{
    bind_part(b->records, TRIP_GL_VOXELS, b->voxels);
    bind_part(b->records, TRIP_GL_NORMALS, b->normals);
    bind_part(b->slot, TRIP_GL_RUNS, b->runs);
    bind_part(b->slot, TRIP_GL_SQUARES, b->squares);
    bind_part(b->slot, TRIP_GL_RUN_OF, b->run_of);
}

/* Quads share one list of vertex numbers: two triangles over corners 0 to 3 of each. */
static int make_quad_indices(gl_renderer *r)
{
    static const GLuint corners[QUAD_INDICES] = { 0, 1, 2, 2, 1, 3 };
    if (r->quad_indices)
        return TRIP_OK;
    size_t count = (size_t)QUADS_PER_DRAW * QUAD_INDICES;
    GLuint *indices = malloc(count * sizeof *indices);
    if (!indices)
        return trip_fail(TRIP_ERROR, "gl", "quads", "out of memory");
    for (size_t i = 0; i < count; i++)
        indices[i] = (GLuint)(i / QUAD_INDICES) * QUAD_VERTICES + corners[i % QUAD_INDICES];
    glCreateBuffers(1, &r->quad_indices);
    glNamedBufferStorage(r->quad_indices, (GLsizeiptr)(count * sizeof *indices), indices, 0);
    glVertexArrayElementBuffer(r->vertex_array, r->quad_indices);
    free(indices);
    return trip_gl_check(r->context, "quads");
}

static int draw_quads(gl_renderer *r, const trip_gl_piece *piece)
{
    int status = make_quad_indices(r);
    if (!status)
        status = use_program(r, TRIP_GL_PASS_SPLAT, r->lists[piece->list].effects | TRIP_GL_QUADS);
    if (status)
        return status;
    for (uint32_t done = 0; done < piece->count; done += QUADS_PER_DRAW) {
        uint32_t left = piece->count - done;
        GLsizei quads = (GLsizei)(left < QUADS_PER_DRAW ? left : QUADS_PER_DRAW);
        glDrawElementsBaseVertex(GL_TRIANGLES, quads * QUAD_INDICES, GL_UNSIGNED_INT, NULL,
                                 (GLint)((piece->first + done) * QUAD_VERTICES));
    }
    if (!r->frame->settings->triangles)
        r->quads += piece->count;
    return TRIP_OK;
}

static int draw_sprites(gl_renderer *r, const trip_gl_piece *piece)
{
    int status = use_program(r, TRIP_GL_PASS_SPLAT, r->lists[piece->list].effects);
    if (!status)
        glDrawArrays(GL_POINTS, (GLint)piece->first, (GLsizei)piece->count);
    return status;
}

/* Waits for the step before the last one. */
static int end_step(gl_renderer *r)
{
    int status = trip_gl_slot_is_done(&r->pace, true);
    if (status < 0)
        return status;
    trip_gl_slot_fence(&r->pace);
    r->in_step = 0;
    return TRIP_OK;
}

/* In parts where a step ends within it. */
static int draw_piece(gl_renderer *r, const trip_gl_piece *piece)
{
    int status = TRIP_OK;
    for (uint32_t done = 0; done < piece->count && !status;) {
        uint32_t left = piece->count - done, room = r->step - r->in_step;
        uint32_t count = left < room ? left : room;
        const trip_gl_piece part = { piece->first + done, count, piece->list, piece->quads };
        status = part.quads ? draw_quads(r, &part) : draw_sprites(r, &part);
        r->in_step += count;
        if (!status && r->in_step == r->step)
            status = end_step(r);
        done += count;
    }
    return status;
}

static int draw_pieces(gl_renderer *r, bool front_to_back)
{
    int status = TRIP_OK;
    glEnable(GL_BLEND);
    if (front_to_back)
        glBlendFunc(GL_ONE_MINUS_DST_ALPHA, GL_ONE);
    else
        glBlendFunc(GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
    for (size_t i = 0; i < r->batch.piece_count && !status; i++) {
        bind_constants(r, LIST_BLOCKS + r->batch.pieces[i].list, false);
        status = draw_piece(r, &r->batch.pieces[i]);
    }
    return status;
}

static int count_piece(gl_renderer *r, const trip_gl_piece *piece)
{
    int status = use_program(r, TRIP_GL_PASS_COUNT, r->lists[piece->list].effects);
    if (status)
        return status;
    GLuint groups = (piece->count + TRIP_GL_COUNT_GROUP - 1) / TRIP_GL_COUNT_GROUP;
    GLuint rows = (groups + GROUPS_PER_ROW - 1) / GROUPS_PER_ROW;
    bind_constants(r, LIST_BLOCKS + piece->list, true);
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, TRIP_GL_COUNTS, r->counts);
    glUniform2ui(0, piece->first, piece->count);
    glDispatchCompute(rows > 1 ? GROUPS_PER_ROW : groups, rows, 1);
    glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT | GL_SHADER_STORAGE_BARRIER_BIT);
    return TRIP_OK;
}

static int count_pieces(gl_renderer *r)
{
    int status = TRIP_OK;
    for (size_t i = 0; i < r->batch.piece_count && !status; i++)
        status = count_piece(r, &r->batch.pieces[i]);
    return status;
}

static int draw(trip_renderer *base, const trip_batch *batch, bool front_to_back)
{
    gl_renderer *r = (gl_renderer *)base;
    int status = trip_gl_context_use(r->context);
    if (!status)
        status = trip_gl_batch_fill(&r->batch, &r->ring, r->lists, batch,
                                    trip_gl_slots_find(&r->slots, batch->planes[TRIP_PLANE_VOXELS]),
                                    r->frame->settings->indexed);
    if (status)
        return status;
    r->stats[r->axis].splats_read += r->batch.positions;
    bind_batch(&r->batch);
    status = draw_pieces(r, front_to_back);
    if (!status && r->frame->count)
        status = count_pieces(r);
    trip_gl_slot_fence(r->batch.slot);
    if (r->batch.records != r->batch.slot)
        trip_gl_slot_fence(r->batch.records);
    return status;
}

static void *const *take_slots(trip_renderer *base, unsigned count, size_t bytes)
{
    gl_renderer *r = (gl_renderer *)base;
    if (r->copies || bytes > trip_gl_context_limits(r->context)->storage_block_bytes ||
        trip_gl_context_use(r->context) || !trip_gl_slots_take(&r->slots, count, bytes))
        return NULL;
    return r->slots.memory;
}

static void drop_slots(trip_renderer *base)
{
    gl_renderer *r = (gl_renderer *)base;
    if (trip_gl_context_use(r->context) == TRIP_OK)
        trip_gl_slots_release(&r->slots);
}

static int is_done(trip_renderer *base, const trip_batch *batch, bool wait)
{
    gl_renderer *r = (gl_renderer *)base;
    trip_gl_slot *slot = trip_gl_slots_find(&r->slots, batch->planes[TRIP_PLANE_VOXELS]);
    if (!slot)
        return 1;
    int status = trip_gl_context_use(r->context);
    return status ? status : trip_gl_slot_is_done(slot, wait);
}

static int merge(gl_renderer *r)
{
    int status = trip_gl_target_begin_image(&r->target);
    if (!status)
        status = use_program(r, TRIP_GL_PASS_MERGE, 0);
    if (status)
        return status;
    bind_constants(r, 0, true);
    glDisable(GL_BLEND);
    glDisable(GL_STENCIL_TEST);
    glBindVertexArray(r->vertex_array);
    for (unsigned axis = 0; axis < 3; axis++)
        glBindTextureUnit(TRIP_GL_LAYER + axis, r->target.layers[axis]);
    return draw_screen(r);
}

static int read_image(const gl_renderer *r, float *rgba)
{
    int status = TRIP_OK, width = r->target.width, height = r->target.height;
    int rows = STRIP_PIXELS / width + 1;
    for (int y = 0; y < height && !status; y += rows) {
        int count = height - y < rows ? height - y : rows;
        trip_gl_target_read_rows(&r->target, y, count, rgba + (size_t)y * (size_t)width * 4);
        status = trip_frame_poll();
    }
    return status;
}

/* Back to the layer that was being drawn. */
static int go_on(gl_renderer *r)
{
    if (r->masked)
        glEnable(GL_STENCIL_TEST);
    return trip_gl_target_bind_layer(&r->target, r->axis);
}

static void read_counts(gl_renderer *r)
{
    GLuint counts[COUNTS];
    glGetNamedBufferSubData(r->counts, 0, sizeof counts, counts);
    for (int axis = 0; axis < 3; axis++) {
        const GLuint *c = counts + 4 * axis;
        r->stats[axis].splats_projected = c[0] | (uint64_t)c[1] << 32;
        r->stats[axis].splats_drawn = c[2] | (uint64_t)c[3] << 32;
    }
}

static void describe(gl_renderer *r)
{
    const char *name = trip_gl_context_device(r->context);
    if (r->quads)
        snprintf(r->device, sizeof r->device,
                 "%s (%" PRIu64 " splats as triangles: sprites end at %g px)", name, r->quads,
                 trip_gl_context_limits(r->context)->point_size_px);
    else
        snprintf(r->device, sizeof r->device, "%s", name);
}

static int picture(trip_renderer *base, float *rgba, float *depth)
{
    gl_renderer *r = (gl_renderer *)base;
    (void)depth;
    int status = trip_gl_context_use(r->context);
    if (!status)
        status = merge(r);
    if (!status)
        status = read_image(r, rgba);
    if (!status && r->layers)
        status = go_on(r);
    if (status)
        return status;
    if (r->frame->count)
        read_counts(r);
    describe(r);
    return trip_gl_check(r->context, "frame");
}

static void stats(const trip_renderer *base, trip_list_stats lists[3])
{
    memcpy(lists, ((const gl_renderer *)base)->stats, 3 * sizeof *lists);
}

static const trip_renderer_ops gl_ops = {
    .name = "gl",
    .destroy = destroy,
    .device = device,
    .begin_frame = begin_frame,
    .begin_layer = begin_layer,
    .draw = draw,
    .take_slots = take_slots,
    .drop_slots = drop_slots,
    .is_done = is_done,
    .picture = picture,
    .stats = stats,
};

static int make_buffers(gl_renderer *r)
{
    glCreateVertexArrays(1, &r->vertex_array);
    glCreateBuffers(1, &r->table);
    glNamedBufferStorage(r->table, TABLE_BYTES, NULL, GL_DYNAMIC_STORAGE_BIT);
    glCreateBuffers(1, &r->counts);
    glNamedBufferStorage(r->counts, COUNTS * sizeof(GLuint), NULL, GL_DYNAMIC_STORAGE_BIT);
    glEnable(GL_PROGRAM_POINT_SIZE);
    glDisable(GL_DITHER);
    return trip_gl_check(r->context, "buffers");
}

static int choose_slots(gl_renderer *r)
{
    const char *slots = getenv("TRIPTYCH_GL_SLOTS");
    r->copies = !slots || !strcmp(slots, "copy");
    if (!slots || r->copies || !strcmp(slots, "mapped"))
        return TRIP_OK;
    return trip_fail(TRIP_USAGE, "gl", "TRIPTYCH_GL_SLOTS", "'%s' is neither mapped nor copy",
                     slots);
}

int trip_gl_create(trip_renderer **out, trip_budget *budget)
{
    gl_renderer *r = calloc(1, sizeof *r);
    *out = NULL;
    if (!r)
        return trip_fail(TRIP_ERROR, "gl", "renderer", "out of memory");
    r->base.ops = &gl_ops;
    r->budget = r->ring.budget = r->target.budget = r->resident.budget = budget;
    r->slots.budget = budget;
    int status = choose_slots(r);
    if (!status)
        status = trip_gl_context_create(&r->context);
    if (!status)
        status = make_buffers(r);
    if (status) {
        destroy(&r->base);
        return status;
    }
    describe(r);
    *out = &r->base;
    return TRIP_OK;
}
