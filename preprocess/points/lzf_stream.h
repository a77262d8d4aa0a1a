/* Decompresses a part of a file that LZF compressed (Lehmann, liblzf), in order and in bounded
 * memory. One thread at a time. */
#ifndef TRIP_LZF_STREAM_H
#define TRIP_LZF_STREAM_H

#include <stddef.h>
#include <stdint.h>

/* References reach this many bytes back. */
enum { TRIP_LZF_WINDOW = 1 << 13, TRIP_LZF_BUFFER = 1 << 13 };

typedef struct trip_lzf_stream {
    const char *path;
    int fd;
    uint64_t at, end; /* of the next bytes of the file, behind the buffer */
    unsigned used, have;
    unsigned literals, copies; /* bytes that are left of the current run */
    unsigned distance;
    uint32_t made; /* modulo the window */
    uint64_t all;  /* bytes made */
    unsigned char buffer[TRIP_LZF_BUFFER], window[TRIP_LZF_WINDOW];
} trip_lzf_stream;

/* Begins at the range `from` to `end` of a file. The path must outlive the stream. A copy of a
 * stream continues from the place of the original. */
void trip_lzf_stream_begin(trip_lzf_stream *s, const char *path, int fd, uint64_t from,
                           uint64_t end);

/* Makes `bytes` bytes. `to` may be NULL, which skips them. A range that is too short or damaged is
 * a reported failure. */
int trip_lzf_stream_read(trip_lzf_stream *s, unsigned char *to, uint64_t bytes);

#endif
