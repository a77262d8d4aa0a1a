/* bench stream: compares reading and drawing from disk with the bandwidth of the disk, and measures
 * their overlap. */
#include "bench_tables.h"

#include <math.h>
#include <stdlib.h>

#include "bench_disk.h"
#include "bench_probe.h"
#include "bench_view.h"
#include "report.h"

enum { PLAIN, BLIND, SMALL, STREAMED, READ, DRAW, FRAME, STAGES };

static const char *const names[STAGES] = {
    "plain read",     "plain read, blind", "plain read, blind, small pages",
    "lists streamed", "read alone",        "draw alone",
    "frame"
};
static const char *const keys[STAGES] = { "plain", "plain_blind", "plain_small", "streamed",
                                          "read",  "draw",        "frame" };

static const double gigabyte = 1e9, second_ms = 1e3;

static const measure_column stage_columns[] = {
    { "stage", "stage", 0, 0 },
    { "ms", "s: median", 3, second_ms },
    { "ms_min", "fastest", 3, second_ms },
    { "ms_max", "slowest", 3, second_ms },
    { "bytes_read", "GB read", 3, gigabyte },
    { "gb_per_s", "GB/s", 3, 0 },
    { "of_plain", "x plain read", 3, 0 },
    { "of_blind", "x blind", 3, 0 },
};

static const measure_column summary_columns[] = {
    { "dataset_bytes", "data set GB", 3, gigabyte },
    { "memory_limit_bytes", "memory limit MB", 1, 1e6 },
    { "memory_peak_bytes", "peak MB", 1, 1e6 },
    { "peak_rss_bytes", "resident MB", 1, 1e6 },
    { "seconds_per_frame", "seconds/frame", 3, 0 },
    { "gb_per_s", "GB/s", 3, 0 },
    { "disk_gb_per_s", "disk GB/s", 3, 0 },
    { "frame_of_disk", "x disk", 3, 0 },
    { "streamed_of_disk", "lists streamed x disk", 3, 0 },
    { "frame_of_bound", "frame / max(read, draw)", 3, 0 },
};

/* State of the measurement. */
typedef struct stream {
    const session *session;
    const bench_options *options;
    trip_budget
        *whole; /* holds the data set for drawing without the disk, outside the memory limit */
    bench_scene *scene;
    bench_frame *frame;    /* of the scene, from disk */
    bench_frame in_memory; /* renderer is NULL if the data set does not fit */
    bench_frame unread;    /* reads, and does not draw */
    bench_probe probe;
    bench_files files;
    uint64_t peak_rss_bytes, peak_bytes;
    bench_disk_read *samples; /* [stage * repeat + run] */
} stream;

static int take(stream *t, int stage, bench_disk_read *out)
{
    const bench_frame *frames[STAGES] = {
        [READ] = &t->unread, [DRAW] = &t->in_memory, [FRAME] = t->frame
    };
    static const bench_plain plain[] = {
        [PLAIN] = BENCH_PLAIN, [BLIND] = BENCH_PLAIN_BLIND, [SMALL] = BENCH_PLAIN_SMALL
    };
    bench_cost cost;
    measure_progress_step(t->options->progress, names[stage]);
    if (stage == DRAW && !t->in_memory.renderer)
        return 0;
    bench_files_forget(t->session, &t->files);
    if (stage <= SMALL)
        return bench_files_read(t->session, &t->files, plain[stage], out);
    if (stage == STREAMED) {
        t->scene->occluder = NULL;
        return bench_files_stream(t->session, &t->files, t->frame->reader, out);
    }
    int status = bench_frame_draw(frames[stage], false, &cost);
    *out = (bench_disk_read){ .ms = cost.ms, .bytes = cost.stats.reader.bytes_read };
    return status;
}

static int find_files(stream *t)
{
    trip_camera camera;
    trip_plan plan;
    int status = trip_camera_make(&camera, &t->frame->view, &t->session->data->index_to_world);
    if (!status)
        status = trip_plan_make_next(
            &plan, t->session->data, &camera, &t->frame->settings,
            session_table(t->session, trip_settings_interpolates(&t->frame->settings, false)),
            session_classified(t->session, 0), NULL, t->session->budget);
    if (status)
        return status;
    bench_files_of_plan(t->session->data, &plan, &t->files);
    trip_plan_release(&plan, t->session->budget);
    return 0;
}

/* Draws a frame within the memory limit. Notes the peaks before anything else takes memory. */
static int draw_first(stream *t)
{
    bench_cost cost;
    t->frame->view = bench_view_oblique(t->session, t->scene->size);
    int status = find_files(t);
    if (!status)
        status = bench_frame_draw(t->frame, false, &cost);
    t->peak_rss_bytes = trip_memory_peak_rss_bytes();
    t->peak_bytes = trip_budget_peak_bytes(t->session->budget);
    t->probe = bench_probe_make(0);
    t->unread = *t->frame;
    t->unread.renderer = &t->probe.base;
    return status;
}

/* Loads the data set into memory with a budget of its own. Leaves it out if it does not fit. */
static int open_in_memory(stream *t, bench_report *r)
{
    char why[256] = "";
    session other = *t->session;
    t->in_memory = *t->frame;
    t->in_memory.reader = NULL;
    int status = trip_budget_create(&t->whole, trip_memory_available_bytes() / 4 * 3);
    if (status)
        return status;
    other.budget = t->whole;
    bench_keep_report(why);
    status = bench_reader_create(&other, &t->in_memory.reader, t->options, TRIP_ENGINE_NULL, NULL,
                                 t->frame->occluder);
    bench_keep_report(NULL);
    if (!status || trip_interrupted())
        return status;
    bench_report_limit(r, "draw alone is left out: %s", why);
    t->in_memory.renderer = NULL;
    return 0;
}

static int by_time(const void *a, const void *b)
{
    double x = ((const bench_disk_read *)a)->ms, y = ((const bench_disk_read *)b)->ms;
    return (x > y) - (x < y);
}

/* Returns the median run. */
static bench_disk_read middle(const stream *t, int stage)
{
    bench_disk_read *runs = &t->samples[stage * t->options->repeat];
    qsort(runs, (size_t)t->options->repeat, sizeof *runs, by_time);
    return runs[(t->options->repeat - 1) / 2];
}

static double gb_per_s(bench_disk_read s)
{
    return s.ms > 0 ? (double)s.bytes / gigabyte / (s.ms / second_ms) : 0;
}

static void add_stages(const stream *t, bench_report *r)
{
    cJSON *rows =
        bench_report_table(r, "stages", "The parts of a frame, alone and together", stage_columns);
    for (int stage = 0; stage < STAGES; stage++) {
        const bench_disk_read own = middle(t, stage);
        const double plain = gb_per_s(middle(t, PLAIN)), blind = gb_per_s(middle(t, BLIND));
        const bench_disk_read *runs = &t->samples[stage * t->options->repeat];
        cJSON *row = measure_new_row(rows);
        cJSON_AddStringToObject(row, "key", keys[stage]);
        cJSON_AddStringToObject(row, "stage", names[stage]);
        if (stage != DRAW || t->in_memory.renderer)
            measure_add(row, { "ms", own.ms }, { "ms_min", runs[0].ms },
                        { "ms_max", runs[t->options->repeat - 1].ms });
        if (stage != DRAW)
            measure_add(row, { "bytes_read", (double)own.bytes }, { "gb_per_s", gb_per_s(own) },
                        { "of_plain", gb_per_s(own) / plain },
                        { "of_blind", gb_per_s(own) / blind });
    }
}

static void add_summary(const stream *t, bench_report *r)
{
    cJSON *rows =
        bench_report_table(r, "summary", "The frame, compared with its limits", summary_columns);
    cJSON *row = measure_new_row(rows);
    const bench_disk_read read = middle(t, READ), draw = middle(t, DRAW), frame = middle(t, FRAME);
    const double disk = gb_per_s(middle(t, PLAIN)), streamed = gb_per_s(middle(t, STREAMED));
    measure_add(row, { "dataset_bytes", (double)t->session->data->bytes },
                { "memory_limit_bytes", (double)trip_budget_limit_bytes(t->session->budget) },
                { "memory_peak_bytes", (double)t->peak_bytes },
                { "peak_rss_bytes", (double)t->peak_rss_bytes },
                { "seconds_per_frame", frame.ms / second_ms }, { "gb_per_s", gb_per_s(frame) },
                { "disk_gb_per_s", disk }, { "frame_of_disk", gb_per_s(frame) / disk },
                { "streamed_of_disk", streamed / disk });
    if (t->in_memory.renderer) {
        cJSON_AddStringToObject(row, "bound", read.ms > draw.ms ? "read" : "draw");
        cJSON_AddNumberToObject(row, "frame_of_bound", frame.ms / fmax(read.ms, draw.ms));
    }
}

static void describe(const stream *t, bench_report *r)
{
    cJSON_AddStringToObject(r->machine, "plain_read",
                            t->samples[0].direct
                                ? "8 threads, transfers of 1 MiB, O_DIRECT"
                                : "8 threads, transfers of 1 MiB, through the page cache "
                                  "(O_DIRECT refused), dropped before each run");
    bench_report_limit(
        r, "plain read: the plane files of the lists that the view needs, each as a whole, into "
           "pages like the ring's (2 MiB if the system has them). A byte of every cache line is "
           "loaded, as checking and drawing do. All ratios to the disk use this read. The host of "
           "a virtual disk may cache the files, equally for every stage.");
    bench_report_limit(r, "blind: no byte is loaded. small pages: memory of the default page size, "
                          "which costs more on a virtual disk.");
    bench_report_limit(r, "lists streamed: the bytes of the plain read, through the frame's ring, "
                          "verified and handed out in draw order, not drawn.");
    bench_report_limit(
        r, "read alone: the frame's plan, ring and checksums, with a renderer that does nothing. "
           "The plan leaves out bricks, so that it reads fewer bytes, with gaps between them.");
    bench_report_limit(
        r, "draw alone: the same frame with the data set in memory, outside the "
           "memory limit. gl copies the data to its own memory; cpu and reference do not.");
    if (t->frame->occluder)
        bench_report_limit(
            r, "The frame skips bricks behind opaque ones; read alone cannot skip them.");
    bench_report_limit(r, "memory: the limit, the peak use, and the resident memory after one "
                          "frame from disk, with code and libraries.");
    bench_report_limit(r, "The view is oblique, in perspective, and needs all three lists. Stages "
                          "run alternately, and figures are of median runs.");
}

static int measure(stream *t)
{
    int status = 0, repeat = t->options->repeat;
    t->samples = calloc((size_t)(STAGES * repeat), sizeof *t->samples);
    if (!t->samples)
        return trip_fail(TRIP_ERROR, "bench", "runs", "out of memory");
    for (int run = 0; run < repeat; run++)
        for (int stage = 0; stage < STAGES && !status; stage++)
            status = take(t, stage, &t->samples[stage * repeat + run]);
    return status;
}

int bench_stream(bench_scene *scene, const bench_options *o, bench_report *r)
{
    stream t = {
        .session = scene->frame.session, .options = o, .scene = scene, .frame = &scene->frame
    };
    measure_progress_expect(o->progress, 1 + STAGES * o->repeat);
    scene->frame.progress = NULL; /* each stage is a step */
    int status = draw_first(&t);
    measure_progress_step(o->progress, "loading the data set");
    if (!status)
        status = open_in_memory(&t, r);
    if (!status)
        status = measure(&t);
    if (!status) {
        describe(&t, r);
        add_summary(&t, r);
        add_stages(&t, r);
    }
    free(t.samples);
    if (t.in_memory.reader)
        trip_reader_destroy(t.in_memory.reader);
    if (t.whole)
        trip_budget_destroy(t.whole);
    return status;
}
