/* bench ewa: measures the error of the local affine approximation of EWA volume splatting. It
 * compares single splats with the exact form, by the angle from the axis of view and the distance
 * from the eye. It also measures the change of whole pictures and of their times. */
#include "bench_tables.h"

#include <math.h>
#include <stdlib.h>

#include "bench_context.h"
#include "error.h"
#include "report.h"
#include "splat.h"
#include "median.h"

#define PI 3.14159265358979323846

/* ---- one splat ---- */

static const double angles[] = { 0, 10, 20, 30, 45, 60 };
static const double distances[] = { 3, 4, 6, 10, 20, 50, 100 }; /* in kernel radii */
enum {
    ANGLES = sizeof angles / sizeof *angles,
    DISTANCES = sizeof distances / sizeof *distances,
    SAMPLES = 400, /* sample positions along each side of a support */
};

/* Differences of optical depth over the image plane. max is the maximum as a share of the peak,
 * mean is the mean as a share of the mean depth, and sum is the relative error of the sum. */
typedef struct deviation {
    double max, mean, sum;
    bool affine;
} deviation;

static double depth_at(const trip_splat_frame *f, const trip_splat *s, double x, double y)
{
    double m = trip_splat_radius2(f, s, x, y);
    double stretch = s->affine ? 1 : trip_splat_stretch(f, x, y);
    return m > f->cutoff2 ? 0 : stretch * s->amplitude * (exp(-m / 2) - f->edge);
}

static deviation compare_splats(const trip_splat_frame *exact, const trip_splat *a,
                                const trip_splat_frame *ewa, const trip_splat *b)
{
    double x0 = fmin(a->x0, b->x0), x1 = fmax(a->x1, b->x1), y0 = fmin(a->y0, b->y0);
    double y1 = fmax(a->y1, b->y1), peak = 0, max = 0, apart = 0, sum = 0, truth = 0;
    for (int i = 0; i < SAMPLES; i++)
        for (int j = 0; j < SAMPLES; j++) {
            double x = x0 + (x1 - x0) * (i + 0.5) / SAMPLES;
            double y = y0 + (y1 - y0) * (j + 0.5) / SAMPLES;
            double is = depth_at(ewa, b, x, y), should = depth_at(exact, a, x, y);
            peak = fmax(peak, should);
            max = fmax(max, fabs(is - should));
            apart += fabs(is - should);
            sum += is;
            truth += should;
        }
    return (deviation){ max / peak, apart / truth, sum / truth - 1, true };
}

/* Compares a splat of cubic voxels at a distance in kernel radii and at an angle from the axis of
 * view, without low-pass filter. */
static int measure_splat(double angle_degrees, double distance, deviation *out)
{
    const trip_affine cubes = trip_affine_identity();
    const double angle = angle_degrees * PI / 180;
    trip_settings s = trip_settings_default();
    const trip_camera_params view = {
        .look = { 0, 0, 1 }, .up = { 0, 1, 0 }, .fov_degrees = 160, .width = 1000, .height = 1000
    };
    trip_camera camera;
    int status = trip_camera_make(&camera, &view, &cubes);
    if (status)
        return status;
    s.low_pass = TRIP_LOW_PASS_NONE;
    trip_splat_frame exact = trip_splat_frame_make(&camera, &s);
    s.footprint = TRIP_FOOTPRINT_EWA;
    trip_splat_frame ewa = trip_splat_frame_make(&camera, &s);
    trip_vec3 at =
        trip_scale(trip_v3(sin(angle), 0, cos(angle)), distance * TRIP_KERNEL_RADIUS_VOXELS);
    trip_splat a, b;
    bool drawn = trip_splat_project(&exact, at, &a) && trip_splat_project(&ewa, at, &b);
    *out = (deviation){ 0 };
    if (drawn && b.affine)
        *out = compare_splats(&exact, &a, &ewa, &b);
    return 0;
}

static const measure_column splat_columns[] = {
    { "angle", "degrees", 0, 0 },
    { "distance", "kernel radii", 0, 0 },
    { "max", "maximum, % of peak", 2, 0 },
    { "mean", "mean, %", 2, 0 },
    { "sum", "sum, %", 2, 0 },
};

static int measure_splats(bench_report *r)
{
    cJSON *rows = bench_report_table(
        r, "splats", "Optical depth of an affine splat, compared with the exact form",
        splat_columns);
    for (int i = 0; i < ANGLES; i++)
        for (int k = 0; k < DISTANCES; k++) {
            deviation d;
            int status = measure_splat(angles[i], distances[k], &d);
            if (status)
                return status;
            cJSON *row = measure_new_row(rows);
            measure_add(row, { "angle", angles[i] }, { "distance", distances[k] });
            if (d.affine) {
                measure_add(row, { "max", 100 * d.max }, { "mean", 100 * d.mean },
                            { "sum", 100 * d.sum });
            }
        }
    return 0;
}

/* ---- pictures ---- */

static const double fields_of_view[] = { 10, 30, 60, 90, 120 };
enum { FIELDS = sizeof fields_of_view / sizeof *fields_of_view };

static const measure_column picture_columns[] = {
    { "fov", "field of view, degrees", 0, 0 }, { "mean", "mean of 255", 3, 0 },
    { "percentile_99", "99 %", 3, 0 },         { "max", "max", 2, 0 },
    { "exact_ms", "exact: median ms", 1, 0 },  { "ewa_ms", "ewa", 1, 0 },
    { "ratio", "ewa / exact", 3, 0 },
};

/* One view, drawn alternately by the exact form and by EWA. */
typedef struct pair {
    const bench_options *options;
    bench_context context;
    float *pictures[2];
    double *ms[2];
} pair;

static int take_turns(pair *p)
{
    int status = 0;
    for (int i = -1; i < p->options->repeat && !status; i++)
        for (int ewa = 0; ewa < 2 && !status; ewa++) {
            double ms;
            p->context.settings.splat.footprint =
                ewa ? TRIPTYCH_FOOTPRINT_EWA : TRIPTYCH_FOOTPRINT_EXACT;
            status = bench_context_draw(&p->context, 0, 1, p->pictures[ewa], &ms);
            if (i >= 0)
                p->ms[ewa][i] = ms;
        }
    return status;
}

static int measure_view(pair *p, double fov, cJSON *rows)
{
    const int *size = p->options->sizes[0];
    const triptych_view view = { .width = size[0], .height = size[1], .fov_degrees = fov };
    measure_error *error = calloc(1, sizeof *error);
    triptych_camera camera;
    int status = error ? bench_context_find(&p->context, &view, &camera)
                       : trip_fail(TRIP_ERROR, "bench", "ewa", "out of memory");
    if (!status)
        status = take_turns(p);
    if (!status) {
        measure_error_add(error, p->pictures[1], p->pictures[0], (size_t)size[0] * (size_t)size[1]);
        const measure_error_figures figures = measure_error_measure(error);
        double exact = measure_median(p->ms[0], p->options->repeat);
        double ewa = measure_median(p->ms[1], p->options->repeat);
        cJSON *row = measure_new_row(rows);
        measure_add(row, { "fov", fov }, { "mean", figures.mean },
                    { "percentile_99", figures.percentile_99 }, { "max", figures.max },
                    { "exact_ms", exact }, { "ewa_ms", ewa }, { "ratio", ewa / exact });
    }
    free(error);
    return status;
}

static int measure_pictures(pair *p, bench_report *r)
{
    const int *size = p->options->sizes[0];
    int status = 0;
    for (int i = 0; i < 2 && !status; i++) {
        p->ms[i] = calloc((size_t)p->options->repeat, sizeof *p->ms[i]);
        status = p->ms[i] ? bench_context_picture(&p->context, size[0], size[1], &p->pictures[i])
                          : trip_fail(TRIP_ERROR, "bench", "ewa", "out of memory");
    }
    if (status)
        return status;
    cJSON *rows = bench_report_table(
        r, "pictures",
        "Whole pictures by EWA, compared with the exact form; the object has the same size in each",
        picture_columns);
    for (int i = 0; i < FIELDS && !status; i++)
        status = measure_view(p, fields_of_view[i], rows);
    return status;
}

static void add_limits(bench_report *r)
{
    bench_report_limit(r,
                       "-: too near for the affine map; --kernel ewa draws the exact form there.");
    bench_report_limit(
        r,
        "Splats are of cubic voxels without low-pass filter, with %d x %d sample positions in the "
        "support. Maximum and mean are of the differences; sum is the excess of the splat's total.",
        SAMPLES, SAMPLES);
    bench_report_limit(r, "Picture errors are over the channels of covered pixels. The two forms "
                          "are drawn alternately.");
}

int bench_ewa(const session *s, const bench_options *o, bench_report *r)
{
    pair p = { .options = o };
    (void)s;
    measure_progress_expect(o->progress, FIELDS * 2 * (1 + o->repeat));
    int status = measure_splats(r);
    if (!status)
        status = bench_context_open(&p.context, o->input, o);
    if (!status)
        status = measure_pictures(&p, r);
    if (!status)
        add_limits(r);
    for (int i = 0; i < 2; i++)
        free(p.ms[i]);
    bench_context_close(&p.context);
    return status;
}
