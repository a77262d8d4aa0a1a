/* Records against their bricks, one bad record at every place. */
#include "test.h"

#include "record_check.h"

enum { MOST = 19 };

static const trip_file_brick brick = {
    .code_min = 300, .code_max = 40000, .u_min = 3, .u_max = 9, .v_min = 0, .v_max = 15
};

/* Any record inside, by a number. */
static uint32_t inside(unsigned i)
{
    return trip_voxel_pack(3 + i % 7, i * 5 % 16, 300 + i * 2089 % 39701);
}

static void records_inside_their_brick_are_sound(void **state)
{
    uint32_t records[MOST];
    (void)state;
    for (unsigned i = 0; i < MOST; i++)
        records[i] = inside(i);
    records[1] = trip_voxel_pack(3, 0, 300);
    records[2] = trip_voxel_pack(9, 15, 40000);
    for (size_t count = 0; count <= MOST; count++)
        assert_int_equal(trip_record_check(&brick, records, count), count);
}

static void expect_found(uint32_t bad, const char *fault)
{
    uint32_t records[MOST];
    for (size_t count = 1; count <= MOST; count++)
        for (size_t at = 0; at < count; at++) {
            for (unsigned i = 0; i < MOST; i++)
                records[i] = i == at || i >= count ? bad : inside(i);
            assert_int_equal(trip_record_check(&brick, records, count), at);
        }
    assert_string_equal(trip_record_fault(&brick, bad), fault);
}

static void one_record_outside_is_found_wherever_it_stands(void **state)
{
    const char *bounds = "the splat is outside its brick's bounds";
    const char *range = "the value is outside its brick's range";
    (void)state;
    expect_found(trip_voxel_pack(2, 5, 1000), bounds);
    expect_found(trip_voxel_pack(10, 5, 1000), bounds);
    expect_found(trip_voxel_pack(255, 5, 1000), bounds);
    expect_found(trip_voxel_pack(5, 16, 1000), bounds);
    expect_found(trip_voxel_pack(5, 255, 1000), bounds);
    expect_found(trip_voxel_pack(5, 5, 299), range);
    expect_found(trip_voxel_pack(5, 5, 40001), range);
    expect_found(trip_voxel_pack(5, 5, 65535), range);
    expect_found(trip_voxel_pack(5, 5, 0), range);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(records_inside_their_brick_are_sound),
        cmocka_unit_test(one_record_outside_is_found_wherever_it_stands),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
