#include "splats.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "dilate.h"
#include "format.h"
#include "normal.h"
#include "report.h"

/* What one thread works on: a box in local coordinates, which count from the corner of its cell of
 * the grid along x and y and from the box's own first slice along z. Arrays of voxels are dense,
 * x fastest, `edge` a row; only entries of kept voxels are written and read. */
typedef struct workspace {
    float *decoded;  /* the box with one voxel around it where gradients or a halo are wanted */
    uint8_t *active; /* of the same voxels, in sparse volumes */
    uint8_t *keep;   /* likewise; around the box only where a halo is wanted */
    uint8_t *near;   /* kept, or a neighbour is */
    uint8_t *scratch;
    uint32_t *values; /* codes, or the bits of floats */
    uint32_t *normals;
    float *magnitudes;
    uint64_t *bits[3];   /* [sheet][word]: which places of the cell's part of a sheet are taken */
    uint64_t kept, halo; /* in all boxes so far; a voxel of a halo as often as boxes give it */
    trip_tally tally;
} workspace;

struct trip_splatter {
    trip_splat_params params;
    trip_budget *budget;
    double to_world[3][3]; /* of gradients: the inverse transpose of index_to_world */
    double gradient_unit;
    int64_t edge;
    unsigned words;       /* of the bitmap of an edge x edge square */
    uint16_t spread[128]; /* bits of a coordinate at the even places */
    uint16_t place_u[TRIP_TILE_MAX_SPLATS], place_v[TRIP_TILE_MAX_SPLATS]; /* of a Morton code */
    size_t thread_bytes, bytes;
    unsigned char *memory; /* of all threads; each begins with its workspace */
};

/* Decoded voxels: the box and what is around it. */
typedef struct window {
    int64_t lo[3], size[3];
    int64_t pitch, slice; /* entries to the next row and slice */
} window;

/* A part of the window that lies in one cell of the grid, whose splats are made together. */
typedef struct view {
    const trip_splatter *s;
    const window *window;
    workspace *w;
    int64_t lo[3], size[3];
    int64_t cell[3]; /* grid coordinates of the local origin */
    int64_t from[3]; /* local coordinates of the part's first voxel */
    size_t first;    /* in the window, of that voxel */
} view;

int64_t trip_splat_edge(const trip_piece_format *f)
{
    return f->tile_log2 > 6 ? (int64_t)1 << f->tile_log2 : 64;
}

/* The next `bytes` of a thread's memory; NULL where only the size is asked for. */
static void *carve(unsigned char *base, size_t *used, size_t bytes)
{
    size_t at = *used;
    *used = at + ((bytes + 63) & ~(size_t)63);
    return base ? base + at : NULL;
}

/* Lays a workspace out from `base`, or, with base NULL, counts its bytes. */
static size_t lay_out(const trip_piece_format *f, bool sparse, unsigned char *base, workspace *w)
{
    size_t edge = (size_t)trip_splat_edge(f), plane = edge * edge, used = 0;
    size_t around = (edge + 2) * (edge + 2) * (TRIP_SPLAT_HEIGHT + 2);
    size_t voxels = plane * TRIP_SPLAT_HEIGHT, height = TRIP_SPLAT_HEIGHT + (f->halo ? 2 : 0);
    carve(base, &used, sizeof *w);
    w->decoded = carve(base, &used, around * sizeof(float));
    w->active = carve(base, &used, sparse ? around : 0);
    w->keep = carve(base, &used, around + 8); /* looked at eight at a time */
    w->near = carve(base, &used, f->halo ? around + 8 : 0);
    w->scratch = carve(base, &used, f->halo ? around : 0);
    w->values = carve(base, &used, plane * height * sizeof(uint32_t));
    w->normals = carve(base, &used, f->normals ? voxels * sizeof(uint32_t) : 0);
    w->magnitudes = carve(base, &used, f->normals && !f->quantised ? voxels * sizeof(float) : 0);
    for (int axis = 0; axis < 3; axis++)
        w->bits[axis] = carve(base, &used, (axis == 2 ? height : edge) * plane / 8);
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

static void fill_tables(trip_splatter *s)
{
    for (unsigned x = 0; x < 128; x++)
        s->spread[x] = (uint16_t)trip_morton(x, 0);
    for (unsigned v = 0; v < (unsigned)s->edge; v++)
        for (unsigned u = 0; u < (unsigned)s->edge; u++) {
            s->place_u[trip_morton(u, v)] = (uint16_t)u;
            s->place_v[trip_morton(u, v)] = (uint16_t)v;
        }
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
                         "%u threads need %zu bytes, which is more than is allowed: give more with "
                         "--memory, or take fewer --threads",
                         params->threads, bytes);
    s->params = *params;
    s->budget = budget;
    s->bytes = bytes;
    s->thread_bytes = each;
    s->memory = (unsigned char *)s + own;
    s->edge = trip_splat_edge(&params->format);
    s->words = (unsigned)(s->edge * s->edge / 64);
    fill_map(s);
    fill_tables(s);
    fill_workspaces(s);
    return 0;
}

void trip_splatter_destroy(trip_splatter *s)
{
    if (s)
        trip_budget_release(s->budget, s, s->bytes);
}

static window window_of(const trip_splatter *s, const trip_box *box)
{
    window n;
    int64_t around = s->params.format.normals || s->params.format.halo;
    for (int a = 0; a < 3; a++) {
        n.lo[a] = box->lo[a] - around;
        n.size[a] = box->size[a] + 2 * around;
    }
    n.pitch = n.size[0];
    n.slice = n.size[0] * n.size[1];
    return n;
}

static view view_of(const trip_splatter *s, unsigned thread, const window *n, const int64_t lo[3],
                    const int64_t size[3])
{
    view v = { .s = s, .window = n, .w = workspace_of(s, thread) };
    for (int a = 0; a < 3; a++) {
        v.lo[a] = lo[a];
        v.size[a] = size[a];
        v.cell[a] = a == 2 ? lo[a] : lo[a] & ~(s->edge - 1);
        v.from[a] = lo[a] - v.cell[a];
    }
    v.first =
        (size_t)((lo[2] - n->lo[2]) * n->slice + (lo[1] - n->lo[1]) * n->pitch + lo[0] - n->lo[0]);
    return v;
}

static inline double difference(const float *at, int64_t step)
{
    return 0.5 * ((double)at[step] - (double)at[-step]);
}

/* A neighbour that is not finite is replaced by the voxel's own value. */
static double careful_difference(const float *at, int64_t step)
{
    double after = isfinite(at[step]) ? at[step] : *at;
    double before = isfinite(at[-step]) ? at[-step] : *at;
    return 0.5 * (after - before);
}

/* Central differences of index space; J^-T takes them to world space. */
static inline void gradient(const view *v, const float *at, double g[3])
{
    const int64_t step[3] = { 1, v->window->pitch, v->window->slice };
    for (int a = 0; a < 3; a++)
        g[a] = difference(at, step[a]);
    if (isfinite(g[0] + g[1] + g[2]))
        return;
    for (int a = 0; a < 3; a++) /* as soon as one neighbour is not */
        g[a] = careful_difference(at, step[a]);
}

static inline void to_world(const trip_splatter *s, const double index[3], double g[3])
{
    const double(*m)[3] = s->to_world;
    for (int row = 0; row < 3; row++)
        g[row] = m[row][0] * index[0] + m[row][1] * index[1] + m[row][2] * index[2];
}

/* The voxels of a row that become splats. Local coordinates in `x`, ascending. */
typedef struct splat_row {
    const float *values; /* decoded, of local x `first` */
    unsigned first;
    int64_t y, z; /* local */
    size_t index; /* in the arrays of voxels, of local x 0 */
    unsigned count;
    uint8_t x[128];
} splat_row;

static void put_values(const view *v, const splat_row *r)
{
    uint32_t *to = v->w->values + r->index;
    const trip_quantiser q = v->s->params.quantiser;
    if (v->s->params.format.quantised)
        for (unsigned i = 0; i < r->count; i++)
            to[r->x[i]] = trip_quantise(&q, r->values[r->x[i] - r->first]);
    else
        for (unsigned i = 0; i < r->count; i++)
            memcpy(&to[r->x[i]], &r->values[r->x[i] - r->first], sizeof *to);
}

static void put_normals(const view *v, const splat_row *r)
{
    uint32_t *to = v->w->normals + r->index;
    const trip_splat_params *p = &v->s->params;
    for (unsigned i = 0; i < r->count; i++) {
        unsigned x = r->x[i];
        double index[3], g[3];
        gradient(v, r->values + (x - r->first), index);
        if (p->compact) {
            to[x] = trip_compact_normal_pack(p->compact, index);
            continue;
        }
        to_world(v->s, index, g);
        if (p->format.quantised) {
            to[x] = trip_normal_pack(g, p->quantiser.gradient_scale);
            continue;
        }
        double magnitude = sqrt(g[0] * g[0] + g[1] * g[1] + g[2] * g[2]);
        to[x] = trip_normal_pack(g, magnitude) & 0xffffff;
        v->w->magnitudes[r->index + x] = (float)fmin(magnitude * v->s->gradient_unit, FLT_MAX);
    }
}

/* Marks the voxels in the sheets of the three lists. The place in a sheet counts the third
 * coordinate from a multiple of the edge. */
static void mark(const view *v, const splat_row *r)
{
    const uint16_t *spread = v->s->spread;
    const size_t words = v->s->words;
    const unsigned y = spread[r->y], z = spread[(v->lo[2] + r->z) & (v->s->edge - 1)];
    const unsigned place = y | z << 1; /* in all sheets along X */
    uint64_t *x_words = v->w->bits[0] + place / 64;
    uint64_t *y_sheet = v->w->bits[1] + (size_t)r->y * words;
    uint64_t *z_sheet = v->w->bits[2] + (size_t)r->z * words;
    const uint64_t x_bit = UINT64_C(1) << (place % 64);
    for (unsigned i = 0; i < r->count; i++) {
        unsigned x = spread[r->x[i]], in_y = z | x << 1, in_z = x | y << 1;
        x_words[r->x[i] * words] |= x_bit;
        y_sheet[in_y / 64] |= UINT64_C(1) << (in_y % 64);
        z_sheet[in_z / 64] |= UINT64_C(1) << (in_z % 64);
    }
}

/* Places of the ones in `flags`, each counted from `first`; returns how many. */
static unsigned find_flags(const uint8_t *flags, int64_t count, int64_t first, uint8_t *places)
{
    unsigned n = 0;
    for (int64_t i = 0; i < count; i += 8) {
        uint64_t eight;
        memcpy(&eight, flags + i, sizeof eight);
        if (eight == 0)
            continue;
        for (int64_t k = i; k < i + 8 && k < count; k++) {
            places[n] = (uint8_t)(first + k);
            n += flags[k];
        }
    }
    return n;
}

/* The row (y, z) of a part, with those of its voxels that have a flag. */
static splat_row row_of(const view *v, const uint8_t *flags, int64_t y, int64_t z)
{
    size_t at = v->first + (size_t)(z * v->window->slice + y * v->window->pitch);
    splat_row r = { .values = v->w->decoded + at,
                    .first = (unsigned)v->from[0],
                    .y = v->from[1] + y,
                    .z = z,
                    .index = (size_t)((z * v->s->edge + v->from[1] + y) * v->s->edge) };
    r.count = find_flags(flags + at, v->size[0], v->from[0], r.x);
    return r;
}

static void put_row(const view *v, const splat_row *r, bool normals)
{
    if (r->count == 0)
        return;
    mark(v, r);
    put_values(v, r);
    if (normals)
        put_normals(v, r);
}

static void tally_row(const view *v, int64_t y, int64_t z)
{
    size_t at = v->first + (size_t)(z * v->window->slice + y * v->window->pitch);
    const uint8_t *active = v->s->params.info->sparse ? v->w->active + at : NULL;
    trip_tally_range(&v->w->tally, v->w->decoded + at, active, (size_t)v->size[0]);
    trip_tally_count(&v->w->tally, v->w->decoded + at, active, (size_t)v->size[0]);
}

/* Which voxels of the window are kept. */
static void find_kept(const trip_splatter *s, const workspace *w, const window *n)
{
    const int64_t rows = n->size[1] * n->size[2];
    for (int64_t r = 0; r < rows; r++)
        trip_envelope_keep_row(s->params.envelope, w->decoded + r * n->pitch, (size_t)n->pitch,
                               w->keep + r * n->pitch);
    for (int64_t i = 0; s->params.info->sparse && i < rows * n->pitch; i++)
        w->keep[i] &= w->active[i];
}

static void clear_bits(const view *v)
{
    size_t words = v->s->words;
    for (int axis = 0; axis < 3; axis++)
        memset(v->w->bits[axis] + (size_t)v->from[axis] * words, 0,
               (size_t)v->size[axis] * words * sizeof(uint64_t));
}

/* Where the splats of one tile of one sheet are, to be gathered in list order. */
typedef struct part {
    unsigned list;
    int axis;               /* the list's */
    int64_t sheet;          /* local */
    unsigned first_place;   /* of the tile in the cell's square */
    const uint64_t *bitmap; /* of the tile */
    unsigned words;         /* of that */
} part;

static uint64_t key_of(const view *v, const part *p)
{
    const int u = (p->axis + 1) % 3, w = (p->axis + 2) % 3;
    unsigned log2 = v->s->params.format.tile_log2;
    int64_t cell[3] = { v->cell[0], v->cell[1], v->cell[2] & ~(v->s->edge - 1) };
    uint32_t tile_u = (uint32_t)((cell[u] + v->s->place_u[p->first_place]) >> log2);
    uint32_t tile_v = (uint32_t)((cell[w] + v->s->place_v[p->first_place]) >> log2);
    return (uint64_t)(v->cell[p->axis] + p->sheet) << TRIP_TILE_MORTON_BITS |
           trip_morton(tile_u, tile_v);
}

/* Index of each of the part's voxels in the dense arrays, in list order. */
static uint32_t gather_indices(const view *v, const part *p, uint32_t *indices)
{
    const int64_t edge = v->s->edge, stride[3] = { 1, edge, edge * edge };
    const int64_t su = stride[(p->axis + 1) % 3], sv = stride[(p->axis + 2) % 3];
    /* Places count the third coordinate from a multiple of the edge, the arrays from the box. */
    int64_t base = p->sheet * stride[p->axis];
    if (p->axis != 2)
        base -= (v->lo[2] & (edge - 1)) * stride[2];
    uint32_t n = 0;
    for (unsigned w = 0; w < p->words; w++)
        for (uint64_t bits = p->bitmap[w]; bits; bits &= bits - 1) {
            unsigned place = p->first_place + w * 64 + (unsigned)__builtin_ctzll(bits);
            indices[n++] = (uint32_t)(base + v->s->place_u[place] * su + v->s->place_v[place] * sv);
        }
    return n;
}

static void fill_piece(const view *v, const trip_piece_format *f, trip_piece *piece,
                       const uint32_t *indices, uint32_t splats)
{
    const workspace *w = v->w;
    unsigned char *base = (unsigned char *)piece;
    trip_piece_parts parts = trip_piece_get_parts(f, piece);
    uint16_t *codes = (void *)(base + parts.values);
    uint32_t *floats = (void *)(base + parts.values), *normals = (void *)(base + parts.normals);
    float *magnitudes = (void *)(base + parts.magnitudes);
    if (v->s->params.format.quantised)
        for (uint32_t i = 0; i < splats; i++)
            codes[i] = (uint16_t)w->values[indices[i]];
    else
        for (uint32_t i = 0; i < splats; i++)
            floats[i] = w->values[indices[i]];
    if (parts.normals)
        for (uint32_t i = 0; i < splats; i++)
            normals[i] = w->normals[indices[i]];
    if (parts.magnitudes)
        for (uint32_t i = 0; i < splats; i++)
            magnitudes[i] = w->magnitudes[indices[i]];
}

static int emit_part(const view *v, unsigned thread, const part *p)
{
    uint32_t indices[TRIP_TILE_MAX_SPLATS];
    const trip_splat_params *params = &v->s->params;
    unsigned used = 0;
    for (unsigned w = 0; w < p->words; w++)
        used += p->bitmap[w] != 0;
    if (used == 0)
        return 0;
    uint32_t splats = gather_indices(v, p, indices);
    const trip_piece_format f = trip_piece_format_of(&params->format, p->list);
    unsigned words = trip_piece_choose_words(&f, splats, used);
    size_t bytes = trip_piece_layout(&f, splats, words).bytes;
    trip_piece *piece = params->reserve(params->user, thread, p->list, bytes);
    if (!piece)
        return TRIP_ERROR;
    trip_piece_begin(piece, &f, key_of(v, p), splats, words, p->bitmap);
    fill_piece(v, &f, piece, indices, splats);
    return 0;
}

static int emit_list(const view *v, unsigned thread, unsigned list)
{
    unsigned tile_words = 1u << (2 * v->s->params.format.tile_log2 - 6);
    int status = 0, axis = trip_list_axis(list);
    for (int64_t i = 0; i < v->size[axis] && status == 0; i++) {
        int64_t sheet = v->from[axis] + i;
        const uint64_t *bits = v->w->bits[axis] + (size_t)sheet * v->s->words;
        for (unsigned w = 0; w < v->s->words && status == 0; w += tile_words)
            status =
                emit_part(v, thread, &(part){ list, axis, sheet, w * 64, bits + w, tile_words });
    }
    return status;
}

/* Makes the pieces of all voxels of a part that have a flag, in three lists from `list` on; adds
 * their number to *splats. */
static int make_part(const view *v, unsigned thread, const uint8_t *flags, unsigned list,
                     uint64_t *splats)
{
    uint64_t made = 0;
    int status = 0;
    clear_bits(v);
    for (int64_t z = 0; z < v->size[2]; z++)
        for (int64_t y = 0; y < v->size[1]; y++) {
            splat_row r = row_of(v, flags, y, z);
            put_row(v, &r, v->s->params.format.normals && list < TRIP_HALO_LISTS);
            made += r.count;
        }
    for (unsigned l = list; l < list + 3 && made > 0 && status == 0; l++)
        status = emit_list(v, thread, l);
    *splats += made;
    return status;
}

/* Marks the voxels of the window that are not kept, have a value, and a neighbour that is kept.
 * False when there are none. */
static bool find_halo(const workspace *w, const window *n)
{
    size_t count = (size_t)(n->slice * n->size[2]);
    if (!memchr(w->keep, 1, count) || !memchr(w->keep, 0, count))
        return false;
    trip_dilate(w->keep, w->near, w->scratch, n->size);
    for (size_t i = 0; i < count; i++)
        w->near[i] &= (uint8_t)(!w->keep[i] & (fabsf(w->decoded[i]) <= FLT_MAX));
    return true;
}

/* The voxels whose halo this box makes: its own, and where no block of a sparse volume may be, one
 * around it. What several boxes make is put together as one. */
static void halo_range(const trip_splatter *s, const trip_box *box, int axis, int64_t *begin,
                       int64_t *end)
{
    const int64_t first = box->block->origin[axis], past = first + box->block->size[axis];
    *begin = box->lo[axis];
    *end = *begin + box->size[axis];
    if (s->params.info->sparse && *begin == first && *begin > 0)
        --*begin;
    if (s->params.info->sparse && *end == past && *end < s->params.info->dims[axis])
        ++*end;
}

/* The part of [begin, end) along an axis that is in the cell of `at`. */
static int64_t cell_end(const trip_splatter *s, int64_t at, int64_t end)
{
    int64_t past = (at & ~(s->edge - 1)) + s->edge;
    return past < end ? past : end;
}

/* Cell by cell: what is around a box may lie in others. */
static int make_halo(const trip_splatter *s, unsigned thread, const trip_box *box, const window *n)
{
    workspace *w = workspace_of(s, thread);
    int64_t begin[3], end[3], at[3];
    int status = 0;
    if (!find_halo(w, n))
        return 0;
    for (int a = 0; a < 3; a++)
        halo_range(s, box, a, &begin[a], &end[a]);
    for (at[2] = begin[2]; at[2] < end[2]; at[2] = cell_end(s, at[2], end[2]))
        for (at[1] = begin[1]; at[1] < end[1]; at[1] = cell_end(s, at[1], end[1]))
            for (at[0] = begin[0]; at[0] < end[0] && status == 0;
                 at[0] = cell_end(s, at[0], end[0])) {
                int64_t size[3];
                for (int a = 0; a < 3; a++)
                    size[a] = cell_end(s, at[a], end[a]) - at[a];
                view v = view_of(s, thread, n, at, size);
                status = make_part(&v, thread, w->near, TRIP_HALO_LISTS, &w->halo);
            }
    return status;
}

int trip_splatter_box(trip_splatter *s, unsigned thread, const trip_box *box)
{
    workspace *w = workspace_of(s, thread);
    const window n = window_of(s, box);
    view v = view_of(s, thread, &n, box->lo, box->size);
    int status = trip_block_decode(box->volume, box->block, n.lo, n.size, w->decoded,
                                   s->params.info->sparse ? w->active : NULL);
    if (status < 0)
        return status;
    for (int64_t row = 0; s->params.tally && row < box->size[1] * box->size[2]; row++)
        tally_row(&v, row % box->size[1], row / box->size[1]);
    find_kept(s, w, &n);
    status = make_part(&v, thread, w->keep, 0, &w->kept);
    return status == 0 && s->params.format.halo ? make_halo(s, thread, box, &n) : status;
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
        kept += workspace_of(s, i)->kept;
    return kept;
}

uint64_t trip_splatter_halo(const trip_splatter *s)
{
    uint64_t halo = 0;
    for (unsigned i = 0; i < s->params.threads; i++)
        halo += workspace_of(s, i)->halo;
    return halo;
}

double trip_gradient_unit(const trip_affine *index_to_world)
{
    double voxel = cbrt(fabs(trip_affine_determinant(index_to_world)));
    return voxel > 0 && isfinite(voxel) ? ldexp(1, ilogb(voxel)) : 1;
}

double trip_gradient_bound(const trip_volume_info *info, double lo, double hi)
{
    trip_affine to_index;
    double most = 0;
    if (info->sparse) {
        lo = fmin(lo, info->background);
        hi = fmax(hi, info->background);
    }
    trip_affine_invert(&info->index_to_world, &to_index);
    for (int signs = 0; signs < 4; signs++) {
        trip_vec3 corner = { 1, signs & 1 ? 1 : -1, signs & 2 ? 1 : -1 };
        most = fmax(most, trip_length(trip_affine_transpose_vector(&to_index, corner)));
    }
    double bound = most * (hi - lo) / 2;
    return bound > 0 && isfinite(bound) ? bound : 1;
}
