#include "volume_files.h"

#include <pthread.h>

static trip_budget *budget;

static trip_volume *open_sample(trip_scalar type, const trip_volume_params *extra)
{
    bytes b = { .count = 0 };
    trip_volume *v;
    trip_volume_params p = extra ? *extra : (trip_volume_params){ 0 };
    append_volume(&b, type, true);
    p.raw_dims[0] = NX, p.raw_dims[1] = NY, p.raw_dims[2] = NZ;
    p.raw_type = trip_scalar_name(type);
    p.raw_endian = 2;
    assert_int_equal(trip_volume_open(&v, write_file("sample.raw", &b), &p, budget), 0);
    return v;
}

static int make_budget(void **state)
{
    (void)state;
    return trip_budget_create(&budget, 1 << 20);
}

static int end_budget(void **state)
{
    (void)state;
    bool all_returned = trip_budget_left_bytes(budget) == trip_budget_limit_bytes(budget);
    trip_budget_destroy(budget);
    return all_returned ? 0 : -1;
}

static void portions_are_slabs_that_cover_the_volume_once(void **state)
{
    (void)state;
    for (int64_t hint = 0; hint <= NZ + 3; hint++) {
        trip_volume *v = open_sample(TRIP_U16, NULL);
        trip_volume_portion portion;
        int64_t next = 0;
        while (trip_volume_next(v, hint, &portion) == 1) {
            assert_int_equal(portion.origin[0], 0);
            assert_int_equal(portion.origin[1], 0);
            assert_int_equal(portion.origin[2], next);
            assert_int_equal(portion.size[0], NX);
            assert_int_equal(portion.size[1], NY);
            int64_t left = NZ - next;
            assert_int_equal(portion.size[2], hint == 0 || hint > left ? left : hint);
            next += portion.size[2];
            trip_portion_release(v, &portion);
        }
        assert_int_equal(next, NZ);
        assert_int_equal(trip_volume_next(v, hint, &portion), 0);
        trip_volume_close(v);
    }
}

static int clamp(int v, int n)
{
    return v < 0 ? 0 : v >= n ? n - 1 : v;
}

/* Compares a box of a portion with the sample's formula. The values at the edges of the volume
 * repeat beyond it. */
static void assert_box(const trip_volume *v, const trip_volume_portion *portion,
                       const int64_t lo[3], const int64_t size[3])
{
    float values[(NX + 2) * (NY + 2) * (NZ + 2)], *value = values;
    uint8_t active[(NX + 2) * (NY + 2) * (NZ + 2)], *mark = active;
    assert_int_equal(trip_portion_decode(v, portion, lo, size, values, active), 0);
    for (int k = (int)lo[2]; k < lo[2] + size[2]; k++)
        for (int j = (int)lo[1]; j < lo[1] + size[1]; j++)
            for (int i = (int)lo[0]; i < lo[0] + size[0]; i++) {
                int ci = clamp(i, NX), cj = clamp(j, NY), ck = clamp(k, NZ);
                assert_true(*value++ == (float)sample(TRIP_I16, ci, cj, ck));
                assert_int_equal(*mark++, ci == i && cj == j && ck == k);
            }
}

static void every_box_decodes_with_repeated_edges(void **state)
{
    (void)state;
    for (int64_t hint = 1; hint <= NZ; hint += 2) {
        trip_volume *v = open_sample(TRIP_I16, NULL);
        trip_volume_portion portion;
        while (trip_volume_next(v, hint, &portion) == 1) {
            int64_t first = portion.origin[2] - 1, depth = portion.size[2] + 2;
            for (int64_t i = -1; i <= NX; i++)
                for (int64_t w = 1; i + w <= NX + 1; w++)
                    for (int64_t j = -1; j <= NY; j += 2) {
                        assert_box(v, &portion, (int64_t[3]){ i, -1, first },
                                   (int64_t[3]){ w, NY + 2, depth });
                        assert_box(v, &portion, (int64_t[3]){ i, j, first + depth - 1 },
                                   (int64_t[3]){ w, 1, 1 });
                    }
            trip_portion_release(v, &portion);
        }
        trip_volume_close(v);
    }
}

static void a_volume_of_one_voxel_repeats_it_on_all_sides(void **state)
{
    (void)state;
    trip_volume *v;
    trip_volume_portion portion;
    float values[27];
    uint8_t active[27];
    const trip_volume_params p = { .raw_dims = { 1, 1, 1 } };
    assert_int_equal(trip_volume_open(&v, write_bytes("one.raw", "*", 1), &p, budget), 0);
    assert_int_equal(trip_volume_next(v, 4, &portion), 1);
    const int64_t lo[3] = { -1, -1, -1 }, size[3] = { 3, 3, 3 };
    assert_int_equal(trip_portion_decode(v, &portion, lo, size, values, active), 0);
    for (int i = 0; i < 27; i++) {
        assert_true(values[i] == '*');
        assert_int_equal(active[i], i == 13);
    }
    trip_portion_release(v, &portion);
    trip_volume_close(v);
}

static void a_box_outside_the_portion_is_refused(void **state)
{
    (void)state;
    trip_volume *v = open_sample(TRIP_U8, NULL);
    trip_volume_portion portion;
    float values[VOXELS];
    assert_int_equal(trip_volume_next(v, 2, &portion), 1);
    catch_reports();
    assert_int_equal(trip_portion_decode(v, &portion, (int64_t[3]){ 0, 0, 2 },
                                         (int64_t[3]){ 1, 1, 2 }, values, NULL),
                     TRIP_ERROR);
    assert_int_equal(trip_portion_decode(v, &portion, (int64_t[3]){ -2, 0, 0 },
                                         (int64_t[3]){ 1, 1, 1 }, values, NULL),
                     TRIP_ERROR);
    trip_report_redirect(NULL, NULL);
    trip_portion_release(v, &portion);
    trip_volume_close(v);
}

static void portions_live_until_they_are_released(void **state)
{
    (void)state;
    trip_volume *v = open_sample(TRIP_I16, NULL);
    trip_volume_portion portions[NZ];
    for (int k = 0; k < NZ; k++)
        assert_int_equal(trip_volume_next(v, 1, &portions[k]), 1);
    for (int k = 0; k < NZ; k++) {
        assert_box(v, &portions[k], (int64_t[3]){ -1, -1, k - 1 },
                   (int64_t[3]){ NX + 2, NY + 2, 3 });
        trip_portion_release(v, &portions[k]);
        assert_null(portions[k].data);
        trip_portion_release(v, &portions[k]);
    }
    trip_volume_close(v);
}

static pthread_mutex_t reading = PTHREAD_MUTEX_INITIALIZER;

/* Takes portions under a lock that the threads share, then decodes and releases them without it. */
static void *decode_portions(void *volume)
{
    trip_volume *v = volume;
    trip_volume_portion portion;
    bool *right = malloc(sizeof *right);
    *right = true;
    for (;;) {
        float values[NX * NY];
        pthread_mutex_lock(&reading);
        int status = trip_volume_next(v, 1, &portion);
        pthread_mutex_unlock(&reading);
        if (status <= 0)
            break;
        status = trip_portion_decode(v, &portion, portion.origin, portion.size, values, NULL);
        for (int i = 0; i < NX * NY; i++)
            *right = *right && status == 0 &&
                     values[i] == (float)sample(TRIP_I16, i % NX, i / NX, (int)portion.origin[2]);
        trip_portion_release(v, &portion);
    }
    return right;
}

static void portions_may_be_decoded_and_released_by_other_threads(void **state)
{
    (void)state;
    enum { THREADS = 4 };
    trip_volume *v = open_sample(TRIP_I16, NULL);
    for (int round = 0; round < 50; round++) {
        pthread_t threads[THREADS];
        for (int t = 0; t < THREADS; t++)
            assert_int_equal(pthread_create(&threads[t], NULL, decode_portions, v), 0);
        for (int t = 0; t < THREADS; t++) {
            void *right;
            assert_int_equal(pthread_join(threads[t], &right), 0);
            assert_true(*(bool *)right);
            free(right);
        }
        assert_int_equal(trip_volume_rewind(v), 0);
    }
    trip_volume_close(v);
}

static void rewinding_restarts_even_in_mid_volume(void **state)
{
    (void)state;
    trip_volume *v = open_sample(TRIP_I16, NULL);
    for (int stop = 0; stop <= NZ; stop++) {
        trip_volume_portion portion;
        for (int k = 0; k < stop; k++) {
            assert_int_equal(trip_volume_next(v, 1, &portion), 1);
            assert_int_equal(portion.origin[2], k);
            assert_box(v, &portion, (int64_t[3]){ 0, 0, k }, (int64_t[3]){ NX, NY, 1 });
            trip_portion_release(v, &portion);
        }
        assert_int_equal(trip_volume_rewind(v), 0);
    }
    trip_volume_close(v);
}

static void the_budget_counts_slabs_and_can_refuse_them(void **state)
{
    (void)state;
    trip_volume *v;
    trip_volume_portion portion;
    const trip_volume_params p = { .raw_dims = { 1024, 1024, 4 } };
    const char *path = path_of("sparse.raw");
    FILE *f = fopen(path, "wb");
    assert_non_null(f);
    assert_int_equal(fclose(f), 0);
    assert_int_equal(truncate(path, 4 << 20), 0);
    assert_int_equal(trip_volume_open(&v, path, &p, budget), 0);
    catch_reports();
    assert_int_equal(trip_volume_next(v, 1, &portion), TRIP_ERROR);
    trip_report_redirect(NULL, NULL);
    assert_int_equal(reports, 1);
    assert_non_null(strstr(reported, "--memory"));
    trip_volume_close(v);
}

static void a_read_that_fails_in_mid_volume_stays_failed(void **state)
{
    (void)state;
    trip_volume *v = open_sample(TRIP_U8, NULL);
    trip_volume_portion portion;
    assert_int_equal(trip_volume_next(v, 2, &portion), 1);
    trip_portion_release(v, &portion);
    assert_int_equal(truncate(path_of("sample.raw"), 4 * NX * NY), 0);
    catch_reports();
    assert_int_equal(trip_volume_next(v, 2, &portion), TRIP_ERROR);
    assert_int_equal(trip_volume_next(v, 2, &portion), TRIP_ERROR);
    trip_report_redirect(NULL, NULL);
    assert_int_equal(reports, 1);
    assert_int_equal(trip_volume_rewind(v), 0); /* the file can be read again up to its end */
    assert_int_equal(trip_volume_next(v, 2, &portion), 1);
    trip_portion_release(v, &portion);
    trip_volume_close(v);
}

static void spacing_replaces_lengths_and_keeps_directions(void **state)
{
    (void)state;
    bytes b = { .count = 0 };
    float values[VOXELS];
    trip_volume_info info;
    append_text(&b, "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 5 4 7\nencoding: raw\n"
                    "space: right-anterior-superior\n"
                    "space directions: (0,3,4) (0,-8,6) (-5,0,0)\nspace origin: (1,2,3)\n\n");
    append_volume(&b, TRIP_U8, false);
    const trip_volume_params p = { .spacing = { 1, 2, 3 } };
    assert_int_equal(read_volume(write_file("turned.nrrd", &b), &p, 2, values, VOXELS, &info), 0);
    assert_map(&info.index_to_world,
               (const double[3][4]){ { 0, 0, -3, 1 }, { 0.6, -1.6, 0, 2 }, { 0.8, 1.2, 0, 3 } });
}

/* The files give no orientation. The option says x up, y left and z back, which are +z, +x and +y
 * of LPS. Each axis keeps its spacing. */
static void axes_orient_files_without_orientation(void **state)
{
    (void)state;
    const char head[] = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 5 4 7\nencoding: raw\n";
    bytes up = { .count = 0 }, down = { .count = 0 };
    float values[VOXELS];
    trip_volume_info info;
    append_text(&up, head);
    append_text(&up, "spacings: 1 2 3\naxis mins: 10 20 30\ncenterings: node node node\n\n");
    append_volume(&up, TRIP_U8, false);
    const trip_volume_params p = { .axes = "SLP" };
    assert_int_equal(read_volume(write_file("up.nrrd", &up), &p, 2, values, VOXELS, &info), 0);
    assert_map(&info.index_to_world,
               (const double[3][4]){ { 0, -2, 0, -20 }, { 0, 0, -3, -30 }, { 1, 0, 0, 10 } });
    assert_string_equal(info.space, "RAS");
    append_text(&down, head);
    append_text(&down, "spacings: 1 -2 3\n\n");
    append_volume(&down, TRIP_U8, false);
    assert_refused_as(TRIP_USAGE, write_file("down.nrrd", &down), &p,
                      "gives the directions of its axes");
}

static void options_of_another_format_are_wrong_usage(void **state)
{
    (void)state;
    bytes b = { .count = 0 };
    append_text(&b, "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 5 4 7\nencoding: raw\n\n");
    append_volume(&b, TRIP_U8, false);
    const char *nrrd = write_file("options.nrrd", &b);
    static const trip_volume_params wrong[] = {
        { .raw_dims = { 5, 4, 7 } }, { .raw_type = "uint8" },
        { .raw_endian = 1 },         { .raw_offset_bytes = 1 },
        { .grid = "density" },       { .level_set = TRIP_LEVEL_SET_FILLED },
    };
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++)
        assert_refused_as(TRIP_USAGE, nrrd, &wrong[i], "its format is nrrd");
    static const double spacings[][3] = { { 1, 0, 1 }, { 0, 0, 1 }, { -1, 1, 1 }, { NAN, 1, 1 } };
    for (size_t i = 0; i < sizeof spacings / sizeof spacings[0]; i++) {
        trip_volume_params p = { .spacing = { spacings[i][0], spacings[i][1], spacings[i][2] } };
        assert_refused_as(TRIP_USAGE, nrrd, &p, "--spacing");
    }
}

/* Files of formats that are read in order. */
static void compressed_files_are_read_whatever_their_names(void **state)
{
    (void)state;
    static const char *const names[] = { "x.nrrd.gz", "x.bz2", "x.nii", "x.vol" };
    for (int format = 0; format < 4; format++)
        for (int name = 0; name < 4; name++)
            for (int bz2 = 0; bz2 < 2; bz2++) {
                bytes b = { .count = 0 }, packed = { .count = 0 };
                unsigned char head[352] = { 92, 1, [40] = 3, 0, NX, 0, NY, 0, NZ, [70] = 2, 0, 8 };
                const float one = 1, offset = 352;
                for (int a = 1; a < 4; a++)
                    memcpy(head + 76 + 4 * a, &one, 4);
                memcpy(head + 108, &offset, 4);
                memcpy(head + 344, "n+1", 4);
                if (format == 0)
                    append_text(&b, "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 5 4 7\n"
                                    "encoding: raw\n\n");
                else if (format == 1)
                    append_text(&b, "X: 5\nY: 4\nZ: 7\nVersion: 2\n.\n");
                else if (format == 2)
                    append(&b, head, sizeof head);
                const trip_volume_params raw = { .raw_dims = { NX, NY, NZ } };
                append_volume(&b, TRIP_U8, false);
                if (bz2)
                    append_bzip2(&packed, &b);
                else
                    append_gzip(&packed, &b);
                if (format < 3 || name < 2)
                    assert_holds_sample(write_file(names[name], &packed), format == 3 ? &raw : NULL,
                                        TRIP_U8);
                packed.count -= 9;
                if (format < 3)
                    assert_true(survives(write_file(names[name], &packed), NULL));
            }
}

static void compressed_files_of_other_formats_are_refused(void **state)
{
    (void)state;
    static const struct {
        char head[9];
        const char *says;
    } formats[] = {
        { "II*\0\10", "its format (images) can only be read unpacked" },
        { "\x89HDF\r\n\x1a\n", "its format (netcdf) can only be read unpacked" },
        { "CDF\1", "its format (netcdf) can only be read unpacked" },
        { " BDV\0\0\0\0", "its format (openvdb) can only be read unpacked" },
        { "hello", "is of no known format" },
    };
    for (size_t i = 0; i < sizeof formats / sizeof *formats; i++) {
        bytes b = { .count = 0 }, packed = { .count = 0 };
        append(&b, formats[i].head, 8);
        b.count = 400;
        append_gzip(&packed, &b);
        assert_refused(write_file("packed.gz", &packed), formats[i].says);
    }
    assert_refused(write_bytes("short.gz", "\x1f\x8b\x08", 3), "is of no known format");
    bytes b = { .count = 0 }, values = { .count = 0 }, packed = { .count = 0 };
    append_text(&b, "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 5 4 7\nencoding: gzip\n\n");
    append_volume(&values, TRIP_U8, false);
    append_gzip(&b, &values);
    append_gzip(&packed, &b);
    assert_refused(write_file("twice.nrrd.gz", &packed), "unpack it first");
}

/* Values that begin like a gzip file. */
static void plain_values_may_look_compressed(void **state)
{
    (void)state;
    unsigned char values[8] = { 0x1f, 0x8b, 8, 0, 5, 6, 7, 9 };
    float got[8];
    const trip_volume_params params = { .raw_dims = { 2, 2, 2 } };
    assert_int_equal(read_volume(write_bytes("looks.raw", values, 8), &params, 1, got, 8, NULL), 0);
    assert_true(got[0] == 0x1f && got[7] == 9);
    values[0] = 0;
    assert_int_equal(read_volume(write_bytes("plain.gz", values, 8), &params, 1, got, 8, NULL), 0);
    assert_refused_as(TRIP_ERROR, write_bytes("plain.gz", values, 7), &params,
                      "neither gzip nor bzip2");
}

static void errors_name_the_file_that_cannot_be_opened(void **state)
{
    (void)state;
    assert_refused(path_of("missing.nrrd"), "missing.nrrd: cannot open: No such file");
    assert_refused(write_bytes("empty.nrrd", "", 0), "is empty");
    assert_refused(write_bytes("text.txt", "hello", 5), "is text, not a volume");
    assert_refused("/dev/null", "not a regular file");
}

/* The system denies root nothing, so the test needs another user. */
static void errors_name_a_file_without_permission(void **state)
{
    (void)state;
    const char *path = write_bytes("secret.nrrd", "NRRD0004\n", 9);
    uid_t user = geteuid();
    assert_int_equal(chmod(path, 0), 0);
    assert_int_equal(user ? 0 : seteuid(65534), 0);
    assert_refused(path, "Permission denied");
    assert_int_equal(seteuid(user), 0);
}

static void voxels_too_long_or_short_to_draw_are_refused(void **state)
{
    (void)state;
    bytes b = { .count = 0 };
    append_volume(&b, TRIP_U8, false);
    const char *raw = write_file("long.raw", &b);
    const double lengths[] = { 1e300, 1e33, 1e-33, 1e-300 };
    for (size_t i = 0; i < sizeof lengths / sizeof *lengths; i++) {
        const trip_volume_params p = { .raw_dims = { NX, NY, NZ },
                                       .raw_type = "uint8",
                                       .spacing = { 1, lengths[i], 1 } };
        assert_refused_as(TRIP_ERROR, raw, &p, "world units long along j");
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(portions_are_slabs_that_cover_the_volume_once, make_budget,
                                        end_budget),
        cmocka_unit_test_setup_teardown(every_box_decodes_with_repeated_edges, make_budget,
                                        end_budget),
        cmocka_unit_test_setup_teardown(a_volume_of_one_voxel_repeats_it_on_all_sides, make_budget,
                                        end_budget),
        cmocka_unit_test_setup_teardown(a_box_outside_the_portion_is_refused, make_budget,
                                        end_budget),
        cmocka_unit_test_setup_teardown(portions_live_until_they_are_released, make_budget,
                                        end_budget),
        cmocka_unit_test_setup_teardown(portions_may_be_decoded_and_released_by_other_threads,
                                        make_budget, end_budget),
        cmocka_unit_test_setup_teardown(rewinding_restarts_even_in_mid_volume, make_budget,
                                        end_budget),
        cmocka_unit_test_setup_teardown(the_budget_counts_slabs_and_can_refuse_them, make_budget,
                                        end_budget),
        cmocka_unit_test_setup_teardown(a_read_that_fails_in_mid_volume_stays_failed, make_budget,
                                        end_budget),
        cmocka_unit_test(spacing_replaces_lengths_and_keeps_directions),
        cmocka_unit_test(axes_orient_files_without_orientation),
        cmocka_unit_test(voxels_too_long_or_short_to_draw_are_refused),
        cmocka_unit_test(options_of_another_format_are_wrong_usage),
        cmocka_unit_test(compressed_files_are_read_whatever_their_names),
        cmocka_unit_test(compressed_files_of_other_formats_are_refused),
        cmocka_unit_test(plain_values_may_look_compressed),
        cmocka_unit_test(errors_name_the_file_that_cannot_be_opened),
        cmocka_unit_test(errors_name_a_file_without_permission),
    };
    return cmocka_run_group_tests_name("volume", tests, make_folder, remove_folder);
}
