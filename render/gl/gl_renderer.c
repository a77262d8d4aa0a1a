/* The OpenGL renderer, trip_gl_create(). It fills one layer for each list. In `pre` it blends the
 * splats in list order, and a stencil masks the pixels that the current pass does not draw. In
 * `post` it draws the sheets sample by sample (gl/gl_sheets.h). A full-screen pass then merges the
 * layers.
 *
 * The shaders in shaders/ mirror the reference renderer. The code here computes only the constants
 * of a frame and the positions of runs. */
#include "renderer.h"

#include <assert.h>
#include <epoxy/gl.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "gl/gl_batch.h"
#include "gl/constants.h"
#include "gl/gl_context.h"
#include "gl/frame_block.h"
#include "gl/lattices.h"
#include "gl/queue.h"
#include "gl/resident.h"
#include "gl/ring.h"
#include "gl/gl_sheets.h"
#include "gl/gl_surfels.h"
#include "gl/gl_tiles.h"
#include "gl/slots.h"
#include "gl/sums.h"
#include "gl/target.h"
#include "gl/variant.h"
#include "gl/voxel_positions.h"
#include "report.h"
#include "weight.h"

enum {
    COUNTS = 4, /* counters of one list: low and high half of projected, then of drawn */
    QUAD_VERTICES = 4,
    QUAD_INDICES = 6,
};

typedef struct gl_renderer {
    trip_renderer base;
    trip_budget *budget;
    trip_gl_context *context;
    trip_gl_variants variants;
    trip_gl_target target;
    trip_gl_queue queue;
    trip_gl_ring ring;
    trip_gl_slots slots; /* memory for a reader that reads directly into GL memory */
    bool copies;         /* take_slots() returns NULL, so batches are copied */
    trip_gl_batch batch;
    trip_gl_cursor at;         /* progress in the batch */
    bool in_batch;             /* the batch is not completely drawn */
    bool prepared;             /* prepare() has finished for this frame */
    const trip_gl_band *band;  /* the current band */
    trip_gl_resident resident; /* for the submission forms indexed and resident */
    GLuint vertex_array, quad_indices;
    GLuint counts;
    trip_gl_constants constants;
    trip_gl_voxel_positions positions;
    trip_gl_lattices lattices; /* only for frames with effects */
    trip_gl_sheets sheets;     /* only for `post` */
    trip_gl_sums sums;         /* only for frames that composite sheet by sheet */
    trip_gl_tiles tiles;       /* only for Gaussian scenes */
    trip_gl_surfels surfels;   /* only for deferred pictures */
    const trip_frame *frame;
    bool in_layer;          /* some sheets of the current layer may not be drawn yet */
    int axis;               /* of the current layer */
    unsigned layers;        /* bit a is set once the layer of axis a has begun */
    bool masked;            /* the stencil masks the current layer */
    trip_way way;           /* direction of the rays of the current pass */
    uint64_t quads;         /* splats of the frame drawn as quads although sprites were requested */
    trip_list_stats *stats; /* by list index; `counts` has the same capacity */
    unsigned stats_room;
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
        trip_gl_queue_drain(&r->queue);
        trip_gl_variants_release(&r->variants);
        trip_gl_target_release(&r->target);
        trip_gl_ring_release(&r->ring);
        trip_gl_slots_release(&r->slots);
        trip_gl_resident_release(&r->resident);
        trip_gl_constants_release(&r->constants);
        trip_gl_voxel_positions_release(&r->positions);
        trip_gl_lattices_release(&r->lattices);
        trip_gl_sheets_release(&r->sheets);
    }
    trip_gl_batch_release(&r->batch);
    free(r->stats);
    trip_gl_context_destroy(r->context); /* frees all remaining GL objects */
    free(r);
}

static int check_size(const gl_renderer *r, const trip_camera *camera)
{
    int max = trip_gl_context_limits(r->context)->image_px;
    if (camera->width <= max && camera->height <= max)
        return TRIP_OK;
    return trip_fail(TRIP_ERROR, "gl", "image",
                     "%d x %d px exceed this driver's limit of %d px; use a smaller size or "
                     "another renderer",
                     camera->width, camera->height, max);
}

/* Ensures that the counters can hold `lists` lists. */
static int fit_stats(gl_renderer *r, unsigned lists)
{
    if (lists <= r->stats_room)
        return TRIP_OK;
    trip_list_stats *more = realloc(r->stats, lists * sizeof *more);
    if (!more)
        return trip_fail(TRIP_ERROR, "gl", "lists", "out of memory");
    r->stats = more;
    glDeleteBuffers(1, &r->counts);
    glCreateBuffers(1, &r->counts);
    glNamedBufferStorage(r->counts, (GLsizeiptr)(lists * COUNTS * sizeof(GLuint)), NULL,
                         GL_DYNAMIC_STORAGE_BIT);
    r->stats_room = lists;
    return trip_gl_check(r->context, "counts");
}

static bool classifies_post(const gl_renderer *r)
{
    return r->frame->settings->classify == TRIP_CLASSIFY_POST;
}

static bool sums_sheets(const gl_renderer *r)
{
    return trip_settings_sum_sheets(r->frame->settings);
}

/* Prepares the frame. Call it only after the GPU has finished all earlier frames, because it frees
 * memory that they use. */
static int prepare(gl_renderer *r)
{
    const trip_frame *frame = r->frame;
    const trip_camera *camera = frame->camera;
    int status = trip_gl_target_resize(&r->target, camera->width, camera->height,
                                       frame->settings->target, frame->settings->depth);
    if (!status)
        status = trip_gl_constants_fill(&r->constants, r->context, frame);
    if (!status)
        status = trip_gl_lattices_begin(&r->lattices, r->context, frame);
    if (!status)
        status = fit_stats(r, frame->data->list_count);
    if (!status && trip_settings_stays(frame->settings))
        status = trip_gl_resident_begin(&r->resident, frame->data, frame->plan->planes,
                                        !frame->settings->indexed,
                                        trip_gl_context_limits(r->context)->storage_block_bytes);
    if (status)
        return status;
    memset(r->stats, 0, frame->data->list_count * sizeof *r->stats);
    if (frame->count) {
        static const GLuint zero = 0;
        glClearNamedBufferData(r->counts, GL_R32UI, GL_RED_INTEGER, GL_UNSIGNED_INT, &zero);
    }
    if (classifies_post(r))
        status = trip_gl_sheets_begin_frame(&r->sheets, frame);
    else
        status = trip_gl_voxel_positions_set(&r->positions, &frame->data->coordinates);
    if (status)
        return status;
    r->prepared = true;
    return trip_gl_check(r->context, "frame");
}

/* Prepares the frame if the GPU has finished all its work. Otherwise returns TRIP_FRAME_WAITS. */
static int prepare_when_done(gl_renderer *r)
{
    int done = trip_gl_queue_is_done(&r->queue, r->queue.ended, false);
    return done < 0 ? done : done ? prepare(r) : TRIP_FRAME_WAITS;
}

/* gl blends all splats. The result is within the tolerance of the default early termination. */
static int check_early_termination(const trip_settings *s)
{
    if (s->classify == TRIP_CLASSIFY_POST || s->early_termination <= TRIP_EARLY_TERMINATION_PRE)
        return TRIP_OK;
    return trip_fail(TRIP_USAGE, "render", "gl",
                     "draws all splats: --early-termination %g requires --renderer cpu or "
                     "reference, or --classify post",
                     s->early_termination);
}

static int begin_frame(trip_renderer *base, const trip_frame *frame)
{
    gl_renderer *r = (gl_renderer *)base;
    int status = check_size(r, frame->camera);
    if (!status)
        status = check_early_termination(frame->settings);
    if (!status)
        status = trip_gl_context_use(r->context);
    if (status)
        return status;
    r->base.resident = trip_settings_stays(frame->settings);
    r->frame = frame;
    r->layers = 0;
    r->quads = 0;
    r->prepared = false;
    r->in_batch = false;
    r->in_layer = false;
    r->sums.method = frame->settings->method;
    status = prepare_when_done(r);
    return status < 0 ? status : TRIP_OK;
}

static int load(trip_renderer *base)
{
    gl_renderer *r = (gl_renderer *)base;
    int status = trip_gl_context_use(r->context);
    if (!status && !r->prepared)
        status = prepare_when_done(r);
    if (!status)
        status = trip_gl_lattices_load(&r->lattices, r->context, r->frame);
    if (status || !trip_settings_stays(r->frame->settings))
        return status;
    return trip_gl_resident_load(&r->resident);
}

static void await(trip_renderer *base, uint64_t timeout_ns)
{
    gl_renderer *r = (gl_renderer *)base;
    if (r->prepared && trip_settings_stays(r->frame->settings) && r->resident.loading)
        trip_gl_resident_await(&r->resident, timeout_ns);
    else if (trip_gl_context_use(r->context) == TRIP_OK)
        trip_gl_queue_await(&r->queue, timeout_ns);
}

/* Returns 0 if a part may begin, TRIP_FRAME_WAITS if not yet, or a negative failure. */
static int await_room(gl_renderer *r)
{
    int room = trip_gl_queue_has_room(&r->queue);
    return room < 0 ? room : room ? TRIP_OK : TRIP_FRAME_WAITS;
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

/* Runs the current program over the whole layer, strip by strip. */
static int draw_screen(gl_renderer *r, int axis)
{
    const trip_gl_target *t = &r->target;
    int status = TRIP_OK;
    glEnable(GL_SCISSOR_TEST);
    for (const trip_gl_band *b = t->bands; b < t->bands + t->band_count; b++) {
        trip_gl_target_bind(t, axis, b);
        glUniform1i(TRIP_GL_ROW, b->first_row);
        for (int y = 0; y < b->rows && !status; y += t->strip_rows) {
            glScissor(0, y, t->width, t->strip_rows);
            glDrawArrays(GL_TRIANGLES, 0, 3);
            status = trip_gl_queue_end_part(&r->queue);
        }
    }
    glDisable(GL_SCISSOR_TEST);
    return status;
}

/* Returns the stencil value for pixels with weight and rays in direction `way`. All others have 0.
 */
static GLint mark_of(trip_way way)
{
    return way == TRIP_WAY_DOWN ? 2 : 1;
}

static const GLuint all_marks = 3;

/* Restricts drawing to the pixels of the current pass. */
static void draw_masked(const gl_renderer *r)
{
    glEnable(GL_STENCIL_TEST);
    glStencilFunc(GL_EQUAL, mark_of(r->way), all_marks);
    glStencilOp(GL_KEEP, GL_KEEP, GL_KEEP);
}

static int mark_region(gl_renderer *r, int axis, trip_way way)
{
    static_assert(TRIP_WAY_ANY == TRIP_GL_WAY_ANY && TRIP_WAY_UP == TRIP_GL_WAY_UP, "as in GLSL");
    int status = use_program(r, TRIP_GL_PASS_REGION, 0);
    if (status)
        return status;
    trip_gl_constants_bind_layer(&r->constants, axis, true);
    glEnable(GL_STENCIL_TEST);
    glStencilFunc(GL_ALWAYS, mark_of(way), all_marks);
    glStencilOp(GL_KEEP, GL_KEEP, GL_REPLACE);
    glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
    glUniform1i(TRIP_GL_WAY, (GLint)way);
    status = draw_screen(r, axis);
    glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    return status;
}

/* Marks the pixels with weight. If the passes of a layer differ by ray direction, each direction
 * gets its own mark. */
static int mask_region(gl_renderer *r, int axis)
{
    if (!r->frame->plan->layers[axis].parted)
        return mark_region(r, axis, TRIP_WAY_ANY);
    int status = mark_region(r, axis, TRIP_WAY_UP);
    return status ? status : mark_region(r, axis, TRIP_WAY_DOWN);
}

/* Draws a part of the last sheets of the current layer, if any are open. */
static int end_passes(trip_renderer *base)
{
    gl_renderer *r = (gl_renderer *)base;
    int status = trip_gl_context_use(r->context);
    if (!status)
        status = await_room(r);
    if (!status && r->in_layer && classifies_post(r))
        status = trip_gl_sheets_end_layer(&r->sheets);
    else if (!status && r->in_layer && sums_sheets(r))
        status = trip_gl_sums_end_layer(&r->sums);
    r->in_layer = r->in_layer && status > 0;
    return status;
}

static int begin_sheet_layer(gl_renderer *r, int axis)
{
    int status = end_passes(&r->base);
    if (!status)
        status = trip_gl_target_begin_layer(&r->target, axis, false, false);
    if (!status)
        status = trip_gl_sheets_begin_layer(&r->sheets, axis);
    if (status)
        return status;
    r->layers |= 1u << axis;
    r->in_layer = true;
    return trip_gl_check(r->context, "layer");
}

static int begin_layer(trip_renderer *base, int axis)
{
    gl_renderer *r = (gl_renderer *)base;
    const trip_frame *frame = r->frame;
    if (classifies_post(r))
        return begin_sheet_layer(r, axis);
    const bool whole =
        !frame->plan->layers[axis].parted &&
        trip_weight_is_everywhere(frame->settings, frame->camera, frame->plan->axis_of_view, axis);
    int status = end_passes(base);
    if (!status)
        status = trip_gl_target_begin_layer(&r->target, axis, !whole, sums_sheets(r));
    if (status)
        return status; /* the previous layer may have more sheets to draw */
    trip_gl_sums_begin_layer(&r->sums, axis);
    glDisable(GL_BLEND);
    glDisable(GL_STENCIL_TEST);
    glBindVertexArray(r->vertex_array);
    if (!whole)
        status = mask_region(r, axis);
    if (status)
        return status;
    r->layers |= 1u << axis;
    r->axis = axis;
    r->masked = !whole;
    r->way = trip_plan_way(frame->plan, axis, false);
    r->in_layer = true;
    if (trip_settings_stays(frame->settings))
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

static void draw_quads(const trip_gl_piece *piece)
{
    glDrawElementsBaseVertex(GL_TRIANGLES, (GLsizei)piece->count * QUAD_INDICES, GL_UNSIGNED_INT,
                             NULL, (GLint)(piece->first * QUAD_VERTICES));
}

static int draw_piece(gl_renderer *r, const trip_gl_piece *piece)
{
    unsigned effects = r->constants.lists[piece->list].effects |
                       (piece->quads ? TRIP_GL_QUADS : 0) | (piece->near ? TRIP_GL_NEAR : 0);
    const unsigned level = r->frame->data->lists[piece->list].level;
    int status =
        sums_sheets(r) ? trip_gl_sums_use(&r->sums, r->band, level, piece->sheet) : TRIP_OK;
    if (!status)
        status = use_program(r, TRIP_GL_PASS_SPLAT, effects);
    if (status)
        return status;
    trip_gl_constants_bind_list(&r->constants, piece->list, false);
    if (effects & TRIP_GL_PLACED)
        trip_gl_lattices_bind_block(&r->lattices, piece->list);
    glUniform1i(TRIP_GL_ROW, r->band->first_row);
    if (piece->quads)
        draw_quads(piece);
    else
        glDrawArrays(GL_POINTS, (GLint)piece->first, (GLsizei)piece->count);
    return TRIP_OK;
}

static int count_piece(gl_renderer *r, const trip_gl_piece *piece)
{
    int status = use_program(r, TRIP_GL_PASS_COUNT, r->constants.lists[piece->list].effects);
    if (status)
        return status;
    trip_gl_constants_bind_list(&r->constants, piece->list, true);
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, TRIP_GL_COUNTS, r->counts);
    glUniform3ui(TRIP_GL_PIECE, piece->first, piece->count, piece->list);
    glUniform1i(TRIP_GL_WAY, (GLint)r->way);
    glDispatchCompute((piece->count + TRIP_GL_COUNT_GROUP - 1) / TRIP_GL_COUNT_GROUP, 1, 1);
    glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT | GL_SHADER_STORAGE_BARRIER_BIT);
    return TRIP_OK;
}

/* Software GL processes vertices within the draw calls, so its parts are smaller. */
static uint32_t part_cost(const gl_renderer *r)
{
    return r->base.software ? TRIP_GL_PART_COST / TRIP_GL_SOFTWARE_PARTS : TRIP_GL_PART_COST;
}

/* Calls `run` for the pieces of the next part of the batch, starting at the cursor. */
static int for_part(gl_renderer *r, trip_gl_cursor *at,
                    int (*run)(gl_renderer *, const trip_gl_piece *))
{
    int status = TRIP_OK;
    uint32_t room = part_cost(r);
    while (room > 0 && !trip_gl_batch_is_drawn(&r->batch, at) && !status) {
        const trip_gl_piece piece = trip_gl_batch_next(&r->batch, at, &room);
        status = run(r, &piece);
    }
    return status;
}

/* Sets all GL state for drawing splats. Other calls, such as picture(), may have changed it since
 * the last part. */
static void prepare_drawing(gl_renderer *r, bool front_to_back)
{
    glEnable(GL_BLEND);
    if (front_to_back)
        glBlendFunc(GL_ONE_MINUS_DST_ALPHA, GL_ONE);
    else
        glBlendFunc(GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
    if (r->masked)
        draw_masked(r);
    r->sums.front_to_back = front_to_back;
    bind_batch(&r->batch);
    trip_gl_voxel_positions_bind(&r->positions, trip_settings_stays(r->frame->settings));
    trip_gl_lattices_bind(&r->lattices);
}

static int draw_bands(gl_renderer *r)
{
    const trip_gl_target *t = &r->target;
    const trip_gl_cursor from = r->at;
    int status = TRIP_OK;
    for (r->band = t->bands; r->band < t->bands + t->band_count && !status; r->band++) {
        r->at = from;
        trip_gl_target_bind(t, r->axis, r->band);
        status = for_part(r, &r->at, draw_piece);
    }
    return status;
}

static int draw_part(gl_renderer *r, bool front_to_back)
{
    trip_gl_cursor counted = r->at;
    prepare_drawing(r, front_to_back);
    int status = draw_bands(r);
    if (!status && r->frame->count)
        status = for_part(r, &counted, count_piece);
    if (!status)
        status = trip_gl_queue_end_part(&r->queue);
    r->batch.slot->part = r->batch.records->part = r->queue.ended;
    return status;
}

static void count_read(gl_renderer *r, const trip_batch *batch)
{
    for (size_t i = 0; i < batch->run_count; i++)
        r->stats[trip_batch_list(batch, &batch->runs[i])->index].splats_read +=
            batch->runs[i].count;
}

/* Selects the ray direction of the batch's pass. */
static int use_way(gl_renderer *r, const trip_batch *batch)
{
    const trip_way way = trip_plan_way(r->frame->plan, r->axis, batch->pass->descending);
    const bool other = way != r->way;
    r->way = way;
    return other && sums_sheets(r) ? trip_gl_sums_end_layer(&r->sums) : TRIP_OK;
}

static int begin_batch(gl_renderer *r, const trip_batch *batch)
{
    trip_gl_slot *slot = trip_gl_slots_find(&r->slots, batch->planes[TRIP_PLANE_VOXELS]);
    int status = use_way(r, batch);
    if (!status)
        status =
            trip_gl_batch_fill(&r->batch, &r->ring, r->constants.lists, r->frame->plan, batch, slot,
                               trip_settings_stays(r->frame->settings) ? r->resident.lists : NULL);
    if (status)
        return status;
    count_read(r, batch);
    for (size_t i = 0; i < r->batch.piece_count && !r->frame->settings->triangles; i++)
        r->quads += r->batch.pieces[i].quads ? r->batch.pieces[i].count : 0;
    r->at = (trip_gl_cursor){ 0 };
    r->in_batch = true;
    return TRIP_OK;
}

static int draw_sheets(gl_renderer *r, const trip_batch *batch)
{
    int status = trip_gl_sheets_draw(&r->sheets, batch);
    if (status == 0)
        count_read(r, batch);
    return status;
}

/* Returns 0 if the ring has a free slot or the batch already holds one, TRIP_FRAME_WAITS if not
 * yet, or a negative failure. */
static int await_slot(const gl_renderer *r)
{
    bool taken = classifies_post(r) ? r->sheets.batch.begun : r->in_batch;
    int is_free = taken ? 1 : trip_gl_ring_is_free(&r->ring);
    return is_free < 0 ? is_free : is_free ? TRIP_OK : TRIP_FRAME_WAITS;
}

static int draw(trip_renderer *base, const trip_batch *batch, bool front_to_back)
{
    gl_renderer *r = (gl_renderer *)base;
    int status = trip_gl_context_use(r->context);
    if (!status)
        status = await_room(r);
    if (!status)
        status = await_slot(r);
    if (!status && classifies_post(r))
        return draw_sheets(r, batch);
    if (!status && !r->in_batch)
        status = begin_batch(r, batch);
    if (!status)
        status = draw_part(r, front_to_back);
    if (status)
        return status;
    r->in_batch = !trip_gl_batch_is_drawn(&r->batch, &r->at);
    return r->in_batch;
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
    if (trip_gl_context_use(r->context))
        return;
    trip_gl_queue_drain(&r->queue);
    trip_gl_slots_release(&r->slots);
}

static int is_done(trip_renderer *base, const trip_batch *batch)
{
    gl_renderer *r = (gl_renderer *)base;
    trip_gl_slot *slot = trip_gl_slots_find(&r->slots, batch->planes[TRIP_PLANE_VOXELS]);
    if (!slot)
        return 1;
    int status = trip_gl_context_use(r->context);
    return status ? status : trip_gl_queue_is_done(&r->queue, slot->part, false);
}

/* Merges a strip of the band, from row `y` on, and reads it back. */
static int merge_strip(gl_renderer *r, const trip_gl_band *band, int y, float *rgba, float *depth)
{
    const trip_gl_target *t = &r->target;
    int left = band->rows - y, rows = left < t->strip_rows ? left : t->strip_rows;
    size_t at = (size_t)(band->first_row + y) * (size_t)t->width;
    trip_gl_target_bind_strip(t, rows);
    glUniform1i(TRIP_GL_ROW, band->first_row + y);
    glUniform1i(TRIP_GL_ROW_IN_BAND, y);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    int status = trip_gl_queue_end_part(&r->queue);
    if (!status)
        status = trip_gl_queue_is_done(&r->queue, r->queue.ended, true);
    if (status < 0)
        return status;
    trip_gl_target_read_strip(t, rows, rgba + 4 * at, depth ? depth + at : NULL);
    return trip_frame_poll();
}

static int merge(gl_renderer *r, float *rgba, float *depth)
{
    const trip_gl_target *t = &r->target;
    int status = use_program(r, TRIP_GL_PASS_MERGE, t->depth ? TRIP_GL_DEPTH : 0);
    trip_gl_constants_bind_layer(&r->constants, 0, true);
    glDisable(GL_BLEND);
    glDisable(GL_STENCIL_TEST);
    glBindVertexArray(r->vertex_array);
    for (const trip_gl_band *b = t->bands; b < t->bands + t->band_count; b++) {
        for (unsigned axis = 0; axis < 3; axis++) {
            glBindTextureUnit(TRIP_GL_LAYER + axis, b->layers[axis].colour);
            glBindTextureUnit(TRIP_GL_LAYER_DEPTH + axis, b->layers[axis].depth);
        }
        for (int y = 0; y < b->rows && !status; y += t->strip_rows)
            status = merge_strip(r, b, y, rgba, depth);
    }
    return status;
}

static void read_counts(gl_renderer *r)
{
    for (unsigned i = 0; i < r->frame->data->list_count; i++) {
        GLuint c[COUNTS];
        glGetNamedBufferSubData(r->counts, (GLintptr)(i * sizeof c), sizeof c, c);
        r->stats[i].splats_projected = c[0] | (uint64_t)c[1] << 32;
        r->stats[i].splats_drawn = c[2] | (uint64_t)c[3] << 32;
    }
}

static void describe(gl_renderer *r)
{
    const char *name = trip_gl_context_device(r->context);
    if (r->quads)
        snprintf(r->device, sizeof r->device,
                 "%s (%" PRIu64 " splats as triangles: sprite limit %g px)", name, r->quads,
                 trip_gl_context_limits(r->context)->point_size_px);
    else
        snprintf(r->device, sizeof r->device, "%s", name);
}

static int wait_and_prepare(gl_renderer *r)
{
    int status = trip_gl_queue_is_done(&r->queue, r->queue.ended, true);
    return status < 0 ? status : prepare(r);
}

static int picture(trip_renderer *base, float *rgba, float *depth)
{
    gl_renderer *r = (gl_renderer *)base;
    int status = trip_gl_context_use(r->context);
    if (!status && !r->prepared)
        status = wait_and_prepare(r);
    if (!status)
        status = merge(r, rgba, depth);
    if (status)
        return status;
    if (r->frame->count)
        read_counts(r);
    describe(r);
    return trip_gl_check(r->context, "frame");
}

static void end_frame(trip_renderer *base)
{
    gl_renderer *r = (gl_renderer *)base;
    trip_gl_resident_pause(&r->resident);
    if (trip_gl_context_use(r->context))
        return;
    trip_gl_queue_leave(&r->queue);
    trip_gl_ring_leave(&r->ring);
}

static const trip_tile_device *tile_device(trip_renderer *base)
{
    return &((gl_renderer *)base)->tiles.device;
}

static const trip_surfel_device *surfel_device(trip_renderer *base)
{
    return &((gl_renderer *)base)->surfels.device;
}

static trip_list_stats stats(const trip_renderer *base, unsigned list)
{
    return ((const gl_renderer *)base)->stats[list];
}

static const trip_renderer_ops gl_ops = {
    .name = "gl",
    .classifies_post = true,
    .closed_forms = true,
    .blurs = true,
    .effects = 1u << TRIP_CLASSIFY_PRE | 1u << TRIP_CLASSIFY_POST,
    .forms = TRIP_DRAWS_FIXED,
    .destroy = destroy,
    .device = device,
    .begin_frame = begin_frame,
    .load = load,
    .await = await,
    .begin_layer = begin_layer,
    .draw = draw,
    .end_passes = end_passes,
    .in_parts = true,
    .take_slots = take_slots,
    .drop_slots = drop_slots,
    .is_done = is_done,
    .picture = picture,
    .end_frame = end_frame,
    .tile_device = tile_device,
    .surfel_device = surfel_device,
    .stats = stats,
};

/* Makes the index list that all quads of a part share: two triangles over corners 0 to 3 of each
 * quad. */
static int make_quad_indices(gl_renderer *r)
{
    static const GLuint corners[QUAD_INDICES] = { 0, 1, 2, 2, 1, 3 };
    size_t count = (size_t)TRIP_GL_PART_COST * QUAD_INDICES;
    GLuint *indices = malloc(count * sizeof *indices);
    if (!indices)
        return trip_fail(TRIP_ERROR, "gl", "quads", "out of memory");
    for (size_t i = 0; i < count; i++)
        indices[i] = (GLuint)(i / QUAD_INDICES) * QUAD_VERTICES + corners[i % QUAD_INDICES];
    glCreateBuffers(1, &r->quad_indices);
    glNamedBufferStorage(r->quad_indices, (GLsizeiptr)(count * sizeof *indices), indices, 0);
    glVertexArrayElementBuffer(r->vertex_array, r->quad_indices);
    free(indices);
    return TRIP_OK;
}

static int make_buffers(gl_renderer *r)
{
    glCreateVertexArrays(1, &r->vertex_array);
    int status = make_quad_indices(r);
    if (status)
        return status;
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
    return trip_fail(TRIP_USAGE, "gl", "TRIPTYCH_GL_SLOTS",
                     "invalid value '%s'; use mapped or copy", slots);
}

static void set_up_sheets(gl_renderer *r)
{
    trip_gl_sheets *s = &r->sheets;
    s->ring = &r->ring;
    s->queue = &r->queue;
    s->variants = &r->variants;
    s->constants = &r->constants;
    s->lattices = &r->lattices;
    s->target = &r->target;
    r->sums.variants = &r->variants;
    r->sums.target = &r->target;
    s->textures.budget = s->function.budget = s->positions.budget = s->blur.budget = r->budget;
    r->positions.budget = r->budget;
}

int trip_gl_create(trip_renderer **out, trip_budget *budget)
{
    gl_renderer *r = calloc(1, sizeof *r);
    *out = NULL;
    if (!r)
        return trip_fail(TRIP_ERROR, "gl", "renderer", "out of memory");
    r->base.ops = &gl_ops;
    r->budget = r->ring.budget = r->target.budget = r->resident.budget = budget;
    r->slots.budget = r->lattices.budget = budget;
    r->ring.queue = &r->queue;
    set_up_sheets(r);
    int status = choose_slots(r);
    if (!status)
        status = trip_gl_context_create(&r->context);
    r->sheets.context = r->context;
    if (!status)
        status = make_buffers(r);
    if (status) {
        destroy(&r->base);
        return status;
    }
    r->tiles = (trip_gl_tiles){ r->context, &r->queue, &r->variants, { 0 } };
    trip_gl_tiles_set_up(&r->tiles);
    r->surfels = (trip_gl_surfels){ r->context, &r->queue, &r->variants, { 0 } };
    trip_gl_surfels_set_up(&r->surfels);
    r->base.software = r->target.software = trip_gl_context_limits(r->context)->software;
    describe(r);
    *out = &r->base;
    return TRIP_OK;
}
