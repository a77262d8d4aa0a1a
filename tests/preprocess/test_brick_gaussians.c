/* Tests bricking of Gaussian scenes and their streams: round trip, order, memory and faults. */
#include "test.h"

#include <signal.h>
#include <fcntl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>
#include <xxhash.h>

#include "brick_gaussians.h"
#include "dataset.h"
#include "gaussian_code.h"
#include "gaussian_set.h"
#include "gaussian_stream.h"
#include "scope.h"

#define NAME "brick_gaussians.trip"
#define OTHER "brick_gaussians_other.trip"

enum { MIB = 1 << 20 };

/* A scene made by numbers, so that no test holds it in memory. Splat i has x = TAG * p, with p a
 * permutation of the numbers. The other values are random. */
typedef struct scene {
    uint64_t count, next;
    int degree;
    double shift;     /* of all centres */
    uint64_t strays;  /* the first splats lie at +-2e7 */
    uint64_t fail_at; /* the source fails there; 0 means never */
    uint64_t cancel_at;
    trip_scope *scope;
    bool palette;   /* otherwise harmonics are stored whole */
    uint64_t alike; /* so many splats have the same harmonics; 0 means 1 */
    double step;    /* centres are multiples of it; 0 means any centres */
    unsigned threads;
} scene;

#define TAG 0.01

static double random_of(uint64_t *state)
{
    *state = *state * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (double)(*state >> 11) * 0x1p-53;
}

static uint64_t place_of(const scene *s, uint64_t i)
{
    return i * UINT64_C(7919) % s->count; /* the count is no multiple of the prime 7919 */
}

static trip_gaussian make_splat(const scene *s, uint64_t i)
{
    uint64_t state = i * 2654435761u + 12345;
    trip_gaussian g = { .opacity = 0 };
    double length = 0;
    for (int warm = 0; warm < 4; warm++)
        random_of(&state);
    g.centre[0] = TAG * (double)place_of(s, i) + s->shift;
    g.centre[1] = 100 * random_of(&state) + s->shift;
    g.centre[2] = 30 * random_of(&state) * random_of(&state) + s->shift;
    for (int a = 0; a < 3 && s->step > 0; a++)
        g.centre[a] = s->step * floor(g.centre[a] / s->step);
    for (int a = 0; a < 3; a++)
        g.deviations[a] = (float)exp(-6 + 5 * random_of(&state));
    if (i % 7 == 0)
        g.deviations[2] = 0;
    for (int k = 0; k < 4; k++) {
        g.rotation[k] = (float)(2 * random_of(&state) - 1);
        length += (double)g.rotation[k] * (double)g.rotation[k];
    }
    for (int k = 0; k < 4; k++)
        g.rotation[k] = (float)((double)g.rotation[k] / sqrt(length));
    g.opacity = (float)random_of(&state);
    if (s->alike)
        state = i / s->alike * 88172645463325252u + 1;
    for (int k = 0; k < trip_sh_count(s->degree); k++)
        for (int c = 0; c < 3; c++)
            g.sh[k][c] = (float)((2 * random_of(&state) - 1) * (k ? 0.3 : 1.7));
    if (i < s->strays)
        for (int a = 0; a < 3; a++)
            g.centre[a] = (i >> a & 1) ? 2e7 : -2e7;
    return g;
}

static int read_scene(void *user, trip_gaussian *out, size_t room, size_t *got)
{
    scene *s = user;
    *got = 0;
    if (s->cancel_at && s->next >= s->cancel_at)
        trip_scope_cancel(s->scope);
    if (s->fail_at && s->next >= s->fail_at)
        return trip_fail(TRIP_ERROR, "read", "scene", "ends early");
    while (*got < room && s->next < s->count)
        out[(*got)++] = make_splat(s, s->next++);
    return TRIP_OK;
}

static int brick(scene *s, const char *path, uint64_t memory, uint64_t *peak)
{
    trip_budget *budget;
    s->next = 0;
    assert_int_equal(trip_budget_create(&budget, memory), TRIP_OK);
    const int status = trip_brick_gaussians(
        &(trip_brick_gaussians_params){ .path = path,
                                        .replace = true,
                                        .source = read_scene,
                                        .source_user = s,
                                        .degree = s->degree,
                                        .harmonics = s->palette ? TRIP_BRICK_HARMONICS_PALETTE
                                                                : TRIP_BRICK_HARMONICS_WHOLE,
                                        .flags = TRIP_GAUSSIAN_Y_DOWN,
                                        .threads = s->threads,
                                        .text = "{\"source\": \"made by numbers\"}" },
        budget, NULL);
    if (peak)
        *peak = trip_budget_peak_bytes(budget);
    assert_int_equal(trip_budget_left_bytes(budget), trip_budget_limit_bytes(budget));
    trip_budget_destroy(budget);
    return status;
}

static trip_gaussian_set *open_set(const char *path, trip_budget **budget)
{
    trip_gaussian_set *set;
    assert_int_equal(trip_budget_create(budget, 512 * MIB), TRIP_OK);
    assert_int_equal(trip_gaussian_set_open(&set, path, *budget), TRIP_OK);
    return set;
}

static void close_set(trip_gaussian_set *set, trip_budget *budget)
{
    trip_gaussian_set_close(set);
    assert_int_equal(trip_budget_left_bytes(budget), trip_budget_limit_bytes(budget));
    trip_budget_destroy(budget);
}

static void rotate(const float q[4], double r[3][3])
{
    const double w = (double)q[0], x = (double)q[1], y = (double)q[2], z = (double)q[3];
    const double m[3][3] = {
        { w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y) },
        { 2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x) },
        { 2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z },
    };
    memcpy(r, m, sizeof m);
}

typedef struct errors {
    double centre, deviation, rotation, opacity, colour, harmonics, harmonics_square;
} errors;

static void worsen(double *worst, double error)
{
    *worst = fmax(*worst, fabs(error));
}

static void compare(const trip_gaussian *g, const trip_gaussian *wanted, int degree, errors *e)
{
    double r[3][3], w[3][3];
    rotate(g->rotation, r);
    rotate(wanted->rotation, w);
    for (int a = 0; a < 3; a++) {
        worsen(&e->centre, g->centre[a] - wanted->centre[a]);
        if (wanted->deviations[a] > 0)
            worsen(&e->deviation, (double)(g->deviations[a] / wanted->deviations[a]) - 1);
        else
            assert_true(g->deviations[a] == 0);
        for (int b = 0; b < 3; b++)
            worsen(&e->rotation, r[a][b] - w[a][b]);
        worsen(&e->colour, (double)(g->sh[0][a] - wanted->sh[0][a]));
        for (int k = 1; k < TRIP_SH_MAX; k++) {
            const double want = k < trip_sh_count(degree) ? (double)wanted->sh[k][a] : 0;
            worsen(&e->harmonics, (double)g->sh[k][a] - want);
            e->harmonics_square += ((double)g->sh[k][a] - want) * ((double)g->sh[k][a] - want);
        }
    }
    worsen(&e->opacity, (double)(g->opacity - wanted->opacity));
}

/* Streams a scene along an axis and compares each splat with the one that was put in. */
static errors stream_and_compare(const trip_gaussian_set *set, const scene *s, int axis,
                                 trip_budget *budget)
{
    enum { ROOM = 500 };
    static trip_gaussian batch[ROOM];
    trip_gaussian_stream_params p = { .axis = axis, .degree = 3 };
    trip_gaussian_stream *stream;
    errors e = { 0 };
    uint64_t *number_at = malloc(s->count * sizeof *number_at), seen = 0;
    unsigned char *found = calloc(s->count, 1);
    double before = -INFINITY, keys[ROOM];
    size_t got = 1;
    for (uint64_t i = 0; i < s->count; i++)
        number_at[place_of(s, i)] = i;
    p.key.direction[axis] = 1;
    assert_int_equal(trip_gaussian_stream_open(&stream, set, &p, budget), TRIP_OK);
    while (got > 0) {
        assert_int_equal(trip_gaussian_stream_next(stream, batch, keys, ROOM, &got), TRIP_OK);
        for (size_t i = 0; i < got; i++, seen++) {
            const double place = (batch[i].centre[0] - s->shift) / TAG;
            const uint64_t number = number_at[(uint64_t)(place + 0.5)];
            const trip_gaussian wanted = make_splat(s, number);
            assert_false(found[number]);
            found[number] = 1;
            assert_true(keys[i] >= before && keys[i] == batch[i].centre[axis]);
            before = keys[i];
            compare(&batch[i], &wanted, s->degree, &e);
        }
    }
    assert_int_equal(seen, s->count);
    trip_gaussian_stream_close(stream);
    free(number_at);
    free(found);
    return e;
}

static void a_scene_comes_back_within_the_stated_errors(void **state)
{
    (void)state;
    for (int degree = 0; degree <= 3; degree++) {
        scene s = { .count = 30000, .degree = degree };
        trip_budget *budget;
        assert_int_equal(brick(&s, NAME, 64 * MIB, NULL), TRIP_OK);
        trip_gaussian_set *set = open_set(NAME, &budget);
        assert_int_equal(set->header.records, s.count);
        assert_int_equal(set->header.degree, degree);
        assert_int_equal(set->header.flags, TRIP_GAUSSIAN_Y_DOWN);
        assert_string_equal(set->text, "{\"source\": \"made by numbers\"}");
        assert_int_equal(trip_gaussian_set_verify(set, budget), TRIP_OK);
        for (int axis = 0; axis < 3; axis++) {
            const errors e = stream_and_compare(set, &s, axis, budget);
            assert_true(e.centre <= 300 / 2097151.0 / 2 * 1.0001);
            assert_true(e.deviation <= 5.01 / 4094 / 2 * 1.001 + 1e-6);
            assert_true(e.rotation <= 1.5e-3);
            assert_true(e.opacity <= 0.5 / 4095 + 1e-7);
            assert_true(e.colour <= 3.4 / 16383 / 2 + 1e-6);
            assert_true(e.harmonics <= 0.3 / 254 + 1e-6);
        }
        close_set(set, budget);
    }
}

static void a_palette_with_an_entry_for_each_splat_is_exact(void **state)
{
    (void)state;
    for (int degree = 1; degree <= 3; degree++) {
        scene s = { .count = 30000, .degree = degree, .palette = true };
        trip_budget *budget;
        assert_int_equal(brick(&s, NAME, 128 * MIB, NULL), TRIP_OK);
        trip_gaussian_set *set = open_set(NAME, &budget);
        assert_int_equal(set->header.flags, TRIP_GAUSSIAN_Y_DOWN | TRIP_GAUSSIAN_PALETTE);
        assert_int_equal(set->header.palette_count, set->header.list_records);
        assert_int_equal(trip_gaussian_set_verify(set, budget), TRIP_OK);
        for (int axis = 0; axis < 3; axis++) {
            const errors e = stream_and_compare(set, &s, axis, budget);
            assert_true(e.colour <= 3.4 / 16383 / 2 + 1e-6);
            assert_true(e.harmonics <= 0.3 / 254 + 1e-6);
        }
        close_set(set, budget);
    }
}

/* 100000 splats have 1000 different sets of coefficients. Coarse splats have others. */
static void a_palette_finds_the_sets_that_splats_share(void **state)
{
    (void)state;
    scene s = { .count = 100000, .degree = 2, .palette = true, .alike = 100 };
    trip_budget *budget;
    assert_int_equal(brick(&s, NAME, 128 * MIB, NULL), TRIP_OK);
    trip_gaussian_set *set = open_set(NAME, &budget);
    assert_in_range(set->header.palette_count, 1000, 1000 + set->header.list_records - s.count);
    assert_int_equal(set->bytes - 24 * 3 * set->header.list_records <
                         2 * 3 * set->header.list_records + (UINT64_C(5) << 20),
                     true);
    const errors e = stream_and_compare(set, &s, 1, budget);
    assert_true(e.harmonics <= 0.3 / 254 + 1e-6);
    close_set(set, budget);
}

static void large_coordinates_keep_millimetres(void **state)
{
    (void)state;
    scene s = { .count = 30000, .shift = 5.5e6 };
    trip_budget *budget;
    assert_int_equal(brick(&s, NAME, 64 * MIB, NULL), TRIP_OK);
    trip_gaussian_set *set = open_set(NAME, &budget);
    assert_true(stream_and_compare(set, &s, 1, budget).centre < 1e-4);
    close_set(set, budget);
}

typedef struct decoded {
    double key;
    uint64_t position;
    trip_gaussian splat;
} decoded;

static int compare_decoded(const void *a, const void *b)
{
    const decoded *x = a, *y = b;
    if (x->key != y->key)
        return x->key < y->key ? -1 : 1;
    return x->position < y->position ? -1 : x->position > y->position;
}

static bool is_coarse(const trip_gaussian_set *set, int axis, uint64_t brick)
{
    const trip_file_gaussian_node *n = set->nodes;
    while (brick >= n->first_brick[axis] + n->brick_count[axis])
        n++;
    return n->nodes > 1;
}

/* Reads the Gaussians of the scene from a whole list by its bricks, and sorts them. */
static decoded *sort_whole(const trip_gaussian_set *set, const trip_gaussian_stream_params *p)
{
    static unsigned char records[TRIP_GAUSSIAN_BRICK_RECORDS_MAX * TRIP_GAUSSIAN_RECORD_BYTES];
    const trip_gaussian_list *list = &set->lists[p->axis];
    decoded *all = malloc(set->header.records * sizeof *all), *to = all;
    for (uint64_t i = 0; i < list->brick_count; i++) {
        const trip_file_gaussian_brick *b = &list->bricks[i];
        if (is_coarse(set, p->axis, i))
            continue;
        assert_int_equal(trip_gaussian_set_read(set, p->axis, i, 0, records), TRIP_OK);
        for (uint32_t j = 0; j < b->records; j++, to++) {
            trip_gaussian_decode(b, records + (size_t)j * TRIP_GAUSSIAN_RECORD_BYTES, NULL, 0,
                                 &to->splat);
            to->key = trip_gaussian_key_of(&p->key, to->splat.centre);
            to->position = b->first_record + j;
        }
    }
    qsort(all, set->header.records, sizeof *all, compare_decoded);
    return all;
}

static void check_order(const trip_gaussian_set *set, int axis, const double direction[3],
                        size_t room, trip_budget *budget)
{
    trip_gaussian_stream_params p = {
        .axis = axis,
        .key = { .direction = { direction[0], direction[1], direction[2] }, .offset = -17 }
    };
    decoded *all = sort_whole(set, &p);
    trip_gaussian *batch = malloc(room * sizeof *batch);
    double *keys = malloc(room * sizeof *keys);
    trip_gaussian_stream *stream;
    uint64_t at = 0;
    assert_int_equal(trip_gaussian_stream_open(&stream, set, &p, budget), TRIP_OK);
    for (size_t got = 1; got > 0;) {
        assert_int_equal(trip_gaussian_stream_next(stream, batch, keys, room, &got), TRIP_OK);
        for (size_t i = 0; i < got; i++, at++) {
            assert_true(at < set->header.records && keys[i] == all[at].key);
            assert_memory_equal(&batch[i], &all[at].splat, sizeof batch[i]);
        }
    }
    assert_int_equal(at, set->header.records);
    trip_gaussian_stream_close(stream);
    free(keys);
    free(batch);
    free(all);
}

static void streams_deliver_in_exact_order_in_any_direction(void **state)
{
    (void)state;
    static const double directions[][3] = { { 1, 0, 0 },       { 0, -1, 0 },   { 0, 0, 1 },
                                            { 0.6, 0, -0.8 },  { -1, -2, -3 }, { 1e-9, 1, 1e-9 },
                                            { 0.3, 0.3, 0.9 }, { 0, 0, 0 } };
    scene s = { .count = 50000, .strays = 8 };
    trip_budget *budget;
    assert_int_equal(brick(&s, NAME, 64 * MIB, NULL), TRIP_OK);
    trip_gaussian_set *set = open_set(NAME, &budget);
    for (size_t i = 0; i < sizeof directions / sizeof *directions; i++)
        check_order(set, (int)(i % 3), directions[i], i % 2 ? 1 : 4097, budget);
    close_set(set, budget);
}

static void all_splats_at_one_place_keep_their_order(void **state)
{
    (void)state;
    const double direction[3] = { 1, 1, 1 };
    scene s = { .count = 20000, .strays = 20000 }; /* at 8 places */
    trip_budget *budget;
    assert_int_equal(brick(&s, NAME, 64 * MIB, NULL), TRIP_OK);
    trip_gaussian_set *set = open_set(NAME, &budget);
    check_order(set, 2, direction, 100, budget);
    close_set(set, budget);
}

static void a_stream_takes_the_memory_that_its_plan_tells(void **state)
{
    (void)state;
    scene s = { .count = 100000 };
    trip_budget *budget, *exact;
    assert_int_equal(brick(&s, NAME, 64 * MIB, NULL), TRIP_OK);
    trip_gaussian_set *set = open_set(NAME, &budget);
    const trip_gaussian_stream_params p = { .key = { .direction = { 0.7, 0.1, 0.7 } } };
    trip_gaussian_plan plan;
    trip_gaussian_stream *stream;
    assert_int_equal(trip_gaussian_stream_plan(set, &p, budget, &plan), TRIP_OK);
    assert_int_equal(plan.records, s.count);
    assert_int_equal(plan.read_bytes, 24 * s.count);
    assert_true(plan.window_records < s.count);
    assert_int_equal(trip_budget_create(&exact, plan.bytes), TRIP_OK);
    assert_int_equal(trip_gaussian_stream_open(&stream, set, &p, exact), TRIP_OK);
    assert_int_equal(trip_budget_left_bytes(exact), 0);
    trip_gaussian_stream_close(stream);
    trip_budget_destroy(exact);
    assert_int_equal(trip_budget_create(&exact, plan.bytes - 4096), TRIP_OK);
    test_catch_reports();
    assert_int_equal(trip_gaussian_stream_open(&stream, set, &p, exact), TRIP_ERROR);
    assert_non_null(strstr(test_last_report, "raise --memory"));
    trip_report_redirect(NULL, NULL);
    trip_budget_destroy(exact);
    close_set(set, budget);
}

static unsigned char *read_file(const char *folder, const char *name, size_t *bytes)
{
    char path[256];
    struct stat st;
    snprintf(path, sizeof path, "%s/%s", folder, name);
    const int fd = open(path, O_RDONLY);
    assert_true(fd >= 0 && fstat(fd, &st) == 0);
    unsigned char *data = malloc((size_t)st.st_size + 1);
    *bytes = (size_t)st.st_size;
    assert_int_equal(read(fd, data, *bytes), *bytes);
    close(fd);
    return data;
}

static const char *const files[] = { "index.trip",   "x.gaussians",  "y.gaussians", "z.gaussians",
                                     "x.harmonics1", "y.harmonics1", "z.harmonics1" };

static void assert_same_files(const char *a, const char *b, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        size_t bytes, other;
        unsigned char *x = read_file(a, files[i], &bytes), *y = read_file(b, files[i], &other);
        assert_int_equal(bytes, other);
        assert_memory_equal(x, y, bytes);
        free(x);
        free(y);
    }
}

static void little_memory_suffices_and_gives_the_same_bytes(void **state)
{
    (void)state;
    scene s = { .count = 400000 };
    uint64_t peak;
    /* So little memory needs several passes of merging. */
    assert_int_equal(brick(&s, NAME, 3 * MIB, &peak), TRIP_OK);
    assert_true(peak <= 3 * MIB);
    assert_int_equal(brick(&s, OTHER, 400 * MIB, NULL), TRIP_OK);
    assert_same_files(NAME, OTHER, 4);
    s = (scene){ .count = 150000, .degree = 1 };
    assert_int_equal(brick(&s, NAME, 3 * MIB, &peak), TRIP_OK);
    assert_true(peak <= 3 * MIB);
    assert_int_equal(brick(&s, OTHER, 30 * MIB, NULL), TRIP_OK);
    assert_same_files(NAME, OTHER, 7);
    s = (scene){ .count = 100000, .degree = 1, .palette = true };
    assert_int_equal(brick(&s, NAME, 14 * MIB, &peak), TRIP_OK);
    assert_true(peak <= 14 * MIB);
    assert_int_equal(brick(&s, OTHER, 100 * MIB, NULL), TRIP_OK);
    assert_same_files(NAME, OTHER, 4);
}

static void threads_and_equal_centres_do_not_change_the_bytes(void **state)
{
    (void)state;
    static const struct {
        uint64_t memory;
        unsigned threads;
    } others[] = {
        { 4 * MIB, 1 }, { 20 * MIB, 2 }, { 40 * MIB, 3 }, { 40 * MIB, 200 }, { 400 * MIB, 5 }
    };
    scene s = { .count = 80000, .degree = 1, .strays = 8, .step = 2, .threads = 1 };
    assert_int_equal(brick(&s, OTHER, 400 * MIB, NULL), TRIP_OK);
    for (size_t i = 0; i < sizeof others / sizeof *others; i++) {
        uint64_t peak;
        s.threads = others[i].threads;
        assert_int_equal(brick(&s, NAME, others[i].memory, &peak), TRIP_OK);
        assert_true(peak <= others[i].memory);
        assert_same_files(NAME, OTHER, 7);
    }
}

/* A sample of 4 million points or fewer fits into memory. Each stride of numbers has one point. */
static void samples_of_any_scene_fit_into_memory(void **state)
{
    static const struct {
        uint64_t records, stride;
    } cases[] = { { 1 << 20, 64 },
                  { UINT64_C(1) << 28, 64 },
                  { UINT64_C(1000000000), 239 },
                  { UINT64_C(1) << 40, 1 << 18 } };
    (void)state;
    for (size_t c = 0; c < sizeof cases / sizeof *cases; c++) {
        const uint64_t stride = cases[c].stride, first = cases[c].records / 2 / stride * stride;
        assert_true(trip_gaussian_sample_room(cases[c].records) <= (1 << 22) + 1);
        for (uint64_t block = 0; block < 8; block++) {
            unsigned sampled = 0;
            for (uint64_t i = 0; i < stride; i++)
                sampled +=
                    trip_gaussian_is_sampled(first + block * stride + i, cases[c].records) != 0;
            assert_int_equal(sampled, 1);
        }
    }
}

static void strays_do_no_harm(void **state)
{
    (void)state;
    scene s = { .count = 50000, .strays = 16 };
    trip_budget *budget;
    assert_int_equal(brick(&s, NAME, 64 * MIB, NULL), TRIP_OK);
    trip_gaussian_set *set = open_set(NAME, &budget);
    for (int axis = 0; axis < 3; axis++) {
        uint64_t stray = 0;
        for (uint64_t i = 0; i < set->lists[axis].brick_count; i++) {
            const trip_file_gaussian_brick *b = &set->lists[axis].bricks[i];
            if (is_coarse(set, axis, i))
                continue;
            if (fabs(b->centre_lo[0]) > 1e7)
                stray += b->records;
            for (int a = 0; a < 3; a++)
                assert_true(b->centre_hi[a] - b->centre_lo[a] < 600);
        }
        assert_int_equal(stray, 16);
    }
    for (int a = 0; a < 3; a++)
        assert_true(set->header.typical_lo[a] > -1 && set->header.typical_hi[a] < 501);
    close_set(set, budget);
}

static void bricks_are_compact_and_full(void **state)
{
    (void)state;
    scene s = { .count = 400000 };
    trip_budget *budget;
    assert_int_equal(brick(&s, NAME, 64 * MIB, NULL), TRIP_OK);
    trip_gaussian_set *set = open_set(NAME, &budget);
    for (int axis = 0; axis < 3; axis++) {
        const trip_gaussian_list *l = &set->lists[axis];
        double volume = 0;
        int classes = 1;
        uint64_t bricks = 0;
        for (uint64_t i = 0; i < l->brick_count; i++) {
            double own = 1;
            if (is_coarse(set, axis, i))
                continue;
            bricks++;
            classes += i && l->bricks[i].size_class != l->bricks[i - 1].size_class;
            for (int a = 0; a < 3; a++)
                own *= (l->bricks[i].centre_hi[a] - l->bricks[i].centre_lo[a]) /
                       (set->header.centre_hi[a] - set->header.centre_lo[a]);
            volume += own;
        }
        /* Each node has a brick of each class at least. */
        assert_in_range(bricks, 98, 220);
        assert_true(classes <= 6 * (int)set->header.node_count);
        /* Each class fills the scene's box at most once. */
        assert_true(volume < 6);
    }
    close_set(set, budget);
}

static void splats_that_reach_into_a_view_are_not_left_out(void **state)
{
    (void)state;
    scene s = { .count = 100000 };
    trip_budget *budget;
    assert_int_equal(brick(&s, NAME, 64 * MIB, NULL), TRIP_OK);
    trip_gaussian_set *set = open_set(NAME, &budget);
    const trip_gaussian_view view = { .eye = { 100, 50, -40 },
                                      .right = { 0.8, 0, -0.6 },
                                      .down = { 0, 1, 0 },
                                      .forward = { 0.6, 0, 0.8 },
                                      .half_width = 0.3,
                                      .half_height = 0.2,
                                      .width_px = 300,
                                      .height_px = 200 };
    trip_gaussian_plane planes[TRIP_GAUSSIAN_SIDES];
    trip_gaussian_stream_params p = { .key = { .direction = { 0.6, 0, 0.8 },
                                               .offset = -0.6 * 100 + 0.8 * 40 },
                                      .key_min = 0.2,
                                      .key_max = 1e30,
                                      .planes = planes,
                                      .plane_count = TRIP_GAUSSIAN_SIDES };
    trip_gaussian_view_planes(&view, planes);
    trip_gaussian_stream *stream;
    trip_gaussian g;
    size_t got = 1;
    uint64_t visible = 0, wanted = 0;
    assert_int_equal(trip_gaussian_stream_open(&stream, set, &p, budget), TRIP_OK);
    assert_true(trip_gaussian_stream_planned(stream)->records < s.count * 3 / 4);
    /* A splat is visible if its projected ellipse of 3.33 deviations reaches into the picture. */
    for (uint64_t i = 0; i < 2; i++) {
        for (uint64_t n = 0; i == 0 ? got > 0 : n < s.count; n++) {
            double d[3], q[3], r[3][3], extent[2] = { 0 };
            if (i == 0)
                assert_int_equal(trip_gaussian_stream_next(stream, &g, NULL, 1, &got), TRIP_OK);
            else
                g = make_splat(&s, n);
            for (int a = 0; a < 3; a++)
                d[a] = g.centre[a] - view.eye[a];
            q[0] = 0.8 * d[0] - 0.6 * d[2], q[1] = d[1], q[2] = 0.6 * d[0] + 0.8 * d[2];
            if ((i == 0 && !got) || q[2] < 0.2)
                continue;
            rotate(g.rotation, r);
            const double tx = fmin(fmax(q[0] / q[2], -0.39), 0.39);
            const double ty = fmin(fmax(q[1] / q[2], -0.26), 0.26);
            for (int k = 0; k < 3; k++) {
                const double x = 0.8 * r[0][k] - 0.6 * r[2][k], y = r[1][k],
                             z = 0.6 * r[0][k] + 0.8 * r[2][k];
                extent[0] += pow((double)g.deviations[k] * 500 / q[2] * (x - tx * z), 2);
                extent[1] += pow((double)g.deviations[k] * 500 / q[2] * (y - ty * z), 2);
            }
            if (fabs(q[0] / q[2]) * 500 - 3.33 * sqrt(extent[0] + 0.3) < 150 &&
                fabs(q[1] / q[2]) * 500 - 3.33 * sqrt(extent[1] + 0.3) < 100)
                ++*(i == 0 ? &visible : &wanted);
        }
    }
    assert_true(wanted > 1000);
    /* Rounding of the codes may move a few across the border. */
    assert_in_range(visible, wanted - wanted / 500, wanted + wanted / 500);
    trip_gaussian_stream_close(stream);
    close_set(set, budget);
}

static bool is_there(const char *name)
{
    struct stat st;
    return lstat(name, &st) == 0;
}

static void failures_leave_nothing_behind(void **state)
{
    (void)state;
    trip_scope scope = { .around = NULL }, *before;
    scene s = { .count = 60000, .fail_at = 40000 };
    test_catch_reports();
    assert_int_equal(brick(&s, "brick_gaussians_left.trip", 64 * MIB, NULL), TRIP_ERROR);
    s = (scene){ .count = 0 };
    assert_int_equal(brick(&s, "brick_gaussians_left.trip", 64 * MIB, NULL), TRIP_ERROR);
    assert_non_null(strstr(test_last_report, "contains no Gaussian"));
    s = (scene){ .count = 60000 };
    assert_int_equal(brick(&s, "brick_gaussians_left.trip", MIB / 2, NULL), TRIP_ERROR);
    assert_non_null(strstr(test_last_report, "raise --memory"));
    trip_report_redirect(NULL, NULL);
    scope.sink = trip_report_discard;
    s = (scene){ .count = 60000, .cancel_at = 30000, .scope = &scope };
    before = trip_scope_enter(&scope);
    assert_int_equal(brick(&s, "brick_gaussians_left.trip", 64 * MIB, NULL), TRIP_INTERRUPTED);
    trip_scope_enter(before);
    assert_false(is_there("brick_gaussians_left.trip"));
    assert_false(is_there("brick_gaussians_left.trip.partial"));
}

static void a_full_disk_leaves_nothing_behind(void **state)
{
    (void)state;
    struct rlimit old, small;
    scene s = { .count = 60000 };
    assert_int_equal(getrlimit(RLIMIT_FSIZE, &old), 0);
    small = old;
    signal(SIGXFSZ, SIG_IGN);
    test_catch_reports();
    /* The first limit stops the spool, the second stops a list. */
    for (int i = 0; i < 2; i++) {
        small.rlim_cur = i ? 60000 * 23 : 1 << 20;
        if (i)
            s.count = 60000;
        assert_int_equal(setrlimit(RLIMIT_FSIZE, &small), 0);
        assert_int_equal(brick(&s, "brick_gaussians_left.trip", 64 * MIB, NULL), TRIP_ERROR);
        assert_int_equal(setrlimit(RLIMIT_FSIZE, &old), 0);
        assert_non_null(strstr(test_last_report, "write"));
    }
    trip_report_redirect(NULL, NULL);
    assert_false(is_there("brick_gaussians_left.trip"));
    assert_false(is_there("brick_gaussians_left.trip.partial"));
}

static void write_file(const char *name, const unsigned char *data, size_t bytes)
{
    char path[256];
    snprintf(path, sizeof path, NAME "/%s", name);
    const int fd = open(path, O_WRONLY | O_TRUNC);
    assert_true(fd >= 0);
    assert_int_equal(write(fd, data, bytes), bytes);
    close(fd);
}

static int open_and_verify(void)
{
    trip_budget *budget;
    trip_gaussian_set *set;
    assert_int_equal(trip_budget_create(&budget, 64 * MIB), TRIP_OK);
    int status = trip_gaussian_set_open(&set, NAME, budget);
    if (status == TRIP_OK)
        status = trip_gaussian_set_verify(set, budget);
    trip_gaussian_set_close(set);
    assert_int_equal(trip_budget_left_bytes(budget), 64 * MIB);
    trip_budget_destroy(budget);
    return status;
}

static void every_damaged_byte_is_reported_in_one_line(void **state)
{
    (void)state;
    scene s = { .count = 300, .degree = 1 };
    assert_int_equal(brick(&s, NAME, 64 * MIB, NULL), TRIP_OK);
    test_catch_reports();
    for (size_t i = 0; i < sizeof files / sizeof *files; i++) {
        size_t bytes;
        unsigned char *data = read_file(NAME, files[i], &bytes);
        for (size_t at = 0; at < bytes; at += i ? 97 : 1) {
            data[at] ^= 16;
            write_file(files[i], data, bytes);
            data[at] ^= 16;
            test_report_count = 0;
            assert_int_equal(open_and_verify(), TRIP_ERROR);
            assert_int_equal(test_report_count, 1);
        }
        write_file(files[i], data, bytes / 2);
        test_report_count = 0;
        assert_int_equal(open_and_verify(), TRIP_ERROR);
        assert_int_equal(test_report_count, 1);
        write_file(files[i], data, bytes);
        free(data);
    }
    trip_report_redirect(NULL, NULL);
    assert_int_equal(open_and_verify(), TRIP_OK);
}

/* Writes an index with a changed field and valid checksums. */
static void write_changed(const unsigned char *index, size_t bytes, size_t at, const void *value,
                          size_t size)
{
    unsigned char *copy = malloc(bytes);
    trip_file_gaussian_header *h = (void *)copy;
    memcpy(copy, index, bytes);
    memcpy(copy + at, value, size);
    h->tables_checksum = XXH64(copy + sizeof *h, bytes - sizeof *h, 0);
    h->header_checksum = 0;
    h->header_checksum = XXH64(h, sizeof *h, 0);
    write_file("index.trip", copy, bytes);
    free(copy);
}

#define HEADER(field) offsetof(trip_file_gaussian_header, field)
#define NODE(field) (sizeof(trip_file_gaussian_header) + offsetof(trip_file_gaussian_node, field))
#define BRICK(field)                                                                               \
    (sizeof(trip_file_gaussian_header) + sizeof(trip_file_gaussian_node) +                         \
     offsetof(trip_file_gaussian_brick, field))

static void a_false_index_with_valid_checksums_is_refused(void **state)
{
    (void)state;
    const uint32_t four = 4, eight = 8, unknown = 1 << 10, two_up = 4 + 16, none = 0, many = 7000;
    const uint64_t huge = UINT64_C(1) << 60, wrong = 5, zero = 0;
    const double nan_double = NAN, far = 1e17, low = -1e9;
    const float nan_float = NAN, large = 1e31f, two = 2, hot = 80;
    const int32_t top_class = 100;
    const uint8_t one = 1;
    const struct {
        size_t at;
        const void *value;
        size_t size;
        const char *part;
    } changes[] = {
        { HEADER(version), &four, 4, "format version 4 of Gaussian scenes is not supported" },
        { HEADER(header_bytes), &four, 4, "wrong header size" },
        { HEADER(index_bytes), &wrong, 8, "instead of the 5 in its header" },
        { HEADER(records), &wrong, 8, "another number of records" },
        { HEADER(degree), &four, 4, "above 3" },
        { HEADER(flags), &unknown, 4, "unknown flags" },
        { HEADER(flags), &two_up, 4, "two axes point up" },
        { HEADER(flags), &eight, 4, "entries of the palette" },
        { HEADER(palette_count), &wrong, 8, "entries of the palette" },
        { HEADER(palette_offset), &wrong, 8, "palette has a wrong offset" },
        { HEADER(brick_count), &huge, 8, "does not fit the file" },
        { HEADER(bricks_offset), &huge, 8, "wrong offset" },
        { HEADER(text_offset), &huge, 8, "text has a wrong offset" },
        { HEADER(text_bytes), &huge, 8, "text has a wrong offset" },
        { HEADER(centre_lo), &nan_double, 8, "bounds of the centres" },
        { HEADER(reach_hi), &far, 8, "bounds of the ellipsoids" },
        { HEADER(typical_lo), &low, 8, "typical bounds" },
        { HEADER(reserved), &one, 1, "reserved bytes" },
        { HEADER(list_records), &wrong, 8, "another number of records" },
        { HEADER(node_count), &huge, 8, "number of nodes does not fit" },
        { HEADER(nodes_offset), &huge, 8, "nodes begin at a wrong offset" },
        { NODE(lo), &nan_double, 8, "bounds of a node are invalid" },
        { NODE(hi), &low, 8, "bounds of a node are invalid" },
        { NODE(width), &far, 8, "width of a node" },
        { NODE(nodes), &wrong, 8, "beyond the node around it" },
        { NODE(nodes), &zero, 8, "beyond the node around it" },
        { NODE(first_brick), &wrong, 8, "do not follow the node before" },
        { NODE(brick_count), &none, 4, "do not follow the node before" },
        { NODE(brick_count), &many, 4, "do not follow the node before" },
        { NODE(level), &four, 4, "level of a node" },
        { BRICK(records), &none, 4, "outside 1 to 6144" },
        { BRICK(records), &many, 4, "outside 1 to 6144" },
        { BRICK(centre_lo), &nan_double, 8, "brick's centres" },
        { BRICK(centre_lo), &low, 8, "brick's centres" },
        { BRICK(reach_lo), &low, 8, "brick's ellipsoids" },
        { BRICK(first_record), &wrong, 8, "does not follow the brick before" },
        { BRICK(size_class), &top_class, 4, "order of their classes" },
        { BRICK(log_lo), &nan_float, 4, "brick's deviations" },
        { BRICK(log_hi), &hot, 4, "brick's deviations" },
        { BRICK(colour_hi), &large, 4, "brick's colours" },
        { BRICK(scale), &large, 4, "spherical harmonics" },
        { BRICK(scale) + 4, &two, 4, "spherical harmonics" },
        { BRICK(opacity_max), &two, 4, "largest opacity" },
        { BRICK(checksums) + 24, &wrong, 8, "file that is absent" },
    };
    scene s = { .count = 4000, .degree = 1 }; /* several classes */
    size_t bytes;
    assert_int_equal(brick(&s, NAME, 64 * MIB, NULL), TRIP_OK);
    unsigned char *index = read_file(NAME, "index.trip", &bytes);
    write_changed(index, bytes, HEADER(magic), TRIP_GAUSSIAN_MAGIC, 8);
    assert_int_equal(open_and_verify(), TRIP_OK);
    for (size_t i = 0; i < sizeof changes / sizeof *changes; i++) {
        write_changed(index, bytes, changes[i].at, changes[i].value, changes[i].size);
        test_catch_reports();
        assert_int_equal(open_and_verify(), TRIP_ERROR);
        assert_one_report(changes[i].part);
    }
    free(index);
}

/* Gives splats with one wrong value each, and a good one. */
static int read_wrong(void *user, trip_gaussian *out, size_t room, size_t *got)
{
    unsigned *next = user;
    *got = 0;
    for (; *next < 7 && *got < room; ++*next) {
        trip_gaussian *g = &out[(*got)++];
        *g = (trip_gaussian){ .deviations = { 1, 2, 3 }, .rotation = { 0, 0, 5, 0 }, .opacity = 7 };
        if (*next == 0)
            g->centre[1] = NAN;
        if (*next == 1)
            g->deviations[2] = -1;
        if (*next == 2)
            g->deviations[0] = INFINITY;
        if (*next == 3)
            g->rotation[2] = 0;
        if (*next == 4)
            g->opacity = NAN;
        if (*next == 5)
            g->sh[0][2] = -INFINITY;
    }
    return TRIP_OK;
}

static void splats_that_are_not_finite_are_left_out_with_a_warning(void **state)
{
    (void)state;
    unsigned next = 0;
    trip_budget *budget;
    trip_brick_gaussians_result result;
    trip_gaussian_stream *stream;
    trip_gaussian g;
    size_t got;
    assert_int_equal(trip_budget_create(&budget, 64 * MIB), TRIP_OK);
    test_catch_reports();
    assert_int_equal(trip_brick_gaussians(&(trip_brick_gaussians_params){ .path = NAME,
                                                                          .replace = true,
                                                                          .source = read_wrong,
                                                                          .source_user = &next },
                                          budget, &result),
                     TRIP_OK);
    assert_one_report("6 of 7 Gaussians have a value that is not finite");
    assert_int_equal(result.records, 1);
    assert_int_equal(result.dropped, 6);
    trip_budget_destroy(budget);
    trip_gaussian_set *set = open_set(NAME, &budget);
    assert_int_equal(
        trip_gaussian_stream_open(&stream, set, &(trip_gaussian_stream_params){ 0 }, budget),
        TRIP_OK);
    assert_int_equal(trip_gaussian_stream_next(stream, &g, NULL, 1, &got), TRIP_OK);
    assert_int_equal(got, 1);
    assert_true(g.opacity == 1 && g.rotation[2] == 1 && g.rotation[0] == 0);
    trip_gaussian_stream_close(stream);
    close_set(set, budget);
}

static void an_existing_data_set_is_replaced_only_when_asked(void **state)
{
    (void)state;
    scene s = { .count = 10 };
    trip_budget *budget;
    assert_int_equal(brick(&s, NAME, 64 * MIB, NULL), TRIP_OK);
    assert_int_equal(trip_budget_create(&budget, 64 * MIB), TRIP_OK);
    s.next = 0;
    test_catch_reports();
    assert_int_equal(
        trip_brick_gaussians(
            &(trip_brick_gaussians_params){ .path = NAME, .source = read_scene, .source_user = &s },
            budget, NULL),
        TRIP_ERROR);
    assert_one_report("exists already");
    trip_budget_destroy(budget);
}

static void a_scene_is_not_a_volume(void **state)
{
    (void)state;
    scene s = { .count = 10 };
    trip_budget *budget;
    trip_dataset *volume;
    assert_int_equal(brick(&s, NAME, 64 * MIB, NULL), TRIP_OK);
    assert_true(trip_gaussian_set_is(NAME));
    assert_false(trip_gaussian_set_is("nowhere.trip"));
    assert_int_equal(trip_budget_create(&budget, 64 * MIB), TRIP_OK);
    test_catch_reports();
    assert_int_equal(trip_dataset_open(&volume, NAME, budget), TRIP_ERROR);
    assert_non_null(strstr(test_last_report, "Gaussian scene, where a volume is needed"));
    trip_report_redirect(NULL, NULL);
    trip_budget_destroy(budget);
}

static int remove_data_sets(void **state)
{
    (void)state;
    return system("rm -rf " NAME " " OTHER);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_scene_comes_back_within_the_stated_errors),
        cmocka_unit_test(a_palette_with_an_entry_for_each_splat_is_exact),
        cmocka_unit_test(a_palette_finds_the_sets_that_splats_share),
        cmocka_unit_test(large_coordinates_keep_millimetres),
        cmocka_unit_test(streams_deliver_in_exact_order_in_any_direction),
        cmocka_unit_test(all_splats_at_one_place_keep_their_order),
        cmocka_unit_test(a_stream_takes_the_memory_that_its_plan_tells),
        cmocka_unit_test(little_memory_suffices_and_gives_the_same_bytes),
        cmocka_unit_test(threads_and_equal_centres_do_not_change_the_bytes),
        cmocka_unit_test(samples_of_any_scene_fit_into_memory),
        cmocka_unit_test(strays_do_no_harm),
        cmocka_unit_test(bricks_are_compact_and_full),
        cmocka_unit_test(splats_that_reach_into_a_view_are_not_left_out),
        cmocka_unit_test(failures_leave_nothing_behind),
        cmocka_unit_test(a_full_disk_leaves_nothing_behind),
        cmocka_unit_test(every_damaged_byte_is_reported_in_one_line),
        cmocka_unit_test(a_false_index_with_valid_checksums_is_refused),
        cmocka_unit_test(splats_that_are_not_finite_are_left_out_with_a_warning),
        cmocka_unit_test(an_existing_data_set_is_replaced_only_when_asked),
        cmocka_unit_test(a_scene_is_not_a_volume),
    };
    return cmocka_run_group_tests(tests, NULL, remove_data_sets);
}
