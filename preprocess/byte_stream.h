/* Reads the bytes of one file in order and decompresses them: where all dense formats read their
 * values from. Holds no more than one buffer of the file. An interruption ends reading and skipping
 * soon, as a reported failure. One thread at a time. */
#ifndef TRIP_BYTE_STREAM_H
#define TRIP_BYTE_STREAM_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef enum trip_byte_encoding {
    TRIP_BYTES_PLAIN,
    TRIP_BYTES_ZLIB, /* gzip of any number of members, or a zlib stream */
    TRIP_BYTES_BZIP2,
} trip_byte_encoding;

typedef struct trip_byte_source {
    const char *path; /* copied */
    trip_byte_encoding encoding;
    uint64_t offset_bytes; /* where it starts in the file */
    uint64_t skip_bytes;   /* skipped at the start, after decompression */
    uint64_t size_bytes;   /* of the data after these */
    bool warned;           /* do not warn of bytes after the data */
} trip_byte_source;

typedef struct trip_byte_stream trip_byte_stream;

/* Opens a regular file. A plain file that is too short for the source is a reported failure. Bytes
 * after the data give a warning, here or, in compressed files, at the last read. */
int trip_byte_stream_open(trip_byte_stream **out, const trip_byte_source *source);
void trip_byte_stream_close(trip_byte_stream *s);

/* Back to the first byte of the source. */
int trip_byte_stream_rewind(trip_byte_stream *s);

/* Reads the next `bytes` bytes, which must be within the source's size. Short, corrupt or
 * unreadable data is a reported failure. The read that reaches the end also verifies the checksum
 * of the encoding. */
int trip_byte_stream_read(trip_byte_stream *s, void *to, size_t bytes);

/* Skips the next `bytes` bytes, which must end before the source's size: at no cost in a plain
 * file, by decompressing elsewhere. */
int trip_byte_stream_skip(trip_byte_stream *s, uint64_t bytes);

/* The length of a regular file; anything else is a reported failure. */
int trip_file_size(const char *path, uint64_t *bytes_out);

/* The encoding that the end of the name stands for: ".gz", ".bz2", else plain. */
trip_byte_encoding trip_byte_encoding_of(const char *path);

#endif
