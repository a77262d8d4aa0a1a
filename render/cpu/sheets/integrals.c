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
static void step(const trip_tf_entry *table, int code, double out[4])
{
    const trip_tf_entry *a = &table[code], *b = &table[code + 1];
    out[0] = 0.5 * ((double)a->extinction + b->extinction);
    for (int i = 0; i < 3; i++)
        out[1 + i] = product(a->extinction, b->extinction, component(a, i), component(b, i));
}

/* The nearest whole number of one that is not negative. */
static int32_t rounded(double x)
{
    return (int32_t)(x + 0.5);
}

static void set_at(trip_cpu_integrals *in, const trip_tf_entry *table, double factor)
{
    for (int code = 0; code < CODES; code++) {
        const trip_tf_entry *e = &table[code];
        in->at[code][0] = rounded(factor * e->extinction);
        for (int i = 0; i < 3; i++)
            in->at[code][1 + i] = rounded(factor * e->extinction * component(e, i));
    }
}

static void set_next_visible(trip_cpu_function *f, const trip_tf_entry *table)
{
    uint32_t next = CODES;
    for (int code = CODES - 1; code >= 0; code--) {
        next = table[code].extinction > 0 ? (uint32_t)code : next;
        f->next_visible[code] = next;
    }
    uint32_t first = f->next_visible[0], last = first;
    while (last + 1 < CODES && f->next_visible[last + 1] == last + 1)
        last++;
    f->integrals.first = (int32_t)first;
    f->integrals.last = -1;
    for (int code = 0; code < CODES; code++)
        if (table[code].extinction > 0)
            f->integrals.last = code;
    f->in_a_row = first < CODES && (last + 1 >= CODES || f->next_visible[last + 1] == CODES);
    f->first_visible = (int16_t)((int)first - TRIP_CPU_CODE_BIAS);
    f->last_visible = (int16_t)((int)last - TRIP_CPU_CODE_BIAS);
}

void trip_cpu_function_set(trip_cpu_function *f, const trip_tf_entry *table, double voxel_world)
{
    trip_cpu_integrals *in = &f->integrals;
    double all = 0, sum[4] = { 0 }, add[4];
    for (int code = 0; code < CODES - 1; code++)
        all += 0.5 * ((double)table[code].extinction + table[code + 1].extinction);
    /* A function of one code alone still has what at[] is in units of. */
    double factor = all > 0 ? GREATEST / all : 1;
    for (int code = 0; code < CODES; code++) {
        for (int i = 0; i < 4; i++)
            in->sums[code][i] = rounded(factor * sum[i]);
        if (code == CODES - 1)
            break;
        if (table[code].extinction == 0 && table[code + 1].extinction == 0)
            continue;
        step(table, code, add);
        for (int i = 0; i < 4; i++)
            sum[i] += add[i];
    }
    set_at(in, table, factor);
    set_next_visible(f, table);
    in->extinction = (float)fmin(1e25, voxel_world / factor); /* opaque anyway */
}
