#include "ssim.h"

#include <math.h>

#include "report.h"

enum { REACH = 5, WINDOW = 2 * REACH + 1 };

/* Gaussian-weighted sums over a window. */
typedef struct moments {
    double a, b, aa, bb, ab;
} moments;

static void make_weights(double weights[WINDOW])
{
    const double sigma = 1.5;
    double sum = 0;
    for (int i = 0; i < WINDOW; i++)
        sum += weights[i] = exp(-(i - REACH) * (i - REACH) / (2 * sigma * sigma));
    for (int i = 0; i < WINDOW; i++)
        weights[i] /= sum;
}

static double luminance(const float *rgba)
{
    return 0.299 * (double)rgba[0] + 0.587 * (double)rgba[1] + 0.114 * (double)rgba[2];
}

/* Sums a row of a window along x. add_column() sums the rows along y. */
static moments add_row(const float *a, const float *b, const double weights[WINDOW])
{
    moments m = { 0 };
    for (int i = 0; i < WINDOW; i++) {
        double x = luminance(a + 4 * i), y = luminance(b + 4 * i), w = weights[i];
        m.a += w * x;
        m.b += w * y;
        m.aa += w * x * x;
        m.bb += w * y * y;
        m.ab += w * x * y;
    }
    return m;
}

static moments add_column(const moments *rows, int stride, const double weights[WINDOW])
{
    moments m = { 0 };
    for (int i = 0; i < WINDOW; i++) {
        const moments *row = &rows[(size_t)i * (size_t)stride];
        m.a += weights[i] * row->a;
        m.b += weights[i] * row->b;
        m.aa += weights[i] * row->aa;
        m.bb += weights[i] * row->bb;
        m.ab += weights[i] * row->ab;
    }
    return m;
}

static double similarity(moments m)
{
    const double c1 = 0.01 * 0.01, c2 = 0.03 * 0.03;
    double aa = m.aa - m.a * m.a, bb = m.bb - m.b * m.b, ab = m.ab - m.a * m.b;
    return (2 * m.a * m.b + c1) * (2 * ab + c2) / ((m.a * m.a + m.b * m.b + c1) * (aa + bb + c2));
}

int accuracy_ssim(const float *a, const float *b, int width, int height, trip_budget *budget,
                  double *out)
{
    double weights[WINDOW], sum = 0;
    int columns = width - 2 * REACH, windows = height - 2 * REACH;
    *out = NAN;
    if (columns < 1 || windows < 1)
        return 0;
    size_t bytes = (size_t)columns * (size_t)height * sizeof(moments);
    moments *rows = trip_budget_take(budget, bytes);
    if (!rows)
        return trip_fail(TRIP_ERROR, "accuracy", "SSIM",
                         "needs %zu bytes, which do not fit the memory; raise --memory", bytes);
    make_weights(weights);
    for (int y = 0; y < height; y++)
        for (int x = 0; x < columns; x++) {
            size_t at = 4 * ((size_t)y * (size_t)width + (size_t)x);
            rows[(size_t)y * (size_t)columns + (size_t)x] = add_row(a + at, b + at, weights);
        }
    for (int y = 0; y < windows; y++)
        for (int x = 0; x < columns; x++)
            sum += similarity(
                add_column(&rows[(size_t)y * (size_t)columns + (size_t)x], columns, weights));
    *out = sum / ((double)columns * windows);
    trip_budget_release(budget, rows, bytes);
    return 0;
}
