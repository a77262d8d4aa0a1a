#include "dicom_file.h"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <sstream>

#include <gdcmCSAElement.h>
#include <gdcmCSAHeader.h>
#include <gdcmReader.h>
#include <gdcmSequenceOfItems.h>
#include <gdcmSplitMosaicFilter.h>
#include <zlib.h>

#include "connection.h"

namespace
{

using Set = gdcm::DataSet;
using Tag = gdcm::Tag;

const Tag pixel_tag(0x7fe0, 0x0010), float_tag(0x7fe0, 0x0008), double_tag(0x7fe0, 0x0009);

/* More frames or slices are not possible in a file: the count is a text of 12 characters. */
constexpr double max_count = 1e9;

const gdcm::ByteValue *bytes_of(const Set &set, const Tag &tag)
{
    if (!set.FindDataElement(tag))
        return nullptr;
    const gdcm::ByteValue *bytes = set.GetDataElement(tag).GetByteValue();
    return bytes && bytes->GetPointer() && bytes->GetLength() ? bytes : nullptr;
}

/* Returns the text without blanks and zeros at its ends, or "". */
std::string text_of(const Set &set, const Tag &tag)
{
    const gdcm::ByteValue *bytes = bytes_of(set, tag);
    std::string text = bytes ? std::string(bytes->GetPointer(), bytes->GetLength()) : "";
    const char blanks[] = " \t\r\n";
    text = text.substr(0, text.find('\0'));
    size_t first = text.find_first_not_of(blanks);
    return first == std::string::npos
               ? ""
               : text.substr(first, text.find_last_not_of(blanks) - first + 1);
}

/* Parses the numbers of a text. Returns none if one of them is missing or not finite. */
std::vector<double> numbers_of(const Set &set, const Tag &tag)
{
    const std::string text = text_of(set, tag);
    std::vector<double> numbers;
    for (size_t at = 0; at < text.size();) {
        size_t end = std::min(text.find('\\', at), text.size());
        const std::string part = text.substr(at, end - at);
        char *rest;
        double v = std::strtod(part.c_str(), &rest);
        if (rest == part.c_str() || !std::isfinite(v))
            return {};
        numbers.push_back(v);
        at = end + 1;
    }
    return numbers;
}

double number_of(const Set &set, const Tag &tag, double missing = NAN)
{
    const std::vector<double> v = numbers_of(set, tag);
    return v.empty() ? missing : v[0];
}

/* Returns the numbers of an element of binary numbers. */
template <typename T> std::vector<T> binary_of(const Set &set, const Tag &tag)
{
    const gdcm::ByteValue *bytes = bytes_of(set, tag);
    std::vector<T> v(bytes ? bytes->GetLength() / sizeof(T) : 0);
    if (!v.empty())
        std::memcpy(v.data(), bytes->GetPointer(), v.size() * sizeof(T));
    return v;
}

template <typename T> double binary_number(const Set &set, const Tag &tag, double missing)
{
    const std::vector<T> v = binary_of<T>(set, tag);
    return v.empty() ? missing : (double)v[0];
}

unsigned count_of(const Set &set, const Tag &tag, unsigned missing)
{
    return (unsigned)binary_number<uint16_t>(set, tag, missing);
}

/* Keeps the items of a sequence alive. */
class Items
{
  public:
    Items(const Set &set, const Tag &tag)
    {
        if (set.FindDataElement(tag))
            items_ = set.GetDataElement(tag).GetValueAsSQ();
    }
    size_t count() const
    {
        return items_ ? items_->GetNumberOfItems() : 0;
    }
    const Set *item(size_t i) const
    {
        return i < count() ? &items_->GetItem(i + 1).GetNestedDataSet() : nullptr;
    }

  private:
    gdcm::SmartPointer<gdcm::SequenceOfItems> items_;
};

/* The places where the properties of a frame may stand, the most specific first. */
struct Places {
    const Set *frame, *shared, *file;

    /* Calls use(set) for the sets that hold the tag, inside the group if it is an item of the
     * frame, until use() returns true. */
    template <typename Use> void visit(const Tag &group, const Tag &tag, const Use &use) const
    {
        for (const Set *set : { frame, shared }) {
            if (!set)
                continue;
            const Items items(*set, group);
            if (items.item(0) && items.item(0)->FindDataElement(tag) && use(*items.item(0)))
                return;
        }
        if (file->FindDataElement(tag))
            use(*file);
    }
    std::vector<double> numbers(const Tag &group, const Tag &tag, size_t count) const
    {
        std::vector<double> found;
        visit(group, tag, [&](const Set &set) {
            found = numbers_of(set, tag);
            return found.size() == count;
        });
        return found.size() == count ? found : std::vector<double>();
    }
    double number(const Tag &group, const Tag &tag, double missing) const
    {
        const std::vector<double> v = numbers(group, tag, 1);
        return v.empty() ? missing : v[0];
    }
    template <typename T> double binary(const Tag &group, const Tag &tag, double missing) const
    {
        double found = missing;
        visit(group, tag, [&](const Set &set) {
            found = binary_number<T>(set, tag, missing);
            return true;
        });
        return found;
    }
};

trip_vec3 vector_of(const std::vector<double> &v, size_t at)
{
    return trip_v3(v[at], v[at + 1], v[at + 2]);
}

/* Returns whether rows and columns are at right angles. */
bool are_square(const std::vector<double> &rows)
{
    trip_vec3 i = trip_normalize(vector_of(rows, 0)), j = trip_normalize(vector_of(rows, 3));
    return trip_length(trip_cross(i, j)) > 0.999;
}

trip_dicom_slice read_slice(const std::string &path, const Places &at)
{
    const Tag plane(0x20, 0x9113), orientation(0x20, 0x9116), measures(0x28, 0x9110);
    const Tag transform(0x28, 0x9145), content(0x20, 0x9111);
    trip_dicom_slice s;
    s.rows = at.numbers(orientation, Tag(0x20, 0x37), 6);
    if (!s.rows.empty() && !are_square(s.rows))
        throw trip_slice_error(
            path, "has rows and columns that are not at right angles in patient space");
    const std::vector<double> position = at.numbers(plane, Tag(0x20, 0x32), 3);
    if (!position.empty())
        s.position = vector_of(position, 0);
    s.placed = !position.empty() && !s.rows.empty();
    const std::vector<double> spacing = at.numbers(measures, Tag(0x28, 0x30), 2);
    if (!spacing.empty() && spacing[0] > 0 && spacing[1] > 0) {
        s.spacing[0] = spacing[1];
        s.spacing[1] = spacing[0];
    }
    for (const Tag &tag : { Tag(0x18, 0x88), Tag(0x18, 0x50) }) {
        const double step = at.number(measures, tag, 0);
        if (std::isnan(s.step) && step != 0)
            s.step = std::fabs(step);
    }
    s.rescale = { at.number(transform, Tag(0x28, 0x1053), 1),
                  at.number(transform, Tag(0x28, 0x1052), 0) };
    s.times[0] =
        at.binary<uint32_t>(content, Tag(0x20, 0x9128), number_of(*at.file, Tag(0x20, 0x100)));
    s.times[1] = number_of(*at.file, Tag(0x20, 0x12));
    s.times[2] = number_of(*at.file, Tag(0x18, 0x1060));
    s.times[3] = number_of(*at.file, Tag(0x20, 0x13));
    s.segment = (unsigned)at.binary<uint16_t>(Tag(0x62, 0x0a), Tag(0x62, 0x0b), 0);
    return s;
}

/* Places the frames of doses and of nuclear medicine, which share one position. */
void place_frames(const Set &set, trip_dicom_file &f)
{
    const std::vector<double> offsets = numbers_of(set, Tag(0x3004, 0x000c));
    const Items detectors(set, Tag(0x54, 0x22));
    const double step = number_of(set, Tag(0x18, 0x88));
    trip_dicom_slice &first = f.slices[0];
    if (detectors.item(0) && !first.placed) {
        const trip_dicom_slice from = read_slice(f.path, { nullptr, nullptr, detectors.item(0) });
        for (trip_dicom_slice &s : f.slices) {
            s.placed = from.placed && std::isfinite(step) && step != 0;
            s.rows = from.rows;
            s.position = from.position;
        }
    } else if (!first.placed || offsets.size() != f.slices.size()) {
        /* One position for all frames tells nothing about the others. */
        for (trip_dicom_slice &s : f.slices)
            s.placed = false;
        return;
    }
    for (size_t k = 0; k < f.slices.size() && f.slices[k].placed; k++) {
        const double along =
            offsets.size() == f.slices.size() ? offsets[k] - offsets[0] : step * (double)k;
        f.slices[k].position =
            trip_add(f.slices[0].position, trip_scale(f.slices[0].normal(), along));
    }
}

/* Reads the slices of a file, one for each frame. */
void read_slices(const Set &set, trip_dicom_file &f)
{
    const Items shared(set, Tag(0x5200, 0x9229)), frames(set, Tag(0x5200, 0x9230));
    const size_t count = (size_t)f.pixels.frames;
    const bool each = frames.count() == count;
    for (size_t k = 0; k < count; k++) {
        if (each || k == 0)
            f.slices.push_back(
                read_slice(f.path, { each ? frames.item(k) : nullptr, shared.item(0), &set }));
        else
            f.slices.push_back(f.slices[0]);
        f.slices.back().frame = (int64_t)k;
        trip_connection_working();
    }
    if (count > 1 && !each)
        place_frames(set, f);
}

/* Unfolds a Siemens mosaic: a picture with all slices of a volume as its tiles. Its position is the
 * one of a slice as large as the whole picture. */
void unfold_mosaic(const gdcm::File &file, trip_dicom_file &f)
{
    const std::string type = text_of(file.GetDataSet(), Tag(0x08, 0x08));
    if (type.find("MOSAIC") == std::string::npos || f.pixels.frames != 1)
        return;
    const unsigned count = gdcm::SplitMosaicFilter::GetNumberOfImagesInMosaic(file);
    const int tiles = (int)std::ceil(std::sqrt((double)count));
    if (count < 2 || f.pixels.columns % tiles != 0 || f.pixels.rows % tiles != 0)
        return trip_warn(f.path.c_str(),
                         "is a mosaic without its number of slices; it is drawn as it is");
    gdcm::SplitMosaicFilter filter;
    double direction[3];
    bool backward = false;
    filter.SetFile(file);
    if (!filter.ComputeMOSAICSliceNormal(direction, backward))
        trip_warn(f.path.c_str(), "does not give the order of its slices; the usual one is taken");
    f.tiles = tiles;
    f.width = f.pixels.columns / tiles;
    f.height = f.pixels.rows / tiles;
    const trip_dicom_slice whole = f.slices[0];
    f.slices.clear();
    for (unsigned k = 0; k < count; k++) {
        trip_dicom_slice s = whole;
        s.tile = (int)k;
        if (s.placed) {
            const double right = 0.5 * s.spacing[0] * (double)(f.pixels.columns - f.width);
            const double down = 0.5 * s.spacing[1] * (double)(f.pixels.rows - f.height);
            const double along = (std::isfinite(s.step) ? s.step : 1) * k * (backward ? -1 : 1);
            s.position = trip_add(s.position, trip_scale(vector_of(s.rows, 0), right));
            s.position = trip_add(s.position, trip_scale(vector_of(s.rows, 3), down));
            s.position = trip_add(s.position, trip_scale(s.normal(), along));
        }
        f.slices.push_back(s);
    }
}

/* Reads the table of one channel. Its descriptor has the number of entries, the first stored value
 * and the bits of an entry. */
std::vector<double> read_table(const std::string &path, const Set &set, const Tag &descriptor,
                               const Tag &data, double &first, bool is_signed)
{
    const std::vector<uint16_t> d = binary_of<uint16_t>(set, descriptor);
    const gdcm::ByteValue *bytes = bytes_of(set, data);
    if (d.size() != 3 || !bytes)
        throw trip_slice_error(path, "lacks a table of its palette colours");
    const size_t count = d[0] ? d[0] : 65536;
    first = is_signed ? (double)(int16_t)d[1] : d[1];
    std::vector<double> entries;
    if (bytes->GetLength() >= 2 * count)
        for (uint16_t v : binary_of<uint16_t>(set, data))
            entries.push_back(v);
    else if (bytes->GetLength() >= count)
        for (uint8_t v : binary_of<uint8_t>(set, data))
            entries.push_back(v);
    else
        throw trip_slice_error(path, "has a table of palette colours that is too short");
    entries.resize(count);
    return entries;
}

std::shared_ptr<trip_dicom_palette> read_palette(const std::string &path, const Set &set,
                                                 bool is_signed)
{
    auto palette = std::make_shared<trip_dicom_palette>();
    for (uint16_t c = 0; c < 3; c++)
        palette->channel[c] =
            read_table(path, set, Tag(0x28, (uint16_t)(0x1101 + c)),
                       Tag(0x28, (uint16_t)(0x1201 + c)), palette->first, is_signed);
    return palette;
}

void read_colour(const std::string &path, const Set &set, trip_dicom_pixels &p)
{
    static const struct {
        const char *name;
        trip_dicom_colour colour;
    } known[] = {
        { "RGB", trip_dicom_colour::RGB },
        { "YBR_FULL", trip_dicom_colour::YBR },
        { "YBR_FULL_422", trip_dicom_colour::YBR_422 },
        { "YBR_RCT", trip_dicom_colour::RGB },
        { "YBR_ICT", trip_dicom_colour::RGB },
    };
    const std::string name = text_of(set, Tag(0x28, 0x04));
    p.planar = count_of(set, Tag(0x28, 0x06), 0) == 1;
    if (p.samples == 1 && name == "PALETTE COLOR") {
        p.colour = trip_dicom_colour::PALETTE;
        p.palette = read_palette(path, set, p.is_signed);
    }
    if (p.samples == 1)
        return;
    for (const auto &k : known)
        if (p.samples == 3 && name == k.name && p.allocated % 8 == 0) {
            p.colour = k.colour;
            return;
        }
    throw trip_slice_error(path, "has colours of a kind that is not read: " +
                                     std::to_string(p.samples) + " samples a pixel, " + name);
}

/* Returns whether the standard allows the number of bits of a sample, and this program reads it. */
bool is_depth_known(const trip_dicom_pixels &p)
{
    if (p.floating)
        return p.allocated == 32 || p.allocated == 64;
    return (p.allocated == 1 || p.allocated == 8 || p.allocated == 16 || p.allocated == 32) &&
           p.stored >= 1 && p.stored <= p.allocated && p.high + 1 >= p.stored &&
           p.high < p.allocated;
}

void read_pixel_format(const std::string &path, const Set &set, trip_dicom_pixels &p)
{
    const double frames = number_of(set, Tag(0x28, 0x08), 1);
    p.columns = count_of(set, Tag(0x28, 0x11), 0);
    p.rows = count_of(set, Tag(0x28, 0x10), 0);
    p.frames = frames >= 1 && frames <= max_count ? (int64_t)frames : 0;
    p.allocated = count_of(set, Tag(0x28, 0x100), 0);
    p.stored = count_of(set, Tag(0x28, 0x101), p.allocated);
    p.high = count_of(set, Tag(0x28, 0x102), p.stored - 1);
    p.is_signed = count_of(set, Tag(0x28, 0x103), 0) == 1;
    p.samples = count_of(set, Tag(0x28, 0x02), 1);
    if (p.columns < 1 || p.rows < 1 || p.frames < 1)
        throw trip_slice_error(path, "contains no picture");
    if (!is_depth_known(p))
        throw trip_slice_error(path, "has pixels of " + std::to_string(p.stored) + " bits in " +
                                         std::to_string(p.allocated) + ", which are not supported");
    read_colour(path, set, p);
}

/* A file while its header is read. */
class Source
{
  public:
    explicit Source(const std::string &path) : path_(path), stream_(trip_dicom_open(path))
    {
        reader_.SetStream(*stream_);
        bool good = false;
        try {
            good = reader_.ReadUpToTag(pixel_tag, { pixel_tag });
        } catch (const std::bad_alloc &) {
            throw;
        } catch (const std::exception &) {
            /* GDCM gives no reason that helps */
        }
        if (!good)
            throw trip_slice_error(
                path, "cannot be read as DICOM: it is damaged, cut off or of an unknown syntax");
        stream_->clear();
    }
    const Set &set() const
    {
        return reader_.GetFile().GetDataSet();
    }
    const gdcm::File &file() const
    {
        return reader_.GetFile();
    }
    uint64_t bytes()
    {
        stream_->seekg(0, std::ios::end);
        return (uint64_t)std::max<std::streamoff>(stream_->tellg(), 0);
    }
    gdcm::TransferSyntax syntax() const
    {
        return reader_.GetFile().GetHeader().GetDataSetTransferSyntax();
    }
    /* Finds the element of the pixels, which GDCM has just passed. Returns false if there is none.
     */
    bool find_pixels(trip_dicom_pixels &p)
    {
        const std::streamoff end = stream_->tellg();
        unsigned char head[12] = { 0 };
        const bool big = syntax().GetSwapCode() == gdcm::SwapCode::BigEndian &&
                         syntax() != gdcm::TransferSyntax::ImplicitVRBigEndianPrivateGE;
        if (end < (std::streamoff)sizeof head)
            return false;
        stream_->seekg(end - (std::streamoff)sizeof head);
        stream_->read((char *)head, sizeof head);
        const unsigned char tags[2][4] = { { 0xe0, 0x7f, 0x10, 0 }, { 0x7f, 0xe0, 0, 0x10 } };
        const bool is_long = std::memcmp(head, tags[big], 4) == 0 && head[4] == 'O';
        if (!is_long && std::memcmp(head, tags[big], 4) == 0 && head[4] != 'U')
            return false;
        if (std::memcmp(head, tags[big], 4) != 0 && std::memcmp(head + 4, tags[big], 4) != 0)
            return false;
        const unsigned char *l = head + 8;
        p.bytes = big ? (uint32_t)l[0] << 24 | l[1] << 16 | l[2] << 8 | l[3]
                      : (uint32_t)l[3] << 24 | l[2] << 16 | l[1] << 8 | l[0];
        p.offset = (uint64_t)end;
        p.words = is_long && head[5] == 'W' && big;
        return true;
    }

  private:
    std::string path_;
    std::unique_ptr<std::istream> stream_;
    gdcm::Reader reader_;
};

/* Finds where the pixels are, and how they are stored. Returns false if the file has none. */
bool find_pixels(Source &source, const std::string &path, trip_dicom_pixels &p)
{
    const gdcm::TransferSyntax syntax = source.syntax();
    const Set &set = source.set();
    p.syntax = syntax;
    p.compressed = syntax.IsEncapsulated();
    p.swap = syntax.GetSwapCode() == gdcm::SwapCode::BigEndian ||
             syntax == gdcm::TransferSyntax::ImplicitVRBigEndianPrivateGE;
    for (const Tag &tag : { float_tag, double_tag })
        if (set.FindDataElement(tag)) {
            p.floating = p.in_memory = true;
            p.swap = false; /* GDCM has swapped them as numbers */
            return true;
        }
    if (!source.find_pixels(p))
        return false;
    if (p.bytes == UINT32_MAX && !p.compressed)
        throw trip_slice_error(path, "has pixels without a size");
    return p.bytes > 0;
}

/* Returns the modality. The standard allows at most 16 upper-case letters, digits, blanks and
 * underscores; other texts are ignored. */
std::string modality_of(const Set &set)
{
    const std::string text = text_of(set, Tag(0x08, 0x60));
    auto known = [](unsigned char c) {
        return (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == ' ' || c == '_';
    };
    return text.size() <= 16 && std::all_of(text.begin(), text.end(), known) ? text : "";
}

/* Returns a description as UTF-8 without control characters. Bytes that are not ASCII count as
 * UTF-8 if the file says so, and else as Latin-1. */
std::string description_of(const Set &set, const Tag &tag)
{
    const bool utf8 = text_of(set, Tag(0x08, 0x05)) == "ISO_IR 192";
    std::string out;
    for (unsigned char c : text_of(set, tag)) {
        if (c < 32 || c == 127 || c == '"' || (!utf8 && c >= 128 && c < 160))
            out += ' ';
        else if (c < 128 || utf8)
            out += (char)c;
        else
            (out += (char)(0xc0 | c >> 6)) += (char)(0x80 | (c & 0x3f));
    }
    return out.substr(0, 64);
}

void read_names(const Set &set, trip_dicom_file &f)
{
    const Items segments(set, Tag(0x62, 0x02));
    f.series = text_of(set, Tag(0x20, 0x0e));
    f.object = text_of(set, Tag(0x08, 0x18));
    f.series_number = number_of(set, Tag(0x20, 0x11));
    f.description = description_of(set, Tag(0x08, 0x103e));
    f.modality = modality_of(set);
    const std::string body = text_of(set, Tag(0x10, 0x2210));
    f.biped = body.empty() || body == "BIPED";
    f.location = number_of(set, Tag(0x20, 0x1041));
    f.number = number_of(set, Tag(0x20, 0x13));
    f.has_table = Items(set, Tag(0x28, 0x3000)).count() > 0;
    for (size_t i = 0; i < segments.count() && i < 65536; i++) {
        const Set &item = *segments.item(i);
        const size_t number = count_of(item, Tag(0x62, 0x04), 0);
        if (f.segments.size() <= number)
            f.segments.resize(number + 1);
        f.segments[number] = description_of(item, Tag(0x62, 0x05));
    }
}

/* Checks that an uncompressed file holds all its frames. */
void check_length(const trip_dicom_file &f, uint64_t file_bytes)
{
    const trip_dicom_pixels &p = f.pixels;
    uint64_t needed;
    const bool possible = !__builtin_mul_overflow(p.frame_bytes(), (uint64_t)p.frames, &needed);
    if (p.allocated == 1)
        needed = ((uint64_t)p.columns * (uint64_t)p.rows * (uint64_t)p.frames + 7) / 8;
    if (!p.compressed && (!possible || needed > p.bytes))
        throw trip_slice_error(f.path, "has pixel data of the wrong size: " +
                                           std::to_string(p.bytes) + " bytes for " + f.size_text());
    const uint64_t there = p.compressed ? 8 : needed;
    if (p.offset > file_bytes || there > file_bytes - p.offset)
        throw trip_slice_error(f.path, "is cut off: its pixels end early");
}

} // namespace

trip_vec3 trip_dicom_slice::normal() const
{
    return trip_normalize(trip_cross(vector_of(rows, 0), vector_of(rows, 3)));
}

bool trip_dicom_alike(const std::vector<double> &a, const std::vector<double> &b)
{
    return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                      [](double x, double y) { return std::fabs(x - y) <= 1e-3; });
}

uint64_t trip_dicom_pixels::frame_bytes() const
{
    const uint64_t count = (uint64_t)columns * (uint64_t)rows;
    if (allocated == 1)
        return (count + 7) / 8 + 1; /* a frame may begin inside a byte */
    if (colour == trip_dicom_colour::YBR_422 && !compressed)
        return (uint64_t)rows * (uint64_t)((columns + 1) / 2) * 4 * (allocated / 8);
    return count * samples * (allocated / 8);
}

trip_scalar trip_dicom_file::type() const
{
    if (pixels.colour != trip_dicom_colour::GREY)
        return TRIP_F32;
    if (pixels.floating)
        return pixels.allocated == 32 ? TRIP_F32 : TRIP_F64;
    return pixels.allocated <= 8    ? (pixels.is_signed ? TRIP_I8 : TRIP_U8)
           : pixels.allocated == 16 ? (pixels.is_signed ? TRIP_I16 : TRIP_U16)
                                    : (pixels.is_signed ? TRIP_I32 : TRIP_U32);
}

std::string trip_dicom_file::size_text() const
{
    return std::to_string(pixels.columns) + " x " + std::to_string(pixels.rows) + " pixels in " +
           std::to_string(pixels.frames) + " frames of " + std::to_string(pixels.samples) + " x " +
           std::to_string(pixels.allocated) + " bits";
}

trip_dicom_file trip_dicom_read(const std::string &path)
{
    trip_connection_decode(path);
    Source source(path);
    trip_dicom_file f;
    f.path = path;
    const Set &set = source.set();
    read_names(set, f);
    f.has_pixels = find_pixels(source, path, f.pixels);
    if (!f.has_pixels)
        return f;
    read_pixel_format(path, set, f.pixels);
    f.width = f.pixels.columns;
    f.height = f.pixels.rows;
    /* A frame has at least one bit. */
    if ((uint64_t)f.pixels.frames / 8 > source.bytes())
        throw trip_slice_error(path, "states more frames than it can hold");
    if (!f.pixels.in_memory)
        check_length(f, source.bytes());
    read_slices(set, f);
    unfold_mosaic(source.file(), f);
    return f;
}

namespace
{

/* Returns the part after the head of a deflated file, inflated. */
std::string inflate_rest(std::istream &file, const std::string &path)
{
    std::vector<char> in(65536), out(262144);
    std::string whole;
    z_stream z = {};
    if (inflateInit2(&z, -MAX_WBITS) != Z_OK)
        throw std::bad_alloc();
    int status = Z_OK;
    while (status == Z_OK) {
        if (z.avail_in == 0) {
            file.read(in.data(), (std::streamsize)in.size());
            z.next_in = (Bytef *)in.data();
            z.avail_in = (uInt)file.gcount();
        }
        z.next_out = (Bytef *)out.data();
        z.avail_out = (uInt)out.size();
        status = inflate(&z, Z_NO_FLUSH);
        whole.append(out.data(), out.size() - z.avail_out);
        trip_connection_working();
    }
    inflateEnd(&z);
    if (status != Z_STREAM_END)
        throw trip_slice_error(path, "is cut off or damaged: its deflated data end early");
    return whole;
}

} // namespace

std::unique_ptr<std::istream> trip_dicom_open(const std::string &path)
{
    /* the mark, and the element with the length of the head that follows it */
    const std::string mark("DICM\2\0\0\0UL\4\0", 12);
    const std::string deflated = "1.2.840.10008.1.2.1.99", plain("1.2.840.10008.1.2.1\0", 20);
    auto file = std::make_unique<std::ifstream>(path, std::ios::binary);
    if (!*file)
        throw trip_slice_error(path, std::string("cannot open: ") + std::strerror(errno));
    std::string head(144, 0);
    file->read(&head[0], (std::streamsize)head.size());
    uint32_t bytes = 0;
    std::memcpy(&bytes, &head[140], sizeof bytes);
    if (file->good() && head.compare(128, mark.size(), mark) == 0 && bytes <= 65536) {
        std::string rest(bytes, 0);
        file->read(&rest[0], (std::streamsize)bytes);
        if (rest.find(deflated) != std::string::npos) {
            const std::string length("\x1c\0\0\0", 4), syntax("\2\0\x10\0UI\x14\0", 8);
            return std::make_unique<std::istringstream>(head.substr(0, 140) + length + syntax +
                                                            plain + inflate_rest(*file, path),
                                                        std::ios::binary);
        }
    }
    file->clear();
    file->seekg(0);
    return file;
}

bool trip_dicom_is_of_series(const std::string &path, const std::string &series)
{
    std::string head(65536, 0);
    std::ifstream stream(path, std::ios::binary);
    stream.read(&head[0], (std::streamsize)head.size());
    head.resize((size_t)stream.gcount());
    const std::string padded = series + std::string(series.size() % 2, '\0');
    const std::string big("\0\x20\0\x0e", 4), little("\x20\0\x0e\0", 4);
    for (size_t at = 8; (at = head.find(padded, at)) != std::string::npos; at++) {
        const std::string tag = head.substr(at - 8, 4);
        if (tag == little || tag == big)
            return true;
    }
    return false;
}
