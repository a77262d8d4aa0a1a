/* The renderer's threads run every task of every job once. All tasks have ended when the wait
 * returns. */
#include "cpu/pool.h"
#include "test.h"

#include <stdatomic.h>
#include <string.h>
#include <unistd.h>

enum { TASKS = 100 };

typedef struct tally {
    int runs[TASKS]; /* not atomic: the waiting thread must see the tasks' writes after the wait */
    unsigned threads;
    _Atomic int busy[64];
    unsigned sleep_task;
} tally;

static void run(void *context, unsigned task, unsigned thread)
{
    tally *t = context;
    assert_true(thread < t->threads);
    assert_int_equal(atomic_fetch_add(&t->busy[thread], 1), 0);
    if (task == t->sleep_task)
        usleep(2000);
    t->runs[task]++;
    atomic_fetch_sub(&t->busy[thread], 1);
}

static void check(tally *t, unsigned tasks)
{
    for (unsigned i = 0; i < TASKS; i++)
        assert_int_equal(t->runs[i], i < tasks);
    memset(t->runs, 0, sizeof t->runs);
}

static void every_task_runs_once_and_is_over_after_the_wait(void **state)
{
    (void)state;
    for (unsigned threads = 1; threads <= 8; threads++) {
        trip_cpu_pool *pool;
        assert_int_equal(trip_cpu_pool_create(&pool, threads), 0);
        tally t = { .threads = threads, .sleep_task = TASKS };
        for (unsigned i = 0; i < 300; i++) {
            trip_cpu_job job = { .run = run, .context = &t, .tasks = i % TASKS };
            trip_cpu_pool_start(pool, &job);
            trip_cpu_pool_wait(pool, &job);
            check(&t, i % TASKS);
        }
        trip_cpu_pool_destroy(pool);
    }
}

static void two_jobs_may_be_under_way(void **state)
{
    (void)state;
    trip_cpu_pool *pool;
    assert_int_equal(trip_cpu_pool_create(&pool, 3), 0);
    for (unsigned i = 0; i < 200; i++) {
        tally t[2] = { { .threads = 3, .sleep_task = i % 20 ? TASKS : 3 },
                       { .threads = 3, .sleep_task = i % 20 ? TASKS : 0 } };
        trip_cpu_job first = { .run = run, .context = &t[0], .tasks = 5 + i % 40 };
        trip_cpu_job second = { .run = run, .context = &t[1], .tasks = i % 17 };
        trip_cpu_pool_start(pool, &first);
        trip_cpu_pool_start(pool, &second);
        trip_cpu_pool_wait(pool, i % 2 ? &first : &second);
        check(&t[i % 2 ? 0 : 1], i % 2 ? first.tasks : second.tasks);
        trip_cpu_pool_wait(pool, i % 2 ? &second : &first);
        check(&t[i % 2 ? 1 : 0], i % 2 ? second.tasks : first.tasks);
    }
    trip_cpu_pool_destroy(pool);
}

static void threads_that_slept_for_long_are_woken(void **state)
{
    (void)state;
    trip_cpu_pool *pool;
    tally t = { .threads = 2, .sleep_task = 1 };
    assert_int_equal(trip_cpu_pool_create(&pool, 2), 0);
    for (int i = 0; i < 10; i++) {
        trip_cpu_job job = { .run = run, .context = &t, .tasks = 4 };
        usleep(3000);
        trip_cpu_pool_start(pool, &job);
        trip_cpu_pool_wait(pool, &job);
        check(&t, 4);
    }
    trip_cpu_pool_destroy(pool);
}

static void waiting_for_an_unstarted_job_returns(void **state)
{
    (void)state;
    trip_cpu_pool *pool;
    trip_cpu_job job = { .tasks = 1 };
    assert_int_equal(trip_cpu_pool_create(&pool, 2), 0);
    trip_cpu_pool_wait(pool, &job);
    trip_cpu_pool_destroy(pool);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_task_runs_once_and_is_over_after_the_wait),
        cmocka_unit_test(two_jobs_may_be_under_way),
        cmocka_unit_test(threads_that_slept_for_long_are_woken),
        cmocka_unit_test(waiting_for_an_unstarted_job_returns),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
