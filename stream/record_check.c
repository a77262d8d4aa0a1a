#include "record_check.h"

#include <stdbool.h>
#include <string.h>

/* Four records: u, v, code's low and high byte of each; or u and v together, and the code. */
typedef uint8_t bytes16 __attribute__((vector_size(16)));
typedef uint16_t words8 __attribute__((vector_size(16)));
typedef uint32_t records4 __attribute__((vector_size(16)));

static records4 four(uint32_t record)
{
    return (records4){ record, record, record, record };
}

/* Smallest and largest of a brick's records, byte by byte, and by the codes. */
typedef struct limits {
    bytes16 place_lo, place_hi;
    words8 code_lo, code_hi;
} limits;

static limits limits_of(const trip_file_brick *b)
{
    return (limits){
        .place_lo = (bytes16)four(trip_voxel_pack(b->u_min, b->v_min, 0)),
        .place_hi = (bytes16)four(trip_voxel_pack(b->u_max, b->v_max, 65535)),
        .code_lo = (words8)four(trip_voxel_pack(0, 0, b->code_min)),
        .code_hi = (words8)four(trip_voxel_pack(255, 255, b->code_max)),
    };
}

/* Not zero where one of four records is outside. */
static records4 outside(const limits *l, const uint32_t records[4])
{
    records4 r;
    memcpy(&r, records, sizeof r);
    bytes16 place = (bytes16)r;
    words8 code = (words8)r;
    return (records4)((place < l->place_lo) | (place > l->place_hi)) |
           (records4)((code < l->code_lo) | (code > l->code_hi));
}

static bool is_outside(const trip_file_brick *b, uint32_t record)
{
    unsigned u = trip_voxel_u(record), v = trip_voxel_v(record), code = trip_voxel_code(record);
    return u < b->u_min || u > b->u_max || v < b->v_min || v > b->v_max || code < b->code_min ||
           code > b->code_max;
}

static bool all_inside(const trip_file_brick *b, const uint32_t *records, size_t count)
{
    const limits l = limits_of(b);
    records4 any = { 0 };
    size_t i = 0;
    for (; i + 4 <= count; i += 4)
        any |= outside(&l, records + i);
    bool found = (any[0] | any[1] | any[2] | any[3]) != 0;
    for (; i < count; i++)
        found |= is_outside(b, records[i]);
    return !found;
}

size_t trip_record_check(const trip_file_brick *b, const uint32_t *records, size_t count)
{
    size_t i = 0;
    if (all_inside(b, records, count))
        return count;
    while (!is_outside(b, records[i]))
        i++;
    return i;
}

const char *trip_record_fault(const trip_file_brick *b, uint32_t record)
{
    unsigned code = trip_voxel_code(record);
    return code < b->code_min || code > b->code_max ? "the value is outside its brick's range"
                                                    : "the splat is outside its brick's bounds";
}
