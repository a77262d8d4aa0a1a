#include "test.h"
#include "interrupt.h"

#include <pthread.h>
#include <sched.h>
#include <signal.h>
#include <stdatomic.h>
#include <unistd.h>

#include "workers.h"

enum { ITEMS = 10000 };

typedef struct work {
    _Atomic unsigned times[ITEMS];
    _Atomic unsigned threads_wrong;
    unsigned threads;
    uint64_t failing; /* index of the item that fails; ITEMS disables it */
} work;

static int do_item(void *user, unsigned thread, uint64_t item)
{
    work *w = user;
    if (thread >= w->threads)
        w->threads_wrong++;
    w->times[item]++;
    return item == w->failing ? -5 : 0;
}

static void every_item_is_done_once(void **state)
{
    (void)state;
    for (unsigned threads = 1; threads <= 8; threads *= 2) {
        static work w;
        trip_workers *pool;
        assert_int_equal(trip_workers_create(&pool, threads), 0);
        assert_int_equal(trip_workers_count(pool), threads);
        for (unsigned round = 1; round <= 3; round++) {
            w.threads = threads;
            w.failing = ITEMS;
            assert_int_equal(trip_workers_run(pool, do_item, &w, ITEMS), 0);
            for (int i = 0; i < ITEMS; i++)
                assert_int_equal(w.times[i], round);
        }
        assert_int_equal(w.threads_wrong, 0);
        trip_workers_destroy(pool);
        for (int i = 0; i < ITEMS; i++)
            w.times[i] = 0;
    }
}

static void a_failure_stops_the_loop_and_is_returned(void **state)
{
    (void)state;
    static work w = { .threads = 1, .failing = 100 };
    trip_workers *pool;
    unsigned done = 0;
    assert_int_equal(trip_workers_create(&pool, 1), 0);
    assert_int_equal(trip_workers_run(pool, do_item, &w, ITEMS), -5);
    for (int i = 0; i < ITEMS; i++)
        done += w.times[i];
    assert_int_equal(done, 101);
    /* The pool stays usable. */
    w.failing = ITEMS;
    assert_int_equal(trip_workers_run(pool, do_item, &w, 3), 0);
    trip_workers_destroy(pool);
}

static void an_empty_loop_ends_at_once(void **state)
{
    (void)state;
    trip_workers *pool;
    int status = 1;
    assert_int_equal(trip_workers_create(&pool, 3), 0);
    trip_workers_start(pool, do_item, NULL, 0);
    assert_true(trip_workers_wait(pool, 0, &status));
    assert_int_equal(status, 0);
    trip_workers_destroy(pool);
}

static int wait_for_flag(void *user, unsigned thread, uint64_t item)
{
    _Atomic int *flag = user;
    (void)thread;
    (void)item;
    while (*flag == 0)
        continue;
    return 0;
}

static void waiting_can_be_interrupted(void **state)
{
    (void)state;
    trip_workers *pool;
    _Atomic int flag = 0;
    int status;
    assert_int_equal(trip_workers_create(&pool, 1), 0);
    trip_workers_start(pool, wait_for_flag, &flag, 1);
    assert_false(trip_workers_wait(pool, 1, &status));
    flag = 1;
    assert_true(trip_workers_wait(pool, 0, &status));
    trip_workers_destroy(pool);
}

/* Waits for all other items, so that all fail. */
static int fail_together(void *user, unsigned thread, uint64_t item)
{
    (void)thread;
    pthread_barrier_wait(user);
    trip_fail(TRIP_ERROR, "read", "a.vdb", "item %d is corrupt", (int)item);
    return trip_fail(TRIP_ERROR, "read", "a.vdb", "once more, of item %d", (int)item);
}

static void a_failure_of_several_threads_at_once_is_reported_once(void **state)
{
    (void)state;
    enum { THREADS = 4 };
    trip_workers *w;
    pthread_barrier_t all;
    assert_int_equal(pthread_barrier_init(&all, NULL, THREADS), 0);
    assert_int_equal(trip_workers_create(&w, THREADS), 0);
    test_catch_reports();
    assert_int_equal(trip_workers_run(w, fail_together, &all, THREADS), TRIP_ERROR);
    assert_one_report("is corrupt");
    trip_workers_destroy(w);
    pthread_barrier_destroy(&all);
}

static int count_up(void *user, unsigned thread, uint64_t item)
{
    _Atomic unsigned *done = user;
    (void)thread;
    (void)item;
    ++*done;
    return 0;
}

/* One thread fails without a report. The other thread then fails and reports the reason. */
static int fail_late_with_the_report(void *user, unsigned thread, uint64_t item)
{
    atomic_int *failed = user;
    (void)thread;
    if (item == 1) {
        *failed = 1;
        return -5;
    }
    while (!*failed)
        sched_yield();
    usleep(20000);
    return trip_fail(-4, "write", "here", "no space left");
}

static void a_report_after_a_failure_without_report_is_kept(void **state)
{
    (void)state;
    trip_workers *pool;
    atomic_int failed = 0;
    assert_int_equal(trip_workers_create(&pool, 2), 0);
    test_catch_reports();
    assert_true(trip_workers_run(pool, fail_late_with_the_report, &failed, 2) < 0);
    assert_one_report("no space left");
    trip_workers_destroy(pool);
}

static void a_signal_to_stop_ends_a_loop_with_one_report(void **state)
{
    (void)state;
    trip_workers *w;
    _Atomic unsigned done = 0;
    assert_int_equal(trip_workers_create(&w, 3), 0);
    trip_interrupt_install();
    raise(SIGINT);
    test_catch_reports();
    assert_int_equal(trip_workers_run(w, count_up, &done, 1000), TRIP_INTERRUPTED);
    assert_one_report("interrupted");
    assert_int_equal(done, 0);
    trip_interrupt_install();
    trip_workers_destroy(w);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_item_is_done_once),
        cmocka_unit_test(a_failure_stops_the_loop_and_is_returned),
        cmocka_unit_test(an_empty_loop_ends_at_once),
        cmocka_unit_test(waiting_can_be_interrupted),
        cmocka_unit_test(a_failure_of_several_threads_at_once_is_reported_once),
        cmocka_unit_test(a_report_after_a_failure_without_report_is_kept),
        cmocka_unit_test(a_signal_to_stop_ends_a_loop_with_one_report),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
