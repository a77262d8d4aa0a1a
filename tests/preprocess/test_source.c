#include "source.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include "test.h"

static char folder[64];

static int enter_folder(void **state)
{
    (void)state;
    snprintf(folder, sizeof folder, "/tmp/trip-source-XXXXXX");
    return mkdtemp(folder) && chdir(folder) == 0 ? 0 : -1;
}

static int leave_folder(void **state)
{
    (void)state;
    char command[128];
    snprintf(command, sizeof command, "rm -rf %s", folder);
    return chdir("/") == 0 && system(command) == 0 ? 0 : -1;
}

static void write_file(const char *path, const char *text)
{
    FILE *f = fopen(path, "we");
    assert_non_null(f);
    fputs(text, f);
    assert_int_equal(fclose(f), 0);
}

static const char png[] = "\x89PNG\r\n\x1a\n";

/* Compares the names found. Each is followed by a space. */
static void assert_files(const char *path, const char *names)
{
    static const trip_volume_params defaults;
    trip_source s;
    char found[1024] = "";
    assert_int_equal(trip_source_find(&s, path, &defaults), 0);
    for (size_t i = 0; i < s.count; i++) {
        strcat(found, s.files[i].path);
        strcat(found, " ");
    }
    assert_string_equal(found, names);
    trip_source_free(&s);
}

static void a_detached_header_refers_to_its_data_files(void **state)
{
    (void)state;
    const char *head = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 2 2 2\nencoding: raw\n";
    char text[256];
    mkdir("sub", 0777);
    snprintf(text, sizeof text, "%sdata file: v.raw\n", head);
    write_file("sub/one.nhdr", text);
    assert_files("sub/one.nhdr", "sub/one.nhdr sub/v.raw ");
    snprintf(text, sizeof text, "%sdata file: LIST\na.raw\nb.raw\n", head);
    write_file("sub/list.nhdr", text);
    assert_files("sub/list.nhdr", "sub/list.nhdr sub/a.raw sub/b.raw ");
    snprintf(text, sizeof text, "%s\n", head);
    write_file("attached.nrrd", text);
    assert_files("attached.nrrd", "attached.nrrd ");
}

static void either_name_of_a_pair_gives_both_files(void **state)
{
    (void)state;
    write_file("p.hdr", "x");
    write_file("p.img", "x");
    write_file("single.nii", "x");
    assert_files("p.hdr", "p.hdr p.img ");
    assert_files("p.img", "p.hdr p.img ");
    assert_files("single.nii", "single.nii ");
}

static void a_folder_or_pattern_gives_all_its_files(void **state)
{
    (void)state;
    mkdir("s", 0777);
    mkdir("s/deeper", 0777);
    const char *const names[] = { "s/a[1]_02.png", "s/a[1]_10.png", "s/b.png", "s/.hidden" };
    for (int i = 0; i < 4; i++)
        write_file(names[i], png);
    assert_int_equal(mkfifo("s/pipe", 0666), 0);
    assert_files("s", "s/a[1]_02.png s/a[1]_10.png s/b.png ");
    assert_files("s/a[1]_%02d.png", "s/a[1]_02.png s/a[1]_10.png ");
    assert_files("s/a*.png", "s/a[1]_02.png s/a[1]_10.png ");
    assert_files("s/b.png", "s/b.png ");
}

static trip_digest content_of(const char *path, const char *text)
{
    static const trip_volume_params defaults;
    trip_source s;
    trip_digest d;
    assert_int_equal(trip_source_find(&s, path, &defaults), 0);
    assert_int_equal(trip_source_digest_content(&s, text, &d, NULL, NULL), 0);
    trip_source_free(&s);
    assert_int_equal(strspn(d.text, "0123456789abcdef"), 32);
    return d;
}

static void the_digest_covers_content_and_only_names_that_are_read(void **state)
{
    (void)state;
    write_file("a.nii", "same");
    write_file("b.nii", "same");
    write_file("c.nii", "sane");
    write_file("a.nii.gz", "same"); /* the content tells whether it is compressed */
    write_file("a_1x2x2_uint8.raw", "same");
    write_file("a_2x2x1_uint8.raw", "same");
    trip_digest a = content_of("a.nii", "options");
    assert_string_equal(content_of("b.nii", "options").text, a.text);
    assert_string_not_equal(content_of("c.nii", "options").text, a.text);
    assert_string_equal(content_of("a.nii.gz", "options").text, a.text);
    assert_string_not_equal(content_of("a.nii", "others").text, a.text);
    assert_string_not_equal(content_of("a_1x2x2_uint8.raw", "").text,
                            content_of("a_2x2x1_uint8.raw", "").text);
}

/* Programs cannot set the time of the last status change (ctime). A file is unchanged as long as
 * its ctime is. */
static void a_change_shows_in_the_state_despite_equal_size_and_time(void **state)
{
    (void)state;
    static const trip_volume_params defaults;
    trip_source before, after;
    trip_digest old, new;
    write_file("v.nii", "old");
    assert_int_equal(trip_source_find(&before, "v.nii", &defaults), 0);
    assert_false(trip_source_is_stable(&before));
    nanosleep(&(struct timespec){ .tv_nsec = 50000000 }, NULL);
    write_file("v.nii", "new");
    const struct timespec times[2] = {
        { .tv_sec = before.files[0].modified_ns / 1000000000,
          .tv_nsec = before.files[0].modified_ns % 1000000000 },
        { .tv_sec = before.files[0].modified_ns / 1000000000,
          .tv_nsec = before.files[0].modified_ns % 1000000000 },
    };
    assert_int_equal(utimensat(AT_FDCWD, "v.nii", times, 0), 0);
    assert_int_equal(trip_source_find(&after, "v.nii", &defaults), 0);
    assert_true(after.files[0].modified_ns == before.files[0].modified_ns);
    assert_int_equal(trip_source_digest_state(&before, "", &old), 0);
    assert_int_equal(trip_source_digest_state(&after, "", &new), 0);
    assert_string_not_equal(old.text, new.text);
    assert_int_equal(trip_source_digest_state(&after, "", &old), 0);
    assert_string_equal(old.text, new.text);
    after.files[0].changed_ns -= INT64_C(3000000000);
    assert_true(trip_source_is_stable(&after));
    trip_source_free(&before);
    trip_source_free(&after);
}

static void a_file_that_shrinks_while_it_is_read_is_reported(void **state)
{
    (void)state;
    static const trip_volume_params defaults;
    trip_source s;
    trip_digest d;
    write_file("v.nii", "long enough");
    assert_int_equal(trip_source_find(&s, "v.nii", &defaults), 0);
    write_file("v.nii", "short");
    test_catch_reports();
    assert_int_equal(trip_source_digest_content(&s, "", &d, NULL, NULL), TRIP_ERROR);
    assert_one_report("became shorter");
    trip_source_free(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_detached_header_refers_to_its_data_files),
        cmocka_unit_test(either_name_of_a_pair_gives_both_files),
        cmocka_unit_test(a_folder_or_pattern_gives_all_its_files),
        cmocka_unit_test(the_digest_covers_content_and_only_names_that_are_read),
        cmocka_unit_test(a_change_shows_in_the_state_despite_equal_size_and_time),
        cmocka_unit_test(a_file_that_shrinks_while_it_is_read_is_reported),
    };
    return cmocka_run_group_tests(tests, enter_folder, leave_folder);
}
