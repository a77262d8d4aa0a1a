/* Coordinates of the voxels from text files, and the tables and maps made from them. */
#include "volume_files.h"

#include <fcntl.h>
#include <sys/wait.h>

#include "comma_locale.h"
#include "coordinates.h"
#include "volume_coordinates.h"

static trip_budget *budget;

/* Writes the file of an axis. The path stays valid until the next call for that axis. */
static const char *write_text(char axis, const char *text)
{
    static char paths[3][256];
    char *path = paths[axis - 'x'];
    snprintf(path, sizeof *paths, "%s", write_bytes((const char[]){ axis, 0 }, text, strlen(text)));
    return path;
}

static trip_volume_params raw_params(const char *coordinates)
{
    return (trip_volume_params){ .raw_dims = { NX, NY, NZ },
                                 .raw_type = "uint8",
                                 .coordinates = coordinates };
}

static const char *sample_file(void)
{
    bytes b = { .count = 0 };
    append_volume(&b, TRIP_U8, false);
    return write_file("sample.raw", &b);
}

/* Returns the option value "X,Y,Z" for files in the test's folder. */
static char *option(const char *x, const char *y, const char *z)
{
    char *text;
    assert_true(asprintf(&text, "%s,%s,%s", x, y, z) > 0);
    return text;
}

static void coordinates_give_positions_and_a_map(void **state)
{
    (void)state;
    trip_volume *v;
    const char *x = write_text('x', "-1 0 0.5\n2,3\n");
    const char *z = write_text('z', "10\t9;7 6 4 2 -2\n\n");
    char *files = option(x, "", z);
    const trip_volume_params p = raw_params(files);
    assert_int_equal(trip_budget_create(&budget, 1 << 20), 0);
    assert_int_equal(trip_volume_open(&v, sample_file(), &p, budget), 0);
    const trip_volume_info *info = trip_volume_get_info(v);
    assert_map(&info->index_to_world,
               (const double[3][4]){ { 1, 0, 0, -1 }, { 0, 1, 0, 0 }, { 0, 0, -2, 10 } });
    const double positions[3][NZ] = { { 0, 1, 1.5, 3, 4 },
                                      { 0, 1, 2, 3 },
                                      { 0, 0.5, 1.5, 2, 3, 4, 6 } };
    const int64_t dims[3] = { NX, NY, NZ };
    for (int a = 0; a < 3; a++) {
        assert_null(trip_coordinates_fault(info->coordinates[a], dims[a]));
        for (int i = 0; i < dims[a]; i++)
            assert_true(fabs(info->coordinates[a][i] - positions[a][i]) < 1e-12);
    }
    trip_volume_close(v);
    trip_budget_destroy(budget);
    free(files);
}

static void even_coordinates_become_a_spacing(void **state)
{
    (void)state;
    trip_volume *v;
    const char *x = write_text('x', "5 7 9.0005 11 13");
    char *files = option(x, "", "");
    const trip_volume_params p = raw_params(files);
    assert_int_equal(trip_budget_create(&budget, 1 << 20), 0);
    assert_int_equal(trip_volume_open(&v, sample_file(), &p, budget), 0);
    const trip_volume_info *info = trip_volume_get_info(v);
    assert_map(&info->index_to_world,
               (const double[3][4]){ { 2, 0, 0, 5 }, { 0, 1, 0, 0 }, { 0, 0, 1, 0 } });
    for (int a = 0; a < 3; a++)
        assert_null(info->coordinates[a]);
    trip_volume_close(v);
    trip_budget_destroy(budget);
    free(files);
}

/* If every second voxel is left out, the others keep their positions in world space. */
static void sampling_keeps_the_positions_of_voxels(void **state)
{
    (void)state;
    trip_volume *v;
    const double world[NZ] = { 0, 1, 3, 4, 9, 10, 16 };
    const char *z = write_text('z', "0 1 3 4 9 10 16");
    char *files = option("", "", z);
    trip_volume_params p = raw_params(files);
    p.max_voxels = VOXELS / 4;
    assert_int_equal(trip_budget_create(&budget, 1 << 20), 0);
    assert_int_equal(trip_volume_open(&v, sample_file(), &p, budget), 0);
    const trip_volume_info *info = trip_volume_get_info(v);
    assert_int_equal(info->dims[2], 4);
    assert_null(trip_coordinates_fault(info->coordinates[2], 4));
    for (int k = 0; k < 4; k++) {
        const trip_vec3 at =
            trip_affine_point(&info->index_to_world, trip_v3(0, 0, info->coordinates[2][k]));
        assert_true(fabs(at.z - world[2 * k]) < 1e-12);
    }
    assert_true(fabs(info->index_to_world.m[0][0] - 2) < 1e-12);
    trip_volume_close(v);
    trip_budget_destroy(budget);
    free(files);
}

static void refuse(int status, const char *x, const char *y, const char *z, const char *why)
{
    char *files = option(x, y, z);
    const trip_volume_params p = raw_params(files);
    assert_refused_as(status, sample_file(), &p, why);
    free(files);
}

static void bad_coordinates_are_refused(void **state)
{
    (void)state;
    const struct {
        const char *text, *why;
    } bad[] = {
        { "0 1 2 3", "fewer" },
        { "", "fewer" },
        { "0 1 2 3 5 6", "more" },
        { "0 1 2 3 3", "they must ascend or descend throughout" },
        { "0 1 3 2 5", "they must ascend or descend throughout" },
        { "1 1 1 1 1", "they must ascend or descend throughout" },
        { "0 1 nan 3 5", "item 3 is not a number" },
        { "0 1 inf 3 5", "item 3 is not a number" },
        { "-1e308 1 2 3 1.7e308", "they must ascend or descend throughout" },
        { "0 1e-9 2 3 5", "millionth" },
        { "0 1 two 3 5", "item 3 is not a number" },
        { "0 1 2x 3 5", "item 3 is not a number" },
        { "0 1 2 3 "
          "5000000000000000000000000000000000000000000000000000000000000000000000000",
          "item 5 is not a number" },
    };
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
        refuse(TRIP_ERROR, write_text('x', bad[i].text), "", "", bad[i].why);
    refuse(TRIP_ERROR, "/nowhere/x.txt", "", "", "cannot open");
    const trip_volume_params two = raw_params("a,b"), four = raw_params("a,b,c,d");
    assert_refused_as(TRIP_USAGE, sample_file(), &two, "three files");
    assert_refused_as(TRIP_USAGE, sample_file(), &four, "three files");
}

/* Writes a header and a hole of `data_bytes` bytes in place of data. */
static const char *write_hole(const char *name, const char *header, int64_t data_bytes)
{
    const char *path = write_bytes(name, header, strlen(header));
    assert_int_equal(truncate(path, (off_t)strlen(header) + data_bytes), 0);
    return path;
}

/* An axis without coordinates gets a table if another axis has coordinates. */
static void no_table_is_made_for_an_axis_that_is_too_long(void **state)
{
    (void)state;
    const int64_t voxels = TRIP_VOLUME_AXIS_MAX + 1;
    char *files = option(write_text('x', "0 1 5"), "", "");
    const trip_volume_params p = { .raw_dims = { 3, voxels, 1 },
                                   .raw_type = "uint8",
                                   .coordinates = files };
    assert_refused_as(TRIP_ERROR, write_hole("long.raw", "", 3 * voxels), &p,
                      "more than 16777216 voxels along an axis");
    assert_refused(write_hole("long.nrrd",
                              "NRRD0005\ntype: uint8\ndimension: 3\nsizes: 3 16777217 1\n"
                              "encoding: raw\ncoordinates 0:=0 1 5\n\n",
                              3 * voxels),
                   "more than 16777216 voxels along an axis");
    free(files);
}

static void a_locale_with_decimal_commas_changes_nothing(void **state)
{
    (void)state;
    need_comma_locale();
    float values[VOXELS];
    trip_volume_info info;
    char *files = option(write_text('x', "0.5 2.5 4.5 6.5 8.5"), "", "");
    const trip_volume_params p = raw_params(files);
    const int status = read_volume(sample_file(), &p, 2, values, VOXELS, &info);
    setlocale(LC_ALL, "C");
    free(files);
    assert_int_equal(status, 0);
    assert_map(&info.index_to_world,
               (const double[3][4]){ { 2, 0, 0, 0.5 }, { 0, 1, 0, 0 }, { 0, 0, 1, 0 } });
}

/* The reader waits for a pipe until an interruption. */
static void coordinates_may_come_through_a_pipe(void **state)
{
    (void)state;
    char fifo[300];
    snprintf(fifo, sizeof fifo, "%s", path_of("x.fifo"));
    assert_int_equal(mkfifo(fifo, 0666), 0);
    char *files = option(fifo, "", "");
    const trip_volume_params p = raw_params(files);
    assert_interrupted(sample_file(), &p);
    pid_t child = fork();
    if (child == 0) {
        int to = open(fifo, O_WRONLY);
        _exit(write(to, "5 7 9 1", 7) == 7 && write(to, "1 13", 4) == 4 ? 0 : 1);
    }
    trip_volume *v;
    assert_int_equal(trip_budget_create(&budget, 1 << 20), 0);
    assert_int_equal(trip_volume_open(&v, sample_file(), &p, budget), 0);
    assert_map(&trip_volume_get_info(v)->index_to_world,
               (const double[3][4]){ { 2, 0, 0, 5 }, { 0, 1, 0, 0 }, { 0, 0, 1, 0 } });
    assert_int_equal(waitpid(child, NULL, 0), child);
    trip_volume_close(v);
    trip_budget_destroy(budget);
    free(files);
}

/* The maps from position to index and from index to position are inverse, beyond the ends too. */
static void positions_and_indices_are_inverse(void **state)
{
    (void)state;
    const double x[] = { 0, 0.25, 2.5, 3 }, one[] = { 0 };
    const trip_coordinates c =
        trip_coordinates_make((const double *const[3]){ x, one, x }, (const int64_t[3]){ 4, 1, 4 });
    const double pairs[][2] = { { -1, -0.25 }, { 0, 0 },      { 0.5, 0.125 },
                                { 1, 0.25 },   { 2.5, 2.75 }, { 4, 3.5 } };
    for (size_t i = 0; i < sizeof pairs / sizeof *pairs; i++) {
        assert_true(fabs(trip_coordinates_position(&c, 0, pairs[i][0]) - pairs[i][1]) < 1e-12);
        assert_true(fabs(trip_coordinates_index(&c, 0, pairs[i][1]) - pairs[i][0]) < 1e-12);
        assert_true(trip_coordinates_position(&c, 1, pairs[i][0]) == pairs[i][0]);
    }
    assert_true(fabs(trip_coordinates_width(&c, 0, 0) - 0.25) < 1e-12);
    assert_true(fabs(trip_coordinates_width(&c, 0, 1) - 1.25) < 1e-12);
    assert_true(fabs(trip_coordinates_width(&c, 0, 3) - 0.5) < 1e-12);
    assert_true(fabs(c.widest - 1.375) < 1e-12);
}

/* Both ends are exact, so that the grid covers the same space as without a table. */
static void positions_of_voxels_come_from_the_table(void **state)
{
    (void)state;
    for (int i = 1; i < 6000; i++) {
        const double x[] = { 0, i / 1000.0 / 3, 2 + i / 7000.0, 3 };
        const trip_coordinates c = trip_coordinates_make((const double *const[3]){ x, x, x },
                                                         (const int64_t[3]){ 4, 4, 4 });
        for (int k = 0; k < 4; k++)
            assert_true(trip_coordinates_position(&c, 0, k) == x[k]);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(coordinates_give_positions_and_a_map),
        cmocka_unit_test(even_coordinates_become_a_spacing),
        cmocka_unit_test(sampling_keeps_the_positions_of_voxels),
        cmocka_unit_test(bad_coordinates_are_refused),
        cmocka_unit_test(no_table_is_made_for_an_axis_that_is_too_long),
        cmocka_unit_test(a_locale_with_decimal_commas_changes_nothing),
        cmocka_unit_test(coordinates_may_come_through_a_pipe),
        cmocka_unit_test(positions_and_indices_are_inverse),
        cmocka_unit_test(positions_of_voxels_come_from_the_table),
    };
    return cmocka_run_group_tests_name("coordinates", tests, make_folder, remove_folder);
}
