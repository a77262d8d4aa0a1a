/* Reads the bytes of a file in order, decompresses them, and decodes values that are text. All
 * readers of dense formats use it. It holds at most two buffers of the file. An interruption ends
 * reads and skips soon, as a reported failure. One thread at a time. */
#ifndef TRIP_BYTE_STREAM_H
#define TRIP_BYTE_STREAM_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "text_values.h"

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
    trip_text_form text;   /* if the values are text, size_bytes counts the decoded bytes */
    trip_scalar text_type; /* of a text of numbers */
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

/* Reads up to `bytes` bytes, fewer only at the end of the file. For sources of 0 size_bytes. */
int trip_byte_stream_read_some(trip_byte_stream *s, void *to, size_t bytes, size_t *got_out);

/* Skips the next `bytes` bytes, which must end before the source's size. Skipping is free in a
 * plain file; compressed data is decompressed. */
int trip_byte_stream_skip(trip_byte_stream *s, uint64_t bytes);

/* Returns the length of a regular file. Any other file is a reported failure. */
int trip_file_size(const char *path, uint64_t *bytes_out);

/* Detects the encoding from the first bytes of a file. The second function reads them; a file that
 * cannot be read counts as plain. */
trip_byte_encoding trip_byte_encoding_of_head(const unsigned char *head, size_t bytes);
trip_byte_encoding trip_byte_encoding_of(const char *path);
/* Returns "gzip" or "bzip2", or "" for plain files. */
const char *trip_byte_encoding_name(trip_byte_encoding encoding);

/* Whether a path ends in a suffix such as ".pts", with or without .gz or .bz2 behind it. */
bool trip_byte_suffix(const char *path, const char *suffix);

/* Reports a compressed file of a format that can only be read unpacked. */
int trip_byte_stream_refuse_compressed(const char *path, const char *format);

/* Reports that a compressed file holds compressed values. Returns TRIP_ERROR.
 */
int trip_byte_stream_refuse_twice(const char *path, trip_byte_encoding whole);

/* Reads the first bytes of a regular file, decompressed if its content is compressed. *got_out is
 * less than `bytes` only at the end of the data. `quiet` reports no damaged compressed data, which
 * then end where the damage begins. */
int trip_byte_stream_head(const char *path, void *to, size_t bytes, bool quiet, size_t *got_out);

#endif
