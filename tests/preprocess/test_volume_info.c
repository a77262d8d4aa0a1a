#include "volume_files.h"

#include "volume_info.h"

static void every_type_has_a_name(void **state)
{
    (void)state;
    for (int t = 0; t < TRIP_SCALARS; t++)
        assert_int_equal(trip_scalar_from_name(trip_scalar_name((trip_scalar)t)), t);
}

static void common_aliases_are_known(void **state)
{
    (void)state;
    assert_int_equal(trip_scalar_from_name("unsigned char"), TRIP_U8);
    assert_int_equal(trip_scalar_from_name("UINT8"), TRIP_U8);
    assert_int_equal(trip_scalar_from_name("short"), TRIP_I16);
    assert_int_equal(trip_scalar_from_name("unsigned short"), TRIP_U16);
    assert_int_equal(trip_scalar_from_name("int"), TRIP_I32);
    assert_int_equal(trip_scalar_from_name("uint32"), TRIP_U32);
    assert_int_equal(trip_scalar_from_name("long long int"), TRIP_I64);
    assert_int_equal(trip_scalar_from_name("ulonglong"), TRIP_U64);
    assert_int_equal(trip_scalar_from_name("float16"), TRIP_F16);
    assert_int_equal(trip_scalar_from_name("float32"), TRIP_F32);
    assert_int_equal(trip_scalar_from_name("float64"), TRIP_F64);
    assert_int_equal(trip_scalar_from_name("float128"), -1);
    assert_int_equal(trip_scalar_from_name(""), -1);
}

static void every_type_decodes_in_both_byte_orders(void **state)
{
    (void)state;
    const uint16_t one = 1;
    bool machine_is_big = *(const unsigned char *)&one == 0;
    for (int t = 0; t < TRIP_SCALARS; t++)
        for (int big = 0; big < 2; big++) {
            bytes b = { .count = 0 };
            float values[VOXELS];
            append_volume(&b, (trip_scalar)t, big);
            trip_scalar_decode((trip_scalar)t, big != machine_is_big, 1, 0, b.data, VOXELS, values);
            for (int v = 0; v < VOXELS; v++)
                assert_true(values[v] ==
                            (float)sample((trip_scalar)t, v % NX, v / NX % NY, v / NX / NY));
        }
}

static void extremes_of_the_integers_survive(void **state)
{
    (void)state;
    const uint64_t u64 = UINT64_MAX;
    const int64_t i64 = INT64_MIN;
    const uint32_t u32 = UINT32_MAX;
    const int32_t i32 = INT32_MIN;
    const int8_t i8 = -128;
    float v;
    trip_scalar_decode(TRIP_U64, false, 1, 0, &u64, 1, &v);
    assert_true(v == 0x1p64f);
    trip_scalar_decode(TRIP_I64, false, 1, 0, &i64, 1, &v);
    assert_true(v == -0x1p63f);
    trip_scalar_decode(TRIP_U32, false, 1, 0, &u32, 1, &v);
    assert_true(v == 0x1p32f);
    trip_scalar_decode(TRIP_I32, false, 1, 0, &i32, 1, &v);
    assert_true(v == -0x1p31f);
    trip_scalar_decode(TRIP_I8, false, 1, 0, &i8, 1, &v);
    assert_true(v == -128);
}

/* sign * fraction * 2^exponent, from the definition of binary16. */
static void every_half_decodes_to_its_value(void **state)
{
    (void)state;
    for (unsigned bits = 0; bits < 65536; bits++) {
        uint16_t half = (uint16_t)bits;
        int exponent = half >> 10 & 31, fraction = half & 1023;
        double expected = exponent == 31  ? (fraction ? NAN : INFINITY)
                          : exponent == 0 ? ldexp(fraction, -24)
                                          : ldexp(1024 + fraction, exponent - 25);
        float v;
        trip_scalar_decode(TRIP_F16, false, 1, 0, &half, 1, &v);
        if (isnan(expected))
            assert_true(isnan(v));
        else
            assert_true((double)v == (half & 0x8000 ? -expected : expected));
        assert_true(isnan(expected) || !signbit(v) == !(half & 0x8000));
    }
}

static void unsigned_interpretation_changes_negative_values(void **state)
{
    (void)state;
    static const trip_scalar types[][2] = { { TRIP_I8, TRIP_U8 },   { TRIP_I16, TRIP_U16 },
                                            { TRIP_I32, TRIP_U32 }, { TRIP_I64, TRIP_U64 },
                                            { TRIP_U8, TRIP_U8 },   { TRIP_F32, TRIP_F32 } };
    for (size_t i = 0; i < sizeof types / sizeof types[0]; i++)
        assert_int_equal(trip_scalar_unsigned(types[i][0]), types[i][1]);
    assert_true(trip_scalar_without_sign(TRIP_I8, -1) == 255);
    assert_true(trip_scalar_without_sign(TRIP_I8, 7) == 7);
    assert_true(trip_scalar_without_sign(TRIP_U64, -1024) == 18446744073709550592.0);
    assert_true(isnan(trip_scalar_without_sign(TRIP_U16, NAN)));
}

static void scaling_is_rounded_once(void **state)
{
    (void)state;
    static const double scales[][2] = { { 1.0 / 3, -1e-3 }, { 1, -1024 }, { 0.5, 0 } };
    for (int n = 0; n < 3; n++)
        for (int i = -32768; i < 32768; i += 7) {
            int16_t stored = (int16_t)i;
            float v;
            trip_scalar_decode(TRIP_I16, false, scales[n][0], scales[n][1], &stored, 1, &v);
            assert_true(v == (float)(scales[n][0] * i + scales[n][1]));
        }
}

static void non_finite_values_pass_through(void **state)
{
    (void)state;
    const float stored[3] = { NAN, INFINITY, -INFINITY };
    float v[3];
    trip_scalar_decode(TRIP_F32, false, 1, 0, stored, 3, v);
    assert_true(isnan(v[0]) && v[1] == INFINITY && v[2] == -INFINITY);
    trip_scalar_decode(TRIP_F32, false, 2, 1, stored, 3, v);
    assert_true(isnan(v[0]) && v[1] == INFINITY && v[2] == -INFINITY);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_type_has_a_name),
        cmocka_unit_test(common_aliases_are_known),
        cmocka_unit_test(every_type_decodes_in_both_byte_orders),
        cmocka_unit_test(extremes_of_the_integers_survive),
        cmocka_unit_test(every_half_decodes_to_its_value),
        cmocka_unit_test(unsigned_interpretation_changes_negative_values),
        cmocka_unit_test(scaling_is_rounded_once),
        cmocka_unit_test(non_finite_values_pass_through),
    };
    return cmocka_run_group_tests_name("scalar", tests, make_folder, remove_folder);
}
