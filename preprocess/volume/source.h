/* The files of a volume: which they are, whether they changed, and hashes of their state and
 * content. Finding them reads headers and lists folders only. One thread. */
#ifndef TRIP_SOURCE_H
#define TRIP_SOURCE_H

#include "volume_info.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The state of a file when it was found. */
typedef struct trip_source_file {
    char *path;
    uint64_t inode, bytes;
    int64_t modified_ns, changed_ns; /* since 1970; programs cannot set the time of change */
} trip_source_file;

/* Must be zeroed at first. */
typedef struct trip_source {
    const char *format; /* "nrrd", "openvdb", ... */
    trip_source_file *files;
    size_t count;
    uint64_t bytes; /* of all files */
} trip_source;

/* Finds every file that the volume is read from. For a folder or a pattern there may be more.
 * `path` is as for trip_volume_open(). Reports failures. */
int trip_source_find(trip_source *s, const char *path, const trip_volume_params *params);
/* Adds a file to a source that is zeroed or found. The caller sets `format`. */
int trip_source_add(trip_source *s, const char *path);
void trip_source_free(trip_source *s);

/* Returns false if a file changed in the last two seconds. A further change might then leave its
 * times as they are, since file systems count in steps of up to two seconds. */
bool trip_source_is_stable(const trip_source *s);

/* A hash of 128 bits as hexadecimal digits. */
typedef struct trip_digest {
    char text[33];
} trip_digest;

/* Hashes a text alone. */
trip_digest trip_source_digest_text(const char *text);

/* Hashes `text` with the files' paths, inodes, lengths and times. */
int trip_source_digest_state(const trip_source *s, const char *text, trip_digest *out);

/* Hashes `text` with all bytes of the files, and with the parts of their names that readers use.
 * `progress` may be NULL; it gets bytes. */
int trip_source_digest_content(const trip_source *s, const char *text, trip_digest *out,
                               void (*progress)(void *user, uint64_t done, uint64_t total),
                               void *user);

#ifdef __cplusplus
}
#endif

#endif
