#include "brick_points.h"

#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "file_path.h"
#include "folder.h"
#include "gaussian_check.h"
#include "gaussian_format.h"
#include "point_ellipsoid.h"
#include "point_sides.h"
#include "point_tiles.h"
#include "report.h"
#include "scan_steps.h"
#include "surfel_shape.h"
#include "workers.h"

enum {
    BATCH = 512,
    SPOOL_BYTES = 1 << 17,
    TILES_PER_THREAD = 2, /* of a loop */
    TELL_EVERY = 1 << 14,
    PASSES = 8, /* over the cloud: read, sort, and six of trip_brick_gaussians() */
};

/* No radius exceeds this part of the cloud's diagonal: FEW / sqrt(points), or LEAST. */
#define FEW 16.0
#define LEAST (1.0 / 64)

typedef struct bricker {
    const trip_brick_points_params *p;
    const trip_point_info *info;
    trip_budget *budget;
    char *folder;
    trip_output spool;
    uint64_t records, left_out, passed;
    bool lacking; /* a radius or a normal */
    bool ordered; /* rows come in the order of the octree */
    trip_gaussian_sample sample;
    double *values; /* of the sample */
    size_t sample_bytes, values_bytes;
    double all_lo[3], all_hi[3];     /* bounds */
    double lo[3], hi[3], radius_max; /* typical bounds */
    double seen_from[3];             /* or zero: normals point away from the middle */
    bool outwards;
    trip_point_palette palette;
    trip_octree octree;
    trip_point_tiles *tiles;
    trip_point_sides *sides; /* NULL: normals keep the sides that they have */
    trip_workers *workers;
    /* Rows of tiles, TRIP_POINT_TILE_MAX each. A loop completes one half while the other half is
     * given out. */
    trip_point_row *rows;
    unsigned rooms;           /* of a half */
    unsigned half;            /* that is given out: 0 or 1 */
    uint64_t next_tile;       /* its first tile */
    unsigned ready, tile;     /* its tiles, and the one that is given out */
    uint32_t row;             /* of this tile */
    uint64_t loop_tile;       /* first tile of the loop */
    unsigned loop_tiles;      /* 0: no loop runs */
    trip_point_row *loop_row; /* of the first tile */
    uint64_t given;           /* rows of the spool, without tiles */
    /* Mean and sum of squares of the spreads, and the greatest spread that is kept. */
    double spread_mean, spread_squares, spread_max;
    bool estimates; /* uncertainties come from neighbours */
    trip_scan_steps *steps;
    double certainty;   /* sum of 1 / uncertainty */
    double uncertainty; /* the mean of point_ellipsoid.h */
    uint64_t outliers;
} bricker;

static int fail_memory(const bricker *b)
{
    return trip_fail(TRIP_ERROR, "brick", b->p->path,
                     "bricking needs more memory than --memory allows: raise --memory");
}

/* Whether the values of the points come from their neighbours. */
static bool has_late_values(const bricker *b)
{
    return b->p->colouring == TRIP_POINT_BY_DENSITY;
}

/* Whether nothing tells the sides of normals: neither the file, nor scanners, nor a flight. */
static bool has_free_sides(const bricker *b)
{
    const char *format = b->info->format;
    bool told = b->p->uncertain || b->info->attributes & TRIP_POINT_NORMAL ||
                !strncmp(format, "LAS", 3) || !strncmp(format, "LAZ", 3) ||
                !strncmp(format, "COPC", 4);
    for (uint32_t i = 0; i < b->info->scan_count && !told; i++)
        told = b->info->scans[i].posed;
    return !told;
}

/* Whether all rows are completed before the first one is given out. */
static bool completes_first(const bricker *b)
{
    return b->p->outliers > 0 || b->estimates || has_late_values(b) || has_free_sides(b);
}

static void tell(void *user, uint64_t more)
{
    const bricker *b = user;
    const uint64_t passes = PASSES + completes_first(b);
    if (b->p->progress)
        b->p->progress(b->p->progress_user, b->passed + more, passes * b->info->points);
}

/* ---- reading ---- */

static bool is_near_enough(const trip_point *p)
{
    for (int a = 0; a < 3; a++)
        if (!(fabs(p->position[a]) <= TRIP_GAUSSIAN_FARTHEST))
            return false;
    return true;
}

/* Two floats keep a GPS time, or a height beside strays. */
static void set_value(trip_point_row *row, double value)
{
    row->colour[0] = (float)value;
    row->colour[1] = (float)(value - (double)row->colour[0]);
}

static double value_of(const trip_point_row *row)
{
    return (double)row->colour[0] + (double)row->colour[1];
}

static void add_to_sample(bricker *b, const trip_point_row *row)
{
    const uint64_t at = b->sample.count++;
    memcpy(b->sample.points[at].centre, row->position, sizeof row->position);
    b->values[at] = value_of(row);
}

static int spool_point(bricker *b, const trip_point *p)
{
    trip_point_row row = { .head.number = b->records,
                           .scan = (float)p->scan,
                           .radius = b->p->radius > 0 ? (float)b->p->radius : p->radius };
    if (!is_near_enough(p)) {
        b->left_out++;
        return 0;
    }
    memcpy(row.position, p->position, sizeof row.position);
    if (b->estimates) {
        row.radius = 0;
        trip_scan_steps_note(b->steps, p);
    } else
        memcpy(row.normal, p->normal, sizeof row.normal);
    if (b->p->uncertain && !b->estimates)
        trip_point_aim(&row, p, b->info->scans[p->scan].scanner);
    if (b->p->colouring == TRIP_POINT_BY_RGB)
        memcpy(row.colour, p->colour, sizeof row.colour);
    else
        set_value(&row, trip_point_value(b->p->colouring, p, b->p->up));
    b->lacking = b->lacking || !(row.radius > 0) ||
                 (row.normal[0] == 0 && row.normal[1] == 0 && row.normal[2] == 0);
    for (int a = 0; a < 3; a++) {
        b->all_lo[a] = fmin(b->all_lo[a], p->position[a]);
        b->all_hi[a] = fmax(b->all_hi[a], p->position[a]);
    }
    if (trip_gaussian_is_sampled(b->records, b->info->points))
        add_to_sample(b, &row);
    if (++b->records % TELL_EVERY == 0)
        tell(b, b->records);
    return trip_output_append(&b->spool, &row, sizeof row);
}

static int spool_points(bricker *b, trip_point *batch)
{
    size_t got = 1;
    int status = trip_point_file_rewind(b->p->file);
    while (status == 0 && got > 0) {
        status = trip_point_file_read(b->p->file, batch, BATCH, &got);
        for (size_t i = 0; i < got && status == 0; i++)
            if (b->records + b->left_out < b->info->points)
                status = spool_point(b, &batch[i]);
            else
                status = trip_fail(TRIP_ERROR, "read", b->p->file_name,
                                   "changed while it was read; run the command again when the "
                                   "file is complete");
    }
    return status == 0 ? trip_output_flush(&b->spool) : status;
}

static int spool_all(bricker *b)
{
    const uint64_t room = trip_gaussian_sample_room(b->info->points);
    trip_point *batch = malloc(BATCH * sizeof *batch);
    b->sample_bytes = room * sizeof *b->sample.points;
    b->values_bytes = room * sizeof *b->values;
    b->sample.points = trip_budget_take(b->budget, b->sample_bytes);
    b->values = trip_budget_take(b->budget, b->values_bytes);
    b->steps = b->estimates ? trip_scan_steps_begin(b->info, b->budget) : NULL;
    int status =
        batch && b->sample.points && b->values && (b->steps || !b->estimates) ? 0 : fail_memory(b);
    if (status == 0)
        status = trip_output_create(&b->spool,
                                    &(trip_output_params){ .folder = b->folder,
                                                           .name = TRIP_SPOOL_NAME,
                                                           .buffer_bytes = SPOOL_BYTES,
                                                           .unnamed = true },
                                    b->budget);
    if (status == 0)
        status = spool_points(b, batch);
    if (status == 0 && b->steps)
        trip_scan_steps_find(b->steps);
    free(batch);
    if (status == 0 && b->left_out)
        trip_warn(b->p->file_name, "%llu of %llu points lie beyond 1e15; they are left out",
                  (unsigned long long)b->left_out, (unsigned long long)b->info->points);
    if (status == 0 && b->records == 0)
        return trip_fail(TRIP_ERROR, "brick", b->p->file_name, "contains no point to draw");
    b->passed += b->records;
    return status;
}

/* ---- sample ---- */

/* Sets *lo and *hi to the values without the outer hundredth at each side. */
static void typical(trip_key *keys, uint64_t count, double *lo, double *hi, const bricker *b,
                    int axis)
{
    for (uint64_t i = 0; i < count; i++)
        keys[i] =
            (trip_key){ trip_key_of(axis < 3 ? b->sample.points[i].centre[axis] : b->values[i]),
                        i };
    trip_key_sort(keys, keys + count + 1, count);
    const uint64_t first = keys[count / 100].number, last = keys[count - 1 - count / 100].number;
    *lo = axis < 3 ? b->sample.points[first].centre[axis] : b->values[first];
    *hi = axis < 3 ? b->sample.points[last].centre[axis] : b->values[last];
}

static double diagonal_of(const double lo[3], const double hi[3])
{
    double sum = 0;
    for (int a = 0; a < 3; a++)
        sum += (hi[a] - lo[a]) * (hi[a] - lo[a]);
    return sqrt(sum);
}

/* Without poses, a scan from above has seen the cloud from far up, and another cloud is the outside
 * of an object. */
static void choose_side(bricker *b, double diagonal)
{
    b->outwards = !(b->p->flags & TRIP_GAUSSIAN_Z_UP);
    for (int a = 0; a < 3; a++) {
        b->seen_from[a] = (b->lo[a] + b->hi[a]) / 2;
        if (!b->outwards)
            b->seen_from[a] += 10 * diagonal * b->p->up[a];
    }
}

/* Makes the palette from the values of the sample. */
static int make_palette(bricker *b, double lo, double hi)
{
    if (b->p->colouring == TRIP_POINT_BY_RETURN) {
        lo = 1;
        hi = b->info->returns_max;
    }
    return trip_point_palette_make(&b->palette, b->p->colouring, lo, hi);
}

static int look_at_sample(bricker *b)
{
    const uint64_t count = b->sample.count;
    const size_t bytes = 2 * (count + 1) * sizeof(trip_key);
    double value_lo = 0, value_hi = 0;
    trip_key *keys = trip_budget_take(b->budget, bytes);
    if (!keys)
        return fail_memory(b);
    for (int a = 0; a < 3 && count > 0; a++)
        typical(keys, count, &b->lo[a], &b->hi[a], b, a);
    if (count > 0)
        typical(keys, count, &value_lo, &value_hi, b, 3);
    trip_budget_release(b->budget, keys, bytes);
    double diagonal = diagonal_of(b->lo, b->hi);
    if (!(diagonal > 0))
        diagonal = diagonal_of(b->info->lo, b->info->hi);
    b->radius_max =
        diagonal > 0 ? diagonal * fmin(1, fmax(LEAST, FEW / sqrt((double)b->records))) : 1;
    choose_side(b, diagonal);
    return has_late_values(b) ? 0 : make_palette(b, value_lo, value_hi);
}

/* ---- radii and normals ---- */

static void find_towards(const bricker *b, const trip_point_row *row, double towards[3])
{
    const uint32_t scan = (uint32_t)row->scan;
    const bool posed = scan < b->info->scan_count && b->info->scans[scan].posed;
    for (int a = 0; a < 3; a++)
        towards[a] = posed         ? b->info->scans[scan].scanner[a] - row->position[a]
                     : b->outwards ? row->position[a] - b->seen_from[a]
                                   : b->seen_from[a] - row->position[a];
}

static bool has_normal(const trip_point_row *row)
{
    return row->normal[0] != 0 || row->normal[1] != 0 || row->normal[2] != 0;
}

static void complete_row(const bricker *b, const trip_neighbours *n, trip_point_row *row)
{
    double towards[3];
    if (completes_first(b))
        row->spread = (float)trip_surfel_spread(n);
    if (has_late_values(b))
        set_value(row, log10(trip_surfel_density(n)));
    if (has_normal(row) && row->radius > 0)
        return;
    find_towards(b, row, towards);
    const trip_surfel_shape shape = trip_surfel_shape_of(n, towards);
    if (b->estimates) {
        const uint32_t scan = (uint32_t)row->scan;
        trip_point_estimate(row, &shape, b->info->scans[scan].scanner,
                            trip_scan_steps_of(b->steps, scan), b->radius_max);
        return;
    }
    for (int a = 0; a < 3 && !has_normal(row); a++) {
        row->normal[0] = (float)shape.normal[0];
        row->normal[1] = (float)shape.normal[1];
        row->normal[2] = (float)shape.normal[2];
    }
    if (!(row->radius > 0))
        row->radius = (float)fmin(shape.radius, b->radius_max);
}

/* Rows with the same position stand together if no others have the same coordinate. */
static int complete_tile(void *user, unsigned thread, uint64_t item)
{
    bricker *b = user;
    const uint64_t tile = b->loop_tile + item;
    trip_point_row *rows = b->loop_row + item * TRIP_POINT_TILE_MAX;
    const uint32_t count = trip_point_tiles_at(b->tiles, tile)->count;
    trip_neighbours n = { .count = 0 };
    const unsigned wanted = b->p->neighbours ? b->p->neighbours : TRIP_POINT_NEIGHBOURS;
    const unsigned room = (unsigned)((rows - b->rows) / TRIP_POINT_TILE_MAX);
    int status = trip_point_tiles_read(b->tiles, tile, rows);
    if (status == 0 && b->sides)
        trip_point_sides_begin(b->sides, room, rows, count);
    if (status == 0)
        status = trip_point_tiles_prepare(b->tiles, thread, tile, rows, wanted);
    for (uint32_t i = 0; i < count && status == 0; i++) {
        if (i == 0 || memcmp(n.position, rows[i].position, sizeof n.position)) {
            n.wanted = wanted;
            n.count = 0;
            memcpy(n.position, rows[i].position, sizeof n.position);
            status = trip_point_tiles_search(b->tiles, thread, tile, &n);
        }
        complete_row(b, &n, &rows[i]);
        if (b->sides)
            trip_point_sides_note(b->sides, room, i, &n);
    }
    if (b->sides && status == 0)
        trip_point_sides_join(b->sides, thread, room);
    return status;
}

static void note_sorted(void *user, uint64_t rows)
{
    tell(user, rows);
}

static size_t rows_bytes(const bricker *b)
{
    return 2 * (size_t)b->rooms * TRIP_POINT_TILE_MAX * sizeof *b->rows;
}

static int prepare_tiles(bricker *b)
{
    int status = trip_workers_create(&b->workers, b->p->threads);
    if (status == 0 && !trip_octree_build(&b->octree, &b->sample, b->records, TRIP_OCTREE_LEAF_AIM,
                                          b->all_lo, b->all_hi, b->budget))
        status = fail_memory(b);
    const trip_point_tiles_params params = { .spool = &b->spool,
                                             .workers = b->workers,
                                             .records = b->records,
                                             .octree = &b->octree,
                                             .folder = b->folder,
                                             .name = b->p->path,
                                             .progress = note_sorted,
                                             .user = b };
    if (status == 0)
        status = trip_point_tiles_make(&b->tiles, &params, b->budget);
    if (status < 0)
        return status;
    b->ordered = true;
    b->rooms = TILES_PER_THREAD * trip_workers_count(b->workers);
    b->rows = trip_budget_take(b->budget, rows_bytes(b));
    return b->rows ? trip_point_tiles_begin_searches(b->tiles, trip_workers_count(b->workers))
                   : fail_memory(b);
}

static trip_point_row *rows_of(const bricker *b, unsigned half, unsigned tile)
{
    return b->rows + ((size_t)half * b->rooms + tile) * TRIP_POINT_TILE_MAX;
}

/* Starts a loop over the tiles from `first` on, in the half that is not given out. */
static void start_loop(bricker *b, uint64_t first)
{
    const uint64_t left = trip_point_tiles_count(b->tiles) - first;
    b->loop_tile = first;
    b->loop_tiles = left < b->rooms ? (unsigned)left : b->rooms;
    b->loop_row = rows_of(b, 1 - b->half, 0);
    if (b->loop_tiles)
        trip_workers_start(b->workers, complete_tile, b, b->loop_tiles);
}

/* Completes the tiles that come next. */
static int complete_tiles(bricker *b)
{
    int status = 0;
    b->tile = 0;
    b->row = 0;
    b->next_tile += b->ready;
    if (!b->loop_tiles)
        start_loop(b, b->next_tile);
    b->ready = b->loop_tiles;
    if (b->ready)
        trip_workers_wait(b->workers, 0, &status);
    b->half = 1 - b->half;
    b->loop_tiles = 0;
    if (status == 0 && b->ready)
        start_loop(b, b->next_tile + b->ready);
    return status;
}

static void release_tiles(bricker *b)
{
    trip_workers_destroy(b->workers); /* ends the loop */
    trip_point_tiles_free(b->tiles);
    if (b->rows)
        trip_budget_release(b->budget, b->rows, rows_bytes(b));
    b->tiles = NULL;
    b->workers = NULL;
    b->rows = NULL;
}

/* ---- completed rows ---- */

/* Adds a row to the statistics (Welford 1962). */
static void note_row(bricker *b, const trip_point_row *row, uint64_t number)
{
    const double spread = (double)row->spread, apart = spread - b->spread_mean;
    b->spread_mean += apart / (double)number;
    b->spread_squares += apart * (spread - b->spread_mean);
    b->certainty += b->estimates && row->uncertainty > 0 ? 1 / (double)row->uncertainty : 0;
    if (has_late_values(b) && trip_gaussian_is_sampled(row->head.number, b->info->points))
        b->values[b->sample.count++] = value_of(row);
}

static int spool_tiles(bricker *b, trip_output *rows)
{
    uint64_t number = 0;
    int status = complete_tiles(b);
    while (status == 0 && b->ready > 0) {
        for (unsigned t = 0; t < b->ready && status == 0; t++) {
            const trip_point_row *from = rows_of(b, b->half, t);
            const uint32_t count = trip_point_tiles_at(b->tiles, b->next_tile + t)->count;
            for (uint32_t i = 0; i < count; i++)
                note_row(b, &from[i], ++number);
            status = trip_output_append(rows, from, count * sizeof *from);
            if (status == 0 && b->sides)
                status = trip_point_sides_keep(b->sides, b->half * b->rooms + t);
        }
        tell(b, number);
        if (status == 0)
            status = complete_tiles(b);
    }
    b->passed += number;
    return status == 0 ? trip_output_flush(rows) : status;
}

/* Makes the palette of values that came from neighbours. */
static int make_late_palette(bricker *b)
{
    const uint64_t count = b->sample.count;
    const size_t bytes = 2 * (count + 1) * sizeof(trip_key);
    double lo = 0, hi = 0;
    trip_key *keys = trip_budget_take(b->budget, bytes);
    if (!keys)
        return fail_memory(b);
    if (count > 0)
        typical(keys, count, &lo, &hi, b, 3);
    trip_budget_release(b->budget, keys, bytes);
    return make_palette(b, lo, hi);
}

static int create_sides(bricker *b)
{
    trip_point_sides_params params = { .tiles = b->tiles,
                                       .rooms = 2 * b->rooms,
                                       .threads = trip_workers_count(b->workers),
                                       .folder = b->folder,
                                       .name = b->p->path };
    const bool up = b->p->flags & TRIP_GAUSSIAN_Z_UP;
    for (int a = 0; a < 3; a++) {
        params.middle[a] = (b->lo[a] + b->hi[a]) / 2;
        params.up[a] = up ? b->p->up[a] : 0;
    }
    return trip_point_sides_create(&b->sides, &params, b->budget);
}

/* Completes all rows before the first one is given out, since a choice depends on all of them. The
 * spool then holds them in the order of the tiles. */
static int complete_first(bricker *b)
{
    trip_output rows = { .fd = -1 };
    b->sample.count = 0; /* the tiles exist */
    int status = trip_output_create(&rows,
                                    &(trip_output_params){ .folder = b->folder,
                                                           .name = TRIP_SPOOL_NAME,
                                                           .buffer_bytes = SPOOL_BYTES,
                                                           .unnamed = true },
                                    b->budget);
    if (status == 0 && has_free_sides(b))
        status = create_sides(b);
    if (status == 0)
        status = spool_tiles(b, &rows);
    if (status == 0 && b->sides)
        status = trip_point_sides_choose(b->sides, &rows, b->rows);
    release_tiles(b);
    b->spool = rows;
    b->lacking = false; /* the rows are complete */
    if (b->estimates)
        b->uncertainty = b->certainty > 0 ? (double)b->records / b->certainty : 0;
    if (b->p->outliers > 0 && b->records > 1)
        b->spread_max =
            b->spread_mean + b->p->outliers * sqrt(b->spread_squares / (double)(b->records - 1));
    return status == 0 && has_late_values(b) ? make_late_palette(b) : status;
}

static bool is_outlier(bricker *b, const trip_point_row *row)
{
    const bool far = b->spread_max > 0 && (double)row->spread > b->spread_max;
    b->outliers += far;
    return far;
}

/* ---- surfels ---- */

void trip_point_turn_to(const float normal[3], float rotation[4])
{
    const double x = (double)normal[0], y = (double)normal[1], z = (double)normal[2];
    const double w = 1 + z, length = sqrt(w * w + x * x + y * y);
    const bool half = !(length > 1e-6); /* half a turn */
    rotation[0] = half ? 0 : (float)(w / length);
    rotation[1] = half ? 1 : (float)(-y / length);
    rotation[2] = half ? 0 : (float)(x / length);
    rotation[3] = 0;
}

static void make_surfel(const bricker *b, const trip_point_row *row, trip_gaussian *g)
{
    const double factor = b->p->radius_factor > 0 ? b->p->radius_factor : 1;
    const float deviation = (float)((double)row->radius * factor * TRIP_SURFEL_DEVIATIONS);
    float rgb[3];
    memset(g, 0, sizeof *g);
    memcpy(g->centre, row->position, sizeof g->centre);
    g->deviations[0] = g->deviations[1] = deviation;
    trip_point_turn_to(row->normal, g->rotation);
    g->opacity = 1;
    if (b->p->uncertain)
        trip_point_stretch(g, row, factor, b->uncertainty);
    if (b->p->colouring == TRIP_POINT_BY_RGB)
        memcpy(rgb, row->colour, sizeof rgb);
    else
        trip_point_palette_colour(&b->palette, value_of(row), rgb);
    for (int c = 0; c < 3; c++)
        g->sh[0][c] = trip_sh_of_colour((double)rgb[c]);
}

static int next_of_tiles(bricker *b, trip_gaussian *out, size_t room, size_t *got)
{
    while (*got < room) {
        if (b->tile == b->ready) {
            const int status = complete_tiles(b);
            if (status < 0 || b->ready == 0)
                return status;
        }
        const uint64_t tile = b->next_tile + b->tile;
        make_surfel(b, rows_of(b, b->half, b->tile) + b->row, &out[(*got)++]);
        if (++b->row == trip_point_tiles_at(b->tiles, tile)->count) {
            b->row = 0;
            b->tile++;
        }
    }
    return 0;
}

static int next_of_spool(bricker *b, trip_gaussian *out, size_t room, size_t *got)
{
    trip_point_row rows[32];
    while (*got < room && b->given < b->records) {
        const uint64_t left = b->records - b->given;
        size_t count = room - *got < 32 ? room - *got : 32;
        count = left < count ? (size_t)left : count;
        const int status =
            trip_output_read(&b->spool, b->given * sizeof *rows, rows, count * sizeof *rows);
        if (status < 0)
            return status;
        for (size_t i = 0; i < count; i++) {
            if (b->sides)
                trip_point_sides_turn(b->sides, &rows[i]);
            if (!is_outlier(b, &rows[i]))
                make_surfel(b, &rows[i], &out[(*got)++]);
        }
        b->given += count;
    }
    return 0;
}

static int give_surfels(void *user, trip_gaussian *out, size_t room, size_t *got)
{
    bricker *b = user;
    *got = 0;
    const int status = !b->lacking ? next_of_spool(b, out, room, got)
                       : b->tiles  ? next_of_tiles(b, out, room, got)
                                   : 0;
    if (status == 0 && *got == 0) {
        release_tiles(b); /* the later passes need the memory and the disk */
        trip_output_close(&b->spool);
    }
    return status;
}

static void release_sample(bricker *b)
{
    if (b->sample.points)
        trip_budget_release(b->budget, b->sample.points, b->sample_bytes);
    if (b->values)
        trip_budget_release(b->budget, b->values, b->values_bytes);
    b->sample.points = NULL;
    b->values = NULL;
}

static int brick_surfels(bricker *b, trip_brick_gaussians_result *result)
{
    const trip_brick_points_params *p = b->p;
    const uint32_t surfels = TRIP_GAUSSIAN_FLAT | TRIP_GAUSSIAN_CLOUD |
                             (p->colouring == TRIP_POINT_BY_RGB ? 0 : TRIP_GAUSSIAN_SHADED);
    /* A small cloud gets a finer octree. */
    const bool keeps_order = b->ordered && !(p->outliers > 0) && b->records > TRIP_OCTREE_LEAF_AIM;
    release_sample(b);
    b->passed += b->records;
    return trip_brick_gaussians(
        &(trip_brick_gaussians_params){
            .path = p->path,
            .replace = p->replace,
            .source = give_surfels,
            .source_user = b,
            .source_name = p->file_name,
            .octree = keeps_order ? &b->octree : NULL,
            .octree_records = keeps_order ? b->records : 0,
            .flags = p->flags | (p->uncertain ? TRIP_GAUSSIAN_FROM_CAMERA : surfels),
            .text = p->text,
            .threads = p->threads,
            .progress = tell,
            .progress_user = b },
        b->budget, result);
}

static int run(bricker *b, trip_brick_gaussians_result *result)
{
    int status = trip_folder_check(b->p->path, b->p->replace);
    b->folder = trip_path_beside(b->p->path, ".");
    if (status == 0 && !b->folder)
        status = trip_fail_errno("brick", b->p->path, "cannot write");
    if (status == 0)
        status = spool_all(b);
    if (status == 0)
        status = look_at_sample(b);
    const bool first = completes_first(b);
    if (status == 0 && (b->lacking || first) && !trip_neighbour_trees_exist())
        status = trip_fail(TRIP_ERROR, "brick", b->p->file_name,
                           "needs neighbours, for radii, normals, outliers or density, but this "
                           "program was built without nanoflann, which finds them");
    if (status == 0 && (b->lacking || first)) {
        status = prepare_tiles(b);
        trip_output_close(&b->spool);
        b->spool = (trip_output){ .fd = -1 };
    }
    if (status == 0 && first)
        status = complete_first(b);
    if (status == 0)
        status = brick_surfels(b, result);
    if (status == 0 && b->outliers)
        trip_note(b->p->file_name,
                  "%" PRIu64 " of %" PRIu64 " points are outliers, on average more than %g away "
                  "from their neighbours; they are left out",
                  b->outliers, b->records, b->spread_max);
    if (b->p->outliers_out)
        *b->p->outliers_out = b->outliers;
    return status;
}

int trip_brick_points(const trip_brick_points_params *params, trip_budget *budget,
                      trip_brick_gaussians_result *result)
{
    const trip_point_info *info = trip_point_file_info(params->file);
    bricker b = {
        .p = params,
        .info = info,
        .budget = budget,
        .estimates = params->uncertain && !(info->attributes & TRIP_POINT_UNCERTAINTY),
        .uncertainty = info->uncertainty,
        .spool.fd = -1,
        .all_lo = { INFINITY, INFINITY, INFINITY },
        .all_hi = { -INFINITY, -INFINITY, -INFINITY },
    };
    const int status = run(&b, result);
    release_tiles(&b);
    trip_point_sides_free(b.sides);
    trip_scan_steps_end(b.steps);
    release_sample(&b);
    trip_octree_free(&b.octree);
    trip_output_close(&b.spool);
    trip_point_palette_free(&b.palette);
    free(b.folder);
    return status;
}
