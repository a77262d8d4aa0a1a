#include "gl/sheet_blur.h"

#include <assert.h>
#include <math.h>
#include <xxhash.h>

#include "gl/shared.h"
#include "report.h"

/* PIECE is the number of entries loaded at once. */
enum { ROWS = TRIP_BLURRED_ROWS, PIECE = 4096 };

static_assert(ROWS == TRIP_GL_BLURRED_ROWS && TRIP_BLURRED_BEFORE == TRIP_GL_BLURRED_BEFORE,
              "shaders find the same rows");

/* A function that a frame does not need may take this part of the memory left. */
#define KEPT_PART (1.0 / 16)

/* Approximate maximum of the sums. Sums are integers, so their differences are exact. */
#define GREATEST 0x1p62

/* The head of the buffer. */
typedef struct head {
    float voxel_world, unused[3];
    struct trip_gl_blurred_row rows[ROWS];
} head;

static uint64_t sums_bytes(void)
{
    const trip_blurred_function shape = trip_blurred_function_shape();
    return sizeof(head) +
           trip_blurred_function_entries(&shape) * sizeof(struct trip_gl_blurred_entry);
}

static const uint64_t growths_bytes = TRIP_CODES * sizeof(float);

static GLuint make_buffer(trip_budget *budget, uint64_t bytes)
{
    GLuint buffer = 0;
    if (!trip_budget_charge(budget, bytes))
        return 0;
    glCreateBuffers(1, &buffer);
    glNamedBufferStorage(buffer, (GLsizeiptr)bytes, NULL, GL_DYNAMIC_STORAGE_BIT);
    return buffer;
}

static void drop_buffer(trip_budget *budget, GLuint *buffer, uint64_t bytes)
{
    if (!*buffer)
        return;
    glDeleteBuffers(1, buffer);
    trip_budget_discharge(budget, bytes);
    *buffer = 0;
}

/* ---- sums ---- */

/* Blurred functions have extinction first, entries of shaders last. */
static double component(const float entry[4], int c)
{
    return entry[(c + 1) % 4];
}

/* Returns the factor from the integrals of a row to its sums. */
static double factor_of(const float (*entries)[4], uint32_t count)
{
    double all = 0;
    for (uint32_t i = 1; i < count; i++)
        all += 0.5 * ((double)entries[i - 1][0] + entries[i][0]);
    return all > 0 ? GREATEST / all : 1;
}

static void fill_entry(struct trip_gl_blurred_entry *to, const float entry[4],
                       const uint64_t sum[4])
{
    for (int c = 0; c < 4; c++) {
        to->low[c] = (uint32_t)sum[c];
        to->high[c] = (uint32_t)(sum[c] >> 32);
        to->entry[c] = (float)component(entry, c);
    }
}

/* Loads a row piece by piece. Returns the value of 1 in its sums, per world unit. */
static double load_row(GLuint buffer, const trip_blurred_row *row, const float (*entries)[4],
                       struct trip_gl_blurred_entry piece[PIECE])
{
    const double factor = factor_of(entries, row->entries);
    uint64_t sum[4] = { 0 };
    for (uint32_t first = 0; first < row->entries; first += PIECE) {
        const uint32_t left = row->entries - first, count = left < PIECE ? left : PIECE;
        for (uint32_t i = first; i < first + count; i++) {
            for (int c = 0; c < 4 && i > 0; c++)
                sum[c] += (uint64_t)llrint(
                    factor * 0.5 * (component(entries[i - 1], c) + component(entries[i], c)));
            fill_entry(&piece[i - first], entries[i], sum);
        }
        glNamedBufferSubData(buffer,
                             (GLintptr)(sizeof(head) + (row->first + first) * sizeof *piece),
                             (GLsizeiptr)(count * sizeof *piece), piece);
    }
    return 1 / factor;
}

/* Makes the buffer after the function, since making the function takes further memory. */
static int load_rows(trip_gl_sheet_blur *b, const trip_tf_entry *table)
{
    trip_blurred_function f;
    const size_t bytes = PIECE * sizeof(struct trip_gl_blurred_entry);
    if (!trip_blurred_function_create(&f, table, b->budget))
        return TRIP_ERROR;
    struct trip_gl_blurred_entry *piece = trip_budget_take(b->budget, bytes);
    b->sums = piece ? make_buffer(b->budget, sums_bytes()) : 0;
    for (int r = 1; r < ROWS && b->sums; r++)
        b->units[r] =
            load_row(b->sums, &f.rows[r], (const float(*)[4])(f.entries + f.rows[r].first), piece);
    trip_blurred_function_destroy(&f, b->budget);
    trip_budget_release(b->budget, piece, bytes);
    return b->sums ? TRIP_OK : TRIP_ERROR;
}

static int set_rows(trip_gl_sheet_blur *b, const trip_tf_entry *table)
{
    const XXH128_hash_t hash = XXH3_128bits(table, TRIP_CODES * sizeof *table);
    if (b->sums && b->table_hash[0] == hash.low64 && b->table_hash[1] == hash.high64)
        return TRIP_OK;
    drop_buffer(b->budget, &b->sums, sums_bytes());
    b->table_hash[0] = hash.low64;
    b->table_hash[1] = hash.high64;
    return load_rows(b, table);
}

static void set_head(const trip_gl_sheet_blur *b, double voxel_world)
{
    const trip_blurred_function shape = trip_blurred_function_shape();
    head h = { .voxel_world = (float)voxel_world };
    for (unsigned r = 0; r < ROWS; r++)
        h.rows[r] = (struct trip_gl_blurred_row){
            .first = shape.rows[r].first,
            .per_code = (float)ldexp(1, -(int)shape.rows[r].log2),
            .unit = (float)(b->units[r] * voxel_world),
            .power = (float)pow(trip_blurred_d_of_row(r) / TRIP_DEVIATION_MAX, 4),
        };
    glNamedBufferSubData(b->sums, 0, sizeof h, &h);
}

/* ---- growth of deviations ---- */

static int set_growths(trip_gl_sheet_blur *b, const trip_draw_codes *draw)
{
    if (!b->growths)
        b->growths = make_buffer(b->budget, growths_bytes);
    float *growths = b->growths ? trip_budget_take(b->budget, growths_bytes) : NULL;
    if (!growths)
        return TRIP_ERROR;
    for (unsigned code = 0; code < TRIP_CODES; code++)
        growths[code] = (float)trip_draw_deviation(draw, code, 1);
    glNamedBufferSubData(b->growths, 0, (GLsizeiptr)growths_bytes, growths);
    trip_budget_release(b->budget, growths, growths_bytes);
    return TRIP_OK;
}

/* Returns the bytes that a new function takes at most, with its growths. */
static uint64_t new_bytes(void)
{
    const trip_blurred_function shape = trip_blurred_function_shape();
    return sums_bytes() + trip_blurred_function_entries(&shape) * sizeof *shape.entries +
           PIECE * sizeof(struct trip_gl_blurred_entry) + 2 * growths_bytes;
}

static int no_memory(trip_gl_sheet_blur *b)
{
    trip_gl_sheet_blur_release(b);
    const uint64_t taken = trip_budget_limit_bytes(b->budget) - trip_budget_left_bytes(b->budget);
    return trip_fail(TRIP_ERROR, "gl", "transfer function",
                     "its blurred integrals do not fit the memory given; raise --memory to more "
                     "than %llu MiB",
                     (unsigned long long)((taken + new_bytes()) >> 20));
}

int trip_gl_sheet_blur_set(trip_gl_sheet_blur *b, const trip_tf_entry *table,
                           const trip_draw_codes *draw, double voxel_world)
{
    int status = set_rows(b, table);
    if (!status)
        set_head(b, voxel_world);
    if (!status && draw->of_stored)
        status = set_growths(b, draw);
    return status ? no_memory(b) : TRIP_OK;
}

void trip_gl_sheet_blur_rest(trip_gl_sheet_blur *b)
{
    const double left = (double)trip_budget_left_bytes(b->budget);
    if ((double)(sums_bytes() + growths_bytes) > KEPT_PART * left)
        trip_gl_sheet_blur_release(b);
}

void trip_gl_sheet_blur_bind(const trip_gl_sheet_blur *b)
{
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, TRIP_GL_BLURRED_SUMS, b->sums);
}

void trip_gl_sheet_blur_release(trip_gl_sheet_blur *b)
{
    drop_buffer(b->budget, &b->sums, sums_bytes());
    drop_buffer(b->budget, &b->growths, growths_bytes);
    *b = (trip_gl_sheet_blur){ .budget = b->budget };
}
