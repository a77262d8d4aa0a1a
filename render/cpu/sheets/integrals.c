#include "cpu/sheets/integrals.h"

#include <math.h>

enum { CODES = 65536, ENTRIES = TRIP_CPU_ENTRIES, ENTRY_CODES = TRIP_CPU_ENTRY_CODES };

/* The greatest of the integrals, so that differences fit 32 bits with a sign. */
#define GREATEST 0x1p30

uint64_t trip_cpu_function_bytes(void)
{
    return ENTRIES * 2 * sizeof(int32_t[4]) + CODES * sizeof(uint32_t);
}

bool trip_cpu_function_create(trip_cpu_function *f, trip_budget *budget)
{
    trip_cpu_integrals *in = &f->integrals;
    *f = (trip_cpu_function){ 0 };
    in->sums = trip_budget_take(budget, ENTRIES * sizeof *in->sums);
    in->at = trip_budget_take(budget, ENTRIES * sizeof *in->at);
    f->next_visible = trip_budget_take(budget, CODES * sizeof *f->next_visible);
    if (in->sums && in->at && f->next_visible)
        return true;
    trip_cpu_function_destroy(f, budget);
    return false;
}

void trip_cpu_function_destroy(trip_cpu_function *f, trip_budget *budget)
{
    trip_cpu_integrals *in = &f->integrals;
    trip_budget_release(budget, in->sums, ENTRIES * sizeof *in->sums);
    trip_budget_release(budget, in->at, ENTRIES * sizeof *in->at);
    trip_budget_release(budget, f->next_visible, CODES * sizeof *f->next_visible);
    *f = (trip_cpu_function){ 0 };
}

/* The function is linear between the codes of the data set. */
static trip_tf_entry entry_at(const trip_tf_entry *table, trip_cpu_codes codes, int code)
{
    const int whole = codes.first + (code >> codes.shift);
    const trip_tf_entry *a = &table[whole < CODES - 1 ? whole : CODES - 1], *b = a + 1;
    const int rest = code & ((1 << codes.shift) - 1);
    if (rest == 0 || whole >= CODES - 1)
        return *a;
    const float part = (float)rest / (float)(1 << codes.shift);
    return (trip_tf_entry){ .r = a->r + part * (b->r - a->r),
                            .g = a->g + part * (b->g - a->g),
                            .b = a->b + part * (b->b - a->b),
                            .extinction = a->extinction + part * (b->extinction - a->extinction) };
}

static double component(const trip_tf_entry *e, int i)
{
    return i == 0 ? e->r : i == 1 ? e->g : e->b;
}

/* The integral from 0 to 1 of the product of two functions that are linear between these values. */
static double product(double a0, double a1, double b0, double b1)
{
    return (a0 * (2 * b0 + b1) + a1 * (b0 + 2 * b1)) / 6;
}

/* From one code to the next: of extinction, and of extinction times each component of colour. */
static void step(const trip_tf_entry *a, const trip_tf_entry *b, double out[4])
{
    out[0] = 0.5 * ((double)a->extinction + b->extinction);
    for (int i = 0; i < 3; i++)
        out[1 + i] = product(a->extinction, b->extinction, component(a, i), component(b, i));
}

/* The nearest whole number of one that is not negative. */
static int32_t rounded(double x)
{
    return (int32_t)(x + 0.5);
}

/* What an entry stands for reaches no farther from a code that is nearest to it. */
static void widen_visible(uint32_t *next)
{
    for (uint32_t code = CODES; code-- > 0;) {
        const uint32_t from = code < ENTRY_CODES ? 0 : code - ENTRY_CODES;
        if (next[from] <= code + ENTRY_CODES)
            next[code] = code;
        else if (next[code] < CODES)
            next[code] -= ENTRY_CODES;
    }
}

static void set_next_visible(trip_cpu_function *f, const trip_tf_entry *table)
{
    uint32_t next = CODES;
    int32_t most = -1;
    for (int code = CODES - 1; code >= 0; code--) {
        if (entry_at(table, f->codes, code).extinction > 0) {
            next = (uint32_t)code;
            most = most < 0 ? code : most;
        }
        f->next_visible[code] = next;
    }
    f->integrals.first = (int32_t)(next / ENTRY_CODES);
    f->integrals.last = most < 0 ? -1 : (most + ENTRY_CODES - 1) / ENTRY_CODES;
    widen_visible(f->next_visible);
    const uint32_t first = f->next_visible[0];
    uint32_t last = first;
    while (last + 1 < CODES && f->next_visible[last + 1] == last + 1)
        last++;
    f->in_a_row = first < CODES && (last + 1 >= CODES || f->next_visible[last + 1] == CODES);
    f->first_visible = (int16_t)((int)first - TRIP_CPU_CODE_BIAS);
    f->last_visible = (int16_t)((int)last - TRIP_CPU_CODE_BIAS);
}

/* Of extinction, over all codes. */
static double whole_integral(const trip_tf_entry *table, trip_cpu_codes codes)
{
    double all = 0, before = entry_at(table, codes, 0).extinction;
    for (int code = 1; code < CODES; code++) {
        const double here = entry_at(table, codes, code).extinction;
        all += 0.5 * (before + here);
        before = here;
    }
    return all;
}

/* The integrals up to half an entry: an entry of sums[], or where one of at[] ends and the next
 * begins. */
static void set_half(trip_cpu_integrals *in, int half, const double sum[4], double factor)
{
    const int entry = half / 2;
    for (int i = 0; i < 4; i++) {
        const int32_t to_here = rounded(factor * sum[i]);
        if (half % 2 == 0) {
            in->sums[entry][i] = to_here;
        } else {
            in->at[entry][i] = to_here - in->at[entry][i];
            in->at[entry + 1][i] = to_here;
        }
    }
}

/* The first and the last of at[], of which half an entry each lies among the codes. */
static void set_ends(trip_cpu_integrals *in, double factor, const trip_tf_entry *first,
                     const trip_tf_entry *last)
{
    const trip_tf_entry *ends[2] = { first, last };
    int32_t *rows[2] = { in->at[0], in->at[ENTRIES - 1] };
    for (int k = 0; k < 2; k++) {
        double sum[4], most = INT32_MAX;
        step(ends[k], ends[k], sum);
        for (int i = 0; i < 4; i++)
            rows[k][i] = (int32_t)fmin(most, ENTRY_CODES * factor * sum[i]);
    }
}

static void set_sums(trip_cpu_integrals *in, const trip_tf_entry *table, trip_cpu_codes codes,
                     double factor)
{
    double sum[4] = { 0 }, add[4];
    trip_tf_entry here = entry_at(table, codes, 0);
    for (int code = 0;; code++) {
        if (code % (ENTRY_CODES / 2) == 0)
            set_half(in, code / (ENTRY_CODES / 2), sum, factor);
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
    const trip_tf_entry first = entry_at(table, codes, 0);
    set_ends(in, factor, &first, &here);
}

void trip_cpu_function_set(trip_cpu_function *f, const trip_tf_entry *table, trip_cpu_codes codes,
                           double voxel_world)
{
    const double all = whole_integral(table, codes);
    /* A function of one code alone still has what at[] is in units of. */
    const double factor = all > 0 ? GREATEST / all : 1;
    f->codes = codes;
    set_sums(&f->integrals, table, codes, factor);
    set_next_visible(f, table);
    f->integrals.extinction =
        (float)fmin(1e25, voxel_world / (factor * ENTRY_CODES)); /* opaque anyway */
}
