#include "bench_sample.h"

#include <ftw.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "brick.h"
#include "report.h"

#define VOLUME "tooth.nhdr"

/* Beside an installed program, else where the program was built from. */
static bool find_volume(char *path, size_t bytes)
{
    char program[2048];
    ssize_t length = readlink("/proc/self/exe", program, sizeof program - 1);
    program[length > 0 ? length : 0] = 0;
    char *slash = strrchr(program, '/');
    snprintf(path, bytes, "%.*s/" TRIP_DATASETS_FROM_BIN "/" VOLUME,
             slash ? (int)(slash - program) : 0, program);
    if (slash && access(path, R_OK) == 0)
        return true;
    snprintf(path, bytes, "%s", TRIP_DATASETS_OF_SOURCE "/" VOLUME);
    return access(path, R_OK) == 0;
}

static int make_folder(bench_sample *s)
{
    const char *parent = getenv("TMPDIR");
    char name[sizeof s->folder];
    if (!parent || !*parent)
        parent = "/var/tmp"; /* on a disk, where /tmp may be in memory */
    if (snprintf(name, sizeof name, "%s/triptych-bench-XXXXXX", parent) >= (int)sizeof name)
        return trip_fail(TRIP_ERROR, "bench", parent, "the name of TMPDIR is too long");
    if (!mkdtemp(name))
        return trip_fail_errno("bench", name, "cannot create");
    snprintf(s->folder, sizeof s->folder, "%s", name);
    snprintf(s->data, sizeof s->data, "%s/tooth.trip", name);
    return 0;
}

int bench_sample_make(bench_sample *s)
{
    char path[4096];
    *s = (bench_sample){ 0 };
    if (!find_volume(path, sizeof path))
        return trip_fail(TRIP_ERROR, "bench", VOLUME,
                         "the included volume is not there; name a data set: `triptych bench "
                         "TABLE NAME.trip`");
    int status = make_folder(s);
    if (status)
        return status;
    trip_brick_summary summary;
    return trip_brick(&(trip_brick_params){ .input = path, .output = s->data }, &summary);
}

static int remove_one(const char *path, const struct stat *st, int type, struct FTW *at)
{
    (void)st;
    (void)type;
    (void)at;
    return remove(path);
}

void bench_sample_remove(const bench_sample *s)
{
    if (s->folder[0])
        nftw(s->folder, remove_one, 8, FTW_DEPTH | FTW_PHYS);
}
