/* Tests volumes in memory. Their data sets must equal the data sets of the same values in files,
 * byte for byte except the index, which names the source. */
#include <triptych_brick.h>

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "contexts.h"

enum { X = 37, Y = 21, Z = 26, VOXELS = X * Y * Z, SIDE = 48, FLOATS = 4 * SIDE * SIDE };

static const char *const types[] = { "uint8",  "int8",  "uint16", "int16", "uint32", "int32",
                                     "uint64", "int64", "half",   "float", "double" };
static const size_t type_bytes[] = { 1, 1, 2, 2, 4, 4, 8, 8, 2, 4, 8 };

/* A smooth shape, so that there are normals and coarse levels. Some values are not finite. */
static double value_at(int i, int j, int k)
{
    const double x = i - X / 2.0, y = j - Y / 2.0, z = k - Z / 2.0;
    return 100 - (x * x / 4 + y * y + z * z / 2) / 2;
}

/* Writes one value. Halves and integers without sign get bits that all their values share. */
static void put(const char *type, unsigned char *to, int i, int j, int k)
{
    const double value = value_at(i, j, k);
    const float f = (i + j + k) % 17 ? (float)value : NAN;
    const double d = (i + j + k) % 17 ? value : INFINITY;
    const int64_t whole = (int64_t)(*type == 'u' ? fmax(value, 0) : value);
    const uint16_t half = (uint16_t)(0x3c00 + (int)fmax(value, 0) * 8);
    const void *from = &whole; /* little-endian: the first bytes are the value */
    if (!strcmp(type, "half"))
        from = &half;
    else if (!strcmp(type, "float"))
        from = &f;
    else if (!strcmp(type, "double"))
        from = &d;
    for (size_t n = 0; n < sizeof types / sizeof *types; n++)
        if (!strcmp(types[n], type))
            memcpy(to, from, type_bytes[n]);
}

static unsigned char *dense(const char *type, size_t bytes)
{
    unsigned char *values = malloc(VOXELS * bytes);
    assert_non_null(values);
    for (int n = 0; n < VOXELS; n++)
        put(type, values + (size_t)n * bytes, n % X, n / X % Y, n / X / Y);
    return values;
}

static void write_file(const char *path, const char *header, const void *values, size_t bytes)
{
    FILE *f = fopen(path, "wb");
    assert_non_null(f);
    assert_true(fputs(header, f) >= 0);
    assert_int_equal(fwrite(values, 1, bytes, f), bytes);
    assert_int_equal(fclose(f), 0);
}

static triptych_volume volume_of(const char *type, const void *data)
{
    return (triptych_volume){ .type = type, .dims = { X, Y, Z }, .data = data };
}

static void brick(const char *volume, const char *data_set, triptych_brick_options options,
                  triptych_brick_summary *summary)
{
    triptych *t = new_context();
    options.replace = 1;
    options.threads = 2;
    if (triptych_brick(t, volume, data_set, &options, summary))
        fail_msg("%s", triptych_error(t));
    triptych_destroy(t);
}

/* Bricks a file of the values. */
static void brick_file(const char *type, const void *values, size_t bytes,
                       triptych_brick_options options, triptych_brick_summary *summary)
{
    write_file("memory.raw", "", values, VOXELS * bytes);
    options.raw_type = type;
    memcpy(options.raw_dims, (const int64_t[]){ X, Y, Z }, sizeof options.raw_dims);
    brick("memory.raw", "file.trip", options, summary);
}

/* Bricks a volume in memory and compares the result with the last file. */
static void assert_like_file(const triptych_volume *volume, triptych_brick_options options,
                             const triptych_brick_summary *file)
{
    triptych_brick_summary memory;
    options.in_memory = volume;
    brick("nothing", "memory.trip", options, &memory);
    assert_int_equal(system("diff -r -x index.trip file.trip memory.trip"), 0);
    assert_int_equal(memory.voxels, file->voxels);
    assert_int_equal(memory.not_finite, file->not_finite);
    assert_int_equal(memory.kept, file->kept);
    assert_int_equal(memory.halo, file->halo);
    assert_int_equal(memory.levels, file->levels);
    assert_memory_equal(memory.spacing, file->spacing, sizeof file->spacing);
    assert_true(memory.value_min == file->value_min && memory.value_max == file->value_max);
}

static void assert_same(const char *type, const void *values, size_t bytes,
                        const triptych_volume *volume, triptych_brick_options options)
{
    triptych_brick_summary file;
    brick_file(type, values, bytes, options, &file);
    assert_like_file(volume, options, &file);
}

static void all_types_give_the_data_set_of_a_file(void **state)
{
    (void)state;
    for (size_t n = 0; n < sizeof types / sizeof *types; n++) {
        unsigned char *values = dense(types[n], type_bytes[n]);
        const triptych_volume volume = volume_of(types[n], values);
        assert_same(types[n], values, type_bytes[n], &volume, (triptych_brick_options){ 0 });
        free(values);
    }
}

static void all_options_hold_for_memory(void **state)
{
    (void)state;
    float *values = (float *)(void *)dense("float", sizeof *values);
    const triptych_volume volume = volume_of("float", values);
    const triptych_range range = { 20, 80 };
    const char *grey = "grey";
    const triptych_brick_options all[] = {
        { .keep_all = 1, .normals = TRIPTYCH_NORMALS_FULL, .spacing = { 1, 2, 0.5 } },
        { .ranges = &range, .range_count = 1, .levels_for = TRIPTYCH_LEVELS_FOR_BOTH },
        { .functions = &grey, .function_count = 1, .no_halo = 1, .tile_voxels = 16 },
        { .automatic = 1, .region_first = { 3, 2, 9 }, .region_past = { 30, 20, 17 } },
        { .ranges = &range, .range_count = 1, .code_bits = TRIPTYCH_CODE_BITS_8, .axes = "PIR" },
    };
    for (size_t n = 0; n < sizeof all / sizeof *all; n++)
        assert_same("float", values, sizeof *values, &volume, all[n]);
    free(values);
}

static void strides_can_have_any_order_sign_and_padding(void **state)
{
    (void)state;
    static unsigned char spread[1 << 20];
    unsigned char *values = dense("int16", 2);
    triptych_brick_summary file;
    static const int64_t strides[][3] = {
        { 2, 2 * X, 2 * X * Y },                 /* dense */
        { 2, 2 * X + 6, (2 * X + 6) * (Y + 1) }, /* padded */
        { 2 * Y * Z, 2 * Z, 2 },                 /* z fastest */
        { 2 * Z, 2 * Z * X, 2 },                 /* z, x, y */
        { -2, 2 * X, 2 * X * Y },                /* mirrored */
        { -2, -2 * X, -2 * X * Y },              /* from the other corner */
        { 2 * Y, -2, 2 * X * Y },                /* y fastest, mirrored */
        { 7, 7 * X, 7 * X * Y },                 /* part of a struct without alignment */
    };
    brick_file("int16", values, 2, (triptych_brick_options){ 0 }, &file);
    for (size_t n = 0; n < sizeof strides / sizeof *strides; n++) {
        const int64_t *s = strides[n];
        int64_t corner = 0;
        for (int a = 0; a < 3; a++)
            corner -= s[a] < 0 ? s[a] * ((const int64_t[]){ X, Y, Z }[a] - 1) : 0;
        memset(spread, 0x55, sizeof spread);
        triptych_volume volume = volume_of("int16", spread + corner);
        memcpy(volume.stride_bytes, s, sizeof volume.stride_bytes);
        for (int k = 0; k < Z; k++)
            for (int j = 0; j < Y; j++)
                for (int i = 0; i < X; i++)
                    put("int16", spread + corner + i * s[0] + j * s[1] + k * s[2], i, j, k);
        assert_like_file(&volume, (triptych_brick_options){ 0 }, &file);
    }
    free(values);
}

/* State of the function that reads slices. */
typedef struct reading {
    const unsigned char *values;
    int64_t next, fails_at;
    triptych *cancels;
} reading;

static int read_slices(void *user, int64_t first, int64_t count, void *values)
{
    reading *r = user;
    assert_true(count > 0 && first >= 0 && first + count <= Z);
    assert_true(first == 0 || first >= r->next); /* ascending in each pass */
    r->next = first + count;
    if (r->fails_at && r->next > r->fails_at)
        return -7;
    if (r->cancels)
        triptych_cancel(r->cancels);
    memcpy(values, r->values + first * X * Y * 2, (size_t)(count * X * Y * 2));
    return 0;
}

static triptych_volume read_volume(reading *r)
{
    triptych_volume volume = volume_of("uint16", NULL);
    volume.read_slices = read_slices;
    volume.user = r;
    return volume;
}

static void a_function_gives_the_data_set_of_a_file(void **state)
{
    (void)state;
    unsigned char *values = dense("uint16", 2);
    reading r = { .values = values };
    const triptych_volume volume = read_volume(&r);
    assert_same("uint16", values, 2, &volume, (triptych_brick_options){ 0 });
    assert_int_equal(r.next, Z);
    assert_same("uint16", values, 2, &volume, (triptych_brick_options){ .max_voxels = VOXELS / 8 });
    free(values);
}

static void assert_fails(triptych *t, int status, int expected, const char *text)
{
    if (status != expected || !strstr(triptych_error(t), text))
        fail_msg("%d, \"%s\": not %d, \"%s\"", status, triptych_error(t), expected, text);
    assert_null(strchr(triptych_error(t), '\n'));
    assert_int_equal(system("ls failed.trip* 2>&1 | grep -q '^failed'"), 256); /* none is left */
}

static void a_failing_or_cancelling_function_leaves_nothing(void **state)
{
    (void)state;
    unsigned char *values = dense("uint16", 2);
    triptych *t = new_context();
    for (int64_t at = 1; at < Z; at += 8) {
        reading r = { .values = values, .fails_at = at };
        const triptych_volume volume = read_volume(&r);
        assert_fails(t,
                     triptych_brick(t, "bad", "failed.trip",
                                    &(triptych_brick_options){ .in_memory = &volume }, NULL),
                     TRIPTYCH_ERROR, "read: bad: read_slices() returned -7 instead of 0");
    }
    reading r = { .values = values, .cancels = t };
    const triptych_volume volume = read_volume(&r);
    assert_fails(t,
                 triptych_brick(t, "cancelled", "failed.trip",
                                &(triptych_brick_options){ .in_memory = &volume, .keep_all = 1 },
                                NULL),
                 TRIPTYCH_CANCELLED, "interrupted");
    triptych_destroy(t);
    free(values);
}

static void bad_volumes_are_refused(void **state)
{
    (void)state;
    unsigned char *values = dense("uint16", 2);
    const triptych_volume good = volume_of("uint16", values);
    triptych *t = new_context();
    triptych_volume bad[8];
    static const char *const says[] = { "unknown type", "unknown type",        "one voxel",
                                        "one voxel",    "data or read_slices", "2^63 bytes",
                                        "2^63 bytes",   "all 0 or none" };
    for (size_t n = 0; n < sizeof bad / sizeof *bad; n++)
        bad[n] = good;
    bad[0].type = NULL;
    bad[1].type = "complex";
    bad[2].dims[1] = 0;
    bad[3].dims[2] = -5;
    bad[4].data = NULL;
    memcpy(bad[5].dims, (const int64_t[]){ INT32_MAX, INT32_MAX, 4 }, sizeof bad[5].dims);
    memcpy(bad[6].stride_bytes, (const int64_t[]){ 2, 2 * X, INT64_MIN }, 3 * sizeof(int64_t));
    bad[7].stride_bytes[1] = 80;
    for (size_t n = 0; n < sizeof bad / sizeof *bad; n++) {
        const triptych_brick_options options = { .in_memory = &bad[n] };
        triptych_brick_estimate e;
        assert_fails(t, triptych_brick(t, "bad", "failed.trip", &options, NULL), TRIPTYCH_USAGE,
                     says[n]);
        assert_fails(t, triptych_estimate(t, "bad", "failed.trip", &options, &e), TRIPTYCH_USAGE,
                     says[n]);
    }
    const triptych_brick_options refused[] = {
        { .in_memory = &good, .resume = 1 },     { .in_memory = &good, .raw_type = "uint8" },
        { .in_memory = &good, .allow_gaps = 1 }, { .in_memory = &good, .grid = "density" },
        { .in_memory = &good, .channel = 1 },    { .in_memory = &good, .time = 1 },
        { .in_memory = &good, .time = -1 },
    };
    static const char *const why[] = { "cannot be resumed",
                                       "its format is memory; --size",
                                       "--allow-gaps",
                                       "--grid",
                                       "--channel and --time require",
                                       "--channel and --time require",
                                       "times count from 0" };
    for (size_t n = 0; n < sizeof refused / sizeof *refused; n++)
        assert_fails(t, triptych_brick(t, "bad", "failed.trip", &refused[n], NULL), TRIPTYCH_USAGE,
                     why[n]);
    triptych_identity identity;
    assert_fails(
        t, triptych_identify(t, "v", &(triptych_brick_options){ .in_memory = &good }, 0, &identity),
        TRIPTYCH_USAGE, "no identity");
    triptych_destroy(t);
    free(values);
}

static void a_map_places_the_volume_as_in_a_file(void **state)
{
    (void)state;
    unsigned char *values = dense("uint16", 2);
    triptych_volume volume = volume_of("uint16", values);
    const double map[3][4] = { { 0, -0.5, 0, 10 }, { 2, 0, 0, -20 }, { 0, 0, 1.5, 30 } };
    triptych *t = new_context();
    triptych_info file, memory;
    memcpy(volume.index_to_world, map, sizeof map);
    write_file("map.nrrd",
               "NRRD0004\ntype: uint16\ndimension: 3\nsizes: 37 21 26\nencoding: raw\n"
               "endian: little\nspace dimension: 3\nspace origin: (10,-20,30)\n"
               "space directions: (0,2,0) (-0.5,0,0) (0,0,1.5)\n\n",
               values, VOXELS * 2);
    brick("map.nrrd", "file.trip", (triptych_brick_options){ 0 }, NULL);
    brick("a name", "memory.trip", (triptych_brick_options){ .in_memory = &volume }, NULL);
    assert_int_equal(system("diff -r -x index.trip file.trip memory.trip"), 0);
    assert_int_equal(triptych_open(t, "file.trip", NULL), TRIPTYCH_OK);
    assert_int_equal(triptych_get_info(t, &file), TRIPTYCH_OK);
    assert_non_null(strstr(file.notes, "\"oriented\":true"));
    assert_int_equal(triptych_open(t, "memory.trip", NULL), TRIPTYCH_OK);
    assert_int_equal(triptych_get_info(t, &memory), TRIPTYCH_OK);
    assert_memory_equal(memory.index_to_world, map, sizeof map);
    assert_memory_equal(memory.lo, file.lo, sizeof file.lo);
    assert_non_null(strstr(memory.notes, "\"oriented\":true"));
    assert_non_null(strstr(memory.notes, "\"grid\":\"a name\""));
    assert_null(strstr(memory.notes, "\"source\"")); /* a file that does not exist */
    triptych_destroy(t);
    free(values);
}

static void draw_source(const char *volume, const triptych_brick_options *options, float *rgba)
{
    triptych *t = new_context();
    assert_int_equal(triptych_open(t, "memory.trip",
                                   &(triptych_resources){ .renderer = TRIPTYCH_RENDERER_INTEGRAL }),
                     TRIPTYCH_OK);
    assert_int_equal(triptych_set_view(t, &(triptych_view){ .width = SIDE, .height = SIDE }),
                     TRIPTYCH_OK);
    assert_int_equal(triptych_set_source(t, volume, options), TRIPTYCH_OK);
    assert_int_equal(triptych_draw(t, rgba), TRIPTYCH_OK);
    triptych_destroy(t);
}

static void estimates_and_the_integral_read_memory_too(void **state)
{
    (void)state;
    static float one[FLOATS], other[FLOATS];
    float *values = (float *)(void *)dense("float", sizeof *values);
    const triptych_volume volume = volume_of("float", values);
    const triptych_brick_options memory = { .in_memory = &volume },
                                 file = { .raw_type = "float", .raw_dims = { X, Y, Z } };
    triptych_brick_estimate a, b;
    triptych *t = new_context();
    write_file("memory.raw", "", values, VOXELS * sizeof *values);
    assert_int_equal(triptych_estimate(t, "memory.raw", "no.trip", &file, &a), TRIPTYCH_OK);
    assert_int_equal(triptych_estimate(t, "nothing", "no.trip", &memory, &b), TRIPTYCH_OK);
    triptych_destroy(t);
    assert_int_equal(a.voxels, b.voxels);
    assert_int_equal(a.kept, b.kept);
    assert_int_equal(a.bytes, b.bytes);
    brick("nothing", "memory.trip", memory, NULL);
    draw_source("memory.raw", &file, one);
    draw_source("nothing", &memory, other);
    assert_memory_equal(one, other, sizeof one);
    free(values);
}

static void a_volume_may_be_larger_than_the_memory(void **state)
{
    (void)state;
    enum { EDGE = 256, DEPTH = 1024 };
    const uint64_t limit = 32 << 20; /* half of the volume */
    unsigned char *values = calloc(EDGE * EDGE, DEPTH);
    const triptych_range range = { 1, 1 };
    triptych_brick_summary summary;
    assert_non_null(values);
    for (size_t n = 0; n < DEPTH; n++)
        values[n * EDGE * EDGE + n] = 1;
    triptych_volume volume = volume_of("uint8", values);
    memcpy(volume.dims, (const int64_t[]){ EDGE, EDGE, DEPTH }, sizeof volume.dims);
    brick("large", "large.trip",
          (triptych_brick_options){
              .in_memory = &volume, .ranges = &range, .range_count = 1, .memory_bytes = limit },
          &summary);
    assert_int_equal(summary.kept, DEPTH);
    assert_int_equal(summary.input_bytes, EDGE * EDGE * DEPTH);
    assert_true(summary.peak_memory_bytes <= limit);
    triptych *t = new_context();
    triptych_info info;
    assert_int_equal(triptych_open(t, "large.trip", NULL), TRIPTYCH_OK);
    assert_int_equal(triptych_get_info(t, &info), TRIPTYCH_OK);
    assert_int_equal(info.last[0], EDGE - 1);
    assert_int_equal(info.last[1], DEPTH / EDGE - 1);
    assert_int_equal(info.last[2], DEPTH - 1);
    triptych_destroy(t);
    free(values);
}

static int clean(void **state)
{
    (void)state;
    return system("rm -r file.trip memory.trip large.trip memory.raw map.nrrd");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(all_types_give_the_data_set_of_a_file),
        cmocka_unit_test(all_options_hold_for_memory),
        cmocka_unit_test(strides_can_have_any_order_sign_and_padding),
        cmocka_unit_test(a_function_gives_the_data_set_of_a_file),
        cmocka_unit_test(a_failing_or_cancelling_function_leaves_nothing),
        cmocka_unit_test(bad_volumes_are_refused),
        cmocka_unit_test(a_map_places_the_volume_as_in_a_file),
        cmocka_unit_test(estimates_and_the_integral_read_memory_too),
        cmocka_unit_test(a_volume_may_be_larger_than_the_memory),
    };
    return cmocka_run_group_tests(tests, NULL, clean);
}
