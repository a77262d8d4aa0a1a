#include "gl/gl_tiles.h"

#include <math.h>
#include <string.h>

#include "gl/frame_block.h"
#include "gl/ring.h"
#include "gl/shared.h"
#include "renderer.h"
#include "report.h"

enum {
    SLOTS = 2,
    /* Rows of tiles are split into bands, since the size of a storage block is limited. GL allows
     * 65535 work groups, one for each tile. */
    BAND_TILES = 16384,
    BANDS_MAX = 1024,
    BATCH_GPU = 32768,
    PART_PAIRS_GPU = 1 << 20,
    /* Software GL composites within the call, and a frame is cancelled between calls. */
    BATCH_SOFTWARE = 8192,
    PART_PAIRS_SOFTWARE = 1 << 16,
};

/* The memory of a piece. */
typedef struct piece_slot {
    trip_gl_slot lists;  /* splats, curves, pairs and jobs, in this order */
    trip_gl_slot closed; /* closed pixels of each tile, once the part is done */
    bool filled;
} piece_slot;

struct trip_tiles {
    trip_gl_tiles *of;
    trip_tiles_params params;
    int columns, rows;
    size_t count, tile_bytes, band_tiles;
    GLuint planes[BANDS_MAX]; /* of each band */
    unsigned bands;
    GLuint closed;                       /* closed pixels of each tile */
    GLuint lists;                        /* a copy of the slot's, since many tiles read a splat */
    uint64_t bytes;                      /* charged for these buffers */
    size_t curves_at, pairs_at, jobs_at; /* in piece_slot.lists */
    piece_slot slots[SLOTS];
    unsigned next;
};

/* ---- memory ---- */

static bool is_software(const trip_gl_tiles *of)
{
    return trip_gl_context_limits(of->context)->software;
}

static void end(trip_tiles *t)
{
    if (!t)
        return;
    trip_budget *budget = t->params.budget;
    if (trip_gl_context_use(t->of->context) == TRIP_OK) {
        trip_gl_queue_leave(t->of->queue); /* GL keeps deleted buffers that are still in use */
        glDeleteBuffers((GLsizei)t->bands, t->planes);
        glDeleteBuffers(1, &t->closed);
        glDeleteBuffers(1, &t->lists);
        for (int i = 0; i < SLOTS; i++) {
            trip_gl_slot_release(&t->slots[i].lists, budget);
            trip_gl_slot_release(&t->slots[i].closed, budget);
        }
    }
    trip_budget_discharge(budget, t->bytes);
    trip_budget_release(budget, t, sizeof *t);
}

/* Returns false if the budget or the driver refuses. */
static bool make_buffer(trip_tiles *t, GLuint *buffer, size_t bytes)
{
    if (!trip_budget_charge(t->params.budget, bytes))
        return false;
    t->bytes += bytes;
    glCreateBuffers(1, buffer);
    glNamedBufferStorage(*buffer, (GLsizeiptr)bytes, NULL, 0);
    return glGetError() == GL_NO_ERROR;
}

/* Returns the number of tiles in a band. */
static size_t tiles_of(const trip_tiles *t, unsigned band)
{
    const size_t left = t->count - band * t->band_tiles;
    return left < t->band_tiles ? left : t->band_tiles;
}

static bool make_planes(trip_tiles *t)
{
    const size_t room = trip_gl_context_limits(t->of->context)->storage_block_bytes / t->tile_bytes;
    t->band_tiles = room < BAND_TILES ? room : BAND_TILES;
    if (t->count > t->band_tiles * BANDS_MAX)
        return false;
    while (t->bands * t->band_tiles < t->count) {
        const unsigned band = t->bands++;
        if (!make_buffer(t, &t->planes[band], tiles_of(t, band) * t->tile_bytes))
            return false;
    }
    return make_buffer(t, &t->closed, t->count * sizeof(uint32_t));
}

static bool make_lists(trip_tiles *t)
{
    const trip_tiles_params *p = &t->params;
    const size_t curves = p->curved ? p->splats_max * sizeof(struct trip_gl_curve) : 0;
    t->curves_at = trip_gl_ring_after(0, p->splats_max * sizeof(struct trip_gl_projected));
    t->pairs_at = trip_gl_ring_after(t->curves_at, curves);
    t->jobs_at = trip_gl_ring_after(t->pairs_at, p->pairs_max * sizeof(uint32_t));
    const size_t bytes = t->jobs_at + t->count * sizeof(struct trip_gl_tile);
    for (int i = 0; i < SLOTS; i++)
        if (!trip_gl_slot_make(&t->slots[i].lists, bytes, false, p->budget) ||
            !trip_gl_slot_make(&t->slots[i].closed, t->count * sizeof(uint32_t), true, p->budget))
            return false;
    return make_buffer(t, &t->lists, t->jobs_at);
}

/* ---- passes ---- */

static int use_program(const trip_tiles *t, trip_gl_pass pass)
{
    GLuint program = 0;
    const trip_gl_variant variant = {
        .pass = pass,
        .effects = (t->params.depth ? TRIP_GL_DEPTH : 0) | (t->params.curved ? TRIP_GL_CURVED : 0),
    };
    const int status = trip_gl_variants_get(t->of->variants, variant, &program);
    if (!status)
        glUseProgram(program);
    return status;
}

static void bind_band(const trip_tiles *t, unsigned band)
{
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, TRIP_GL_TILE_PLANES, t->planes[band]);
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, TRIP_GL_TILE_CLOSED, t->closed);
    glUniform2i(TRIP_GL_TILE_GRID, t->columns, (GLint)(band * t->band_tiles));
}

/* Ends a part that wrote planes. */
static int end_part(const trip_tiles *t)
{
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT);
    return trip_gl_queue_end_part(t->of->queue);
}

static int clear(const trip_tiles *t)
{
    static const GLuint zero = 0;
    int status = use_program(t, TRIP_GL_PASS_TILE_CLEAR);
    if (status)
        return status;
    glClearNamedBufferData(t->closed, GL_R32UI, GL_RED_INTEGER, GL_UNSIGNED_INT, &zero);
    glUniform2i(TRIP_GL_TILE_PICTURE, t->params.width, t->params.height);
    for (unsigned band = 0; band < t->bands && !status; band++) {
        bind_band(t, band);
        glDispatchCompute((GLuint)tiles_of(t, band), 1, 1);
        status = end_part(t);
    }
    return status ? status : trip_gl_check(t->of->context, "tiles");
}

static int begin(void *user, trip_tiles **out, const trip_tiles_params *params)
{
    trip_gl_tiles *of = user;
    *out = NULL;
    int status = trip_gl_context_use(of->context);
    if (status)
        return status;
    trip_tiles *t = trip_budget_take(params->budget, sizeof *t);
    if (!t)
        return 1;
    t->of = of;
    t->params = *params;
    t->columns = (params->width + TRIP_TILE_PX - 1) / TRIP_TILE_PX;
    t->rows = (params->height + TRIP_TILE_PX - 1) / TRIP_TILE_PX;
    t->count = (size_t)t->columns * (size_t)t->rows;
    t->tile_bytes = (size_t)(params->depth ? TRIP_TILE_PLANES_MAX : TRIP_TILE_DEPTH) *
                    TRIP_TILE_PIXELS * sizeof(float);
    status = make_planes(t) && make_lists(t) ? clear(t) : 1;
    if (status)
        end(t);
    else
        *out = t;
    return status;
}

/* ---- pieces ---- */

static int clamped(double at, int count)
{
    return at < 0 ? 0 : at < count ? (int)at : count - 1;
}

/* Moves a footprint to the first pixel of the nearest tile, in double precision. A centre may lie
 * far outside the picture. */
static void convert(const trip_tiles *t, const trip_projected *s, const trip_curve *curve,
                    struct trip_gl_projected *out, struct trip_gl_curve *out_curve)
{
    const int column = clamped(floor(s->x / TRIP_TILE_PX), t->columns);
    const int row = clamped(floor(s->y / TRIP_TILE_PX), t->rows);
    const double dx = column * TRIP_TILE_PX + 0.5 - s->x, dy = row * TRIP_TILE_PX + 0.5 - s->y;
    *out = (struct trip_gl_projected){
        .uv = { { (float)((double)s->across * dx - (double)s->across_shear * dy),
                  (float)((double)s->down * dy), s->across, s->across_shear } },
        .rest = { { s->down, s->limit, s->opacity, s->z } },
        .rgb = { s->rgb[0], s->rgb[1], s->rgb[2] },
        .tile = (uint32_t)column | (uint32_t)row << 16,
    };
    if (!out_curve)
        return;
    *out_curve = (struct trip_gl_curve){ .w_a_b = { { 1 } } };
    if (s->curved)
        *out_curve = (struct trip_gl_curve){
            .w_a_b = { { (float)(1 + (double)curve->bend_x * dx + (double)curve->bend_y * dy),
                         (float)((double)curve->tilt * dx + (double)curve->skew * dy),
                         (float)((double)curve->turn * dy), curve->turn } },
            .steps = { { curve->bend_x, curve->bend_y, curve->tilt, curve->skew } },
        };
}

static void copy_splats(const trip_tiles *t, const trip_tile_piece *piece, unsigned char *memory)
{
    struct trip_gl_projected *splats = (struct trip_gl_projected *)memory;
    struct trip_gl_curve *curves =
        t->params.curved ? (struct trip_gl_curve *)(memory + t->curves_at) : NULL;
    for (size_t i = piece->splat_from; i < piece->splat_to; i++)
        convert(t, &piece->splats[i], curves ? &piece->curves[i] : NULL, &splats[i],
                curves ? &curves[i] : NULL);
}

/* Takes the next slot. Waits until its last piece is done, and notes the tiles closed by then. */
static int take_slot(trip_tiles *t, uint16_t *open, piece_slot **out)
{
    piece_slot *slot = *out = &t->slots[t->next];
    t->next = (t->next + 1) % SLOTS;
    const int done = trip_gl_queue_is_done(t->of->queue, slot->lists.part, true);
    if (done < 0)
        return done;
    const uint32_t *closed = (const uint32_t *)slot->closed.memory;
    for (size_t i = 0; i < t->count && slot->filled; i++)
        if (closed[i] == TRIP_TILE_PIXELS)
            open[i] = 0;
    slot->filled = true;
    return 0;
}

/* Copies and binds a part of the lists. */
static void take_list(const trip_tiles *t, const piece_slot *slot, GLuint binding, size_t at,
                      size_t bytes)
{
    if (!bytes)
        return;
    glCopyNamedBufferSubData(slot->lists.buffer, t->lists, (GLintptr)at, (GLintptr)at,
                             (GLsizeiptr)bytes);
    glBindBufferRange(GL_SHADER_STORAGE_BUFFER, binding, t->lists, (GLintptr)at, (GLsizeiptr)bytes);
}

static void take_lists(const trip_tiles *t, const piece_slot *slot, const trip_tile_piece *piece)
{
    const size_t curves = t->params.curved ? piece->splat_to : 0;
    take_list(t, slot, TRIP_GL_TILE_SPLATS, 0, piece->splat_to * sizeof(struct trip_gl_projected));
    take_list(t, slot, TRIP_GL_TILE_CURVES, t->curves_at, curves * sizeof(struct trip_gl_curve));
    take_list(t, slot, TRIP_GL_TILE_PAIRS, t->pairs_at, piece->pair_count * sizeof(uint32_t));
    glBindBufferRange(GL_SHADER_STORAGE_BUFFER, TRIP_GL_TILE_JOBS, slot->lists.buffer,
                      (GLintptr)t->jobs_at, (GLsizeiptr)(slot->lists.bytes - t->jobs_at));
}

/* Writes the jobs of a band from *tile on, as many as one part should have. Returns their number.
 */
static size_t make_jobs(const trip_tiles *t, const trip_tile_piece *piece, const uint16_t *open,
                        unsigned band, size_t *tile, struct trip_gl_tile *jobs)
{
    const size_t first = band * t->band_tiles, end = first + tiles_of(t, band);
    size_t room = is_software(t->of) ? PART_PAIRS_SOFTWARE : PART_PAIRS_GPU, count = 0;
    for (; *tile < end && room > 0; ++*tile) {
        const uint32_t pairs = piece->count[*tile];
        if (!pairs || !open[*tile])
            continue;
        jobs[count++] =
            (struct trip_gl_tile){ (uint32_t)(*tile - first), piece->first[*tile], pairs };
        room -= pairs < room ? pairs : room;
    }
    return count;
}

/* Composites the piece in its slot. */
static int composite(const trip_tiles *t, const piece_slot *slot, const trip_tile_piece *piece,
                     const uint16_t *open)
{
    struct trip_gl_tile *jobs = (struct trip_gl_tile *)(slot->lists.memory + t->jobs_at);
    size_t made = 0;
    int status = use_program(t, TRIP_GL_PASS_TILES);
    if (status)
        return status;
    take_lists(t, slot, piece);
    glUniform1f(TRIP_GL_TILE_TERMINATION, t->params.termination);
    for (unsigned band = 0; band < t->bands; band++) {
        bind_band(t, band);
        for (size_t tile = band * t->band_tiles, end = tile + tiles_of(t, band); tile < end;) {
            const size_t count = make_jobs(t, piece, open, band, &tile, jobs + made);
            if (!count)
                continue;
            glUniform1ui(TRIP_GL_TILE_FIRST_JOB, (GLuint)made);
            glDispatchCompute((GLuint)count, 1, 1);
            made += count;
            status = end_part(t);
            if (status)
                return status;
        }
    }
    return 0;
}

static int draw(trip_tiles *t, const trip_tile_piece *piece, uint16_t *open)
{
    piece_slot *slot;
    if (!piece->pair_count)
        return 0;
    int status = trip_gl_context_use(t->of->context);
    if (!status)
        status = take_slot(t, open, &slot);
    if (status)
        return status;
    copy_splats(t, piece, slot->lists.memory);
    memcpy(slot->lists.memory + t->pairs_at, piece->pairs,
           piece->pair_count * sizeof *piece->pairs);
    status = composite(t, slot, piece, open);
    glCopyNamedBufferSubData(t->closed, slot->closed.buffer, 0, 0,
                             (GLsizeiptr)(t->count * sizeof(uint32_t)));
    if (!status)
        status = trip_gl_queue_end_part(t->of->queue);
    slot->lists.part = t->of->queue->ended;
    return status ? status : trip_gl_check(t->of->context, "tiles");
}

static int read_planes(trip_tiles *t, size_t first, size_t count, float *planes)
{
    int status = trip_gl_context_use(t->of->context);
    if (!status)
        status = trip_gl_queue_is_done(t->of->queue, t->of->queue->ended, true);
    if (status < 0)
        return status;
    for (size_t end = first + count; first < end;) {
        const size_t band = first / t->band_tiles, at = first - band * t->band_tiles;
        const size_t left = tiles_of(t, (unsigned)band) - at;
        const size_t some = end - first < left ? end - first : left;
        glGetNamedBufferSubData(t->planes[band], (GLintptr)(at * t->tile_bytes),
                                (GLsizeiptr)(some * t->tile_bytes), planes);
        planes += some * t->tile_bytes / sizeof *planes;
        first += some;
    }
    return trip_gl_check(t->of->context, "tiles");
}

void trip_gl_tiles_set_up(trip_gl_tiles *of)
{
    of->device = (trip_tile_device){
        .user = of,
        .batch_max = is_software(of) ? BATCH_SOFTWARE : BATCH_GPU,
        .begin = begin,
        .draw = draw,
        .read = read_planes,
        .end = end,
    };
}
