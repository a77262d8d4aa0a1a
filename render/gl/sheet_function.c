#include "gl/sheet_function.h"

#include <math.h>

#include "gl/shared.h"
#include "report.h"

enum { CODES = 65536, SUMS_BYTES = CODES * sizeof(struct trip_gl_sum) };

/* The greatest of the sums, about: they are whole numbers, so that differences are exact. */
#define GREATEST 0x1p62

static int make(trip_gl_sheet_function *f)
{
    if (f->sums)
        return TRIP_OK;
    f->next_visible = trip_budget_take(f->budget, CODES * sizeof *f->next_visible);
    if (!f->next_visible || !trip_budget_charge(f->budget, SUMS_BYTES)) {
        trip_budget_release(f->budget, f->next_visible, CODES * sizeof *f->next_visible);
        f->next_visible = NULL;
        return trip_fail(TRIP_ERROR, "gl", "transfer function",
                         "its integrals do not fit the memory given; raise --memory");
    }
    glCreateBuffers(1, &f->sums);
    glNamedBufferStorage(f->sums, SUMS_BYTES, NULL, GL_DYNAMIC_STORAGE_BIT);
    return TRIP_OK;
}

/* The integral from 0 to 1 of the product of two functions that are linear between these values. */
static double product(double a0, double a1, double b0, double b1)
{
    return (a0 * (2 * b0 + b1) + a1 * (b0 + 2 * b1)) / 6;
}

/* From a code to the next: of extinction times each component of colour, and of extinction. */
static void integrate_step(const trip_tf_entry *e, double out[4])
{
    out[0] = product(e[0].extinction, e[1].extinction, e[0].r, e[1].r);
    out[1] = product(e[0].extinction, e[1].extinction, e[0].g, e[1].g);
    out[2] = product(e[0].extinction, e[1].extinction, e[0].b, e[1].b);
    out[3] = 0.5 * ((double)e[0].extinction + e[1].extinction);
}

static double whole_integral(const trip_tf_entry *table)
{
    double all = 0, step[4];
    for (int code = 0; code < CODES - 1; code++) {
        integrate_step(&table[code], step);
        all += step[3];
    }
    return all;
}

static void fill_sums(struct trip_gl_sum *sums, const trip_tf_entry *table, double factor)
{
    uint64_t sum[4] = { 0 };
    double step[4];
    for (int code = 0; code < CODES; code++) {
        for (int i = 0; i < 4; i++) {
            sums[code].low[i] = (uint32_t)sum[i];
            sums[code].high[i] = (uint32_t)(sum[i] >> 32);
        }
        if (code == CODES - 1)
            return;
        integrate_step(&table[code], step);
        for (int i = 0; i < 4; i++)
            sum[i] += (uint64_t)llrint(factor * step[i]);
    }
}

static void set_next_visible(trip_gl_sheet_function *f, const trip_tf_entry *table)
{
    uint32_t next = CODES;
    for (int code = CODES - 1; code >= 0; code--) {
        next = table[code].extinction > 0 ? (uint32_t)code : next;
        f->next_visible[code] = next;
    }
}

int trip_gl_sheet_function_set(trip_gl_sheet_function *f, const trip_tf_entry *table)
{
    int status = make(f);
    struct trip_gl_sum *sums = status ? NULL : trip_budget_take(f->budget, SUMS_BYTES);
    if (status)
        return status;
    if (!sums)
        return trip_fail(TRIP_ERROR, "gl", "transfer function",
                         "its integrals do not fit the memory given; raise --memory");
    double all = whole_integral(table);
    double factor = all > 0 ? GREATEST / all : 1;
    f->unit = 1 / factor;
    fill_sums(sums, table, factor);
    set_next_visible(f, table);
    glNamedBufferSubData(f->sums, 0, SUMS_BYTES, sums);
    trip_budget_release(f->budget, sums, SUMS_BYTES);
    return TRIP_OK;
}

void trip_gl_sheet_function_release(trip_gl_sheet_function *f)
{
    if (f->sums) {
        glDeleteBuffers(1, &f->sums);
        trip_budget_discharge(f->budget, SUMS_BYTES);
        trip_budget_release(f->budget, f->next_visible, CODES * sizeof *f->next_visible);
    }
    *f = (trip_gl_sheet_function){ .budget = f->budget };
}
