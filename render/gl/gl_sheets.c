#include "gl/gl_sheets.h"

#include <math.h>
#include <string.h>

#include "brick_ranges.h"
#include "field.h"
#include "gl/frame_block.h"
#include "report.h"
#include "sheet.h"

/* Limits of one part of the work: pixels times segment ends, squares to decode, voxels that get
 * gradients. */
enum { PART_ENDS = 1 << 20, PART_SQUARES = 1 << 14, PART_VOXELS = 1 << 20 };

/* ---- frames, layers, passes ---- */

/* Returns the number of sheets on each side that affect an interval. The kernel needs some;
 * gradients need one more. */
static int sheets_about(const trip_settings *s)
{
    return trip_sheet_reach(s->kernel) - 1;
}

static unsigned effects_of(const trip_frame *frame)
{
    const trip_settings *s = frame->settings;
    return (trip_kernel_is_wide(s->kernel) ? TRIP_GL_WIDE : 0) |
           (s->kernel == TRIP_KERNEL_NEAREST ? TRIP_GL_NEAREST : 0) |
           (frame->camera->ortho ? TRIP_GL_PARALLEL : 0) | (s->shading ? TRIP_GL_SHADED : 0) |
           (s->shading && s->headlight ? TRIP_GL_HEADLIGHT : 0) | (s->depth ? TRIP_GL_DEPTH : 0) |
           trip_gl_frame_placed(s) |
           (trip_coordinates_uneven(&frame->data->coordinates) ? TRIP_GL_UNEVEN : 0) |
           (frame->plan->not_closed ? 0 : TRIP_GL_CLOSED) |
           (frame->plan->blurs ? TRIP_GL_BLURRED : 0) |
           (frame->plan->draw.of_stored ? TRIP_GL_EXACT : 0);
}

static void forget(trip_gl_sheets *s)
{
    s->pass = NULL;
    s->count = s->front = 0;
    s->batch = (trip_gl_sheet_batch){ 0 };
    s->drawing = (trip_gl_sheet_drawing){ 0 };
}

static int set_function(trip_gl_sheets *s, const trip_frame *frame)
{
    const trip_plan *plan = frame->plan;
    const double voxel_world = frame->camera->voxel_world;
    if (!plan->blurs)
        trip_gl_sheet_blur_rest(&s->blur);
    int status =
        trip_gl_sheet_tf_set(&s->function, frame->table, plan->not_closed ? NULL : &plan->closed,
                             &plan->draw, voxel_world);
    if (!status && plan->blurs)
        status = trip_gl_sheet_blur_set(&s->blur, frame->table, &plan->draw, voxel_world);
    return status;
}

int trip_gl_sheets_begin_frame(trip_gl_sheets *s, const trip_frame *frame)
{
    s->frame = frame;
    s->coordinates = &frame->data->coordinates;
    s->effects = effects_of(frame);
    forget(s);
    if (!s->ends_block) {
        glCreateBuffers(1, &s->pass_block);
        glNamedBufferStorage(s->pass_block, sizeof(trip_gl_sheet_pass), NULL,
                             GL_DYNAMIC_STORAGE_BIT);
        glCreateBuffers(1, &s->ends_block);
        glNamedBufferStorage(s->ends_block, TRIP_GL_ENDS_MAX * sizeof(trip_gl_sheet_end), NULL,
                             GL_DYNAMIC_STORAGE_BIT);
    }
    return set_function(s, frame);
}

void trip_gl_sheets_release(trip_gl_sheets *s)
{
    trip_gl_sheet_textures_release(&s->textures);
    trip_gl_sheet_tf_release(&s->function);
    trip_gl_sheet_blur_release(&s->blur);
    trip_gl_sheet_positions_release(&s->positions);
    glDeleteBuffers(1, &s->pass_block);
    glDeleteBuffers(1, &s->ends_block);
    s->pass_block = s->ends_block = 0;
}

/* A rectangle of voxels along u and v of a list; the bounds are inclusive. */
typedef struct rectangle {
    int64_t lo[2], hi[2];
} rectangle;

static void widen(rectangle *r, const trip_selection *selection, unsigned tile_log2)
{
    for (uint64_t i = 0; i < selection->list->brick_count; i++) {
        const trip_file_brick *b = &selection->list->bricks[i];
        if (!trip_selection_has(selection, i))
            continue;
        const int64_t corner[2] = { (int64_t)b->tile_u << tile_log2,
                                    (int64_t)b->tile_v << tile_log2 };
        const int64_t lo[2] = { corner[0] + b->u_min, corner[1] + b->v_min };
        const int64_t hi[2] = { corner[0] + b->u_max, corner[1] + b->v_max };
        for (int a = 0; a < 2; a++) {
            r->lo[a] = lo[a] < r->lo[a] ? lo[a] : r->lo[a];
            r->hi[a] = hi[a] > r->hi[a] ? hi[a] : r->hi[a];
        }
    }
}

/* Finds the rectangle of all voxels that the layer's passes read. It is one voxel if they read
 * none. */
static void find_extent(trip_gl_sheets *s)
{
    const trip_plan_layer *layer = &s->frame->plan->layers[s->axis];
    rectangle r = { { INT64_MAX, INT64_MAX }, { INT64_MIN, INT64_MIN } };
    for (int i = 0; i < layer->pass_count; i++)
        for (unsigned k = 0; k < layer->passes[i].pass.selection_count; k++)
            widen(&r, &layer->passes[i].pass.selections[k], s->frame->data->header.tile_log2);
    for (int a = 0; a < 2; a++) {
        s->first[a] = r.lo[a] <= r.hi[a] ? r.lo[a] : 0;
        s->size[a] = r.lo[a] <= r.hi[a] ? r.hi[a] - r.lo[a] + 1 : 1;
    }
}

int trip_gl_sheets_begin_layer(trip_gl_sheets *s, int axis)
{
    s->axis = axis;
    forget(s);
    find_extent(s);
    /* An interval needs the sheets around it on both sides, and one before it may still be held. */
    const unsigned min = 2 * (unsigned)sheets_about(s->frame->settings) + 1;
    int status =
        trip_gl_sheet_textures_fit(&s->textures, s->size[0], s->size[1], min,
                                   s->frame->settings->shading, s->effects & TRIP_GL_BLURRED);
    if (!status && s->effects & TRIP_GL_UNEVEN)
        status =
            trip_gl_sheet_positions_set(&s->positions, s->coordinates, axis, s->first, s->size);
    return status;
}

static void begin_pass(trip_gl_sheets *s, const trip_pass *pass)
{
    s->pass = pass;
    s->way = pass->descending ? -1 : 1;
    s->view = trip_gl_sheet_view_make(s->frame, s->axis, pass->descending, s->first, s->size,
                                      s->function.unit);
    s->eye = trip_coordinates_index(s->coordinates, s->axis, s->view.eye[0]);
    glNamedBufferSubData(s->pass_block, 0, sizeof s->view.constants, &s->view.constants);
}

static int use_program(trip_gl_sheets *s, trip_gl_pass pass)
{
    GLuint program = 0;
    trip_gl_variant variant = { pass, s->frame->settings->method, s->effects, 0 };
    int status = trip_gl_variants_get(s->variants, variant, &program);
    if (!status)
        glUseProgram(program);
    return status;
}

static GLuint groups_over(int length)
{
    return (GLuint)(length + TRIP_GL_SQUARE_GROUP - 1) / TRIP_GL_SQUARE_GROUP;
}

/* ---- from runs to sheets ---- */

/* Sets u and v of a square's corner in its tile, from its Morton number. */
static void corner_of(uint32_t number, uint32_t at[2])
{
    at[0] = 8 * trip_morton_even(number);
    at[1] = 8 * trip_morton_even(number >> 1);
}

/* Returns the bytes of the deviations of a run that the frame reads. */
static size_t deviation_bytes(const trip_gl_sheets *s, const trip_block *block)
{
    return s->effects & TRIP_GL_BLURRED && block->deviations ? block->count : 0;
}

/* Fills the squares of a run with codes at offset `codes` of the slot's codes. Deviations follow
 * the codes. Returns the number of squares. */
static uint32_t fill_squares(const trip_gl_sheets *s, const trip_run *run, const trip_block *block,
                             size_t codes, struct trip_gl_sheet_square *out)
{
    trip_square squares[TRIP_BLOCK_SQUARES_MAX];
    const uint32_t count = trip_block_squares(block, squares);
    const size_t deviations = codes + trip_block_codes_bytes(block);
    const bool some = deviation_bytes(s, block) > 0;
    for (uint32_t n = 0; n < count; n++) {
        const trip_square *of = &squares[n];
        uint32_t at[2];
        corner_of(of->number, at);
        /* A square may begin before the first voxel of the sheet; its corner then wraps in 16 bits.
         */
        uint32_t u = (uint32_t)(run->u - s->first[0]) + at[0];
        uint32_t v = (uint32_t)(run->v - s->first[1]) + at[1];
        out[n] = (struct trip_gl_sheet_square){
            .mask_low = (uint32_t)of->mask,
            .mask_high = (uint32_t)(of->mask >> 32),
            .codes = (uint32_t)(codes + (size_t)(of->codes - squares[0].codes)),
            .min_width = of->min | of->width << 16,
            .corner = (u & 0xffff) | v << 16,
            .deviations = some ? (uint32_t)(deviations + of->first) : TRIP_GL_NO_DEVIATIONS,
        };
    }
    return count;
}

/* Copies the codes of a run, and its deviations. Returns the end of the copy. */
static unsigned char *copy_run(const trip_gl_sheets *s, const trip_block *block, unsigned char *to)
{
    const size_t codes = trip_block_codes_bytes(block), deviations = deviation_bytes(s, block);
    memcpy(to, trip_block_codes(block), codes);
    if (deviations > 0)
        memcpy(to + codes, block->deviations, deviations);
    return to + codes + deviations;
}

/* Copies the squares, codes and deviations of all runs into a slot. */
static int begin_batch(trip_gl_sheets *s, const trip_batch *batch)
{
    size_t squares = 0, bytes = sizeof(uint32_t); /* not 0: GL cannot bind an empty range */
    for (size_t i = 0; i < batch->run_count; i++) {
        const trip_block block = trip_block_of(batch, &batch->runs[i]);
        squares += block.squares;
        bytes += trip_block_codes_bytes(&block) + deviation_bytes(s, &block);
    }
    size_t codes = trip_gl_ring_after(0, squares * sizeof(struct trip_gl_sheet_square));
    if (codes + bytes > trip_gl_context_limits(s->context)->storage_block_bytes)
        return trip_fail(TRIP_ERROR, "gl", "batch",
                         "%llu splats at a time are too many; read in smaller pieces",
                         (unsigned long long)batch->splats);
    trip_gl_slot *slot;
    int status = trip_gl_ring_take(s->ring, codes + bytes, &slot);
    if (status)
        return status;
    s->batch = (trip_gl_sheet_batch){ .slot = slot, .codes_offset = codes, .begun = true };
    void *memory = slot->memory;
    struct trip_gl_sheet_square *square = memory;
    unsigned char *const first = slot->memory + codes, *to = first;
    for (size_t i = 0; i < batch->run_count; i++) {
        const trip_block block = trip_block_of(batch, &batch->runs[i]);
        square += fill_squares(s, &batch->runs[i], &block, (size_t)(to - first), square);
        to = copy_run(s, &block, to);
    }
    return TRIP_OK;
}

static void begin_sheet(trip_gl_sheets *s, int64_t number)
{
    unsigned taken = 0;
    for (int i = 0; i < s->count; i++)
        taken |= 1u << s->held[i].layer;
    int layer = __builtin_ctz(~taken);
    s->held[s->count++] = (trip_gl_sheet){ .number = number, .layer = layer, .min = UINT16_MAX };
    trip_gl_sheet_textures_clear(&s->textures, layer, (int)s->size[0], (int)s->size[1],
                                 s->effects & TRIP_GL_EXACT ? (float)TRIP_GL_MISSING_EXACT
                                                            : (float)TRIP_GL_MISSING_WHOLE);
}

/* Widens the ranges of draw codes and deviations of the last sheet by the ranges of the run's
 * brick. */
static void widen_range(trip_gl_sheets *s, const trip_batch *batch, const trip_run *run)
{
    const trip_file_brick *brick = &trip_batch_list(batch, run)->bricks[run->brick];
    const trip_code_range range =
        trip_draw_codes_range(&s->frame->plan->draw, brick->code_min, brick->code_max);
    trip_gl_sheet *sheet = &s->held[s->count - 1];
    sheet->min = range.min < sheet->min ? range.min : sheet->min;
    sheet->max = range.max > sheet->max ? range.max : sheet->max;
    if (s->effects & TRIP_GL_BLURRED && brick->deviation_max > sheet->deviation)
        sheet->deviation = brick->deviation_max;
}

static int decode_squares(trip_gl_sheets *s, uint32_t first, uint32_t count)
{
    const trip_gl_slot *slot = s->batch.slot;
    const trip_block_form form = trip_block_form_of(&s->frame->data->header, TRIP_KIND_VOXELS);
    int status = use_program(s, TRIP_GL_PASS_SHEET_DECODE);
    if (status)
        return status;
    glBindBufferRange(GL_SHADER_STORAGE_BUFFER, TRIP_GL_SQUARES, slot->buffer, 0,
                      (GLsizeiptr)s->batch.codes_offset);
    glBindBufferRange(GL_SHADER_STORAGE_BUFFER, TRIP_GL_VOXELS, slot->buffer,
                      (GLintptr)s->batch.codes_offset,
                      (GLsizeiptr)(slot->bytes - s->batch.codes_offset));
    glBindImageTexture(TRIP_GL_IMAGE, s->textures.codes, 0, GL_FALSE, s->held[s->count - 1].layer,
                       GL_WRITE_ONLY, GL_R32F);
    if (s->effects & TRIP_GL_EXACT)
        glBindBufferBase(GL_SHADER_STORAGE_BUFFER, TRIP_GL_DRAW_CODES, s->function.draw_codes);
    if (s->effects & TRIP_GL_BLURRED) {
        glBindImageTexture(TRIP_GL_IMAGE_DEVIATIONS, s->textures.deviations, 0, GL_FALSE,
                           s->held[s->count - 1].layer, GL_WRITE_ONLY, GL_R16);
        glBindBufferBase(GL_SHADER_STORAGE_BUFFER, TRIP_GL_DRAW_DEVIATIONS, s->blur.growths);
    }
    glUniform2ui(TRIP_GL_SHEET, first, trip_block_step(&form));
    glDispatchCompute(count, 1, 1);
    glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT | GL_TEXTURE_UPDATE_BARRIER_BIT);
    status = trip_gl_queue_end_part(s->queue);
    s->batch.slot->part = s->queue->ended;
    return status;
}

/* Decodes some of the batch's next runs for the last sheet. */
static int decode_runs(trip_gl_sheets *s, const trip_batch *batch)
{
    trip_gl_sheet_batch *b = &s->batch;
    int64_t number = s->held[s->count - 1].number;
    uint32_t count = 0;
    for (; b->next_run < batch->run_count && count < PART_SQUARES; b->next_run++) {
        const trip_run *run = &batch->runs[b->next_run];
        if (run->sheet != number)
            break;
        count += trip_block_of(batch, run).squares;
        widen_range(s, batch, run);
    }
    uint32_t first = b->next_square;
    b->next_square += count;
    return decode_squares(s, first, count);
}

/* ---- drawing sheets ---- */

/* Returns the distance in sheets by which the eye lies behind held[i]; negative if it lies before.
 * Returns 0 in parallel views, where each ray has its own start. */
static double eye_behind(const trip_gl_sheets *s, int i)
{
    if (s->frame->camera->ortho)
        return 0;
    return (s->eye - (double)s->held[i].number) * (double)s->way;
}

/* Whether a sample between held[i] and the next sheet may be visible. Returns false without a next
 * sheet. */
static bool shows(const trip_gl_sheets *s, int i)
{
    const int about = sheets_about(s->frame->settings) - 1;
    unsigned min = UINT16_MAX, max = 0, deviation = 0;
    double bounds[2];
    if (i < 0 || i + 1 >= s->count || s->held[i].min > s->held[i].max ||
        s->held[i + 1].min > s->held[i + 1].max || eye_behind(s, i) >= 1)
        return false;
    for (int k = i - about; k <= i + 1 + about; k++)
        if (k >= 0 && k < s->count) {
            min = s->held[k].min < min ? s->held[k].min : min;
            max = s->held[k].max > max ? s->held[k].max : max;
            deviation = s->held[k].deviation > deviation ? s->held[k].deviation : deviation;
        }
    const trip_kernel kernel = s->frame->settings->kernel;
    trip_field_code_bounds(kernel, min, max, bounds);
    const trip_code_range range =
        trip_brick_range_blurred(kernel, &s->frame->plan->draw,
                                 (trip_code_range){ (uint16_t)fmax(0, floor(bounds[0])),
                                                    (uint16_t)fmin(65535, ceil(bounds[1])) },
                                 deviation);
    return trip_gl_sheet_tf_shows(&s->function, range.min, range.max);
}

/* Sets the distances to the sheets below and above a sheet. */
static void bind_positions(const trip_gl_sheets *s, int64_t sheet)
{
    const trip_coordinates *c = s->coordinates;
    const double here = trip_coordinates_position(c, s->axis, (double)sheet);
    glUniform2f(TRIP_GL_SHEET_APART,
                (float)(here - trip_coordinates_position(c, s->axis, (double)(sheet - 1))),
                (float)(trip_coordinates_position(c, s->axis, (double)(sheet + 1)) - here));
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, TRIP_GL_POSITIONS, s->positions.buffer);
}

static int make_gradients(trip_gl_sheets *s, int i)
{
    const int before = i > 0 ? s->held[i - 1].layer : -1;
    const int after = i + 1 < s->count ? s->held[i + 1].layer : -1;
    trip_gl_sheet *sheet = &s->held[i];
    int status = use_program(s, TRIP_GL_PASS_SHEET_GRADIENT);
    if (status)
        return status;
    glBindTextureUnit(TRIP_GL_SHEET_CODES, s->textures.codes);
    glBindImageTexture(TRIP_GL_IMAGE, s->textures.gradients, 0, GL_FALSE, sheet->layer,
                       GL_WRITE_ONLY, GL_RGBA16F);
    glUniform3i(TRIP_GL_SHEET, sheet->layer, s->way > 0 ? before : after,
                s->way > 0 ? after : before);
    if (s->effects & TRIP_GL_UNEVEN)
        bind_positions(s, sheet->number);
    if (s->effects & TRIP_GL_EXACT)
        glUniform1f(TRIP_GL_SHEET_SCALE, (float)s->view.gradient_scale);
    const int width = (int)s->size[0], height = (int)s->size[1];
    const int rows = PART_VOXELS / width < 1 ? 1 : PART_VOXELS / width;
    for (int y = 0; y < height && !status; y += rows) {
        glUniform3i(TRIP_GL_SHEET_SIZE, width, height, y);
        glDispatchCompute(groups_over(width), groups_over(height - y < rows ? height - y : rows),
                          1);
        glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT);
        status = trip_gl_queue_end_part(s->queue);
    }
    sheet->has_gradients = true;
    return status;
}

/* Returns the first sheet that the drawing needs gradients of and that has none, or -1. A sheet
 * needs gradients if an interval near it may be visible. The next group no longer holds the sheets
 * before, so gradients are made now. All held sheets must be complete. */
static int without_gradients(const trip_gl_sheets *s)
{
    const int about = sheets_about(s->frame->settings);
    for (int i = 0; i < s->count && i < s->drawing.to + about && s->textures.gradients; i++)
        for (int k = i - about; k < i + about && !s->held[i].has_gradients; k++)
            if (shows(s, k))
                return i;
    return -1;
}

/* Returns the texture layer of held[i]. Beyond the grid it is the layer of the last sheet. Returns
 * -1 for another sheet that is not held, which then has no voxels. */
static int layer_of(const trip_gl_sheets *s, int i)
{
    const int64_t number = s->held[0].number + i * s->way;
    const int64_t sheets = (int64_t)s->frame->data->header.dims[s->axis];
    if (i >= 0 && i < s->count)
        return s->held[i].layer;
    return number >= 0 && number < sheets ? -1 : s->held[i < 0 ? 0 : s->count - 1].layer;
}

/* Returns the position along the list at a fraction `part` of the way from a sheet to the next. */
static double position_at(const trip_gl_sheets *s, const trip_gl_sheet *from, double part)
{
    return trip_coordinates_position(s->coordinates, s->axis,
                                     (double)from->number + part * (double)s->way);
}

/* Appends the ends of the segments between held[i] and the next sheet. Returns the new count. An
 * interval needs its own first end if `first` is set, because the previous interval is not drawn.
 * Kernels of 64 voxels always need it, because their sheets differ. So does the nearest value,
 * because a segment reads the sheets at its two ends. Otherwise the last end of the
 * previous interval serves. */
static int add_ends(const trip_gl_sheets *s, int i, bool first, trip_gl_sheet_end *ends, int count)
{
    const trip_gl_sheet *from = &s->held[i];
    const int samples_per_sheet = s->frame->settings->samples_per_sheet;
    const int layers[4] = { layer_of(s, i - 1), layer_of(s, i), layer_of(s, i + 1),
                            layer_of(s, i + 2) };
    const double eye = fmax(0, eye_behind(s, i));
    double last = position_at(s, from, eye);
    if (first || s->frame->settings->kernel != TRIP_KERNEL_LINEAR)
        ends[count++] = trip_gl_sheet_end_at(&s->view, last, 0, layers, eye);
    for (int n = 1; n <= samples_per_sheet; n++) {
        double part = (double)n / samples_per_sheet;
        if (n <= eye * samples_per_sheet)
            continue;
        const double next = position_at(s, from, part);
        ends[count++] = trip_gl_sheet_end_at(&s->view, next, next - last, layers, part);
        last = next;
    }
    return count;
}

/* Puts as many of the remaining intervals into a group as fit. */
static void begin_group(trip_gl_sheets *s)
{
    trip_gl_sheet_end ends[TRIP_GL_ENDS_MAX];
    trip_gl_sheet_drawing *d = &s->drawing;
    const int max = s->frame->settings->samples_per_sheet + 1;
    d->in_group = true;
    d->band = d->row = d->ends = 0;
    d->done = s->front;
    bool first = true;
    for (; d->done < d->to && d->ends + max <= TRIP_GL_ENDS_MAX; d->done++) {
        const bool some = shows(s, d->done);
        if (some)
            d->ends = add_ends(s, d->done, first, ends, d->ends);
        first = !some;
    }
    if (d->ends)
        glNamedBufferSubData(s->ends_block, 0, (GLsizeiptr)((size_t)d->ends * sizeof *ends), ends);
}

static int bind_drawing(trip_gl_sheets *s, const trip_gl_band *band)
{
    const trip_gl_surface *layer = &band->layers[s->axis];
    int status = use_program(s, TRIP_GL_PASS_SHEET_DRAW);
    if (status)
        return status;
    trip_gl_constants_bind_layer(s->constants, s->axis, false);
    glBindBufferBase(GL_UNIFORM_BUFFER, TRIP_GL_SHEET_PASS, s->pass_block);
    glBindBufferBase(GL_UNIFORM_BUFFER, TRIP_GL_SHEET_ENDS, s->ends_block);
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, TRIP_GL_SUMS,
                     s->effects & TRIP_GL_CLOSED ? s->function.closed : s->function.sums);
    if (s->effects & TRIP_GL_UNEVEN)
        glBindBufferBase(GL_SHADER_STORAGE_BUFFER, TRIP_GL_POSITIONS, s->positions.buffer);
    glBindTextureUnit(TRIP_GL_SHEET_CODES, s->textures.codes);
    glBindTextureUnit(TRIP_GL_SHEET_GRADIENTS, s->textures.gradients);
    if (s->effects & TRIP_GL_BLURRED) {
        glBindTextureUnit(TRIP_GL_SHEET_DEVIATIONS, s->textures.deviations);
        trip_gl_sheet_blur_bind(&s->blur);
    }
    if (s->effects & TRIP_GL_PLACED) {
        trip_gl_lattices_bind(s->lattices);
        trip_gl_lattices_bind_block(s->lattices, (unsigned)s->axis);
    }
    glBindImageTexture(TRIP_GL_IMAGE, layer->colour, 0, GL_FALSE, 0, GL_READ_WRITE, GL_RGBA32F);
    if (layer->depth)
        glBindImageTexture(TRIP_GL_IMAGE_DEPTH, layer->depth, 0, GL_FALSE, 0, GL_READ_WRITE,
                           GL_RGBA32F);
    return TRIP_OK;
}

/* Draws some rows of the group. */
static int draw_rows(trip_gl_sheets *s)
{
    trip_gl_sheet_drawing *d = &s->drawing;
    const trip_gl_band *band = &s->target->bands[d->band];
    int width = s->target->width, rows = PART_ENDS / d->ends / width;
    int end = d->row + (rows < 1 ? 1 : rows);
    end = end < band->rows ? end : band->rows;
    int status = bind_drawing(s, band);
    if (status)
        return status;
    glUniform4i(TRIP_GL_ROW, band->first_row, d->row, end, d->ends);
    glDispatchCompute(groups_over(width), groups_over(end - d->row), 1);
    glMemoryBarrier(GL_SHADER_IMAGE_ACCESS_BARRIER_BIT | GL_TEXTURE_FETCH_BARRIER_BIT |
                    GL_FRAMEBUFFER_BARRIER_BIT);
    d->row = end < band->rows ? end : 0;
    d->band += d->row == 0;
    return trip_gl_queue_end_part(s->queue);
}

/* Releases the drawn sheets, except one that the kernel still needs. */
static void end_group(trip_gl_sheets *s)
{
    trip_gl_sheet_drawing *d = &s->drawing;
    const int kept = trip_kernel_is_wide(s->frame->settings->kernel) ? 1 : 0;
    const int drop = d->done > kept ? d->done - kept : 0;
    s->count -= drop;
    memmove(s->held, s->held + drop, (size_t)s->count * sizeof *s->held);
    d->to -= drop;
    s->front = d->done - drop;
    d->in_group = false;
    if (d->to <= s->front && d->all)
        s->count = s->front = 0;
    if (d->to <= s->front || s->count == 0)
        d->to = 0;
}

/* Does one part of the drawing. */
static int draw_part(trip_gl_sheets *s)
{
    trip_gl_sheet_drawing *d = &s->drawing;
    int status = TRIP_OK, bare = d->in_group ? -1 : without_gradients(s);
    if (bare >= 0)
        return make_gradients(s, bare);
    if (!d->in_group)
        begin_group(s);
    if (d->ends)
        status = draw_rows(s);
    if (!status && (d->ends == 0 || d->band == s->target->band_count))
        end_group(s);
    return status;
}

/* Begins to draw complete sheets. With `all` it draws up to the last sheet and then releases all.
 * Otherwise it draws only intervals with all surrounding sheets held. */
static void begin_drawing(trip_gl_sheets *s, bool all)
{
    const int to = s->count - 1 - (all ? 0 : sheets_about(s->frame->settings));
    s->drawing = (trip_gl_sheet_drawing){ .to = to > s->front ? to : 0, .all = all };
    if (to <= s->front && all)
        s->count = s->front = 0;
}

/* ---- batches ---- */

/* The next run belongs to a sheet that is not held. Makes room by drawing held sheets, or begins
 * the new sheet. */
static void make_position(trip_gl_sheets *s, const trip_batch *batch)
{
    int64_t number = batch->runs[s->batch.next_run].sheet;
    bool new_pass = batch->pass != s->pass;
    if (s->count > 0 && (new_pass || s->held[s->count - 1].number + s->way != number)) {
        begin_drawing(s, true);
        return;
    }
    if (s->count == s->textures.layers) {
        begin_drawing(s, false);
        return;
    }
    if (new_pass)
        begin_pass(s, batch->pass);
    begin_sheet(s, number);
}

static bool is_held(const trip_gl_sheets *s, const trip_batch *batch)
{
    return s->count > 0 && batch->pass == s->pass &&
           s->held[s->count - 1].number == batch->runs[s->batch.next_run].sheet;
}

int trip_gl_sheets_draw(trip_gl_sheets *s, const trip_batch *batch)
{
    int status = TRIP_OK;
    if (s->drawing.to > 0)
        status = draw_part(s);
    else if (!s->batch.begun)
        status = begin_batch(s, batch);
    else if (!is_held(s, batch))
        make_position(s, batch);
    else
        status = decode_runs(s, batch);
    if (status)
        return status;
    if (s->drawing.to > 0 || s->batch.next_run < batch->run_count)
        return 1;
    s->batch = (trip_gl_sheet_batch){ 0 };
    return trip_gl_check(s->context, "sheets");
}

int trip_gl_sheets_end_layer(trip_gl_sheets *s)
{
    int status = TRIP_OK;
    if (s->pass && s->drawing.to == 0)
        begin_drawing(s, true);
    if (s->drawing.to > 0)
        status = draw_part(s);
    if (!status && s->drawing.to > 0)
        return 1;
    forget(s);
    return status ? status : trip_gl_check(s->context, "sheets");
}
