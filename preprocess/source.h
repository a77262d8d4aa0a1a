/* The files that a volume is read from: which they are, whether they changed, and what they hold.
 * Nothing here reads values; finding the files reads headers and lists folders only. One thread. */
#ifndef TRIP_SOURCE_H
#define TRIP_SOURCE_H

#include "volume.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A file as it was when it was found. */
typedef struct trip_source_file {
    char *path;
    uint64_t inode, bytes;
    int64_t modified_ns, changed_ns; /* since 1970; the second cannot be set by programs */
} trip_source_file;

/* Zeroed at first. */
typedef struct trip_source {
    const char *format; /* "nrrd", "openvdb", ... */
    trip_source_file *files;
    size_t count;
    uint64_t bytes; /* of all files */
} trip_source;

/* `path` as trip_volume_open() takes it. Finds every file that the volume is read from; of a folder
 * or pattern perhaps more than those. */
int trip_source_find(trip_source *s, const char *path, const trip_volume_params *params);
void trip_source_free(trip_source *s);

/* False where a file changed so shortly before that another change might leave the same times: file
 * systems count them in steps of up to two seconds. */
bool trip_source_is_settled(const trip_source *s);

/* 128 bits as hexadecimal digits. */
typedef struct trip_digest {
    char text[33];
} trip_digest;

/* Of `text` and the files' names, places and times. */
int trip_source_digest_state(const trip_source *s, const char *text, trip_digest *out);

/* Of `text` and all bytes of the files; of their names only what readers go by. `progress` may be
 * NULL. */
int trip_source_digest_content(const trip_source *s, const char *text, trip_digest *out,
                               void (*progress)(void *user, uint64_t done, uint64_t total),
                               void *user);

#ifdef __cplusplus
}
#endif

#endif
