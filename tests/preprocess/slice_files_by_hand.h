/* Writes slices of the sample volume as TIFF, PNG, EXR and DICOM files. It uses none of the
 * libraries that read these files, so that errors of a library show. */
#ifndef SLICE_FILES_BY_HAND_H
#define SLICE_FILES_BY_HAND_H

#include "volume_files.h"

static inline void append_u16(bytes *b, unsigned v)
{
    append_word(b, v, 2, false);
}

static inline void append_u32(bytes *b, uint64_t v)
{
    append_word(b, v, 4, false);
}

static inline void patch_u32(bytes *b, size_t at, size_t v)
{
    for (int i = 0; i < 4; i++)
        b->data[at + (size_t)i] = (unsigned char)(v >> (8 * i));
}

static inline void append_tag(bytes *b, unsigned tag, unsigned type, uint64_t value)
{
    append_u16(b, tag);
    append_u16(b, type);
    append_u32(b, 1);
    append_u32(b, value);
}

enum { TIFF_SHORT = 3, TIFF_LONG = 4 };

static inline unsigned tiff_sample_format(trip_scalar type)
{
    return type >= TRIP_F16 ? 3 : is_signed(type) ? 2 : 1;
}

/* Appends slices [first, first + count) as little-endian, uncompressed pages. `wider` adds to the
 * width to make it wrong. */
static inline void append_tiff(bytes *b, trip_scalar type, int first, int count, int wider)
{
    append(b, "II*\0", 4);
    size_t link = b->count;
    append_u32(b, 0);
    for (int k = first; k < first + count; k++) {
        size_t data = b->count;
        append_slices(b, type, false, k, 1);
        b->count += (size_t)(wider * NY) * trip_scalar_bytes(type);
        size_t data_bytes = b->count - data;
        patch_u32(b, link, b->count);
        append_u16(b, 10);
        append_tag(b, 256, TIFF_LONG, (uint64_t)(NX + wider));
        append_tag(b, 257, TIFF_LONG, NY);
        append_tag(b, 258, TIFF_SHORT, 8 * trip_scalar_bytes(type));
        append_tag(b, 259, TIFF_SHORT, 1);
        append_tag(b, 262, TIFF_SHORT, 1);
        append_tag(b, 273, TIFF_LONG, data);
        append_tag(b, 277, TIFF_SHORT, 1);
        append_tag(b, 278, TIFF_LONG, NY);
        append_tag(b, 279, TIFF_LONG, data_bytes);
        append_tag(b, 339, TIFF_SHORT, tiff_sample_format(type));
        link = b->count;
        append_u32(b, 0);
    }
}

/* Appends a TIFF with a single three-dimensional tile of 16 x 16 x 16 voxels. */
static inline void append_deep_tiff(bytes *b)
{
    enum { SIDE = 16, VOXELS_IN_TILE = SIDE * SIDE * SIDE };
    append(b, "II*\0", 4);
    append_u32(b, 8 + VOXELS_IN_TILE);
    b->count += VOXELS_IN_TILE;
    append_u16(b, 12);
    append_tag(b, 256, TIFF_LONG, SIDE);
    append_tag(b, 257, TIFF_LONG, SIDE);
    append_tag(b, 258, TIFF_SHORT, 8);
    append_tag(b, 259, TIFF_SHORT, 1);
    append_tag(b, 262, TIFF_SHORT, 1);
    append_tag(b, 277, TIFF_SHORT, 1);
    append_tag(b, 322, TIFF_LONG, SIDE);
    append_tag(b, 323, TIFF_LONG, SIDE);
    append_tag(b, 324, TIFF_LONG, 8);
    append_tag(b, 325, TIFF_LONG, VOXELS_IN_TILE);
    append_tag(b, 32997, TIFF_LONG, SIDE);
    append_tag(b, 32998, TIFF_LONG, SIDE);
    append_u32(b, 0);
}

static inline void append_png_chunk(bytes *b, const char *name, const void *data, size_t count)
{
    append_word(b, count, 4, true);
    size_t start = b->count;
    append(b, name, 4);
    append(b, data, count);
    append_word(b, crc32(0, b->data + start, (unsigned)(b->count - start)), 4, true);
}

/* Appends a PNG of rows that start with the number of their filter. */
static inline void append_png_file(bytes *b, unsigned width, unsigned height, unsigned bits,
                                   unsigned colour_type, const bytes *rows)
{
    bytes header = { .count = 0 }, packed = { .count = 0 };
    append_word(&header, width, 4, true);
    append_word(&header, height, 4, true);
    unsigned char rest[5] = { (unsigned char)bits, (unsigned char)colour_type };
    append(&header, rest, 5);
    append_zlib(&packed, rows);
    append(b, "\x89PNG\r\n\x1a\n", 8);
    append_png_chunk(b, "IHDR", header.data, header.count);
    append_png_chunk(b, "IDAT", packed.data, packed.count);
    append_png_chunk(b, "IEND", "", 0);
}

/* Appends slice k with `channels` channels. Colour channels repeat the value, and the last of 2 or
 * 4 channels is an alpha of one half. */
static inline void append_png(bytes *b, trip_scalar type, int k, int channels)
{
    static const unsigned char colour_type[] = { 0, 0, 4, 2, 6 };
    bytes raw = { .count = 0 };
    for (int j = 0; j < NY; j++) {
        append_word(&raw, 0, 1, true);
        for (int i = 0; i < NX; i++)
            for (int c = 0; c < channels; c++)
                append_value(&raw, type,
                             c % 2 == 1 && c == channels - 1 ? 128 : sample(type, i, j, k), true);
    }
    append_png_file(b, NX, NY, 8 * trip_scalar_bytes(type), colour_type[channels], &raw);
}

static inline void append_exr_attribute(bytes *b, const char *name, const char *type,
                                        const void *data, size_t count)
{
    append(b, name, strlen(name) + 1);
    append(b, type, strlen(type) + 1);
    append_u32(b, count);
    append(b, data, count);
}

/* Appends slice k as an uncompressed EXR with one channel of half (pixel type 1) or float (2). */
static inline void append_exr(bytes *b, trip_scalar type, int k)
{
    const int32_t window[4] = { 0, 0, NX - 1, NY - 1 };
    const float zero[2] = { 0, 0 }, one = 1;
    const unsigned char none = 0;
    bytes channels = { .count = 0 };
    append(&channels, "Y", 2);
    append_u32(&channels, type == TRIP_F16 ? 1 : 2);
    append_u32(&channels, 0);
    append_u32(&channels, 1);
    append_u32(&channels, 1);
    append(&channels, "", 1);
    append_u32(b, 20000630);
    append_u32(b, 2);
    append_exr_attribute(b, "channels", "chlist", channels.data, channels.count);
    append_exr_attribute(b, "compression", "compression", &none, 1);
    append_exr_attribute(b, "dataWindow", "box2i", window, sizeof window);
    append_exr_attribute(b, "displayWindow", "box2i", window, sizeof window);
    append_exr_attribute(b, "lineOrder", "lineOrder", &none, 1);
    append_exr_attribute(b, "pixelAspectRatio", "float", &one, 4);
    append_exr_attribute(b, "screenWindowCenter", "v2f", zero, 8);
    append_exr_attribute(b, "screenWindowWidth", "float", &one, 4);
    append(b, "", 1);
    size_t row_bytes = NX * trip_scalar_bytes(type), first = b->count + 8 * NY;
    for (int j = 0; j < NY; j++)
        append_word(b, first + (size_t)j * (8 + row_bytes), 8, false);
    for (int j = 0; j < NY; j++) {
        append_u32(b, (uint64_t)j);
        append_u32(b, row_bytes);
        for (int i = 0; i < NX; i++)
            append_value(b, type, sample(type, i, j, k), false);
    }
}

/* Contents of a DICOM slice. NULL omits an element. */
typedef struct dicom {
    const char *series, *number, *position, *orientation, *spacing, *thickness, *slope, *inter;
    const char *frames;
    const char *const *frame_slopes, *const *frame_positions; /* for each frame, or NULL */
    unsigned stored, shift; /* bits of the value (0 for all), and unused bits below */
    trip_scalar type;
} dicom;

static inline void append_element(bytes *b, unsigned group, unsigned element, const char *vr,
                                  const void *data, size_t count)
{
    bool is_long = strcmp(vr, "OW") == 0 || strcmp(vr, "OB") == 0 || strcmp(vr, "SQ") == 0;
    size_t padded = (count + 1) & ~(size_t)1;
    append_u16(b, group);
    append_u16(b, element);
    append(b, vr, 2);
    if (is_long)
        append_u16(b, 0);
    append_word(b, padded, is_long ? 4 : 2, false);
    append(b, data, count);
    if (padded > count)
        append(b, strcmp(vr, "UI") == 0 || is_long ? "" : " ", 1);
}

static inline void append_dicom_text(bytes *b, unsigned group, unsigned element, const char *vr,
                                     const char *text)
{
    if (text)
        append_element(b, group, element, vr, text, strlen(text));
}

static inline void append_dicom_u16(bytes *b, unsigned group, unsigned element, unsigned value)
{
    unsigned char data[2] = { (unsigned char)value, (unsigned char)(value >> 8) };
    append_element(b, group, element, "US", data, 2);
}

/* Appends an item of a sequence. */
static inline void append_item(bytes *b, const bytes *item)
{
    append_u16(b, 0xfffe);
    append_u16(b, 0xe000);
    append_u32(b, item->count);
    append(b, item->data, item->count);
}

/* Appends a sequence of one item. */
static inline void append_group(bytes *b, unsigned group, unsigned element, const bytes *item)
{
    bytes items = { .count = 0 };
    append_item(&items, item);
    append_element(b, group, element, "SQ", items.data, items.count);
}

/* Appends one item for each frame, with its slope and position. */
static inline void append_frame_groups(bytes *b, const dicom *d, int count)
{
    bytes frames = { .count = 0 };
    for (int k = 0; k < count; k++) {
        bytes frame = { .count = 0 }, position = { .count = 0 }, scale = { .count = 0 };
        if (d->frame_positions) {
            append_dicom_text(&position, 0x20, 0x32, "DS", d->frame_positions[k]);
            append_group(&frame, 0x20, 0x9113, &position);
        }
        if (d->frame_slopes) {
            append_dicom_text(&scale, 0x28, 0x1053, "DS", d->frame_slopes[k]);
            append_group(&frame, 0x28, 0x9145, &scale);
        }
        append_item(&frames, &frame);
    }
    append_element(b, 0x5200, 0x9230, "SQ", frames.data, frames.count);
}

/* Appends slices [first, first + count) as frames with explicit VR, little-endian. */
static inline void append_dicom(bytes *b, const dicom *d, int first, int count)
{
    unsigned bits = 8 * trip_scalar_bytes(d->type), stored = d->stored ? d->stored : bits;
    bytes meta = { .count = 0 }, pixels = { .count = 0 };
    append_dicom_text(&meta, 2, 0x10, "UI", "1.2.840.10008.1.2.1");
    unsigned char meta_bytes[4] = { (unsigned char)meta.count };
    b->count += 128;
    append_text(b, "DICM");
    append_element(b, 2, 0, "UL", meta_bytes, 4);
    append(b, meta.data, meta.count);
    append_dicom_text(b, 0x18, 0x50, "DS", d->thickness);
    append_dicom_text(b, 0x20, 0x0e, "UI", d->series);
    append_dicom_text(b, 0x20, 0x13, "IS", d->number);
    append_dicom_text(b, 0x20, 0x32, "DS", d->position);
    append_dicom_text(b, 0x20, 0x37, "DS", d->orientation);
    append_dicom_u16(b, 0x28, 2, 1);
    append_dicom_text(b, 0x28, 4, "CS", "MONOCHROME2");
    append_dicom_text(b, 0x28, 8, "IS", d->frames);
    append_dicom_u16(b, 0x28, 0x10, NY);
    append_dicom_u16(b, 0x28, 0x11, NX);
    append_dicom_text(b, 0x28, 0x30, "DS", d->spacing);
    append_dicom_u16(b, 0x28, 0x100, bits);
    append_dicom_u16(b, 0x28, 0x101, stored);
    append_dicom_u16(b, 0x28, 0x102, stored + d->shift - 1);
    append_dicom_u16(b, 0x28, 0x103, is_signed(d->type));
    append_dicom_text(b, 0x28, 0x1052, "DS", d->inter);
    append_dicom_text(b, 0x28, 0x1053, "DS", d->slope);
    if (d->frame_slopes || d->frame_positions)
        append_frame_groups(b, d, count);
    for (int k = first; k < first + count; k++)
        for (int j = 0; j < NY; j++)
            for (int i = 0; i < NX; i++) {
                uint64_t value = (uint64_t)(int64_t)sample(d->type, i, j, k);
                /* Sets an unused bit above the value and one below it. */
                value = (value & ((UINT64_C(1) << stored) - 1)) << d->shift;
                value |= stored + d->shift < bits ? UINT64_C(1) << (bits - 1) : 0;
                value |= d->shift ? 1 : 0;
                append_word(&pixels, value, bits / 8, false);
            }
    append_element(b, 0x7fe0, 0x10, bits > 8 ? "OW" : "OB", pixels.data, pixels.count);
}

#endif
