#include "fields.h"

#include <stdint.h>
#include <string.h>

#define PI 3.14159265358979323846

static void set_gradient(trip_vec3 *gradient, trip_vec3 g)
{
    if (gradient)
        *gradient = g;
}

/* Marschner & Lobb, An evaluation of reconstruction filters for volume rendering (1994), with f_M =
 * 6 and alpha = 0.25. At 40 samples the largest part of its energy lies just below the Nyquist
 * frequency. */
static double marschner_lobb(trip_vec3 p, double detail, trip_vec3 *gradient)
{
    const double alpha = 0.25, f = 6 * detail, norm = 2 * (1 + alpha);
    double r = sqrt(p.x * p.x + p.y * p.y);
    double phase = 2 * PI * f * cos(PI * r / 2);
    double slope = alpha * sin(phase) * 2 * PI * f * sin(PI * r / 2) * PI / 2 / norm;
    double over_r = r > 0 ? slope / r : 0;
    set_gradient(gradient, trip_v3(over_r * p.x, over_r * p.y, -PI / 2 * cos(PI * p.z / 2) / norm));
    return (1 - sin(PI * p.z / 2) + alpha * (1 + cos(phase))) / norm;
}

/* Concentric shells that fade out towards the unit sphere; zero beyond it. */
static double shells(trip_vec3 p, double detail, trip_vec3 *gradient)
{
    double r2 = trip_dot(p, p), r = sqrt(r2);
    set_gradient(gradient, trip_v3(0, 0, 0));
    if (r2 >= 1)
        return 0;
    double k = 2 * PI * 4 * detail, fade = (1 - r2) * (1 - r2);
    double wave = 0.5 * (1 + cos(k * r));
    double slope = -0.5 * k * sin(k * r) * fade - 4 * r * (1 - r2) * wave;
    set_gradient(gradient, trip_scale(p, r > 0 ? slope / r : 0));
    return wave * fade;
}

/* A sparse network of filaments, near the curves where a gyroid and a Schwarz P surface intersect.
 */
static double filaments(trip_vec3 p, double detail, trip_vec3 *gradient)
{
    const double thickness2 = 0.02;
    double k = 2 * PI * 2 * detail;
    double sx = sin(k * p.x), cx = cos(k * p.x);
    double sy = sin(k * p.y), cy = cos(k * p.y);
    double sz = sin(k * p.z), cz = cos(k * p.z);
    double gyroid = sx * cy + sy * cz + sz * cx, schwarz = cx + cy + cz;
    double inside = 1 - (gyroid * gyroid + schwarz * schwarz) / thickness2;
    set_gradient(gradient, trip_v3(0, 0, 0));
    if (inside <= 0)
        return 0;
    trip_vec3 dg = { cx * cy - sz * sx, cy * cz - sx * sy, cz * cx - sy * sz };
    trip_vec3 ds = { -sx, -sy, -sz };
    trip_vec3 sum = trip_add(trip_scale(dg, gyroid), trip_scale(ds, schwarz));
    set_gradient(gradient, trip_scale(sum, -4 * k * inside / thickness2));
    return inside * inside;
}

static uint32_t hash3(int32_t x, int32_t y, int32_t z)
{
    uint32_t h = (uint32_t)x * 0x8da6b343u ^ (uint32_t)y * 0xd8163841u ^ (uint32_t)z * 0xcb1ab31fu;
    h = (h ^ h >> 16) * 0x7feb352du;
    h = (h ^ h >> 15) * 0x846ca68bu;
    return h ^ h >> 16;
}

/* Value noise in [-1, 1] with quintic interpolation, twice continuously differentiable. */
static double value_noise(trip_vec3 p, trip_vec3 *gradient)
{
    double c[3] = { p.x, p.y, p.z }, w[3], dw[3];
    int32_t i[3];
    for (int a = 0; a < 3; a++) {
        double whole = floor(c[a]), t = c[a] - whole;
        i[a] = (int32_t)whole;
        w[a] = t * t * t * (t * (t * 6 - 15) + 10);
        dw[a] = 30 * t * t * (t - 1) * (t - 1);
    }
    double value = 0, g[3] = { 0, 0, 0 };
    for (int corner = 0; corner < 8; corner++) {
        int o[3] = { corner & 1, corner >> 1 & 1, corner >> 2 };
        double v = hash3(i[0] + o[0], i[1] + o[1], i[2] + o[2]) / 2147483647.5 - 1;
        double f[3], df[3];
        for (int a = 0; a < 3; a++) {
            f[a] = o[a] ? w[a] : 1 - w[a];
            df[a] = o[a] ? dw[a] : -dw[a];
        }
        value += v * f[0] * f[1] * f[2];
        g[0] += v * df[0] * f[1] * f[2];
        g[1] += v * f[0] * df[1] * f[2];
        g[2] += v * f[0] * f[1] * df[2];
    }
    *gradient = trip_v3(g[0], g[1], g[2]);
    return value;
}

/* A fractal cloud: five octaves of value noise above a threshold, squared for a smooth edge. */
static double cloud(trip_vec3 p, double detail, trip_vec3 *gradient)
{
    const double threshold = 0.05, top = 1.9375; /* sum of the octaves' amplitudes */
    double sum = 0, amplitude = 1, frequency = 3 * detail;
    trip_vec3 slope = { 0, 0, 0 };
    for (int octave = 0; octave < 5; octave++) {
        trip_vec3 g;
        sum += amplitude * value_noise(trip_scale(p, frequency), &g);
        slope = trip_add(slope, trip_scale(g, amplitude * frequency));
        amplitude *= 0.5;
        frequency *= 2;
    }
    double above = (sum - threshold) / (top - threshold);
    set_gradient(gradient,
                 above > 0 ? trip_scale(slope, 2 * above / (top - threshold)) : trip_v3(0, 0, 0));
    return above > 0 ? above * above : 0;
}

const trip_field trip_fields[] = {
    { "marschner-lobb", "the test signal of Marschner and Lobb (1994), dense", marschner_lobb },
    { "cloud", "fractal cloud, about half empty", cloud },
    { "shells", "concentric shells in a sphere", shells },
    { "filaments", "sparse network of thin filaments, almost all empty", filaments },
    { NULL, NULL, NULL },
};

const trip_field *trip_field_find(const char *name)
{
    for (const trip_field *f = trip_fields; f->name; f++)
        if (strcmp(f->name, name) == 0)
            return f;
    return NULL;
}
