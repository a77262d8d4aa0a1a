/* Tests with bytes damaged on disk or during reads. A frame gives the same picture or fails with
 * one line that names the file. After a fault during reads, the next frame is complete. */
#include "cloud.h"
#include "renderer_choice.h"
#include "rounds.h"
#include "scenes.h"
#include "test.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { SIZE = 32, FLIPS = 500, CUTS = 95 };

static const size_t picture_bytes = (size_t)SIZE * SIZE * 4 * sizeof(float);

static struct {
    scene scene;
    char files[CLOUD_FILES][400];
    unsigned file_count;
    float wanted[SIZE * SIZE * 4];
} shared;

static unsigned random_below(unsigned count)
{
    return (unsigned)(test_random() * count);
}

/* All objects that draw a frame, from the data set to the renderer. */
typedef struct drawing {
    trip_budget *budget;
    trip_dataset *data;
    trip_camera camera;
    trip_settings settings;
    trip_plan plan;
    trip_renderer *renderer;
    trip_reader *reader;
} drawing;

static void close_drawing(drawing *d)
{
    trip_reader_destroy(d->reader);
    if (d->renderer)
        d->renderer->ops->destroy(d->renderer);
    trip_plan_release(&d->plan, d->budget);
    trip_dataset_close(d->data);
    trip_budget_destroy(d->budget);
}

static int open_drawing(drawing *d, trip_renderer_kind kind, trip_reader_params params)
{
    memset(d, 0, sizeof *d);
    assert_int_equal(trip_budget_create(&d->budget, UINT64_C(1) << 28), 0);
    int status = trip_dataset_open(&d->data, shared.scene.path, d->budget);
    if (status)
        return status;
    trip_camera_params view = scene_view(&shared.scene, trip_v3(1, 0.8, -0.3), 45, 45, SIZE);
    d->settings = trip_settings_default();
    d->settings.h = 0.8;
    assert_int_equal(trip_camera_make(&d->camera, &view, &d->data->index_to_world), 0);
    status =
        trip_plan_make(&d->plan, d->data, &d->camera, &d->settings, shared.scene.table, d->budget);
    params.planes = d->plan.planes;
    if (!status)
        status = trip_renderer_create(&d->renderer, kind, 2, d->budget);
    return status ? status : trip_reader_create(&d->reader, d->data, &params, d->budget);
}

static int draw_frame(drawing *d, float *rgba)
{
    trip_frame_stats stats;
    trip_frame frame = { .data = d->data,
                         .camera = &d->camera,
                         .settings = &d->settings,
                         .plan = &d->plan,
                         .table = shared.scene.table };
    return trip_frame_draw(d->renderer, d->reader, &frame, rgba, NULL, &stats);
}

static void find_files(void)
{
    DIR *folder = opendir(shared.scene.path);
    assert_non_null(folder);
    for (struct dirent *e = readdir(folder); e; e = readdir(folder)) {
        if (e->d_name[0] == '.')
            continue;
        assert_true(shared.file_count < CLOUD_FILES);
        snprintf(shared.files[shared.file_count++], sizeof shared.files[0], "%s/%s",
                 shared.scene.path, e->d_name);
    }
    closedir(folder);
    assert_int_equal(shared.file_count, CLOUD_FILES);
}

static int set_up(void **state)
{
    drawing d;
    (void)state;
    cloud_create(&shared.scene);
    scene_colour(&shared.scene, 10000, 49999, 1, 0.4, 0.1, 0.1);
    scene_colour(&shared.scene, 50000, 65535, 0.2, 0.6, 1, 0.9);
    find_files();
    assert_int_equal(open_drawing(&d, TRIP_RENDERER_CPU, (trip_reader_params){ 0 }), 0);
    assert_int_equal(draw_frame(&d, shared.wanted), 0);
    close_drawing(&d);
    return 0;
}

static int tear_down(void **state)
{
    (void)state;
    scene_destroy(&shared.scene);
    return 0;
}

static const trip_engine engines[] = { TRIP_ENGINE_AUTO, TRIP_ENGINE_PREAD, TRIP_ENGINE_NULL };

/* Draws a frame of the files on disk with a random engine. Returns whether it succeeded. */
static bool judge(const char *file)
{
    static float rgba[SIZE * SIZE * 4];
    drawing d;
    test_catch_reports();
    trip_reader_params params = { .engine = engines[random_below(3)] };
    int status = open_drawing(&d, TRIP_RENDERER_CPU, params);
    if (!status)
        status = draw_frame(&d, rgba);
    int reports = test_caught_reports();
    close_drawing(&d);
    if (status == 0) {
        assert_int_equal(reports, 0);
        assert_memory_equal(rgba, shared.wanted, picture_bytes);
        return true;
    }
    assert_int_equal(reports, 1);
    if (!strstr(test_last_report, file))
        fail_msg("%s is damaged, but: %s", file, test_last_report);
    return false;
}

static long file_bytes(const char *file)
{
    struct stat st;
    assert_int_equal(stat(file, &st), 0);
    return (long)st.st_size;
}

static void change(const char *file, long at, unsigned char bits)
{
    unsigned char byte;
    int fd = open(file, O_RDWR);
    assert_int_equal(pread(fd, &byte, 1, at), 1);
    byte ^= bits;
    assert_int_equal(pwrite(fd, &byte, 1, at), 1);
    close(fd);
}

static void a_flipped_byte_ends_the_frame_or_changes_nothing(void **state)
{
    int flips = limits_rounds(FLIPS), drawn = 0;
    (void)state;
    for (int i = 0; i < flips; i++) {
        const char *file = shared.files[random_below(shared.file_count)];
        long at = (long)(test_random() * (double)file_bytes(file));
        unsigned char bits = (unsigned char)(1 + random_below(255));
        change(file, at, bits);
        drawn += judge(file);
        change(file, at, bits);
    }
    print_message("%d bytes changed: %d errors, %d same pictures\n", flips, flips - drawn, drawn);
    assert_true(drawn < flips);
    assert_true(judge(""));
}

static void copy_file(const char *from, const char *to)
{
    char command[1200];
    snprintf(command, sizeof command, "cp '%s' '%s'", from, to);
    assert_int_equal(system(command), 0);
}

/* Returns the path that holds the sound file while a damaged file replaces it. */
static const char *spare(void)
{
    static char path[512];
    snprintf(path, sizeof path, "%s/copy", shared.scene.folder);
    return path;
}

static void cut_to(const char *file, long length)
{
    copy_file(file, spare());
    assert_int_equal(truncate(file, length), 0);
    assert_false(judge(file));
    assert_int_equal(rename(spare(), file), 0);
}

static void a_file_of_any_other_length_ends_the_frame(void **state)
{
    (void)state;
    for (int i = 0; i < limits_rounds(CUTS); i++) {
        const char *file = shared.files[(unsigned)i % shared.file_count];
        long whole = file_bytes(file), length = (long)(test_random() * 1.1 * (double)whole);
        cut_to(file, length == whole ? whole + 1 : length);
    }
    for (unsigned i = 0; i < shared.file_count; i++) {
        long whole = file_bytes(shared.files[i]);
        const long lengths[] = { 0,         1,         1023,      1024,        4096,
                                 whole - 4, whole - 1, whole + 1, whole + 4096 };
        for (size_t k = 0; k < sizeof lengths / sizeof *lengths; k++)
            cut_to(shared.files[i], lengths[k] == whole ? whole / 2 : lengths[k]);
    }
    assert_true(judge(""));
}

/* The planes of normals have equal lengths for all three axes. */
static void a_swapped_file_ends_the_frame(void **state)
{
    const unsigned step = TEST_BY_TURNS ? 4 : 1;
    (void)state;
    for (unsigned i = 0; i < shared.file_count; i++) {
        copy_file(shared.files[i], spare());
        for (unsigned k = i % step; k < shared.file_count; k += step) {
            if (k == i)
                continue;
            copy_file(shared.files[k], shared.files[i]);
            assert_false(judge(shared.files[i]));
        }
        assert_int_equal(rename(spare(), shared.files[i]), 0);
    }
    assert_true(judge(""));
}

/* A fault in the read of a frame that `countdown` reads precede. */
typedef struct mishap {
    enum { FAILS, ENDS, COMES_SHORT, COMES_CHANGED, IS_INTERRUPTED, MISHAPS } kind;
    _Atomic int countdown;
} mishap;

static long happen(void *user, void *data, uint64_t offset, size_t bytes, long result)
{
    mishap *m = user;
    long somewhere = result > 0 ? (long)(offset / 7 + bytes) % result : 0;
    if (m->countdown-- != 0 || result <= 0)
        return result;
    switch (m->kind) {
    case FAILS:
        return -EIO;
    case ENDS:
        return 0;
    case COMES_SHORT:
        return 1 + somewhere;
    case COMES_CHANGED:
        ((unsigned char *)data)[somewhere] ^= 4;
        return result;
    default:
        return -EINTR;
    }
}

/* Applies a mishap to every fifteenth read of a frame. Each mishap starts at another read. A frame
 * recovers from short and interrupted reads. */
static void check_mishaps(trip_renderer_kind kind, trip_engine engine, int name,
                          const float *wanted)
{
    static float rgba[SIZE * SIZE * 4];
    mishap m = { .countdown = -1 };
    drawing d;
    m.kind = name;
    trip_reader_params params = {
        .engine = engine, .slots = 3, .slot_bytes = 8192, .fault = happen, .fault_user = &m
    };
    assert_int_equal(open_drawing(&d, kind, params), 0);
    for (int at = name;; at += 15) {
        m.countdown = at;
        test_catch_reports();
        int status = draw_frame(&d, rgba);
        bool happened = m.countdown < 0;
        bool fatal = name == FAILS || name == ENDS || name == COMES_CHANGED;
        assert_int_equal(test_caught_reports(), fatal && happened);
        assert_int_equal(status < 0, fatal && happened);
        if (status == 0)
            assert_memory_equal(rgba, wanted, picture_bytes);
        if (!happened)
            break;
        m.countdown = -1;
        assert_int_equal(draw_frame(&d, rgba), 0);
        assert_memory_equal(rgba, wanted, picture_bytes);
    }
    close_drawing(&d);
}

static void failed_short_or_damaged_reads_do_no_harm(void **state)
{
    static float wanted[SIZE * SIZE * 4];
    const trip_renderer_kind kinds[] = { TRIP_RENDERER_CPU, TRIP_RENDERER_REFERENCE };
    (void)state;
    for (int k = 0; k < 2; k++) {
        drawing d;
        assert_int_equal(open_drawing(&d, kinds[k], (trip_reader_params){ 0 }), 0);
        assert_int_equal(draw_frame(&d, wanted), 0);
        close_drawing(&d);
        for (int name = 0; name < MISHAPS; name++)
            for (int engine = 0; engine < 2; engine++)
                check_mishaps(kinds[k], engines[engine], name, wanted);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_flipped_byte_ends_the_frame_or_changes_nothing),
        cmocka_unit_test(a_file_of_any_other_length_ends_the_frame),
        cmocka_unit_test(a_swapped_file_ends_the_frame),
        cmocka_unit_test(failed_short_or_damaged_reads_do_no_harm),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
