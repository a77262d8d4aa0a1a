#include "cpu/sheets/integrals.h"

#include <math.h>

enum { CODES = 65536 };

/* The greatest of the integrals, so that differences fit 32 bits with a sign. */
#define GREATEST 0x1p30

uint64_t trip_cpu_function_bytes(void)
{
    return CODES * (sizeof(int32_t[4]) * 2 + sizeof(uint32_t));
}

bool trip_cpu_function_create(trip_cpu_function *f, trip_budget *budget)
{
    trip_cpu_integrals *in = &f->integrals;
    *f = (trip_cpu_function){ 0 };
    in->sums = trip_budget_take(budget, CODES * sizeof *in->sums);
    in->at = trip_budget_take(budget, CODES * sizeof *in->at);
    f->next_visible = trip_budget_take(budget, CODES * sizeof *f->next_visible);
    if (in->sums && in->at && f->next_visible)
        return true;
    trip_cpu_function_destroy(f, budget);
    return false;
}

void trip_cpu_function_destroy(trip_cpu_function *f, trip_budget *budget)
{
    trip_cpu_integrals *in = &f->integrals;
    trip_budget_release(budget, in->sums, CODES * sizeof *in->sums);
    trip_budget_release(budget, in->at, CODES * sizeof *in->at);
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

static void set_at(trip_cpu_integrals *in, const trip_tf_entry *table, trip_cpu_codes codes,
                   double factor)
{
    for (int code = 0; code < CODES; code++) {
        const trip_tf_entry e = entry_at(table, codes, code);
        in->at[code][0] = rounded(factor * e.extinction);
        for (int i = 0; i < 3; i++)
            in->at[code][1 + i] = rounded(factor * e.extinction * component(&e, i));
    }
}

static void set_next_visible(trip_cpu_function *f, const trip_tf_entry *table)
{
    uint32_t next = CODES;
    f->integrals.last = -1;
    for (int code = CODES - 1; code >= 0; code--) {
        if (entry_at(table, f->codes, code).extinction > 0) {
            next = (uint32_t)code;
            f->integrals.last = f->integrals.last < 0 ? code : f->integrals.last;
        }
        f->next_visible[code] = next;
    }
    uint32_t first = f->next_visible[0], last = first;
    while (last + 1 < CODES && f->next_visible[last + 1] == last + 1)
        last++;
    f->integrals.first = (int32_t)first;
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

static void set_sums(trip_cpu_integrals *in, const trip_tf_entry *table, trip_cpu_codes codes,
                     double factor)
{
    double sum[4] = { 0 }, add[4];
    trip_tf_entry here = entry_at(table, codes, 0);
    for (int code = 0; code < CODES; code++) {
        for (int i = 0; i < 4; i++)
            in->sums[code][i] = rounded(factor * sum[i]);
        if (code == CODES - 1)
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

void trip_cpu_function_set(trip_cpu_function *f, const trip_tf_entry *table, trip_cpu_codes codes,
                           double voxel_world)
{
    const double all = whole_integral(table, codes);
    /* A function of one code alone still has what at[] is in units of. */
    const double factor = all > 0 ? GREATEST / all : 1;
    f->codes = codes;
    set_sums(&f->integrals, table, codes, factor);
    set_at(&f->integrals, table, codes, factor);
    set_next_visible(f, table);
    f->integrals.extinction = (float)fmin(1e25, voxel_world / factor); /* opaque anyway */
}
