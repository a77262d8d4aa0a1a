#include "porous.h"

#include <stdint.h>

#include "clones.h"
#include "geometry.h"

#define PI 3.14159265358979323846

enum { WAVES = 24, SPAN = 256 };

/* The sum has the variance 1. It exceeds the threshold in 22 % of the volume. */
static const double threshold = 0.772193214;
static const double waves_per_unit = 3; /* of the cube [-1, 1]^3, for detail 1 */

/* The waves along one row: c and s are cosine and sine at the present voxel, c1 and s1 at the
 * voxel before it. Both follow cos(a + b) = 2 cos(a) cos(b) - cos(a - b). */
typedef struct row_waves {
    double kx[WAVES], ky[WAVES], kz[WAVES]; /* radians per voxel */
    double phase[WAVES];                    /* at voxel 0 of the row */
    double twice[WAVES];                    /* 2 cos(kx) */
    double c[WAVES], s[WAVES], c1[WAVES], s1[WAVES];
} row_waves;

static double fraction(double x)
{
    return x - floor(x);
}

/* The directions are a Fibonacci spiral over half a sphere. Wave numbers lie between 0.6 and 1.4
 * of the mean. */
static void waves_start(row_waves *w, const long dims[3], double detail, long y, long z)
{
    long longest = 2;
    for (int a = 0; a < 3; a++)
        longest = dims[a] > longest ? dims[a] : longest;
    const double k = 2 * PI * waves_per_unit * detail * 2 / (double)(longest - 1);
    for (int n = 0; n < WAVES; n++) {
        double along = (n + 0.5) / WAVES, around = 2 * PI * fraction(n * 0.61803398875);
        double across = sqrt(1 - along * along),
               length = k * (0.6 + 0.8 * fraction(n * 0.7548776662));
        w->kx[n] = length * across * cos(around);
        w->ky[n] = length * across * sin(around);
        w->kz[n] = length * along;
        w->phase[n] = 2 * PI * fraction((n + 1) * 0.5698402910) -
                      w->kx[n] * (double)(dims[0] - 1) / 2 +
                      w->ky[n] * ((double)y - (double)(dims[1] - 1) / 2) +
                      w->kz[n] * ((double)z - (double)(dims[2] - 1) / 2);
        w->twice[n] = 2 * cos(w->kx[n]);
    }
}

static void waves_at(row_waves *w, long x)
{
    for (int n = 0; n < WAVES; n++) {
        double at = w->phase[n] + w->kx[n] * (double)x;
        w->c[n] = cos(at);
        w->s[n] = sin(at);
        w->c1[n] = cos(at - w->kx[n]);
        w->s1[n] = sin(at - w->kx[n]);
    }
}

static inline double waves_sum(const row_waves *w)
{
    double sum = 0;
    for (int n = 0; n < WAVES; n++)
        sum += w->c[n];
    return sum * sqrt(2.0 / WAVES);
}

static inline void waves_step(row_waves *w)
{
    for (int n = 0; n < WAVES; n++) {
        double c = w->twice[n] * w->c[n] - w->c1[n], s = w->twice[n] * w->s[n] - w->s1[n];
        w->c1[n] = w->c[n];
        w->s1[n] = w->s[n];
        w->c[n] = c;
        w->s[n] = s;
    }
}

/* Returns the length of the gradient of the sum, per voxel. */
static double slope(const row_waves *w)
{
    double x = 0, y = 0, z = 0;
    for (int n = 0; n < WAVES; n++) {
        x += w->kx[n] * w->s[n];
        y += w->ky[n] * w->s[n];
        z += w->kz[n] * w->s[n];
    }
    return sqrt((x * x + y * y + z * z) * 2 / WAVES);
}

/* Returns the share of solid in a voxel. A voxel at distance d from the boundary has the share
 * 0.5 + d. The distance is the height above the threshold over the slope. */
static double solid_share(const row_waves *w, double steepest)
{
    double above = waves_sum(w) - threshold;
    if (fabs(above) >= 0.5 * steepest)
        return above > 0;
    double share = 0.5 + above / fmax(slope(w), 1e-9);
    return share < 0 ? 0 : share > 1 ? 1 : share;
}

/* The finalizer of splitmix64 (Steele, Lea & Flood 2014). */
static uint64_t scramble(uint64_t h)
{
    h = (h ^ h >> 30) * 0xbf58476d1ce4e5b9u;
    h = (h ^ h >> 27) * 0x94d049bb133111ebu;
    return h ^ h >> 31;
}

/* Returns a number with the standard normal distribution for a voxel (Box & Muller 1958). Two
 * neighbours along X share a radius and an angle. */
static float noise(long x, long y, long z)
{
    uint64_t pair = (uint64_t)x >> 1;
    uint64_t h =
        scramble(scramble((uint64_t)z << 32 | (uint64_t)y) + (pair + 1) * 0x9e3779b97f4a7c15u);
    float uniform = ((float)(h >> 40) + 0.5f) * 0x1p-24f;
    float angle = (float)(h & 0xffffff) * (float)(2 * PI * 0x1p-24);
    return sqrtf(-2 * logf(uniform)) * (x & 1 ? sinf(angle) : cosf(angle));
}

TRIP_ALSO_V3
static void span(row_waves *w, double steepest, long count, float *values)
{
    for (long i = 0; i < count; i++, waves_step(w))
        values[i] = (float)solid_share(w, steepest);
}

void trip_porous_row(const long dims[3], double detail, long x, long y, long z, long count,
                     float *values)
{
    row_waves w;
    waves_start(&w, dims, detail, y, z);
    double steepest = 0;
    for (int n = 0; n < WAVES; n++)
        steepest += sqrt(w.kx[n] * w.kx[n] + w.ky[n] * w.ky[n] + w.kz[n] * w.kz[n]);
    steepest *= sqrt(2.0 / WAVES);
    float share[SPAN];
    for (long done = 0; done < count;) {
        /* Every multiple of SPAN begins anew, so rounding does not depend on the call. */
        long at = x + done, before = at % SPAN, n = SPAN - before;
        n = n < count - done ? n : count - done;
        waves_at(&w, at - before);
        span(&w, steepest, before + n, share);
        for (long i = 0; i < n; i++) {
            float v = TRIP_POROUS_PORE +
                      (TRIP_POROUS_SOLID - TRIP_POROUS_PORE) * share[before + i] +
                      TRIP_POROUS_NOISE * noise(at + i, y, z);
            values[done + i] = v < 0 ? 0 : v > TRIP_POROUS_MAX ? TRIP_POROUS_MAX : v;
        }
        done += n;
    }
}
