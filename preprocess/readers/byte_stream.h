/* Reads the bytes of a file in order and decompresses them. All readers of dense formats use it. It
 * holds at most one buffer of the file. An interruption ends reads and skips soon, as a reported
 * failure. One thread at a time. */
#ifndef TRIP_BYTE_STREAM_H
#define TRIP_BYTE_STREAM_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef enum trip_byte_encoding {
    TRIP_BYTES_PLAIN,
    TRIP_BYTES_ZLIB, /* gzip with any number of members, or a zlib stream */
    TRIP_BYTES_BZIP2,
} trip_byte_encoding;

typedef struct trip_byte_source {
    const char *path; /* copied */
    trip_byte_encoding encoding;
    uint64_t offset_bytes; /* start of the data in the file */
    uint64_t skip_bytes;   /* skipped at the start, after decompression */
    uint64_t size_bytes;   /* bytes of data after skip_bytes */
    bool warned;           /* suppresses the warning about bytes after the data */
} trip_byte_source;

typedef struct trip_byte_stream trip_byte_stream;

/* Opens a regular file. A plain file that is too short is a reported failure. Bytes after the data
 * give a warning, for compressed files at the last read. */
int trip_byte_stream_open(trip_byte_stream **out, const trip_byte_source *source);
void trip_byte_stream_close(trip_byte_stream *s);

/* Rewinds to the first byte of the source. */
int trip_byte_stream_rewind(trip_byte_stream *s);

/* Reads the next `bytes` bytes, within the source's size. Short, corrupt or unreadable data is a
 * reported failure. The read that reaches the end also verifies the checksum. */
int trip_byte_stream_read(trip_byte_stream *s, void *to, size_t bytes);

/* Skips the next `bytes` bytes, which must end before the source's size. Skipping is free in a
 * plain file; compressed data is decompressed. */
int trip_byte_stream_skip(trip_byte_stream *s, uint64_t bytes);

/* Returns the length of a regular file. Any other file is a reported failure. */
int trip_file_size(const char *path, uint64_t *bytes_out);

/* Returns the encoding from the name's extension: ".gz", ".bz2", else plain. A file that starts
 * like an uncompressed NIfTI file is plain. */
trip_byte_encoding trip_byte_encoding_of(const char *path);

#endif
