/* Tests of manipulated data sets with valid checksums. The tests set every field of every table,
 * and some records, to values that cause trouble. They do so in lists of voxels and halos at two
 * levels.
 *
 * Opening, verifying and drawing each data set with all renderers succeeds or fails with one line.
 * Every picture drawn has finite numbers. */
#include "cloud.h"
#include "dataset_metadata.h"
#include "hostile.h"
#include "rounds.h"
#include "scenes.h"
#include "test.h"

#include <string.h>

enum { SIZE = 24, RECORDS = 200, SPANS = 60, MEMORY_BYTES = 64 << 20 };

static struct {
    scene scene;
    hostile sound, disk;
    char path[128]; /* path of the changed data set */
    const scene_renderer *renderers;
} shared;

static struct {
    unsigned tried, opened, verified, drawn;
} counts;

static int set_up(void **state)
{
    (void)state;
    cloud_create(&shared.scene);
    scene_colour(&shared.scene, 0, 49999, 1, 0.4, 0.1, 0.1);
    scene_colour(&shared.scene, 50000, 65535, 0.2, 0.6, 1, 0.9);
    hostile_load(&shared.sound, shared.scene.path);
    assert_int_equal(hostile_header(&shared.sound)->list_count, CLOUD_LISTS);
    snprintf(shared.path, sizeof shared.path, "%s/hostile.trip", shared.scene.folder);
    shared.renderers = scene_renderers();
    return 0;
}

static int tear_down(void **state)
{
    (void)state;
    hostile_free(&shared.sound);
    hostile_free(&shared.disk);
    scene_destroy(&shared.scene);
    print_message("%u data sets: %u opened, %u held by their own index, %u pictures\n",
                  counts.tried, counts.opened, counts.verified, counts.drawn);
    return 0;
}

/* Checks that a failure reports one line, and success none. */
static void check_reports(const char *label, const char *step, int status)
{
    int reports = test_caught_reports();
    if (reports != (status < 0))
        fail_msg("%s: %s gave %d and %d lines, the last: %s", label, step, status, reports,
                 test_last_report);
}

static int draw_planned(trip_renderer *renderer, const trip_frame *frame, trip_budget *budget,
                        float *rgba)
{
    trip_reader *reader;
    trip_frame_stats stats;
    const trip_reader_params params = { .planes = frame->plan->planes,
                                        .slots = 3,
                                        .slot_bytes = 65536 };
    int status = trip_reader_create(&reader, frame->data, &params, budget);
    if (status)
        return status;
    status = trip_frame_draw(renderer, reader, frame, rgba, NULL, &stats);
    trip_reader_destroy(reader);
    return status;
}

static int draw(const trip_dataset *data, const scene_renderer *by, trip_classify classify,
                trip_budget *budget, float *rgba)
{
    trip_camera camera;
    trip_plan plan;
    trip_renderer *renderer;
    trip_settings settings = trip_settings_default();
    trip_camera_params view = scene_view(&shared.scene, trip_v3(1, 0.8, -0.3), 45, 45, SIZE);
    settings.h = 0.8;
    settings.classify = classify;
    settings.compositing = (trip_compositing)(counts.tried / 2 % 2);
    int status = trip_camera_make(&camera, &view, &data->index_to_world);
    if (!status)
        status = trip_plan_make(&plan, data, &camera, &settings, shared.scene.table, budget);
    if (status)
        return status;
    status = by->create(&renderer, budget);
    if (!status) {
        const trip_frame frame = { .data = data,
                                   .camera = &camera,
                                   .settings = &settings,
                                   .plan = &plan,
                                   .table = shared.scene.table };
        status = draw_planned(renderer, &frame, budget, rgba);
        renderer->ops->destroy(renderer);
    }
    trip_plan_release(&plan, budget);
    return status;
}

static void check_picture(const char *label, const trip_dataset *data, const scene_renderer *by,
                          trip_classify classify, trip_budget *budget)
{
    static float rgba[SIZE * SIZE * 4];
    test_catch_reports();
    int status = draw(data, by, classify, budget, rgba);
    check_reports(label, by->name, status);
    if (status)
        return;
    counts.drawn++;
    for (int i = 0; i < SIZE * SIZE * 4; i++)
        if (!(rgba[i] >= -0.001 && rgba[i] <= 1.001))
            fail_msg("%s: %s, %s draws %g", label, by->name,
                     classify == TRIP_CLASSIFY_POST ? "post" : "pre", (double)rgba[i]);
}

static void check_text(const char *label, const trip_dataset *data)
{
    trip_dataset_metadata *text = NULL;
    trip_tf *tf = NULL;
    test_catch_reports();
    int status = trip_dataset_metadata_parse(&text, data);
    if (!status)
        status = trip_dataset_metadata_tf(text, data, &tf);
    check_reports(label, "its text", status);
    trip_tf_destroy(tf);
    trip_dataset_metadata_destroy(text);
}

/* Returns whether a renderer draws this data set. The CPU renderer draws every data set, and
 * alternates the classification under sanitizers. The slow renderers alternate, and draw only if
 * `slow` is set. */
static bool takes_part(const scene_renderer *r, trip_classify classify, bool slow)
{
    if (!strcmp(r->name, "cpu"))
        return !TEST_BY_TURNS || counts.tried % 2 == (classify == TRIP_CLASSIFY_POST);
    return slow && counts.tried % 6 == (r == shared.renderers ? 0 : 3);
}

/* Opens, verifies and draws the changed data set. */
static void judge(const char *label, bool slow)
{
    trip_budget *budget;
    trip_dataset *data = NULL;
    assert_int_equal(trip_budget_create(&budget, MEMORY_BYTES), 0);
    counts.tried++;
    test_catch_reports();
    int status = trip_dataset_open(&data, shared.path, budget);
    check_reports(label, "open", status);
    if (!status) {
        counts.opened++;
        check_text(label, data);
        test_catch_reports();
        int verified = trip_dataset_verify(data, budget);
        check_reports(label, "verify", verified);
        counts.verified += verified == 0;
        for (const scene_renderer *r = shared.renderers; r->name; r++)
            if (takes_part(r, TRIP_CLASSIFY_PRE, slow))
                check_picture(label, data, r, TRIP_CLASSIFY_PRE, budget);
        for (const scene_renderer *r = scene_renderers_post(); r->name; r++)
            if (takes_part(r, TRIP_CLASSIFY_POST, slow))
                check_picture(label, data, r, TRIP_CLASSIFY_POST, budget);
        trip_dataset_close(data);
    }
    trip_budget_destroy(budget);
}

/* Tries the sound data set with `bytes` bytes of one file replaced. */
static void judge_changed(const char *label, hostile *h, bool slow)
{
    hostile_seal(h, &shared.sound);
    hostile_write(h, &shared.disk, shared.path);
    hostile_free(h);
    judge(label, slow);
}

static const uint64_t whole_numbers[] = {
    0,
    1,
    2,
    3,
    7,
    63,
    64,
    65,
    127,
    128,
    255,
    256,
    4096,
    32767,
    65535,
    65536,
    0x7fffffff,
    0x80000000,
    0xffffffff,
    UINT64_C(1) << 32,
    UINT64_C(1) << 62,
    INT64_MAX,
    UINT64_C(1) << 63,
    UINT64_MAX - 7,
    UINT64_MAX,
};
enum { WHOLE_NUMBERS = sizeof whole_numbers / sizeof whole_numbers[0] };

static const double real_numbers[] = {
    0.0,   -0.0, -1,   1e-320, 1e-300, 1e-30,    -1e-30,    1e-12, 1e12, -1e12,   1e30,
    -1e30, 1e38, 1e39, 1e300,  -1e300, INFINITY, -INFINITY, NAN,   0.5,  1 << 20,
};
enum { REAL_NUMBERS = sizeof real_numbers / sizeof real_numbers[0] };

/* Sets one integer of the index to each of the values, and to values slightly above and below the
 * original. */
static void try_whole(const char *label, size_t at, size_t bytes)
{
    uint64_t was = 0;
    memcpy(&was, shared.sound.index.data + at, bytes);
    for (int i = 0; i < WHOLE_NUMBERS + 2; i++) {
        char name[96];
        hostile h;
        uint64_t value =
            i < WHOLE_NUMBERS ? whole_numbers[i] : was + (i == WHOLE_NUMBERS ? 1u : -1u);
        if (bytes < 8 && value >> 8 * bytes)
            continue;
        snprintf(name, sizeof name, "%s at byte %zu = %llu", label, at, (unsigned long long)value);
        hostile_copy(&h, &shared.sound);
        memcpy(h.index.data + at, &value, bytes);
        judge_changed(name, &h, i % 9 == 0);
    }
}

static void try_real(const char *label, size_t at)
{
    for (int i = 0; i < REAL_NUMBERS; i++) {
        char name[96];
        hostile h;
        snprintf(name, sizeof name, "%s at byte %zu = %g", label, at, real_numbers[i]);
        hostile_copy(&h, &shared.sound);
        memcpy(h.index.data + at, &real_numbers[i], sizeof real_numbers[i]);
        judge_changed(name, &h, true);
    }
}

static void changed_integers_of_the_header_do_no_harm(void **state)
{
    (void)state;
    for (size_t at = offsetof(trip_file_header, dims);
         at < offsetof(trip_file_header, index_to_world); at += 8)
        try_whole("header", at, 8);
    try_whole("header", offsetof(trip_file_header, version), 4);
    try_whole("header", offsetof(trip_file_header, header_bytes), 4);
    try_whole("header", offsetof(trip_file_header, index_bytes), 8);
    try_whole("header", offsetof(trip_file_header, checksums_offset), 8);
    for (size_t at = offsetof(trip_file_header, voxels); at < offsetof(trip_file_header, tile_log2);
         at += 8)
        try_whole("header", at, 8);
    for (size_t at = offsetof(trip_file_header, tile_log2);
         at < offsetof(trip_file_header, lists_offset); at += 4)
        try_whole("header", at, 4);
    for (size_t at = offsetof(trip_file_header, lists_offset);
         at < offsetof(trip_file_header, reserved) + 8; at += 8)
        try_whole("header", at, 8);
}

static void changed_real_numbers_of_the_header_do_no_harm(void **state)
{
    (void)state;
    for (size_t at = offsetof(trip_file_header, index_to_world);
         at < offsetof(trip_file_header, voxels); at += 8)
        try_real("header", at);
}

/* Scales whole maps and ranges at once, because a change of one number alone is refused. */
static void scaled_maps_and_ranges_do_no_harm(void **state)
{
    static const double scales[] = {
        1e-150, 1e-40, 1e-20, 1e-12, 1e-6, 1e6, 1e12, 1e20, 1e40, 1e99
    };
    (void)state;
    for (size_t i = 0; i < 2 * sizeof scales / sizeof scales[0]; i++) {
        char name[96];
        hostile h;
        double s = scales[i / 2];
        hostile_copy(&h, &shared.sound);
        trip_file_header *header = hostile_header(&h);
        for (int k = 0; k < 12 && i % 2 == 0; k++) {
            header->index_to_world[k] *= s;
            for (unsigned list = 0; list < CLOUD_LISTS; list++)
                hostile_list(&h, &shared.sound, list)->index_to_world[k] *= s;
        }
        if (i % 2 == 1) {
            header->code_lo = header->value_min = -s;
            header->code_hi = header->value_max = s;
            header->gradient_full = s;
        }
        snprintf(name, sizeof name, "%s times %g", i % 2 ? "values" : "space", s);
        judge_changed(name, &h, true);
    }
}

static size_t list_at(unsigned list)
{
    return hostile_header(&shared.sound)->lists_offset + list * sizeof(trip_file_list);
}

static void try_list(const char *label, unsigned list)
{
    for (size_t at = 0; at < offsetof(trip_file_list, dims); at += 4)
        try_whole(label, list_at(list) + at, 4);
    for (size_t at = offsetof(trip_file_list, dims); at < sizeof(trip_file_list); at += 8)
        try_whole(label, list_at(list) + at, 8);
    for (size_t at = offsetof(trip_file_list, index_to_world);
         at < offsetof(trip_file_list, records); at += 8)
        try_real(label, list_at(list) + at);
}

static void changed_lists_do_no_harm(void **state)
{
    (void)state;
    try_list("list Z", CLOUD_VOXELS + 2);
    try_list("halo X", CLOUD_HALO);
    try_list("level 1 Y", CLOUD_COARSE + 1);
}

/* Changes a number in all lists of a level. A change in one list alone is refused. */
static void try_map_of_level(unsigned field, double value)
{
    char name[96];
    hostile h;
    hostile_copy(&h, &shared.sound);
    for (unsigned list = CLOUD_COARSE; list < CLOUD_LISTS; list++) {
        trip_file_list *f = hostile_list(&h, &shared.sound, list);
        double *const at[] = { &f->sheet_first, &f->sheet_step };
        *(field < 12 ? &f->index_to_world[field] : at[field - 12]) = value;
    }
    snprintf(name, sizeof name, "number %u of level 1 = %g", field, value);
    judge_changed(name, &h, true);
}

static void try_size_of_level(unsigned axis, uint64_t voxels)
{
    char name[96];
    hostile h;
    hostile_copy(&h, &shared.sound);
    for (unsigned list = CLOUD_COARSE; list < CLOUD_LISTS; list++)
        hostile_list(&h, &shared.sound, list)->dims[axis] = voxels;
    snprintf(name, sizeof name, "size %u of level 1 = %llu", axis, (unsigned long long)voxels);
    judge_changed(name, &h, true);
}

static void a_changed_grid_of_a_level_does_no_harm(void **state)
{
    (void)state;
    for (int i = 0; i < REAL_NUMBERS; i++)
        for (unsigned field = 0; field < 14; field++)
            try_map_of_level(field, real_numbers[i]);
    for (int i = 0; i < WHOLE_NUMBERS; i++)
        for (unsigned axis = 0; axis < 3; axis++)
            try_size_of_level(axis, whole_numbers[i]);
}

/* Exchanges the tables and planes of two lists. Their axes, levels and kinds stay. */
static void exchange(unsigned a, unsigned b)
{
    char name[96];
    hostile h;
    hostile_copy(&h, &shared.sound);
    trip_file_list *f = hostile_list(&h, &shared.sound, a);
    trip_file_list *g = hostile_list(&h, &shared.sound, b);
    const trip_file_list was = *f;
    size_t head = offsetof(trip_file_list, records);
    memcpy((char *)f + head, (char *)g + head, sizeof *f - head);
    memcpy((char *)g + head, (const char *)&was + head, sizeof *g - head);
    snprintf(name, sizeof name, "lists %u and %u exchanged", a, b);
    judge_changed(name, &h, true);
}

static void exchanged_lists_do_no_harm(void **state)
{
    (void)state;
    for (unsigned a = 0; a < CLOUD_LISTS; a++)
        for (unsigned b = 0; b < a; b++)
            exchange(a, b);
}

static void try_tables(const char *label, unsigned number)
{
    const trip_file_list *list = hostile_list(&shared.sound, &shared.sound, number);
    size_t slab = list->slabs_offset + sizeof(trip_file_slab); /* the second slab */
    size_t brick = list->bricks_offset + sizeof(trip_file_brick);
    size_t run = list->runs_offset + 5 * sizeof(trip_file_run);
    assert_true(list->slab_count > 1 && list->brick_count > 2);
    for (size_t at = 0; at < 24; at += 8)
        try_whole(label, slab + at, 8);
    for (size_t at = 24; at < sizeof(trip_file_slab); at += 4)
        try_whole(label, slab + at, 4);
    for (size_t at = 0; at < 12; at += 4)
        try_whole(label, brick + at, 4);
    for (size_t at = 12; at < 16; at += 2)
        try_whole(label, brick + at, 2);
    for (size_t at = 16; at < sizeof(trip_file_brick); at++)
        try_whole(label, brick + at, 1);
    for (size_t at = 0; at < 5 * sizeof(trip_file_run); at += 2)
        try_whole(label, run + at, 2);
}

static void changed_slabs_bricks_and_runs_do_no_harm(void **state)
{
    (void)state;
    try_tables("tables of Y", CLOUD_VOXELS + 1);
    try_tables("tables of the halo along Z", CLOUD_HALO + 2);
    try_tables("tables of level 1 along X", CLOUD_COARSE);
}

static unsigned random_below(unsigned count)
{
    return (unsigned)(test_random() * count);
}

static void changed_records_do_no_harm(void **state)
{
    int rounds = limits_rounds(RECORDS);
    (void)state;
    for (int i = 0; i < rounds; i++) {
        char name[96];
        hostile h;
        hostile_copy(&h, &shared.sound);
        hostile_file *f = &h.planes[random_below(h.plane_count)];
        unsigned changes = 1u << random_below(12);
        for (unsigned k = 0; k < changes; k++)
            f->data[random_below((unsigned)f->bytes)] = (unsigned char)random_below(256);
        snprintf(name, sizeof name, "%u bytes of %s, round %d", changes, f->name, i);
        judge_changed(name, &h, i % 10 == 0);
    }
}

/* Copies spans of the index over other spans, which changes several numbers at once. */
static void copied_spans_of_the_index_do_no_harm(void **state)
{
    int rounds = limits_rounds(SPANS);
    unsigned content = (unsigned)hostile_header(&shared.sound)->checksums_offset;
    (void)state;
    for (int i = 0; i < rounds; i++) {
        char name[96];
        hostile h;
        unsigned bytes = 8 * (1 + random_below(32));
        unsigned from =
            TRIP_HEADER_BYTES + 8 * random_below((content - TRIP_HEADER_BYTES - bytes) / 8);
        unsigned to =
            TRIP_HEADER_BYTES + 8 * random_below((content - TRIP_HEADER_BYTES - bytes) / 8);
        hostile_copy(&h, &shared.sound);
        memmove(h.index.data + to, h.index.data + from, bytes);
        snprintf(name, sizeof name, "%u bytes from %u to %u", bytes, from, to);
        judge_changed(name, &h, i % 10 == 0);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(changed_integers_of_the_header_do_no_harm),
        cmocka_unit_test(changed_real_numbers_of_the_header_do_no_harm),
        cmocka_unit_test(scaled_maps_and_ranges_do_no_harm),
        cmocka_unit_test(changed_lists_do_no_harm),
        cmocka_unit_test(a_changed_grid_of_a_level_does_no_harm),
        cmocka_unit_test(exchanged_lists_do_no_harm),
        cmocka_unit_test(changed_slabs_bricks_and_runs_do_no_harm),
        cmocka_unit_test(changed_records_do_no_harm),
        cmocka_unit_test(copied_spans_of_the_index_do_no_harm),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
