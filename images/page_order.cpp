#include "page_order.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <memory>

#include <expat.h>

#include "report.h"
#include "slice_stack.h"
#include "text.h"

namespace
{

/* A description cannot make the search for pages longer than this. */
constexpr double steps_max = 1e8;

/* The sizes of an image, as a description gives them. */
struct Sizes {
    int64_t slices = 1, channels = 1, times = 1;
};

/* Lengths in micrometres. The names are ImageJ's and OME's. */
const struct {
    const char *name, *plain;
    double micrometres;
} units[] = {
    { "um", "um", 1 },
    { "\xc2\xb5m", "um", 1 },
    { "\xce\xbcm", "um", 1 },
    { "\xb5m", "um", 1 },
    { "\\u00B5m", "um", 1 },
    { "micron", "um", 1 },
    { "microns", "um", 1 },
    { "nm", "nm", 1e-3 },
    { "pm", "pm", 1e-6 },
    { "mm", "mm", 1e3 },
    { "cm", "cm", 1e4 },
    { "dm", "dm", 1e5 },
    { "m", "m", 1e6 },
    { "km", "km", 1e9 },
    { "\xc3\x85", "Angstrom", 1e-4 },
    { "inch", "inch", 25400 },
    { "inches", "inch", 25400 },
    { "in", "inch", 25400 },
    { "ft", "ft", 304800 },
    { "yd", "yd", 914400 },
    { "thou", "thou", 25.4 },
    { "pt", "pt", 25400.0 / 72 },
};

/* Returns the number of the unit in the table, or -1. */
int find_unit(const std::string &name)
{
    for (size_t i = 0; i < sizeof units / sizeof *units; i++)
        if (name == units[i].name)
            return (int)i;
    return -1;
}

/* Converts a length to the unit `to`, if both units are known. */
double convert(double length, int from, int to)
{
    return from >= 0 && to >= 0 ? length * units[from].micrometres / units[to].micrometres : length;
}

void add_note(trip_page_order &order, const std::string &text)
{
    order.note += (order.note.empty() || text.empty() ? "" : "; ") + text;
}

void note_unit(trip_page_order &order, int unit)
{
    if (unit >= 0)
        add_note(order, std::string("lengths are in ") + units[unit].plain);
}

void note_entry(trip_page_order &order, const char *what, int64_t index, int64_t count)
{
    char note[256] = "";
    trip_entry_note(note, sizeof note, what, index, count, "");
    add_note(order, note);
}

/* An image of one slice has its times, or else its channels, as slices. */
void use_as_slices(Sizes &sizes, trip_page_order &order, bool &times, bool &channels)
{
    times = sizes.slices == 1 && sizes.times > 1;
    channels = sizes.slices == 1 && !times && sizes.channels > 1;
    if (times)
        add_note(order, "the image has one slice; its times are read as slices");
    if (channels)
        add_note(order, "the image has one slice; its channels are read as slices");
}

/* The position of a plane in an image, and its number in the order of the pages. */
struct Numbering {
    Sizes sizes;
    std::string order; /* of the axes, the fastest first: a permutation of "ZCT" */
    bool times_are_slices = false, channels_are_slices = false;

    double count() const
    {
        return (double)sizes.slices * (double)sizes.channels * (double)sizes.times;
    }
    int64_t slices() const
    {
        return times_are_slices ? sizes.times : channels_are_slices ? sizes.channels : sizes.slices;
    }
    int64_t channels() const
    {
        return channels_are_slices ? 1 : sizes.channels;
    }
    int64_t times() const
    {
        return times_are_slices ? 1 : sizes.times;
    }
    int64_t at(int64_t z, int64_t c, int64_t t) const
    {
        int64_t number = 0, step = 1;
        for (char axis : order) {
            number += step * (axis == 'Z' ? z : axis == 'C' ? c : t);
            step *= axis == 'Z' ? sizes.slices : axis == 'C' ? sizes.channels : sizes.times;
        }
        return number;
    }
    int64_t slice_at(int64_t slice, int64_t c, int64_t t) const
    {
        return times_are_slices      ? at(0, c, slice)
               : channels_are_slices ? at(0, slice, t)
                                     : at(slice, c, t);
    }
};

/* Checks the wanted channel and time. Returns the channel of the pages. */
int64_t choose(const trip_page_source &s, const Numbering &n, trip_page_order &order)
{
    const int64_t channels = n.channels() * s.samples;
    trip_check_entry(s.file, "time", s.time, n.times());
    trip_check_entry(s.file, "channel", s.channel, channels);
    note_entry(order, "channel", s.channel, channels);
    note_entry(order, "time", s.time, n.times());
    order.sample = s.channel % s.samples;
    return s.channel / s.samples;
}

/* ---- ImageJ ---- */

/* Returns the text of a line "key=value", or "". */
std::string imagej_text(const std::string &text, const std::string &key)
{
    for (size_t at = 0; at < text.size();) {
        size_t end = std::min(text.find('\n', at), text.size());
        if (text.compare(at, key.size(), key) == 0 && text[at + key.size()] == '=') {
            size_t from = at + key.size() + 1;
            while (end > from && (text[end - 1] == '\r' || text[end - 1] == ' '))
                end--;
            return text.substr(from, end - from);
        }
        at = end + 1;
    }
    return "";
}

double imagej_number(const std::string &text, const std::string &key, double missing)
{
    double value;
    return trip_text_to_double(imagej_text(text, key).c_str(), &value) ? value : missing;
}

/* Returns a count of at least 1. */
int64_t imagej_count(const std::string &text, const std::string &key)
{
    const double value = imagej_number(text, key, 1);
    return value >= 1 && value <= 0x1p31 ? (int64_t)value : 1;
}

/* The unit of a picture without one in its description, as ImageJ reads it. */
std::string tag_unit(const trip_page_source &s)
{
    const bool screen = s.unit == "in" && std::fabs(s.per_unit[0] - 72) < 1e-3;
    return s.unit == "in" && !screen ? "inch" : s.unit == "cm" ? "cm" : "";
}

void imagej_spacing(const trip_page_source &s, trip_page_order &order)
{
    const std::string &text = s.description;
    std::string name = imagej_text(text, "unit");
    const bool tagged = name.empty();
    if (tagged)
        name = tag_unit(s);
    const int unit = find_unit(name);
    for (int a = 0; a < 2; a++)
        if (s.per_unit[a] > 0 && std::isfinite(s.per_unit[a]) &&
            !(tagged && s.unit == "in" && name.empty()))
            order.spacing[a] = 1 / s.per_unit[a];
    order.measured = !imagej_text(text, "spacing").empty() || order.spacing[0] != 1;
    const double z = std::fabs(imagej_number(text, "spacing", 1));
    order.spacing[2] = z > 0 && std::isfinite(z) ? z : 1;
    const std::string own[2] = { imagej_text(text, "yunit"), imagej_text(text, "zunit") };
    for (int a = 0; a < 2; a++)
        if (!own[a].empty())
            order.spacing[1 + a] = convert(order.spacing[1 + a], find_unit(own[a]), unit);
    note_unit(order, unit);
}

/* Applies a straight line, the calibration of 16-bit values with a sign. */
void imagej_calibration(const trip_page_source &s, trip_page_order &order)
{
    if (imagej_text(s.description, "cf") != "0")
        return;
    order.inter = imagej_number(s.description, "c0", 0);
    order.slope = imagej_number(s.description, "c1", 1);
    if (order.slope == 0) {
        order.inter = 0;
        order.slope = 1;
    }
}

void imagej_order(const trip_page_source &s, trip_page_order &order)
{
    const std::string &text = s.description;
    Numbering n;
    const int64_t images = imagej_count(text, "images");
    imagej_spacing(s, order);
    imagej_calibration(s, order);
    if (s.several_files) {
        choose(s, n, order);
        return;
    }
    if (s.pages == 1 && images > 1)
        throw trip_slice_error(s.file, "holds " + std::to_string(images) +
                                           " slices in a form private to ImageJ; save it as raw "
                                           "data or as an image sequence");
    n.order = "CZT";
    n.sizes = { imagej_count(text, "slices"), imagej_count(text, "channels"),
                imagej_count(text, "frames") };
    if (imagej_text(text, "slices").empty() && n.sizes.channels * n.sizes.times > 1 &&
        s.pages % (n.sizes.channels * n.sizes.times) == 0)
        n.sizes.slices = s.pages / (n.sizes.channels * n.sizes.times);
    if (n.count() != (double)s.pages) {
        if (n.count() > 1)
            trip_warn(s.file.c_str(), "ImageJ's description fits another number of pages than the "
                                      "file has; all pages are read as slices");
        choose(s, Numbering(), order);
        return;
    }
    use_as_slices(n.sizes, order, n.times_are_slices, n.channels_are_slices);
    const int64_t channel = choose(s, n, order);
    for (int64_t k = 0; k < n.slices(); k++)
        order.pages.push_back(n.slice_at(k, channel, s.time));
}

/* ---- OME ---- */

/* A TiffData element: planes on consecutive pages. */
struct Planes {
    int64_t page = 0, z = 0, c = 0, t = 0, count = -1; /* count -1: the default */
    bool has_page = false;
    std::string name, uuid; /* of the file; empty for this file */
};

/* The parts of an OME document that matter. */
struct Ome {
    XML_Parser parser = nullptr;
    std::string uuid; /* of this file */
    int images = 0;
    bool in_pixels = false, in_planes = false, in_uuid = false, has_pixels = false;
    std::string order;
    Sizes sizes;
    int64_t samples = 0; /* of the first channel */
    double spacing[3] = { 0, 0, 0 };
    std::string unit[3];
    std::vector<Planes> planes;
};

/* Returns the name without a prefix. */
std::string local(const char *name)
{
    const char *colon = std::strrchr(name, ':');
    return colon ? colon + 1 : name;
}

const char *attribute(const char **attributes, const char *name)
{
    for (; *attributes; attributes += 2)
        if (std::strcmp(attributes[0], name) == 0)
            return attributes[1];
    return nullptr;
}

int64_t whole(const char **attributes, const char *name, int64_t missing)
{
    const char *text = attribute(attributes, name);
    char *end = nullptr;
    const long long value = text ? std::strtoll(text, &end, 10) : 0;
    return text && end != text && !*end && value >= 0 && value <= INT32_MAX ? value : missing;
}

void take_pixels(Ome &ome, const char **attributes)
{
    static const char *const axes[] = { "X", "Y", "Z" };
    const char *order = attribute(attributes, "DimensionOrder");
    ome.has_pixels = true;
    ome.order = order && std::strncmp(order, "XY", 2) == 0 ? order + 2 : "";
    ome.sizes = { whole(attributes, "SizeZ", 0), whole(attributes, "SizeC", 0),
                  whole(attributes, "SizeT", 0) };
    for (int a = 0; a < 3; a++) {
        const std::string name = std::string("PhysicalSize") + axes[a];
        const char *length = attribute(attributes, name.c_str());
        const char *unit = attribute(attributes, (name + "Unit").c_str());
        double value;
        if (length && trip_text_to_double(length, &value) && value > 0)
            ome.spacing[a] = value;
        ome.unit[a] = unit ? unit : "um"; /* the default of the standard */
    }
}

void take_planes(Ome &ome, const char **attributes)
{
    Planes p;
    p.has_page = attribute(attributes, "IFD") != nullptr;
    p.page = whole(attributes, "IFD", 0);
    p.z = whole(attributes, "FirstZ", 0);
    p.c = whole(attributes, "FirstC", 0);
    p.t = whole(attributes, "FirstT", 0);
    p.count = whole(attributes, "PlaneCount", -1);
    ome.planes.push_back(p);
}

void on_start(void *user, const char *name, const char **attributes)
{
    Ome &ome = *static_cast<Ome *>(user);
    const std::string element = local(name);
    const bool first = ome.images == 1;
    if (element == "OME" && attribute(attributes, "UUID"))
        ome.uuid = attribute(attributes, "UUID");
    else if (element == "Image")
        ome.images++;
    else if (element == "Pixels" && first && !ome.has_pixels) {
        take_pixels(ome, attributes);
        ome.in_pixels = true;
    } else if (element == "Channel" && ome.in_pixels && ome.samples == 0)
        ome.samples = std::max<int64_t>(1, whole(attributes, "SamplesPerPixel", 1));
    else if (element == "TiffData" && ome.in_pixels) {
        take_planes(ome, attributes);
        ome.in_planes = true;
    } else if (element == "UUID" && ome.in_planes) {
        const char *file = attribute(attributes, "FileName");
        ome.planes.back().name = file ? file : "";
        ome.in_uuid = true;
    }
}

void on_end(void *user, const char *name)
{
    Ome &ome = *static_cast<Ome *>(user);
    const std::string element = local(name);
    ome.in_pixels = ome.in_pixels && element != "Pixels";
    ome.in_planes = ome.in_planes && element != "TiffData";
    ome.in_uuid = ome.in_uuid && element != "UUID";
}

void on_text(void *user, const char *text, int length)
{
    Ome &ome = *static_cast<Ome *>(user);
    if (ome.in_uuid && ome.planes.back().uuid.size() < 100)
        ome.planes.back().uuid.append(text, (size_t)length);
}

/* Refuses a document with a type declaration, so that no entity is ever expanded. */
void on_doctype(void *user, const char *, const char *, const char *, int)
{
    XML_StopParser(static_cast<Ome *>(user)->parser, XML_FALSE);
}

bool parse_ome(const std::string &text, Ome &ome)
{
    const std::unique_ptr<XML_ParserStruct, void (*)(XML_Parser)> parser(XML_ParserCreate(nullptr),
                                                                         XML_ParserFree);
    if (!parser)
        throw std::bad_alloc();
    ome.parser = parser.get();
    XML_SetUserData(ome.parser, &ome);
    XML_SetElementHandler(ome.parser, on_start, on_end);
    XML_SetCharacterDataHandler(ome.parser, on_text);
    XML_SetStartDoctypeDeclHandler(ome.parser, on_doctype);
    return text.size() < INT32_MAX &&
           XML_Parse(ome.parser, text.data(), (int)text.size(), 1) == XML_STATUS_OK &&
           ome.has_pixels;
}

bool is_permutation(const std::string &order)
{
    std::string sorted = order;
    std::sort(sorted.begin(), sorted.end());
    return sorted == "CTZ";
}

std::string base_name(const std::string &path)
{
    const size_t slash = path.rfind('/');
    return slash == std::string::npos ? path : path.substr(slash + 1);
}

/* Marks planes in other files. A file that was renamed is known by its identifier, or because no
 * plane has another file. */
std::vector<bool> find_foreign(const trip_page_source &s, const Ome &ome)
{
    std::vector<bool> foreign;
    bool all = !ome.planes.empty(), alike = true;
    for (const Planes &p : ome.planes) {
        const bool named = !p.name.empty() || !p.uuid.empty();
        foreign.push_back(named && !(p.uuid == ome.uuid && !ome.uuid.empty()) &&
                          p.name != base_name(s.file));
        all = all && foreign.back();
        alike = alike && p.name == ome.planes[0].name && p.uuid == ome.planes[0].uuid;
    }
    if (all && alike)
        foreign.assign(foreign.size(), false);
    return foreign;
}

void ome_spacing(const trip_page_source &s, const Ome &ome, trip_page_order &order)
{
    const int unit = find_unit(ome.unit[0]);
    const double x = ome.spacing[0];
    if (!(x > 0))
        return;
    order.measured = true;
    for (int a = 0; a < 3; a++)
        order.spacing[a] =
            ome.spacing[a] > 0 ? convert(ome.spacing[a], find_unit(ome.unit[a]), unit) : x;
    if (!(ome.spacing[2] > 0) && ome.sizes.slices > 1)
        trip_warn(s.file.c_str(), "gives no distance of slices; they are as far apart as pixels "
                                  "(--spacing X,Y,Z sets another)");
    note_unit(order, unit);
}

void refuse_missing_page(const trip_page_source &s, const std::string &elsewhere)
{
    throw trip_slice_error(
        s.file, elsewhere.empty()
                    ? "its OME description names a page that the file does not have; the "
                      "file may be truncated"
                    : "has slices in another file, \"" + elsewhere.substr(0, 80) +
                          "\"; join them in one file, for example with `bfconvert`");
}

/* Returns the name of another file that holds planes, or "". */
std::string find_other_file(const Ome &ome, const std::vector<bool> &foreign)
{
    for (size_t i = 0; i < foreign.size(); i++)
        if (foreign[i])
            return ome.planes[i].name.empty() ? ome.planes[i].uuid : ome.planes[i].name;
    return "";
}

/* Finds the page of each slice. */
void find_pages(const trip_page_source &s, const Ome &ome, const Numbering &n, int64_t channel,
                trip_page_order &order)
{
    const std::vector<bool> foreign = find_foreign(s, ome);
    const int64_t samples = std::max<int64_t>(1, ome.samples);
    std::vector<Planes> planes = ome.planes;
    if (planes.empty())
        planes.push_back(Planes()); /* all pages, in order */
    if (n.slices() > s.pages)
        refuse_missing_page(s, find_other_file(ome, foreign));
    if ((double)planes.size() * (double)n.slices() > steps_max)
        throw trip_slice_error(s.file, "its OME description has too many elements");
    order.pages.assign((size_t)n.slices(), -1);
    for (size_t i = 0; i < planes.size(); i++) {
        const Planes &p = planes[i];
        const bool inside = p.z < n.sizes.slices && p.c / samples < n.sizes.channels &&
                            p.t < n.sizes.times && !(i < foreign.size() && foreign[i]);
        const int64_t first = inside ? n.at(p.z, p.c / samples, p.t) : 0;
        const int64_t count = p.count >= 0 ? p.count : p.has_page ? 1 : (int64_t)n.count();
        for (int64_t k = 0; k < n.slices() && inside; k++) {
            const int64_t plane = n.slice_at(k, channel, s.time);
            if (plane >= first && plane - first < count)
                order.pages[(size_t)k] = p.page + plane - first;
        }
    }
    for (int64_t page : order.pages)
        if (page < 0 || page >= s.pages)
            refuse_missing_page(s, page < 0 ? find_other_file(ome, foreign) : "");
}

void ome_order(const trip_page_source &s, trip_page_order &order)
{
    Ome ome;
    Numbering n;
    const bool sound = parse_ome(s.description, ome) && is_permutation(ome.order) &&
                       ome.sizes.slices > 0 && ome.sizes.channels > 0 && ome.sizes.times > 0;
    if (!sound) {
        trip_warn(s.file.c_str(), "its OME description cannot be read; all pages are slices");
        choose(s, n, order);
        return;
    }
    ome_spacing(s, ome, order);
    n.order = ome.order;
    n.sizes = ome.sizes;
    if (ome.samples > 1 && n.sizes.channels % ome.samples == 0)
        n.sizes.channels /= ome.samples;
    if (s.several_files) {
        if (n.sizes.channels > 1 || n.sizes.times > 1)
            trip_warn(s.file.c_str(), "belongs to an image of several channels or times; all files "
                                      "are read as slices, in the order of their names");
        choose(s, Numbering(), order);
        return;
    }
    if (n.count() > 0x1p53)
        throw trip_slice_error(s.file, "its OME description has impossible sizes");
    if (ome.images > 1)
        add_note(order, "the first of " + std::to_string(ome.images) + " images is read");
    use_as_slices(n.sizes, order, n.times_are_slices, n.channels_are_slices);
    find_pages(s, ome, n, choose(s, n, order), order);
}

} // namespace

trip_page_order trip_page_order_of(const trip_page_source &source)
{
    trip_page_order order;
    const std::string &text = source.description;
    if (text.compare(0, 7, "ImageJ=") == 0)
        imagej_order(source, order);
    else if (text.find("<OME") != std::string::npos || text.find(":OME ") != std::string::npos)
        ome_order(source, order);
    else
        choose(source, Numbering(), order);
    return order;
}
