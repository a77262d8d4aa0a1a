/* Reads Gaussian scenes in .splat: 32 bytes each, without a header. Three floats of the centre,
 * three of the deviations, then red, green, blue and opacity, and the rotation from w on, in bytes.
 */
#include "gaussian_file_internal.h"

#include <inttypes.h>
#include <stdlib.h>

#include "byte_stream.h"
#include "little_endian.h"
#include "report.h"

enum { ROW_BYTES = 32, ROWS = 4096 };

typedef struct splat {
    trip_byte_stream *stream;
    unsigned char rows[ROWS * ROW_BYTES];
} splat;

static bool probe(const trip_gaussian_head *head)
{
    return trip_byte_suffix(head->path, ".splat") && head->count > 0;
}

static int open_splat(trip_gaussian_file *f)
{
    uint64_t bytes;
    splat *s = f->state = calloc(1, sizeof *s);
    if (!s)
        return trip_gaussian_no_memory(f);
    f->info.format = ".splat";
    int status = trip_byte_stream_refuse_compressed(f->path, f->info.format);
    if (status == 0)
        status = trip_file_size(f->path, &bytes);
    if (status < 0)
        return status;
    if (bytes % ROW_BYTES)
        return trip_fail(TRIP_ERROR, "read", f->path,
                         "holds %" PRIu64 " bytes, which is no multiple of %d; is it truncated?",
                         bytes, ROW_BYTES);
    f->info.count = bytes / ROW_BYTES;
    return trip_byte_stream_open(&s->stream,
                                 &(trip_byte_source){ .path = f->path, .size_bytes = bytes });
}

static void decode(const unsigned char *row, trip_gaussian *g)
{
    for (int a = 0; a < 3; a++) {
        g->centre[a] = trip_le_float(row + 4 * a);
        g->deviations[a] = trip_le_float(row + 12 + 4 * a);
        g->sh[0][a] = trip_sh_of_colour(row[24 + a] / 255.0);
    }
    g->opacity = row[27] / 255.0f;
    for (int i = 0; i < 4; i++)
        g->rotation[i] = ((float)row[28 + i] - 128) / 128;
}

static int read_splat(trip_gaussian_file *f, trip_gaussian *out, size_t count)
{
    splat *s = f->state;
    for (size_t done = 0; done < count;) {
        const size_t n = count - done < ROWS ? count - done : ROWS;
        int status = trip_byte_stream_read(s->stream, s->rows, n * ROW_BYTES);
        if (status < 0)
            return status;
        for (size_t i = 0; i < n; i++)
            decode(s->rows + i * ROW_BYTES, &out[done + i]);
        done += n;
    }
    return 0;
}

static int rewind_splat(trip_gaussian_file *f)
{
    return trip_byte_stream_rewind(((splat *)f->state)->stream);
}

static void close_splat(trip_gaussian_file *f)
{
    splat *s = f->state;
    if (s)
        trip_byte_stream_close(s->stream);
    free(s);
}

const trip_gaussian_reader trip_read_splat = { probe, open_splat, read_splat, rewind_splat,
                                               close_splat };
