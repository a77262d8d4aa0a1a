/* The buffer between the threads that project and the threads that blend. Checks which splats it
 * keeps when it is full, whatever the order of arrival, and the order in which panes get their
 * splats back. */
#include "cpu/splat_buffer.h"
#include "cpu/cpu_scalar.h"
#include "test.h"

#include <stdlib.h>
#include <string.h>

enum { ACROSS = 4, PANES = ACROSS * ACROSS, CAPACITY = 2 * TRIP_CPU_CHUNK };

typedef struct fixture {
    trip_budget *budget;
    trip_cpu_buffer buffer;
    uint32_t counts[PANES + ACROSS + 2];
    trip_cpu_sorting sorting;
    _Atomic uint64_t open[PANES];
    trip_cpu_mask mask;
} fixture;

static int set_up(void **state)
{
    fixture *f = calloc(1, sizeof *f);
    assert_non_null(f);
    assert_int_equal(trip_budget_create(&f->budget, UINT64_C(1) << 24), 0);
    assert_int_equal(trip_cpu_buffer_create(&f->buffer, CAPACITY, f->budget), 0);
    assert_int_equal(trip_cpu_buffer_fit(&f->buffer, PANES, false, f->budget), 0);
    trip_cpu_buffer_empty(&f->buffer);
    f->sorting.counts = f->counts;
    f->mask = (trip_cpu_mask){ { ACROSS, ACROSS, 0 }, f->open };
    for (int i = 0; i < PANES; i++)
        f->open[i] = UINT64_MAX;
    *state = f;
    return 0;
}

static int tear_down(void **state)
{
    fixture *f = *state;
    trip_cpu_buffer_destroy(&f->buffer, f->budget);
    trip_budget_destroy(f->budget);
    free(f);
    return 0;
}

/* Reserves `count` chunks, or fewer. */
static uint32_t reserve(fixture *f, uint32_t count)
{
    uint32_t reserved = 0;
    while (reserved < count && trip_cpu_buffer_reserve(&f->buffer))
        reserved++;
    return reserved;
}

/* Fills a chunk with `count` splats, the i-th in pane i mod PANES. `mark` identifies the chunk. */
static void fill(fixture *f, uint32_t number, uint32_t count, float mark)
{
    trip_cpu_chunk *chunk = &f->buffer.chunks[number];
    if (!trip_cpu_buffer_claim(&f->buffer, chunk, count))
        return;
    chunk->splats = count;
    for (uint32_t i = 0; i < count; i++)
        f->buffer.splats[chunk->splat + i] =
            (trip_cpu_splat){ .r = mark, .g = (float)i, .panes = i % PANES };
    trip_cpu_sort_chunk(&f->buffer, chunk, f->mask.grid, &f->sorting);
}

static void chunks_before_the_first_without_room_are_kept(void **state)
{
    fixture *f = *state;
    assert_int_equal(reserve(f, 4), 4);
    fill(f, 1, CAPACITY / 2, 1);
    fill(f, 3, CAPACITY / 4, 3);
    fill(f, 0, CAPACITY / 8, 0);
    fill(f, 2, CAPACITY / 2, 2);
    assert_int_equal(trip_cpu_buffer_cut(&f->buffer), 2);
    assert_int_equal(reserve(f, 1), 1);
}

/* The first chunk comes last every time. It must find room eventually, or a frame would never end.
 */
static void a_first_chunk_that_always_comes_last_finds_room(void **state)
{
    fixture *f = *state;
    uint32_t kept = 0, rounds = 0;
    while (kept == 0 && rounds++ < 10) {
        uint32_t reserved = reserve(f, 5);
        assert_true(reserved > 0);
        for (uint32_t i = reserved; i-- > 0;)
            fill(f, i, TRIP_CPU_CHUNK, 0);
        kept = trip_cpu_buffer_cut(&f->buffer);
    }
    assert_int_equal(kept, 1);
    assert_int_equal(rounds, 2);
    trip_cpu_buffer_empty(&f->buffer);
    assert_int_equal(reserve(f, 5), 5);
}

typedef struct taken {
    uint32_t pane, count;
    float mark, number;
} taken;

static void take(void *user, const trip_cpu_chunk *chunk, const trip_cpu_splat *splats,
                 const uint16_t *order, uint32_t count)
{
    (void)chunk;
    taken *t = user;
    for (uint32_t i = 0; i < count; i++, t->count++) {
        const trip_cpu_splat *s = &splats[order ? order[i] : i];
        assert_int_equal(s->panes, t->pane);
        assert_true(t->count == 0 || s->r > t->mark || (s->r >= t->mark && s->g > t->number));
        t->mark = s->r;
        t->number = s->g;
    }
}

static void panes_get_their_splats_in_the_order_of_chunks(void **state)
{
    fixture *f = *state;
    const uint32_t order[3] = { 2, 0, 1 };
    f->open[5] = 0;
    assert_int_equal(reserve(f, 3), 3);
    for (int i = 0; i < 3; i++)
        fill(f, order[i], 100, (float)order[i]);
    assert_int_equal(trip_cpu_buffer_cut(&f->buffer), 3);
    trip_cpu_link_pane_lists(&f->buffer, &f->mask);
    for (uint32_t pane = 0; pane < PANES; pane++) {
        taken t = { .pane = pane };
        trip_cpu_pane_list_each(&f->buffer, pane, take, &t);
        uint32_t each = 100 / PANES + (pane < 100 % PANES);
        assert_int_equal(t.count, pane == 5 ? 0 : 3 * each);
    }
}

/* Returns splat `i` of a chunk. Successive splats lie in the same panes for 1 to 40 splats at a
 * time: in one pane, two, four or more. */
static trip_cpu_splat mixed(uint32_t i)
{
    static const uint16_t sizes[][2] = { { 2, 2 }, { 34, 2 }, { 2, 34 }, { 34, 34 }, { 70, 2 } };
    uint32_t series = 0, end = 1;
    while (i >= end)
        end += 1 + 7 * ++series % 40;
    uint16_t x = (uint16_t)(series * 13 % 60), y = (uint16_t)(series * 29 % 90);
    const uint16_t *size = sizes[series * 11 % 5];
    trip_cpu_splat s = { .g = (float)i, .x0 = x, .y0 = y };
    s.x1 = (uint16_t)(x + size[0] - 1);
    s.y1 = (uint16_t)(y + size[1] - 1);
    if (s.y1 >= ACROSS * TRIP_CPU_PANE)
        s.y1 = ACROSS * TRIP_CPU_PANE - 1;
    s.panes = trip_cpu_panes(&s, ACROSS);
    return s;
}

static bool lies_in(const trip_cpu_splat *s, uint32_t pane)
{
    uint32_t x = pane % ACROSS, y = pane / ACROSS;
    return s->x0 / TRIP_CPU_PANE <= x && x <= s->x1 / TRIP_CPU_PANE && s->y0 / TRIP_CPU_PANE <= y &&
           y <= s->y1 / TRIP_CPU_PANE;
}

static void take_mixed(void *user, const trip_cpu_chunk *chunk, const trip_cpu_splat *splats,
                       const uint16_t *order, uint32_t count)
{
    (void)chunk;
    taken *t = user;
    assert_non_null(order);
    for (uint32_t i = 0; i < count; i++, t->count++) {
        const trip_cpu_splat *s = &splats[order[i]];
        assert_true(lies_in(s, t->pane) && (t->count == 0 || s->g > t->number));
        t->number = s->g;
    }
}

static void every_pane_of_a_splat_gets_it_once(void **state)
{
    fixture *f = *state;
    enum { SPLATS = 3000 };
    assert_int_equal(reserve(f, 1), 1);
    trip_cpu_chunk *chunk = &f->buffer.chunks[0];
    assert_true(trip_cpu_buffer_claim(&f->buffer, chunk, SPLATS));
    chunk->splats = SPLATS;
    for (uint32_t i = 0; i < SPLATS; i++)
        f->buffer.splats[chunk->splat + i] = mixed(i);
    trip_cpu_sort_chunk(&f->buffer, chunk, f->mask.grid, &f->sorting);
    trip_cpu_link_pane_lists(&f->buffer, &f->mask);
    for (uint32_t pane = 0; pane < PANES; pane++) {
        taken t = { .pane = pane };
        uint32_t expected = 0;
        for (uint32_t i = 0; i < SPLATS; i++)
            expected += lies_in(&f->buffer.splats[chunk->splat + i], pane);
        trip_cpu_pane_list_each(&f->buffer, pane, take_mixed, &t);
        assert_int_equal(t.count, expected);
    }
    for (int i = 0; i < PANES + ACROSS + 2; i++)
        assert_int_equal(f->counts[i], 0);
}

int main(void)
{
#define TEST(name) cmocka_unit_test_setup_teardown(name, set_up, tear_down)
    const struct CMUnitTest tests[] = {
        TEST(chunks_before_the_first_without_room_are_kept),
        TEST(a_first_chunk_that_always_comes_last_finds_room),
        TEST(panes_get_their_splats_in_the_order_of_chunks),
        TEST(every_pane_of_a_splat_gets_it_once),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
