#include "brick_files.h"

#include <math.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/wait.h>

#include "comma_locale.h"
#include "estimate.h"
#include "identity.h"
#include "normal.h"

enum { NX = 97, NY = 70, NZ = 61, N = NX * NY * NZ };

static uint8_t bytes[N];
static float floats[N];

/* Makes concentric spheres with some noise, so that there are dense and empty regions. */
static void make_bytes(void)
{
    uint64_t random = 11;
    for (int i = 0; i < N; i++) {
        double x = i % NX - NX / 2, y = i / NX % NY - NY / 2, z = i / NX / NY - NZ / 2;
        double r = sqrt(x * x + y * y + z * z);
        bytes[i] = (uint8_t)(120 + 100 * cos(r / 4) + test_random(&random) % 20);
    }
    test_write("v.raw", bytes, sizeof bytes);
}

static void make_floats(void)
{
    for (int i = 0; i < N; i++)
        floats[i] = (float)sin(i % NX * 0.1) * (float)(i / NX % NY) - (float)(i / NX / NY) * 0.7f;
    test_write("v.raw", floats, sizeof floats);
}

/* A slice of fill values that nobody declared, and one value far outside. */
static void make_strange_floats(void)
{
    make_floats();
    for (int i = 0; i < NX * NY; i++)
        floats[i] = 1e20f;
    floats[N / 2] = 1e6f;
    test_write("v.raw", floats, sizeof floats);
}

/* Blocks of 8 ids, some of which share a float. */
static void make_ids(void)
{
    static uint32_t ids[N];
    for (int i = 0; i < N; i++)
        ids[i] = i % NX / 8 ? 4000000000u + (uint32_t)(i % NX / 8 % 3 + i / NX % NY / 8 % 3) : 0;
    test_write("v.raw", ids, sizeof ids);
}

static trip_brick_params params_for(const char *type, const char *output)
{
    static char input_path[128], output_path[128];
    strcpy(input_path, test_path("v.raw"));
    strcpy(output_path, test_path(output));
    return (trip_brick_params){ .input = input_path,
                                .output = output_path,
                                .volume = { .raw_dims = { NX, NY, NZ }, .raw_type = type },
                                .normals = TRIP_NORMALS_STORED,
                                .memory_bytes = (uint64_t)1 << 28,
                                .threads = 2 };
}

static const trip_value_range middle = { 100, 180 };

/* Returns the bytes of all plane files. The halo's plane files must have `halo` bytes each. */
static uint64_t bytes_of_lists(const char *name, uint64_t halo)
{
    static const char *const planes[] = { "halo", "voxels", "normals" };
    uint64_t sums[3] = { 0 };
    for (int i = 0; i < 9; i++) {
        char path[256];
        struct stat st;
        snprintf(path, sizeof path, "%s/%c0.%s", test_path(name), 'x' + i % 3, planes[i / 3]);
        sums[i / 3] += stat(path, &st) == 0 ? (uint64_t)st.st_size : 0;
    }
    assert_int_equal(sums[0], halo);
    return sums[0] + sums[1] + sums[2];
}

static void the_envelope_selects_the_kept_voxels(void **state)
{
    (void)state;
    test_lists l;
    trip_brick_summary s;
    trip_brick_params p = params_for("uint8", "a.trip");
    p.ranges = &middle;
    p.range_count = 1;
    make_bytes();
    assert_int_equal(trip_brick(&p, &s), 0);
    test_read_lists("a.trip", &l);
    test_check_lists(&l);
    uint64_t kept = 0;
    for (int i = 0; i < N; i++) {
        bool keep = bytes[i] >= 100 && bytes[i] <= 180;
        kept += keep;
        assert_int_equal(l.codes[0][i], keep ? 85 * (258 + bytes[i]) : -1);
    }
    assert_int_equal(l.header.kept, kept);
    assert_int_equal(s.kept, kept);
    assert_int_equal(s.voxels, N);
    struct stat index;
    assert_int_equal(stat(test_path("a.trip/index.trip"), &index), 0);
    assert_int_equal(s.bytes, bytes_of_lists("a.trip", s.halo_bytes) + s.level_bytes +
                                  (uint64_t)index.st_size);
    assert_false(test_exists("a.trip.partial"));
    assert_false(test_exists("a.trip.spill"));
    test_free_lists(&l);
}

static void a_transfer_function_keeps_the_voxels_it_shows(void **state)
{
    (void)state;
    static const char text[] = "values data\n10 0 0 0 0\n90 1 1 1 0\n120 1 1 1 0.5\n150 1 1 1 0\n";
    test_lists l;
    trip_brick_summary s;
    const char *function = test_path("f.tf");
    trip_brick_params p = params_for("uint8", "a.trip");
    test_write("f.tf", text, sizeof text - 1);
    p.functions = &function;
    p.function_count = 1;
    make_bytes();
    assert_int_equal(trip_brick(&p, &s), 0);
    test_read_lists("a.trip", &l);
    test_check_lists(&l);
    for (int i = 0; i < N; i++)
        assert_int_equal(l.codes[0][i] >= 0, bytes[i] > 90 && bytes[i] < 150);
    assert_non_null(strstr(l.text, "\"envelope\":[[90.0"));
    assert_non_null(strstr(l.text, "120 1 1 1 0.5"));
    test_free_lists(&l);
}

/* The refusal comes before any voxel is read. */
static void transfer_functions_too_large_for_a_data_set_are_refused(void **state)
{
    (void)state;
    trip_brick_summary s;
    const char *const functions[] = { test_path("f.tf"), test_path("f.tf"), test_path("f.tf") };
    trip_brick_params p = params_for("uint8", "a.trip");
    FILE *f = fopen(functions[0], "w");
    assert_non_null(f);
    fputs("values data\n", f);
    for (int i = 0; i < 65536; i++)
        fprintf(f,
                "%.17g 0.12345678901234567 0.12345678901234567 0.12345678901234567 "
                "0.12345678901234567\n",
                i * 0.1234567);
    assert_int_equal(fclose(f), 0);
    p.functions = functions;
    p.function_count = 3;
    make_bytes();
    assert_int_equal(trip_brick(&p, &s), TRIP_USAGE);
    assert_non_null(strstr(test_report, "give fewer or simpler ones"));
    assert_false(test_exists("a.trip"));
}

static void the_automatic_envelope_keeps_voxels_and_stores_a_function(void **state)
{
    (void)state;
    test_lists l;
    trip_brick_summary s;
    trip_brick_params p = params_for("uint8", "a.trip");
    make_bytes();
    assert_int_equal(trip_brick(&p, &s), 0);
    assert_true(s.kept > 0 && s.kept < N);
    test_read_lists("a.trip", &l);
    assert_non_null(strstr(l.text, "\"transfer_function\":\"unit voxel"));
    assert_non_null(strstr(l.text, "\"source\":\"v.raw\""));
    test_free_lists(&l);
}

/* Checks that each code is the nearest of `steps` steps. They cover the range of all values, kept
 * or not, extended by `room` times the range on either side. */
static void check_codes_of_floats(trip_brick_code_bits bits, unsigned code_bytes, int steps,
                                  double room)
{
    test_lists l;
    trip_brick_summary s;
    trip_brick_params p = params_for("float", "a.trip");
    trip_value_range range = { -1, 20 };
    float lo = INFINITY, hi = -INFINITY;
    p.ranges = &range;
    p.range_count = 1;
    p.code_bits = bits;
    make_floats();
    for (int i = 0; i < N; i++) {
        lo = fminf(lo, floats[i]);
        hi = fmaxf(hi, floats[i]);
    }
    assert_int_equal(trip_brick(&p, &s), 0);
    test_read_lists("a.trip", &l);
    test_check_lists(&l);
    assert_int_equal(s.code_bytes, code_bytes);
    assert_int_equal(l.header.code_bytes, code_bytes);
    const double range_of_values = (double)hi - lo, all = (1 + 2 * room) * range_of_values;
    assert_true(fabs(l.header.code_lo - (lo - room * range_of_values)) < 1e-9 * all);
    assert_true(fabs(l.header.code_hi - (hi + room * range_of_values)) < 1e-9 * all);
    assert_true(l.header.value_min == lo && l.header.value_max == hi);
    for (int i = 0; i < N; i++) {
        assert_int_equal(l.codes[0][i] >= 0, floats[i] >= -1 && floats[i] <= 20);
        if (l.codes[0][i] >= 0) {
            assert_int_equal(l.codes[0][i] % (65535 / steps), 0);
            const int code = l.codes[0][i], step = 65535 / steps;
            const double value = trip_codes_value(&l.scale, code);
            const double above = trip_codes_value(&l.scale, code + step) - value;
            const double below = value - trip_codes_value(&l.scale, code - step);
            assert_true(fabs(value - floats[i]) <= 0.5001 * fmax(above, below));
            assert_true(fmax(above, below) <= 8 * all / steps);
        }
    }
    test_free_lists(&l);
}

/* The range of a wide type is only known once all values are read. Codes cover the whole range
 * nevertheless. */
static void codes_of_floats_cover_the_range_of_all_values(void **state)
{
    (void)state;
    check_codes_of_floats(TRIP_CODE_BITS_AUTO, 2, 65535, 0.25);
}

static void byte_codes_are_the_nearest_over_the_range_of_all_values(void **state)
{
    (void)state;
    check_codes_of_floats(TRIP_CODE_BITS_8, 1, 771, 258.0 / 255);
}

/* Codes cover the range of the values. Over the range of the type, these values would share a few
 * codes. */
static void shorts_of_a_narrow_range_use_all_codes_of_a_byte(void **state)
{
    (void)state;
    test_lists l;
    trip_brick_summary s;
    trip_brick_params p = params_for("uint16", "a.trip");
    uint16_t shorts[N];
    p.keep_all = true;
    p.code_bits = TRIP_CODE_BITS_8;
    make_bytes();
    for (int i = 0; i < N; i++)
        shorts[i] = (uint16_t)(1000 + 2 * bytes[i]);
    shorts[0] = 1000;
    shorts[1] = 1510;
    test_write("v.raw", shorts, sizeof shorts);
    assert_int_equal(trip_brick(&p, &s), 0);
    test_read_lists("a.trip", &l);
    test_check_lists(&l);
    assert_true(l.header.code_lo == 1000 - 2 * 258 && l.header.code_hi == 1510 + 2 * 258);
    for (int i = 0; i < N; i++)
        assert_int_equal(l.codes[0][i], 85 * (258 + (shorts[i] - 1000) / 2));
    test_free_lists(&l);
}

static void bytes_are_exact_in_16_bit_codes(void **state)
{
    (void)state;
    test_lists l;
    trip_brick_summary s;
    trip_brick_params p = params_for("uint8", "a.trip");
    p.keep_all = true;
    p.code_bits = TRIP_CODE_BITS_16;
    make_bytes();
    assert_int_equal(trip_brick(&p, &s), 0);
    test_read_lists("a.trip", &l);
    test_check_lists(&l);
    assert_int_equal(l.header.code_bytes, 2);
    for (int i = 0; i < N; i++)
        assert_int_equal(l.codes[0][i], 257 * bytes[i]);
    test_free_lists(&l);
}

static void gradients_of_floats_are_correct(void **state)
{
    (void)state;
    test_lists l;
    trip_brick_summary s;
    trip_brick_params p = params_for("float", "a.trip");
    p.keep_all = true;
    p.volume.spacing[0] = 5;
    p.volume.spacing[1] = 10;
    p.volume.spacing[2] = 20;
    make_floats();
    assert_int_equal(trip_brick(&p, &s), 0);
    test_read_lists("a.trip", &l);
    for (int k = 1; k < NZ - 1; k++)
        for (int j = 1; j < NY - 1; j++)
            for (int i = 1; i < NX - 1; i++) {
                const float *f = floats + ((size_t)k * NY + (size_t)j) * NX + (size_t)i;
                double g[3],
                    e[3] = { ((double)f[1] - f[-1]) / 2 / 5, ((double)f[NX] - f[-NX]) / 2 / 10,
                             ((double)f[NX * NY] - f[-NX * NY]) / 2 / 20 };
                double full = l.header.gradient_full;
                trip_normal_unpack(l.normals[0][f - floats], full, g);
                double length = sqrt(e[0] * e[0] + e[1] * e[1] + e[2] * e[2]);
                /* Below `full` the error is bounded by a lattice with steps of full / 511. Above,
                 * it is half a step of the length's square root, and 0.06 degrees. */
                double error = length < full
                                   ? full / 511
                                   : sqrt(length * full) / 32 + full / 1024 + 0.0012 * length;
                for (int a = 0; a < 3; a++)
                    assert_true(fabs(g[a] - e[a]) <= error);
            }
    test_free_lists(&l);
}

static void non_finite_values_are_dropped_with_one_warning(void **state)
{
    (void)state;
    test_lists l;
    trip_brick_summary s;
    trip_brick_params p = params_for("float", "a.trip");
    p.keep_all = true;
    make_floats();
    for (int i = 0; i < N; i += 7)
        floats[i] = i % 2 ? NAN : INFINITY;
    test_write("v.raw", floats, sizeof floats);
    assert_int_equal(trip_brick(&p, &s), 0);
    assert_int_equal(s.not_finite, (N + 6) / 7);
    test_read_lists("a.trip", &l);
    test_check_lists(&l);
    for (int i = 0; i < N; i++)
        assert_int_equal(l.codes[0][i] >= 0, i % 7 != 0);
    assert_ptr_equal(strchr(test_report, '\n'), test_report + strlen(test_report) - 1);
    assert_non_null(strstr(test_report, "values are not finite and count as absent"));
    test_free_lists(&l);
}

/* 8-bit values are their own codes, signed or not. 16-bit values have 16-bit codes. */
static void codes_have_the_bytes_of_the_source(void **state)
{
    (void)state;
    static const char *const types[] = { "uint8", "int8", "int16" };
    make_bytes();
    for (int i = 0; i < 3; i++) {
        test_lists l;
        trip_brick_summary s;
        trip_brick_params p = params_for(types[i], "a.trip");
        p.keep_all = p.replace = true;
        p.volume.raw_dims[2] = i == 2 ? NZ / 2 : NZ;
        assert_int_equal(trip_brick(&p, &s), 0);
        test_read_lists("a.trip", &l);
        test_check_lists(&l);
        assert_int_equal(s.code_bytes, i == 2 ? 2 : 1);
        assert_int_equal(l.header.code_bytes, s.code_bytes);
        for (int n = 0; n < N && i < 2; n++)
            assert_int_equal(l.codes[0][n], 85 * (258 + (i ? (int8_t)bytes[n] + 128 : bytes[n])));
        for (int n = 0; n < NX * NY * (NZ / 2) && i == 2; n++)
            assert_int_equal(l.codes[0][n],
                             (int16_t)(bytes[2 * n] | bytes[2 * n + 1] << 8) + 32768);
        test_free_lists(&l);
    }
}

/* Bricks the bytes as a NIfTI-1 file with this slope and intercept. */
static trip_brick_summary brick_scaled(float slope, float inter)
{
    static struct {
        unsigned char header[352], values[N];
    } file;
    static char input[128];
    const int32_t size = 348;
    const int16_t dims[4] = { 3, NX, NY, NZ }, type = 2, bits = 8;
    const float offset = 352;
    memcpy(file.values, bytes, sizeof bytes);
    memcpy(file.header, &size, 4);
    memcpy(file.header + 40, dims, sizeof dims);
    memcpy(file.header + 70, &type, 2);
    memcpy(file.header + 72, &bits, 2);
    memcpy(file.header + 108, &offset, 4);
    memcpy(file.header + 112, &slope, 4);
    memcpy(file.header + 116, &inter, 4);
    memcpy(file.header + 344, "n+1", 4);
    test_write("v.nii", &file, sizeof file);
    trip_brick_summary s;
    trip_brick_params p = params_for(NULL, "a.trip");
    strcpy(input, test_path("v.nii"));
    p.input = input;
    p.volume = (trip_volume_params){ 0 };
    p.keep_all = p.replace = true;
    assert_int_equal(trip_brick(&p, &s), 0);
    return s;
}

/* The values are 10 - 2 times the bytes: -500 to 10. */
static void byte_codes_are_exact_under_a_negative_slope(void **state)
{
    (void)state;
    test_lists l;
    make_bytes();
    brick_scaled(-2, 10);
    test_read_lists("a.trip", &l);
    assert_int_equal(l.header.code_bytes, 1);
    assert_true(l.header.code_lo < l.header.code_hi);
    for (int n = 0; n < N; n++)
        assert_int_equal(l.codes[0][n], 85 * (258 + 255 - bytes[n]));
    for (int stored = 0; stored < 256; stored += 255) {
        const double part = 85 * (258 + 255 - stored) / 65535.0;
        const double value = l.header.code_lo + (l.header.code_hi - l.header.code_lo) * part;
        assert_true(fabs(value - (10 - 2 * stored)) < 1e-9);
    }
    test_free_lists(&l);
}

/* Floats near 10^6 are 1/16 apart, so they cannot represent tenths. */
static void bytes_scaled_to_inexact_floats_have_16_bit_codes(void **state)
{
    (void)state;
    make_bytes();
    assert_int_equal(brick_scaled(0.1f, 1).code_bytes, 1);
    assert_int_equal(brick_scaled(0.1f, 1e6f).code_bytes, 2);
}

/* The field is linear in world space, so its gradient is the same everywhere. */
static void gradients_of_uneven_grids_are_in_world_space(void **state)
{
    (void)state;
    const int size[3] = { NX, NY, NZ };
    const double slope[3] = { 2, -1, 0.5 };
    double positions[3][NX];
    char files[400], paths[3][128];
    test_lists l;
    trip_brick_summary s;
    trip_brick_params p = params_for("float", "a.trip");
    for (int a = 0; a < 3; a++) {
        snprintf(paths[a], sizeof paths[a], "%s.%c", p.input, 'x' + a);
        FILE *f = fopen(paths[a], "w");
        for (int i = 0; i < size[a]; i++) { /* steps of 1, 2, 3, 1, 2, 3 ... */
            positions[a][i] = i / 3 * 6 + (i % 3 == 0 ? 0 : i % 3 == 1 ? 1 : 3);
            fprintf(f, "%g\n", positions[a][i]);
        }
        fclose(f);
    }
    snprintf(files, sizeof files, "%s,%s,%s", paths[0], paths[1], paths[2]);
    for (int i = 0; i < N; i++)
        floats[i] = (float)(slope[0] * positions[0][i % NX] + slope[1] * positions[1][i / NX % NY] +
                            slope[2] * positions[2][i / NX / NY]);
    test_write("v.raw", floats, sizeof floats);
    p.volume.coordinates = files;
    p.keep_all = true;
    assert_int_equal(trip_brick(&p, &s), 0);
    test_read_lists("a.trip", &l);
    for (int i = 0; i < N; i++) {
        double g[3];
        trip_normal_unpack(l.normals[0][i], l.header.gradient_full, g);
        for (int a = 0; a < 3; a++)
            assert_true(fabs(g[a] - slope[a]) <= l.header.gradient_full / 511);
    }
    test_free_lists(&l);
    make_bytes(); /* the differences of the bytes are no multiples of a step */
    p.volume.raw_type = "uint8";
    p.replace = true;
    assert_int_equal(trip_brick(&p, &s), 0);
    assert_int_equal(s.normal_bytes, 4);
}

static void check_compact_normal(const trip_compact_normals *c, uint32_t normal, const uint8_t *b)
{
    const double e[3] = { (b[1] - b[-1]) / 2.0, (b[NX] - b[-NX]) / 2.0,
                          (b[NX * NY] - b[-NX * NY]) / 2.0 };
    double g[3], length = sqrt(e[0] * e[0] + e[1] * e[1] + e[2] * e[2]);
    trip_compact_normal_unpack(c, normal, g);
    double along = g[0] * e[0] + g[1] * e[1] + g[2] * e[2];
    if (length < c->full) {
        double sign = along < 0 ? -1 : 1;
        assert_true(g[0] == sign * e[0] && g[1] == sign * e[1] && g[2] == sign * e[2]);
    } else { /* within a tenth of a degree */
        assert_true(fabs(along) > cos(0.1 * M_PI / 180) * length * c->full * (1 - 1e-9));
    }
}

static void compact_normals_of_bytes_are_exact_below_full_shading(void **state)
{
    (void)state;
    test_lists l;
    trip_brick_summary s;
    trip_brick_params p = params_for("uint8", "a.trip");
    const trip_affine m = trip_affine_identity();
    p.keep_all = true;
    make_bytes();
    assert_int_equal(trip_brick(&p, &s), 0);
    assert_int_equal(s.normal_bytes, 3);
    test_read_lists("a.trip", &l);
    assert_true(fabs(l.header.gradient_full - 0.04 * 255) < 1e-12);
    trip_compact_normals c =
        trip_compact_normals_make(&m, l.header.gradient_full, l.header.gradient_step);
    for (int k = 1; k < NZ - 1; k++)
        for (int j = 1; j < NY - 1; j++)
            for (int i = 1; i < NX - 1; i++) {
                size_t at = ((size_t)k * NY + (size_t)j) * NX + (size_t)i;
                check_compact_normal(&c, l.normals[0][at], bytes + at);
            }
    test_free_lists(&l);
}

/* Compact normals store half differences of bytes up to 63.5. A gradient is stored exactly up to
 * 0.04 * 255 per mean voxel length. Along z, that limit is multiplied by the z spacing over the
 * mean voxel length. */
static void bytes_get_compact_normals_if_half_steps_cover_the_range(void **state)
{
    (void)state;
    make_bytes();
    for (int i = 0; i < 2; i++) {
        trip_brick_summary s;
        trip_brick_params p = params_for("uint8", "a.trip");
        p.keep_all = p.replace = true;
        p.volume.spacing[0] = p.volume.spacing[1] = 1;
        p.volume.spacing[2] = i ? 27 : 8; /* 10.2 * 27 / 3 exceeds 63.5, 10.2 * 8 / 2 does not */
        assert_int_equal(trip_brick(&p, &s), 0);
        assert_int_equal(s.normal_bytes, i ? 4 : 3);
    }
}

/* Compact normals need the range of values. If nothing else needs the range, normals are full. */
static void normals_have_the_chosen_number_of_bytes(void **state)
{
    (void)state;
    static const struct {
        trip_brick_normals normals;
        bool ranges;
        unsigned bytes;
    } ways[] = {
        { TRIP_NORMALS_STORED, false, 4 },  { TRIP_NORMALS_STORED, true, 4 },
        { TRIP_NORMALS_COMPACT, true, 3 },  { TRIP_NORMALS_FULL, false, 4 },
        { TRIP_NORMALS_COMPACT, false, 3 }, { TRIP_NORMALS_NONE, true, 0 },
    };
    const trip_value_range range = { -1, 20 };
    make_floats();
    for (size_t i = 0; i < sizeof ways / sizeof *ways; i++) {
        trip_brick_summary s;
        trip_brick_params p = params_for("float", "a.trip");
        p.replace = true;
        p.normals = ways[i].normals;
        p.ranges = &range;
        p.range_count = ways[i].ranges;
        assert_int_equal(trip_brick(&p, &s), 0);
        assert_int_equal(s.normal_bytes, ways[i].bytes);
    }
}

static void brick_to(trip_brick_params p, const char *output)
{
    trip_brick_summary s;
    p.output = test_path(output);
    p.replace = true;
    if (trip_brick(&p, &s) != 0)
        fail_msg("%s", test_report);
}

static void check_ways(const trip_brick_params *base)
{
    brick_to(*base, "a.trip");
    for (int way = 0; way < 5; way++) {
        trip_brick_params p = *base;
        p.threads = (unsigned[]){ 1, 1, 4, 3, 2 }[way];
        p.slices = (int64_t[]){ 0, 1, 5, 23, 64 }[way];
        p.memory_bytes = (uint64_t[]){ 0, 29 << 20, 48 << 20, 64 << 20, 256 << 20 }[way];
        brick_to(p, "b.trip");
        test_same_dataset("a.trip", "b.trip");
    }
}

static void memory_threads_and_slabs_do_not_change_the_result(void **state)
{
    (void)state;
    trip_brick_params p = params_for("uint8", "a.trip");
    make_bytes();
    p.keep_all = true;
    check_ways(&p);
    p = params_for("uint8", "a.trip");
    check_ways(&p);
    make_floats();
    p = params_for("float", "a.trip");
    p.keep_all = true;
    check_ways(&p);
    p = params_for("float", "a.trip");
    check_ways(&p);
    make_strange_floats();
    check_ways(&p);
    p.keep_all = true;
    check_ways(&p);
    make_ids();
    p = params_for("uint32", "a.trip");
    check_ways(&p);
}

static void the_order_of_splats_does_not_depend_on_tiles(void **state)
{
    (void)state;
    trip_brick_params p = params_for("uint8", "a.trip");
    p.ranges = &middle;
    p.range_count = 1;
    make_bytes();
    brick_to(p, "a.trip");
    for (unsigned tile = 16; tile <= 128; tile *= 2) {
        test_lists l;
        p.tile_voxels = tile;
        p.slab_sheets = tile / 4;
        brick_to(p, "b.trip");
        test_read_lists("b.trip", &l);
        test_check_lists(&l);
        test_free_lists(&l);
        /* Normals depend on the order of splats, not on the tile size. Positions in voxel records
         * depend on both. */
        assert_true(test_same_file(test_path("a.trip/x0.normals"), test_path("b.trip/x0.normals")));
        assert_true(test_same_file(test_path("a.trip/y0.normals"), test_path("b.trip/y0.normals")));
        assert_true(test_same_file(test_path("a.trip/z0.normals"), test_path("b.trip/z0.normals")));
    }
}

static void without_normals_the_plane_is_absent(void **state)
{
    (void)state;
    test_lists l;
    trip_brick_params p = params_for("uint8", "a.trip");
    p.normals = TRIP_NORMALS_NONE;
    p.keep_all = true;
    make_bytes();
    brick_to(p, "a.trip");
    test_read_lists("a.trip", &l);
    test_check_lists(&l);
    assert_int_equal(l.header.planes & 1u << TRIP_PLANE_NORMALS, 0);
    assert_int_equal(l.header.kept, N);
    assert_false(test_exists("a.trip/x0.normals"));
    test_free_lists(&l);
}

static void check_refused(trip_brick_params p, const char *why)
{
    trip_brick_summary s;
    test_report[0] = 0;
    assert_true(trip_brick(&p, &s) < 0);
    if (!strstr(test_report, why))
        fail_msg("\"%s\" does not say \"%s\"", test_report, why);
    assert_ptr_equal(strchr(test_report, '\n'), test_report + strlen(test_report) - 1);
    assert_false(test_exists("a.trip"));
    assert_false(test_exists("a.trip.partial"));
    assert_false(test_exists("a.trip.spill"));
}

static void impossible_requests_report_one_line_and_leave_no_files(void **state)
{
    (void)state;
    const trip_value_range above = { 300, 400 };
    trip_brick_params p = params_for("uint8", "a.trip");
    make_bytes();
    p.ranges = &above;
    p.range_count = 1;
    check_refused(p, "no voxel is visible: the values are from 20 to ");
    p = params_for("uint8", "a.trip");
    p.memory_bytes = 1 << 20;
    check_refused(p, "--memory");
    /* The memory that the error line asks for suffices. */
    for (unsigned threads = 1; threads < 4; threads++) {
        unsigned min = 0;
        char same[200];
        p.memory_bytes = 1 << 20;
        p.threads = threads;
        check_refused(p, threads > 1 ? "threads need --memory " : "1 thread need --memory ");
        assert_int_equal(sscanf(strstr(test_report, "--memory "), "--memory %uM", &min), 1);
        snprintf(same, sizeof same, "%s", strstr(test_report, "slices of"));
        p.memory_bytes = (uint64_t)(min - 2) << 20;
        check_refused(p, same);
        p.memory_bytes = (uint64_t)min << 20;
        assert_int_equal(trip_brick(&p, &(trip_brick_summary){ 0 }), 0);
        assert_int_equal(rename(p.output, test_path(threads > 1 ? threads > 2 ? "3" : "2" : "1")),
                         0);
    }
    p = params_for("uint8", "a.trip");
    p.volume.raw_dims[2] = NZ + 1;
    check_refused(p, "v.raw");
    p = params_for("uint8", "no/such/folder.trip");
    check_refused(p, "No such file");
    static const trip_region beyond[] = { { { 0, 0, 0 }, { 0, NY + 1, 0 } },
                                          { { 0, NY, 0 }, { 0, 0, 0 } },
                                          { { 0, 7, 0 }, { 0, 7, 0 } },
                                          { { 0, -1, 0 }, { 0, 0, 0 } } };
    for (size_t i = 0; i < sizeof beyond / sizeof *beyond; i++) {
        p = params_for("uint8", "a.trip");
        p.keep_all = true;
        p.region = beyond[i];
        check_refused(p, "leaves the grid along j");
    }
    p = params_for("float", "a.trip");
    for (int i = 0; i < N; i++)
        floats[i] = NAN;
    test_write("v.raw", floats, sizeof floats);
    p.keep_all = true;
    check_refused(p, "has no finite values");
}

static void an_existing_data_set_stays_without_replace(void **state)
{
    (void)state;
    trip_brick_summary s;
    trip_brick_params p = params_for("uint8", "a.trip");
    p.ranges = &middle;
    p.range_count = 1;
    make_bytes();
    assert_int_equal(trip_brick(&p, &s), 0);
    assert_true(trip_brick(&p, &s) < 0);
    assert_non_null(strstr(test_report, "exists"));
    assert_true(test_exists("a.trip/index.trip"));
    p.replace = true;
    assert_int_equal(trip_brick(&p, &s), 0);
}

/* Kills the process when a stage reaches this share. */
typedef struct killer {
    const char *stage;
    double share;
} killer;

static void kill_at(void *user, const char *stage, uint64_t done, uint64_t total)
{
    const killer *k = user;
    if (strcmp(stage, k->stage) == 0 && (double)done >= k->share * (double)total)
        raise(SIGKILL);
}

static void run_killed(trip_brick_params p, const killer *k)
{
    pid_t child = fork();
    int how;
    assert_true(child >= 0);
    if (child == 0) {
        trip_brick_summary s;
        p.progress = kill_at;
        p.progress_user = (void *)(uintptr_t)k;
        trip_brick(&p, &s);
        fputs(test_report, stderr);
        _exit(0);
    }
    assert_int_equal(waitpid(child, &how, 0), child);
    if (!WIFSIGNALED(how))
        fail_msg("not killed in %s at %g", k->stage, k->share);
}

static void check_resumed(const trip_brick_params *base, bool *any_checkpoint)
{
    const killer killers[] = { { "scan", 0.5 }, { "read", 0 },   { "read", 0.3 },
                               { "read", 0.6 }, { "read", 0.8 }, { "read", 1 } };
    trip_brick_params p = *base;
    trip_brick_summary s;
    char output[128], command[160];
    strcpy(output, test_path("b.trip"));
    p.output = output;
    p.resume = true;
    /* Only runs with an automatic envelope scan the volume first. */
    for (size_t i = p.keep_all ? 1 : 0; i < sizeof killers / sizeof *killers; i++)
        run_killed(p, &killers[i]);
    assert_false(test_exists("b.trip"));
    assert_int_equal(trip_brick(&p, &s), 0);
    *any_checkpoint = *any_checkpoint || s.resumed;
    test_same_dataset("a.trip", "b.trip");
    assert_false(test_exists("b.trip.spill"));
    snprintf(command, sizeof command, "rm -rf %s", output);
    assert_int_equal(system(command), 0);
}

static void killed_runs_resume_and_give_the_same_bytes(void **state)
{
    (void)state;
    bool resumed = false;
    static const struct {
        const char *type;
        void (*make)(void);
        bool keep_all;
    } kinds[] = { { "uint8", make_bytes, false },         { "uint8", make_bytes, true },
                  { "float", make_floats, true },         { "float", make_strange_floats, false },
                  { "float", make_strange_floats, true }, { "uint32", make_ids, false } };
    for (size_t kind = 0; kind < sizeof kinds / sizeof *kinds; kind++) {
        trip_brick_params p = params_for(kinds[kind].type, "a.trip");
        kinds[kind].make();
        p.keep_all = kinds[kind].keep_all;
        p.threads = 1;
        p.slices = 4;
        p.memory_bytes = 29 << 20;
        brick_to(p, "a.trip");
        check_resumed(&p, &resumed);
    }
    assert_true(resumed);
}

static void a_run_does_not_resume_with_other_input_or_parameters(void **state)
{
    (void)state;
    trip_brick_params p = params_for("uint8", "a.trip");
    trip_brick_summary s;
    make_bytes();
    p.keep_all = true;
    p.slices = 4;
    run_killed(p, &(killer){ "read", 0.5 });
    assert_true(test_exists("a.trip.spill"));
    p.resume = true;
    p.tile_voxels = 32;
    assert_true(trip_brick(&p, &s) < 0);
    assert_non_null(strstr(test_report, "another input or other options"));
    p.resume = false;
    assert_int_equal(trip_brick(&p, &s), 0);
    assert_false(s.resumed);
}

/* Writes squares, used as uneven coordinates of the slices. */
static void write_squares(const char *name)
{
    char text[512];
    int used = 0;
    for (int z = 0; z < NZ; z++)
        used += snprintf(text + used, sizeof text - (size_t)used, "%d\n", z * z);
    test_write(name, text, (size_t)used);
}

/* Another data file changes, not the file named as the input. */
static void a_run_does_not_resume_after_a_data_file_changed(void **state)
{
    (void)state;
    static const char header[] = "NRRD0001\ntype: uint8\ndimension: 3\nsizes: 97 70 61\n"
                                 "encoding: raw\ndata file: v.raw\n";
    char input[128], files[128];
    trip_brick_params p = params_for("uint8", "a.trip");
    trip_brick_summary s;
    make_bytes();
    test_write("v.nhdr", header, sizeof header - 1);
    write_squares("z.txt");
    strcpy(input, test_path("v.nhdr"));
    snprintf(files, sizeof files, ",,%s", test_path("z.txt"));
    p.input = input;
    p.volume = (trip_volume_params){ .coordinates = files };
    p.keep_all = true;
    p.slices = 4;
    for (int i = 0; i < 2; i++) {
        p.resume = false;
        test_report[0] = 0;
        run_killed(p, &(killer){ "read", 0.5 });
        /* Another file with the same bytes replaces the file. Its inode differs. */
        if (i == 0)
            test_write("new", bytes, sizeof bytes);
        else
            write_squares("new");
        assert_int_equal(rename(test_path("new"), test_path(i == 0 ? "v.raw" : "z.txt")), 0);
        p.resume = true;
        assert_true(trip_brick(&p, &s) < 0);
        assert_non_null(strstr(test_report, "another input or other options"));
    }
}

static void the_summary_tells_the_requested_levels(void **state)
{
    (void)state;
    const struct {
        int levels;
        trip_brick_levels_for levels_for;
        const char *options;
    } asked[] = {
        { 0, TRIP_LEVELS_FOR_AUTO, "[\"--size=97,70,61\",\"--type=uint8\"]" },
        { -1, TRIP_LEVELS_FOR_AUTO, "[\"--size=97,70,61\",\"--type=uint8\",\"--levels=0\"]" },
        { 2, TRIP_LEVELS_FOR_BOTH,
          "[\"--size=97,70,61\",\"--type=uint8\",\"--levels=2\","
          "\"--levels-for=both\"]" },
        { 0, TRIP_LEVELS_FOR_PRE, "[\"--size=97,70,61\",\"--type=uint8\",\"--levels-for=pre\"]" }
    };
    trip_brick_params p = params_for("uint8", "a.trip");
    trip_brick_summary s;
    make_bytes();
    p.replace = true;
    p.normals = TRIP_NORMALS_AUTO;
    for (size_t i = 0; i < sizeof asked / sizeof *asked; i++) {
        test_lists l;
        p.levels = asked[i].levels;
        p.levels_for = asked[i].levels_for;
        assert_int_equal(trip_brick(&p, &s), 0);
        test_read_lists("a.trip", &l);
        assert_non_null(strstr(l.text, asked[i].options));
        test_free_lists(&l);
    }
}

static void a_locale_with_decimal_commas_changes_nothing(void **state)
{
    (void)state;
    char *points[2] = { 0 }, *commas[2] = { 0 };
    trip_brick_params p = params_for("uint8", "a.trip");
    p.ranges = (const trip_value_range[]){ { 60.3, 255 } };
    p.range_count = 1;
    p.volume.spacing[0] = 0.7;
    assert_int_equal(trip_brick_form_text(&p, &points[0]), 0);
    assert_int_equal(trip_brick_kept_text(&p, &points[1]), 0);
    need_comma_locale();
    const int form = trip_brick_form_text(&p, &commas[0]);
    const int kept = trip_brick_kept_text(&p, &commas[1]);
    setlocale(LC_ALL, "C");
    assert_true(form == 0 && kept == 0);
    for (int i = 0; i < 2; i++) {
        assert_string_equal(commas[i], points[i]);
        free(commas[i]);
        free(points[i]);
    }
}

static void levels_of_uneven_grids_are_refused(void **state)
{
    (void)state;
    char files[128];
    trip_brick_params p = params_for("uint8", "a.trip");
    trip_brick_summary s;
    trip_brick_estimate e;
    make_bytes();
    write_squares("z.txt");
    snprintf(files, sizeof files, ",,%s", test_path("z.txt"));
    p.volume.coordinates = files;
    p.levels = 3;
    assert_int_equal(trip_brick(&p, &s), TRIP_USAGE);
    assert_non_null(strstr(test_report, "leave out --levels"));
    assert_int_equal(trip_brick_estimate_make(&p, &e), TRIP_USAGE);
    p.levels = 0;
    p.levels_for = TRIP_LEVELS_FOR_BOTH;
    assert_int_equal(trip_brick(&p, &s), 0);
    assert_int_equal(s.levels, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(codes_have_the_bytes_of_the_source, test_begin, test_end),
        cmocka_unit_test_setup_teardown(compact_normals_of_bytes_are_exact_below_full_shading,
                                        test_begin, test_end),
        cmocka_unit_test_setup_teardown(bytes_get_compact_normals_if_half_steps_cover_the_range,
                                        test_begin, test_end),
        cmocka_unit_test_setup_teardown(normals_have_the_chosen_number_of_bytes, test_begin,
                                        test_end),
        cmocka_unit_test_setup_teardown(the_envelope_selects_the_kept_voxels, test_begin, test_end),
        cmocka_unit_test_setup_teardown(a_transfer_function_keeps_the_voxels_it_shows, test_begin,
                                        test_end),
        cmocka_unit_test_setup_teardown(transfer_functions_too_large_for_a_data_set_are_refused,
                                        test_begin, test_end),
        cmocka_unit_test_setup_teardown(the_automatic_envelope_keeps_voxels_and_stores_a_function,
                                        test_begin, test_end),
        cmocka_unit_test_setup_teardown(codes_of_floats_cover_the_range_of_all_values, test_begin,
                                        test_end),
        cmocka_unit_test_setup_teardown(byte_codes_are_the_nearest_over_the_range_of_all_values,
                                        test_begin, test_end),
        cmocka_unit_test_setup_teardown(shorts_of_a_narrow_range_use_all_codes_of_a_byte,
                                        test_begin, test_end),
        cmocka_unit_test_setup_teardown(bytes_are_exact_in_16_bit_codes, test_begin, test_end),
        cmocka_unit_test_setup_teardown(gradients_of_floats_are_correct, test_begin, test_end),
        cmocka_unit_test_setup_teardown(non_finite_values_are_dropped_with_one_warning, test_begin,
                                        test_end),
        cmocka_unit_test_setup_teardown(memory_threads_and_slabs_do_not_change_the_result,
                                        test_begin, test_end),
        cmocka_unit_test_setup_teardown(the_order_of_splats_does_not_depend_on_tiles, test_begin,
                                        test_end),
        cmocka_unit_test_setup_teardown(without_normals_the_plane_is_absent, test_begin, test_end),
        cmocka_unit_test_setup_teardown(byte_codes_are_exact_under_a_negative_slope, test_begin,
                                        test_end),
        cmocka_unit_test_setup_teardown(bytes_scaled_to_inexact_floats_have_16_bit_codes,
                                        test_begin, test_end),
        cmocka_unit_test_setup_teardown(gradients_of_uneven_grids_are_in_world_space, test_begin,
                                        test_end),
        cmocka_unit_test_setup_teardown(impossible_requests_report_one_line_and_leave_no_files,
                                        test_begin, test_end),
        cmocka_unit_test_setup_teardown(an_existing_data_set_stays_without_replace, test_begin,
                                        test_end),
        cmocka_unit_test_setup_teardown(killed_runs_resume_and_give_the_same_bytes, test_begin,
                                        test_end),
        cmocka_unit_test_setup_teardown(a_run_does_not_resume_after_a_data_file_changed, test_begin,
                                        test_end),
        cmocka_unit_test_setup_teardown(a_run_does_not_resume_with_other_input_or_parameters,
                                        test_begin, test_end),
        cmocka_unit_test_setup_teardown(the_summary_tells_the_requested_levels, test_begin,
                                        test_end),
        cmocka_unit_test_setup_teardown(a_locale_with_decimal_commas_changes_nothing, test_begin,
                                        test_end),
        cmocka_unit_test_setup_teardown(levels_of_uneven_grids_are_refused, test_begin, test_end),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
