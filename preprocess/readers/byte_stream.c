#include "byte_stream.h"

#include <bzlib.h>
#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include "file_pieces.h"
#include "report.h"

/* Size of the buffer for compressed bytes. Plain files are read into the caller's memory. */
#define PIECE_BYTES ((size_t)1 << 20)
/* Minimum size of plain data that several threads read. */
#define LARGE_BYTES ((uint64_t)4 << 20)
/* Size of the buffer for values that are text. */
#define TEXT_BYTES ((size_t)64 << 10)
/* Maximum bytes to read or decompress between checks for an interruption. The decompressors count
 * in 32 bits. */
#define STEP_BYTES ((size_t)4 << 20)

struct trip_byte_stream {
    trip_byte_source source;
    char *path;
    int fd;
    uint64_t file_bytes;
    uint64_t position;        /* file position of the next byte to read */
    uint64_t done;            /* bytes delivered so far */
    trip_file_pieces *pieces; /* reader of a large plain file, or NULL */

    unsigned char *piece; /* buffer of compressed bytes; piece_used of piece_bytes are consumed */
    size_t piece_used, piece_bytes;
    bool ended; /* the compressed stream is complete */
    bool codec_ready, quiet;
    char *text; /* buffer of a text; text_used of text_bytes are decoded */
    size_t text_used, text_bytes;
    trip_text_decoder decoder;
    union {
        z_stream zlib;
        bz_stream bzip2;
    } codec;
};

trip_byte_encoding trip_byte_encoding_of_head(const unsigned char *head, size_t bytes)
{
    /* The first block of a bzip2 file, or its end. */
    static const unsigned char block[] = { 0x31, 0x41, 0x59, 0x26, 0x53, 0x59 };
    static const unsigned char end[] = { 0x17, 0x72, 0x45, 0x38, 0x50, 0x90 };
    if (bytes >= 2 && head[0] == 0x1f && head[1] == 0x8b && (bytes == 2 || head[2] == 8))
        return TRIP_BYTES_ZLIB;
    if (bytes >= 10 && memcmp(head, "BZh", 3) == 0 && head[3] >= '1' && head[3] <= '9' &&
        (memcmp(head + 4, block, 6) == 0 || memcmp(head + 4, end, 6) == 0))
        return TRIP_BYTES_BZIP2;
    return TRIP_BYTES_PLAIN;
}

trip_byte_encoding trip_byte_encoding_of(const char *path)
{
    unsigned char head[10];
    const int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    const ssize_t got = fd >= 0 ? pread(fd, head, sizeof head, 0) : 0;
    if (fd >= 0)
        close(fd);
    return trip_byte_encoding_of_head(head, got > 0 ? (size_t)got : 0);
}

const char *trip_byte_encoding_name(trip_byte_encoding encoding)
{
    return encoding == TRIP_BYTES_ZLIB ? "gzip" : encoding == TRIP_BYTES_BZIP2 ? "bzip2" : "";
}

bool trip_byte_suffix(const char *path, const char *suffix)
{
    size_t stem = strlen(path);
    const size_t n = strlen(suffix);
    if (stem > 3 && strcasecmp(path + stem - 3, ".gz") == 0)
        stem -= 3;
    else if (stem > 4 && strcasecmp(path + stem - 4, ".bz2") == 0)
        stem -= 4;
    return stem > n && strncasecmp(path + stem - n, suffix, n) == 0;
}

int trip_byte_stream_refuse_compressed(const char *path, const char *format)
{
    const char *program = trip_byte_encoding_name(trip_byte_encoding_of(path));
    return *program ? trip_fail(TRIP_ERROR, "read", path,
                                "is compressed with %s, and its format (%s) can only be read "
                                "unpacked: unpack it first, with `%s -dc FILE >NAME`",
                                program, format, program)
                    : 0;
}

int trip_byte_stream_refuse_twice(const char *path, trip_byte_encoding whole)
{
    return trip_fail(TRIP_ERROR, "read", path,
                     "is compressed with %s and holds values that are compressed again: unpack it "
                     "first, with `%s -dc FILE >NAME`",
                     trip_byte_encoding_name(whole), trip_byte_encoding_name(whole));
}

static int open_regular(const char *path, int *fd_out, uint64_t *bytes_out)
{
    /* Non-blocking, so that a FIFO is refused and not waited for. */
    int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    struct stat st;
    if (fd < 0)
        return trip_fail_errno("read", path, "cannot open");
    if (fstat(fd, &st) != 0) {
        int status = trip_fail_errno("read", path, "cannot examine");
        close(fd);
        return status;
    }
    if (!S_ISREG(st.st_mode)) {
        close(fd);
        return trip_fail(TRIP_ERROR, "read", path, "is not a regular file");
    }
    *fd_out = fd;
    *bytes_out = (uint64_t)st.st_size;
    return 0;
}

int trip_file_size(const char *path, uint64_t *bytes_out)
{
    int fd = -1;
    int status = open_regular(path, &fd, bytes_out);
    if (status == 0)
        close(fd);
    return status;
}

static void codec_end(trip_byte_stream *s)
{
    if (s->codec_ready && s->source.encoding == TRIP_BYTES_ZLIB)
        inflateEnd(&s->codec.zlib);
    else if (s->codec_ready)
        BZ2_bzDecompressEnd(&s->codec.bzip2);
    s->codec_ready = false;
}

static int codec_begin(trip_byte_stream *s)
{
    codec_end(s);
    memset(&s->codec, 0, sizeof s->codec);
    int failed = s->source.encoding == TRIP_BYTES_ZLIB
                     ? inflateInit2(&s->codec.zlib, 15 + 32) != Z_OK /* gzip or zlib */
                     : BZ2_bzDecompressInit(&s->codec.bzip2, 0, 0) != BZ_OK;
    if (failed)
        return trip_fail(TRIP_ERROR, "read", s->path, "no memory to decompress it");
    s->codec_ready = true;
    return 0;
}

static size_t one_step(size_t bytes)
{
    return bytes < STEP_BYTES ? bytes : STEP_BYTES;
}

static int check_interrupt(const trip_byte_stream *s)
{
    return trip_interrupted() ? trip_fail(TRIP_INTERRUPTED, "read", s->path, "interrupted") : 0;
}

/* Reads `bytes` bytes at the current position, fewer only at the end of the file. */
static int read_file(trip_byte_stream *s, void *to, size_t bytes, size_t *got_out)
{
    size_t got = 0;
    while (got < bytes) {
        int status = check_interrupt(s);
        if (status < 0)
            return status;
        ssize_t n = pread(s->fd, (char *)to + got, one_step(bytes - got), (off_t)s->position);
        if (n < 0 && errno == EINTR)
            continue;
        if (n < 0)
            return trip_fail_errno("read", s->path, "cannot read");
        if (n == 0)
            break;
        got += (size_t)n;
        s->position += (uint64_t)n;
    }
    *got_out = got;
    return 0;
}

static int fill_piece(trip_byte_stream *s)
{
    s->piece_used = 0;
    return read_file(s, s->piece, PIECE_BYTES, &s->piece_bytes);
}

static int corrupt(const trip_byte_stream *s)
{
    const char *kind = s->source.encoding == TRIP_BYTES_ZLIB ? "zlib" : "bzip2";
    if (s->quiet)
        return TRIP_ERROR;
    return trip_fail(TRIP_ERROR, "read", s->path,
                     "%s data is corrupt near byte %" PRIu64 " of the file", kind,
                     s->position - (s->piece_bytes - s->piece_used));
}

/* Decompresses some of the buffered bytes. */
static int step_zlib(trip_byte_stream *s, unsigned char *to, size_t bytes, size_t *got_out)
{
    z_stream *z = &s->codec.zlib;
    z->next_in = s->piece + s->piece_used;
    z->avail_in = (uInt)(s->piece_bytes - s->piece_used);
    z->next_out = to;
    z->avail_out = (uInt)bytes;
    int code = inflate(z, Z_NO_FLUSH);
    s->piece_used = s->piece_bytes - z->avail_in;
    *got_out = bytes - z->avail_out;
    s->ended = code == Z_STREAM_END;
    return code == Z_OK || code == Z_STREAM_END || code == Z_BUF_ERROR ? 0 : corrupt(s);
}

static int step_bzip2(trip_byte_stream *s, unsigned char *to, size_t bytes, size_t *got_out)
{
    bz_stream *b = &s->codec.bzip2;
    b->next_in = (char *)s->piece + s->piece_used;
    b->avail_in = (unsigned)(s->piece_bytes - s->piece_used);
    b->next_out = (char *)to;
    b->avail_out = (unsigned)bytes;
    int code = BZ2_bzDecompress(b);
    s->piece_used = s->piece_bytes - b->avail_in;
    *got_out = bytes - b->avail_out;
    s->ended = code == BZ_STREAM_END;
    return code == BZ_OK || code == BZ_STREAM_END ? 0 : corrupt(s);
}

/* Returns whether another member of the same kind follows in the buffer. */
static bool another_member(const trip_byte_stream *s)
{
    const unsigned char *next = s->piece + s->piece_used;
    if (s->piece_bytes - s->piece_used < 2)
        return false;
    if (s->source.encoding == TRIP_BYTES_ZLIB)
        return next[0] == 0x1f && next[1] == 0x8b;
    return next[0] == 'B' && next[1] == 'Z';
}

/* Begins the next member after a complete one, if there is any. */
static int next_member(trip_byte_stream *s)
{
    size_t left = s->piece_bytes - s->piece_used, more = 0;
    if (left < 2) {
        memmove(s->piece, s->piece + s->piece_used, left);
        s->piece_used = 0;
        int status = read_file(s, s->piece + left, PIECE_BYTES - left, &more);
        s->piece_bytes = left + more;
        if (status < 0)
            return status;
    }
    if (!another_member(s))
        return 0;
    s->ended = false;
    return codec_begin(s);
}

/* Decompresses up to `bytes` bytes, fewer only at the end of the stream. */
static int decompress(trip_byte_stream *s, unsigned char *to, size_t bytes, size_t *got_out)
{
    int status = 0;
    size_t done = 0;
    while (done < bytes && !s->ended && status == 0) {
        size_t want = one_step(bytes - done), got = 0;
        bool starved = false;
        status = check_interrupt(s);
        if (status == 0 && s->piece_used == s->piece_bytes) {
            status = fill_piece(s);
            starved = s->piece_bytes == 0;
        }
        if (status == 0)
            status = s->source.encoding == TRIP_BYTES_ZLIB ? step_zlib(s, to + done, want, &got)
                                                           : step_bzip2(s, to + done, want, &got);
        done += got;
        if (status == 0 && s->ended)
            status = next_member(s);
        else if (status == 0 && starved && got == 0)
            break; /* the file ends inside the stream */
    }
    *got_out = done;
    return status;
}

static int too_short(const trip_byte_stream *s, uint64_t bytes)
{
    return trip_fail(TRIP_ERROR, "read", s->path,
                     "holds %" PRIu64 " bytes of data, but %" PRIu64
                     " are expected; is it truncated?",
                     bytes, s->source.size_bytes);
}

static void warn_left_over(trip_byte_stream *s, const char *count_text)
{
    if (!s->source.warned)
        trip_warn(s->path, "%s after the expected %" PRIu64 " bytes of data", count_text,
                  s->source.size_bytes);
    s->source.warned = true;
}

static int read_plain(trip_byte_stream *s, void *to, size_t bytes, size_t *got_out)
{
    if (!s->pieces || !trip_file_pieces_read(s->pieces, s->position, to, bytes))
        return read_file(s, to, bytes, got_out);
    s->position += bytes;
    *got_out = bytes;
    return 0;
}

/* Reads the bytes of the file, decompressed, fewer than `bytes` only at their end. */
static int fetch(trip_byte_stream *s, void *to, size_t bytes, size_t *got_out)
{
    return s->source.encoding == TRIP_BYTES_PLAIN ? read_plain(s, to, bytes, got_out)
                                                  : decompress(s, to, bytes, got_out);
}

static int not_a_value(const trip_byte_stream *s)
{
    return trip_fail(
        TRIP_ERROR, "read", s->path, "\"%.40s\" is not a value of the type %s", s->decoder.word,
        s->source.text == TRIP_TEXT_HEX ? "hex" : trip_scalar_name(s->source.text_type));
}

/* Decodes up to `bytes` bytes of values, fewer only at the end of the text. */
static int decode_text(trip_byte_stream *s, char *to, size_t bytes, size_t *got_out)
{
    bool ended = false;
    size_t done = 0;
    while (done < bytes) {
        size_t used, made;
        if (!trip_text_decode(&s->decoder, s->text + s->text_used, s->text_bytes - s->text_used,
                              &used, to + done, bytes - done, &made))
            return not_a_value(s);
        s->text_used += used;
        done += made;
        if (done == bytes || ended)
            break;
        if (s->text_used < s->text_bytes)
            continue;
        s->text_used = 0;
        int status = fetch(s, s->text, TEXT_BYTES, &s->text_bytes);
        if (status < 0)
            return status;
        if (s->text_bytes == 0) { /* a line end ends the last number */
            s->text[s->text_bytes++] = '\n';
            ended = true;
        }
    }
    *got_out = done;
    return 0;
}

/* Reads to the end of a text and warns if it holds more than separators. */
static int finish_text(trip_byte_stream *s)
{
    for (;;) {
        for (size_t i = s->text_used; i < s->text_bytes; i++)
            if (!strchr(" \t\r\n\v\f,", s->text[i]) || !s->text[i]) {
                warn_left_over(s, "more text is");
                return 0;
            }
        s->text_used = 0;
        int status = fetch(s, s->text, TEXT_BYTES, &s->text_bytes);
        if (status < 0 || s->text_bytes == 0)
            return status;
    }
}

/* Reads to the end of a compressed stream, which verifies its checksum. */
static int finish(trip_byte_stream *s)
{
    unsigned char extra;
    size_t got;
    if (s->source.text)
        return finish_text(s);
    int status = s->ended ? 0 : decompress(s, &extra, 1, &got);
    if (status < 0)
        return status;
    if (!s->ended && got == 0)
        return trip_fail(TRIP_ERROR, "read", s->path, "compressed data is truncated at its end");
    if (!s->ended)
        warn_left_over(s, "compressed bytes are");
    return 0;
}

int trip_byte_stream_read(trip_byte_stream *s, void *to, size_t bytes)
{
    size_t got = 0;
    int status = s->source.text ? decode_text(s, to, bytes, &got) : fetch(s, to, bytes, &got);
    if (status < 0)
        return status;
    if (got < bytes)
        return too_short(s, s->done + got);
    s->done += bytes;
    const bool plain = s->source.encoding == TRIP_BYTES_PLAIN && !s->source.text;
    return s->done == s->source.size_bytes && !plain ? finish(s) : 0;
}

int trip_byte_stream_read_some(trip_byte_stream *s, void *to, size_t bytes, size_t *got_out)
{
    const int status = fetch(s, to, bytes, got_out);
    if (status == 0 && *got_out < bytes && s->codec_ready && !s->ended)
        return trip_fail(TRIP_ERROR, "read", s->path, "compressed data is truncated at its end");
    return status;
}

/* Skips bytes by reading them, decompressed and, if `text`, decoded. */
static int skip_decoded(trip_byte_stream *s, uint64_t bytes, bool text)
{
    char waste[4096];
    uint64_t left = bytes;
    while (left > 0) {
        size_t n = left < sizeof waste ? (size_t)left : sizeof waste, got;
        int status = text ? decode_text(s, waste, n, &got) : fetch(s, waste, n, &got);
        if (status < 0)
            return status;
        if (got < n)
            return trip_fail(TRIP_ERROR, "read", s->path,
                             "ends within the %" PRIu64 " bytes to skip", bytes);
        left -= n;
    }
    return 0;
}

int trip_byte_stream_skip(trip_byte_stream *s, uint64_t bytes)
{
    int status = 0;
    if (s->source.encoding == TRIP_BYTES_PLAIN && !s->source.text)
        s->position += bytes;
    else
        status = skip_decoded(s, bytes, s->source.text != TRIP_TEXT_NONE);
    s->done += bytes;
    return status;
}

int trip_byte_stream_rewind(trip_byte_stream *s)
{
    s->position = s->source.offset_bytes;
    s->done = 0;
    s->piece_used = s->piece_bytes = 0;
    s->ended = false;
    s->text_used = s->text_bytes = 0;
    s->decoder = (trip_text_decoder){ .form = s->source.text, .type = s->source.text_type };
    if (s->source.encoding == TRIP_BYTES_PLAIN) {
        s->position += s->source.skip_bytes;
        return 0;
    }
    int status = codec_begin(s);
    return status < 0 ? status : skip_decoded(s, s->source.skip_bytes, false);
}

static int too_short_text(const trip_byte_stream *s, uint64_t bytes)
{
    return trip_fail(TRIP_ERROR, "read", s->path,
                     "holds %" PRIu64 " characters of values, which are too few for %" PRIu64
                     " bytes of data; is it truncated?",
                     bytes, s->source.size_bytes);
}

/* The length of a plain file is checked before reading. */
static int check_length(trip_byte_stream *s)
{
    bool plain = s->source.encoding == TRIP_BYTES_PLAIN;
    uint64_t start = s->source.offset_bytes, end;
    if ((plain && __builtin_add_overflow(start, s->source.skip_bytes, &start)) ||
        start > s->file_bytes)
        return trip_fail(TRIP_ERROR, "read", s->path,
                         "the data offset lies beyond its end, %" PRIu64 " bytes", s->file_bytes);
    if (!plain)
        return 0;
    if (s->source.text)
        return s->file_bytes - start < trip_text_min_bytes(&s->decoder, s->source.size_bytes)
                   ? too_short_text(s, s->file_bytes - start)
                   : 0;
    if (__builtin_add_overflow(start, s->source.size_bytes, &end) || end > s->file_bytes)
        return too_short(s, s->file_bytes - start);
    if (end < s->file_bytes) {
        char text[64];
        snprintf(text, sizeof text, "%" PRIu64 " bytes are", s->file_bytes - end);
        warn_left_over(s, text);
    }
    return 0;
}

static int prepare(trip_byte_stream *s)
{
    int status = open_regular(s->path, &s->fd, &s->file_bytes);
    if (status < 0)
        return status;
    s->decoder = (trip_text_decoder){ .form = s->source.text, .type = s->source.text_type };
    status = check_length(s);
    if (status < 0)
        return status;
    if (s->source.text && !(s->text = malloc(TEXT_BYTES)))
        return trip_fail(TRIP_ERROR, "read", s->path, "no memory to decode it");
    if (s->source.encoding != TRIP_BYTES_PLAIN && !(s->piece = malloc(PIECE_BYTES)))
        return trip_fail(TRIP_ERROR, "read", s->path, "no memory to decompress it");
    posix_fadvise(s->fd, 0, 0, POSIX_FADV_SEQUENTIAL);
    if (s->source.encoding == TRIP_BYTES_PLAIN && s->source.size_bytes >= LARGE_BYTES)
        s->pieces = trip_file_pieces_create(s->path, s->fd, s->file_bytes);
    return trip_byte_stream_rewind(s);
}

int trip_byte_stream_open(trip_byte_stream **out, const trip_byte_source *source)
{
    trip_byte_stream *s = calloc(1, sizeof *s);
    char *path = strdup(source->path);
    if (!s || !path) {
        free(s);
        free(path);
        return trip_fail(TRIP_ERROR, "read", source->path, "no memory to open it");
    }
    s->source = *source;
    s->source.path = s->path = path;
    s->fd = -1;
    int status = prepare(s);
    if (status < 0) {
        trip_byte_stream_close(s);
        return status;
    }
    *out = s;
    return 0;
}

void trip_byte_stream_close(trip_byte_stream *s)
{
    if (!s)
        return;
    codec_end(s);
    trip_file_pieces_destroy(s->pieces);
    if (s->fd >= 0)
        close(s->fd);
    free(s->piece);
    free(s->text);
    free(s->path);
    free(s);
}

int trip_byte_stream_head(const char *path, void *to, size_t bytes, bool quiet, size_t *got_out)
{
    trip_byte_stream *s;
    const trip_byte_source source = { .path = path,
                                      .encoding = trip_byte_encoding_of(path),
                                      .warned = true };
    *got_out = 0;
    int status = trip_byte_stream_open(&s, &source);
    if (status < 0)
        return status;
    s->quiet = quiet;
    status = fetch(s, to, bytes, got_out);
    trip_byte_stream_close(s);
    return quiet && status == TRIP_ERROR ? 0 : status;
}
