#include "zstd_stream.h"

#include <fcntl.h>
#include <inttypes.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <zstd.h>

#include "read_at.h"
#include "report.h"

/* Frames may ask for windows up to this size (as a power of two). */
enum { PIECE_BYTES = 1 << 17, WINDOW_LOG = 27 };

struct trip_zstd_stream {
    char *path;
    int fd;
    uint64_t offset, packed, bytes;
    uint64_t taken, given; /* packed bytes read; bytes given */
    ZSTD_DStream *codec;
    ZSTD_inBuffer in;
    unsigned char piece[PIECE_BYTES];
};

int trip_zstd_stream_rewind(trip_zstd_stream *s)
{
    s->taken = s->given = 0;
    s->in = (ZSTD_inBuffer){ s->piece, 0, 0 };
    ZSTD_DCtx_reset(s->codec, ZSTD_reset_session_only);
    return 0;
}

int trip_zstd_stream_open(trip_zstd_stream **out, const char *path, uint64_t offset_bytes,
                          uint64_t packed_bytes, uint64_t bytes)
{
    trip_zstd_stream *s = malloc(sizeof *s);
    if (!s)
        return trip_fail(TRIP_ERROR, "read", path, "out of memory");
    *s = (trip_zstd_stream){ .path = strdup(path),
                             .fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK),
                             .offset = offset_bytes,
                             .packed = packed_bytes,
                             .bytes = bytes,
                             .codec = ZSTD_createDStream() };
    int status = s->fd < 0 ? trip_fail_errno("read", path, "cannot open") : 0;
    if (status == 0 &&
        (!s->path || !s->codec ||
         ZSTD_isError(ZSTD_DCtx_setParameter(s->codec, ZSTD_d_windowLogMax, WINDOW_LOG))))
        status = trip_fail(TRIP_ERROR, "read", path, "no memory to decompress it");
    if (status == 0)
        status = trip_zstd_stream_rewind(s);
    if (status < 0)
        trip_zstd_stream_close(s);
    else
        *out = s;
    return status;
}

void trip_zstd_stream_close(trip_zstd_stream *s)
{
    if (!s)
        return;
    ZSTD_freeDStream(s->codec);
    if (s->fd >= 0)
        close(s->fd);
    free(s->path);
    free(s);
}

/* Reads the next packed bytes. Sets *end if there are none. */
static int fill(trip_zstd_stream *s, bool *end)
{
    const uint64_t left = s->packed - s->taken;
    const size_t want = left < PIECE_BYTES ? (size_t)left : PIECE_BYTES;
    const ssize_t got = trip_read_at(s->fd, s->piece, want, want, s->offset + s->taken);
    if (got < 0)
        return trip_fail_errno("read", s->path, "cannot read");
    s->taken += (uint64_t)got;
    s->in = (ZSTD_inBuffer){ s->piece, (size_t)got, 0 };
    *end = got == 0;
    return 0;
}

/* Decompresses up to `bytes` bytes, fewer only at the end of the stream. */
static int decompress(trip_zstd_stream *s, void *to, size_t bytes, size_t *got_out)
{
    ZSTD_outBuffer out = { to, bytes, 0 };
    bool end = false;
    while (out.pos < bytes) {
        const size_t in = s->in.pos, before = out.pos;
        const size_t code = ZSTD_decompressStream(s->codec, &out, &s->in);
        if (ZSTD_isError(code))
            return trip_fail(TRIP_ERROR, "read", s->path, "zstd data is corrupt: %s",
                             ZSTD_getErrorName(code));
        if (trip_interrupted())
            return trip_fail(TRIP_INTERRUPTED, "read", s->path, "interrupted");
        if (out.pos == before && s->in.pos == in) {
            int status = end ? 0 : fill(s, &end);
            if (status < 0)
                return status;
            if (end)
                break;
        }
    }
    *got_out = out.pos;
    return 0;
}

int trip_zstd_stream_read(trip_zstd_stream *s, void *to, size_t bytes)
{
    unsigned char more;
    size_t got = 0, extra = 0;
    int status = decompress(s, to, bytes, &got);
    if (status < 0)
        return status;
    s->given += got;
    if (got < bytes)
        return trip_fail(TRIP_ERROR, "read", s->path,
                         "a zstd stream holds %" PRIu64 " bytes, but %" PRIu64
                         " are expected; is it truncated?",
                         s->given, s->bytes);
    if (s->given == s->bytes)
        status = decompress(s, &more, 1, &extra);
    return status == 0 && extra
               ? trip_fail(TRIP_ERROR, "read", s->path,
                           "a zstd stream holds more than the expected %" PRIu64 " bytes", s->bytes)
               : status;
}
