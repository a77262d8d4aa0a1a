/* Compares coarse levels with plain sums over the voxels that each coarse voxel covers. */
#include "brick_files.h"

#include <math.h>

#include "levels.h"
#include "mean.h"
#include "normal.h"
#include "reader.h"

enum { NX = 300, NY = 70, NZ = 41, N = NX * NY * NZ, MIN = 200 };

static uint8_t bytes[N];

static bool is_kept(int64_t x, int64_t y, int64_t z)
{
    return x >= 0 && y >= 0 && z >= 0 && x < NX && y < NY && z < NZ &&
           bytes[(z * NY + y) * NX + x] >= MIN;
}

/* Returns whether the voxel is kept or a neighbour of a kept voxel. */
static bool is_known(int64_t x, int64_t y, int64_t z)
{
    for (int n = 0; n < 27; n++)
        if (is_kept(x + n % 3 - 1, y + n / 3 % 3 - 1, z + n / 9 - 1))
            return x < NX && y < NY && z < NZ;
    return false;
}

static uint8_t known[N];

static void find_known(void)
{
    for (int i = 0; i < N; i++)
        known[i] = is_known(i % NX, i / NX % NY, i / NX / NY);
}

/* Makes a ball and some single voxels at random positions. */
static void make_bytes(uint64_t seed, unsigned rare)
{
    uint64_t random = seed;
    for (int i = 0; i < N; i++) {
        int x = i % NX - 260, y = i / NX % NY - 30, z = i / NX / NY - 21;
        bool kept = x * x + y * y + z * z < 300 || test_random(&random) % rare == 0;
        bytes[i] = (uint8_t)(kept ? MIN + test_random(&random) % 56 : test_random(&random) % MIN);
    }
    test_write("v.raw", bytes, sizeof bytes);
    find_known();
}

static const trip_value_range high = { MIN, 255 };

static trip_brick_summary brick_to(const char *output, trip_brick_params p)
{
    static char input[128], path[128];
    trip_brick_summary s;
    strcpy(input, test_path("v.raw"));
    strcpy(path, test_path(output));
    p.input = input;
    p.output = path;
    if (!p.normals)
        p.normals = TRIP_NORMALS_STORED;
    if (!p.levels_for && !p.no_halo)
        p.levels_for = TRIP_LEVELS_FOR_BOTH;
    if (p.range_count == 0) {
        p.ranges = &high;
        p.range_count = 1;
    }
    p.replace = true;
    if (!p.volume.raw_type)
        p.volume = (trip_volume_params){ .raw_dims = { NX, NY, NZ }, .raw_type = "uint8" };
    if (trip_brick(&p, &s) != 0)
        fail_msg("%s", test_report);
    return s;
}

/* Sums over the cube of voxels that one coarse voxel covers. */
typedef struct cube {
    int kept, known, columns; /* columns along the axis that contain kept voxels */
    double mean, value;       /* codes */
    double squares;           /* mean square of the codes of the known voxels */
} cube;

static cube sum_cube(const int64_t at[3], unsigned level, int axis)
{
    const int64_t edge = (int64_t)1 << level;
    bool column[64] = { false };
    cube c = { 0 };
    for (int64_t n = 0; n < edge * edge * edge; n++) {
        const int64_t in[3] = { n % edge, n / edge % edge, n / edge / edge };
        int64_t x = at[0] * edge + in[0], y = at[1] * edge + in[1], z = at[2] * edge + in[2];
        double code = 0;
        if (x >= 0 && y >= 0 && z >= 0 && x < NX && y < NY && z < NZ &&
            known[(z * NY + y) * NX + x]) {
            code = 85.0 * (258 + bytes[(z * NY + y) * NX + x]);
            c.known++;
            c.value += code;
            c.squares += code * code;
        }
        if (is_kept(x, y, z)) {
            c.kept++;
            c.mean += code;
            column[in[(axis + 1) % 3] * edge + in[(axis + 2) % 3]] = true;
        }
    }
    for (int i = 0; i < 64; i++)
        c.columns += column[i];
    c.mean /= c.kept ? c.kept : 1;
    c.value /= c.known ? c.known : 1;
    c.squares /= c.known ? c.known : 1;
    return c;
}

/* The means are exact up to the rounding of codes. */
static void expect_mean(const trip_mean_scale *scale, const cube *c, unsigned code, unsigned level)
{
    const double edge = (double)(1u << level), cover = c->columns / (edge * edge);
    const double part = c->kept / (edge * edge * edge);
    assert_true(fabs(trip_mean_value(scale, code) - c->mean) < 65535.0 / 1023);
    if (level == 1)
        assert_int_equal(code & (TRIP_MEAN_SHARES - 1),
                         trip_mean_pack(scale, 0, cover, part / cover) & (TRIP_MEAN_SHARES - 1));
    else if (part == 1)
        assert_int_equal(code & (TRIP_MEAN_SHARES - 1), TRIP_MEAN_SHARES - 1);
}

/* A voxel of level 1 or 2 for interpolation, before sharpening. */
typedef struct base {
    bool kept, there, added;
    double value, around; /* codes; `around` is the minimum of the voxels not kept */
} base;

enum { MAX_LEVEL = 2, MAX = (NX / 2 + 1) * (NY / 2 + 1) * (NZ / 2 + 1) };

static base bases[1 + MAX_LEVEL][MAX];

static int64_t size_of(int axis, unsigned level)
{
    return (((int64_t[]){ NX, NY, NZ }[axis] - 1) >> level) + 1;
}

/* Returns NULL beyond the grid. */
static base *base_at(int64_t x, int64_t y, int64_t z, unsigned level)
{
    if (x < 0 || y < 0 || z < 0 || x >= size_of(0, level) || y >= size_of(1, level) ||
        z >= size_of(2, level))
        return NULL;
    return &bases[level][(z * size_of(1, level) + y) * size_of(0, level) + x];
}

/* Returns the minimum of the voxels not kept in this coarse voxel. At level 1 these are its halo
 * voxels. At level 2 each voxel of level 1 counts with `around`, or with its value if it covers no
 * kept voxel. */
static double min_in(const int64_t at[3], unsigned level)
{
    double min = INFINITY;
    for (int n = 0; n < 8; n++) {
        const int64_t x = 2 * at[0] + n % 2, y = 2 * at[1] + n / 2 % 2, z = 2 * at[2] + n / 4;
        const base *below = level > 1 ? base_at(x, y, z, level - 1) : NULL;
        if (below && below->there)
            min = fmin(min, below->kept ? below->around : below->value);
        if (level == 1 && x < NX && y < NY && z < NZ && known[(z * NY + y) * NX + x] &&
            !is_kept(x, y, z))
            min = fmin(min, 85.0 * (258 + bytes[(z * NY + y) * NX + x]));
    }
    return min;
}

/* Fills a voxel of level 2 that covers neither kept nor halo voxels. The new value is the minimum
 * of `around` over the neighbours that cover kept voxels. */
static void add_halo(const int64_t at[3], unsigned level, base *b)
{
    double min = INFINITY;
    for (int n = 0; n < 27; n++) {
        const base *beside =
            base_at(at[0] + n % 3 - 1, at[1] + n / 3 % 3 - 1, at[2] + n / 9 - 1, level);
        if (beside && beside->kept)
            min = fmin(min, beside->around);
    }
    if (level > 1 && !b->there && min < INFINITY)
        *b = (base){ .there = true, .added = true, .value = min };
}

static void find_bases(void)
{
    for (unsigned level = 1; level <= MAX_LEVEL; level++)
        for (int pass = 0; pass < 2; pass++) {
            int64_t at[3];
            for (at[2] = 0; at[2] < size_of(2, level); at[2]++)
                for (at[1] = 0; at[1] < size_of(1, level); at[1]++)
                    for (at[0] = 0; at[0] < size_of(0, level); at[0]++) {
                        base *b = base_at(at[0], at[1], at[2], level);
                        const cube c = sum_cube(at, level, 0);
                        if (pass == 0)
                            *b = (base){ .kept = c.kept > 0,
                                         .there = c.known > 0,
                                         .value = c.value,
                                         .around = min_in(at, level) };
                        else
                            add_halo(at, level, b);
                    }
        }
}

/* Returns the value plus an eighth of its difference from each of the six neighbours that exist.
 * Sharpening never raises an added voxel, because the kept values lie above it. */
static double sharp_value(const int64_t at[3], unsigned level)
{
    const base *own = base_at(at[0], at[1], at[2], level);
    double sum = own->value;
    for (int n = 0; n < 6; n++) {
        int64_t to[3] = { at[0], at[1], at[2] };
        to[n / 2] += n % 2 ? 1 : -1;
        const base *beside = base_at(to[0], to[1], to[2], level);
        if (beside && beside->there)
            sum += (own->value - beside->value) / 8;
    }
    return fmin(own->added ? own->value : 65535, fmax(0, sum));
}

/* Calls `each` with the position, the code and the deviation of each record of a list. Lists of
 * means have no deviations. Returns the number of records. */
static uint64_t visit(const trip_dataset *d, const trip_list *list,
                      void (*each)(const trip_dataset *d, const trip_list *list,
                                   const int64_t at[3], unsigned code, unsigned deviation,
                                   void *user),
                      void *user)
{
    static uint64_t words[TRIP_BLOCK_WORDS_MAX];
    static uint32_t voxels[TRIP_RUN_RECORDS_MAX];
    static uint8_t deviations[TRIP_RUN_RECORDS_MAX];
    const int deviations_fd = list->plane_fd[TRIP_PLANE_DEVIATIONS];
    const trip_block_form form = trip_block_form_of(&d->header, list->kind);
    trip_selection all;
    trip_run run;
    uint64_t records = 0;
    assert_int_equal(trip_selection_create_whole(&all, d, list, false, d->budget), 0);
    for (trip_run_iterator it = trip_run_begin(&all); trip_run_next(&it, &run);) {
        size_t size = 8 * (size_t)run.words;
        assert_int_equal(pread(list->plane_fd[0], words, size, (off_t)run.at[0]), size);
        trip_block block = trip_block_make(&form, run.count, run.words, words, NULL);
        trip_block_voxels(&block, 0, run.count, voxels);
        if (deviations_fd >= 0)
            assert_int_equal(
                pread(deviations_fd, deviations, run.count, (off_t)run.at[TRIP_PLANE_DEVIATIONS]),
                run.count);
        for (uint32_t i = 0; i < run.count; i++) {
            int64_t at[3];
            at[list->axis] = run.sheet;
            at[(list->axis + 1) % 3] = run.u + (int64_t)trip_voxel_u(voxels[i]);
            at[(list->axis + 2) % 3] = run.v + (int64_t)trip_voxel_v(voxels[i]);
            each(d, list, at, trip_voxel_code(voxels[i]), deviations[i], user);
        }
        records += run.count;
    }
    trip_selection_destroy(&all, d->budget);
    return records;
}

static double deviation_code(double variance)
{
    return 255 * sqrt(sqrt(fmax(0, variance)) / 32767.5);
}

/* Checks the standard deviation of the known voxels of a cube. The part that interpolation shows is
 * taken off its square. Means that the program rounded to codes limit the accuracy of the square.
 * Returns whether this leaves at most two codes. */
static bool check_deviation(const int64_t at[3], unsigned level, unsigned deviation)
{
    const cube c = sum_cube(at, level, 0);
    const base *own = base_at(at[0], at[1], at[2], level);
    const double variance = fmax(0, c.squares - c.value * c.value);
    const double part = (1 - pow(4, -(double)level)) / 24;
    double shown = 0, rounded = 4 * sqrt(variance) + 4 + 1e-4 * variance;
    for (int n = 0; n < 6; n++) {
        int64_t to[3] = { at[0], at[1], at[2] };
        to[n / 2] += n % 2 ? 1 : -1;
        const base *beside = base_at(to[0], to[1], to[2], level);
        const double by = beside && beside->there ? own->value - beside->value : 0;
        shown += by * by * part;
        rounded += (4 * fabs(by) + 4) * part;
    }
    const double min = deviation_code(variance - shown - rounded);
    const double max = deviation_code(variance - shown + rounded);
    if (c.known == 0)
        assert_int_equal(deviation, 0);
    else
        assert_true(deviation >= min - 0.5 && deviation <= max + 0.5);
    return max - min < 1;
}

static void check_record(const trip_dataset *d, const trip_list *list, const int64_t at[3],
                         unsigned code, unsigned deviation, void *user)
{
    const trip_mean_scale scale =
        trip_mean_scale_make(d->header.value_min, d->header.value_max, &d->codes);
    const cube c = sum_cube(at, list->level, list->axis);
    const base *b = base_at(at[0], at[1], at[2], list->level);
    uint64_t *sure = user;
    if (list->kind == TRIP_KIND_MEANS) {
        expect_mean(&scale, &c, code, list->level);
    } else {
        assert_true(fabs(code - sharp_value(at, list->level)) < 85);
        *sure += check_deviation(at, list->level, deviation);
    }
    assert_true(list->kind == TRIP_KIND_MEANS ? c.kept > 0 : b && b->there);
}

/* Returns the number of voxels of the list's level that cover a kept voxel. For a list of values,
 * returns the number that have a value. */
static uint64_t count_cubes(const trip_list *list)
{
    uint64_t count = 0;
    for (int64_t n = 0; n < list->dims[0] * list->dims[1] * list->dims[2]; n++) {
        const int64_t at[3] = { n % list->dims[0], n / list->dims[0] % list->dims[1],
                                n / list->dims[0] / list->dims[1] };
        const base *b = base_at(at[0], at[1], at[2], list->level);
        count += list->kind == TRIP_KIND_MEANS ? b->kept : b->there;
    }
    return count;
}

/* `lists` is the number of lists of each coarse level. */
static void check_data_set(const char *name, unsigned levels, unsigned lists)
{
    trip_dataset *d;
    trip_budget *budget;
    assert_int_equal(trip_budget_create(&budget, (uint64_t)1 << 28), 0);
    assert_int_equal(trip_dataset_open(&d, test_path(name), budget), 0);
    assert_int_equal(d->list_count, 6 + lists * levels);
    find_bases();
    for (unsigned i = 6; i < d->list_count; i++) {
        const trip_list *list = &d->lists[i];
        uint64_t sure = 0, records = visit(d, list, check_record, &sure);
        assert_true(records > 0);
        assert_true(list->kind == TRIP_KIND_MEANS || sure > records / 2);
        if (list->axis == 0)
            assert_int_equal(records, count_cubes(list));
    }
    assert_int_equal(trip_dataset_verify(d, budget), 0);
    trip_dataset_close(d);
    trip_budget_destroy(budget);
}

static void coarse_voxels_are_means_of_the_voxels_they_cover(void **state)
{
    (void)state;
    for (int sparse = 0; sparse < 2; sparse++) {
        make_bytes(7, sparse ? 2000 : 3);
        trip_brick_summary s =
            brick_to("a.trip", (trip_brick_params){ .tile_voxels = 64, .levels = 2, .threads = 2 });
        assert_int_equal(s.levels, 2);
        assert_true(s.level_bytes > 0 && s.level_bytes < s.bytes);
        check_data_set("a.trip", 2, 6);
    }
}

/* Voxels that cover neither kept nor halo voxels. None of them may be visible. */
typedef struct added {
    int shown_from, shown_to; /* values */
    uint64_t count;
} added;

static void check_added_record(const trip_dataset *d, const trip_list *list, const int64_t at[3],
                               unsigned code, unsigned deviation, void *user)
{
    added *a = user;
    (void)d;
    (void)deviation;
    if (sum_cube(at, list->level, 0).known > 0)
        return;
    assert_true((int)code < 85 * (258 + a->shown_from) || (int)code > 85 * (258 + a->shown_to));
    a->count++;
}

/* Returns the number of added voxels in the list of level 2 along X. */
static uint64_t check_added(const char *name, int shown_from, int shown_to)
{
    added a = { shown_from, shown_to, 0 };
    trip_dataset *d;
    trip_budget *budget;
    assert_int_equal(trip_budget_create(&budget, (uint64_t)1 << 28), 0);
    assert_int_equal(trip_dataset_open(&d, test_path(name), budget), 0);
    visit(d, trip_dataset_find(d, 0, 2, TRIP_KIND_VALUES), check_added_record, &a);
    trip_dataset_close(d);
    trip_budget_destroy(budget);
    return a.count;
}

static void voxels_added_around_kept_voxels_are_invisible(void **state)
{
    static const trip_value_range low = { 0, 255 - MIN };
    trip_brick_params p = { .levels = 2 };
    (void)state;
    make_bytes(12, 2000);
    brick_to("a.trip", p);
    const uint64_t count = check_added("a.trip", MIN, 255);
    assert_true(count > 100);
    for (int i = 0; i < N; i++)
        bytes[i] = (uint8_t)(255 - bytes[i]); /* the same voxels are kept */
    test_write("v.raw", bytes, sizeof bytes);
    p.ranges = &low;
    p.range_count = 1;
    brick_to("a.trip", p);
    assert_int_equal(check_added("a.trip", 0, 255 - MIN), count);
}

/* Below and above all values that codes can hold. */
enum { LOWEST = -258, HIGHEST = 513 };

/* Moves the voxels that make_bytes() kept into the ranges `kept`. The other voxels move below and
 * above the ranges, alternating along each axis. */
static void spread_bytes(const trip_value_range *kept, unsigned count)
{
    const int lo = (int)kept[0].lo, hi = (int)kept[count - 1].hi;
    for (int i = 0; i < N; i++) {
        const trip_value_range *in = &kept[bytes[i] % count];
        const int width = (int)(in->hi - in->lo) + 1, byte = bytes[i];
        const bool below = (i % NX + i / NX % NY + i / NX / NY) % 2;
        if (byte >= MIN)
            bytes[i] = (uint8_t)(in->lo + byte / (int)count % width);
        else
            bytes[i] = (uint8_t)(below ? byte % lo : 255 - byte % (255 - hi));
    }
    test_write("v.raw", bytes, sizeof bytes);
}

/* The values not kept lie on both sides of the kept ranges. Added voxels get values from the wider
 * side, even after sharpening. */
static void added_voxels_get_values_of_the_wider_side(void **state)
{
    static const struct {
        trip_value_range kept[2];
        unsigned count;
        bool above;
    } forms[] = {
        { { { 60, 100 } }, 1, true },
        { { { 155, 195 } }, 1, false },
        { { { 35, 50 }, { 205, 215 } }, 2, true },
        { { { 40, 50 }, { 205, 220 } }, 2, false },
        { { { 40, 50 }, { 205, 215 } }, 2, false }, /* both sides are equally wide */
    };
    (void)state;
    for (size_t i = 0; i < sizeof forms / sizeof *forms; i++) {
        const trip_value_range *kept = forms[i].kept;
        const unsigned count = forms[i].count;
        make_bytes(12, 2000);
        spread_bytes(kept, count);
        brick_to("a.trip",
                 (trip_brick_params){ .ranges = kept, .range_count = count, .levels = 2 });
        assert_true(check_added("a.trip", forms[i].above ? LOWEST : (int)kept[0].lo,
                                forms[i].above ? (int)kept[count - 1].hi : HIGHEST) > 100);
    }
}

static trip_dataset *open_data_set(const char *name, trip_budget **budget)
{
    trip_dataset *d;
    assert_int_equal(trip_budget_create(budget, (uint64_t)1 << 28), 0);
    assert_int_equal(trip_dataset_open(&d, test_path(name), *budget), 0);
    return d;
}

/* A volume of 16-bit voxels, several squares long along y. Level 1 has the rounded means of up to
 * eight of them. */
enum { SX = 7, SY = 300, SZ = 9 };

static uint16_t shorts[SX * SY * SZ];

/* Returns -1 beyond the grid. */
static double mean_of_shorts(const int64_t at[3])
{
    double sum = 0, count = 0;
    for (int n = 0; n < 8; n++) {
        const int64_t x = 2 * at[0] + n % 2, y = 2 * at[1] + n / 2 % 2, z = 2 * at[2] + n / 4;
        if (x < 0 || y < 0 || z < 0 || x >= SX || y >= SY || z >= SZ)
            continue;
        sum += shorts[(z * SY + y) * SX + x];
        count++;
    }
    return count > 0 ? floor(sum / count + 0.5) : -1;
}

static void check_short(const trip_dataset *d, const trip_list *list, const int64_t at[3],
                        unsigned code, unsigned deviation, void *user)
{
    const double own = mean_of_shorts(at);
    double sharp = own;
    (void)d;
    (void)deviation;
    (void)list;
    for (int n = 0; n < 6; n++) {
        int64_t to[3] = { at[0], at[1], at[2] };
        to[n / 2] += n % 2 ? 1 : -1;
        const double beside = mean_of_shorts(to);
        sharp += beside < 0 ? 0 : (own - beside) / 8;
    }
    assert_true(fabs(code - fmin(65535, fmax(0, sharp))) <= 0.5);
    ((uint64_t *)user)[sharp < 0 ? 0 : sharp > 65535 ? 2 : 1]++;
}

static void sharpened_values_are_nearest_codes_within_range(void **state)
{
    (void)state;
    uint64_t random = 4, counts[3] = { 0 };
    for (int i = 0; i < SX * SY * SZ; i++) { /* cubes that are nearly black, nearly white or grey */
        const int which = (i % SX / 2 + i / SX % SY / 2 * 7 + i / SX / SY / 2 * 31) % 3;
        const uint16_t near = (uint16_t)(test_random(&random) % 100);
        shorts[i] = which == 0 ? near : which == 1 ? UINT16_MAX - near : 30000 + near;
    }
    test_write("v.raw", shorts, sizeof shorts);
    brick_to("a.trip",
             (trip_brick_params){ .volume = { .raw_dims = { SX, SY, SZ }, .raw_type = "uint16" },
                                  .keep_all = true,
                                  .levels = 1 });
    trip_budget *budget;
    trip_dataset *d = open_data_set("a.trip", &budget);
    const uint64_t records =
        visit(d, trip_dataset_find(d, 1, 1, TRIP_KIND_VALUES), check_short, counts);
    assert_int_equal(records, (SX + 1) / 2 * (SY / 2) * ((SZ + 1) / 2));
    for (int i = 0; i < 3; i++)
        assert_true(counts[i] > 20);
    trip_dataset_close(d);
    trip_budget_destroy(budget);
}

enum { RX = 21, RY = 35, RZ = 10 };

/* The steps of a ramp along each axis. Means of its cubes are whole codes. */
static const double ramp_steps[3] = { 1000, 500, 100 };

/* Whether all voxels of a cube are in the grid. */
static bool is_full(const int64_t at[3], unsigned level)
{
    return (at[0] + 1) << level <= RX && (at[1] + 1) << level <= RY && (at[2] + 1) << level <= RZ;
}

/* Returns how many of the neighbours along an axis exist, or -1 if one is not full. */
static int full_neighbours(const int64_t at[3], unsigned level, int axis)
{
    int count = 0;
    for (int way = -1; way < 2; way += 2) {
        const int64_t size = (((int64_t[]){ RX, RY, RZ }[axis] - 1) >> level) + 1;
        int64_t to[3] = { at[0], at[1], at[2] };
        to[axis] += way;
        if (to[axis] < 0 || to[axis] >= size)
            continue;
        if (!is_full(to, level))
            return -1;
        count++;
    }
    return count;
}

typedef struct deviations_seen {
    bool stripes;
    uint64_t checked, zero;
} deviations_seen;

/* Along an axis, a ramp of step g has the variance g^2 (4^n - 1) / 12 in a cube of level n.
 * Interpolation towards each of the two neighbours shows half of it. Stripes one voxel wide have
 * equal means, and interpolation shows nothing. */
static void expect_deviation(const trip_list *list, const int64_t at[3], unsigned deviation,
                             deviations_seen *seen)
{
    double variance = seen->stripes ? 10000.0 * 10000 : 0;
    if (!is_full(at, list->level))
        return;
    for (int axis = 0; axis < 3; axis++) {
        const int beside = full_neighbours(at, list->level, axis);
        if (beside < 0)
            return;
        if (!seen->stripes)
            variance += (2 - beside) / 2.0 * ramp_steps[axis] * ramp_steps[axis] *
                        (pow(4, list->level) - 1) / 12;
    }
    assert_int_equal(deviation, (int)floor(deviation_code(variance) + 0.5));
    seen->checked++;
    seen->zero += deviation == 0;
}

/* Reads a list as renderers do. */
static void read_deviations(const trip_dataset *d, const trip_list *list, deviations_seen *seen)
{
    static uint32_t voxels[TRIP_RUN_RECORDS_MAX];
    const trip_reader_params params = { .planes = list->planes };
    trip_reader *reader;
    trip_selection all;
    trip_batch batch;
    uint64_t records = 0;
    assert_int_equal(trip_reader_create(&reader, d, &params, d->budget), 0);
    assert_int_equal(trip_selection_create_whole(&all, d, list, false, d->budget), 0);
    const trip_pass pass = trip_pass_of(&all);
    assert_int_equal(trip_reader_begin(reader, &pass), 0);
    while (trip_reader_next(reader, &batch) == 1) {
        for (size_t i = 0; i < batch.run_count; i++) {
            const trip_run *run = &batch.runs[i];
            const trip_block block = trip_block_of(&batch, run);
            assert_non_null(block.deviations);
            assert_null(block.normals);
            trip_block_voxels(&block, 0, run->count, voxels);
            for (uint32_t n = 0; n < run->count; n++) {
                int64_t at[3];
                at[list->axis] = run->sheet;
                at[(list->axis + 1) % 3] = run->u + (int64_t)trip_voxel_u(voxels[n]);
                at[(list->axis + 2) % 3] = run->v + (int64_t)trip_voxel_v(voxels[n]);
                expect_deviation(list, at, block.deviations[n], seen);
            }
            records += run->count;
        }
        trip_reader_release(reader, &batch);
    }
    assert_int_equal(records, list->records);
    trip_reader_destroy(reader);
    trip_selection_destroy(&all, d->budget);
}

static void deviations_of_ramps_and_stripes_have_closed_forms(void **state)
{
    static uint16_t values[RX * RY * RZ];
    (void)state;
    for (int stripes = 0; stripes < 2; stripes++) {
        deviations_seen seen = { .stripes = stripes };
        for (int i = 0; i < RX * RY * RZ; i++)
            values[i] =
                (uint16_t)(stripes ? (i % RX % 2 ? 30000 : 10000)
                                   : ramp_steps[0] * (i % RX) + ramp_steps[1] * (i / RX % RY) +
                                         ramp_steps[2] * (i / RX / RY));
        test_write("v.raw", values, sizeof values);
        brick_to("a.trip", (trip_brick_params){
                               .volume = { .raw_dims = { RX, RY, RZ }, .raw_type = "uint16" },
                               .keep_all = true,
                               .levels = 3,
                               .tile_voxels = 16 });
        trip_budget *budget;
        trip_dataset *d = open_data_set("a.trip", &budget);
        for (unsigned level = 1; level <= 3; level++)
            for (int axis = 0; axis < 3; axis++)
                read_deviations(d, trip_dataset_find(d, axis, level, TRIP_KIND_VALUES), &seen);
        assert_true(seen.checked > 3 * 400);
        assert_true(stripes ? seen.zero == 0 : seen.zero > 3 * 200);
        trip_dataset_close(d);
        trip_budget_destroy(budget);
    }
}

/* Labels have no mean. Labels of more than 16 bits are stored as ids. */
static void labels_have_no_deviations(void **state)
{
    static uint32_t labels[32 * 32 * 32];
    (void)state;
    const char header[] = "NRRD0004\ntype: uint32\ndimension: 3\nsizes: 32 32 32\n"
                          "encoding: raw\nendian: little\ndata file: v.raw\n";
    static char input[128], output[128];
    strcpy(input, test_path("v-labels.nhdr"));
    strcpy(output, test_path("labels.trip"));
    for (uint32_t scale = 1; scale <= 100000000; scale *= 100000000) {
        trip_brick_summary s;
        trip_budget *budget;
        for (uint32_t i = 0; i < 32 * 32 * 32; i++)
            labels[i] = scale * ((i % 32 / 8 + i / 32 % 32 / 8 * 3 + i / 1024 / 8 * 5) % 7);
        test_write("v.raw", labels, sizeof labels);
        test_write("v-labels.nhdr", header, sizeof header - 1);
        const trip_brick_params p = {
            .input = input, .output = output, .keep_all = true, .levels = 1, .replace = true
        };
        if (trip_brick(&p, &s) != 0)
            fail_msg("%s", test_report);
        trip_dataset *d = open_data_set("labels.trip", &budget);
        assert_int_equal(d->header.planes & 1u << TRIP_PLANE_DEVIATIONS, 0);
        assert_true(trip_dataset_find(d, 0, 1, TRIP_KIND_VALUES)->records > 0);
        assert_false(test_exists("labels.trip/x1.deviations"));
        assert_true(test_exists("labels.trip/x1.values"));
        assert_int_equal(trip_codes_even(&d->codes), scale == 1);
        trip_dataset_close(d);
        trip_budget_destroy(budget);
    }
}

static void expect_records(const char *name, unsigned level, uint64_t records)
{
    trip_budget *budget;
    trip_dataset *d = open_data_set(name, &budget);
    for (int axis = 0; axis < 3; axis++)
        assert_int_equal(trip_dataset_find(d, axis, level, TRIP_KIND_VALUES)->records, records);
    trip_dataset_close(d);
    trip_budget_destroy(budget);
}

/* One kept voxel lies in the middle of a voxel of level 2, at the start of a square and far from
 * the first sheet. The halo lies in 2 x 2 x 2 voxels of level 1 and in one voxel of level 2. Level
 * 2 also gets the 26 neighbours of the one voxel as added voxels. */
static void neighbours_are_added_at_any_position(void **state)
{
    enum { X = 20, Y = 300, Z = 200 };
    (void)state;
    uint8_t *voxels = calloc(Z, (size_t)X * Y);
    voxels[(154 * Y + 4 * 64 + 2) * X + 10] = 255;
    test_write("v.raw", voxels, (size_t)X * Y * Z);
    free(voxels);
    brick_to("a.trip",
             (trip_brick_params){ .volume = { .raw_dims = { X, Y, Z }, .raw_type = "uint8" },
                                  .levels = 2 });
    expect_records("a.trip", 1, 8);
    expect_records("a.trip", 2, 27);
}

/* If all values are kept, no value is left that an added voxel could take and stay invisible. */
static void no_voxel_is_added_if_all_values_are_kept(void **state)
{
    enum { EDGE = 16 };
    (void)state;
    float values[EDGE * EDGE * EDGE];
    for (int i = 0; i < EDGE * EDGE * EDGE; i++)
        values[i] = i % EDGE < EDGE / 2 ? (float)(1 + i % 5) : NAN;
    test_write("v.raw", values, sizeof values);
    brick_to("a.trip", (trip_brick_params){
                           .volume = { .raw_dims = { EDGE, EDGE, EDGE }, .raw_type = "float" },
                           .keep_all = true,
                           .levels = 2 });
    expect_records("a.trip", 1, 4 * 8 * 8);
    expect_records("a.trip", 2, 2 * 4 * 4);
}

static void tiles_of_any_size_have_levels(void **state)
{
    (void)state;
    make_bytes(8, 40);
    for (unsigned tile = 16; tile <= 128; tile *= 2) {
        brick_to("a.trip",
                 (trip_brick_params){ .tile_voxels = tile, .slab_sheets = 3, .levels = 2 });
        check_data_set("a.trip", 2, 6);
    }
}

static void memory_threads_and_slices_do_not_change_the_result(void **state)
{
    (void)state;
    make_bytes(9, 100);
    brick_to("a.trip", (trip_brick_params){ .threads = 1 });
    for (int way = 0; way < 3; way++) {
        trip_brick_params p = { .threads = (unsigned[]){ 1, 4, 2 }[way],
                                .slices = (int64_t[]){ 1, 5, 23 }[way],
                                .memory_bytes = (uint64_t[]){ 28 << 20, 48 << 20, 0 }[way] };
        brick_to("b.trip", p);
        test_same_dataset("a.trip", "b.trip");
    }
}

static void expect_same_file(const char *a, const char *b)
{
    char command[512];
    snprintf(command, sizeof command, "test -s '%s' && cmp -s '%s' '%s'", test_path(a),
             test_path(a), test_path(b));
    assert_int_equal(system(command), 0);
}

/* The default is levels for interpolation. Without the halo, the default is levels for splats.
 * A data set with both kinds of levels contains the same files. */
static void levels_for_one_use_have_only_its_kind(void **state)
{
    (void)state;
    make_bytes(11, 100);
    brick_to("both.trip", (trip_brick_params){ .levels = 2 });
    brick_to("pre.trip", (trip_brick_params){ .levels = 2, .levels_for = TRIP_LEVELS_FOR_PRE });
    brick_to("post.trip", (trip_brick_params){ .levels = 2, .levels_for = TRIP_LEVELS_FOR_POST });
    expect_same_file("both.trip/x1.means", "pre.trip/x1.means");
    expect_same_file("both.trip/y2.mean-normals", "pre.trip/y2.mean-normals");
    expect_same_file("both.trip/x1.values", "post.trip/x1.values");
    expect_same_file("both.trip/z2.values", "post.trip/z2.values");
    expect_same_file("both.trip/y1.deviations", "post.trip/y1.deviations");
    assert_false(test_exists("pre.trip/x1.deviations"));
    assert_false(test_exists("pre.trip/x1.values"));
    assert_false(test_exists("post.trip/x1.means"));
    check_data_set("pre.trip", 2, 3);
    check_data_set("post.trip", 2, 3);
    assert_true(trip_levels_kinds(TRIP_LEVELS_FOR_AUTO, true).values);
    assert_false(trip_levels_kinds(TRIP_LEVELS_FOR_AUTO, true).means);
}

static void levels_can_be_left_out_and_stop_at_one_voxel(void **state)
{
    (void)state;
    make_bytes(10, 100);
    trip_brick_summary s = brick_to("a.trip", (trip_brick_params){ .levels = -1 });
    assert_int_equal(s.levels, 0);
    assert_int_equal(s.level_bytes, 0);
    assert_false(test_exists("a.trip/x1.means"));
    s = brick_to("a.trip", (trip_brick_params){ .levels = 24 });
    assert_int_equal(s.levels, 9); /* 2^9 voxels are more than 300 */
    s = brick_to("a.trip", (trip_brick_params){ .no_halo = true });
    assert_int_equal(s.levels, 3); /* 300 voxels: 150, 75, 38 */
    assert_true(test_exists("a.trip/x1.means"));
    assert_false(test_exists("a.trip/x1.values"));
}

/* Every level of a slab of 4 voxels along z has the normals of its faces, with their length. Voxels
 * inside the slab have no normal and do not count. */
static void normals_of_a_slab_are_the_normals_of_its_faces(void **state)
{
    (void)state;
    for (int i = 0; i < N; i++)
        bytes[i] = i / NX / NY / 4 == 3 ? 255 : 0;
    test_write("v.raw", bytes, sizeof bytes);
    brick_to("a.trip", (trip_brick_params){ .normals = TRIP_NORMALS_FULL });
    trip_budget *budget;
    trip_dataset *d = open_data_set("a.trip", &budget);
    const trip_list *list = trip_dataset_find(d, 2, 1, TRIP_KIND_MEANS);
    assert_non_null(list);
    assert_int_equal(list->records, 2 * 150 * 35);
    uint32_t *normals = malloc(list->plane_bytes[1]);
    assert_int_equal(pread(list->plane_fd[1], normals, list->plane_bytes[1], 0),
                     list->plane_bytes[1]);
    for (uint64_t i = 0; i < list->records; i++) {
        double g[3];
        trip_normal_unpack(normals[i], d->header.gradient_full, g);
        assert_true(fabs(fabs(g[2]) - 127.5) < 2);
        assert_true(fabs(g[0]) < 1 && fabs(g[1]) < 1);
    }
    free(normals);
    trip_dataset_close(d);
    trip_budget_destroy(budget);
}

/* The slab has its z axis along x of world space. */
static void compact_normals_of_a_turned_slab_are_face_normals(void **state)
{
    (void)state;
    const char header[] = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 300 70 41\n"
                          "space dimension: 3\nspace directions: (0,1,0) (0,0,1) (1,0,0)\n"
                          "encoding: raw\ndata file: v.raw\n";
    for (int i = 0; i < N; i++)
        bytes[i] = i / NX / NY / 4 == 3 ? 100 : 0;
    test_write("v.raw", bytes, sizeof bytes);
    test_write("v.nhdr", header, sizeof header - 1);
    const trip_value_range shown = { 50, 255 };
    static char input[128], output[128];
    trip_brick_summary s;
    strcpy(input, test_path("v.nhdr"));
    strcpy(output, test_path("a.trip"));
    const trip_brick_params p = { .input = input,
                                  .output = output,
                                  .ranges = &shown,
                                  .range_count = 1,
                                  .levels_for = TRIP_LEVELS_FOR_BOTH,
                                  .levels = 1,
                                  .normals = TRIP_NORMALS_COMPACT };
    assert_int_equal(trip_brick(&p, &s), 0);
    trip_budget *budget;
    trip_dataset *d = open_data_set("a.trip", &budget);
    const trip_list *list = trip_dataset_find(d, 2, 1, TRIP_KIND_MEANS);
    const trip_compact_normals compact = trip_compact_normals_make(
        &d->index_to_world, d->header.gradient_full, d->header.gradient_step);
    assert_int_equal(d->header.normal_bytes, 3);
    assert_int_equal(list->records, 2 * 150 * 35);
    unsigned char *normals = malloc(list->plane_bytes[1]);
    assert_int_equal(pread(list->plane_fd[1], normals, list->plane_bytes[1], 0),
                     list->plane_bytes[1]);
    for (uint64_t i = 0; i < list->records; i++) {
        const unsigned char *n = normals + 3 * i;
        double g[3];
        trip_compact_normal_unpack(&compact, n[0] | (uint32_t)n[1] << 8 | (uint32_t)n[2] << 16, g);
        assert_true(fabs(g[0]) > 0.9 * fmin(50, compact.full));
        assert_true(fabs(g[1]) < 1 && fabs(g[2]) < 1);
    }
    free(normals);
    trip_dataset_close(d);
    trip_budget_destroy(budget);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(coarse_voxels_are_means_of_the_voxels_they_cover,
                                        test_begin, test_end),
        cmocka_unit_test_setup_teardown(voxels_added_around_kept_voxels_are_invisible, test_begin,
                                        test_end),
        cmocka_unit_test_setup_teardown(added_voxels_get_values_of_the_wider_side, test_begin,
                                        test_end),
        cmocka_unit_test_setup_teardown(sharpened_values_are_nearest_codes_within_range, test_begin,
                                        test_end),
        cmocka_unit_test_setup_teardown(deviations_of_ramps_and_stripes_have_closed_forms,
                                        test_begin, test_end),
        cmocka_unit_test_setup_teardown(labels_have_no_deviations, test_begin, test_end),
        cmocka_unit_test_setup_teardown(neighbours_are_added_at_any_position, test_begin, test_end),
        cmocka_unit_test_setup_teardown(no_voxel_is_added_if_all_values_are_kept, test_begin,
                                        test_end),
        cmocka_unit_test_setup_teardown(tiles_of_any_size_have_levels, test_begin, test_end),
        cmocka_unit_test_setup_teardown(memory_threads_and_slices_do_not_change_the_result,
                                        test_begin, test_end),
        cmocka_unit_test_setup_teardown(levels_for_one_use_have_only_its_kind, test_begin,
                                        test_end),
        cmocka_unit_test_setup_teardown(levels_can_be_left_out_and_stop_at_one_voxel, test_begin,
                                        test_end),
        cmocka_unit_test_setup_teardown(normals_of_a_slab_are_the_normals_of_its_faces, test_begin,
                                        test_end),
        cmocka_unit_test_setup_teardown(compact_normals_of_a_turned_slab_are_face_normals,
                                        test_begin, test_end),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
