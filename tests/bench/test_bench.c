/* Tests that every table of `triptych bench` runs, and that its figures agree with each other and
 * with the data set. They do not test speed. */
#include <stdbool.h>
#include <unistd.h>

#include "opengl.h"
#include "program.h"

#include <cjson/cJSON.h>
#include <sys/stat.h>

static const double kept = 20 * 18 * 16;

/* Bricks a body of 20 x 18 x 16 voxels and keeps all of them. */
static int enter(void **state)
{
    program_run r;
    unsigned char values[20 * 18 * 16];
    if (program_enter_folder(state) != 0)
        return -1;
    for (size_t i = 0; i < sizeof values; i++)
        values[i] = (unsigned char)(50 + i % 200);
    FILE *f = fopen("block.raw", "wb");
    if (!f || fwrite(values, 1, sizeof values, f) != sizeof values || fclose(f) != 0)
        return -1;
    program_call(&r, "brick block.raw --size 20,18,16 --type uint8 --keep-all --normals stored -o "
                     "block.trip -q");
    return r.exit_status;
}

static cJSON *bench(const char *arguments)
{
    program_run r;
    program_call(&r, "bench %s --json", arguments);
    assert_works(&r);
    cJSON *root = cJSON_Parse(r.out);
    assert_non_null(root);
    assert_true(cJSON_IsString(cJSON_GetObjectItem(root, "command")));
    assert_true(cJSON_GetArraySize(cJSON_GetObjectItem(root, "limits")) > 0);
    const cJSON *machine = cJSON_GetObjectItem(root, "machine");
    assert_true(cJSON_IsString(cJSON_GetObjectItem(machine, "cpu")));
    assert_true(cJSON_GetObjectItem(machine, "cores")->valueint >= 1);
    return root;
}

static const cJSON *rows_of(const cJSON *root, const char *table)
{
    const cJSON *rows = cJSON_GetObjectItem(
        cJSON_GetObjectItem(cJSON_GetObjectItem(root, "tables"), table), "rows");
    assert_true(cJSON_IsArray(rows));
    return rows;
}

static double number(const cJSON *row, const char *key)
{
    const cJSON *item = cJSON_GetObjectItem(row, key);
    if (!cJSON_IsNumber(item))
        print_error("%s is missing\n", key);
    assert_true(cJSON_IsNumber(item));
    return item->valuedouble;
}

static void assert_close(double a, double b)
{
    assert_true(fabs(a - b) <= 1e-9 * fmax(fabs(a), fabs(b)));
}

/* Checks the times of a row. */
static void check_times(const cJSON *row)
{
    double ms = number(row, "ms");
    assert_true(ms > 0);
    assert_true(number(row, "ms_min") <= ms && ms <= number(row, "ms_max"));
    assert_close(number(row, "fps"), 1000 / ms);
}

/* Checks the rows of the papers. `lists` is the number of lists with weight. `normal_fps` has the
 * column "Normal" of the paper's table. `image` tells whether a row of image-aligned sheets
 * follows. */
static void check_orders(const cJSON *rows, const double multiples[5], int lists,
                         const double normal_fps[5], bool image)
{
    static const char *const names[] = { "merge, h = 0.00", "merge, h = 0.85", "merge, h = 0.95",
                                         "clip", "axis" };
    assert_int_equal(cJSON_GetArraySize(rows), image ? 6 : 5);
    for (int i = 0; i < 5; i++) {
        const cJSON *row = cJSON_GetArrayItem(rows, i), *axis = cJSON_GetArrayItem(rows, 4);
        assert_string_equal(cJSON_GetObjectItem(row, "method")->valuestring, names[i]);
        check_times(row);
        assert_close(number(row, "multiple"), number(row, "splats_drawn") / kept);
        assert_close(number(row, "speed"), number(axis, "ms") / number(row, "ms"));
        assert_true(number(row, "splats_drawn") >= number(axis, "splats_drawn"));
        assert_true(number(row, "splats_read") >= number(row, "splats_drawn"));
        assert_close(number(row, "paper_multiple"), number(row, "paper_splats") / 897229);
        assert_true(number(row, "normal_read") == (i == 4 ? 1 : lists));
        assert_true(number(row, "normal_read") >= number(row, "read"));
        assert_close(number(row, "normal_part"), number(row, "ms") / number(row, "normal_ms"));
        assert_true(number(row, "paper_normal_fps") == normal_fps[i]);
        assert_close(number(row, "paper_normal_part"), normal_fps[i] / number(row, "paper_fps"));
        if (multiples[i] > 0)
            assert_true(number(row, "multiple") == multiples[i]);
    }
}

/* The volume has values up to 249, so that all of it is transparent. Normal reads it anyway. */
static void normal_reads_transparent_voxels_too(void **state)
{
    (void)state;
    FILE *f = fopen("none.tf", "w");
    assert_non_null(f);
    fputs("values data\nunit voxel\n250 1 1 1 0\n251 1 1 1 0.5\n", f);
    assert_int_equal(fclose(f), 0);
    cJSON *root = bench("orders block.trip --renderer cpu --size 32x32 --repeat 1 --tf none.tf");
    const cJSON *row;
    cJSON_ArrayForEach(row, rows_of(root, "lateral"))
    {
        assert_true(number(row, "normal_read") == 1);
        assert_true(number(row, "read") == 0);
    }
    cJSON_Delete(root);
}

static void orders_draws_three_times_at_h_0_and_once_from_the_side(void **state)
{
    static const double oblique[] = { 3, 0, 0, 0, 1 }, lateral[] = { 1, 1, 1, 1, 1 };
    (void)state;
    static const double table_1[] = { 0.790, 1.016, 1.143, 1.208, 2.062 };
    static const double table_2[] = { 0.970, 1.333, 1.333, 1.333, 2.208 };
    static const char *const renderers[] = { "reference", "cpu", "gl" };
    for (int i = 0; i < (test_opengl() ? 3 : 2); i++) {
        char arguments[128];
        snprintf(arguments, sizeof arguments,
                 "orders block.trip --renderer %s --size 96x80 --repeat 3", renderers[i]);
        cJSON *root = bench(arguments);
        const cJSON *rows = rows_of(root, "oblique");
        check_orders(rows, oblique, 3, table_1, i == 0);
        check_orders(rows_of(root, "lateral"), lateral, 1, table_2, i == 0);
        for (int k = 0; k < 4; k++)
            assert_true(number(cJSON_GetArrayItem(rows, k), "splats_drawn") >=
                        number(cJSON_GetArrayItem(rows, k + 1), "splats_drawn"));
        cJSON_Delete(root);
    }
}

static double file_bytes(const char *path)
{
    struct stat s;
    assert_int_equal(stat(path, &s), 0);
    return (double)s.st_size;
}

static const cJSON *stage(const cJSON *rows, const char *key)
{
    const cJSON *row;
    cJSON_ArrayForEach(row, rows)
    {
        if (!strcmp(cJSON_GetObjectItem(row, "key")->valuestring, key))
            return row;
    }
    fail_msg("no stage %s", key);
    return NULL;
}

static void stream_reads_the_files_of_all_lists(void **state)
{
    (void)state;
    cJSON *root = bench("stream block.trip --classify pre --renderer cpu --size 64x64 --repeat 2 "
                        "--memory 64M");
    const cJSON *rows = rows_of(root, "stages");
    const cJSON *summary = cJSON_GetArrayItem(rows_of(root, "summary"), 0);
    double planes = file_bytes("block.trip/x0.voxels") + file_bytes("block.trip/y0.voxels") +
                    file_bytes("block.trip/z0.voxels") + file_bytes("block.trip/x0.normals") +
                    file_bytes("block.trip/y0.normals") + file_bytes("block.trip/z0.normals");
    assert_true(number(stage(rows, "plain"), "bytes_read") == planes);
    assert_true(number(stage(rows, "plain_blind"), "bytes_read") == planes);
    assert_true(number(stage(rows, "plain_small"), "bytes_read") == planes);
    assert_true(number(stage(rows, "streamed"), "bytes_read") == planes);
    assert_true(number(stage(rows, "read"), "bytes_read") == planes);
    assert_true(number(stage(rows, "frame"), "bytes_read") == planes);
    assert_true(number(summary, "dataset_bytes") == planes + file_bytes("block.trip/index.trip"));
    assert_true(number(summary, "memory_limit_bytes") == 64.0 * (1 << 20));
    assert_true(number(summary, "memory_peak_bytes") <= 64.0 * (1 << 20));
    /* The comparison uses the plain read that has the same kind of memory as the ring, and loads
     * the bytes read. */
    assert_close(number(summary, "disk_gb_per_s"), number(stage(rows, "plain"), "gb_per_s"));
    assert_close(number(stage(rows, "streamed"), "of_blind"),
                 number(stage(rows, "streamed"), "gb_per_s") /
                     number(stage(rows, "plain_blind"), "gb_per_s"));
    assert_close(number(summary, "frame_of_disk"),
                 number(summary, "gb_per_s") / number(summary, "disk_gb_per_s"));
    assert_close(number(summary, "streamed_of_disk"),
                 number(stage(rows, "streamed"), "gb_per_s") / number(summary, "disk_gb_per_s"));
    assert_close(number(summary, "seconds_per_frame") * 1000, number(stage(rows, "frame"), "ms"));
    assert_close(number(summary, "frame_of_bound"),
                 number(stage(rows, "frame"), "ms") /
                     fmax(number(stage(rows, "read"), "ms"), number(stage(rows, "draw"), "ms")));
    cJSON_Delete(root);
}

/* `post` reads values and their halo, but no normals. */
static void stream_of_post_reads_values_and_halo(void **state)
{
    (void)state;
    program_run r;
    program_call(&r,
                 "brick block.raw --size 20,18,16 --type uint8 --range 100:255 -o upper.trip -q");
    assert_int_equal(r.exit_status, 0);
    cJSON *root =
        bench("stream upper.trip --renderer cpu --classify post --samples-per-sheet 2 --size 64x64 "
              "--repeat 2 --memory 64M");
    const cJSON *rows = rows_of(root, "stages");
    const cJSON *summary = cJSON_GetArrayItem(rows_of(root, "summary"), 0);
    double planes = file_bytes("upper.trip/x0.voxels") + file_bytes("upper.trip/y0.voxels") +
                    file_bytes("upper.trip/z0.voxels") + file_bytes("upper.trip/x0.halo") +
                    file_bytes("upper.trip/y0.halo") + file_bytes("upper.trip/z0.halo");
    assert_true(number(stage(rows, "plain"), "bytes_read") == planes);
    assert_true(number(stage(rows, "streamed"), "bytes_read") == planes);
    assert_true(number(stage(rows, "frame"), "bytes_read") == planes);
    assert_close(number(summary, "frame_of_bound"),
                 number(stage(rows, "frame"), "ms") /
                     fmax(number(stage(rows, "read"), "ms"), number(stage(rows, "draw"), "ms")));
    cJSON_Delete(root);
}

static void renderers_has_a_row_for_each_renderer_size_and_threads(void **state)
{
    (void)state;
    cJSON *root = bench("renderers block.trip --classify pre --renderer cpu,reference "
                        "--size 32x32,48x40 --views 3 --threads 1,2");
    const cJSON *rows = rows_of(root, "renderers"), *row;
    assert_int_equal(cJSON_GetArraySize(rows), 6);
    cJSON_ArrayForEach(row, rows)
    {
        check_times(row);
        assert_true(number(row, "views") == 3);
        /* A body in full view is drawn from one to three lists. */
        assert_true(number(row, "splats_drawn") >= kept);
        assert_true(number(row, "splats_drawn") <= 3 * kept);
        assert_close(number(row, "mpixels_per_s"),
                     number(row, "msplats_per_s") * number(row, "pixels_per_splat"));
    }
    cJSON_Delete(root);
}

/* Draws by `render` without options, and returns its statistics. */
static cJSON *render_stats(const char *data, const char *options)
{
    static char text[65536];
    program_run r;
    program_call(&r, "render %s -o drawn.png --stats drawn.json %s", data, options);
    assert_works(&r);
    program_read("drawn.json", text, sizeof text);
    cJSON *stats = cJSON_Parse(text);
    assert_non_null(stats);
    return stats;
}

static const char *text_of(const cJSON *row, const char *key)
{
    const char *text = cJSON_GetStringValue(cJSON_GetObjectItem(row, key));
    assert_non_null(text);
    return text;
}

/* The first row has the settings that `render` chooses by itself, for a volume and for a slice. */
static void the_first_row_of_renderers_is_the_default_of_render(void **state)
{
    (void)state;
    program_run r;
    program_call(&r, "brick block.raw --size 360,16,1 --type uint8 --keep-all -o slice.trip -q");
    assert_works(&r);
    for (int slice = 0; slice < 2; slice++) {
        const char *data = slice ? "slice.trip" : "block.trip";
        char arguments[128], size[32];
        snprintf(arguments, sizeof arguments,
                 "renderers %s --views 2 --repeat 2 --renderer cpu --size 16x16", data);
        cJSON *root = bench(arguments), *stats = render_stats(data, "");
        const cJSON *rows = rows_of(root, "renderers"), *row = cJSON_GetArrayItem(rows, 0), *view;
        check_times(row);
        assert_string_equal(text_of(row, "name"), "default");
        const cJSON *sides = cJSON_GetObjectItem(stats, "size");
        snprintf(size, sizeof size, "%d x %d", cJSON_GetArrayItem(sides, 0)->valueint,
                 cJSON_GetArrayItem(sides, 1)->valueint);
        assert_string_equal(text_of(row, "size"), size);
        assert_string_equal(text_of(row, "renderer"), text_of(stats, "renderer"));
        assert_string_equal(text_of(row, "device"), text_of(stats, "device")); /* with threads */
        assert_string_equal(text_of(row, "classify"), text_of(stats, "classify"));
        assert_string_equal(text_of(row, "classify"), slice ? "pre" : "post");
        assert_true(number(row, "early_termination") == number(stats, "early_termination"));
        assert_null(cJSON_GetObjectItem(stats, "effects"));
        assert_true(number(row, "effects") == 0);
        if (!slice) {
            assert_string_equal(text_of(row, "interpolation"), text_of(stats, "interpolation"));
            assert_true(number(row, "samples_per_sheet") == number(stats, "samples_per_sheet"));
        }
        const cJSON *views = cJSON_GetObjectItem(row, "each_view");
        assert_int_equal(cJSON_GetArraySize(views), 2);
        cJSON_ArrayForEach(view, views)
            assert_int_equal(cJSON_GetArraySize(cJSON_GetObjectItem(view, "ms")), 2);
        /* The other rows classify like the default. */
        for (int i = 1; i < cJSON_GetArraySize(rows); i++)
            assert_int_equal(!strcmp(text_of(cJSON_GetArrayItem(rows, i), "name"), "post"), !slice);
        cJSON_Delete(root);
        cJSON_Delete(stats);
    }
}

/* The camera of a view draws the picture of `render`. */
static void the_default_is_seen_as_by_render(void **state)
{
    (void)state;
    char options[512];
    cJSON *root = bench("renderers block.trip --views 4 --renderer cpu --size 16x16");
    const cJSON *views =
        cJSON_GetObjectItem(cJSON_GetArrayItem(rows_of(root, "renderers"), 0), "each_view");
    for (int i = 0; i < 2; i++) {
        const cJSON *view = cJSON_GetArrayItem(views, i);
        int at = snprintf(options, sizeof options, "--fov %.17g", number(view, "fov_degrees"));
        static const char *const names[] = { "eye", "look", "up" };
        for (int k = 0; k < 3; k++) {
            const cJSON *p = cJSON_GetObjectItem(view, names[k]);
            at += snprintf(options + at, sizeof options - (size_t)at, " --%s=%.17g,%.17g,%.17g",
                           names[k], cJSON_GetArrayItem(p, 0)->valuedouble,
                           cJSON_GetArrayItem(p, 1)->valuedouble,
                           cJSON_GetArrayItem(p, 2)->valuedouble);
        }
        cJSON_Delete(render_stats("block.trip", options));
        assert_int_equal(rename("drawn.png", "seen.png"), 0);
        cJSON_Delete(render_stats("block.trip", i ? "--azimuth 90" : ""));
        assert_int_equal(system("cmp -s drawn.png seen.png"), 0);
    }
    cJSON_Delete(root);
}

/* Each table names the options of `render` that draw like it. */
static void tables_name_the_options_of_render(void **state)
{
    (void)state;
    static const char *const cases[][2] = {
        { "orders block.trip --size 16x16 --repeat 1 --renderer cpu",
          "--classify pre --compositing splat --kernel-radius 2 --size 16x16 --renderer cpu" },
        { "stream block.trip --size 16x16 --repeat 1 --renderer cpu",
          "--classify post --size 16x16 --renderer cpu" },
        { "stream block.trip --size 16x16 --repeat 1 --renderer cpu --compositing sheet",
          "--classify pre --compositing sheet --kernel-radius 2 --size 16x16 --renderer cpu" },
        { "renderers block.trip --size 16x16 --views 1 --renderer cpu --samples-per-sheet 3 "
          "--threads 2 --no-shading --early-termination 0.01",
          "--classify post --samples-per-sheet 3 --early-termination 0.01 --no-shading "
          "--size 16x16 --renderer cpu --threads 2" },
        { "popping block.trip --size 16x16", "--classify post --size 16x16 --renderer cpu" },
        { "variants block.trip --size 16x16", "--classify pre --compositing splat --kernel-radius "
                                              "2 --size 16x16 --renderer reference" },
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        cJSON *root = bench(cases[i][0]);
        const cJSON *settings = cJSON_GetObjectItem(root, "settings");
        assert_string_equal(text_of(settings, "options_of_render"), cases[i][1]);
        cJSON_Delete(render_stats("block.trip", cases[i][1]));
        cJSON_Delete(root);
    }
}

static void renderers_reports_each_view_without_counts_too(void **state)
{
    (void)state;
    cJSON *root = bench("renderers block.trip --renderer cpu --size 32x32 --views 4 --repeat 2 "
                        "--no-counts");
    const cJSON *row = cJSON_GetArrayItem(rows_of(root, "renderers"), 0), *view;
    check_times(row);
    assert_null(cJSON_GetObjectItem(row, "splats_drawn"));
    assert_null(cJSON_GetObjectItem(row, "msplats_per_s"));
    const cJSON *views = cJSON_GetObjectItem(row, "each_view");
    assert_int_equal(cJSON_GetArraySize(views), 4);
    cJSON_ArrayForEach(view, views)
    {
        assert_int_equal(cJSON_GetArraySize(cJSON_GetObjectItem(view, "ms")), 2);
        assert_int_equal(cJSON_GetArraySize(cJSON_GetObjectItem(view, "eye")), 3);
        assert_true(number(view, "fov_degrees") == 30);
    }
    cJSON_Delete(root);
}

static void submit_compares_methods_of_gl(void **state)
{
    (void)state;
    if (!test_opengl())
        skip();
    double projected[14];
    for (int two_points = 0; two_points < 2; two_points++) {
        cJSON *root = bench(two_points ? "submit block.trip --size 64x64 --repeat 1 "
                                         "--culling two-points"
                                       : "submit block.trip --size 64x64 --repeat 1");
        const cJSON *rows = rows_of(root, "submit"), *start = rows_of(root, "start");
        assert_int_equal(cJSON_GetArraySize(rows), 14);
        assert_int_equal(cJSON_GetArraySize(start), 14);
        for (int i = 0; i < 14; i++) {
            const cJSON *row = cJSON_GetArrayItem(rows, i);
            bool axis = !strcmp(cJSON_GetObjectItem(row, "orders")->valuestring, "axis");
            check_times(row);
            assert_true(axis ? number(row, "multiple") == 1 : number(row, "multiple") > 1);
            assert_true(number(row, "projected") >= number(row, "multiple"));
            assert_true(number(cJSON_GetArrayItem(start, i), "start_s") > 0);
            assert_true((cJSON_GetObjectItem(row, "lost_max") != NULL) == two_points);
            if (two_points)
                assert_true(number(row, "projected") <= projected[i]);
            projected[i] = number(row, "projected");
        }
        assert_true(number(cJSON_GetArrayItem(rows, 0), "speed") == 1);
        /* Replicated point sprites of the MRI in Tables 3 and 4 of the paper, three lists. */
        assert_close(number(cJSON_GetArrayItem(rows, 1), "paper_mri"), 3.03 / 6.07);
        assert_true(number(cJSON_GetArrayItem(start, 1), "paper_mri") == 55.51);
        /* Indexed triangles of the Head. */
        assert_close(number(cJSON_GetArrayItem(rows, 7), "paper_head"), 2.00 / 22.45);
        assert_true(number(cJSON_GetArrayItem(start, 7), "paper_head") == 5.89);
        cJSON_Delete(root);
    }
}

static void without_a_table_bench_lists_tables_and_runs_a_short_one(void **state)
{
    (void)state;
    static const char *const names[] = { "orders", "submit", "stream", "renderers" };
    program_run r;
    assert_int_equal(mkdir("temporary", 0700), 0);
    assert_int_equal(setenv("TMPDIR", "temporary", 1), 0);
    program_call(&r, "bench --renderer cpu --size 32x32 --views 1");
    assert_works(&r);
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        char line[32];
        snprintf(line, sizeof line, "\n  %s ", names[i]);
        assert_non_null(strstr(r.out, line));
    }
    /* With a graphics processor, the default is drawn by gl. */
    assert_true(strstr(r.out, "\n| default | cpu ") ||
                (strstr(r.out, "\n| post ") && strstr(r.out, "| cpu ")));
    assert_non_null(strstr(r.out, "\n- grid: 103 x 94 x 161\n")); /* from the header of the tooth */
    assert_string_equal(r.err, "");
    cJSON_Delete(bench("--renderer cpu --size 32x32 --views 1"));
    cJSON *root = bench("orders --renderer cpu --size 32x32 --repeat 1");
    assert_int_equal(cJSON_GetArraySize(rows_of(root, "lateral")), 5);
    cJSON_Delete(root);
    program_call(&r, "bench orders --renderer cpu --memory 1M");
    assert_fails(&r, 1);
    assert_int_equal(rmdir("temporary"), 0); /* the folder is empty */
    unsetenv("TMPDIR");
    program_call(&r, "bench --no-counts --engine pread");
    assert_fails(&r, 2);
}

static void assert_a_plot(const char *path, const char *label)
{
    static char text[16384];
    program_read(path, text, sizeof text);
    assert_true(!strncmp(text, "<svg ", 5) && strstr(text, "</svg>\n") && strstr(text, label));
}

static void a_plot_replaces_no_input_file(void **state)
{
    (void)state;
    static const char function[] = "0 0 0 0 0\n255 1 1 1 0.5\n";
    const char *const plots[] = { "f.tf", "./f.tf", "block.trip/index.trip", "block.trip/new.svg",
                                  "missing/new.svg" };
    const char *const says[] = { "is an input file", "is an input file", "among the input files",
                                 "among the input files", "cannot create" };
    program_run r;
    char text[64];
    FILE *f = fopen("f.tf", "w");
    assert_true(f && fputs(function, f) >= 0 && fclose(f) == 0);
    for (int i = 0; i < 5; i++) {
        program_call(&r, "bench popping block.trip --size 8x8 --tf f.tf --plot %s", plots[i]);
        assert_fails(&r, i < 4 ? 2 : 1);
        assert_non_null(strstr(r.err, says[i]));
        assert_int_equal(r.out[0], 0);
    }
    program_read("f.tf", text, sizeof text);
    assert_string_equal(text, function);
    program_call(&r, "info block.trip");
    assert_works(&r);
}

/* All rows are compared with the first. */
static void variants_compares_the_papers_with_the_default_picture(void **state)
{
    (void)state;
    cJSON *root = bench("variants block.trip --size 24x24");
    const cJSON *rows = rows_of(root, "variants"), *row;
    assert_int_equal(cJSON_GetArraySize(rows), 7);
    cJSON_ArrayForEach(row, rows)
    {
        bool first = row == cJSON_GetArrayItem(rows, 0);
        assert_true(first ? number(row, "max") == 0 : number(row, "max") > 0);
        assert_true(number(row, "percentile_99") <= number(row, "max"));
    }
    cJSON_Delete(root);
}

/* The volume is noise, so that the three lists look very different. With `axis` all pixels jump at
 * once. With `clip` the pixels at the border of two lists jump, with `merge` none. */
static void only_axis_pops(void **state)
{
    (void)state;
    const char *const models[] = { "", "--compositing sheet",
                                   "--classify post --samples-per-sheet 1" };
    for (int i = 0; i < 3; i++) {
        char arguments[128];
        snprintf(arguments, sizeof arguments,
                 "popping block.trip --size 32x32 --no-shading --plot popping.svg %s", models[i]);
        cJSON *root = bench(arguments);
        const cJSON *rows = rows_of(root, "popping"), *axis = cJSON_GetArrayItem(rows, 6);
        const cJSON *clip = cJSON_GetArrayItem(rows, 5), *row;
        assert_true(number(axis, "mean") > 3 * number(axis, "motion"));
        assert_true(number(clip, "mean") < number(axis, "mean") / 6);
        cJSON_ArrayForEach(row, rows)
        {
            assert_true(number(row, "mean") <= number(row, "max"));
            assert_true(number(row, "percentile_99") <= number(row, "max"));
            if (row != axis && row != clip)
                assert_true(number(row, "percentile_99") < number(axis, "percentile_99") / 4);
        }
        cJSON_Delete(root);
        assert_a_plot("popping.svg", "0.95");
    }
}

/* In a uniform body without shading, coarse levels differ only at the edges. Their pixels change as
 * much as the pixels of the finest level. */
static void levels_of_a_uniform_block_are_close_to_the_finest(void **state)
{
    (void)state;
    program_run r;
    char tf[] = "values data\nunit 1\n0 1 1 1 0.02\n255 1 1 1 0.02\n";
    unsigned char values[32 * 32 * 32];
    for (size_t i = 0; i < sizeof values; i++)
        values[i] = (unsigned char)(100 + i % 2); /* both values look the same */
    FILE *f = fopen("plain.raw", "wb");
    assert_non_null(f);
    assert_int_equal(fwrite(values, 1, sizeof values, f), sizeof values);
    assert_int_equal(fclose(f), 0);
    f = fopen("plain.tf", "w");
    assert_non_null(f);
    assert_true(fputs(tf, f) >= 0);
    assert_int_equal(fclose(f), 0);
    program_call(&r,
                 "brick plain.raw --size 32,32,32 --type uint8 --keep-all --tf plain.tf --levels 2 "
                 "--levels-for both -o plain.trip -q");
    assert_works(&r);
    cJSON *root = bench("levels plain.trip --classify pre --views 1 --no-shading");
    const cJSON *rows = rows_of(root, "levels"), *row;
    assert_int_equal(cJSON_GetArraySize(rows), 2);
    for (int level = 1; level <= 2; level++) {
        row = cJSON_GetArrayItem(rows, level - 1);
        assert_true(number(row, "level") == level);
        /* The picture shows 32 voxels, rotated and with a margin. */
        assert_true(number(row, "width") >= 32 >> level && number(row, "width") <= 72 >> level);
        assert_true(number(row, "ms") > 0 && number(row, "fine_ms") > 0);
        assert_true(number(row, "colour_mean") > 0 && number(row, "colour_mean") < 8 * level);
        /* The body is white. */
        assert_true(fabs(number(row, "colour_mean") - number(row, "alpha_mean")) < 0.01);
    }
    row = cJSON_GetArrayItem(rows_of(root, "dolly"), 1);
    assert_true(number(row, "mean_of_finest") > 0.8 && number(row, "mean_of_finest") < 1.25);
    assert_true(number(row, "max") >= number(row, "mean"));
    cJSON_Delete(root);
    program_call(
        &r, "brick plain.raw --size 32,32,32 --type uint8 --keep-all --levels 0 -o without.trip "
            "-q");
    assert_works(&r);
    program_call(&r, "bench levels without.trip");
    assert_fails(&r, 1);
}

/* Holds for any number of pictures that the machine is fast enough to draw. */
static void flight_ends_with_the_picture_of_render(void **state)
{
    (void)state;
    cJSON *root = bench("flight block.trip --renderer cpu --threads 2 --size 40x30 --seconds 0.4 "
                        "--memory 64M");
    const cJSON *rows = rows_of(root, "parts");
    const cJSON *rest = cJSON_GetArrayItem(rows_of(root, "rest"), 0);
    double pictures = 0;
    assert_int_equal(cJSON_GetArraySize(rows), 5);
    for (int i = 0; i < 5; i++) {
        const cJSON *row = cJSON_GetArrayItem(rows, i);
        assert_true(number(row, "ms") <= number(row, "ms_99"));
        assert_true(number(row, "ms_99") <= number(row, "ms_max"));
        assert_true(number(row, "stale") <= number(row, "pictures"));
        if (i < 4)
            pictures += number(row, "pictures");
        else
            assert_true(number(row, "pictures") == pictures);
    }
    assert_true(number(rest, "differ") == 0);
    assert_true(number(rest, "first_ms") <= number(rest, "first_whole_ms"));
    assert_true(number(rest, "limit_bytes") == 64.0 * (1 << 20));
    assert_true(number(rest, "peak_bytes") <= number(rest, "limit_bytes"));
    cJSON_Delete(root);
}

static void levels_without_a_data_set_samples_a_field(void **state)
{
    (void)state;
    program_run r;
    assert_int_equal(mkdir("fields", 0700), 0);
    assert_int_equal(setenv("TMPDIR", "fields", 1), 0);
    cJSON *root = bench("levels --field filaments --finest 128 --size 32x24 --views 1 --repeat 1 "
                        "--plot levels.svg");
    assert_int_equal(rmdir("fields"), 0); /* the folder is empty */
    unsetenv("TMPDIR");
    const cJSON *rows = rows_of(root, "finer"), *row = cJSON_GetArrayItem(rows, 0);
    assert_int_equal(cJSON_GetArraySize(rows), 1);
    assert_true(number(row, "voxels") == 128);
    assert_true(number(row, "ms") > 0 && number(row, "fine_ms") > 0);
    /* A single volume has no coarser level to compare. */
    assert_close(number(row, "colour"), number(row, "fine_colour"));
    cJSON_Delete(root);
    assert_a_plot("levels.svg", "128");
    program_call(&r, "bench levels --field spheres");
    assert_fails(&r, 2);
    program_call(&r, "bench levels --finest 100");
    assert_fails(&r, 2);
}

/* Returns the maximum error on the view axis, by the formulas of render/splat.h. With t, the
 * distance from the centre in standard deviations, the exact form divides t^2 by 1 + (t sigma /
 * distance)^2. */
static double max_on_axis(double radii)
{
    const double k = 10.0 / 3, edge = exp(-k * k / 2);
    double max = 0;
    for (double t = 0; t < 1.2 * k; t += 1e-3) {
        double exact = t * t / (1 + pow(t / (k * radii), 2));
        double is = t < k ? exp(-t * t / 2) - edge : 0;
        max = fmax(max, fabs(is - fmax(0, exp(-exact / 2) - edge)));
    }
    return 100 * max / (1 - edge);
}

static void ewa_compares_splats_and_pictures(void **state)
{
    (void)state;
    cJSON *root = bench("ewa block.trip --size 24x20 --repeat 2");
    const cJSON *rows = rows_of(root, "splats"), *row;
    int checked = 0;
    cJSON_ArrayForEach(row, rows)
    {
        if (number(row, "angle") > 0)
            continue;
        double expected = max_on_axis(number(row, "distance"));
        assert_true(fabs(number(row, "max") - expected) < 0.01 * expected + 1e-4);
        assert_true(number(row, "sum") <= 0 && -number(row, "sum") <= number(row, "mean") + 1e-9);
        checked++;
    }
    assert_true(checked >= 5);
    rows = rows_of(root, "pictures");
    assert_true(cJSON_GetArraySize(rows) >= 3);
    cJSON_ArrayForEach(row, rows)
    {
        assert_close(number(row, "ratio"), number(row, "ewa_ms") / number(row, "exact_ms"));
        assert_true(number(row, "mean") <= number(row, "max"));
    }
    assert_true(number(cJSON_GetArrayItem(rows, 0), "max") <
                number(cJSON_GetArrayItem(rows, cJSON_GetArraySize(rows) - 1), "max"));
    cJSON_Delete(root);
}

static void printed_tables_name_the_command_and_their_limits(void **state)
{
    (void)state;
    program_run r;
    program_call(&r, "bench orders block.trip --renderer cpu --size 32x32 --repeat 1");
    assert_works(&r);
    assert_non_null(strstr(r.out, "triptych bench orders block.trip --renderer cpu --size 32x32"));
    assert_non_null(strstr(r.out, "| merge, h = 0.85 |"));
    assert_non_null(strstr(r.out, "\nWhat the figures mean\n"));
    assert_non_null(strstr(r.out, "\nMachine\n"));
}

static void wrong_usage_is_refused_in_one_line(void **state)
{
    (void)state;
    static const char *const wrong[] = {
        "bench sideways block.trip",
        "bench orders block.trip block.trip",
        "bench orders block.trip --views 3",
        "bench orders block.trip --no-counts",
        "bench orders block.trip --engine pread",
        "bench orders block.trip --size 32x32,64x64",
        "bench orders block.trip --renderer cpu,gl",
        "bench submit block.trip --renderer cpu",
        "bench submit block.trip --culling none",
        "bench orders block.trip --culling two-points",
        "bench renderers block.trip --engine pread",
        "bench renderers block.trip --renderer none",
        "bench stream block.trip --views 2",
        "bench stream block.trip --classify never",
        "bench renderers block.trip --classify never",
        "bench stream block.trip --occluded skip --renderer gl",
        "bench stream block.trip --occluded skip --renderer reference",
        "bench renderers block.trip --occluded skip --renderer gl,reference",
        "bench popping block.trip --finest 256",
        "bench levels block.trip --finest 128",
        "bench levels block.trip --field cloud",
        "bench levels block.trip --plot x.svg",
        "bench orders block.trip --repeat 0",
        "bench orders block.trip --size 0x32",
        "bench orders block.trip --threads 1,2",
        "bench renderers block.trip --threads 1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1",
    };
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
        program_run r;
        program_call(&r, "%s", wrong[i]);
        assert_fails(&r, 2);
    }
}

static void impossible_measurements_fail_in_one_line(void **state)
{
    (void)state;
    program_run r;
    program_call(&r, "bench orders missing.trip");
    assert_fails(&r, 1);
    program_call(&r, "bench orders block.trip --renderer cpu --memory 1M");
    assert_fails(&r, 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(orders_draws_three_times_at_h_0_and_once_from_the_side),
        cmocka_unit_test(stream_reads_the_files_of_all_lists),
        cmocka_unit_test(stream_of_post_reads_values_and_halo),
        cmocka_unit_test(renderers_has_a_row_for_each_renderer_size_and_threads),
        cmocka_unit_test(the_first_row_of_renderers_is_the_default_of_render),
        cmocka_unit_test(the_default_is_seen_as_by_render),
        cmocka_unit_test(tables_name_the_options_of_render),
        cmocka_unit_test(renderers_reports_each_view_without_counts_too),
        cmocka_unit_test(normal_reads_transparent_voxels_too),
        cmocka_unit_test(submit_compares_methods_of_gl),
        cmocka_unit_test(without_a_table_bench_lists_tables_and_runs_a_short_one),
        cmocka_unit_test(variants_compares_the_papers_with_the_default_picture),
        cmocka_unit_test(only_axis_pops),
        cmocka_unit_test(a_plot_replaces_no_input_file),
        cmocka_unit_test(levels_of_a_uniform_block_are_close_to_the_finest),
        cmocka_unit_test(levels_without_a_data_set_samples_a_field),
        cmocka_unit_test(flight_ends_with_the_picture_of_render),
        cmocka_unit_test(ewa_compares_splats_and_pictures),
        cmocka_unit_test(printed_tables_name_the_command_and_their_limits),
        cmocka_unit_test(wrong_usage_is_refused_in_one_line),
        cmocka_unit_test(impossible_measurements_fail_in_one_line),
    };
    return cmocka_run_group_tests(tests, enter, program_leave_folder);
}
