#include "page_order.h"

#include <csetjmp>
#include <cstdarg>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
extern "C" {
#include <cmocka.h>
}

#include "report.h"
#include "slice_stack.h"

namespace
{

int warnings;
std::string last_warning;

void keep_line(const char *line, void *)
{
    warnings++;
    last_warning = line;
}

trip_page_source source_of(const std::string &description, int64_t pages, int64_t time = 0,
                           int64_t channel = 0)
{
    return { "folder/a.tif", description, pages, false, { 0, 0 }, "none", 1, time, channel };
}

trip_page_order order_of(const trip_page_source &source, int expected_warnings = 0)
{
    warnings = 0;
    trip_report_redirect(keep_line, nullptr);
    const trip_page_order order = trip_page_order_of(source);
    trip_report_redirect(nullptr, nullptr);
    if (warnings != expected_warnings)
        fail_msg("%d warnings: %s", warnings, last_warning.c_str());
    return order;
}

void assert_refused(const trip_page_source &source, const char *why, int status = TRIP_ERROR)
{
    try {
        trip_page_order_of(source);
    } catch (const trip_slice_error &e) {
        if (!strstr(e.what(), why) || e.status != status)
            fail_msg("status %d: %s", e.status, e.what());
        return;
    }
    fail_msg("not refused: %s", source.description.c_str());
}

void assert_pages(const trip_page_order &order, const std::vector<int64_t> &pages)
{
    if (order.pages != pages)
        fail_msg("%zu pages, from %lld", order.pages.size(),
                 order.pages.empty() ? -1 : (long long)order.pages[0]);
}

void assert_spacing(const trip_page_order &order, double x, double y, double z)
{
    const double expected[3] = { x, y, z };
    for (int a = 0; a < 3; a++)
        if (!(std::abs(order.spacing[a] / expected[a] - 1) < 1e-6))
            fail_msg("spacing %d is %g", a, order.spacing[a]);
}

/* Channels are the fastest, then slices, then times. */
void imagej_gives_the_order(void **)
{
    const std::string text = "ImageJ=1.53t\nimages=24\nchannels=2\nslices=4\nframes=3\n"
                             "hyperstack=true\n";
    assert_pages(order_of(source_of(text, 24)), { 0, 2, 4, 6 });
    assert_pages(order_of(source_of(text, 24, 0, 1)), { 1, 3, 5, 7 });
    assert_pages(order_of(source_of(text, 24, 2, 1)), { 17, 19, 21, 23 });
    assert_non_null(strstr(order_of(source_of(text, 24, 2, 1)).note.c_str(),
                           "channel 1 of 2 is read (--channel N reads another, from 0); time 2 of "
                           "3"));
    assert_refused(source_of(text, 24, 3), "has 3 times, from 0 to 2", TRIP_USAGE);
    assert_refused(source_of(text, 24, 0, 2), "has 2 channels, from 0 to 1", TRIP_USAGE);
    assert_true(order_of(source_of(text, 23), 1).pages.empty());
    assert_non_null(strstr(last_warning.c_str(), "another number of pages"));
    assert_pages(order_of(source_of("ImageJ=1\nimages=6\nchannels=3\n", 6)), { 0, 3 });
    assert_pages(order_of(source_of("ImageJ=1\nimages=3\nslices=3\n", 3)), { 0, 1, 2 });
    assert_refused(source_of("ImageJ=1\nimages=3\nslices=3\n", 1), "a form private to ImageJ");
}

void imagej_gives_distances(void **)
{
    trip_page_source s = source_of("ImageJ=1\nspacing=1.5\nunit=micron\n", 1);
    s.per_unit[0] = 4;
    s.per_unit[1] = 2;
    assert_spacing(order_of(s), 0.25, 0.5, 1.5);
    assert_true(order_of(s).measured);
    assert_non_null(strstr(order_of(s).note.c_str(), "lengths are in um"));
    s.description = "ImageJ=1\nspacing=-2e-3\nunit=\\u00B5m\nzunit=mm\n";
    assert_spacing(order_of(s), 0.25, 0.5, 2);
    s.description = "ImageJ=1\n";
    s.unit = "in"; /* a unit without a description of it */
    s.per_unit[0] = s.per_unit[1] = 72;
    assert_spacing(order_of(s), 1, 1, 1);
    assert_false(order_of(s).measured);
    s.per_unit[0] = s.per_unit[1] = 100;
    assert_spacing(order_of(s), 0.01, 0.01, 1);
    s.per_unit[0] = s.per_unit[1] = 0;
    s.description = "ImageJ=1\nunit=nm\nspacing=nan\n";
    assert_spacing(order_of(s), 1, 1, 1);
    s.several_files = true; /* each slice is a file with the whole description */
    s.description = "ImageJ=1\nimages=24\nslices=24\nunit=nm\nspacing=7\n";
    assert_spacing(order_of(s), 1, 1, 7);
}

void imagej_calibrates_values(void **)
{
    const trip_page_order order = order_of(source_of("ImageJ=1\ncf=0\nc0=-32768.0\nc1=2\n", 1));
    assert_true(order.inter == -32768 && order.slope == 2);
    const trip_page_order curved = order_of(source_of("ImageJ=1\ncf=5\nc0=3\nc1=2\n", 1));
    assert_true(curved.inter == 0 && curved.slope == 1);
}

std::string ome(const std::string &pixels, const std::string &inside = "")
{
    return "<?xml version=\"1.0\"?><!-- a comment --><OME UUID=\"urn:uuid:own\"><Image><Pixels " +
           pixels + ">" + inside + "</Pixels></Image></OME>";
}

const std::string sizes = " SizeX=\"5\" SizeY=\"4\" SizeZ=\"4\" SizeC=\"2\" SizeT=\"3\"";

/* The sample volume has 4 slices, 2 channels and 3 times. Each order is computed here by itself. */
void ome_gives_the_order(void **)
{
    static const struct {
        const char *order;
        int64_t z, c, t; /* steps between pages */
    } orders[] = { { "XYZCT", 1, 4, 8 }, { "XYZTC", 1, 12, 4 }, { "XYCZT", 2, 1, 8 },
                   { "XYCTZ", 6, 1, 2 }, { "XYTZC", 3, 12, 1 }, { "XYTCZ", 6, 3, 1 } };
    for (const auto &o : orders)
        for (int64_t c = 0; c < 2; c++)
            for (int64_t t = 0; t < 3; t++) {
                const std::string pixels =
                    std::string("DimensionOrder=\"") + o.order + "\"" + sizes;
                const int64_t first = c * o.c + t * o.t;
                const std::vector<int64_t> pages = { first, first + o.z, first + 2 * o.z,
                                                     first + 3 * o.z };
                assert_pages(order_of(source_of(ome(pixels), 24, t, c)), pages);
                assert_pages(order_of(source_of(ome(pixels, "<TiffData/>"), 24, t, c)), pages);
                assert_pages(order_of(source_of(
                                 ome(pixels, "<TiffData IFD=\"0\" PlaneCount=\"24\"/>"), 24, t, c)),
                             pages);
            }
}

void ome_places_planes_one_by_one(void **)
{
    std::string planes;
    for (int z = 0; z < 3; z++) /* from the last slice to the first, after a page of its own */
        planes += "<ome:TiffData FirstZ=\"" + std::to_string(z) + "\" FirstC=\"1\" IFD=\"" +
                  std::to_string(3 - z) + "\"/>";
    const std::string pixels = "DimensionOrder=\"XYZCT\" SizeZ=\"3\" SizeC=\"2\" SizeT=\"1\"";
    assert_pages(order_of(source_of(ome(pixels, planes), 4, 0, 1)), { 3, 2, 1 });
    assert_refused(source_of(ome(pixels, planes), 4, 0, 0), "a page that the file does not have");
    assert_refused(source_of(ome(pixels, planes), 3, 0, 1), "a page that the file does not have");
}

void planes_in_other_files_are_refused(void **)
{
    const std::string pixels = "DimensionOrder=\"XYZCT\" SizeZ=\"2\" SizeC=\"1\" SizeT=\"1\"";
    auto plane = [](int z, const char *file, const char *uuid) {
        return "<TiffData IFD=\"" + std::to_string(z) + "\" FirstZ=\"" + std::to_string(z) +
               "\"><UUID FileName=\"" + file + "\">urn:uuid:" + uuid + "</UUID></TiffData>";
    };
    assert_refused(source_of(ome(pixels, plane(0, "a.tif", "own") + plane(1, "b.tif", "b")), 2),
                   "in another file, \"b.tif\"");
    assert_refused(source_of(ome(pixels, plane(0, "a.tif", "own") + plane(1, "b.tif", "b")), 1),
                   "in another file, \"b.tif\"");
    /* A renamed file. */
    assert_pages(order_of(source_of(
                     ome(pixels, plane(0, "old.tif", "own") + plane(1, "old.tif", "own")), 2)),
                 { 0, 1 });
    assert_pages(
        order_of(source_of(ome(pixels, plane(0, "old.tif", "x") + plane(1, "old.tif", "x")), 2)),
        { 0, 1 });
}

void ome_gives_distances(void **)
{
    const std::string pixels = "DimensionOrder=\"XYZCT\" SizeZ=\"2\" SizeC=\"1\" SizeT=\"1\" ";
    assert_spacing(order_of(source_of(ome(pixels + "PhysicalSizeX=\"200\" PhysicalSizeXUnit=\"nm\" "
                                                   "PhysicalSizeY=\"0.3\" PhysicalSizeZ=\"0.001\" "
                                                   "PhysicalSizeZUnit=\"mm\""),
                                      2)),
                   200, 300, 1000);
    const trip_page_order flat =
        order_of(source_of(ome(pixels + "PhysicalSizeX=\"0.5\" PhysicalSizeY=\"0.25\""), 2), 1);
    assert_spacing(flat, 0.5, 0.25, 0.5);
    assert_non_null(strstr(last_warning.c_str(), "no distance of slices"));
    assert_spacing(order_of(source_of(ome(pixels + "PhysicalSizeX=\"-1\""), 2)), 1, 1, 1);
}

/* A colour counts as three channels in SizeC. */
void samples_of_a_pixel_are_channels_unless_they_are_a_colour(void **)
{
    const std::string text = ome("DimensionOrder=\"XYCZT\" SizeZ=\"2\" SizeC=\"6\" SizeT=\"1\"",
                                 "<Channel SamplesPerPixel=\"3\"/><Channel/><TiffData/>");
    trip_page_source s = source_of(text, 4, 0, 1);
    assert_pages(order_of(s), { 1, 3 });
    s.samples = 3;
    s.channel = 5;
    assert_pages(order_of(s), { 1, 3 });
    assert_int_equal(order_of(s).sample, 2);
    s = source_of("no description", 4, 0, 2);
    s.samples = 3;
    assert_true(order_of(s).pages.empty());
    assert_int_equal(order_of(s).sample, 2);
    s.samples = 2;
    assert_refused(s, "has 2 channels", TRIP_USAGE);
}

void an_image_of_one_slice_has_other_slices(void **)
{
    const std::string head = "ImageJ=1\nimages=6\n";
    const trip_page_order times =
        order_of(source_of(head + "channels=2\nslices=1\nframes=3\n", 6, 0, 1));
    assert_pages(times, { 1, 3, 5 });
    assert_non_null(strstr(times.note.c_str(), "its times are read as slices"));
    const trip_page_order channels = order_of(source_of(head + "channels=6\nslices=1\n", 6));
    assert_pages(channels, { 0, 1, 2, 3, 4, 5 });
    assert_non_null(strstr(channels.note.c_str(), "its channels are read as slices"));
}

void unusable_descriptions_are_warned_of_or_refused(void **)
{
    static const char *const unusable[] = {
        "<OME",
        "<OME></OME>",
        "<!DOCTYPE a [<!ENTITY b \"c\">]><OME>&b;</OME>",
        "<OME><Image><Pixels DimensionOrder=\"XYZZT\" SizeZ=\"1\" SizeC=\"1\" "
        "SizeT=\"1\"/></Image></OME>",
        "<OME><Image><Pixels DimensionOrder=\"XYZCT\" SizeZ=\"0\" SizeC=\"1\" "
        "SizeT=\"1\"/></Image></OME>",
    };
    for (const char *text : unusable)
        assert_true(order_of(source_of(text, 3), 1).pages.empty());
    const std::string order = "DimensionOrder=\"XYZCT\" ";
    assert_refused(
        source_of(ome(order + "SizeZ=\"2147483647\" SizeC=\"2147483647\" SizeT=\"9\""), 3),
        "impossible sizes");
    assert_refused(source_of(ome(order + "SizeZ=\"2000000000\" SizeC=\"1\" SizeT=\"1\""), 3),
                   "may be truncated");
    assert_refused(source_of(ome(order + "SizeZ=\"2\" SizeC=\"1\" SizeT=\"1\"",
                                 "<TiffData IFD=\"2147483647\" FirstZ=\"2147483647\" "
                                 "PlaneCount=\"2147483647\"/>"),
                             3),
                   "a page that the file does not have");
}

} // namespace

int main()
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(imagej_gives_the_order),
        cmocka_unit_test(imagej_gives_distances),
        cmocka_unit_test(imagej_calibrates_values),
        cmocka_unit_test(ome_gives_the_order),
        cmocka_unit_test(ome_places_planes_one_by_one),
        cmocka_unit_test(planes_in_other_files_are_refused),
        cmocka_unit_test(ome_gives_distances),
        cmocka_unit_test(samples_of_a_pixel_are_channels_unless_they_are_a_colour),
        cmocka_unit_test(an_image_of_one_slice_has_other_slices),
        cmocka_unit_test(unusable_descriptions_are_warned_of_or_refused),
    };
    return cmocka_run_group_tests(tests, nullptr, nullptr);
}
