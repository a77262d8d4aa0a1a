#include <algorithm>
#include <cstring>
#include <type_traits>

#include <gdcmFragment.h>
#include <gdcmJPEG2000Codec.h>
#include <gdcmJPEGCodec.h>
#include <gdcmJPEGLSCodec.h>
#include <gdcmRLECodec.h>
#include <gdcmReader.h>
#include <gdcmSequenceOfFragments.h>

#include "connection.h"
#include "dicom_file.h"

namespace
{

const gdcm::Tag pixel_tag(0x7fe0, 0x0010);

struct Fragment {
    uint64_t offset, bytes;
};

/* A frame in memory: samples in the machine's byte order, in the low bits from `shift` on. */
struct Samples {
    const char *data;
    unsigned bytes; /* of a sample */
    unsigned stored, shift;
    bool is_signed;
    bool planar;
    trip_dicom_colour colour;
};

uint32_t word_at(const unsigned char *p)
{
    return (uint32_t)p[0] | (uint32_t)p[1] << 8 | (uint32_t)p[2] << 16 | (uint32_t)p[3] << 24;
}

void swap_bytes(char *data, size_t count, unsigned bytes)
{
    for (size_t i = 0; i < count; i++)
        std::reverse(data + i * bytes, data + (i + 1) * bytes);
}

/* Returns sample i without its unused bits. */
template <typename Unsigned> int64_t sample_at(const Samples &s, size_t i)
{
    Unsigned v;
    std::memcpy(&v, s.data + i * sizeof v, sizeof v);
    const unsigned bits = 8 * sizeof v;
    const int64_t value = (int64_t)((uint64_t)v >> s.shift);
    const uint64_t mask =
        s.stored >= bits ? UINT64_MAX >> (64 - bits) : (UINT64_C(1) << s.stored) - 1;
    const uint64_t low = (uint64_t)value & mask;
    const bool negative = s.is_signed && (low >> (std::min(s.stored, bits) - 1) & 1);
    return negative ? (int64_t)(low | ~mask) : (int64_t)low;
}

int64_t sample_of(const Samples &s, size_t i)
{
    return s.bytes == 1   ? sample_at<uint8_t>(s, i)
           : s.bytes == 2 ? sample_at<uint16_t>(s, i)
                          : sample_at<uint32_t>(s, i);
}

/* Rec. ITU-R BT.709-6, 3.2, of the stored numbers. */
double luma(double red, double green, double blue)
{
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue;
}

double palette_luma(const trip_dicom_palette &palette, int64_t value)
{
    double colour[3];
    for (int c = 0; c < 3; c++) {
        const double last = (double)palette.channel[c].size() - 1;
        const double at = std::min(std::max((double)value - palette.first, 0.0), last);
        colour[c] = palette.channel[c][(size_t)at];
    }
    return luma(colour[0], colour[1], colour[2]);
}

/* Rec. ITU-R BT.601-7 with the full range, as DICOM demands (PS3.3, C.7.6.3.1.2). */
double ybr_luma(const double v[3], unsigned stored)
{
    const double most = std::ldexp(1.0, (int)stored) - 1, half = std::ldexp(1.0, (int)stored - 1);
    const double blue = v[1] - half, red = v[2] - half;
    auto clamp = [&](double x) { return std::min(std::max(x, 0.0), most); };
    return luma(clamp(v[0] + 1.402 * red), clamp(v[0] - 0.344136 * blue - 0.714136 * red),
                clamp(v[0] + 1.772 * blue));
}

/* Expands pairs of pixels (luma, luma, blue, red) to three samples a pixel. */
void expand_422(const unsigned char *from, const trip_dicom_pixels &p, char *to)
{
    for (int64_t y = 0; y < p.rows; y++)
        for (int64_t x = 0; x < p.columns; x++) {
            const unsigned char *pair = from + 4 * (y * ((p.columns + 1) / 2) + x / 2);
            *to++ = (char)pair[x & 1];
            *to++ = (char)pair[2];
            *to++ = (char)pair[3];
        }
}

gdcm::PhotometricInterpretation photometric_of(const trip_dicom_pixels &p)
{
    using PI = gdcm::PhotometricInterpretation;
    switch (p.colour) {
    case trip_dicom_colour::RGB:
        return PI::RGB;
    case trip_dicom_colour::YBR:
        return PI::YBR_FULL;
    case trip_dicom_colour::YBR_422:
        return PI::YBR_FULL_422;
    case trip_dicom_colour::PALETTE:
        return PI::PALETTE_COLOR;
    default:
        return PI::MONOCHROME2;
    }
}

/* JPEG-LS needs the size of its output. */
template <typename Codec> void set_length(Codec &, uint64_t)
{
}

void set_length(gdcm::JPEGLSCodec &codec, uint64_t bytes)
{
    codec.SetBufferLength(bytes);
}

/* Decodes run lengths. The output holds one plane for each byte of a sample, the highest first, one
 * sample after the other. GDCM combines the bytes of grey values only, so it gets bytes to decode.
 */
bool decode_runs(const trip_dicom_pixels &p, const gdcm::DataElement &in, gdcm::DataElement &out)
{
    gdcm::RLECodec codec;
    const unsigned planes = p.samples * (p.allocated / 8);
    const unsigned dimensions[3] = { (unsigned)p.columns, (unsigned)p.rows * planes, 1 };
    if (!codec.CanDecode((gdcm::TransferSyntax::TSType)p.syntax))
        return false;
    codec.SetNumberOfDimensions(2);
    codec.SetDimensions(dimensions);
    codec.SetPhotometricInterpretation(gdcm::PhotometricInterpretation::MONOCHROME2);
    codec.SetPixelFormat(gdcm::PixelFormat(1, 8, 8, 7, 0));
    codec.SetBufferLength(p.frame_bytes());
    return codec.Decode(in, out);
}

/* Combines the planes of decode_runs() to samples in the machine's byte order. */
void combine_planes(const trip_dicom_pixels &p, const char *planes, char *to)
{
    const size_t count = (size_t)(p.columns * p.rows), bytes = p.allocated / 8;
    for (size_t c = 0; c < p.samples; c++)
        for (size_t b = 0; b < bytes; b++) {
            const char *plane = planes + (c * bytes + b) * count;
            for (size_t i = 0; i < count; i++)
                to[(c * count + i) * bytes + (bytes - 1 - b)] = plane[i];
        }
}

template <typename Codec>
bool decode_with(const trip_dicom_pixels &p, const gdcm::DataElement &in, gdcm::DataElement &out,
                 Samples &s)
{
    Codec codec;
    const unsigned dimensions[3] = { (unsigned)p.columns, (unsigned)p.rows, 1 };
    if (!codec.CanDecode((gdcm::TransferSyntax::TSType)p.syntax))
        return false;
    codec.SetNumberOfDimensions(2);
    codec.SetDimensions(dimensions);
    codec.SetPlanarConfiguration(p.planar);
    codec.SetPhotometricInterpretation(photometric_of(p));
    codec.SetPixelFormat(gdcm::PixelFormat((uint16_t)p.samples, (uint16_t)p.allocated,
                                           (uint16_t)p.stored, (uint16_t)p.high, p.is_signed));
    set_length(codec, p.frame_bytes());
    if (!codec.Decode(in, out))
        return false;
    s.planar = codec.GetPlanarConfiguration() == 1;
    return true;
}

} // namespace

struct trip_dicom_reader::state {
    void open(const trip_dicom_file &f);
    void index_fragments(const trip_dicom_file &f);
    void group_fragments(const trip_dicom_file &f, const std::vector<uint32_t> &table);
    void load_whole(const trip_dicom_file &f);
    void read_bytes(const trip_dicom_file &f, uint64_t offset, uint64_t bytes, char *to);
    void load(const trip_dicom_file &f, int64_t frame);
    void load_plain(const trip_dicom_file &f, int64_t frame);
    void unpack_bits(const trip_dicom_file &f, int64_t frame);
    void decompress(const trip_dicom_file &f, int64_t frame);

    std::string path; /* of the open file */
    std::unique_ptr<std::istream> stream;
    std::string whole;               /* the pixels that GDCM returned at once */
    std::vector<Fragment> fragments; /* of a compressed file, and the first one of each frame */
    std::vector<size_t> first_of;
    uint64_t first_offset = 0; /* of the first fragment's item */
    int64_t frame = -1;        /* in memory */
    Samples samples = {};
    gdcm::DataElement decompressed;
    trip_slice_buffer buffer, packed;
    uint64_t reserved = 0;
};

trip_dicom_reader::trip_dicom_reader() : state_(new state)
{
}

trip_dicom_reader::~trip_dicom_reader() = default;

void trip_dicom_reader::reserve(trip_budget *budget, const trip_dicom_file &file)
{
    const trip_dicom_pixels &p = file.pixels;
    const uint64_t count = (uint64_t)p.columns * (uint64_t)p.rows * p.samples;
    const uint64_t bytes = count * std::max(p.allocated / 8, 1u);
    /* A decoder keeps a frame of its own. */
    state_->buffer.take(budget, file.path, bytes * (p.compressed ? 2 : 1) + 8);
    state_->packed.take(budget, file.path, p.frame_bytes() + 8);
}

void trip_dicom_reader::state::read_bytes(const trip_dicom_file &f, uint64_t offset, uint64_t bytes,
                                          char *to)
{
    if (f.pixels.in_memory) {
        if (offset > whole.size() || bytes > whole.size() - offset)
            throw trip_slice_error(f.path, "has pixel data of the wrong size");
        std::memcpy(to, whole.data() + offset, bytes);
        return;
    }
    stream->clear();
    stream->seekg((std::streamoff)(f.pixels.offset + offset));
    stream->read(to, (std::streamsize)bytes);
    if ((uint64_t)stream->gcount() != bytes)
        throw trip_slice_error(f.path, "is cut off: its pixels end early");
}

void trip_dicom_reader::state::load_whole(const trip_dicom_file &f)
{
    gdcm::Reader reader;
    reader.SetStream(*stream);
    reader.ReadUpToTag(pixel_tag);
    for (uint16_t element : { 0x0008, 0x0009 }) {
        const gdcm::Tag tag(0x7fe0, element);
        const gdcm::DataSet &set = reader.GetFile().GetDataSet();
        const gdcm::ByteValue *bytes =
            set.FindDataElement(tag) ? set.GetDataElement(tag).GetByteValue() : nullptr;
        if (bytes && bytes->GetPointer()) {
            whole.assign(bytes->GetPointer(), bytes->GetLength());
            return;
        }
    }
    throw trip_slice_error(f.path, "cannot be read: its pixels are damaged");
}

/* Assigns fragments to frames, by their number or by the table of offsets. */
void trip_dicom_reader::state::group_fragments(const trip_dicom_file &f,
                                               const std::vector<uint32_t> &table)
{
    const size_t frames = (size_t)f.pixels.frames;
    first_of.clear();
    if (fragments.size() == frames || frames == 1) {
        for (size_t i = 0; i < frames; i++)
            first_of.push_back(i);
    } else if (table.size() == frames) {
        size_t at = 0;
        for (uint32_t offset : table) {
            while (at < fragments.size() && fragments[at].offset - 8 < first_offset + offset)
                at++;
            first_of.push_back(at);
        }
    } else {
        throw trip_slice_error(f.path, "has " + std::to_string(fragments.size()) +
                                           " fragments of compressed pixels for " +
                                           std::to_string(frames) + " frames, without a table");
    }
    first_of.push_back(fragments.size());
    for (size_t i = 0; i < frames; i++)
        if (first_of[i] >= first_of[i + 1])
            throw trip_slice_error(f.path, "has no pixels for frame " + std::to_string(i + 1));
}

/* Finds the fragments of compressed pixels. The first item is the table of offsets. */
void trip_dicom_reader::state::index_fragments(const trip_dicom_file &f)
{
    std::vector<uint32_t> table;
    fragments.clear();
    stream->seekg(0, std::ios::end);
    const uint64_t file_bytes = (uint64_t)stream->tellg();
    bool first = true;
    for (uint64_t at = 0;;) {
        unsigned char head[8];
        /* Some files end without the mark of the end. */
        if (f.pixels.offset + at + 8 > file_bytes && !fragments.empty())
            break;
        read_bytes(f, at, sizeof head, (char *)head);
        const uint32_t tag = word_at(head), bytes = word_at(head + 4);
        if (tag == 0xe0ddfffe)
            break;
        if (tag != 0xe000fffe)
            throw trip_slice_error(f.path, "has compressed pixels that are damaged");
        at += 8;
        if (bytes > file_bytes || f.pixels.offset + at > file_bytes - bytes)
            throw trip_slice_error(f.path, "is cut off: its compressed pixels end early");
        if (first && bytes <= 4 * (uint64_t)f.pixels.frames) {
            table.resize(bytes / 4);
            read_bytes(f, at, 4 * table.size(), (char *)table.data());
        }
        if (first)
            first_offset = at + bytes;
        else
            fragments.push_back({ at, bytes });
        at += bytes;
        first = false;
    }
    group_fragments(f, table);
}

void trip_dicom_reader::state::open(const trip_dicom_file &f)
{
    if (path == f.path)
        return;
    path.clear();
    frame = -1;
    whole = std::string();
    stream = trip_dicom_open(f.path);
    if (f.pixels.in_memory)
        load_whole(f);
    else if (f.pixels.compressed)
        index_fragments(f);
    path = f.path;
}

/* The bits of all frames follow one another, the lowest bit of a byte first. */
void trip_dicom_reader::state::unpack_bits(const trip_dicom_file &f, int64_t number)
{
    const trip_dicom_pixels &p = f.pixels;
    const uint64_t count = (uint64_t)(p.columns * p.rows), begin = count * (uint64_t)number;
    uint64_t from = begin / 8, to = (begin + count + 7) / 8;
    if (p.words) {
        from &= ~UINT64_C(1);
        to = std::min((to + 1) & ~UINT64_C(1), p.bytes);
    }
    read_bytes(f, from, to - from, packed.data());
    for (uint64_t i = 0; i < count; i++) {
        const uint64_t byte = (begin + i) / 8 ^ (p.words ? 1 : 0);
        const unsigned char value = byte < to ? (unsigned char)packed.data()[byte - from] : 0;
        buffer.data()[i] = value >> ((begin + i) % 8) & 1;
    }
    samples = { buffer.data(), 1, 1, 0, false, false, p.colour };
}

void trip_dicom_reader::state::load_plain(const trip_dicom_file &f, int64_t number)
{
    const trip_dicom_pixels &p = f.pixels;
    const uint64_t bytes = p.frame_bytes(), begin = bytes * (uint64_t)number;
    const unsigned size = p.allocated / 8;
    samples = { buffer.data(), size,     p.stored, p.high + 1 - p.stored,
                p.is_signed,   p.planar, p.colour };
    if (p.floating)
        samples.shift = 0;
    if (p.colour == trip_dicom_colour::YBR_422) {
        read_bytes(f, begin, bytes, packed.data());
        expand_422((const unsigned char *)packed.data(), p, buffer.data());
        return;
    }
    if (p.words && size == 1) { /* bytes in words of the other byte order */
        const uint64_t from = begin & ~UINT64_C(1);
        const uint64_t to = std::min((begin + bytes + 1) & ~UINT64_C(1), p.bytes);
        read_bytes(f, from, to - from, packed.data());
        for (uint64_t i = begin; i < begin + bytes; i++)
            buffer.data()[i - begin] = (i ^ 1) < to ? packed.data()[(i ^ 1) - from] : 0;
        return;
    }
    read_bytes(f, begin, bytes, buffer.data());
    if (p.swap && size > 1)
        swap_bytes(buffer.data(), bytes / size, size);
}

void trip_dicom_reader::state::decompress(const trip_dicom_file &f, int64_t number)
{
    const trip_dicom_pixels &p = f.pixels;
    gdcm::SmartPointer<gdcm::SequenceOfFragments> sequence = new gdcm::SequenceOfFragments;
    for (size_t i = first_of[(size_t)number]; i < first_of[(size_t)number + 1]; i++) {
        std::string bytes(fragments[i].bytes, 0);
        read_bytes(f, fragments[i].offset, bytes.size(), &bytes[0]);
        gdcm::Fragment fragment;
        fragment.SetByteValue(bytes.data(), (uint32_t)bytes.size());
        sequence->AddFragment(fragment);
    }
    gdcm::DataElement in(pixel_tag, 0, gdcm::VR::OB);
    in.SetValue(*sequence);
    samples = { nullptr, 0, p.stored, 0, p.is_signed, false, p.colour };
    const bool good = decode_with<gdcm::JPEGCodec>(p, in, decompressed, samples) ||
                      decode_with<gdcm::JPEGLSCodec>(p, in, decompressed, samples) ||
                      decode_with<gdcm::JPEG2000Codec>(p, in, decompressed, samples);
    const bool runs = !good && decode_runs(p, in, decompressed);
    const gdcm::ByteValue *out = good || runs ? decompressed.GetByteValue() : nullptr;
    const uint64_t count = (uint64_t)p.columns * (uint64_t)p.rows * p.samples;
    const char *name = gdcm::TransferSyntax::GetTSString((gdcm::TransferSyntax::TSType)p.syntax);
    if (!out || !out->GetPointer())
        throw trip_slice_error(f.path, std::string("has compressed pixels that cannot be read, of "
                                                   "the transfer syntax ") +
                                           name);
    /* Decoders round an odd number of bytes up. */
    for (unsigned size : { 4u, 2u, 1u })
        if (!samples.bytes && out->GetLength() >= count * size)
            samples.bytes = size;
    if (!samples.bytes || out->GetLength() > count * samples.bytes + 1)
        throw trip_slice_error(f.path, "has compressed pixels of another size than it states");
    samples.data = out->GetPointer();
    if (runs) {
        combine_planes(p, out->GetPointer(), buffer.data());
        samples.data = buffer.data();
        samples.planar = true;
    }
    samples.stored = std::min(p.stored, 8 * samples.bytes);
}

void trip_dicom_reader::state::load(const trip_dicom_file &f, int64_t number)
{
    open(f);
    if (frame == number)
        return;
    trip_connection_decode(f.path);
    frame = -1;
    if (f.pixels.compressed)
        decompress(f, number);
    else if (f.pixels.allocated == 1)
        unpack_bits(f, number);
    else
        load_plain(f, number);
    frame = number;
}

namespace
{

template <typename Unsigned, typename T>
void put_samples(const Samples &s, size_t from, size_t count, T *to)
{
    if (sizeof(Unsigned) == sizeof(T) && s.shift == 0 && s.stored == 8 * sizeof(T))
        std::memcpy(to, s.data + from * sizeof(T), count * sizeof(T));
    else
        for (size_t i = 0; i < count; i++)
            to[i] = (T)sample_at<Unsigned>(s, from + i);
}

template <typename T> void put_grey(const Samples &s, size_t from, size_t count, T *to)
{
    if (s.bytes == 1)
        put_samples<uint8_t>(s, from, count, to);
    else if (s.bytes == 2)
        put_samples<uint16_t>(s, from, count, to);
    else
        put_samples<uint32_t>(s, from, count, to);
}

void put_colour(const Samples &s, const trip_dicom_pixels &p, size_t from, size_t count, float *to)
{
    const size_t plane = (size_t)(p.columns * p.rows);
    for (size_t i = from; i < from + count; i++) {
        double v[3] = { 0, 0, 0 };
        if (p.colour == trip_dicom_colour::PALETTE) {
            *to++ = (float)palette_luma(*p.palette, sample_of(s, i));
            continue;
        }
        for (size_t c = 0; c < 3; c++)
            v[c] = (double)sample_of(s, s.planar ? c * plane + i : 3 * i + c);
        *to++ = (float)(p.colour == trip_dicom_colour::RGB ? luma(v[0], v[1], v[2])
                                                           : ybr_luma(v, s.stored));
    }
}

void put_row(const Samples &s, const trip_dicom_file &f, size_t from, size_t count, char *to)
{
    const trip_dicom_pixels &p = f.pixels;
    if (p.colour != trip_dicom_colour::GREY)
        return put_colour(s, p, from, count, (float *)to);
    switch (f.type()) {
    case TRIP_U8:
        return put_grey(s, from, count, (uint8_t *)to);
    case TRIP_I8:
        return put_grey(s, from, count, (int8_t *)to);
    case TRIP_U16:
        return put_grey(s, from, count, (uint16_t *)to);
    case TRIP_I16:
        return put_grey(s, from, count, (int16_t *)to);
    case TRIP_U32:
        return put_grey(s, from, count, (uint32_t *)to);
    case TRIP_I32:
        return put_grey(s, from, count, (int32_t *)to);
    default: /* floating */
        std::memcpy(to, s.data + from * s.bytes, count * s.bytes);
    }
}

} // namespace

void trip_dicom_reader::read(const trip_dicom_file &file, const trip_dicom_slice &slice,
                             void *values)
{
    state_->load(file, slice.frame);
    const size_t row_bytes = (size_t)file.width * trip_scalar_bytes(file.type());
    for (int64_t j = 0; j < file.height; j++) {
        const int64_t x = slice.tile % file.tiles * file.width;
        const int64_t y = slice.tile / file.tiles * file.height + j;
        put_row(state_->samples, file, (size_t)(y * file.pixels.columns + x), (size_t)file.width,
                (char *)values + (size_t)j * row_bytes);
    }
}
