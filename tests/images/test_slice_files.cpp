#include "slice_files.h"

#include <cerrno>
#include <fstream>

#include <sys/stat.h>
#include <unistd.h>

#include <csetjmp>
#include <cstdarg>
#include <cstddef>
#include <cstdint>
extern "C" {
#include <cmocka.h>
}

#include "report.h"

namespace
{

int warnings;
std::string last_warning;

void keep_line(const char *line, void *)
{
    warnings++;
    last_warning = line;
}

char folder[] = "slice_files-XXXXXX";

int enter_folder(void **)
{
    trip_report_redirect(keep_line, nullptr);
    return mkdtemp(folder) ? chdir(folder) : -1;
}

int leave_folder(void **)
{
    trip_report_redirect(nullptr, nullptr);
    return chdir("..") == 0 && system((std::string("rm -r ") + folder).c_str()) == 0 ? 0 : -1;
}

/* Writes a file with the first bytes of a TIFF. */
void make_slice(const std::string &path)
{
    std::ofstream(path) << "II*" << '\0' << "........";
}

void make_folder(const std::string &path, const std::vector<std::string> &slices)
{
    assert_int_equal(mkdir(path.c_str(), 0777), 0);
    for (const std::string &name : slices)
        make_slice(path + "/" + name);
}

std::string why_refused(const std::string &path)
{
    try {
        trip_slice_find(path, false);
    } catch (const trip_slice_error &e) {
        return e.where + ": " + e.what();
    }
    return "";
}

void assert_refused(const std::string &path, const std::string &part)
{
    const std::string why = why_refused(path);
    if (why.find(part) == std::string::npos)
        fail_msg("\"%s\" is not in \"%s\"", part.c_str(), why.c_str());
}

void a_missing_number_is_named_with_its_file(void **)
{
    make_folder("gap", { "s_0015.tif", "s_0016.tif", "s_0018.tif", "s_0019.tif" });
    for (const char *path : { "gap", "gap/", "gap/s_*.tif", "gap/s_%04d.tif" })
        assert_refused(path,
                       "slice 17 is missing (s_0017.tif); --allow-gaps lets its neighbours touch");
    unlink("gap/s_0016.tif");
    assert_refused("gap", "slice 16 is missing (s_0016.tif), and 1 more");
    warnings = 0;
    assert_int_equal(trip_slice_find("gap", true).names.size(), 3);
    assert_int_equal(warnings, 1);
    assert_true(last_warning.find("slice 16 is missing") != std::string::npos);
}

void two_slices_that_are_not_neighbours_have_a_gap(void **)
{
    make_folder("two", { "a1.tif", "a3.tif" });
    assert_refused("two", "slice 2 is missing (a2.tif)");
    make_slice("two/a2.tif");
    assert_int_equal(trip_slice_find("two", false).names.size(), 3);
}

void numbers_in_equal_steps_have_no_gap(void **)
{
    make_folder("even", { "z00.tif", "z05.tif", "z10.tif", "z15.tif" });
    assert_true(why_refused("even").empty());
    make_slice("even/z25.tif");
    assert_refused("even", "slice 20 is missing (z20.tif)");
}

void leading_zeros_match_the_names(void **)
{
    make_folder("bare", { "8.tif", "9.tif", "11.tif" });
    assert_refused("bare", "slice 10 is missing (10.tif)");
}

/* No counter is found in dates and times, two counters, names without numbers, and numbers with too
 * many digits. */
void names_without_a_single_counter_have_no_gaps(void **)
{
    make_folder("dates", { "20240131_0959.tif", "20240201_1107.tif", "20240201_1115.tif" });
    make_folder("words", { "back.tif", "front.tif", "middle.tif" });
    make_folder("long", { "1000000000000000000000.tif", "3000000000000000000000.tif" });
    for (const char *path : { "dates", "words", "long" })
        assert_true(why_refused(path).empty());
}

void names_of_another_pattern_are_not_counted(void **)
{
    make_folder("mixed", { "cover.tif", "p1.tif", "p2.tif", "p3.tif", "q7.tif" });
    assert_true(why_refused("mixed").empty());
}

void a_file_named_as_a_slice_but_no_slice_is_an_error(void **)
{
    make_folder("bad", { "im1", "im2", "im4" });
    assert_int_equal(symlink("nowhere", "bad/im3"), 0);
    assert_refused("bad", "bad/im3: is a broken link");
    unlink("bad/im3");
    assert_int_equal(mkfifo("bad/im3", 0666), 0);
    assert_refused("bad", "bad/im3: is a pipe");
    assert_refused("bad/im%d", "bad/im3: is a pipe");
    assert_refused("bad/im*", "bad/im3: is a pipe");
    unlink("bad/im3");
    assert_int_equal(mkdir("bad/im3", 0777), 0);
    assert_refused("bad", "bad/im3: is a folder");
    assert_int_equal(rmdir("bad/im3"), 0);
    std::ofstream("bad/im3") << "";
    assert_refused("bad", "bad/im3: holds no TIFF, PNG, EXR or DICOM picture");
    unlink("bad/im3");
    make_slice("bad/im3");
    assert_true(why_refused("bad").empty());
    assert_int_equal(symlink("nowhere", "bad/other.tif"), 0);
    assert_refused("bad", "bad/other.tif: is a broken link");
}

void an_unreadable_slice_is_an_error(void **)
{
    const uid_t self = geteuid();
    make_folder("closed", { "c1.tif", "c2.tif" });
    assert_int_equal(chmod("closed/c2.tif", 0), 0);
    assert_int_equal(chmod(".", 0755), 0);
    if (self == 0) /* root can read every file */
        assert_int_equal(seteuid(65534), 0);
    const std::string why = why_refused("closed");
    assert_int_equal(seteuid(self), 0);
    assert_string_equal(why.c_str(), "closed/c2.tif: cannot open: Permission denied");
}

void other_files_and_folders_are_skipped(void **)
{
    make_folder("beside", { "t1.tif", "t2.tif", ".t9.tif" });
    std::ofstream("beside/notes.txt") << "hello";
    std::ofstream("beside/series 2") << "hello";
    assert_int_equal(mkdir("beside/more", 0777), 0);
    assert_int_equal(mkfifo("beside/pipe", 0666), 0);
    assert_int_equal(trip_slice_find("beside", false).names.size(), 2);
}

/* Returns the reason why positions are refused, or "". */
std::string gap_in(const std::vector<double> &positions)
{
    std::vector<std::string> names;
    for (size_t i = 0; i < positions.size(); i++)
        names.push_back(std::string(1, (char)('a' + i)));
    try {
        trip_check_positions(positions, names, false);
        return "";
    } catch (const trip_slice_error &e) {
        return e.where + ": " + e.what();
    }
}

void positions_in_equal_steps_have_no_gap(void **)
{
    assert_string_equal(gap_in({}).c_str(), "");
    assert_string_equal(gap_in({ 3 }).c_str(), "");
    assert_string_equal(gap_in({ 3, 9 }).c_str(), "");
    assert_string_equal(gap_in({ 0, 1.5, 3, 4.5 }).c_str(), "");
}

/* Either no step is two or three times its neighbours, or several in a row are. */
void positions_in_uneven_steps_have_no_gap(void **)
{
    assert_string_equal(gap_in({ 0, 1, 2.3, 3.8 }).c_str(), "");
    assert_string_equal(gap_in({ 0, 1, 2, 7, 12, 17 }).c_str(), "");
    assert_string_equal(gap_in({ 0, 5, 10, 11, 12 }).c_str(), "");
}

void a_missing_position_is_named_by_its_neighbours(void **)
{
    const std::vector<double> positions = { 0, 2, 4, 10, 12 };
    assert_string_equal(gap_in(positions).c_str(),
                        "c: a slice is missing after it: the next slice, d, is 3 steps away; "
                        "--allow-gaps draws the others where they are");
    assert_true(gap_in({ 0, 4, 6, 8 }).compare(0, 2, "a:") == 0);
    assert_true(gap_in({ 0, 2, 4, 8 }).compare(0, 2, "c:") == 0);
    warnings = 0;
    trip_check_positions(positions, { "a", "b", "c", "d", "e" }, true);
    assert_int_equal(warnings, 1);
}

} // namespace

int main()
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_missing_number_is_named_with_its_file),
        cmocka_unit_test(two_slices_that_are_not_neighbours_have_a_gap),
        cmocka_unit_test(numbers_in_equal_steps_have_no_gap),
        cmocka_unit_test(leading_zeros_match_the_names),
        cmocka_unit_test(names_without_a_single_counter_have_no_gaps),
        cmocka_unit_test(names_of_another_pattern_are_not_counted),
        cmocka_unit_test(a_file_named_as_a_slice_but_no_slice_is_an_error),
        cmocka_unit_test(an_unreadable_slice_is_an_error),
        cmocka_unit_test(other_files_and_folders_are_skipped),
        cmocka_unit_test(positions_in_equal_steps_have_no_gap),
        cmocka_unit_test(positions_in_uneven_steps_have_no_gap),
        cmocka_unit_test(a_missing_position_is_named_by_its_neighbours),
    };
    return cmocka_run_group_tests(tests, enter_folder, leave_folder);
}
