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

/* The nodes and the bricks of the three lists follow the header without gaps. The text follows
 * them. */
static int check_layout(const trip_file_gaussian_header *h, const char *where)
{
    uint64_t at = TRIP_GAUSSIAN_HEADER_BYTES;
    if (h->nodes_offset != at)
        return FAIL_FIELD(nodes_offset, "the nodes begin at a wrong offset");
    if (h->node_count < 1 ||
        h->node_count > (h->index_bytes - at) / sizeof(trip_file_gaussian_node))
        return FAIL_FIELD(node_count, "the number of nodes does not fit the file");
    at += h->node_count * sizeof(trip_file_gaussian_node);
    for (int a = 0; a < 3; a++) {
        const uint64_t room = (h->index_bytes - at) / sizeof(trip_file_gaussian_brick);
        if (h->bricks_offset[a] != at)
            return FAIL_FIELD(bricks_offset, "the bricks of a list begin at a wrong offset");
        if (h->brick_count[a] < 1 || h->brick_count[a] > room)
            return FAIL_FIELD(brick_count, "the number of bricks does not fit the file");
        at += h->brick_count[a] * sizeof(trip_file_gaussian_brick);
    }
    const uint64_t entry = trip_gaussian_entry_bytes((int)h->degree);
    const bool palette = h->flags & TRIP_GAUSSIAN_PALETTE;
    if (palette != (h->palette_count > 0) || h->palette_count > TRIP_GAUSSIAN_PALETTE_MAX ||
        (palette && h->degree == 0) || h->palette_count * entry > h->index_bytes - at)
        return FAIL_FIELD(palette_count, "the number of entries of the palette is invalid");
    if (h->palette_offset != (palette ? at : 0))
        return FAIL_FIELD(palette_offset, "the palette has a wrong offset");
    at += h->palette_count * entry;
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

/* Whether a brick has a cone of normals, or four zeros for none. */
static bool is_cone(const trip_file_gaussian_brick *b, const trip_file_gaussian_header *h)
{
    double length2 = 0;
    for (int a = 0; a < 3; a++)
        length2 += (double)b->cone_axis[a] * (double)b->cone_axis[a];
    if (b->cone_cosine == 0)
        return length2 == 0;
    return trip_gaussian_has_sides(h) && fabs(length2 - 1) <= 1e-5 && b->cone_cosine > 0 &&
           b->cone_cosine <= 1;
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
            (c >= (h->palette_count ? 0 : (int)h->degree) && b->scale[c] != 0))
            return "the scale of a brick's spherical harmonics is invalid";
    }
    if (!(b->opacity_max >= 0 && b->opacity_max <= 1))
        return "the largest opacity of a brick is outside 0 to 1";
    if (!is_cone(b, h))
        return "the cone of a brick's normals is invalid";
    for (unsigned n = trip_gaussian_plane_count(h, (int)h->degree); n < TRIP_GAUSSIAN_PLANES; n++)
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
        if (fault)
            return fail_at(where, at + i * sizeof *bricks, fault);
        records += bricks[i].records;
    }
    return records == h->list_records
               ? TRIP_OK
               : FAIL_FIELD(list_records, "the bricks of a list have another number of records");
}

typedef struct tables {
    const trip_file_gaussian_header *h;
    const trip_file_gaussian_node *nodes;
    const trip_file_gaussian_brick *bricks[3];
    uint64_t next[3]; /* brick that no node has yet */
} tables;

/* Returns why the bricks of a node are invalid, or NULL. Sets *records to the records of a list. */
static const char *fault_of_parts(tables *t, const trip_file_gaussian_node *n, uint64_t *records)
{
    for (int a = 0; a < 3; a++) {
        uint64_t sum = 0;
        if (n->first_brick[a] != t->next[a] || n->brick_count[a] < 1 ||
            n->brick_count[a] > t->h->brick_count[a] - t->next[a])
            return "the bricks of a node do not follow the node before";
        for (uint32_t i = 0; i < n->brick_count[a]; i++) {
            const trip_file_gaussian_brick *b = &t->bricks[a][t->next[a]++];
            if (i && b->size_class < b[-1].size_class)
                return "the bricks are not in order of their classes of size";
            if (!is_inside(b->centre_lo, b->centre_hi, n->lo, n->hi))
                return "the bounds of a node do not hold its bricks";
            sum += b->records;
        }
        if (a && sum != *records)
            return "the lists of a node have different numbers of records";
        *records = sum;
    }
    return NULL;
}

/* Returns why a node is invalid, or NULL. `end` is the end of the nodes around it, `around` the
 * node that it is inside of or NULL. */
static const char *fault_of_node(const trip_file_gaussian_node *n, uint64_t left,
                                 const trip_file_gaussian_node *around,
                                 const trip_file_gaussian_header *h)
{
    if (n->nodes < 1 || n->nodes > left)
        return "a node holds nodes beyond the node around it";
    if (!is_box(n->lo, n->hi) || !is_inside(n->lo, n->hi, around ? around->lo : h->centre_lo,
                                            around ? around->hi : h->centre_hi))
        return "the bounds of a node are invalid";
    if (n->nodes == 1 ? n->width != 0 : !(n->width > 0 && n->width <= 4 * TRIP_GAUSSIAN_FARTHEST))
        return "the width of a node is invalid";
    if ((n->nodes == 1) != (n->level == 0) || (around && n->level >= around->level))
        return "the level of a node is invalid";
    return NULL;
}

static int check_nodes(tables *t, const char *where)
{
    const trip_file_gaussian_header *h = t->h;
    uint64_t open[TRIP_GAUSSIAN_DEPTH_MAX], records = 0; /* nodes around the next one */
    unsigned depth = 0;
    for (uint64_t i = 0; i < h->node_count; i++) {
        const trip_file_gaussian_node *n = &t->nodes[i];
        while (depth && i == open[depth - 1] + t->nodes[open[depth - 1]].nodes)
            depth--;
        const trip_file_gaussian_node *around = depth ? &t->nodes[open[depth - 1]] : NULL;
        const uint64_t end = around ? open[depth - 1] + around->nodes : h->node_count;
        uint64_t own = 0;
        const char *fault = fault_of_node(n, end - i, around, h);
        if (!fault)
            fault = fault_of_parts(t, n, &own);
        if (!fault && n->nodes > 1 && depth == TRIP_GAUSSIAN_DEPTH_MAX)
            fault = "too many nodes lie around one another";
        if (fault)
            return fail_at(where, h->nodes_offset + i * sizeof *n, fault);
        if (n->nodes > 1)
            open[depth++] = i;
        else
            records += own;
    }
    for (int a = 0; a < 3; a++)
        if (t->next[a] != h->brick_count[a])
            return FAIL_FIELD(brick_count, "a brick belongs to no node");
    return records == h->records ? TRIP_OK
                                 : FAIL_FIELD(records, "the nodes have another number of records");
}

/* The magnitudes of a palette must be finite. */
static int check_palette(const unsigned char *entries, const trip_file_gaussian_header *h,
                         const char *where)
{
    const unsigned bytes = trip_gaussian_entry_bytes((int)h->degree);
    for (uint64_t i = 0; i < h->palette_count; i++)
        for (int n = 1; n <= (int)h->degree; n++) {
            const uint64_t at = i * bytes + trip_gaussian_entry_bytes(n - 1);
            float largest;
            memcpy(&largest, entries + at, sizeof largest);
            if (!(largest >= 0 && largest <= TRIP_GAUSSIAN_COEFFICIENT_MAX))
                return fail_at(where, h->palette_offset + at,
                               "the magnitude of an entry of the palette is invalid");
        }
    return TRIP_OK;
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
    if (status == TRIP_OK)
        status = check_nodes(&(tables){ .h = h,
                                        .nodes = (const void *)(index + h->nodes_offset),
                                        .bricks = { (const void *)(index + h->bricks_offset[0]),
                                                    (const void *)(index + h->bricks_offset[1]),
                                                    (const void *)(index + h->bricks_offset[2]) } },
                             where);
    if (status == TRIP_OK)
        status = check_palette(index + h->palette_offset, h, where);
    if (status == TRIP_OK && memchr(index + h->text_offset, 0, h->text_bytes))
        return fail_at(where, h->text_offset, "the text contains a zero byte");
    return status;
}
