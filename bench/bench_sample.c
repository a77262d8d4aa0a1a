#include "bench_sample.h"

#include <ftw.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "brick.h"
#include "companion.h"
#include "fields.h"
#include "new_file.h"
#include "report.h"

#define VOLUME "tooth.nhdr"

static int make_folder(bench_sample *s)
{
    const char *parent = getenv("TMPDIR");
    char name[sizeof s->folder];
    if (!parent || !*parent)
        parent = "/var/tmp"; /* /var/tmp is on a disk; /tmp may be in memory */
    if (snprintf(name, sizeof name, "%s/triptych-bench-XXXXXX", parent) >= (int)sizeof name)
        return trip_fail(TRIP_ERROR, "bench", parent, "the path in TMPDIR is too long");
    if (!mkdtemp(name))
        return trip_fail_errno("bench", name, "cannot create");
    snprintf(s->folder, sizeof s->folder, "%s", name);
    snprintf(s->data, sizeof s->data, "%s/data.trip", name);
    return 0;
}

int bench_sample_make(bench_sample *s)
{
    char path[PATH_MAX];
    *s = (bench_sample){ 0 };
    if (!trip_companion_find(path, TRIP_DATASETS_FROM_BIN "/" VOLUME,
                             TRIP_DATASETS_OF_SOURCE "/" VOLUME, R_OK))
        return trip_fail(
            TRIP_ERROR, "bench", VOLUME,
            "the included volume is missing; name a data set, `triptych bench TABLE NAME.trip`");
    int status = make_folder(s);
    if (status)
        return status;
    trip_brick_summary summary;
    return trip_brick(
        &(trip_brick_params){ .input = path, .output = s->data, .normals = TRIP_NORMALS_STORED },
        &summary);
}

/* The width of the field in world units, and its default transfer function. */
static const double field_width = 255;
static const char field_function[] = "values data\nunit 1\n"
                                     "0   0.10 0.15 0.50  0\n"
                                     "25  0.10 0.15 0.50  0\n"
                                     "100 0.20 0.55 0.60  0.02\n"
                                     "180 0.90 0.75 0.35  0.10\n"
                                     "255 1.00 0.95 0.85  0.40\n";

static int write_slice(FILE *file, const char *path, const trip_field *field, int n, int z,
                       uint8_t *row)
{
    const double step = 2.0 / (n - 1);
    for (int y = 0; y < n; y++) {
        for (int x = 0; x < n; x++) {
            const trip_vec3 at = trip_v3(x * step - 1, y * step - 1, z * step - 1);
            row[x] = (uint8_t)lrint(255 * field->sample(at, 1, NULL));
        }
        if (fwrite(row, 1, (size_t)n, file) != (size_t)n)
            return trip_fail_errno("bench", path, "cannot write");
    }
    return trip_interrupted() ? trip_fail(TRIP_INTERRUPTED, "bench", path, "interrupted") : 0;
}

static int write_field(const char *path, const trip_field *field, int n)
{
    const double spacing = field_width / (n - 1);
    uint8_t *row = malloc((size_t)n);
    FILE *file = row ? fopen(path, "wb") : NULL;
    int status = file ? 0 : trip_fail_errno("bench", path, "cannot create");
    if (file)
        fprintf(file,
                "NRRD0004\ntype: uint8\ndimension: 3\nsizes: %d %d %d\nspacings: %.17g %.17g "
                "%.17g\nencoding: raw\n\n",
                n, n, n, spacing, spacing, spacing);
    for (int z = 0; z < n && !status; z++)
        status = write_slice(file, path, field, n, z, row);
    if (file && fclose(file) != 0 && !status)
        status = trip_fail_errno("bench", path, "cannot write");
    free(row);
    return status;
}

int bench_sample_make_field(bench_sample *s, const char *field, int n, const char *tf)
{
    char volume[sizeof s->folder + 16], function[sizeof s->folder + 16];
    trip_brick_summary summary;
    *s = (bench_sample){ 0 };
    int status = make_folder(s);
    if (status)
        return status;
    snprintf(volume, sizeof volume, "%s/field.nrrd", s->folder);
    snprintf(function, sizeof function, "%s/field.tf", s->folder);
    status = write_field(volume, trip_field_find(field), n);
    if (!status && !tf)
        status = trip_new_file_of_text("bench", tf = function, field_function);
    if (!status)
        status = trip_brick(&(trip_brick_params){ .input = volume,
                                                  .output = s->data,
                                                  .functions = &tf,
                                                  .function_count = 1,
                                                  .normals = TRIP_NORMALS_STORED,
                                                  .levels_for = TRIP_LEVELS_FOR_BOTH },
                            &summary);
    remove(volume);
    return status;
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
