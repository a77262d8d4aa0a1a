#include "dataset_check.h"

#include "block.h"
#include "codes.h"
#include "coordinates.h"
#include "geometry.h"
#include "kind.h"
#include "normal.h"
#include "report.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <xxhash.h>

static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "files are read as they lie in memory");

enum { TABLES_PER_LIST = 3 + TRIP_FILE_PLANES };

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
    if (memcmp(h->magic, TRIP_GAUSSIAN_MAGIC, sizeof h->magic) == 0)
        return FAIL_FIELD(magic, "the data set of a Gaussian scene, where a volume is needed");
    if (memcmp(h->magic, TRIP_MAGIC, sizeof h->magic) != 0)
        return FAIL_FIELD(magic, "not the index of a data set (no " TRIP_MAGIC ")");
    if (h->version > 0 && h->version < TRIP_FORMAT_OLDEST)
        return trip_fail(TRIP_ERROR, "open", where,
                         "byte %zu: format version %u is no longer supported; make the data set "
                         "again with `triptych brick`",
                         offsetof(trip_file_header, version), h->version);
    if (h->version == 0 || h->version > TRIP_FORMAT_VERSION)
        return trip_fail(
            TRIP_ERROR, "open", where,
            "byte %zu: format version %u is not supported; this program reads versions %d to %d",
            offsetof(trip_file_header, version), h->version, TRIP_FORMAT_OLDEST,
            TRIP_FORMAT_VERSION);
    if (XXH64(&copy, sizeof copy, 0) != h->header_checksum)
        return FAIL_FIELD(header_checksum, "the header is damaged (checksum)");
    if (h->header_bytes != TRIP_HEADER_BYTES)
        return FAIL_FIELD(header_bytes, "wrong header size");
    if (h->index_bytes != file_bytes)
        return trip_fail(TRIP_ERROR, "open", where, "%llu bytes instead of the %llu in its header",
                         (unsigned long long)file_bytes, (unsigned long long)h->index_bytes);
    if (h->reserved0)
        return FAIL_FIELD(reserved0, "reserved bytes are not zero");
    if (h->reserved1)
        return FAIL_FIELD(reserved1, "reserved bytes are not zero");
    if (!all_zero(h->reserved, sizeof h->reserved))
        return FAIL_FIELD(reserved, "reserved bytes are not zero");
    return TRIP_OK;
}

static bool is_length(double x)
{
    return isfinite(x) && x >= 0;
}

/* Returns why a grid cannot be drawn, or NULL. The map is invertible. */
static const char *fault_of_map(const trip_affine *map, const uint64_t dims[3])
{
    const double sizes[3] = { (double)dims[0], (double)dims[1], (double)dims[2] };
    for (int a = 0; a < 3; a++) {
        const double length = trip_length(trip_v3(map->m[0][a], map->m[1][a], map->m[2][a]));
        if (!(length >= TRIP_VOXEL_WORLD_MIN && length <= TRIP_VOXEL_WORLD_MAX))
            return "the voxels are too small or too large to be drawn";
    }
    return trip_affine_farthest_voxels(map, sizes) <= TRIP_FARTHEST_VOXELS
               ? NULL
               : "the grid lies too far from the origin of world space to be drawn";
}

static int check_grid(const trip_file_header *h, const char *where)
{
    trip_affine map, inverse;
    double voxels = 1;
    for (int a = 0; a < 3; a++) {
        if (h->dims[a] < 1 || h->dims[a] > TRIP_AXIS_VOXELS_MAX)
            return FAIL_FIELD(dims, "grid size outside 1 to 16777216");
        voxels *= (double)h->dims[a];
    }
    memcpy(map.m, h->index_to_world, sizeof map.m);
    if (!trip_affine_invert(&map, &inverse))
        return FAIL_FIELD(index_to_world, "the index-to-world map is singular or not finite");
    const char *fault = fault_of_map(&map, h->dims);
    if (fault)
        return FAIL_FIELD(index_to_world, fault);
    if (!isfinite(h->code_lo) || !isfinite(h->code_hi) || h->code_lo > h->code_hi)
        return FAIL_FIELD(code_lo, "the range of codes is invalid");
    if (!isfinite(h->value_min) || !isfinite(h->value_max) || h->value_min > h->value_max)
        return FAIL_FIELD(value_min, "the range of values is invalid");
    if (!(h->typical_min >= h->value_min && h->typical_min <= h->typical_max &&
          h->typical_max <= h->value_max))
        return FAIL_FIELD(typical_min, "the typical range leaves the range of values");
    if (!h->code_table_offset && (h->code_table_entries || h->code_table_step_log2))
        return FAIL_FIELD(code_table_entries, "entries of a table of codes that is absent");
    if (h->code_table_offset && h->code_bytes != 2)
        return FAIL_FIELD(code_bytes, "codes with a table must have 2 bytes");
    if (!is_length(h->gradient_full))
        return FAIL_FIELD(gradient_full, "the length of gradients is invalid");
    for (int a = 0; a < 3; a++)
        if (!is_length(h->gradient_step[a]))
            return FAIL_FIELD(gradient_step, "the gradient step is invalid");
    if (h->normal_bytes == 3 &&
        !trip_compact_normals_possible(&map, h->gradient_full, h->gradient_step))
        return FAIL_FIELD(gradient_step, "the gradient step is too large for gradient_full");
    if ((double)h->voxels > voxels)
        return FAIL_FIELD(voxels, "more voxels than the grid has");
    if (h->kept > h->voxels)
        return FAIL_FIELD(kept, "there are more kept voxels than voxels");
    if ((double)h->halo > voxels - (double)h->kept)
        return FAIL_FIELD(halo, "there are more kept voxels and halo voxels than the grid has");
    return TRIP_OK;
}

static int check_layout(const trip_file_header *h, const char *where)
{
    if (h->tile_log2 < 4 || h->tile_log2 > 7)
        return FAIL_FIELD(tile_log2, "tile size outside 16 to 128");
    if (h->slab_sheets < 1 || h->slab_sheets > 64)
        return FAIL_FIELD(slab_sheets, "sheets per slab outside 1 to 64");
    if (h->page_log2 < 12 || h->page_log2 > 24)
        return FAIL_FIELD(page_log2, "page size outside 4096 to 16777216");
    const unsigned planes = h->version < 7 ? TRIP_PLANE_DEVIATIONS : TRIP_PLANES;
    if (!(h->planes & 1u << TRIP_PLANE_VOXELS) || h->planes >> planes)
        return FAIL_FIELD(planes, "unknown planes, or no voxels");
    if (h->code_bytes < 1 || h->code_bytes > 2)
        return FAIL_FIELD(code_bytes, "codes must have 1 or 2 bytes");
    if (h->planes >> TRIP_PLANE_NORMALS & 1 ? h->normal_bytes < 3 || h->normal_bytes > 4
                                            : h->normal_bytes != 0)
        return FAIL_FIELD(normal_bytes, "normals must have 3 or 4 bytes, or 0 if there are none");
    if (h->list_count < 3 || h->list_count > TRIP_LISTS_MAX)
        return FAIL_FIELD(list_count, "the number of lists must be 3 to 4096");
    if (h->checksums_offset % 8 || h->checksums_offset < TRIP_HEADER_BYTES ||
        h->checksums_offset > h->index_bytes ||
        h->index_bytes - h->checksums_offset !=
            8 * trip_page_count(h->checksums_offset - TRIP_HEADER_BYTES, h->page_log2))
        return FAIL_FIELD(checksums_offset, "the checksums are at the wrong offset");
    if (h->text_bytes > TRIP_TEXT_BYTES_MAX)
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
    section *items;
    unsigned count;
} sections;

/* Records a table of count * item_bytes bytes. Returns false unless it lies between the header and
 * the checksums, at a multiple of `alignment`. */
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

static int check_list_grid(const trip_file_header *h, const trip_file_list *f, const char *where,
                           uint64_t at)
{
    trip_affine map, inverse;
    double voxels = 1;
    for (int a = 0; a < 3; a++) {
        if (f->dims[a] < 1 || f->dims[a] > TRIP_AXIS_VOXELS_MAX)
            return fail_at(where, at, "the list's grid size is outside 1 to 16777216");
        voxels *= (double)f->dims[a];
    }
    if ((double)f->records > voxels)
        return fail_at(where, at, "the list has more records than its grid has voxels");
    memcpy(map.m, f->index_to_world, sizeof map.m);
    if (!trip_affine_invert(&map, &inverse))
        return fail_at(where, at, "the list's index-to-world map is singular or not finite");
    if (!(f->sheet_step > 0) ||
        !isfinite(f->sheet_first + f->sheet_step * (double)f->dims[f->axis]))
        return fail_at(where, at, "the coordinates of the list's sheets do not ascend");
    if (f->level == 0 && (memcmp(f->dims, h->dims, sizeof f->dims) != 0 ||
                          memcmp(f->index_to_world, h->index_to_world, sizeof map.m) != 0 ||
                          f->sheet_first != 0 || f->sheet_step != 1))
        return fail_at(where, at, "a list of level 0 has a different grid than the header");
    return TRIP_OK;
}

/* Whether the lengths of the planes fit the records of the list. */
static bool plane_bytes_fit(const trip_file_header *h, const trip_file_list *f)
{
    uint64_t bytes;
    for (int plane = 0; plane < TRIP_FILE_PLANES; plane++)
        if (!(f->planes >> plane & 1) && f->plane_bytes[plane] != 0)
            return false;
    if (f->plane_bytes[TRIP_PLANE_VOXELS] % 8 || f->plane_bytes[TRIP_PLANE_VOXELS] > INT64_MAX)
        return false;
    if (f->planes >> TRIP_PLANE_DEVIATIONS & 1 &&
        f->plane_bytes[TRIP_PLANE_DEVIATIONS] != f->records)
        return false;
    if (!(f->planes >> TRIP_PLANE_NORMALS & 1))
        return true;
    return !__builtin_mul_overflow(f->records, h->normal_bytes, &bytes) && bytes <= INT64_MAX &&
           f->plane_bytes[TRIP_PLANE_NORMALS] == bytes;
}

static int check_list_kind(const trip_file_header *h, const trip_file_list *f, const char *where,
                           uint64_t at)
{
    const trip_kind_info *kind = f->kind < TRIP_KINDS ? trip_kind_of((trip_kind)f->kind) : NULL;
    if (f->axis > 2 || !kind)
        return fail_at(where, at, "unknown axis or kind of list");
    if (f->planes != (kind->planes & h->planes))
        return fail_at(where, at, "the list does not have the planes of its kind");
    if (f->level == 0 && kind->coarse)
        return fail_at(where, at, "a list of level 0 has a kind of coarse levels");
    if (f->level == 0 && f->records != (f->kind == TRIP_KIND_VOXELS ? h->kept : h->halo))
        return fail_at(where, at,
                       "the number of the list's records is not the number of kept voxels");
    if (!plane_bytes_fit(h, f))
        return fail_at(where, at, "the sizes of the list's planes do not match its records");
    if (!all_zero(f->reserved, sizeof f->reserved))
        return fail_at(where, at, "reserved bytes are not zero");
    return TRIP_OK;
}

static int check_list_head(sections *s, const trip_file_header *h, const trip_file_list *f,
                           const char *where, uint64_t at)
{
    int status = check_list_kind(h, f, where, at);
    if (status == TRIP_OK)
        status = check_list_grid(h, f, where, at);
    if (status < 0)
        return status;
    if (f->brick_count > UINT32_MAX)
        return fail_at(where, at, "more bricks than 4294967295");
    if (!add_section(s, h, f->slabs_offset, f->slab_count, sizeof(trip_file_slab), 8) ||
        !add_section(s, h, f->bricks_offset, f->brick_count, sizeof(trip_file_brick), 8) ||
        !add_section(s, h, f->runs_offset, f->brick_count,
                     sizeof(trip_file_run) * (uint64_t)h->slab_sheets, 8))
        return fail_at(where, at, "a table of the list lies outside the file");
    for (int plane = 0; plane < TRIP_FILE_PLANES; plane++) {
        uint64_t pages = trip_page_count(f->plane_bytes[plane], h->page_log2);
        if (f->planes >> plane & 1
                ? !add_section(s, h, f->page_checksums_offset[plane], pages, 8, 8)
                : f->page_checksums_offset[plane] != 0)
            return fail_at(where, at, "the list's page checksums lie outside the file");
    }
    return TRIP_OK;
}

static bool same_grid(const trip_file_list *f, const trip_file_list *g)
{
    return memcmp(f->dims, g->dims, sizeof f->dims) == 0 &&
           memcmp(f->index_to_world, g->index_to_world, sizeof f->index_to_world) == 0 &&
           (f->axis != g->axis ||
            (f->sheet_first == g->sheet_first && f->sheet_step == g->sheet_step));
}

/* Checks the lists against each other. */
static int check_set(const trip_file_header *h, const trip_file_list *lists, const char *where)
{
    unsigned axes = 0;
    bool halo = false;
    for (uint32_t i = 0; i < h->list_count; i++) {
        const trip_file_list *f = &lists[i];
        uint64_t at = h->lists_offset + i * sizeof *f;
        for (const trip_file_list *g = lists; g < f; g++) {
            if (f->level != g->level)
                continue;
            if (!same_grid(f, g))
                return fail_at(where, at, "lists of a level have different grids");
            if (f->kind != g->kind)
                continue;
            if (f->axis == g->axis)
                return fail_at(where, at, "two lists have the same axis, level and kind");
            if (f->records != g->records)
                return fail_at(where, at,
                               "lists of a kind and level have different numbers of records");
        }
        if (f->level == 0 && f->kind == TRIP_KIND_VOXELS)
            axes |= 1u << f->axis;
        halo |= f->level == 0 && f->kind == TRIP_KIND_HALO;
    }
    if (h->halo && !halo)
        return FAIL_FIELD(halo, "there is a halo, but no list of it");
    if (axes != 7)
        return fail_at(where, h->lists_offset, "a list of voxels of level 0 is missing");
    return TRIP_OK;
}

/* The tables of a list, and the file that faults are reported for. */
typedef struct list_check {
    const char *where;
    const trip_file_header *h;
    const trip_file_list *f;
    const trip_kind_info *kind;
    trip_block_form form;
    const trip_file_slab *slabs;
    const trip_file_brick *bricks;
    const trip_file_run *runs;
    uint64_t bricks_before, records_before, bytes_before; /* of the tables checked so far */
} list_check;

static int fail_brick(const list_check *c, uint64_t i, const char *why)
{
    return fail_at(c->where, c->f->bricks_offset + i * sizeof *c->bricks, why);
}

/* Checks the runs of a brick:
 * - there are none outside its sheets, and some in the first and the last
 * - no run has more records than the bounds have room for
 * - the sum is right
 * - the length of each block is possible for its records */
static bool runs_fit(const list_check *c, uint64_t i, uint64_t *bytes)
{
    const trip_file_brick *b = &c->bricks[i];
    const trip_file_run *runs = c->runs + i * c->h->slab_sheets;
    unsigned room = (b->u_max - b->u_min + 1u) * (b->v_max - b->v_min + 1u);
    uint64_t sum = 0;
    for (unsigned s = 0; s < c->h->slab_sheets; s++) {
        const trip_file_run *r = &runs[s];
        if (r->records > (s < b->sheet_min || s > b->sheet_max ? 0 : room))
            return false;
        if (r->records ? !c->kind->words_fit(&c->form, r->records, r->words) : r->words != 0)
            return false;
        sum += r->records;
        *bytes += 8 * (uint64_t)r->words;
    }
    return runs[b->sheet_min].records && runs[b->sheet_max].records && sum == b->records;
}

static int check_brick(list_check *c, uint64_t i, uint64_t first_sheet)
{
    const trip_file_header *h = c->h;
    const trip_file_brick *b = &c->bricks[i];
    uint64_t tile = UINT64_C(1) << h->tile_log2;
    if (b->reserved || (b->deviation_max && !(c->f->planes >> TRIP_PLANE_DEVIATIONS & 1)))
        return fail_brick(c, i, "reserved bytes of a brick are not zero");
    if (b->u_min > b->u_max || b->v_min > b->v_max || b->u_max >= tile || b->v_max >= tile ||
        b->tile_u * tile + b->u_max >= c->f->dims[(c->f->axis + 1) % 3] ||
        b->tile_v * tile + b->v_max >= c->f->dims[(c->f->axis + 2) % 3])
        return fail_brick(c, i, "a brick's bounds are not inside the grid");
    if (b->sheet_min > b->sheet_max || b->sheet_max >= h->slab_sheets ||
        first_sheet + b->sheet_max >= c->f->dims[c->f->axis])
        return fail_brick(c, i, "a brick's sheets are not inside the grid");
    if (b->code_min > b->code_max)
        return fail_brick(c, i, "a brick's value range is empty");
    if (!runs_fit(c, i, &c->bytes_before))
        return fail_brick(c, i, "a brick's runs do not agree with it");
    c->records_before += b->records;
    return TRIP_OK;
}

static int check_slab_bricks(list_check *c, const trip_file_slab *slab)
{
    for (uint64_t i = slab->first_brick; i < slab->first_brick + slab->brick_count; i++) {
        const trip_file_brick *b = &c->bricks[i];
        if (i > slab->first_brick &&
            trip_morton(b[-1].tile_u, b[-1].tile_v) >= trip_morton(b->tile_u, b->tile_v))
            return fail_brick(c, i, "the bricks of a slab are not in Morton order");
        int status = check_brick(c, i, (uint64_t)slab->slab * c->h->slab_sheets);
        if (status < 0)
            return status;
    }
    return TRIP_OK;
}

static int check_slabs(list_check *c)
{
    for (uint64_t i = 0; i < c->f->slab_count; i++) {
        const trip_file_slab *slab = &c->slabs[i];
        uint64_t at = c->f->slabs_offset + i * sizeof *slab;
        if (i > 0 && slab->slab <= slab[-1].slab)
            return fail_at(c->where, at, "the slabs are not ascending");
        if (slab->first_brick != c->bricks_before || slab->brick_count < 1 ||
            slab->brick_count > c->f->brick_count - c->bricks_before)
            return fail_at(c->where, at, "the slab's bricks do not follow the previous bricks");
        if (slab->first_record != c->records_before || slab->first_block != c->bytes_before)
            return fail_at(c->where, at, "the slab's records do not follow the previous records");
        int status = check_slab_bricks(c, slab);
        if (status < 0)
            return status;
        c->bricks_before += slab->brick_count;
    }
    if (c->bricks_before != c->f->brick_count || c->records_before != c->f->records ||
        c->bytes_before != c->f->plane_bytes[TRIP_PLANE_VOXELS])
        return fail_at(c->where, c->f->slabs_offset, "the slabs do not add up to the list");
    return TRIP_OK;
}

static int check_text(const unsigned char *index, const trip_file_header *h, const char *where)
{
    if (memchr(index + h->text_offset, 0, h->text_bytes))
        return fail_at(where, h->text_offset, "the text contains a zero byte");
    return TRIP_OK;
}

/* Checks the tables of a grid with uneven spacing, which has no coarse levels. */
static int check_coordinates(const unsigned char *index, const trip_file_header *h,
                             const trip_file_list *lists, const char *where)
{
    const double *table = (const void *)(index + h->coordinates_offset);
    for (int a = 0; a < 3; a++) {
        const char *fault = trip_coordinates_fault(table, (int64_t)h->dims[a]);
        if (fault)
            return fail_at(where, (uint64_t)((const unsigned char *)table - index), fault);
        table += h->dims[a];
    }
    for (uint32_t i = 0; i < h->list_count; i++)
        if (lists[i].level > 0)
            return fail_at(where, h->lists_offset + i * sizeof *lists,
                           "a coarse level of a grid with uneven spacing");
    return TRIP_OK;
}

/* Checks the table of codes. code_lo and code_hi must be the values of the first and last code. */
static int check_codes(const unsigned char *index, const trip_file_header *h, const char *where)
{
    const double *table = (const void *)(index + h->code_table_offset);
    const char *fault = trip_codes_fault(table, h->code_table_entries, h->code_table_step_log2);
    if (fault)
        return fail_at(where, h->code_table_offset, fault);
    const trip_codes codes = trip_codes_of(h, table);
    if (codes.lo != h->code_lo || codes.hi != h->code_hi)
        return FAIL_FIELD(code_lo, "the range of codes differs from their table");
    return TRIP_OK;
}

static int check_positions(const unsigned char *index, const trip_file_header *h, const char *where,
                           sections *s)
{
    if (!add_section(s, h, h->lists_offset, h->list_count, sizeof(trip_file_list), 8))
        return FAIL_FIELD(lists_offset, "the lists lie outside the file");
    if (!add_section(s, h, h->text_offset, h->text_bytes, 1, 1))
        return FAIL_FIELD(text_offset, "the text lies outside the file");
    if (h->coordinates_offset &&
        !add_section(s, h, h->coordinates_offset, h->dims[0] + h->dims[1] + h->dims[2], 8, 8))
        return FAIL_FIELD(coordinates_offset, "the coordinates lie outside the file");
    if (h->code_table_offset &&
        !add_section(s, h, h->code_table_offset, h->code_table_entries, 8, 8))
        return FAIL_FIELD(code_table_offset, "the table of codes lies outside the file");
    const trip_file_list *lists = (const void *)(index + h->lists_offset);
    int status = check_text(index, h, where);
    for (uint32_t i = 0; i < h->list_count && status == TRIP_OK; i++)
        status = check_list_head(s, h, &lists[i], where, h->lists_offset + i * sizeof *lists);
    if (status == TRIP_OK)
        status = check_set(h, lists, where);
    if (status == TRIP_OK && h->coordinates_offset)
        status = check_coordinates(index, h, lists, where);
    if (status == TRIP_OK && h->code_table_offset)
        status = check_codes(index, h, where);
    return status == TRIP_OK ? check_overlap(s, where) : status;
}

int trip_dataset_check_tables(const unsigned char *index, const trip_file_header *h,
                              const char *where)
{
    sections s = { calloc(TABLES_PER_LIST * (size_t)h->list_count + 3, sizeof *s.items), 0 };
    if (!s.items)
        return trip_fail(TRIP_ERROR, "open", where, "out of memory");
    int status = check_positions(index, h, where, &s);
    free(s.items);
    if (status < 0)
        return status;
    const trip_file_list *lists = (const void *)(index + h->lists_offset);
    for (uint32_t i = 0; i < h->list_count && status == TRIP_OK; i++)
        status = check_slabs(&(list_check){
            .where = where,
            .h = h,
            .f = &lists[i],
            .kind = trip_kind_of((trip_kind)lists[i].kind),
            .form = trip_block_form_of(h, (trip_kind)lists[i].kind),
            .slabs = (const void *)(index + lists[i].slabs_offset),
            .bricks = (const void *)(index + lists[i].bricks_offset),
            .runs = (const void *)(index + lists[i].runs_offset),
        });
    return status;
}
