#include "gaussian_check.h"

#include "gaussian.h"
#include "report.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>
#include <xxhash.h>

static int fail_at(const char *where, uint64_t at, const char *why)
{
    return trip_fail(TRIP_ERROR, "open", where, "byte %llu: %s", (unsigned long long)at, why);
}

#define FAIL_FIELD(field, why) fail_at(where, offsetof(trip_file_gaussian_header, field), why)

static bool all_zero(const uint8_t *data, size_t bytes)
{
    for (size_t i = 0; i < bytes; i++)
        if (data[i])
            return false;
    return true;
}

static int check_identity(const trip_file_gaussian_header *h, uint64_t file_bytes,
                          const char *where)
{
    trip_file_gaussian_header copy = *h;
    copy.header_checksum = 0;
    if (memcmp(h->magic, TRIP_MAGIC, sizeof h->magic) == 0)
        return FAIL_FIELD(magic, "the data set of a volume, where a Gaussian scene is needed");
    if (memcmp(h->magic, TRIP_GAUSSIAN_MAGIC, sizeof h->magic) != 0)
        return FAIL_FIELD(magic, "not the index of a Gaussian scene (no " TRIP_GAUSSIAN_MAGIC ")");
    if (h->version != TRIP_GAUSSIAN_VERSION)
        return trip_fail(TRIP_ERROR, "open", where,
                         "byte %zu: format version %u of Gaussian scenes is not supported; this "
                         "program reads version %d",
                         offsetof(trip_file_gaussian_header, version), h->version,
                         TRIP_GAUSSIAN_VERSION);
    if (XXH64(&copy, sizeof copy, 0) != h->header_checksum)
        return FAIL_FIELD(header_checksum, "the header is damaged (checksum)");
    if (h->header_bytes != TRIP_GAUSSIAN_HEADER_BYTES)
        return FAIL_FIELD(header_bytes, "wrong header size");
    if (h->index_bytes != file_bytes)
        return trip_fail(TRIP_ERROR, "open", where, "%llu bytes instead of the %llu in its header",
                         (unsigned long long)file_bytes, (unsigned long long)h->index_bytes);
    if (!all_zero(h->reserved, sizeof h->reserved))
        return FAIL_FIELD(reserved, "reserved bytes are not zero");
    return TRIP_OK;
}

/* Whether lo to hi is a box within the limit, along each axis. */
static bool is_box(const double lo[3], const double hi[3])
{
    for (int a = 0; a < 3; a++)
        if (!(lo[a] >= -2 * TRIP_GAUSSIAN_FARTHEST * TRIP_GAUSSIAN_REACH && lo[a] <= hi[a] &&
              hi[a] <= 2 * TRIP_GAUSSIAN_FARTHEST * TRIP_GAUSSIAN_REACH))
            return false;
    return true;
}

static bool is_inside(const double lo[3], const double hi[3], const double outer_lo[3],
                      const double outer_hi[3])
{
    for (int a = 0; a < 3; a++)
        if (!(lo[a] >= outer_lo[a] && hi[a] <= outer_hi[a]))
            return false;
    return true;
}

/* The bricks of the three lists follow the header without gaps. The text follows them. */
static int check_layout(const trip_file_gaussian_header *h, const char *where)
{
    uint64_t at = TRIP_GAUSSIAN_HEADER_BYTES;
    for (int a = 0; a < 3; a++) {
        const uint64_t room = (h->index_bytes - at) / sizeof(trip_file_gaussian_brick);
        if (h->bricks_offset[a] != at)
            return FAIL_FIELD(bricks_offset, "the bricks of a list begin at a wrong offset");
        if (h->brick_count[a] < 1 || h->brick_count[a] > room)
            return FAIL_FIELD(brick_count, "the number of bricks does not fit the file");
        at += h->brick_count[a] * sizeof(trip_file_gaussian_brick);
    }
    if (h->text_offset != at || h->text_bytes != h->index_bytes - at ||
        h->text_bytes > TRIP_TEXT_BYTES_MAX)
        return FAIL_FIELD(text_offset, "the text has a wrong offset or length");
    return TRIP_OK;
}

int trip_gaussian_check_header(const trip_file_gaussian_header *h, uint64_t file_bytes,
                               const char *where)
{
    const int status = check_identity(h, file_bytes, where);
    if (status < 0)
        return status;
    if (h->index_bytes < TRIP_GAUSSIAN_HEADER_BYTES)
        return FAIL_FIELD(index_bytes, "the index is shorter than its header");
    if (h->degree > TRIP_SH_DEGREE_MAX)
        return FAIL_FIELD(degree, "the degree of the spherical harmonics is above 3");
    if (h->flags & ~(uint32_t)TRIP_GAUSSIAN_FLAGS)
        return FAIL_FIELD(flags, "unknown flags");
    if (h->flags & TRIP_GAUSSIAN_Y_DOWN && h->flags & TRIP_GAUSSIAN_Z_UP)
        return FAIL_FIELD(flags, "two axes point up");
    if (!is_box(h->centre_lo, h->centre_hi))
        return FAIL_FIELD(centre_lo, "the bounds of the centres are invalid");
    if (!is_box(h->reach_lo, h->reach_hi) ||
        !is_inside(h->centre_lo, h->centre_hi, h->reach_lo, h->reach_hi))
        return FAIL_FIELD(reach_lo, "the bounds of the ellipsoids are invalid");
    if (!is_box(h->typical_lo, h->typical_hi) ||
        !is_inside(h->typical_lo, h->typical_hi, h->centre_lo, h->centre_hi))
        return FAIL_FIELD(typical_lo, "the typical bounds leave the bounds of the centres");
    return check_layout(h, where);
}

static bool is_range(float lo, float hi)
{
    return isfinite(lo) && isfinite(hi) && lo <= hi;
}

/* Returns why a brick is invalid, or NULL. */
static const char *fault_of_brick(const trip_file_gaussian_brick *b,
                                  const trip_file_gaussian_header *h)
{
    if (b->records < 1 || b->records > TRIP_GAUSSIAN_BRICK_RECORDS_MAX)
        return "the number of records of a brick is outside 1 to 6144";
    if (!is_box(b->centre_lo, b->centre_hi) ||
        !is_inside(b->centre_lo, b->centre_hi, h->centre_lo, h->centre_hi))
        return "the bounds of a brick's centres are invalid";
    if (!is_box(b->reach_lo, b->reach_hi) ||
        !is_inside(b->reach_lo, b->reach_hi, h->reach_lo, h->reach_hi) ||
        !is_inside(b->centre_lo, b->centre_hi, b->reach_lo, b->reach_hi))
        return "the bounds of a brick's ellipsoids are invalid";
    if (!is_range(b->log_lo, b->log_hi) || b->log_hi > 40)
        return "the range of a brick's deviations is invalid";
    for (int c = 0; c < 3; c++) {
        if (!is_range(b->colour_lo[c], b->colour_hi[c]) ||
            b->colour_lo[c] < -TRIP_GAUSSIAN_COEFFICIENT_MAX ||
            b->colour_hi[c] > TRIP_GAUSSIAN_COEFFICIENT_MAX)
            return "the range of a brick's colours is invalid";
        if (!(b->scale[c] >= 0 && b->scale[c] <= TRIP_GAUSSIAN_COEFFICIENT_MAX) ||
            (c >= (int)h->degree && b->scale[c] != 0))
            return "the scale of a brick's spherical harmonics is invalid";
    }
    if (!(b->opacity_max >= 0 && b->opacity_max <= 1))
        return "the largest opacity of a brick is outside 0 to 1";
    for (unsigned n = h->degree + 1; n < TRIP_GAUSSIAN_PLANES; n++)
        if (b->checksums[n])
            return "a brick has the checksum of a file that is absent";
    return NULL;
}

static int check_list(const trip_file_gaussian_brick *bricks, uint64_t count, uint64_t at,
                      const trip_file_gaussian_header *h, const char *where)
{
    uint64_t records = 0;
    for (uint64_t i = 0; i < count; i++) {
        const char *fault = fault_of_brick(&bricks[i], h);
        if (!fault && bricks[i].first_record != records)
            fault = "the first record of a brick does not follow the brick before";
        if (!fault && i && bricks[i].size_class < bricks[i - 1].size_class)
            fault = "the bricks are not in order of their classes of size";
        if (fault)
            return fail_at(where, at + i * sizeof *bricks, fault);
        records += bricks[i].records;
    }
    return records == h->records
               ? TRIP_OK
               : FAIL_FIELD(records, "the bricks of a list have another number of records");
}

int trip_gaussian_check_tables(const unsigned char *index, const trip_file_gaussian_header *h,
                               const char *where)
{
    int status = TRIP_OK;
    if (XXH64(index + h->header_bytes, h->index_bytes - h->header_bytes, 0) != h->tables_checksum)
        return FAIL_FIELD(tables_checksum, "the index is damaged (checksum)");
    for (int a = 0; a < 3 && status == TRIP_OK; a++)
        status = check_list((const void *)(index + h->bricks_offset[a]), h->brick_count[a],
                            h->bricks_offset[a], h, where);
    if (status == TRIP_OK && memchr(index + h->text_offset, 0, h->text_bytes))
        return fail_at(where, h->text_offset, "the text contains a zero byte");
    return status;
}
