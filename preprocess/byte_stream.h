/* The bytes of one file in order, decompressed on the way: what all headerless and dense formats
 * read their values from. The file is read by position in large pieces, so that nothing but the
 * piece is held. Reading and passing over end soon when the user wants to stop. One thread at a
 * time. */
#ifndef TRIP_BYTE_STREAM_H
#define TRIP_BYTE_STREAM_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef enum trip_byte_encoding {
    TRIP_BYTES_PLAIN,
    TRIP_BYTES_ZLIB, /* a gzip file (any number of members) or a zlib stream, told apart by itself
                      */
    TRIP_BYTES_BZIP2,
} trip_byte_encoding;

typedef struct trip_byte_source {
    const char *path; /* copied */
    trip_byte_encoding encoding;
    uint64_t offset_bytes; /* where it starts in the file */
    uint64_t skip_bytes;   /* passed over after decompression */
    uint64_t size_bytes;   /* what the stream must hold from there */
    bool warned;           /* say nothing of bytes left over */
} trip_byte_source;

typedef struct trip_byte_stream trip_byte_stream;

/* Opens a regular file. A plain file too short for the source is refused here; bytes left over are
 * warned of, here or, where they have to be decompressed first, at the last read. */
int trip_byte_stream_open(trip_byte_stream **out, const trip_byte_source *source);
void trip_byte_stream_close(trip_byte_stream *s);

/* Back to the first byte of the source. */
int trip_byte_stream_rewind(trip_byte_stream *s);

/* The next `bytes` bytes, which must be within the source's size. Short, corrupt or unreadable data
 * is a reported failure. The read that reaches the end also checks the checksum of the encoding. */
int trip_byte_stream_read(trip_byte_stream *s, void *to, size_t bytes);

/* Passes over the next `bytes` bytes, which must be within the source's size and not reach its end:
 * at no cost in a plain file, by decompression elsewhere. */
int trip_byte_stream_skip(trip_byte_stream *s, uint64_t bytes);

/* Size of a regular file; anything else is a reported failure. */
int trip_file_size(const char *path, uint64_t *bytes_out);

/* From the name: ".gz" or ".bz2" at its end. */
trip_byte_encoding trip_byte_encoding_of(const char *path);

#endif
