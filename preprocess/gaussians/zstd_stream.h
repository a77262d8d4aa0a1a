/* Reads a stream of zstd in a file from its start, in bounded memory. One thread at a time. */
#ifndef TRIP_ZSTD_STREAM_H
#define TRIP_ZSTD_STREAM_H

#include <stddef.h>
#include <stdint.h>

typedef struct trip_zstd_stream trip_zstd_stream;

/* `packed_bytes` bytes at `offset_bytes` of the file hold `bytes` bytes. */
int trip_zstd_stream_open(trip_zstd_stream **out, const char *path, uint64_t offset_bytes,
                          uint64_t packed_bytes, uint64_t bytes);
void trip_zstd_stream_close(trip_zstd_stream *s); /* NULL is allowed */
int trip_zstd_stream_rewind(trip_zstd_stream *s);

/* Reads the next `bytes` bytes. Damaged, short and long streams are reported failures. */
int trip_zstd_stream_read(trip_zstd_stream *s, void *to, size_t bytes);

#endif
