/* Describes Gaussian scenes for triptych_brick.h. */
#include "triptych_brick.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "gaussian_file.h"
#include "library_context.h"
#include "report.h"

enum { BATCH = 1024 };

static int read_all(trip_gaussian_file *f, const char *path, triptych_gaussians *out)
{
    trip_gaussian *batch = malloc(BATCH * sizeof *batch);
    int status = batch ? 0 : trip_fail(TRIP_ERROR, "read", path, "out of memory");
    size_t got = 1;
    while (status == 0 && got > 0) {
        status = trip_gaussian_file_read(f, batch, BATCH, &got);
        for (size_t i = 0; i < got && status == 0; i++)
            for (int a = 0; a < 3; a++) {
                const double v = batch[i].centre[a];
                out->lo[a] = out->count || i ? fmin(out->lo[a], v) : v;
                out->hi[a] = out->count || i ? fmax(out->hi[a], v) : v;
            }
        out->count += status == 0 ? got : 0;
    }
    out->left_out = trip_gaussian_file_left_out(f);
    free(batch);
    return status;
}

static int describe(const char *path, triptych_gaussians *out)
{
    trip_gaussian_file *f;
    int status = trip_gaussian_file_open(path, &f);
    if (status < 0)
        return status;
    const trip_gaussian_info *info = trip_gaussian_file_info(f);
    *out = (triptych_gaussians){ .degree = info->degree,
                                 .antialiased = info->antialiased,
                                 .flat = info->flat };
    snprintf(out->format, sizeof out->format, "%s", info->format);
    memcpy(out->trainer, info->trainer, sizeof out->trainer);
    memcpy(out->up, info->up, sizeof out->up);
    status = read_all(f, path, out);
    trip_gaussian_file_close(f);
    if (status == 0 && out->count == 0)
        status = trip_fail(TRIP_ERROR, "read", path, "holds no Gaussian with finite values");
    return status;
}

int triptych_is_gaussians(triptych *t, const char *path)
{
    trip_scope *before = trip_context_enter_anew(t);
    return trip_context_leave(before, trip_gaussian_file_is(path));
}

int triptych_describe_gaussians(triptych *t, const char *path, triptych_gaussians *out)
{
    trip_scope *before = trip_context_enter_anew(t);
    *out = (triptych_gaussians){ 0 };
    return trip_context_leave(before, describe(path, out));
}
