/* Tests of untrusted files of tests/regress: journals of interrupted runs, and answers of the image
 * helper. Each kind has one sound file. The other files differ from it in one number. */
#include "test.h"

#include <errno.h>
#include <sys/socket.h>
#include <unistd.h>

#include "../fuzz/journal_file.h"
#include "image_helper.h"
#include "volume.h"

enum { SLICE_VOXELS = 64 * 64, SLICES = 64, MAX_BYTES = 4096, MEMORY_BYTES = 16 << 20 };

static char folder[] = "distrust-XXXXXX";

static int enter_folder(void **state)
{
    (void)state;
    return mkdtemp(folder) ? chdir(folder) : -1;
}

static int leave_folder(void **state)
{
    (void)state;
    return chdir("..") == 0 ? rmdir(folder) : -1;
}

static size_t read_kept(const char *name, unsigned char bytes[MAX_BYTES])
{
    char path[512];
    snprintf(path, sizeof path, TRIP_SOURCE_DIR "/tests/regress/%s", name);
    FILE *f = fopen(path, "rb");
    assert_non_null(f);
    size_t count = fread(bytes, 1, MAX_BYTES, f);
    fclose(f);
    assert_true(count > 0 && count < MAX_BYTES);
    return count;
}

static FILE *create(const char *name)
{
    FILE *f = fopen(name, "wb");
    assert_non_null(f);
    return f;
}

/* Resumes `brick` with the journal `name` and returns its status. All other files are present. */
static int resume(const char *name, trip_budget *budget)
{
    static const trip_journal_params params = { .resume = true,
                                                .voxels = SLICE_VOXELS * SLICES,
                                                .slice_voxels = SLICE_VOXELS };
    unsigned char bytes[MAX_BYTES];
    trip_spill *spill;
    trip_journal *journal;
    size_t count = read_kept(name, bytes);
    assert_int_equal(trip_spill_open(&spill, "spill", false, budget), 0);
    FILE *f = create("spill/journal");
    write_journal(f, bytes, count);
    fclose(f);
    fclose(create("spill/runs"));
    test_catch_reports();
    int status = trip_journal_open(&journal, spill, &params, budget);
    trip_report_redirect(NULL, NULL);
    if (status == 0) {
        assert_non_null(trip_journal_get_checkpoint(journal));
        assert_int_equal(trip_journal_get_checkpoint(journal)->done, 1);
    }
    trip_journal_close(journal);
    trip_spill_keep(spill, false);
    trip_spill_close(spill);
    return status;
}

static void journals_are_not_trusted(void **state)
{
    static const char *const names[][2] = {
        { "journal_exponent", "its count of values is invalid" },
        { "journal_voxels", "its count of values is invalid" },
        { "journal_slices", "its progress is invalid" },
        { "journal_segments", "a record is invalid" },
    };
    trip_budget *budget;
    (void)state;
    assert_int_equal(trip_budget_create(&budget, MEMORY_BYTES), 0);
    assert_int_equal(resume("journal_sound", budget), 0);
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        assert_int_equal(resume(names[i][0], budget), TRIP_ERROR);
        assert_one_report(names[i][1]);
    }
    trip_budget_destroy(budget);
}

static struct {
    unsigned char bytes[MAX_BYTES];
    size_t count;
    int fd;
} answer;

/* Sends the whole answer at once, and nothing after it. */
static int answer_at_once(int fd)
{
    answer.fd = dup(fd);
    ssize_t sent = send(answer.fd, answer.bytes, answer.count, MSG_NOSIGNAL);
    shutdown(answer.fd, SHUT_WR);
    return sent == (ssize_t)answer.count ? 0 : EIO;
}

/* Opens slices with this answer of the helper. */
static int open_slices(const char *name, trip_budget *budget)
{
    trip_volume *v;
    answer.count = read_kept(name, answer.bytes);
    trip_image_helper_replace(answer_at_once, 1000);
    test_catch_reports();
    int status = trip_volume_open(&v, "/", NULL, budget);
    trip_report_redirect(NULL, NULL);
    trip_image_helper_replace(NULL, 0);
    if (status == 0) {
        assert_int_equal(trip_volume_get_info(v)->dims[2], 3);
        trip_volume_close(v);
    }
    close(answer.fd);
    return status;
}

static void answers_of_the_image_helper_are_not_trusted(void **state)
{
    static const char *const names[][2] = {
        { "answer_type", "slices of an unknown type" },
        { "answer_outcome", "an unknown outcome" },
        { "answer_sizes", "slices without a size" },
        { "answer_large_sizes", "has slices of an impossible size" },
        { "answer_data_bytes", "data of the wrong size" },
    };
    trip_budget *budget;
    (void)state;
    assert_int_equal(trip_budget_create(&budget, MEMORY_BYTES), 0);
    assert_int_equal(open_slices("answer_sound", budget), 0);
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        assert_int_equal(open_slices(names[i][0], budget), TRIP_ERROR);
        assert_one_report(names[i][1]);
        assert_int_equal(trip_budget_left_bytes(budget), MEMORY_BYTES);
    }
    trip_budget_destroy(budget);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(journals_are_not_trusted),
        cmocka_unit_test(answers_of_the_image_helper_are_not_trusted),
    };
    return cmocka_run_group_tests(tests, enter_folder, leave_folder);
}
