#include "gl/sheet_tf.h"

#include <math.h>

#include "gl/shared.h"
#include "report.h"
#include "segments.h"

enum {
    CODES = 65536,
    SUMS_BYTES = CODES * sizeof(struct trip_gl_sum),
    DRAW_CODES_BYTES = CODES * sizeof(float)
};

/* Approximate maximum of the sums. Sums are integers, so their differences are exact. */
#define GREATEST 0x1p62

static int no_memory(void)
{
    return trip_fail(TRIP_ERROR, "gl", "transfer function",
                     "its integrals do not fit the memory given; raise --memory");
}

static int take_next_visible(trip_gl_sheet_tf *f)
{
    if (!f->next_visible)
        f->next_visible = trip_budget_take(f->budget, CODES * sizeof *f->next_visible);
    return f->next_visible ? TRIP_OK : no_memory();
}

static int make_sums(trip_gl_sheet_tf *f)
{
    if (f->sums)
        return TRIP_OK;
    if (!trip_budget_charge(f->budget, SUMS_BYTES))
        return no_memory();
    glCreateBuffers(1, &f->sums);
    glNamedBufferStorage(f->sums, SUMS_BYTES, NULL, GL_DYNAMIC_STORAGE_BIT);
    return TRIP_OK;
}

/* Stores the extinction per voxel length, limited so that products fit a float. Higher values are
 * opaque anyway. */
static void fill_entries(struct trip_gl_sum *sums, const trip_tf_entry *table, double voxel_world)
{
    for (int code = 0; code < CODES; code++) {
        const trip_tf_entry *e = &table[code];
        float *entry = sums[code].entry;
        entry[0] = e->r;
        entry[1] = e->g;
        entry[2] = e->b;
        entry[3] = (float)fmin(1e25, e->extinction * voxel_world);
    }
}

/* Returns the integrals from a code to the next: of extinction times each colour component, and of
 * extinction. */
static void integrate_step(const struct trip_gl_sum *at, double out[4])
{
    const float *a = at[0].entry, *b = at[1].entry;
    for (int i = 0; i < 3; i++)
        out[i] = trip_segment_product(a[3], b[3], a[i], b[i]);
    out[3] = 0.5 * ((double)a[3] + b[3]);
}

static double whole_integral(const struct trip_gl_sum *sums)
{
    double all = 0, step[4];
    for (int code = 0; code < CODES - 1; code++) {
        integrate_step(&sums[code], step);
        all += step[3];
    }
    return all;
}

static void fill_sums(struct trip_gl_sum *sums, double factor)
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
        integrate_step(&sums[code], step);
        for (int i = 0; i < 4; i++)
            sum[i] += (uint64_t)llrint(factor * step[i]);
    }
}

static void set_next_visible(trip_gl_sheet_tf *f, const trip_tf_entry *table)
{
    uint32_t next = CODES;
    for (int code = CODES - 1; code >= 0; code--) {
        next = table[code].extinction > 0 ? (uint32_t)code : next;
        f->next_visible[code] = next;
    }
}

static int set_sums(trip_gl_sheet_tf *f, const trip_tf_entry *table, double voxel_world)
{
    int status = make_sums(f);
    struct trip_gl_sum *sums = status ? NULL : trip_budget_take(f->budget, SUMS_BYTES);
    if (status)
        return status;
    if (!sums)
        return no_memory();
    fill_entries(sums, table, voxel_world);
    double all = whole_integral(sums);
    double factor = all > 0 ? GREATEST / all : 1;
    f->unit = 1 / factor;
    fill_sums(sums, factor);
    glNamedBufferSubData(f->sums, 0, SUMS_BYTES, sums);
    trip_budget_release(f->budget, sums, SUMS_BYTES);
    return TRIP_OK;
}

static void set_closed(trip_gl_sheet_tf *f, const trip_closed_form *form, double voxel_world)
{
    struct trip_gl_closed c = { .scale = (float)form->scale,
                                .offset = (float)form->offset,
                                .ramp = form->ramp };
    for (int i = 0; i < 4; i++)
        c.k[i] = (float)(form->k[i] * voxel_world);
    for (int i = 0; i < 3; i++) {
        c.q0[i] = (float)form->q0[i];
        c.q1[i] = (float)form->q1[i];
    }
    if (!f->closed) {
        glCreateBuffers(1, &f->closed);
        glNamedBufferStorage(f->closed, sizeof c, NULL, GL_DYNAMIC_STORAGE_BIT);
    }
    glNamedBufferSubData(f->closed, 0, sizeof c, &c);
}

static int set_draw_codes(trip_gl_sheet_tf *f, const trip_draw_codes *draw)
{
    if (!f->draw_codes) {
        if (!trip_budget_charge(f->budget, DRAW_CODES_BYTES))
            return no_memory();
        glCreateBuffers(1, &f->draw_codes);
        glNamedBufferStorage(f->draw_codes, DRAW_CODES_BYTES, NULL, GL_DYNAMIC_STORAGE_BIT);
    }
    float *codes = trip_budget_take(f->budget, DRAW_CODES_BYTES);
    if (!codes)
        return no_memory();
    for (unsigned code = 0; code < CODES; code++)
        codes[code] = (float)trip_draw_code_exact(draw, code);
    glNamedBufferSubData(f->draw_codes, 0, DRAW_CODES_BYTES, codes);
    trip_budget_release(f->budget, codes, DRAW_CODES_BYTES);
    return TRIP_OK;
}

int trip_gl_sheet_tf_set(trip_gl_sheet_tf *f, const trip_tf_entry *table,
                         const trip_closed_form *closed, const trip_draw_codes *draw,
                         double voxel_world)
{
    int status = take_next_visible(f);
    if (!status && draw->of_stored)
        status = set_draw_codes(f, draw);
    if (!status && !closed)
        status = set_sums(f, table, voxel_world);
    if (status)
        return status;
    if (closed)
        set_closed(f, closed, voxel_world);
    set_next_visible(f, table);
    return TRIP_OK;
}

void trip_gl_sheet_tf_release(trip_gl_sheet_tf *f)
{
    if (f->sums) {
        glDeleteBuffers(1, &f->sums);
        trip_budget_discharge(f->budget, SUMS_BYTES);
    }
    if (f->draw_codes) {
        glDeleteBuffers(1, &f->draw_codes);
        trip_budget_discharge(f->budget, DRAW_CODES_BYTES);
    }
    if (f->closed)
        glDeleteBuffers(1, &f->closed);
    trip_budget_release(f->budget, f->next_visible, CODES * sizeof *f->next_visible);
    *f = (trip_gl_sheet_tf){ .budget = f->budget };
}
