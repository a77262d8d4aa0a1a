#include "cpu/sheets/integrals.h"

#include <assert.h>
#include <math.h>
#include <string.h>
#include <xxhash.h>

#include "segments.h"

static_assert(TRIP_CPU_BLURRED_ROWS == (int)TRIP_BLURRED_ROWS, "kernels read the same rows");
static_assert(TRIP_CPU_BLURRED_BEFORE == (int)TRIP_BLURRED_BEFORE, "kernels find the same rows");

enum { CODES = 65536, ENTRIES = TRIP_CPU_ENTRIES_MAX, LOG2_MAX = 2 };

/* The largest integral. Differences of integrals then fit a signed 32-bit integer. */
#define GREATEST 0x1p30

uint64_t trip_cpu_tf_bytes(void)
{
    return ENTRIES * 2 * sizeof(int32_t[4]) + CODES * sizeof(uint32_t);
}

/* The rows of a blurred function for one stretch of codes. Entries are at most a thirty-second part
 * of a row's deviation apart, because samples take the nearest entry. Closer than every fourth
 * stretched code they need not be (TRIP_CPU_ENTRIES), nor closer than the codes themselves. */
#define ENTRIES_EACH_DEVIATION 31.8
enum { CLOSEST_LOG2 = 2 };

/* Returns log2 of the codes from one entry of a row to the next. */
static unsigned log2_of_row(const trip_blurred_row *row, trip_cpu_codes codes)
{
    unsigned log2 = codes.shift > CLOSEST_LOG2 ? codes.shift : CLOSEST_LOG2;
    while (log2 < 15 &&
           ldexp(1, (int)(log2 + 1 - codes.shift)) <= row->deviation / ENTRIES_EACH_DEVIATION)
        log2++;
    return log2;
}

/* Returns the maximum number of entries of all rows but row 0. Stretched codes need fewer. */
static uint32_t entries_of_rows(void)
{
    const trip_blurred_function shape = trip_blurred_function_shape();
    uint32_t sum = 0;
    for (int r = 1; r < TRIP_BLURRED_ROWS; r++)
        sum += (CODES >> log2_of_row(&shape.rows[r], (trip_cpu_codes){ 0 })) + 1;
    return sum;
}

uint64_t trip_cpu_tf_blurred_bytes(void)
{
    const uint64_t rows = TRIP_CPU_BLURRED_ROWS * sizeof(trip_cpu_blurred_row);
    return rows + (ENTRIES + entries_of_rows()) * 2 * sizeof(int32_t[4]);
}

static bool create_blurred(trip_cpu_tf *f, trip_budget *budget)
{
    const uint32_t entries = ENTRIES + entries_of_rows();
    char *memory = f->blurred.rows ? NULL : trip_budget_take(budget, trip_cpu_tf_blurred_bytes());
    if (!memory)
        return f->blurred.rows != NULL;
    void *sums = memory, *at = memory + entries * sizeof *f->blurred.sums;
    void *rows = memory + 2 * entries * sizeof *f->blurred.sums;
    f->blurred = (trip_cpu_blurred){ .rows = rows, .sums = sums, .at = at };
    return true;
}

static void destroy_blurred(trip_cpu_tf *f, trip_budget *budget)
{
    if (f->blurred.rows)
        trip_budget_release(budget, f->blurred.sums, trip_cpu_tf_blurred_bytes());
    f->blurred = (trip_cpu_blurred){ NULL };
}

bool trip_cpu_tf_create(trip_cpu_tf *f, trip_budget *budget)
{
    trip_cpu_integrals *in = &f->integrals;
    *f = (trip_cpu_tf){ 0 };
    in->sums = trip_budget_take(budget, ENTRIES * sizeof *in->sums);
    in->at = trip_budget_take(budget, ENTRIES * sizeof *in->at);
    f->next_visible = trip_budget_take(budget, CODES * sizeof *f->next_visible);
    if (in->sums && in->at && f->next_visible)
        return true;
    trip_cpu_tf_destroy(f, budget);
    return false;
}

void trip_cpu_tf_destroy(trip_cpu_tf *f, trip_budget *budget)
{
    trip_cpu_integrals *in = &f->integrals;
    destroy_blurred(f, budget);
    trip_budget_release(budget, in->sums, ENTRIES * sizeof *in->sums);
    trip_budget_release(budget, in->at, ENTRIES * sizeof *in->at);
    trip_budget_release(budget, f->next_visible, CODES * sizeof *f->next_visible);
    *f = (trip_cpu_tf){ 0 };
}

static trip_tf_entry between(const trip_tf_entry *a, const trip_tf_entry *b, float part)
{
    return (trip_tf_entry){ .r = a->r + part * (b->r - a->r),
                            .g = a->g + part * (b->g - a->g),
                            .b = a->b + part * (b->b - a->b),
                            .extinction = a->extinction + part * (b->extinction - a->extinction) };
}

/* Returns the transfer function at a stretched code. It is linear between the codes of the data
 * set. */
static trip_tf_entry entry_at(const trip_tf_entry *table, trip_cpu_codes codes, int code)
{
    const int whole = codes.first + (code >> codes.shift);
    const trip_tf_entry *a = &table[whole < CODES - 1 ? whole : CODES - 1], *b = a + 1;
    const int rest = code & ((1 << codes.shift) - 1);
    if (rest == 0 || whole >= CODES - 1)
        return *a;
    return between(a, b, (float)rest / (float)(1 << codes.shift));
}

static double component(const trip_tf_entry *e, int i)
{
    return i == 0 ? e->r : i == 1 ? e->g : e->b;
}

/* Computes the integrals between two neighbouring codes: of extinction, and of extinction times
 * each colour component. */
static void step(const trip_tf_entry *a, const trip_tf_entry *b, double out[4])
{
    out[0] = 0.5 * ((double)a->extinction + b->extinction);
    for (int i = 0; i < 3; i++)
        out[1 + i] =
            trip_segment_product(a->extinction, b->extinction, component(a, i), component(b, i));
}

/* Rounds a number x >= 0 to the nearest integer. */
static int32_t rounded(double x)
{
    return (int32_t)(x + 0.5);
}

/* Widens the set of visible codes by `entry_codes` on both sides. An entry stands for codes up to
 * half an entry away, and the line between two entries for all codes between. */
static void widen_visible(uint32_t *next, uint32_t entry_codes)
{
    for (uint32_t code = CODES; code-- > 0;) {
        const uint32_t from = code < entry_codes ? 0 : code - entry_codes;
        if (next[from] <= code + entry_codes)
            next[code] = code;
        else if (next[code] < CODES)
            next[code] -= entry_codes;
    }
}

static void set_next_visible(trip_cpu_tf *f, const trip_tf_entry *table)
{
    const int log2 = f->integrals.entry_log2;
    uint32_t next = CODES;
    int32_t max = -1;
    for (int code = CODES - 1; code >= 0; code--) {
        if (entry_at(table, f->codes, code).extinction > 0) {
            next = (uint32_t)code;
            max = max < 0 ? code : max;
        }
        f->next_visible[code] = next;
    }
    f->integrals.first = (int32_t)(next >> log2);
    f->integrals.last = max < 0 ? -1 : (max + (1 << log2) - 1) >> log2;
    widen_visible(f->next_visible, 1u << log2);
    const uint32_t first = f->next_visible[0];
    uint32_t last = first;
    while (last + 1 < CODES && f->next_visible[last + 1] == last + 1)
        last++;
    f->in_a_row = first < CODES && (last + 1 >= CODES || f->next_visible[last + 1] == CODES);
    f->first_visible = (int16_t)((int)first - TRIP_CPU_CODE_BIAS);
    f->last_visible = (int16_t)((int)last - TRIP_CPU_CODE_BIAS);
}

/* Returns the integral of extinction over all codes, and the maximum. */
static double whole_integral(const trip_tf_entry *table, trip_cpu_codes codes, double *max)
{
    double all = 0, before = entry_at(table, codes, 0).extinction;
    *max = before;
    for (int code = 1; code < CODES; code++) {
        const double here = entry_at(table, codes, code).extinction;
        all += 0.5 * (before + here);
        *max = fmax(*max, here);
        before = here;
    }
    return all;
}

/* Tolerance of opacity and colour along a voxel's length. Neighbouring values of an 8-bit source
 * are 256 codes apart. So any transfer function of such a source changes by less than this between
 * an entry and the codes nearest to it. */
#define ENTRY_TOLERANCE (1.0 / 127)

/* Returns whether a voxel's length of two media adds about the same to a picture. */
static bool are_alike(const trip_tf_entry *a, const trip_tf_entry *b, double voxel_world)
{
    double colour = 0, max = 0;
    for (int i = 0; i < 3; i++)
        colour = fmax(colour, fabs(component(a, i) - component(b, i)));
    if (voxel_world * fabs((double)a->extinction - b->extinction) + colour <= ENTRY_TOLERANCE)
        return true;
    const double of_a = -expm1(-voxel_world * a->extinction);
    const double of_b = -expm1(-voxel_world * b->extinction);
    for (int i = 0; i < 3; i++)
        max = fmax(max, fabs(of_a * component(a, i) - of_b * component(b, i)));
    return fmax(max, fabs(of_a - of_b)) <= ENTRY_TOLERANCE;
}

/* Returns whether entries 2^log2 codes apart can stand for the codes nearest to them. */
static bool suffices(const trip_tf_entry *table, trip_cpu_codes codes, int log2, double voxel_world)
{
    const int step = 1 << log2, max = CODES - 1;
    if (log2 == 0 || codes.shift >= 8)
        return true;
    for (int code = 0; code < CODES; code++) {
        const int nearest = (code + step / 2) >> log2 << log2;
        const trip_tf_entry is = entry_at(table, codes, code);
        const trip_tf_entry taken = entry_at(table, codes, nearest < max ? nearest : max);
        if (!are_alike(&is, &taken, voxel_world))
            return false;
    }
    return true;
}

static void set_entry(trip_cpu_integrals *in, int entry, const double sum[4],
                      const trip_tf_entry *here, double factor)
{
    const double codes = 1 << in->entry_log2;
    double at[4];
    step(here, here, at);
    for (int i = 0; i < 4; i++) {
        in->sums[entry][i] = rounded(fmin(INT32_MAX - 1, factor * sum[i]));
        in->at[entry][i] = rounded(fmin(INT32_MAX - 1, codes * factor * at[i]));
    }
}

static void set_sums(trip_cpu_integrals *in, const trip_tf_entry *table, trip_cpu_codes codes,
                     double factor)
{
    double sum[4] = { 0 }, add[4];
    trip_tf_entry here = entry_at(table, codes, 0);
    for (int code = 0;; code++) {
        if (code % (1 << in->entry_log2) == 0)
            set_entry(in, code >> in->entry_log2, sum, &here, factor);
        if (code == CODES)
            break;
        const trip_tf_entry before = here;
        here = entry_at(table, codes, code + 1);
        if (before.extinction == 0 && here.extinction == 0)
            continue;
        step(&before, &here, add);
        for (int i = 0; i < 4; i++)
            sum[i] += add[i];
    }
}

static void set_integrals(trip_cpu_tf *f, const trip_tf_entry *table)
{
    double max;
    const double all = whole_integral(table, f->codes, &max);
    /* If the integral is 0, at[] still needs a unit. */
    const double factor = all > 0 ? GREATEST / all : 1;
    f->integrals.entry_log2 = LOG2_MAX;
    while (!suffices(table, f->codes, f->integrals.entry_log2, f->voxel_world) ||
           (f->integrals.entry_log2 > 0 &&
            ldexp(factor * max, f->integrals.entry_log2) > INT32_MAX)) /* `at` needs 32 bits */
        f->integrals.entry_log2--;
    set_sums(&f->integrals, table, f->codes, factor);
    f->integrals.extinction = (float)fmin(
        1e25, f->voxel_world / ldexp(factor, f->integrals.entry_log2)); /* opaque at this limit */
}

/* ---- blurred functions ---- */

/* Returns a row of the blurred function at a stretched code. */
static void blurred_at(const trip_blurred_function *f, int row, trip_cpu_codes codes, int code,
                       double out[4])
{
    const trip_blurred_row *r = &f->rows[row];
    const double last = (double)(r->entries - 1);
    const double at =
        fmin(last, ldexp(codes.first + ldexp(code, -(int)codes.shift), -(int)r->log2));
    const uint32_t i = at < last ? (uint32_t)at : r->entries - 2;
    const float *a = f->entries[r->first + i], *b = f->entries[r->first + i + 1];
    for (int k = 0; k < 4; k++)
        out[k] = a[k] + (at - i) * ((double)b[k] - a[k]);
}

/* Sets the integrals of a row by trapezoids between its entries. Returns the entry behind them. */
static int32_t set_row(trip_cpu_tf *f, const trip_blurred_function *blurred, int row, int32_t first)
{
    const unsigned log2 = log2_of_row(&blurred->rows[row], f->codes);
    const int entries = (CODES >> log2) + 1;
    double all = 0, before[4], here[4], sum[4] = { 0 };
    for (int i = 0; i < entries; i++) {
        blurred_at(blurred, row, f->codes, i << log2, here);
        all += i > 0 ? 0.5 * (before[0] + here[0]) : 0;
        before[0] = here[0];
    }
    const double factor = all > 0 ? GREATEST / all : 1;
    for (int i = 0; i < entries; i++) {
        blurred_at(blurred, row, f->codes, i << log2, here);
        for (int k = 0; k < 4; k++) {
            sum[k] += i > 0 ? 0.5 * (before[k] + here[k]) : 0;
            f->blurred.sums[first + i][k] = rounded(fmin(GREATEST, factor * sum[k]));
            f->blurred.at[first + i][k] = rounded(fmin(INT32_MAX - 1, factor * here[k]));
            before[k] = here[k];
        }
    }
    f->blurred.rows[row] = (trip_cpu_blurred_row){
        .first = first,
        .log2 = (int32_t)log2,
        .half = (int32_t)(TRIP_CPU_CODE_PARTS << log2 >> 1),
        .extinction = (float)fmin(1e25, f->voxel_world / factor),
    };
    return first + entries;
}

/* Copies the integrals of the function itself to row 0. */
static int32_t set_first_row(trip_cpu_tf *f)
{
    const trip_cpu_integrals *in = &f->integrals;
    const int entries = (CODES >> in->entry_log2) + 1;
    memcpy(f->blurred.sums, in->sums, (size_t)entries * sizeof *in->sums);
    memcpy(f->blurred.at, in->at, (size_t)entries * sizeof *in->at);
    f->blurred.rows[0] = (trip_cpu_blurred_row){
        .first = 0,
        .log2 = in->entry_log2,
        .half = TRIP_CPU_CODE_PARTS << in->entry_log2 >> 1,
        .extinction = in->extinction,
    };
    return entries;
}

static bool set_rows(trip_cpu_tf *f, const trip_tf_entry *table, trip_budget *budget)
{
    trip_blurred_function blurred;
    if (!trip_blurred_function_create(&blurred, table, budget))
        return false;
    const bool created = create_blurred(f, budget);
    int32_t first = created ? set_first_row(f) : 0;
    for (int row = 1; row < TRIP_BLURRED_ROWS && created; row++)
        first = set_row(f, &blurred, row, first);
    trip_blurred_function_destroy(&blurred, budget);
    return created;
}

/* Finds the visible codes nearest to the range of stretched codes. */
static void set_visible_beyond(trip_cpu_tf *f, const trip_tf_entry *table)
{
    const int64_t first = f->codes.first, last = first + ((CODES - 1) >> f->codes.shift);
    int64_t below = first - 1, above = last + 1;
    while (below >= 0 && !(table[below].extinction > 0))
        below--;
    while (above < CODES && !(table[above].extinction > 0))
        above++;
    const int64_t never = INT64_C(1) << 40, unit = INT64_C(1) << f->codes.shift;
    f->visible_below = below >= 0 ? (below - first) * unit : -never;
    f->visible_above = above < CODES ? (above - first) * unit : never;
}

int64_t trip_cpu_tf_reach(const trip_cpu_tf *f, unsigned row)
{
    return (int64_t)ceil(ldexp(trip_blurred_reach_of_row(row), (int)f->codes.shift));
}

bool trip_cpu_tf_shows_within(const trip_cpu_tf *f, int16_t min, int16_t max, int64_t reach)
{
    const int64_t from = min + TRIP_CPU_CODE_BIAS - reach, to = max + TRIP_CPU_CODE_BIAS + reach;
    if (min > max)
        return false;
    if (reach > 0 && (from <= f->visible_below || to >= f->visible_above))
        return true;
    return f->next_visible[from > 0 ? from : 0] <= (uint32_t)(to < CODES ? to : CODES - 1);
}

/* Converts a closed form to the codes of samples, and from world units to voxels. */
static trip_cpu_closed_form closed_form_of(const trip_closed_form *form, trip_cpu_codes codes,
                                           double voxel_world)
{
    trip_cpu_closed_form f = { .ramp = form->ramp, .coloured = form->coloured };
    const double scale = ldexp(form->scale, -(int)codes.shift);
    f.scale = (float)(scale / TRIP_CPU_CODE_PARTS);
    f.offset = (float)(form->offset + form->scale * codes.first + scale * TRIP_CPU_CODE_BIAS);
    /* Rasters store code 0 as 1, where a ramp has already begun. Half a code more covers the
     * rounding of floats. */
    f.min = (float)fmax(0, form->scale > 0 ? form->offset + form->scale * codes.first + 1.5 * scale
                                           : 0);
    for (int i = 0; i < 4; i++)
        f.k[i] = (float)(form->k[i] * voxel_world);
    for (int i = 0; i < 3; i++) {
        f.q0[i] = (float)form->q0[i];
        f.q1[i] = (float)form->q1[i];
    }
    return f;
}

static bool is_of(const trip_cpu_tf *f, XXH128_hash_t table, const trip_closed_form *closed,
                  trip_cpu_codes codes, double voxel_world, bool blurs)
{
    return f->voxel_world == voxel_world && f->integrals.is_closed == (closed != NULL) &&
           f->blurs == blurs && f->codes.first == codes.first && f->codes.shift == codes.shift &&
           f->table_hash[0] == table.low64 && f->table_hash[1] == table.high64;
}

/* `budget` is NULL if nothing is blurred. Returns false if it has too little left. */
static bool set(trip_cpu_tf *f, const trip_tf_entry *table, XXH128_hash_t hash,
                const trip_closed_form *closed, trip_cpu_codes codes, double voxel_world,
                trip_budget *budget)
{
    if (closed) /* depends on more than is_of() compares */
        f->integrals.closed = closed_form_of(closed, codes, voxel_world);
    if (is_of(f, hash, closed, codes, voxel_world, budget != NULL))
        return true;
    f->table_hash[0] = hash.low64;
    f->table_hash[1] = hash.high64;
    f->codes = codes;
    f->voxel_world = voxel_world;
    f->integrals.is_closed = closed != NULL;
    f->integrals.entry_log2 = 0;
    f->integrals.end = (int32_t)fmin(INT16_MAX, ldexp(CODES - 1 - codes.first, (int)codes.shift) -
                                                    TRIP_CPU_CODE_BIAS);
    if (!closed)
        set_integrals(f, table);
    set_next_visible(f, table);
    f->blurs = budget != NULL;
    if (!budget)
        return true;
    set_visible_beyond(f, table);
    if (set_rows(f, table, budget))
        return true;
    f->voxel_world = 0; /* nothing is valid */
    return false;
}

static XXH128_hash_t hash_of(const trip_tf_entry *table)
{
    return XXH3_128bits(table, CODES * sizeof *table);
}

void trip_cpu_tf_set(trip_cpu_tf *f, const trip_tf_entry *table, const trip_closed_form *closed,
                     trip_cpu_codes codes, double voxel_world)
{
    (void)set(f, table, hash_of(table), closed, codes, voxel_world, NULL);
}

bool trip_cpu_tf_set_blurred(trip_cpu_tf *f, const trip_tf_entry *table, trip_cpu_codes codes,
                             double voxel_world, trip_budget *budget)
{
    return set(f, table, hash_of(table), NULL, codes, voxel_world, budget);
}

/* ---- kept functions ---- */

bool trip_cpu_tfs_create(trip_cpu_tfs *f, trip_budget *budget)
{
    *f = (trip_cpu_tfs){ 0 };
    return trip_cpu_tf_create(&f->kept[0], budget);
}

void trip_cpu_tfs_destroy(trip_cpu_tfs *f, trip_budget *budget)
{
    for (int i = 0; i < TRIP_CPU_TFS; i++)
        if (f->kept[i].next_visible)
            trip_cpu_tf_destroy(&f->kept[i], budget);
}

/* Returns the index for the next function. Takes an unused entry if it needs only a small part of
 * the free memory, otherwise the entry taken longest ago. */
static int position_of_next(trip_cpu_tfs *f, trip_budget *budget, bool blurs)
{
    enum { SMALL_PART = 32 };
    int longest = 0;
    for (int i = 0; i < TRIP_CPU_TFS; i++) {
        if (!f->kept[i].next_visible) {
            const uint64_t left = trip_budget_left_bytes(budget);
            const uint64_t bytes = trip_cpu_tf_bytes() + (blurs ? trip_cpu_tf_blurred_bytes() : 0);
            const bool is_small = bytes < left / SMALL_PART;
            return is_small && trip_cpu_tf_create(&f->kept[i], budget) ? i : longest;
        }
        longest = f->turns[i] < f->turns[longest] ? i : longest;
    }
    return longest;
}

const trip_cpu_tf *trip_cpu_tfs_take(trip_cpu_tfs *f, trip_budget *budget,
                                     const trip_tf_entry *table, const trip_closed_form *closed,
                                     trip_cpu_codes codes, double voxel_world, bool blurs)
{
    const XXH128_hash_t hash = hash_of(table);
    int at = 0;
    while (at < TRIP_CPU_TFS && !is_of(&f->kept[at], hash, closed, codes, voxel_world, blurs))
        at++;
    if (at == TRIP_CPU_TFS)
        at = position_of_next(f, budget, blurs);
    f->turns[at] = ++f->turn;
    const bool is_set =
        set(&f->kept[at], table, hash, closed, codes, voxel_world, blurs ? budget : NULL);
    return is_set ? &f->kept[at] : NULL;
}

trip_cpu_codes trip_cpu_codes_of(unsigned min, unsigned max)
{
    trip_cpu_codes c = { .first = 0 };
    if (min > max)
        return c;
    c.first = (uint16_t)min;
    while ((max - min) << (c.shift + 1) <= UINT16_MAX && c.shift < 15)
        c.shift++;
    if (c.shift == 0)
        c.first = 0;
    return c;
}
