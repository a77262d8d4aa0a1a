#include "flip.h"

#include <math.h>

#include "report.h"

enum { CHANNELS = 3, KERNEL_MAX = 64 };

static const double ppd = ACCURACY_FLIP_PIXELS_PER_DEGREE, pi = 3.14159265358979323846;

/* Converts linear RGB with the primaries of sRGB to XYZ. (1, 1, 1) maps to the white point. */
static const double to_xyz[3][3] = { { 0.4124564, 0.3575761, 0.1804375 },
                                     { 0.2126729, 0.7151522, 0.0721750 },
                                     { 0.0193339, 0.1191920, 0.9503041 } };
static const double from_xyz[3][3] = { { 3.2404542, -1.5371385, -0.4985314 },
                                       { -0.9692660, 1.8760108, 0.0415560 },
                                       { 0.0556434, -0.2040259, 1.0572252 } };

/* One picture: YCxCz channels, filtered channels, and features. */
typedef struct picture {
    float *channel[CHANNELS], *seen[CHANNELS], *edges, *points;
} picture;

typedef struct work {
    int width, height;
    size_t pixels;
    picture pictures[2];
    float *rows;
} work;

/* Weights from -reach to +reach. */
typedef struct kernel {
    int reach;
    double weights[2 * KERNEL_MAX + 1];
} kernel;

static double clamp(double x)
{
    return x < 0 ? 0 : x > 1 ? 1 : x;
}

static double to_linear(double x)
{
    return x <= 0.04045 ? x / 12.92 : pow((x + 0.055) / 1.055, 2.4);
}

static void multiply(const double m[3][3], const double v[3], double out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = m[i][0] * v[0] + m[i][1] * v[1] + m[i][2] * v[2];
}

/* Computes X, Y and Z of linear RGB, each relative to the white point. */
static void relative_xyz(const double rgb[3], double out[3])
{
    multiply(to_xyz, rgb, out);
    for (int i = 0; i < 3; i++)
        out[i] /= to_xyz[i][0] + to_xyz[i][1] + to_xyz[i][2];
}

/* Converts to linearised L*a*b*, the space of contrast filtering (section 4.1.1). */
static void rgb_to_ycxcz(const double rgb[3], double out[3])
{
    double r[3];
    relative_xyz(rgb, r);
    out[0] = 116 * r[1] - 16;
    out[1] = 500 * (r[0] - r[1]);
    out[2] = 200 * (r[1] - r[2]);
}

static void ycxcz_to_rgb(const double c[3], double out[3])
{
    double y = (c[0] + 16) / 116, r[3] = { c[1] / 500 + y, y, y - c[2] / 200 };
    for (int i = 0; i < 3; i++)
        r[i] *= to_xyz[i][0] + to_xyz[i][1] + to_xyz[i][2];
    multiply(from_xyz, r, out);
}

static double cube_root_or_line(double t)
{
    const double delta = 6.0 / 29;
    return t > delta * delta * delta ? cbrt(t) : t / (3 * delta * delta) + 4.0 / 29;
}

/* Converts to L*a*b* with the Hunt effect, which scales chromaticness by lightness (equation 3). */
static void rgb_to_hunt_lab(const double rgb[3], double out[3])
{
    double r[3], f[3];
    relative_xyz(rgb, r);
    for (int i = 0; i < 3; i++)
        f[i] = cube_root_or_line(r[i]);
    out[0] = 116 * f[1] - 16;
    out[1] = 0.01 * out[0] * 500 * (f[0] - f[1]);
    out[2] = 0.01 * out[0] * 200 * (f[1] - f[2]);
}

/* Returns the HyAB distance, for colours far apart (equation 4). */
static double hyab(const double a[3], const double b[3])
{
    return fabs(a[0] - b[0]) + hypot(a[1] - b[1], a[2] - b[2]);
}

static int clamp_to(int i, int count)
{
    return i < 0 ? 0 : i >= count ? count - 1 : i;
}

/* Filters with one kernel along x and one along y, times `share`. Adds to `out` if `add` is true,
 * else overwrites it. */
static void filter(const work *w, const float *in, const kernel *x, const kernel *y, double share,
                   bool add, float *out)
{
    for (int j = 0; j < w->height; j++)
        for (int i = 0; i < w->width; i++) {
            const float *row = in + (size_t)j * (size_t)w->width;
            double sum = 0;
            for (int k = -x->reach; k <= x->reach; k++)
                sum += x->weights[k + x->reach] * (double)row[clamp_to(i + k, w->width)];
            w->rows[(size_t)j * (size_t)w->width + (size_t)i] = (float)sum;
        }
    for (int j = 0; j < w->height; j++)
        for (int i = 0; i < w->width; i++) {
            size_t at = (size_t)j * (size_t)w->width + (size_t)i;
            double sum = 0;
            for (int k = -y->reach; k <= y->reach; k++)
                sum +=
                    y->weights[k + y->reach] *
                    (double)
                        w->rows[(size_t)clamp_to(j + k, w->height) * (size_t)w->width + (size_t)i];
            out[at] = (float)(share * sum + (add ? (double)out[at] : 0));
        }
}

/* Contrast sensitivity of a channel as a sum of two Gaussians (equation 1 and table 1). */
typedef struct sensitivity {
    double a[2], b[2];
} sensitivity;

static const sensitivity sensitivities[CHANNELS] = { { { 1, 0 }, { 0.0047, 1e-5 } },
                                                     { { 1, 0 }, { 0.0053, 1e-5 } },
                                                     { { 34.1, 13.5 }, { 0.04, 0.025 } } };

/* Makes a normalised Gaussian with the reach of the widest one. Returns the sum of the weights
 * before normalisation. */
static double make_gaussian(kernel *k, double b)
{
    double sum = 0;
    k->reach = (int)ceil(3 * sqrt(sensitivities[2].b[0] / (2 * pi * pi)) * ppd);
    for (int i = -k->reach; i <= k->reach; i++)
        sum += k->weights[i + k->reach] = exp(-pi * pi * (i / ppd) * (i / ppd) / b);
    for (int i = 0; i <= 2 * k->reach; i++)
        k->weights[i] /= sum;
    return sum;
}

static void filter_contrast(const work *w, picture *p)
{
    for (int c = 0; c < CHANNELS; c++) {
        kernel k[2];
        double weight[2], sum = 0;
        for (int g = 0; g < 2; g++) {
            double width = make_gaussian(&k[g], sensitivities[c].b[g]);
            weight[g] = sensitivities[c].a[g] * sqrt(pi / sensitivities[c].b[g]) * width * width;
            sum += weight[g];
        }
        for (int g = 0; g < 2; g++)
            if (weight[g] > 0)
                filter(w, p->channel[c], &k[g], &k[g], weight[g] / sum, g > 0, p->seen[c]);
    }
}

/* Makes a Gaussian and its first or second derivative. The positive and the negative weights of the
 * derivative each sum to 1 (section 4.2). */
static void make_feature(kernel *along, kernel *across, bool points)
{
    const double sigma = 0.5 * 0.082 * ppd;
    double positive = 0, negative = 0, sum = 0;
    along->reach = across->reach = (int)ceil(3 * sigma);
    for (int i = -along->reach; i <= along->reach; i++) {
        double g = exp(-i * i / (2 * sigma * sigma));
        double d = g * (points ? i * i / (sigma * sigma) - 1 : -i);
        across->weights[i + across->reach] = g;
        along->weights[i + along->reach] = d;
        sum += g;
        *(d > 0 ? &positive : &negative) += fabs(d);
    }
    for (int i = 0; i <= 2 * along->reach; i++) {
        across->weights[i] /= sum;
        along->weights[i] /= along->weights[i] > 0 ? positive : negative;
    }
}

/* Computes the length of the feature vector, from edges or points along x and y. `spare` is
 * overwritten. */
static void find_features(const work *w, const float *light, bool points, float *spare, float *out)
{
    kernel along, across;
    make_feature(&along, &across, points);
    filter(w, light, &along, &across, 1, false, out);
    filter(w, light, &across, &along, 1, false, spare);
    for (size_t i = 0; i < w->pixels; i++)
        out[i] = hypotf(out[i], spare[i]);
}

/* Converts colours to YCxCz, and leaves the luminance, 0 to 1, in seen[0]. */
static void convert(const work *w, const float *rgba, picture *p)
{
    for (size_t i = 0; i < w->pixels; i++) {
        double rgb[3], c[3];
        for (int k = 0; k < 3; k++)
            rgb[k] = to_linear(clamp((double)rgba[4 * i + (size_t)k]));
        rgb_to_ycxcz(rgb, c);
        for (int k = 0; k < 3; k++)
            p->channel[k][i] = (float)c[k];
        p->seen[0][i] = (float)((c[0] + 16) / 116);
    }
}

static void look_at(const work *w, const float *rgba, picture *p)
{
    convert(w, rgba, p);
    find_features(w, p->seen[0], false, p->seen[1], p->edges);
    find_features(w, p->seen[0], true, p->seen[1], p->points);
    filter_contrast(w, p);
}

static void colour_seen(const picture *p, size_t i, double lab[3])
{
    double c[3], rgb[3];
    for (int k = 0; k < 3; k++)
        c[k] = (double)p->seen[k][i];
    ycxcz_to_rgb(c, rgb);
    for (int k = 0; k < 3; k++)
        rgb[k] = clamp(rgb[k]);
    rgb_to_hunt_lab(rgb, lab);
}

/* Returns the distance between green and blue, the maximum for colours. */
static double max_apart(void)
{
    double green[3], blue[3];
    rgb_to_hunt_lab((double[3]){ 0, 1, 0 }, green);
    rgb_to_hunt_lab((double[3]){ 0, 0, 1 }, blue);
    return pow(hyab(green, blue), 0.7);
}

/* Maps colour distances to 0 to 1. Small distances get the larger part of this range (equation
 * 5). */
static double colour_error(double apart, double max)
{
    const double pc = 0.4, pt = 0.95;
    double e = pow(apart, 0.7), knee = pc * max;
    return e < knee ? pt * e / knee : pt + (e - knee) / (max - knee) * (1 - pt);
}

/* Returns the FLIP error of a pixel (equations 6 and 7). */
static double error_at(const work *w, size_t i, double max)
{
    const picture *a = &w->pictures[0], *b = &w->pictures[1];
    double x[3], y[3];
    colour_seen(a, i, x);
    colour_seen(b, i, y);
    double colour = colour_error(hyab(x, y), max);
    double feature = fmax(fabs((double)a->edges[i] - (double)b->edges[i]),
                          fabs((double)a->points[i] - (double)b->points[i]));
    return pow(colour, 1 - sqrt(feature / sqrt(2)));
}

static void lay_out(work *w, float *memory)
{
    for (int p = 0; p < 2; p++) {
        for (int c = 0; c < CHANNELS; c++, memory += 2 * w->pixels) {
            w->pictures[p].channel[c] = memory;
            w->pictures[p].seen[c] = memory + w->pixels;
        }
        w->pictures[p].edges = memory;
        w->pictures[p].points = memory + w->pixels;
        memory += 2 * w->pixels;
    }
    w->rows = memory;
}

int accuracy_flip(const float *a, const float *b, int width, int height, trip_budget *budget,
                  double *out)
{
    work w = { .width = width, .height = height, .pixels = (size_t)width * (size_t)height };
    size_t bytes = (2 * (2 * CHANNELS + 2) + 1) * w.pixels * sizeof(float);
    float *memory = trip_budget_take(budget, bytes);
    if (!memory)
        return trip_fail(TRIP_ERROR, "accuracy", "FLIP",
                         "needs %zu bytes, which do not fit the memory; raise --memory", bytes);
    lay_out(&w, memory);
    look_at(&w, a, &w.pictures[0]);
    look_at(&w, b, &w.pictures[1]);
    double sum = 0, max = max_apart();
    for (size_t i = 0; i < w.pixels; i++)
        sum += error_at(&w, i, max);
    *out = sum / (double)w.pixels;
    trip_budget_release(budget, memory, bytes);
    return 0;
}
