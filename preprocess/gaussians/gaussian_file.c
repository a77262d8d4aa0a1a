#include "gaussian_file.h"

#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "byte_stream.h"
#include "gaussian_file_internal.h"
#include "report.h"

enum { HEAD_BYTES = 1 << 18 };

static const trip_gaussian_reader *const readers[] = {
    &trip_read_compressed_ply,
    &trip_read_gaussian_ply,
    &trip_read_spz,
    &trip_read_sog,
    &trip_read_gltf_gaussians,
    /* without a magic number: */
    &trip_read_splat,
    &trip_read_ksplat,
};

int trip_gaussian_no_memory(const trip_gaussian_file *f)
{
    return trip_fail(TRIP_ERROR, "read", f->path, "out of memory");
}

/* Sets *out to the reader of a file, or to NULL. */
static int choose(const char *path, bool quiet, const trip_gaussian_reader **out)
{
    *out = NULL;
    unsigned char *bytes = malloc(HEAD_BYTES);
    if (!bytes)
        return quiet ? TRIP_ERROR : trip_fail(TRIP_ERROR, "read", path, "out of memory");
    size_t count = 0;
    trip_held_report held = { 0 };
    trip_report_hold(&held);
    int status = trip_byte_stream_head(path, bytes, HEAD_BYTES, true, &count);
    trip_report_release(&held);
    if (status < 0 && !quiet)
        trip_report_print(&held);
    const trip_gaussian_head head = { .path = path, .bytes = bytes, .count = count };
    for (size_t i = 0; i < sizeof readers / sizeof *readers && status == 0 && !*out; i++)
        if (readers[i]->probe(&head))
            *out = readers[i];
    free(bytes);
    return status;
}

bool trip_gaussian_file_is(const char *path)
{
    const trip_gaussian_reader *reader;
    return choose(path, true, &reader) == 0 && reader;
}

int trip_gaussian_file_open(const char *path, trip_gaussian_file **out)
{
    const trip_gaussian_reader *reader;
    *out = NULL;
    int status = choose(path, false, &reader);
    if (status < 0)
        return status;
    if (!reader)
        return trip_fail(TRIP_ERROR, "read", path,
                         "is no Gaussian scene; `triptych info FILE` tells the kind of a file");
    trip_gaussian_file *f = calloc(1, sizeof *f);
    if (!f || !(f->path = strdup(path))) {
        free(f);
        return trip_fail(TRIP_ERROR, "read", path, "out of memory");
    }
    f->reader = reader;
    memcpy(f->info.up, "-y", sizeof "-y");
    status = reader->open(f);
    if (status == 0 && f->info.count == 0)
        status = trip_fail(TRIP_ERROR, "read", path, "holds no Gaussians");
    if (status < 0) {
        trip_gaussian_file_close(f);
        return status;
    }
    *out = f;
    return 0;
}

void trip_gaussian_file_close(trip_gaussian_file *f)
{
    if (!f)
        return;
    f->reader->close(f);
    free(f->path);
    free(f);
}

const trip_gaussian_info *trip_gaussian_file_info(const trip_gaussian_file *f)
{
    return &f->info;
}

uint64_t trip_gaussian_file_left_out(const trip_gaussian_file *f)
{
    return f->left_out;
}

int trip_gaussian_file_rewind(trip_gaussian_file *f)
{
    f->done = f->left_out = f->unturned = 0;
    return f->reader->rewind(f);
}

/* Makes the rotation a unit quaternion. Length 0 means no rotation, as the matrix of such a
 * quaternion is the identity. Returns false if a value is not finite. */
static bool normalise(trip_gaussian_file *f, float q[4])
{
    double largest = 0, sum = 0;
    for (int i = 0; i < 4; i++) {
        if (!isfinite(q[i]))
            return false;
        largest = fmax(largest, fabs((double)q[i]));
    }
    if (largest == 0) {
        q[0] = 1;
        f->unturned++;
        return true;
    }
    for (int i = 0; i < 4; i++)
        sum += (double)q[i] * q[i];
    const double length = sqrt(sum);
    for (int i = 0; i < 4; i++)
        q[i] = (float)(q[i] / length);
    return true;
}

/* Returns false for a Gaussian that cannot be drawn. */
static bool check(trip_gaussian_file *f, trip_gaussian *g)
{
    bool good = isfinite(g->opacity) && g->opacity >= 0 && g->opacity <= 1;
    for (int a = 0; a < 3; a++)
        good = good && isfinite(g->centre[a]) && isfinite(g->deviations[a]);
    for (int k = 0; k < trip_sh_count(f->info.degree); k++)
        for (int c = 0; c < 3; c++)
            good = good && isfinite(g->sh[k][c]);
    for (int a = 0; a < 3 && good; a++)
        g->deviations[a] = fabsf(g->deviations[a]); /* the covariance holds its square */
    return good && normalise(f, g->rotation);
}

static void warn(trip_gaussian_file *f)
{
    if (f->warned)
        return;
    f->warned = true;
    if (f->left_out > 0)
        trip_warn(f->path,
                  "%" PRIu64 " of %" PRIu64
                  " Gaussians hold a value that is not finite, or an opacity outside of 0 to 1; "
                  "they are left out",
                  f->left_out, f->info.count);
    if (f->unturned > 0)
        trip_warn(f->path,
                  "%" PRIu64 " of %" PRIu64
                  " Gaussians have a rotation of length 0; they are not rotated",
                  f->unturned, f->info.count);
}

int trip_gaussian_file_read(trip_gaussian_file *f, trip_gaussian *out, size_t room, size_t *got_out)
{
    *got_out = 0;
    while (*got_out == 0 && room > 0 && f->done < f->info.count) {
        const uint64_t left = f->info.count - f->done;
        const size_t count = left < room ? (size_t)left : room;
        if (trip_interrupted())
            return trip_fail(TRIP_INTERRUPTED, "read", f->path, "interrupted");
        memset(out, 0, count * sizeof *out);
        int status = f->reader->read(f, out, count);
        if (status < 0)
            return status;
        f->done += count;
        for (size_t i = 0; i < count; i++)
            if (check(f, &out[i]))
                out[(*got_out)++] = out[i];
            else
                f->left_out++;
    }
    if (f->done == f->info.count)
        warn(f);
    return 0;
}
