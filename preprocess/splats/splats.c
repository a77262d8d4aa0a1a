#include "splats.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "gradient.h"
#include "normal.h"
#include "report.h"
#include "splat_box.h"

/* One thread's memory. The window is the box, plus one voxel around it if there are gradients or a
 * halo. Its arrays are dense, x fastest. */
typedef struct workspace {
    float *decoded;   /* arrays of the window */
    uint8_t *active;  /* which voxels exist, in sparse volumes */
    uint8_t *kept;    /* flags */
    uint8_t *halo;    /* flags */
    uint8_t *scratch; /* for dilate() */
    trip_splat_box box;
    uint64_t kept_count, halo_count; /* sums over all boxes so far; see trip_splatter_halo() */
    trip_tally tally;
} workspace;

struct trip_splatter {
    trip_splat_params params;
    trip_budget *budget;
    double to_world[3][3]; /* maps gradients: inverse transpose of index_to_world */
    double gradient_unit;
    trip_splat_box_tables tables;
    size_t thread_bytes, bytes;
    unsigned char *memory; /* of all threads; each part begins with a workspace */
};

/* A box in processing by one thread. */
typedef struct work {
    const trip_splatter *s;
    const trip_box *box;
    unsigned thread;
    workspace *w;
    int64_t lo[3], size[3]; /* of the window */
    int64_t step[3];        /* between entries of neighbouring voxels in the window */
} work;

int64_t trip_splat_edge(const trip_piece_format *f)
{
    return trip_splat_box_edge(f);
}

/* Returns the next `bytes` of a thread's memory. With a NULL base it only counts the size. */
static void *carve(unsigned char *base, size_t *used, size_t bytes)
{
    size_t at = *used;
    *used = at + ((bytes + 63) & ~(size_t)63);
    return base ? base + at : NULL;
}

/* Lays out a workspace at `base` and returns its size in bytes. With a NULL base it only computes
 * the size. */
static size_t lay_out(const trip_piece_format *f, bool sparse, unsigned char *base, workspace *w)
{
    size_t edge = (size_t)trip_splat_box_edge(f), plane = edge * edge, used = 0;
    size_t window = (edge + 2) * (edge + 2) * (TRIP_SPLAT_HEIGHT + 2);
    size_t voxels = plane * TRIP_SPLAT_HEIGHT, height = TRIP_SPLAT_HEIGHT + (f->halo ? 2 : 0);
    trip_splat_box *c = &w->box;
    carve(base, &used, sizeof *w);
    w->decoded = carve(base, &used, window * sizeof(float));
    w->active = carve(base, &used, sparse ? window : 0);
    w->kept = carve(base, &used, window + 8); /* flags are read eight at a time */
    w->halo = carve(base, &used, f->halo ? window + 8 : 0);
    w->scratch = carve(base, &used, f->halo ? window : 0);
    c->values = carve(base, &used, plane * height * sizeof(uint32_t));
    c->normals = carve(base, &used, f->normals ? voxels * sizeof(uint32_t) : 0);
    c->magnitudes = carve(base, &used, f->normals && !f->quantised ? voxels * sizeof(float) : 0);
    for (int axis = 0; axis < 3; axis++)
        c->bits[axis] = carve(base, &used, (axis == 2 ? height : edge) * plane / 8);
    return (used + 4095) & ~(size_t)4095;
}

size_t trip_splat_thread_bytes(const trip_piece_format *f, bool sparse)
{
    workspace w;
    return lay_out(f, sparse, NULL, &w);
}

static workspace *workspace_of(const trip_splatter *s, unsigned thread)
{
    return (workspace *)(void *)(s->memory + thread * s->thread_bytes);
}

static void fill_map(trip_splatter *s)
{
    trip_affine to_index;
    trip_affine_invert(&s->params.info->index_to_world, &to_index);
    s->gradient_unit = trip_gradient_unit(&s->params.info->index_to_world);
    for (int row = 0; row < 3; row++)
        for (int column = 0; column < 3; column++)
            s->to_world[row][column] = to_index.m[column][row];
}

static void fill_workspaces(trip_splatter *s)
{
    const trip_splat_params *p = &s->params;
    for (unsigned i = 0; i < p->threads; i++) {
        unsigned char *base = s->memory + i * s->thread_bytes;
        workspace *w = workspace_of(s, i);
        lay_out(&p->format, p->info->sparse, base, w);
        w->box.tables = &s->tables;
        trip_tally_clear(&w->tally);
    }
}

int trip_splatter_create(trip_splatter **out, const trip_splat_params *params, trip_budget *budget)
{
    size_t own = (sizeof(trip_splatter) + 4095) & ~(size_t)4095;
    size_t each = trip_splat_thread_bytes(&params->format, params->info->sparse);
    size_t bytes = own + each * params->threads;
    trip_splatter *s = *out = trip_budget_take(budget, bytes);
    if (!s)
        return trip_fail(TRIP_ERROR, "brick", "splats",
                         "%u threads need %zu bytes, more than --memory allows: raise --memory or "
                         "lower --threads",
                         params->threads, bytes);
    s->params = *params;
    s->budget = budget;
    s->bytes = bytes;
    s->thread_bytes = each;
    s->memory = (unsigned char *)s + own;
    trip_splat_box_tables_fill(&s->tables, &params->format);
    fill_map(s);
    fill_workspaces(s);
    return 0;
}

void trip_splatter_destroy(trip_splatter *s)
{
    if (s)
        trip_budget_release(s->budget, s, s->bytes);
}

static work work_on(const trip_splatter *s, unsigned thread, const trip_box *box)
{
    work k = { .s = s, .box = box, .thread = thread, .w = workspace_of(s, thread) };
    int64_t around = s->params.format.normals || s->params.format.halo;
    for (int a = 0; a < 3; a++) {
        k.lo[a] = box->lo[a] - around;
        k.size[a] = box->size[a] + 2 * around;
        k.step[a] = a == 0 ? 1 : k.step[a - 1] * k.size[a - 1];
    }
    return k;
}

/* Returns the entry of a voxel in the window's arrays. */
static size_t entry_of(const work *k, const int64_t voxel[3])
{
    int64_t at = 0;
    for (int a = 0; a < 3; a++)
        at += (voxel[a] - k->lo[a]) * k->step[a];
    return (size_t)at;
}

/* The voxels of a row that become splats. */
typedef struct splat_row {
    const float *values; /* decoded; starts at the voxel with local x `first` */
    unsigned first;
    size_t index; /* in the box's arrays, of local x 0 */
    unsigned count;
    uint8_t x[128]; /* local, ascending */
} splat_row;

static void put_values(const work *k, const splat_row *r)
{
    uint32_t *to = k->w->box.values + r->index;
    const trip_quantiser q = k->s->params.quantiser;
    if (k->s->params.format.quantised)
        for (unsigned i = 0; i < r->count; i++)
            to[r->x[i]] = trip_quantise(&q, r->values[r->x[i] - r->first]);
    else
        for (unsigned i = 0; i < r->count; i++)
            memcpy(&to[r->x[i]], &r->values[r->x[i] - r->first], sizeof *to);
}

/* Returns the 4-byte world-space normal of an index-space gradient. For formats that are not
 * quantised, returns its direction and sets *magnitude. */
static uint32_t full_normal(const trip_splatter *s, const double index[3], float *magnitude)
{
    const double(*m)[3] = s->to_world;
    double g[3];
    for (int row = 0; row < 3; row++)
        g[row] = m[row][0] * index[0] + m[row][1] * index[1] + m[row][2] * index[2];
    if (s->params.format.quantised)
        return trip_normal_pack(g, s->params.quantiser.gradient_full);
    double length = sqrt(g[0] * g[0] + g[1] * g[1] + g[2] * g[2]);
    *magnitude = (float)fmin(length * s->gradient_unit, FLT_MAX);
    return trip_direction_pack(g);
}

/* Returns trip_gradient_share() of a voxel along an axis. Sparse volumes have no border, since
 * their background continues. With uneven spacing, returns the reciprocal distance of the
 * neighbours in the table of coordinates. */
static double share_of(const work *k, int axis, int64_t at)
{
    const trip_volume_info *info = k->s->params.info;
    const double *x = info->coordinates[axis];
    if (x) {
        int64_t after = at < info->dims[axis] - 1 ? at + 1 : at, before = at > 0 ? at - 1 : at;
        return after > before ? 1 / (x[after] - x[before]) : 0;
    }
    return trip_gradient_share(!info->sparse && (at == 0 || at == info->dims[axis] - 1));
}

/* `voxel` is the voxel at local x `first`. */
static void put_normals(const work *k, const splat_row *r, const int64_t voxel[3])
{
    const trip_splat_box *c = &k->w->box;
    const trip_compact_normals *compact = k->s->params.compact;
    double share[3] = { 0, share_of(k, 1, voxel[1]), share_of(k, 2, voxel[2]) };
    for (unsigned i = 0; i < r->count; i++) {
        size_t at = r->index + r->x[i];
        unsigned x = r->x[i] - r->first;
        double gradient[3];
        share[0] = share_of(k, 0, voxel[0] + x);
        trip_gradient_at(r->values + x, k->step, share, gradient);
        c->normals[at] = compact ? trip_compact_normal_pack(compact, gradient)
                                 : full_normal(k->s, gradient, c->magnitudes + at);
    }
}

/* Packs eight flags into eight bits: bit i is flag i. The product adds shifted copies of the flags
 * without overlap. Its highest byte holds the flags side by side. */
static unsigned bits_of(uint64_t eight_flags)
{
#if __BYTE_ORDER__ == __ORDER_BIG_ENDIAN__
    eight_flags = __builtin_bswap64(eight_flags);
#endif
    return (unsigned)(eight_flags * UINT64_C(0x0102040810204080) >> 56);
}

/* Writes the positions of the ones in `flags`, counted from `first`, and returns their number.
 * Reads eight flags at a time, up to 7 beyond `count`. */
static unsigned find_flags(const uint8_t *flags, int64_t count, int64_t first, uint8_t *positions)
{
    unsigned n = 0;
    for (int64_t i = 0; i < count; i += 8) {
        uint64_t eight;
        memcpy(&eight, flags + i, sizeof eight);
        if (eight == 0)
            continue;
        unsigned bits = bits_of(eight) & (count - i < 8 ? (1u << (count - i)) - 1 : 0xff);
        for (; bits; bits &= bits - 1)
            positions[n++] = (uint8_t)(first + i + __builtin_ctz(bits));
    }
    return n;
}

/* Makes splats of the flagged voxels in a row of the box and returns their number. `y` and `z`
 * count from the first voxel of the box. */
static unsigned put_row(const work *k, const uint8_t *flags, int64_t y, int64_t z, bool normals)
{
    trip_splat_box *c = &k->w->box;
    const int64_t voxel[3] = { c->origin[0] + c->first[0], c->origin[1] + c->first[1] + y,
                               c->origin[2] + z };
    size_t at = entry_of(k, voxel);
    splat_row r;
    r.count = find_flags(flags + at, c->size[0], c->first[0], r.x);
    if (r.count == 0)
        return 0;
    r.values = k->w->decoded + at;
    r.first = (unsigned)c->first[0];
    r.index = trip_splat_box_row(c, c->first[1] + y, z);
    trip_splat_box_mark(c, c->first[1] + y, z, r.x, r.count);
    put_values(k, &r);
    if (normals)
        put_normals(k, &r, voxel);
    return r.count;
}

/* Makes the pieces of all flagged voxels of [lo, lo + size), for three lists from `list` on. Adds
 * the number of voxels to *count. */
static int make_pieces(const work *k, const int64_t lo[3], const int64_t size[3],
                       const uint8_t *flags, unsigned list, uint64_t *count)
{
    const trip_piece_format f = trip_piece_format_of(&k->s->params.format, list);
    const trip_piece_sink sink = { k->s->params.reserve, k->s->params.user, k->thread };
    uint64_t made = 0;
    int status = 0;
    trip_splat_box_begin(&k->w->box, lo, size);
    for (int64_t z = 0; z < size[2]; z++)
        for (int64_t y = 0; y < size[1]; y++)
            made += put_row(k, flags, y, z, f.normals);
    for (unsigned l = list; l < list + 3 && made > 0 && status == 0; l++)
        status = trip_splat_box_emit(&k->w->box, &f, l, &sink);
    *count += made;
    return status;
}

static void find_kept(const work *k)
{
    const workspace *w = k->w;
    const int64_t rows = k->size[1] * k->size[2], row = k->size[0];
    for (int64_t r = 0; r < rows; r++)
        trip_envelope_keep_row(k->s->params.envelope, w->decoded + r * row, (size_t)row,
                               w->kept + r * row);
    for (int64_t i = 0; k->s->params.info->sparse && i < rows * row; i++)
        w->kept[i] &= w->active[i];
}

/* Clears the flags of the window's voxels outside the region. */
static void keep_region(const work *k)
{
    const trip_region *r = k->s->params.region;
    int64_t begin[3], end[3]; /* in the window */
    for (int a = 0; a < 3; a++) {
        begin[a] = r->first[a] > k->lo[a] ? r->first[a] - k->lo[a] : 0;
        end[a] = r->past[a] - k->lo[a] < k->size[a] ? r->past[a] - k->lo[a] : k->size[a];
    }
    for (int64_t z = 0; z < k->size[2]; z++)
        for (int64_t y = 0; y < k->size[1]; y++) {
            uint8_t *row = k->w->kept + z * k->step[2] + y * k->step[1];
            bool in =
                z >= begin[2] && z < end[2] && y >= begin[1] && y < end[1] && begin[0] < end[0];
            memset(row, 0, (size_t)(in ? begin[0] : k->size[0]));
            if (in)
                memset(row + end[0], 0, (size_t)(k->size[0] - end[0]));
        }
}

/* Clears the flags of voxels without a finite value. Few voxels have a flag, so it skips eight zero
 * flags at once. */
static void drop_not_finite(const float *values, uint8_t *flags, size_t count)
{
    for (size_t i = 0; i < count; i += 8) {
        uint64_t eight;
        memcpy(&eight, flags + i, sizeof eight);
        for (size_t k = i; eight && k < i + 8 && k < count; k++)
            flags[k] &= (uint8_t)(fabsf(values[k]) <= FLT_MAX);
    }
}

/* Dilates a row along x. */
static void dilate_row(const uint8_t *restrict from, uint8_t *restrict to, int64_t count)
{
    if (count == 1) {
        to[0] = from[0];
        return;
    }
    to[0] = from[0] | from[1];
    for (int64_t i = 1; i < count - 1; i++)
        to[i] = from[i - 1] | from[i] | from[i + 1];
    to[count - 1] = from[count - 2] | from[count - 1];
}

/* Dilates `count` consecutive groups of `length` flags by the groups before and after each: rows in
 * a slice, or slices in a box. */
static void dilate_groups(const uint8_t *restrict from, uint8_t *restrict to, int64_t length,
                          int64_t count)
{
    for (int64_t r = 0; r < count; r++) {
        const uint8_t *at = from + r * length;
        const uint8_t *before = r > 0 ? at - length : at;
        const uint8_t *after = r < count - 1 ? at + length : at;
        for (int64_t i = 0; i < length; i++)
            to[r * length + i] = before[i] | at[i] | after[i];
    }
}

/* Dilates the flags (0 or 1) of a dense box, x fastest, by the 26 neighbours. It finds the halo,
 * which interpolation needs at the border of the kept voxels. `out` is 1 if the voxel or a
 * neighbour inside the box is set, else 0. `scratch` has the same size. */
static void dilate(const uint8_t *flags, uint8_t *out, uint8_t *scratch, const int64_t size[3])
{
    const int64_t slice = size[0] * size[1];
    for (int64_t row = 0; row < size[1] * size[2]; row++)
        dilate_row(flags + row * size[0], out + row * size[0], size[0]);
    for (int64_t z = 0; z < size[2]; z++)
        dilate_groups(out + z * slice, scratch + z * slice, size[0], size[1]);
    dilate_groups(scratch, out, slice, size[2]);
}

/* Flags the halo: voxels of the window that are not kept, have a finite value, and have a kept
 * neighbour. Returns false if there are none. */
static bool find_halo(const work *k)
{
    const workspace *w = k->w;
    const uint8_t *restrict kept = w->kept;
    uint8_t *restrict halo = w->halo;
    size_t count = (size_t)(k->step[2] * k->size[2]);
    if (!memchr(kept, 1, count) || !memchr(kept, 0, count))
        return false;
    dilate(kept, halo, w->scratch, k->size);
    for (size_t i = 0; i < count; i++)
        halo[i] &= kept[i] ^ 1;
    drop_not_finite(w->decoded, halo, count);
    return true;
}

/* Sets the range along an axis in which this box makes the halo. It covers the box, and one voxel
 * beyond each end of a portion of a sparse volume, since such voxels may lie in no portion. Several
 * boxes may make one voxel; the merge turns them into one record. */
static void halo_range(const work *k, int axis, int64_t *begin, int64_t *end)
{
    const trip_box *box = k->box;
    const trip_volume_info *info = k->s->params.info;
    const int64_t first = box->portion->origin[axis], past = first + box->portion->size[axis];
    *begin = box->lo[axis];
    *end = *begin + box->size[axis];
    if (info->sparse && *begin == first && *begin > 0)
        --*begin;
    if (info->sparse && *end == past && *end < info->dims[axis])
        ++*end;
}

/* Returns the end of the splat box that begins at `at`, at most `end`. */
static int64_t box_end(const trip_splatter *s, int64_t at, int64_t end)
{
    int64_t past = (at & ~(s->tables.edge - 1)) + s->tables.edge;
    return past < end ? past : end;
}

/* Makes the halo in several splat boxes, since halo voxels may lie beyond a multiple of their edge.
 */
static int make_halo(const work *k)
{
    const trip_splatter *s = k->s;
    int64_t begin[3], end[3], at[3];
    int status = 0;
    if (!find_halo(k))
        return 0;
    for (int a = 0; a < 3; a++)
        halo_range(k, a, &begin[a], &end[a]);
    for (at[2] = begin[2]; at[2] < end[2]; at[2] = box_end(s, at[2], end[2]))
        for (at[1] = begin[1]; at[1] < end[1]; at[1] = box_end(s, at[1], end[1]))
            for (at[0] = begin[0]; at[0] < end[0] && status == 0;
                 at[0] = box_end(s, at[0], end[0])) {
                int64_t size[3];
                for (int a = 0; a < 3; a++)
                    size[a] = box_end(s, at[a], end[a]) - at[a];
                status = make_pieces(k, at, size, k->w->halo, TRIP_HALO_LISTS, &k->w->halo_count);
            }
    return status;
}

static void tally_box(const work *k)
{
    const trip_box *box = k->box;
    for (int64_t z = 0; z < box->size[2]; z++)
        for (int64_t y = 0; y < box->size[1]; y++) {
            const int64_t voxel[3] = { box->lo[0], box->lo[1] + y, box->lo[2] + z };
            size_t at = entry_of(k, voxel), count = (size_t)box->size[0];
            const uint8_t *active = k->s->params.info->sparse ? k->w->active + at : NULL;
            trip_tally_row(&k->w->tally, k->w->decoded + at, active, count, voxel);
        }
}

int trip_splatter_box(trip_splatter *s, unsigned thread, const trip_box *box)
{
    const work k = work_on(s, thread, box);
    int status = trip_portion_decode(box->volume, box->portion, k.lo, k.size, k.w->decoded,
                                     s->params.info->sparse ? k.w->active : NULL);
    if (status < 0)
        return status;
    if (s->params.tally)
        tally_box(&k);
    find_kept(&k);
    if (s->params.region)
        keep_region(&k);
    status = make_pieces(&k, box->lo, box->size, k.w->kept, 0, &k.w->kept_count);
    return status == 0 && s->params.format.halo ? make_halo(&k) : status;
}

void trip_splatter_tally(const trip_splatter *s, trip_tally *out)
{
    trip_tally_clear(out);
    for (unsigned i = 0; i < s->params.threads; i++)
        trip_tally_add(out, &workspace_of(s, i)->tally);
}

uint64_t trip_splatter_kept(const trip_splatter *s)
{
    uint64_t kept = 0;
    for (unsigned i = 0; i < s->params.threads; i++)
        kept += workspace_of(s, i)->kept_count;
    return kept;
}

uint64_t trip_splatter_halo(const trip_splatter *s)
{
    uint64_t halo = 0;
    for (unsigned i = 0; i < s->params.threads; i++)
        halo += workspace_of(s, i)->halo_count;
    return halo;
}
