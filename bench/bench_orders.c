/* bench orders: compares the methods of ordering splats by three lists, in splats and time, with
 * Tables 1 and 2 of Hofsetz & Max 2005. */
#include "bench_tables.h"

#include <string.h>

#include "bench_view.h"
#include "report.h"

enum { METHODS = 6, AXIS = 4, IN_PAPER = 5, VIEWS = 2 };

static const struct {
    const char *name;
    trip_method method;
    double h; /* of merge */
} methods[METHODS] = {
    { "merge, h = 0.00", TRIP_METHOD_MERGE, 0.00 },
    { "merge, h = 0.85", TRIP_METHOD_MERGE, 0.85 },
    { "merge, h = 0.95", TRIP_METHOD_MERGE, 0.95 },
    { "clip", TRIP_METHOD_CLIP, 0 },
    { "axis", TRIP_METHOD_AXIS, 0 },
    { "image", TRIP_METHOD_IMAGE, 0 }, /* only for renderers that implement it */
};

/* Results for the Foot in Hofsetz & Max 2005, by view and method. The columns are splats, and
 * frames per second: from one list of all voxels ("normal"), and from a list for each axis with
 * the visible voxels alone ("optimized"). */
#define PAPER_VALID_VOXELS 897229.0
static const struct {
    double splats, normal_fps, fps;
} paper[VIEWS][IN_PAPER] = {
    /* Table 1: all three lists. */
    { { 2691697, 0.790, 0.889 },
      { 1559188, 1.016, 1.307 },
      { 1148354, 1.143, 1.488 },
      { 956507, 1.208, 1.600 },
      { 897229, 2.062, 2.667 } },
    /* Table 2: image plane parallel to X-Y, one list. */
    { { 897229, 0.970, 1.185 },
      { 897229, 1.333, 1.730 },
      { 897229, 1.333, 1.730 },
      { 897229, 1.333, 1.730 },
      { 897229, 2.208, 2.667 } },
};

static const struct {
    const char *key, *title;
    trip_camera_params (*view)(const session *s, const int size[2]);
} views[VIEWS] = {
    { "oblique", "Oblique: perspective, 30 degrees, along the diagonal of the grid (2005, Table 1)",
      bench_view_oblique },
    { "lateral", "Lateral: parallel, image plane parallel to X-Y (2005, Table 2)",
      bench_view_lateral },
};

static const measure_column columns[] = {
    { "method", "method", 0, 0 },
    { "splats_drawn", "splats drawn", 0, 0 },
    { "multiple", "x kept", 3, 0 },
    { "read", "read x kept", 3, 0 },
    { "ms", "median ms", 1, 0 },
    { "speed", "speed", 3, 0 },
    { "bound_by", "largest part", 0, 0 },
    { "normal_read", "normal: read x kept", 3, 0 },
    { "normal_ms", "normal: ms", 1, 0 },
    { "normal_part", "normal: share of speed", 3, 0 },
    { "paper_multiple", "2005: x kept", 3, 0 },
    { "paper_speed", "2005: speed", 3, 0 },
    { "paper_normal_part", "2005: normal: share", 3, 0 },
};

static bool is_gl(const trip_renderer *renderer)
{
    return !strcmp(renderer->ops->name, "gl");
}

static double reads(const bench_cost *counted, double kept)
{
    return kept > 0 ? (double)counted->stats.all.splats_read / kept : 0;
}

/* Adds the figures of the same method with nothing left out. */
static void add_normal(cJSON *row, bench_runs *runs, const bench_cost *counted, int method,
                       double kept)
{
    cJSON *normal = cJSON_CreateObject();
    bench_runs_describe(runs, METHODS + method, method, counted, kept, normal);
    measure_add(row, { "normal_read", reads(counted, kept) },
                { "normal_ms", cJSON_GetObjectItem(normal, "ms")->valuedouble },
                { "normal_part", cJSON_GetObjectItem(normal, "speed")->valuedouble });
    cJSON_Delete(normal);
}

static void add_row(cJSON *rows, bench_runs *runs, const bench_frame frames[2 * METHODS],
                    const bench_cost counted[2 * METHODS], int view, int method, double kept)
{
    cJSON *row = measure_new_row(rows);
    cJSON_AddStringToObject(row, "method", methods[method].name);
    if (methods[method].method == TRIP_METHOD_MERGE)
        cJSON_AddNumberToObject(row, "h", methods[method].h);
    bench_runs_describe(runs, method, AXIS, &counted[method], kept, row);
    cJSON_AddNumberToObject(row, "read", reads(&counted[method], kept));
    if (frames[METHODS + method].renderer)
        add_normal(row, runs, &counted[METHODS + method], method, kept);
    if (method >= IN_PAPER)
        return;
    measure_add(row, { "paper_splats", paper[view][method].splats },
                { "paper_multiple", paper[view][method].splats / PAPER_VALID_VOXELS },
                { "paper_fps", paper[view][method].fps },
                { "paper_speed", paper[view][method].fps / paper[view][AXIS].fps },
                { "paper_normal_fps", paper[view][method].normal_fps },
                { "paper_normal_part", paper[view][method].normal_fps / paper[view][method].fps });
}

/* The method image is the last one. Only some renderers implement it. */
static int methods_of(const trip_renderer *renderer)
{
    return renderer->ops->forms & TRIP_DRAWS_IMAGE_SHEETS ? METHODS : METHODS - 1;
}

/* Draws the frame with nothing left out, by gl from one list. Leaves it out if that list does not
 * fit. */
static int warm_up_normal(bench_frame *normal, bench_cost *counted, bench_report *r, int repeat)
{
    char why[256] = "";
    normal->settings.unculled = true;
    normal->settings.indexed = is_gl(normal->renderer);
    bench_keep_report(why);
    int status = bench_frame_draw(normal, true, counted);
    bench_keep_report(NULL);
    if (!status || trip_interrupted())
        return status;
    bench_report_limit(r, "normal is left out: %s", why);
    normal->renderer = NULL;
    measure_progress_expect(normal->progress, -repeat);
    return 0;
}

/* Draws each method once with exact counts, which also warms up, then takes the timed runs. The
 * second half of the frames has nothing left out. */
static int measure_view(const bench_frame *base, const bench_options *o, bench_report *r, int view)
{
    bench_frame frames[2 * METHODS];
    bench_cost counted[2 * METHODS];
    bench_runs runs = { 0 };
    const int count = methods_of(base->renderer);
    int status = 0;
    for (int i = 0; i < 2 * METHODS; i++)
        frames[i].renderer = NULL;
    for (int i = 0; i < count && !status; i++) {
        frames[i] = *base;
        frames[i].view = views[view].view(base->session, o->sizes[0]);
        frames[i].settings.method = methods[i].method;
        frames[i].settings.h = methods[i].h;
        status = bench_frame_draw(&frames[i], true, &counted[i]);
        if (status || i >= IN_PAPER)
            continue;
        frames[METHODS + i] = frames[i];
        status = warm_up_normal(&frames[METHODS + i], &counted[METHODS + i], r, o->repeat);
    }
    if (!status)
        status = bench_runs_take(&runs, frames, 2 * METHODS, o->repeat);
    if (!status) {
        cJSON *rows = bench_report_table(r, views[view].key, views[view].title, columns);
        for (int i = 0; i < count; i++)
            add_row(rows, &runs, frames, counted, view, i,
                    (double)base->session->data->header.kept);
    }
    bench_runs_free(&runs);
    return status;
}

static void add_limits(bench_report *r)
{
    bench_report_limit(
        r, "A frame begins with the data set in memory, so that no time includes the disk. It ends "
           "with the picture in the memory of the program.");
    bench_report_limit(r,
                       "splats drawn: splats with a pixel centre in the footprint where their list "
                       "has weight, counted in an untimed frame. x kept: splats drawn / voxels "
                       "kept per list. Bricks that are transparent under the transfer function are "
                       "left out, so that a narrower transfer function lowers all ratios.");
    bench_report_limit(
        r, "normal: nothing is left out. Every voxel of a list with weight is read and tested, as "
           "in the column Normal of 2005. gl draws from one list with indices for the others "
           "(--submit indexed). cpu and reference have no such form and read the three lists. "
           "Brick with --keep-all for all voxels of the volume, as in the paper.");
    bench_report_limit(r, "image: sheets parallel to the image plane (Mueller & Crawfis 1998); "
                          "each splat is divided among them. Only the reference implements it.");
    bench_report_limit(r, "speed: time of axis / time, in the same view. Times are medians of runs "
                          "that are taken alternately.");
    bench_report_limit(r, "largest part: of the median run, as the calling thread sees it. Work of "
                          "a GPU or other threads counts where the calling thread waits for it.");
    bench_report_limit(
        r, "The parallel view gives one list all the weight. A perspective view parallel to X-Y "
           "would draw three lists at h = 0, but not at the other h of a narrow view.");
    bench_report_limit(r,
                       "2005: Hofsetz & Max, the Foot (183 x 255 x 125, %.0f voxels kept) at 512 x "
                       "512 on a GeForce 6600 GT, with a separate list for each axis. Object, view "
                       "and kernel differ, so compare the pattern and not the figures.",
                       PAPER_VALID_VOXELS);
}

int bench_orders(bench_scene *scene, const bench_options *o, bench_report *r)
{
    int status = 0;
    measure_progress_expect(o->progress, VIEWS * (methods_of(scene->frame.renderer) + IN_PAPER) *
                                             (1 + o->repeat));
    add_limits(r);
    for (int view = 0; view < VIEWS && !status; view++)
        status = measure_view(&scene->frame, o, r, view);
    return status;
}
