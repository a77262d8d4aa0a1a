#include <stdbool.h>
#include <string.h>

#include "image_helper.h"

/* Reads the head of a DICOM element, little-endian, with or without its type. Returns the bytes up
 * to the next element, or 0 if it is none of the groups 2 and 8, or follows `*tag` in a wrong
 * order. */
static size_t element_bytes(const unsigned char *p, size_t left, unsigned *tag)
{
    static const char types[] = "AE CS DA DS DT IS LO PN SH ST TM UI UL US";
    if (left < 8)
        return 0;
    const unsigned group = p[0] | p[1] << 8, next = group << 16 | p[2] | (unsigned)p[3] << 8;
    const char type[3] = { (char)p[4], (char)p[5], 0 };
    const bool typed = p[4] && p[5] && strstr(types, type);
    if (memcmp(p, "\2\0\1\0OB", 6) == 0 && left >= 12) { /* the version of the file's head */
        *tag = 0x20002;
        return 12 + (size_t)p[8];
    }
    const size_t bytes = typed ? (size_t)(p[6] | p[7] << 8)
                               : p[4] | (size_t)p[5] << 8 | (size_t)p[6] << 16 | (size_t)p[7] << 24;
    if ((group != 2 && group != 8) || next < *tag || bytes > 256 || bytes % 2)
        return 0;
    *tag = next + 1;
    return 8 + bytes;
}

/* Whether a file is DICOM without the mark: old files begin with their first element. */
static bool is_bare_dicom(const unsigned char *head, size_t bytes)
{
    unsigned tag = 0;
    const size_t first = element_bytes(head, bytes, &tag);
    return first && first < bytes && element_bytes(head + first, bytes - first, &tag);
}

trip_image_kind trip_image_kind_of(const unsigned char *head, size_t bytes)
{
    static const struct {
        trip_image_kind kind;
        size_t offset, bytes;
        const char *magic;
    } magics[] = {
        /* The 128 bytes before the mark are free, and some programs put a TIFF header there. */
        { TRIP_IMAGE_DICOM, 128, 4, "DICM" },    { TRIP_IMAGE_TIFF, 0, 4, "II*\0" },
        { TRIP_IMAGE_TIFF, 0, 4, "MM\0*" },      { TRIP_IMAGE_TIFF, 0, 4, "II+\0" },
        { TRIP_IMAGE_TIFF, 0, 4, "MM\0+" },      { TRIP_IMAGE_EXR, 0, 4, "v/1\1" },
        { TRIP_IMAGE_PNG, 0, 6, "\x89PNG\r\n" },
    };
    for (size_t i = 0; i < sizeof magics / sizeof magics[0]; i++)
        if (bytes >= magics[i].offset + magics[i].bytes &&
            memcmp(head + magics[i].offset, magics[i].magic, magics[i].bytes) == 0)
            return magics[i].kind;
    return is_bare_dicom(head, bytes) ? TRIP_IMAGE_DICOM : TRIP_IMAGE_OTHER;
}

const char *trip_image_kind_name(trip_image_kind kind)
{
    static const char *const names[] = { "unknown", "TIFF", "PNG", "EXR", "DICOM" };
    return names[kind];
}
