/* The JSON and the buffers of a glTF file (2.0), .gltf or .glb. Accessors read numbers from the
 * buffers. One thread at a time. */
#ifndef TRIP_GLTF_FILE_H
#define TRIP_GLTF_FILE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "json.h"

typedef struct trip_gltf_buffer {
    int fd; /* -1 if not open yet */
    uint64_t at, bytes;
} trip_gltf_buffer;

typedef struct trip_gltf_file {
    const char *path; /* of the caller */
    trip_budget *budget;
    trip_json json;
    trip_gltf_buffer *buffers;
    int buffer_count;
    uint64_t chunk_at, chunk_bytes; /* binary chunk of a .glb */
} trip_gltf_file;

/* Numbers of an attribute: `count` rows of `components` numbers. */
typedef struct trip_gltf_accessor {
    const trip_gltf_buffer *buffer;
    uint64_t at, count;
    unsigned stride, components, number_bytes;
    int type; /* componentType */
    bool normalised;
} trip_gltf_accessor;

enum { TRIP_GLTF_STRIDE_MAX = 252 };

/* Close it after a failure too. */
int trip_gltf_open(trip_gltf_file *g, const char *path);
void trip_gltf_close(trip_gltf_file *g);

/* Returns element `index` of an array at the top of the JSON, or NULL. */
const struct cJSON *trip_gltf_item(const trip_gltf_file *g, const char *array, int index);
/* Returns the whole number of a member from 0 on, or -1. */
int trip_gltf_index(const struct cJSON *object, const char *name);

/* Prepares to read an accessor with `components` numbers a row. `name` is for failures. */
int trip_gltf_accessor_open(trip_gltf_file *g, int index, unsigned components, const char *name,
                            trip_gltf_accessor *out);

/* Reads `rows` rows from `first` on into `out`, through `room`, which holds rows of
 * TRIP_GLTF_STRIDE_MAX bytes. */
int trip_gltf_accessor_read(const trip_gltf_file *g, const trip_gltf_accessor *a, uint64_t first,
                            size_t rows, unsigned char *room, float *out);

#endif
