/* Tests with netCDF-4 files that libnetcdf writes. */
#include <errno.h>
#include <netcdf.h>
#include <sys/socket.h>
#include <unistd.h>

#include "image_helper.h"
#include "netcdf_files.h"

/* Indexed by netCDF type number. */
static const trip_scalar scalar_of[] = {
    TRIP_U8,  TRIP_I8, TRIP_U8,  TRIP_I16, TRIP_I32, TRIP_F32,
    TRIP_F64, TRIP_U8, TRIP_U16, TRIP_U32, TRIP_I64, TRIP_U64
};

/* Contents of a file in addition to the sample volume t (netcdf_files.h). */
typedef struct contents {
    int type;
    int endian;       /* NC_ENDIAN_... */
    bool chunks;      /* compressed chunks of 3 x 3 x 3 */
    bool records;     /* z is unlimited */
    bool deeper;      /* a dimension of size 2 comes first */
    size_t time;      /* its index that holds the sample */
    bool inside;      /* t is in the group "g" */
    bool coordinates; /* x and z have coordinates */
    bool scaled;      /* t has scale 2 and offset 3 */
    bool missing;     /* 5 means a missing value, -7 if unsigned */
    int no_sign;      /* 1: t and x are unsigned by a text attribute, 2: by a string attribute */
} contents;

static void put_no_sign(int file, int variable, int no_sign)
{
    if (no_sign == 1)
        assert_int_equal(nc_put_att_text(file, variable, "_Unsigned", 4, "true"), 0);
    if (no_sign == 2)
        assert_int_equal(
            nc_put_att_string(file, variable, "_Unsigned", 1, &(const char *){ "true" }), 0);
}

static void put_coordinates(int file, int x, int z, int no_sign)
{
    int variable;
    assert_int_equal(nc_def_var(file, "x", no_sign ? NC_BYTE : NC_DOUBLE, 1, &x, &variable), 0);
    for (size_t i = 0; i < NX; i++) {
        const int position =
            no_sign ? (signed char)unsigned_x_position((int)i) : x_position((int)i);
        assert_int_equal(nc_put_var1_int(file, variable, &i, &position), 0);
    }
    put_no_sign(file, variable, no_sign);
    assert_int_equal(nc_def_var(file, "z", NC_INT, 1, &z, &variable), 0);
    for (size_t k = 0; k < NZ; k++)
        assert_int_equal(nc_put_var1_int(file, variable, &k, &(int){ z_position((int)k) }), 0);
}

static const char *write_contents(const char *name, const contents *c)
{
    const char *path = path_of(name);
    int file, group, dims[4], variable;
    assert_int_equal(nc_create(path, NC_NETCDF4 | NC_CLOBBER, &file), 0);
    assert_int_equal(nc_def_dim(file, "w", 2, &dims[0]), 0);
    assert_int_equal(nc_def_dim(file, "z", c->records ? NC_UNLIMITED : NZ, &dims[1]), 0);
    assert_int_equal(nc_def_dim(file, "lat", NY, &dims[2]), 0);
    assert_int_equal(nc_def_dim(file, "x", NX, &dims[3]), 0);
    group = file;
    if (c->inside)
        assert_int_equal(nc_def_grp(file, "g", &group), 0);
    const int first = c->deeper ? 0 : 1;
    assert_int_equal(nc_def_var(group, "t", c->type, 4 - first, dims + first, &variable), 0);
    if (c->chunks) {
        assert_int_equal(nc_def_var_chunking(group, variable, NC_CHUNKED,
                                             (const size_t[]){ 3, 3, 3, 3 } + first),
                         0);
        assert_int_equal(nc_def_var_deflate(group, variable, 1, 1, 5), 0);
    }
    assert_int_equal(nc_def_var_endian(group, variable, c->endian), 0);
    if (c->scaled) {
        assert_int_equal(
            nc_put_att_double(group, variable, "scale_factor", NC_DOUBLE, 1, &(double){ 2 }), 0);
        assert_int_equal(
            nc_put_att_float(group, variable, "add_offset", NC_FLOAT, 1, &(float){ 3 }), 0);
    }
    if (c->missing)
        assert_int_equal(nc_put_att_double(group, variable, "missing_value", NC_DOUBLE, 1,
                                           &(double){ c->no_sign ? -7 : 5 }),
                         0);
    put_no_sign(group, variable, c->no_sign);
    for (size_t v = 0; v < VOXELS; v++) {
        const size_t at[4] = { c->time, v / NX / NY, v / NX % NY, v % NX };
        const int value = sample(scalar_of[c->type], (int)at[3], (int)at[2], (int)at[1]);
        assert_int_equal(nc_put_var1_int(group, variable, at + first, &value), 0);
    }
    if (c->coordinates)
        put_coordinates(file, dims[3], dims[1], c->no_sign);
    assert_int_equal(nc_close(file), 0);
    return path;
}

static void every_type_holds_the_sample(void **state)
{
    (void)state;
    for (int type = 1; type <= NC_UINT64; type++)
        for (int n = 0; n < 8 && type != NC_CHAR; n++) {
            const contents c = { .type = type,
                                 .endian = n & 1 ? NC_ENDIAN_BIG : NC_ENDIAN_NATIVE,
                                 .chunks = n & 2,
                                 .records = n & 4,
                                 .deeper = n == 5,
                                 .inside = n == 3,
                                 .coordinates = n > 5 };
            const trip_scalar held = type == NC_DOUBLE ? TRIP_F32 : scalar_of[type];
            assert_holds_sample(write_contents("a.nc", &c), NULL, held);
        }
}

static void a_time_is_chosen(void **state)
{
    (void)state;
    const contents c = { .type = NC_SHORT, .deeper = true, .time = 1 };
    const char *path = write_contents("t.nc", &c);
    float values[VOXELS];
    trip_volume_info info;
    assert_holds_sample(path, &(trip_volume_params){ .time = 1 }, TRIP_I16);
    assert_int_equal(read_volume(path, NULL, 2, values, VOXELS, &info), 0);
    assert_non_null(strstr(info.note, "time 0 of 2"));
    assert_true(values[0] != (float)sample(TRIP_I16, 0, 0, 0));
    assert_refused_as(TRIP_USAGE, path, &(trip_volume_params){ .time = 2 }, "has 2 times");
    assert_refused_as(TRIP_USAGE, path, &(trip_volume_params){ .channel = 1 }, "has one channel");
}

static void coordinates_become_positions(void **state)
{
    (void)state;
    for (int inside = 0; inside < 2; inside++) {
        const contents c = { .type = NC_FLOAT, .coordinates = true, .inside = inside };
        assert_placed(write_contents("b.nc", &c), inside ? "g/t" : "t");
    }
}

static void numbers_are_scaled_and_missing_ones_have_no_value(void **state)
{
    (void)state;
    for (int n = 0; n < 4; n++) {
        const contents c = {
            .type = n / 2 ? NC_FLOAT : NC_SHORT, .chunks = n % 2, .scaled = true, .missing = true
        };
        assert_scaled(write_contents("c.nc", &c), scalar_of[c.type]);
    }
}

static void the_unsigned_attribute_applies(void **state)
{
    (void)state;
    for (int n = 0; n < 8; n++) {
        const contents c = { .type = n & 1 ? NC_SHORT : NC_BYTE,
                             .chunks = n & 2,
                             .coordinates = true,
                             .missing = n & 4,
                             .no_sign = n & 2 ? 2 : 1 };
        assert_unsigned(write_contents("j.nc", &c), scalar_of[c.type], c.missing);
    }
}

static void a_variable_is_chosen_by_name(void **state)
{
    (void)state;
    const contents c = { .type = NC_SHORT, .coordinates = true, .inside = true };
    const char *path = write_contents("d.nc", &c);
    assert_holds_sample(path, &(trip_volume_params){ .grid = "g/t" }, TRIP_I16);
    assert_refused_as(TRIP_ERROR, path, &(trip_volume_params){ .grid = "t" }, "no variable \"t\"");
    assert_refused_as(TRIP_ERROR, path, &(trip_volume_params){ .grid = "x" },
                      "does not have three dimensions");
}

/* Tries a file with only the signature of HDF5, and a file cut in half. */
static void truncated_files_are_refused(void **state)
{
    (void)state;
    unsigned char whole[1 << 16];
    const contents c = { .type = NC_SHORT };
    FILE *f = fopen(write_contents("e.nc", &c), "rb");
    const size_t count = fread(whole, 1, sizeof whole, f);
    fclose(f);
    assert_in_range(count, 1000, sizeof whole - 1);
    assert_refused(write_bytes("f.nc", "\x89HDF\r\n\x1a\n\0\0\0\0", 12), "libnetcdf reports");
    assert_refused(write_bytes("f.nc", whole, count / 2), "libnetcdf reports");
}

/* Damaged files never end the program, even if the library crashes. Reading succeeds or fails with
 * one line. */
static void damaged_files_are_read_or_refused(void **state)
{
    (void)state;
    static unsigned char whole[1 << 16], damaged[1 << 16];
    const contents c = { .type = NC_SHORT, .chunks = true, .coordinates = true, .missing = true };
    FILE *f = fopen(write_contents("g.nc", &c), "rb");
    const size_t count = fread(whole, 1, sizeof whole, f);
    fclose(f);
    unsigned seed = 7;
    int refused = 0;
    for (int round = 0; round < 60; round++) {
        memcpy(damaged, whole, count);
        for (int n = 0; n < 1 + round % 8; n++)
            damaged[8 + (size_t)(rand_r(&seed) % (int)(count - 8))] = (unsigned char)rand_r(&seed);
        refused += survives(write_bytes("h.nc", damaged, count), NULL);
    }
    assert_in_range(refused, 5, 60);
}

/* The answer of the helper. It sends all of it at once, and nothing after it. */
static struct {
    trip_image_reply reply;
    trip_image_netcdf about;
    double coordinates[NX];
} answer;

static int answer_fd;

static int answer_at_once(int fd)
{
    answer_fd = dup(fd);
    const ssize_t sent = send(answer_fd, &answer, sizeof answer, MSG_NOSIGNAL);
    shutdown(answer_fd, SHUT_WR);
    return sent == (ssize_t)sizeof answer ? 0 : EIO;
}

/* Makes a sound answer and applies change `number` to it. */
static void make_answer(int number)
{
    trip_image_netcdf *v = &answer.about;
    answer.reply = (trip_image_reply){ .outcome = TRIP_IMAGE_DONE,
                                       .data_bytes = sizeof *v + sizeof answer.coordinates };
    *v = (trip_image_netcdf){ .dims = { NX, NY, NZ },
                              .type = TRIP_I16,
                              .placed = 1,
                              .times = 1,
                              .channels = 1,
                              .slope = 1,
                              .name = "t",
                              .helper_bytes = 1000 };
    for (int i = 0; i < NX; i++)
        answer.coordinates[i] = i * i;
    switch (number) {
    case 1:
        v->type = TRIP_SCALARS;
        break;
    case 2:
        v->dims[1] = 0;
        break;
    case 3:
        memset(v->name, 'x', sizeof v->name);
        break;
    case 4:
        v->placed = 8;
        break;
    case 5:
        v->slope = NAN;
        break;
    case 6:
        answer.reply.data_bytes = sizeof *v - 1;
        break;
    case 7:
        v->placed = 3;
        break;
    case 8:
        v->dims[2] = INT64_MAX / 8;
        break;
    case 9:
        v->helper_bytes = UINT64_MAX;
        break;
    case 10:
        answer.coordinates[2] = NAN;
        break;
    case 11:
        v->name[0] = '\n';
        break;
    default:
        break;
    }
}

static void answers_of_the_helper_are_not_trusted(void **state)
{
    (void)state;
    static const char *const why[] = { NULL,
                                       "slices of an unknown type",
                                       "slices without a size",
                                       "a variable without a name",
                                       "coordinates of an unknown axis",
                                       "not finite",
                                       "data of a wrong size",
                                       "coordinates of a wrong size",
                                       "",
                                       "impossible size",
                                       "not all are finite",
                                       "a variable without a name" };
    const char *path = write_bytes("i.nc", "\x89HDF\r\n\x1a\n", 8);
    for (int n = 0; n < (int)(sizeof why / sizeof *why); n++) {
        trip_budget *budget;
        trip_volume *v;
        assert_int_equal(trip_budget_create(&budget, 16 << 20), 0);
        make_answer(n);
        trip_image_helper_replace(answer_at_once, 1000);
        catch_reports();
        const int status = trip_volume_open(&v, path, NULL, budget);
        trip_report_redirect(NULL, NULL);
        trip_image_helper_replace(NULL, 0);
        if (status == 0)
            trip_volume_close(v);
        close(answer_fd);
        if ((status == 0) != (why[n] == NULL) || (why[n] && !strstr(reported, why[n])))
            fail_msg("%d: status %d: %s", n, status, reported);
        assert_int_equal(reports, why[n] != NULL);
        assert_int_equal(trip_budget_left_bytes(budget), trip_budget_limit_bytes(budget));
        trip_budget_destroy(budget);
    }
}

/* The memory is too small for a chunk, or for the slices. */
static void chunks_and_slices_too_large_for_memory_are_refused(void **state)
{
    (void)state;
    int file, dims[3], variable;
    for (int chunks = 0; chunks < 2; chunks++) {
        const char *path = path_of("j.nc");
        const size_t sizes[3] = { chunks ? 512 : 1, 1024, chunks ? 8 : 4096 };
        assert_int_equal(nc_create(path, NC_NETCDF4 | NC_CLOBBER, &file), 0);
        assert_int_equal(nc_set_fill(file, NC_NOFILL, NULL), 0);
        for (int a = 0; a < 3; a++)
            assert_int_equal(
                nc_def_dim(file, (const char *[]){ "z", "y", "x" }[a], sizes[a], &dims[a]), 0);
        assert_int_equal(nc_def_var(file, "t", NC_INT, 3, dims, &variable), 0);
        if (chunks)
            assert_int_equal(nc_def_var_chunking(file, variable, NC_CHUNKED, sizes), 0);
        assert_int_equal(nc_close(file), 0);
        trip_budget *budget;
        trip_volume *v;
        assert_int_equal(trip_budget_create(&budget, 8 << 20), 0);
        catch_reports();
        assert_int_equal(trip_volume_open(&v, path, NULL, budget), TRIP_ERROR);
        trip_report_redirect(NULL, NULL);
        assert_int_equal(reports, 1);
        assert_non_null(strstr(reported, "raise --memory"));
        trip_budget_destroy(budget);
    }
}

/* MINC 2 is HDF5 with a group of this name. */
static void minc_is_refused(void **state)
{
    (void)state;
    const contents c = { .type = NC_SHORT };
    const char *path = write_contents("minc2.mnc", &c);
    int file, group;
    assert_int_equal(nc_open(path, NC_WRITE, &file), 0);
    assert_int_equal(nc_def_grp(file, "minc-2.0", &group), 0);
    assert_int_equal(nc_close(file), 0);
    assert_refused(path, "is a MINC file");
    assert_refused(path, "convert it to NIfTI with `mnc2nii`");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_type_holds_the_sample),
        cmocka_unit_test(a_time_is_chosen),
        cmocka_unit_test(coordinates_become_positions),
        cmocka_unit_test(numbers_are_scaled_and_missing_ones_have_no_value),
        cmocka_unit_test(the_unsigned_attribute_applies),
        cmocka_unit_test(a_variable_is_chosen_by_name),
        cmocka_unit_test(minc_is_refused),
        cmocka_unit_test(truncated_files_are_refused),
        cmocka_unit_test(damaged_files_are_read_or_refused),
        cmocka_unit_test(answers_of_the_helper_are_not_trusted),
        cmocka_unit_test(chunks_and_slices_too_large_for_memory_are_refused),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
