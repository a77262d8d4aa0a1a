#include <string.h>

#include "image_helper.h"

trip_image_kind trip_image_kind_of(const unsigned char *head, size_t bytes)
{
    static const struct {
        trip_image_kind kind;
        size_t offset, bytes;
        const char *magic;
    } magics[] = {
        /* The 128 bytes before the mark are free, and some programs put a TIFF header there. */
        { TRIP_IMAGE_DICOM, 128, 4, "DICM" },
        { TRIP_IMAGE_TIFF, 0, 4, "II*\0" },   { TRIP_IMAGE_TIFF, 0, 4, "MM\0*" },
        { TRIP_IMAGE_TIFF, 0, 4, "II+\0" },   { TRIP_IMAGE_TIFF, 0, 4, "MM\0+" },
        { TRIP_IMAGE_EXR, 0, 4, "v/1\1" },    { TRIP_IMAGE_PNG, 0, 6, "\x89PNG\r\n" },
    };
    for (size_t i = 0; i < sizeof magics / sizeof magics[0]; i++)
        if (bytes >= magics[i].offset + magics[i].bytes &&
            memcmp(head + magics[i].offset, magics[i].magic, magics[i].bytes) == 0)
            return magics[i].kind;
    return TRIP_IMAGE_OTHER;
}

const char *trip_image_kind_name(trip_image_kind kind)
{
    static const char *const names[] = { "unknown", "TIFF", "PNG", "EXR", "DICOM" };
    return names[kind];
}
