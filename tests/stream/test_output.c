/* Tests of unnamed output files. The file appears on the disk only when the buffer is full. Reads
 * return the same bytes before and after. Several outputs of a folder may overflow at once. */
#include "fixture.h"

#include <errno.h>
#include <pthread.h>
#include <unistd.h>

#include "folder.h"
#include "output.h"

enum { BUFFER_BYTES = 4096, OUTPUTS = 8, ROUNDS = 50 };

typedef struct output_test {
    char folder[32];
    trip_budget *budget;
    trip_output output; /* empty at first */
} output_test;

static trip_output create(const output_test *t)
{
    trip_output o;
    assert_int_equal(trip_output_create(&o,
                                        &(trip_output_params){ .folder = t->folder,
                                                               .name = TRIP_SPOOL_NAME,
                                                               .buffer_bytes = BUFFER_BYTES,
                                                               .unnamed = true },
                                        t->budget),
                     0);
    return o;
}

static int begin(void **state)
{
    output_test *t = *state = calloc(1, sizeof *t);
    assert_non_null(t);
    strcpy(t->folder, "/tmp/test_output_XXXXXX");
    assert_non_null(mkdtemp(t->folder));
    assert_int_equal(trip_budget_create(&t->budget, 1 << 24), 0);
    t->output = create(t);
    return 0;
}

/* Checks that the folder is empty or gone. */
static int finish(void **state)
{
    output_test *t = *state;
    trip_output_close(&t->output);
    const bool removed = rmdir(t->folder) == 0 || errno == ENOENT;
    trip_budget_destroy(t->budget);
    free(t);
    return removed ? 0 : -1;
}

/* Returns byte i of the pattern that fills all outputs. */
static unsigned char pattern(size_t i)
{
    return (unsigned char)(i * 7 + i / 251);
}

static int append(trip_output *o, size_t bytes)
{
    unsigned char some[100];
    int status = 0;
    for (size_t left = bytes; left > 0 && status == 0;) {
        const size_t n = left < sizeof some ? left : sizeof some, at = (size_t)o->bytes;
        for (size_t i = 0; i < n; i++)
            some[i] = pattern(at + i);
        status = trip_output_append(o, some, n);
        left -= n;
    }
    return status;
}

static bool holds(const trip_output *o, size_t at, size_t bytes)
{
    unsigned char *read = malloc(bytes);
    bool same = read && trip_output_read(o, at, read, bytes) == 0;
    for (size_t i = 0; i < bytes && same; i++)
        same = read[i] == pattern(at + i);
    free(read);
    return same;
}

static void buffered_data_needs_no_file(void **state)
{
    trip_output *o = &((output_test *)*state)->output;
    assert_int_equal(append(o, BUFFER_BYTES - 1), 0);
    assert_int_equal(trip_output_flush(o), 0);
    assert_int_equal(o->fd, -1);
    assert_true(holds(o, 0, BUFFER_BYTES - 1));
    assert_true(holds(o, 1000, 3095));
}

static void overflowing_data_goes_to_a_file_and_reads_the_same(void **state)
{
    trip_output *o = &((output_test *)*state)->output;
    assert_int_equal(append(o, BUFFER_BYTES - 1), 0);
    assert_int_equal(trip_output_flush(o), 0);
    assert_int_equal(append(o, 3 * BUFFER_BYTES + 17), 0);
    assert_int_equal(trip_output_flush(o), 0);
    assert_true(o->fd >= 0);
    assert_int_equal(o->bytes, 4 * BUFFER_BYTES + 16);
    assert_true(holds(o, 0, 4 * BUFFER_BYTES + 16));
    assert_true(holds(o, BUFFER_BYTES - 5, 10));
}

static void bytes_never_written_cannot_be_read(void **state)
{
    trip_output *o = &((output_test *)*state)->output;
    unsigned char read[2];
    assert_int_equal(append(o, 10), 0);
    assert_true(trip_output_read(o, 9, read, 2) < 0);
    assert_true(trip_output_read(o, UINT64_MAX, read, 2) < 0);
}

static void a_missing_folder_is_a_failure(void **state)
{
    output_test *t = *state;
    assert_int_equal(rmdir(t->folder), 0);
    assert_int_equal(append(&t->output, BUFFER_BYTES - 1), 0);
    assert_true(append(&t->output, 1) < 0);
}

typedef struct overflowing {
    trip_output output;
    bool right;
} overflowing;

static void *overflow(void *arg)
{
    overflowing *o = arg;
    o->right = append(&o->output, 5 * BUFFER_BYTES) == 0 && trip_output_flush(&o->output) == 0 &&
               holds(&o->output, 0, 5 * BUFFER_BYTES);
    return NULL;
}

static void outputs_of_a_folder_may_overflow_at_once(void **state)
{
    for (int round = 0; round < ROUNDS; round++) {
        overflowing all[OUTPUTS];
        pthread_t threads[OUTPUTS];
        for (int i = 0; i < OUTPUTS; i++)
            all[i] = (overflowing){ .output = create(*state) };
        for (int i = 0; i < OUTPUTS; i++)
            assert_int_equal(pthread_create(&threads[i], NULL, overflow, &all[i]), 0);
        for (int i = 0; i < OUTPUTS; i++) {
            pthread_join(threads[i], NULL);
            assert_true(all[i].right);
            trip_output_close(&all[i].output);
        }
    }
}

#define TEST(name) cmocka_unit_test_setup_teardown(name, begin, finish)

int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(buffered_data_needs_no_file),
        TEST(overflowing_data_goes_to_a_file_and_reads_the_same),
        TEST(bytes_never_written_cannot_be_read),
        TEST(a_missing_folder_is_a_failure),
        TEST(outputs_of_a_folder_may_overflow_at_once),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
