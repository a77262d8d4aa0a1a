#include "lzf_stream.h"

#include "read_at.h"
#include "report.h"

void trip_lzf_stream_begin(trip_lzf_stream *s, const char *path, int fd, uint64_t from,
                           uint64_t end)
{
    s->path = path;
    s->fd = fd;
    s->at = from;
    s->end = end;
    s->used = s->have = 0;
    s->literals = s->copies = 0;
    s->made = 0;
    s->all = 0;
}

static int damaged(const trip_lzf_stream *s)
{
    return trip_fail(TRIP_ERROR, "read", s->path,
                     "its compressed data end early or are damaged; is it truncated?");
}

/* Returns the next byte of the range, or -1. */
static int next_byte(trip_lzf_stream *s)
{
    if (s->used == s->have) {
        const uint64_t left = s->end - s->at;
        const size_t wanted = left < TRIP_LZF_BUFFER ? (size_t)left : TRIP_LZF_BUFFER;
        const ssize_t got = wanted ? trip_read_at(s->fd, s->buffer, wanted, wanted, s->at) : 0;
        if (got <= 0)
            return -1;
        s->used = 0;
        s->have = (unsigned)got;
        s->at += (uint64_t)got;
    }
    return s->buffer[s->used++];
}

/* Reads the head of the next run. Returns false for a damaged one. */
static int next_run(trip_lzf_stream *s)
{
    enum { LITERALS = 32, LONG = 7, SHORTEST = 2 };
    const int head = next_byte(s);
    if (head < 0)
        return damaged(s);
    if (head < LITERALS) {
        s->literals = (unsigned)head + 1;
        return 0;
    }
    unsigned length = (unsigned)head >> 5;
    if (length == LONG) {
        const int more = next_byte(s);
        if (more < 0)
            return damaged(s);
        length += (unsigned)more;
    }
    const int low = next_byte(s);
    s->distance = ((unsigned)head % LITERALS << 8) + 1 + (low < 0 ? 0 : (unsigned)low);
    s->copies = length + SHORTEST;
    return low < 0 || s->distance > s->all ? damaged(s) : 0;
}

int trip_lzf_stream_read(trip_lzf_stream *s, unsigned char *to, uint64_t bytes)
{
    for (uint64_t i = 0; i < bytes; i++) {
        if (s->literals == 0 && s->copies == 0) {
            if (i % 4096 == 0 && trip_interrupted())
                return trip_fail(TRIP_INTERRUPTED, "read", s->path, "interrupted");
            const int status = next_run(s);
            if (status < 0)
                return status;
        }
        int byte;
        if (s->literals > 0) {
            s->literals--;
            if ((byte = next_byte(s)) < 0)
                return damaged(s);
        } else {
            s->copies--;
            byte = s->window[(s->made - s->distance) % TRIP_LZF_WINDOW];
        }
        s->window[s->made++ % TRIP_LZF_WINDOW] = (unsigned char)byte;
        s->all++;
        if (to)
            to[i] = (unsigned char)byte;
    }
    return 0;
}
