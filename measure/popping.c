#include "popping.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "plot.h"
#include "report.h"
#include "table.h"

const measure_popping_setting measure_popping_settings[MEASURE_POPPING_SETTINGS] = {
    { "merge, h 0", "0", TRIPTYCH_METHOD_MERGE, 0 },
    { "merge, h 0.5", "0.5", TRIPTYCH_METHOD_MERGE, 0.5 },
    { "merge, h 0.85", "0.85", TRIPTYCH_METHOD_MERGE, 0.85 },
    { "merge, h 0.95", "0.95", TRIPTYCH_METHOD_MERGE, 0.95 },
    { "merge, h 0.99", "0.99", TRIPTYCH_METHOD_MERGE, 0.99 },
    { "clip", "clip", TRIPTYCH_METHOD_CLIP, 0 },
    { "axis", "axis", TRIPTYCH_METHOD_AXIS, 0 },
    { "image", "image", TRIPTYCH_METHOD_IMAGE, 0 },
};

enum { STEPS = MEASURE_POPPING_STEPS, MERGES = 5 };

/* Changes of every pixel in every step. */
typedef struct changes {
    size_t pixels;
    float (*of)[STEPS]; /* of each pixel */
    float *before;      /* picture of the previous step */
    float *sorted;      /* scratch memory for the changes of a step */
} changes;

size_t measure_popping_bytes(size_t pixels)
{
    const changes *p = NULL;
    return pixels * (4 * sizeof *p->before + sizeof *p->of + sizeof *p->sorted);
}

static int ascending(const void *a, const void *b)
{
    float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

/* Returns the maximum change over the components. */
static float change_of(const float a[4], const float b[4])
{
    float max = 0;
    for (int c = 0; c < 4; c++)
        max = fmaxf(max, fabsf(a[c] - b[c]));
    return max;
}

/* Adds the picture of a step, from 0 to STEPS in this order. */
static void add_picture(changes *p, int step, const float *rgba)
{
    for (size_t i = 0; i < p->pixels && step > 0; i++)
        p->of[i][step - 1] = change_of(&rgba[4 * i], &p->before[4 * i]);
    memcpy(p->before, rgba, 4 * p->pixels * sizeof *p->before);
}

/* Subtracts the motion from the changes, and moves the pixels that change to the front. Returns
 * their number; *mean is the mean motion. */
static size_t take_motion(changes *p, double *mean)
{
    size_t kept = 0;
    double sum = 0;
    for (size_t n = 0; n < p->pixels; n++) {
        float sorted[STEPS];
        memcpy(sorted, p->of[n], sizeof sorted);
        qsort(sorted, STEPS, sizeof *sorted, ascending);
        if (!(sorted[STEPS - 1] > 0))
            continue;
        float motion = sorted[STEPS / 2];
        for (int i = 0; i < STEPS; i++)
            p->of[kept][i] = fmaxf(0, p->of[n][i] - motion);
        sum += (double)motion;
        kept++;
    }
    *mean = kept ? sum / (double)kept : 0;
    return kept;
}

/* Adds the row of a setting after all its pictures. Overwrites the changes. */
static void add_row(changes *p, const char *name, cJSON *rows)
{
    double mean = 0, percentile_99 = 0, max = 0, motion;
    const size_t count = take_motion(p, &motion);
    for (int i = 0; i < STEPS && count > 0; i++) {
        double sum = 0;
        for (size_t n = 0; n < count; n++)
            sum += (double)(p->sorted[n] = p->of[n][i]);
        qsort(p->sorted, count, sizeof *p->sorted, ascending);
        mean = fmax(mean, 255 * sum / (double)count);
        max = fmax(max, 255 * (double)p->sorted[count - 1]);
        percentile_99 = fmax(percentile_99, 255 * (double)p->sorted[(count - 1) * 99 / 100]);
    }
    cJSON *row = measure_new_row(rows);
    cJSON_AddStringToObject(row, "settings", name);
    measure_add(row, { "mean", mean }, { "percentile_99", percentile_99 }, { "max", max },
                { "motion", 255 * motion });
}

int measure_popping_all(measure_popping_draw *draw, void *user, const float *rgba, size_t pixels,
                        void *memory, int count, cJSON *rows)
{
    changes p = { .pixels = pixels, .of = memory };
    int status = 0;
    p.before = (float *)(p.of + pixels);
    p.sorted = p.before + 4 * pixels;
    for (int i = 0; i < count && !status; i++) {
        const measure_popping_setting *one = &measure_popping_settings[i];
        for (int step = 0; step <= STEPS && !status; step++) {
            status = draw(user, one, 45 + MEASURE_POPPING_DEGREES * (step - 0.5 * STEPS));
            if (!status)
                add_picture(&p, step, rgba);
        }
        if (!status)
            add_row(&p, one->name, rows);
    }
    return status;
}

char *measure_popping_svg(const cJSON *rows)
{
    static const measure_curve curves[] = { { "max", "max", "#b03020" },
                                            { "percentile_99", "99 %", "#c08010" },
                                            { "mean", "mean", "#2050b0" },
                                            { "motion", "motion", "#777" } };
    const char *names[MEASURE_POPPING_SETTINGS];
    for (int i = 0; i < MEASURE_POPPING_SETTINGS; i++)
        names[i] = measure_popping_settings[i].label;
    const measure_plot plot = { .width = 620,
                                .height = 380,
                                .x_title = "merge by h, then the other methods",
                                .y_title = "change beyond the motion, of 255",
                                .names = names,
                                .name_count = cJSON_GetArraySize(rows),
                                .y_min = 0.01 };
    return measure_plot_rows(&plot, rows, curves, sizeof curves / sizeof *curves, MERGES);
}
