#include "dataset_check.h"

#include "geometry.h"
#include "report.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <xxhash.h>

static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "files are read as they lie in memory");

enum { TEXT_BYTES_MAX = 1 << 24, SECTIONS_MAX = 32 };

static int fail_at(const char *where, uint64_t at, const char *why)
{
    return trip_fail(TRIP_ERROR, "open", where, "byte %llu: %s", (unsigned long long)at, why);
}

static bool all_zero(const void *data, size_t bytes)
{
    const unsigned char *p = data;
    for (size_t i = 0; i < bytes; i++)
        if (p[i])
            return false;
    return true;
}

#define FAIL_FIELD(field, why) fail_at(where, offsetof(trip_file_header, field), why)

static int check_identity(const trip_file_header *h, uint64_t file_bytes, const char *where)
{
    trip_file_header copy = *h;
    copy.header_checksum = 0;
    if (memcmp(h->magic, TRIP_MAGIC, sizeof h->magic) != 0)
        return FAIL_FIELD(magic, "not the index of a data set (no " TRIP_MAGIC ")");
    if (h->version != TRIP_FORMAT_VERSION)
        return trip_fail(TRIP_ERROR, "open", where,
                         "byte %zu: format version %u, this program reads version %d",
                         offsetof(trip_file_header, version), h->version, TRIP_FORMAT_VERSION);
    if (XXH64(&copy, sizeof copy, 0) != h->header_checksum)
        return FAIL_FIELD(header_checksum, "the header is damaged (checksum)");
    if (h->header_bytes != TRIP_HEADER_BYTES)
        return FAIL_FIELD(header_bytes, "wrong header size");
    if (h->index_bytes != file_bytes)
        return trip_fail(TRIP_ERROR, "open", where, "%llu bytes instead of the %llu in its header",
                         (unsigned long long)file_bytes, (unsigned long long)h->index_bytes);
    if (h->reserved0 || !all_zero(h->reserved, sizeof h->reserved))
        return FAIL_FIELD(reserved0, "reserved bytes are not zero");
    return TRIP_OK;
}

static int check_grid(const trip_file_header *h, const char *where)
{
    trip_affine map, inverse;
    double voxels = 1;
    for (int a = 0; a < 3; a++) {
        if (h->dims[a] < 1 || h->dims[a] > INT32_MAX)
            return FAIL_FIELD(dims, "grid size outside 1 to 2147483647");
        voxels *= (double)h->dims[a];
    }
    memcpy(map.m, h->index_to_world, sizeof map.m);
    if (!trip_affine_invert(&map, &inverse))
        return FAIL_FIELD(index_to_world, "the index-to-world map is singular or not finite");
    if (!isfinite(h->code_lo) || !isfinite(h->code_hi) || h->code_lo > h->code_hi)
        return FAIL_FIELD(code_lo, "no range of codes");
    if (!isfinite(h->value_min) || !isfinite(h->value_max) || h->value_min > h->value_max)
        return FAIL_FIELD(value_min, "no range of values");
    if (!isfinite(h->gradient_scale) || h->gradient_scale < 0)
        return FAIL_FIELD(gradient_scale, "no gradient scale");
    if ((double)h->voxels > voxels)
        return FAIL_FIELD(voxels, "more voxels than the grid has");
    if (h->kept > h->voxels || h->kept > INT64_MAX / TRIP_RECORD_BYTES)
        return FAIL_FIELD(kept, "more splats than voxels");
    return TRIP_OK;
}

static uint64_t page_count(uint64_t bytes, unsigned page_log2)
{
    return (bytes >> page_log2) + ((bytes & ((UINT64_C(1) << page_log2) - 1)) != 0);
}

static int check_layout(const trip_file_header *h, const char *where)
{
    if (h->tile_log2 < 4 || h->tile_log2 > 7)
        return FAIL_FIELD(tile_log2, "tile size outside 16 to 128");
    if (h->slab_sheets < 1 || h->slab_sheets > 64)
        return FAIL_FIELD(slab_sheets, "sheets per slab outside 1 to 64");
    if (h->page_log2 < 12 || h->page_log2 > 24)
        return FAIL_FIELD(page_log2, "page size outside 4096 to 16777216");
    if (!(h->planes & 1u << TRIP_PLANE_VOXELS) || h->planes >> TRIP_PLANES)
        return FAIL_FIELD(planes, "unknown planes, or no voxels");
    if (h->list_count != 3)
        return FAIL_FIELD(list_count, "the number of lists is not 3");
    if (h->checksums_offset % 8 || h->checksums_offset < TRIP_HEADER_BYTES ||
        h->checksums_offset > h->index_bytes ||
        h->index_bytes - h->checksums_offset !=
            8 * page_count(h->checksums_offset - TRIP_HEADER_BYTES, h->page_log2))
        return FAIL_FIELD(checksums_offset, "the checksums are not where they must be");
    if (h->text_bytes > TEXT_BYTES_MAX)
        return FAIL_FIELD(text_bytes, "the text is too long");
    return TRIP_OK;
}

int trip_dataset_check_header(const trip_file_header *h, uint64_t file_bytes, const char *where)
{
    int status = check_identity(h, file_bytes, where);
    if (status == TRIP_OK)
        status = check_layout(h, where);
    return status == TRIP_OK ? check_grid(h, where) : status;
}

int trip_dataset_check_pages(const unsigned char *index, const trip_file_header *h,
                             const char *where)
{
    const unsigned char *table = index + h->checksums_offset;
    uint64_t page = UINT64_C(1) << h->page_log2;
    if (memcmp(index, h, sizeof *h) != 0)
        return fail_at(where, 0, "the file changed while it was read");
    if (XXH64(table, h->index_bytes - h->checksums_offset, 0) != h->checksums_checksum)
        return fail_at(where, h->checksums_offset, "the page checksums are damaged");
    for (uint64_t at = TRIP_HEADER_BYTES; at < h->checksums_offset; at += page) {
        uint64_t left = h->checksums_offset - at, sum;
        memcpy(&sum, table, sizeof sum);
        table += sizeof sum;
        if (XXH64(index + at, left < page ? left : page, 0) != sum)
            return fail_at(where, at, "the page that starts here is damaged (checksum)");
    }
    return TRIP_OK;
}

typedef struct section {
    uint64_t offset, bytes;
} section;

typedef struct sections {
    section items[SECTIONS_MAX];
    unsigned count;
} sections;

/* Notes a table of count * item_bytes bytes; false when it does not lie between the header and the
 * checksums at a multiple of 8. */
static bool add_section(sections *s, const trip_file_header *h, uint64_t offset, uint64_t count,
                        uint64_t item_bytes, unsigned alignment)
{
    uint64_t bytes, end;
    if (__builtin_mul_overflow(count, item_bytes, &bytes) ||
        __builtin_add_overflow(offset, bytes, &end))
        return false;
    if (offset % alignment || offset < TRIP_HEADER_BYTES || end > h->checksums_offset)
        return false;
    s->items[s->count++] = (section){ offset, bytes };
    return true;
}

static int by_offset(const void *a, const void *b)
{
    const section *x = a, *y = b;
    if (x->offset != y->offset)
        return x->offset < y->offset ? -1 : 1;
    return (x->bytes > y->bytes) - (x->bytes < y->bytes);
}

static int check_overlap(sections *s, const char *where)
{
    qsort(s->items, s->count, sizeof *s->items, by_offset);
    for (unsigned i = 1; i < s->count; i++)
        if (s->items[i].offset - s->items[i - 1].offset < s->items[i - 1].bytes)
            return fail_at(where, s->items[i].offset, "two tables overlap");
    return TRIP_OK;
}

static int check_list_head(sections *s, const trip_file_header *h, const trip_file_list *f,
                           uint32_t axis, const char *where, uint64_t at)
{
    if (f->axis != axis || f->level != 0)
        return fail_at(where, at, "the lists are not X, Y and Z at level 0");
    if (f->splats != h->kept)
        return fail_at(where, at, "the list does not hold the splats that were kept");
    if (!all_zero(f->reserved, sizeof f->reserved))
        return fail_at(where, at, "reserved bytes are not zero");
    if (f->brick_count > UINT32_MAX)
        return fail_at(where, at, "more bricks than 4294967295");
    if (!add_section(s, h, f->slabs_offset, f->slab_count, sizeof(trip_file_slab), 8) ||
        !add_section(s, h, f->bricks_offset, f->brick_count, sizeof(trip_file_brick), 8) ||
        !add_section(s, h, f->counts_offset, f->brick_count, 2 * h->slab_sheets, 8))
        return fail_at(where, at, "a table of the list lies outside the file");
    for (int plane = 0; plane < 4; plane++) {
        uint64_t pages = page_count(f->splats * TRIP_RECORD_BYTES, h->page_log2);
        bool present = h->planes >> plane & 1;
        if (present ? !add_section(s, h, f->page_checksums_offset[plane], pages, 8, 8)
                    : f->page_checksums_offset[plane] != 0)
            return fail_at(where, at, "the list's page checksums lie outside the file");
    }
    return TRIP_OK;
}

/* A list's tables and the place in the file that faults are reported at. */
typedef struct list_check {
    const char *where;
    const trip_file_header *h;
    const trip_file_list *f;
    const trip_file_slab *slabs;
    const trip_file_brick *bricks;
    const uint16_t *counts;
} list_check;

static int fail_brick(const list_check *c, uint64_t i, const char *why)
{
    return fail_at(c->where, c->f->bricks_offset + i * sizeof *c->bricks, why);
}

/* Run counts of a brick: none outside its sheets, some in the first and last, no more than the
 * bounds have room for, the right sum. */
static bool counts_fit(const list_check *c, uint64_t i)
{
    const trip_file_brick *b = &c->bricks[i];
    const uint16_t *counts = c->counts + i * c->h->slab_sheets;
    unsigned room = (b->u_max - b->u_min + 1u) * (b->v_max - b->v_min + 1u);
    uint64_t sum = 0;
    for (unsigned s = 0; s < c->h->slab_sheets; s++) {
        if (counts[s] > (s < b->sheet_min || s > b->sheet_max ? 0 : room))
            return false;
        sum += counts[s];
    }
    return counts[b->sheet_min] && counts[b->sheet_max] && sum == b->splats;
}

static int check_brick(const list_check *c, uint64_t i, uint64_t first_sheet)
{
    const trip_file_header *h = c->h;
    const trip_file_brick *b = &c->bricks[i];
    uint64_t tile = UINT64_C(1) << h->tile_log2;
    if (b->reserved)
        return fail_brick(c, i, "reserved bytes of a brick are not zero");
    if (b->u_min > b->u_max || b->v_min > b->v_max || b->u_max >= tile || b->v_max >= tile ||
        b->tile_u * tile + b->u_max >= h->dims[(c->f->axis + 1) % 3] ||
        b->tile_v * tile + b->v_max >= h->dims[(c->f->axis + 2) % 3])
        return fail_brick(c, i, "a brick's bounds are not inside the grid");
    if (b->sheet_min > b->sheet_max || b->sheet_max >= h->slab_sheets ||
        first_sheet + b->sheet_max >= h->dims[c->f->axis])
        return fail_brick(c, i, "a brick's sheets are not inside the grid");
    if (b->code_min > b->code_max)
        return fail_brick(c, i, "a brick's value range is empty");
    if (!counts_fit(c, i))
        return fail_brick(c, i, "a brick's run counts do not agree with it");
    return TRIP_OK;
}

static int check_slab_bricks(const list_check *c, const trip_file_slab *slab, uint64_t *splats)
{
    for (uint64_t i = slab->first_brick; i < slab->first_brick + slab->brick_count; i++) {
        const trip_file_brick *b = &c->bricks[i];
        if (i > slab->first_brick &&
            trip_morton(b[-1].tile_u, b[-1].tile_v) >= trip_morton(b->tile_u, b->tile_v))
            return fail_brick(c, i, "the bricks of a slab are not in Morton order");
        int status = check_brick(c, i, (uint64_t)slab->slab * c->h->slab_sheets);
        if (status < 0)
            return status;
        *splats += b->splats;
    }
    return TRIP_OK;
}

static int check_slabs(const list_check *c)
{
    uint64_t bricks = 0, splats = 0;
    for (uint64_t i = 0; i < c->f->slab_count; i++) {
        const trip_file_slab *slab = &c->slabs[i];
        uint64_t at = c->f->slabs_offset + i * sizeof *slab;
        if (i > 0 && slab->slab <= slab[-1].slab)
            return fail_at(c->where, at, "the slabs are not ascending");
        if (slab->first_brick != bricks || slab->brick_count < 1 ||
            slab->brick_count > c->f->brick_count - bricks)
            return fail_at(c->where, at, "the slab's bricks do not follow those before");
        if (slab->first_splat != splats)
            return fail_at(c->where, at, "the slab's splats do not follow those before");
        int status = check_slab_bricks(c, slab, &splats);
        if (status < 0)
            return status;
        bricks += slab->brick_count;
    }
    if (bricks != c->f->brick_count || splats != c->f->splats)
        return fail_at(c->where, c->f->slabs_offset, "the slabs do not add up to the list");
    return TRIP_OK;
}

static int check_text(const unsigned char *index, const trip_file_header *h, const char *where)
{
    if (memchr(index + h->text_offset, 0, h->text_bytes))
        return fail_at(where, h->text_offset, "the text holds a zero byte");
    return TRIP_OK;
}

int trip_dataset_check_tables(const unsigned char *index, const trip_file_header *h,
                              const char *where)
{
    sections s = { .count = 0 };
    if (!add_section(&s, h, h->lists_offset, h->list_count, sizeof(trip_file_list), 8))
        return FAIL_FIELD(lists_offset, "the lists lie outside the file");
    if (!add_section(&s, h, h->text_offset, h->text_bytes, 1, 1))
        return FAIL_FIELD(text_offset, "the text lies outside the file");
    const trip_file_list *lists = (const void *)(index + h->lists_offset);
    int status = check_text(index, h, where);
    for (uint32_t a = 0; a < 3 && status == TRIP_OK; a++)
        status = check_list_head(&s, h, &lists[a], a, where, h->lists_offset + a * sizeof *lists);
    if (status == TRIP_OK)
        status = check_overlap(&s, where);
    for (uint32_t a = 0; a < 3 && status == TRIP_OK; a++)
        status = check_slabs(&(list_check){
            .where = where,
            .h = h,
            .f = &lists[a],
            .slabs = (const void *)(index + lists[a].slabs_offset),
            .bricks = (const void *)(index + lists[a].bricks_offset),
            .counts = (const void *)(index + lists[a].counts_offset),
        });
    return status;
}
