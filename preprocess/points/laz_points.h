/* Decodes the points of a chunk of LAZ into records of LAS. The first record of a chunk is stored
 * plainly. Point formats 0 to 5 have one code for all fields of a point. Point formats 6 to 10 have
 * a layer for each field. One thread at a time. */
#ifndef TRIP_LAZ_POINTS_H
#define TRIP_LAZ_POINTS_H

#include <stddef.h>

#include "laz_codes.h"

enum { TRIP_LAZ_ITEMS_MAX = 5, TRIP_LAZ_LAYERS_MAX = 10 };

/* Fields that are coded together, with the numbers of the format. */
typedef enum trip_laz_item_type {
    TRIP_LAZ_BYTES = 0,
    TRIP_LAZ_POINT_10 = 6,
    TRIP_LAZ_TIME = 7,
    TRIP_LAZ_COLOUR = 8,
    TRIP_LAZ_WAVE = 9,
    TRIP_LAZ_POINT_14 = 10,
    TRIP_LAZ_COLOUR_14 = 11,
    TRIP_LAZ_COLOUR_NIR_14 = 12,
    TRIP_LAZ_WAVE_14 = 13,
    TRIP_LAZ_BYTES_14 = 14,
} trip_laz_item_type;

typedef struct trip_laz_item {
    uint16_t type, bytes, version;
} trip_laz_item;

typedef struct trip_laz_items {
    unsigned count;
    trip_laz_item items[TRIP_LAZ_ITEMS_MAX];
    uint32_t record_bytes;
} trip_laz_items;

/* Point formats 0 to 5. */
typedef struct trip_laz_pointwise trip_laz_pointwise;
int trip_laz_pointwise_create(trip_laz_pointwise **out, const trip_laz_items *items,
                              const char *path);
void trip_laz_pointwise_destroy(trip_laz_pointwise *p);
/* Begins a chunk with its first record. */
void trip_laz_pointwise_begin(trip_laz_pointwise *p, const unsigned char *record);
/* Replaces the record before by the next one. */
void trip_laz_pointwise_next(trip_laz_pointwise *p, trip_laz_decoder *d, unsigned char *record);

/* Point formats 6 to 10. Some fields are not decoded and keep the values of the first record: scan
 * angle, user data, point source, near infrared, waves and further bytes. */
typedef struct trip_laz_layered trip_laz_layered;
int trip_laz_layered_create(trip_laz_layered **out, const trip_laz_items *items, int fd,
                            const char *path);
void trip_laz_layered_destroy(trip_laz_layered *p);
/* Returns the number of bytes that tell the sizes of the layers. */
size_t trip_laz_layered_sizes_bytes(const trip_laz_layered *p);
/* Begins a chunk with its first record. `sizes` are the sizes of its layers, which begin at `at` in
 * the file. Returns false if the layers end after `end`. */
bool trip_laz_layered_begin(trip_laz_layered *p, const unsigned char *record,
                            const unsigned char *sizes, uint64_t at, uint64_t end);
void trip_laz_layered_next(trip_laz_layered *p, unsigned char *record);
/* Returns whether all points so far came from bytes of the layers. */
bool trip_laz_layered_sound(const trip_laz_layered *p);

#endif
