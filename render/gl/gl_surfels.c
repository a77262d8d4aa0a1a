#include "gl/gl_surfels.h"

#include <assert.h>
#include <math.h>
#include <string.h>

#include "depth_pyramid.h"
#include "gl/frame_block.h"
#include "gl/ring.h"
#include "gl/shared.h"
#include "renderer.h"

static_assert(TRIP_GL_SURFEL_BLOCK == 1 << TRIP_PYRAMID_BITS, "blocks are those of the pyramid");
static_assert(TRIP_GL_NO_CELL == TRIP_SURFEL_NO_CELL, "the shaders know cells without surfels");

enum {
    SLOTS = 2,
    /* Software GL draws within the call, and a frame is cancelled between calls. */
    PART_SOFTWARE = 8192,
    PART_GPU = 65536,
    STRIP = 16, /* rows of sums that are read at once */
};

/* The textures of a picture. */
typedef enum texture {
    DEPTHS,  /* bits of floats, for each pixel */
    COLOURS, /* sums of weight times r, g and b, and of weight, for each pixel */
    RESTS,   /* sums of weight times tolerance, and of coverage, for each pixel */
    FRONTS,  /* bits of z' - t, for each cell */
    NUMBERS, /* for each cell */
    HOLDERS, /* the surfels of the cells, in TRIP_GL_SURFEL_LAYERS layers */
    BLOCKS,  /* bits of the greatest depths */
    TEXTURES,
} texture;

struct trip_surfel_target {
    trip_gl_surfels *of;
    trip_surfel_target_params params;
    int pitch, cell_rows, block_columns, block_rows;
    GLuint textures[TEXTURES];
    GLuint bare, summing; /* framebuffers: without outputs, and of the sums */
    GLuint vertices;      /* a vertex array without arrays */
    GLuint lists;         /* a copy of the slot's, since many vertices read a surfel */
    size_t places_at, list_bytes;
    uint64_t bytes; /* charged for textures and lists */
    trip_gl_slot slots[SLOTS];
    unsigned next;
    float *strip; /* for reading sums */
    size_t strip_bytes;
};

/* ---- memory ---- */

static void end(trip_surfel_target *t)
{
    if (!t)
        return;
    trip_budget *budget = t->params.budget;
    if (trip_gl_context_use(t->of->context) == TRIP_OK) {
        trip_gl_queue_leave(t->of->queue); /* GL keeps deleted objects that are still in use */
        glDeleteTextures(TEXTURES, t->textures);
        glDeleteFramebuffers(1, &t->bare);
        glDeleteFramebuffers(1, &t->summing);
        glDeleteVertexArrays(1, &t->vertices);
        glDeleteBuffers(1, &t->lists);
        for (int i = 0; i < SLOTS; i++)
            trip_gl_slot_release(&t->slots[i], budget);
    }
    trip_budget_release(budget, t->strip, t->strip_bytes);
    trip_budget_discharge(budget, t->bytes);
    trip_budget_release(budget, t, sizeof *t);
}

static bool charge(trip_surfel_target *t, uint64_t bytes)
{
    if (!trip_budget_charge(t->params.budget, bytes))
        return false;
    t->bytes += bytes;
    return true;
}

static bool make_texture(trip_surfel_target *t, texture which, GLenum format, size_t texel_bytes,
                         int width, int height)
{
    const int layers = which == HOLDERS ? TRIP_GL_SURFEL_LAYERS : 1;
    GLuint *made = &t->textures[which];
    if (!charge(t, (uint64_t)width * (uint64_t)height * (uint64_t)layers * texel_bytes))
        return false;
    glCreateTextures(layers > 1 ? GL_TEXTURE_2D_ARRAY : GL_TEXTURE_2D, 1, made);
    if (layers > 1)
        glTextureStorage3D(*made, 1, format, width, height, layers);
    else
        glTextureStorage2D(*made, 1, format, width, height);
    glTextureParameteri(*made, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTextureParameteri(*made, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    return glGetError() == GL_NO_ERROR;
}

static bool make_textures(trip_surfel_target *t)
{
    const int width = t->params.width, height = t->params.height;
    return make_texture(t, DEPTHS, GL_R32UI, 4, width, height) &&
           make_texture(t, COLOURS, GL_RGBA32F, 16, width, height) &&
           make_texture(t, RESTS, GL_RG32F, 8, width, height) &&
           make_texture(t, FRONTS, GL_R32UI, 4, t->pitch, t->cell_rows) &&
           make_texture(t, NUMBERS, GL_R32UI, 4, t->pitch, t->cell_rows) &&
           make_texture(t, HOLDERS, GL_RGBA32F, 16, t->pitch, t->cell_rows) &&
           make_texture(t, BLOCKS, GL_R32UI, 4, t->block_columns, t->block_rows);
}

static bool make_framebuffers(trip_surfel_target *t)
{
    static const GLenum outs[] = { GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1 };
    glCreateFramebuffers(1, &t->bare);
    glNamedFramebufferParameteri(t->bare, GL_FRAMEBUFFER_DEFAULT_WIDTH, t->params.width);
    glNamedFramebufferParameteri(t->bare, GL_FRAMEBUFFER_DEFAULT_HEIGHT, t->params.height);
    glCreateFramebuffers(1, &t->summing);
    glNamedFramebufferTexture(t->summing, outs[0], t->textures[COLOURS], 0);
    glNamedFramebufferTexture(t->summing, outs[1], t->textures[RESTS], 0);
    glNamedFramebufferDrawBuffers(t->summing, 2, outs);
    glCreateVertexArrays(1, &t->vertices);
    return glGetError() == GL_NO_ERROR;
}

static bool make_lists(trip_surfel_target *t)
{
    const size_t count = t->params.batch_max;
    t->places_at = trip_gl_ring_after(0, count * sizeof(struct trip_gl_surfel));
    t->list_bytes = t->places_at + count * 2 * sizeof(uint32_t);
    for (int i = 0; i < SLOTS; i++)
        if (!trip_gl_slot_make(&t->slots[i], t->list_bytes, false, t->params.budget))
            return false;
    if (!charge(t, t->list_bytes))
        return false;
    glCreateBuffers(1, &t->lists);
    glNamedBufferStorage(t->lists, (GLsizeiptr)t->list_bytes, NULL, 0);
    t->strip_bytes = (size_t)t->params.width * STRIP * sizeof(trip_surfel_sum);
    t->strip = trip_budget_take(t->params.budget, t->strip_bytes);
    return t->strip && glGetError() == GL_NO_ERROR;
}

static int clear(const trip_surfel_target *t)
{
    static const GLuint none = UINT32_MAX;
    const float infinite = INFINITY;
    GLuint bits;
    memcpy(&bits, &infinite, sizeof bits);
    glClearTexImage(t->textures[DEPTHS], 0, GL_RED_INTEGER, GL_UNSIGNED_INT, &bits);
    glClearTexImage(t->textures[FRONTS], 0, GL_RED_INTEGER, GL_UNSIGNED_INT, &none);
    glClearTexImage(t->textures[NUMBERS], 0, GL_RED_INTEGER, GL_UNSIGNED_INT, &none);
    return trip_gl_check(t->of->context, "surfels");
}

static int check_size(const trip_gl_surfels *of, const trip_surfel_target *t)
{
    const int most = trip_gl_context_limits(of->context)->image_px;
    if (t->pitch <= most && t->cell_rows <= most)
        return 0;
    return trip_fail(TRIP_ERROR, "gl", "image",
                     "%d x %d px exceed this driver's limit of %d px for deferred pictures; use a "
                     "smaller size or another renderer",
                     t->params.width, t->params.height, most - 2 * TRIP_SURFEL_GUARD);
}

static int blocks_along(int size)
{
    return (size + TRIP_GL_SURFEL_BLOCK - 1) / TRIP_GL_SURFEL_BLOCK;
}

static int begin(void *user, trip_surfel_target **out, const trip_surfel_target_params *params)
{
    trip_gl_surfels *of = user;
    *out = NULL;
    int status = trip_gl_context_use(of->context);
    if (status)
        return status;
    trip_surfel_target *t = trip_budget_take(params->budget, sizeof *t);
    if (!t)
        return 1;
    t->of = of;
    t->params = *params;
    t->pitch = params->width + 2 * TRIP_SURFEL_GUARD;
    t->cell_rows = params->height + 2 * TRIP_SURFEL_GUARD;
    t->block_columns = blocks_along(params->width);
    t->block_rows = blocks_along(params->height);
    status = check_size(of, t);
    if (!status)
        status = make_textures(t) && make_framebuffers(t) && make_lists(t) ? clear(t) : 1;
    if (status)
        end(t);
    else
        *out = t;
    return status;
}

/* ---- passes ---- */

static int use_program(const trip_surfel_target *t, trip_gl_pass pass)
{
    GLuint program = 0;
    const trip_gl_variant variant = { .pass = pass,
                                      .effects = t->params.ortho ? TRIP_GL_PARALLEL : 0 };
    const int status = trip_gl_variants_get(t->of->variants, variant, &program);
    if (status)
        return status;
    glUseProgram(program);
    glUniform2i(TRIP_GL_SURFEL_PICTURE, t->params.width, t->params.height);
    return 0;
}

static void bind_image(const trip_surfel_target *t, texture which, GLuint unit, GLenum access)
{
    const bool layered = which == HOLDERS;
    glBindImageTexture(unit, t->textures[which], 0, layered, 0, access,
                       layered ? GL_RGBA32F : GL_R32UI);
}

static void bind_framebuffer(const trip_surfel_target *t, GLuint framebuffer)
{
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, framebuffer);
    glViewport(0, 0, t->params.width, t->params.height);
    glDisable(GL_DEPTH_TEST);
    glDisable(GL_STENCIL_TEST);
    glDisable(GL_SCISSOR_TEST);
    glBindVertexArray(t->vertices);
}

/* Takes the next slot. Waits until the GPU has read its last contents. */
static int take_slot(trip_surfel_target *t, trip_gl_slot **out)
{
    trip_gl_slot *slot = *out = &t->slots[t->next];
    t->next = (t->next + 1) % SLOTS;
    const int done = trip_gl_queue_is_done(t->of->queue, slot->part, true);
    return done < 0 ? done : 0;
}

/* Copies and binds a part of the lists. */
static void take_list(const trip_surfel_target *t, const trip_gl_slot *slot, GLuint binding,
                      size_t at, size_t bytes)
{
    glCopyNamedBufferSubData(slot->buffer, t->lists, (GLintptr)at, (GLintptr)at, (GLsizeiptr)bytes);
    glBindBufferRange(GL_SHADER_STORAGE_BUFFER, binding, t->lists, (GLintptr)at, (GLsizeiptr)bytes);
}

static size_t part_of(const trip_surfel_target *t)
{
    return trip_gl_context_limits(t->of->context)->software ? PART_SOFTWARE : PART_GPU;
}

static struct trip_gl_surfel packed(const trip_surfel_projected *p)
{
    return (struct trip_gl_surfel){ {
        { { p->x, p->y, p->base, p->near } },
        { { p->slope_x, p->slope_y, p->far, p->tolerance } },
        { { p->blend.across, p->blend.shear, p->blend.down, p->mass } },
        { { p->disc.across, p->disc.shear, p->disc.down, p->front } },
        { { p->rgb[0], p->rgb[1], p->rgb[2], 0 } },
    } };
}

static void copy_batch(const trip_surfel_target *t, const trip_surfel_batch *batch,
                       unsigned char *memory)
{
    struct trip_gl_surfel *surfels = (struct trip_gl_surfel *)memory;
    uint32_t *places = (uint32_t *)(memory + t->places_at);
    for (size_t i = 0; i < batch->count; i++) {
        if (batch->cells[i] != TRIP_SURFEL_NO_CELL)
            surfels[i] = packed(&batch->surfels[i]);
        places[2 * i] = batch->cells[i];
        places[2 * i + 1] = batch->numbers[i];
    }
}

static int lower_depths(const trip_surfel_target *t, size_t count)
{
    int status = use_program(t, TRIP_GL_PASS_SURFEL_DEPTH);
    if (status)
        return status;
    bind_framebuffer(t, t->bare);
    bind_image(t, DEPTHS, TRIP_GL_SURFEL_IMAGE_DEPTHS, GL_READ_WRITE);
    glDisable(GL_BLEND);
    for (size_t from = 0; from < count && !status; from += part_of(t)) {
        const size_t some = count - from < part_of(t) ? count - from : part_of(t);
        glUniform1ui(TRIP_GL_SURFEL_FIRST, (GLuint)from);
        glDrawArraysInstanced(GL_TRIANGLE_STRIP, 0, 4, (GLsizei)some);
        status = trip_gl_queue_end_part(t->of->queue);
    }
    return status;
}

static int take_cells(const trip_surfel_target *t, size_t count)
{
    const int status = use_program(t, TRIP_GL_PASS_SURFEL_SELECT);
    if (status)
        return status;
    bind_image(t, FRONTS, TRIP_GL_SURFEL_IMAGE_FRONTS, GL_READ_WRITE);
    bind_image(t, NUMBERS, TRIP_GL_SURFEL_IMAGE_NUMBERS, GL_READ_WRITE);
    bind_image(t, HOLDERS, TRIP_GL_SURFEL_IMAGE_HOLDERS, GL_WRITE_ONLY);
    glUniform1ui(TRIP_GL_SURFEL_COUNT, (GLuint)count);
    glUniform1ui(TRIP_GL_SURFEL_PITCH, (GLuint)t->pitch);
    const size_t groups = (count + TRIP_GL_SURFEL_GROUP - 1) / TRIP_GL_SURFEL_GROUP;
    for (int stage = 0; stage < 3; stage++) {
        glUniform1i(TRIP_GL_SURFEL_STAGE, stage);
        glDispatchCompute((GLuint)groups, 1, 1);
        glMemoryBarrier(GL_SHADER_IMAGE_ACCESS_BARRIER_BIT);
    }
    return 0;
}

static int find_blocks(const trip_surfel_target *t)
{
    const int status = use_program(t, TRIP_GL_PASS_SURFEL_BLOCKS);
    if (status)
        return status;
    const int group = TRIP_GL_SQUARE_GROUP;
    bind_image(t, DEPTHS, TRIP_GL_SURFEL_IMAGE_DEPTHS, GL_READ_ONLY);
    bind_image(t, BLOCKS, TRIP_GL_SURFEL_IMAGE_BLOCKS, GL_WRITE_ONLY);
    glDispatchCompute((GLuint)((t->block_columns + group - 1) / group),
                      (GLuint)((t->block_rows + group - 1) / group), 1);
    glMemoryBarrier(GL_TEXTURE_UPDATE_BARRIER_BIT);
    return trip_gl_queue_end_part(t->of->queue);
}

/* Waits for the GPU, then reads a texture. */
static int read_texture(const trip_surfel_target *t, texture which, size_t bytes, void *to)
{
    const int done = trip_gl_queue_is_done(t->of->queue, t->of->queue->ended, true);
    if (done < 0)
        return done;
    glGetTextureImage(t->textures[which], 0, GL_RED_INTEGER, GL_UNSIGNED_INT, (GLsizei)bytes, to);
    return trip_gl_check(t->of->context, "surfels");
}

static int add(trip_surfel_target *t, const trip_surfel_batch *batch, float *greatest)
{
    trip_gl_slot *slot;
    int status = trip_gl_context_use(t->of->context);
    if (!status)
        status = take_slot(t, &slot);
    if (status)
        return status;
    copy_batch(t, batch, slot->memory);
    take_list(t, slot, TRIP_GL_SURFELS, 0, batch->count * sizeof(struct trip_gl_surfel));
    take_list(t, slot, TRIP_GL_SURFEL_PLACES, t->places_at, batch->count * 2 * sizeof(uint32_t));
    status = take_cells(t, batch->count);
    if (!status)
        status = lower_depths(t, batch->count);
    glMemoryBarrier(GL_SHADER_IMAGE_ACCESS_BARRIER_BIT | GL_TEXTURE_FETCH_BARRIER_BIT);
    if (!status)
        status = find_blocks(t);
    slot->part = t->of->queue->ended;
    if (!status)
        status = read_texture(t, BLOCKS,
                              (size_t)t->block_columns * (size_t)t->block_rows * sizeof *greatest,
                              greatest);
    return status;
}

/* ---- results ---- */

static int read_depths(trip_surfel_target *t, uint32_t *depths, uint32_t *fronts, uint32_t *numbers)
{
    static const float zero[4] = { 0 };
    const size_t cells = (size_t)t->pitch * (size_t)t->cell_rows;
    const size_t pixels = (size_t)t->params.width * (size_t)t->params.height;
    int status = trip_gl_context_use(t->of->context);
    glMemoryBarrier(GL_TEXTURE_UPDATE_BARRIER_BIT);
    if (!status)
        status = read_texture(t, DEPTHS, pixels * sizeof *depths, depths);
    if (!status)
        status = read_texture(t, FRONTS, cells * sizeof *fronts, fronts);
    if (!status)
        status = read_texture(t, NUMBERS, cells * sizeof *numbers, numbers);
    glClearTexImage(t->textures[COLOURS], 0, GL_RGBA, GL_FLOAT, zero);
    glClearTexImage(t->textures[RESTS], 0, GL_RG, GL_FLOAT, zero);
    return status ? status : trip_gl_check(t->of->context, "surfels");
}

static int blend(trip_surfel_target *t, const uint32_t *cells, size_t count)
{
    trip_gl_slot *slot;
    int status = trip_gl_context_use(t->of->context);
    if (!status)
        status = take_slot(t, &slot);
    if (!status)
        status = use_program(t, TRIP_GL_PASS_SURFEL_BLEND);
    if (status)
        return status;
    memcpy(slot->memory, cells, count * sizeof *cells);
    take_list(t, slot, TRIP_GL_SURFEL_CELLS, 0, count * sizeof *cells);
    bind_framebuffer(t, t->summing);
    glBindTextureUnit(TRIP_GL_SURFEL_DEPTHS, t->textures[DEPTHS]);
    glBindTextureUnit(TRIP_GL_SURFEL_HOLDERS, t->textures[HOLDERS]);
    glUniform1ui(TRIP_GL_SURFEL_PITCH, (GLuint)t->pitch);
    glEnable(GL_BLEND);
    glBlendEquation(GL_FUNC_ADD);
    glBlendFunc(GL_ONE, GL_ONE);
    glDrawArraysInstanced(GL_TRIANGLE_STRIP, 0, 4, (GLsizei)count);
    glDisable(GL_BLEND);
    status = trip_gl_queue_end_part(t->of->queue);
    slot->part = t->of->queue->ended;
    return status ? status : trip_gl_check(t->of->context, "surfels");
}

/* Reads rows of the sums. */
static void read_strip(const trip_surfel_target *t, int row, int rows, trip_surfel_sum *sums)
{
    const size_t count = (size_t)t->params.width * (size_t)rows;
    float *colours = t->strip, *rests = colours + 4 * count;
    glGetTextureSubImage(t->textures[COLOURS], 0, 0, row, 0, t->params.width, rows, 1, GL_RGBA,
                         GL_FLOAT, (GLsizei)(4 * count * sizeof *colours), colours);
    glGetTextureSubImage(t->textures[RESTS], 0, 0, row, 0, t->params.width, rows, 1, GL_RG,
                         GL_FLOAT, (GLsizei)(2 * count * sizeof *rests), rests);
    for (size_t i = 0; i < count; i++) {
        memcpy(sums[i].rgb, colours + 4 * i, sizeof sums[i].rgb);
        sums[i].weight = colours[4 * i + 3];
        sums[i].tolerance = rests[2 * i];
        sums[i].coverage = rests[2 * i + 1];
    }
}

static int read_sums(trip_surfel_target *t, trip_surfel_sum *sums)
{
    const int status = trip_gl_context_use(t->of->context);
    const int done =
        status ? status : trip_gl_queue_is_done(t->of->queue, t->of->queue->ended, true);
    if (done < 0)
        return done;
    for (int row = 0; row < t->params.height; row += STRIP) {
        const int left = t->params.height - row;
        read_strip(t, row, left < STRIP ? left : STRIP,
                   sums + (size_t)row * (size_t)t->params.width);
    }
    return trip_gl_check(t->of->context, "surfels");
}

void trip_gl_surfels_set_up(trip_gl_surfels *of)
{
    of->device = (trip_surfel_device){
        .user = of,
        .begin = begin,
        .add = add,
        .read_depths = read_depths,
        .blend = blend,
        .read_sums = read_sums,
        .end = end,
    };
}
