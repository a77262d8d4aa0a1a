/* Helpers for the tests of the readers. They make a small volume with known values, in every type
 * and byte order, plain or compressed. They write files in a temporary folder, read a volume
 * through its portions, and catch reports. */
#ifndef VOLUME_FILES_H
#define VOLUME_FILES_H

#include <dirent.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <bzlib.h>
#include <cmocka.h>
#include <sys/stat.h>
#include <zlib.h>

#include "report.h"
#include "scope.h"
#include "volume.h"

enum { NX = 5, NY = 4, NZ = 7, VOXELS = NX * NY * NZ };

typedef struct bytes {
    unsigned char data[1 << 16];
    size_t count;
} bytes;

static inline void append(bytes *b, const void *data, size_t count)
{
    assert_true(b->count + count <= sizeof b->data);
    memcpy(b->data + b->count, data, count);
    b->count += count;
}

static inline void append_text(bytes *b, const char *text)
{
    append(b, text, strlen(text));
}

static inline bool is_signed(trip_scalar t)
{
    return t == TRIP_I8 || t == TRIP_I16 || t == TRIP_I32 || t == TRIP_I64 || t >= TRIP_F16;
}

/* Returns a value that the type can hold. Some voxels of signed types are negative. */
static inline int sample(trip_scalar type, int i, int j, int k)
{
    int v = (7 * i + 31 * j + 13 * k + i * j * k) % 127;
    return is_signed(type) ? v - 60 : v;
}

/* Returns the bits of a small whole number as a half, float or double, computed without the code
 * under test. */
static inline uint64_t float_bits(int v, int exponent_bits, int fraction_bits)
{
    if (v == 0)
        return 0;
    uint64_t magnitude = (uint64_t)abs(v), top = 0;
    while (magnitude >> (top + 1))
        top++;
    uint64_t exponent = top + (UINT64_C(1) << (exponent_bits - 1)) - 1;
    uint64_t fraction =
        (magnitude << (fraction_bits - (int)top)) & ((UINT64_C(1) << fraction_bits) - 1);
    return (uint64_t)(v < 0) << (exponent_bits + fraction_bits) | exponent << fraction_bits |
           fraction;
}

static inline void append_word(bytes *b, uint64_t word, unsigned width, bool big)
{
    unsigned char out[8];
    for (unsigned i = 0; i < width; i++)
        out[big ? width - 1 - i : i] = (unsigned char)(word >> (8 * i));
    append(b, out, width);
}

static inline void append_value(bytes *b, trip_scalar type, int v, bool big)
{
    uint64_t word = type == TRIP_F16   ? float_bits(v, 5, 10)
                    : type == TRIP_F32 ? float_bits(v, 8, 23)
                    : type == TRIP_F64 ? float_bits(v, 11, 52)
                                       : (uint64_t)(int64_t)v;
    append_word(b, word, trip_scalar_bytes(type), big);
}

/* Appends slices [first, first + count) of the sample volume as a file stores them. */
static inline void append_slices(bytes *b, trip_scalar type, bool big, int first, int count)
{
    for (int k = first; k < first + count; k++)
        for (int j = 0; j < NY; j++)
            for (int i = 0; i < NX; i++)
                append_value(b, type, sample(type, i, j, k), big);
}

static inline void append_volume(bytes *b, trip_scalar type, bool big)
{
    append_slices(b, type, big, 0, NZ);
}

/* zlib's window bits: 15 for a zlib stream, 31 for a gzip file. */
static inline void append_deflated(bytes *b, const bytes *from, int window_bits)
{
    z_stream z = { 0 };
    assert_int_equal(deflateInit2(&z, 6, Z_DEFLATED, window_bits, 8, Z_DEFAULT_STRATEGY), Z_OK);
    z.next_in = (unsigned char *)(uintptr_t)from->data;
    z.avail_in = (unsigned)from->count;
    z.next_out = b->data + b->count;
    z.avail_out = (unsigned)(sizeof b->data - b->count);
    assert_int_equal(deflate(&z, Z_FINISH), Z_STREAM_END);
    b->count += z.total_out;
    deflateEnd(&z);
}

static inline void append_gzip(bytes *b, const bytes *from)
{
    append_deflated(b, from, 31);
}

static inline void append_zlib(bytes *b, const bytes *from)
{
    append_deflated(b, from, 15);
}

static inline void append_bzip2(bytes *b, const bytes *from)
{
    unsigned room = (unsigned)(sizeof b->data - b->count);
    assert_int_equal(BZ2_bzBuffToBuffCompress((char *)b->data + b->count, &room,
                                              (char *)(uintptr_t)from->data, (unsigned)from->count,
                                              9, 0, 0),
                     BZ_OK);
    b->count += room;
}

/* Folder of all files. The program makes it at its start and removes it at its end. */
static char folder[] = "volume-files-XXXXXX";

static int make_folder(void **state)
{
    (void)state;
    return mkdtemp(folder) ? 0 : -1;
}

static int remove_folder(void **state)
{
    (void)state;
    DIR *d = opendir(folder);
    struct dirent *entry;
    char path[600];
    while (d && (entry = readdir(d))) {
        snprintf(path, sizeof path, "%s/%s", folder, entry->d_name);
        if (entry->d_name[0] != '.')
            remove(path);
    }
    if (d)
        closedir(d);
    return rmdir(folder);
}

/* Returns the path of `name` in the folder. It stays valid for the next seven calls. */
static inline const char *path_of(const char *name)
{
    static char paths[8][300];
    static int turn;
    char *path = paths[turn++ % 8];
    snprintf(path, sizeof paths[0], "%s/%s", folder, name);
    return path;
}

static inline const char *write_bytes(const char *name, const void *data, size_t count)
{
    const char *path = path_of(name);
    FILE *f = fopen(path, "wb");
    assert_non_null(f);
    assert_int_equal(fwrite(data, 1, count, f), count);
    assert_int_equal(fclose(f), 0);
    return path;
}

static inline const char *write_file(const char *name, const bytes *b)
{
    return write_bytes(name, b->data, b->count);
}

/* Caught reports, one a line. */
static char reported[8192];
static int reports;

static inline void keep_report(const char *line, void *user)
{
    (void)user;
    size_t used = strlen(reported);
    snprintf(reported + used, sizeof reported - used, "%s\n", line);
    reports++;
}

static inline void catch_reports(void)
{
    reported[0] = '\0';
    reports = 0;
    trip_report_redirect(keep_report, NULL);
}

/* Reads the volume through portions of `slices` slices into values[0..count). Returns 0 or the
 * status of the first failure. Checks that the budget is whole again. */
static inline int read_volume(const char *path, const trip_volume_params *params, int64_t slices,
                              float *values, size_t count, trip_volume_info *info)
{
    trip_budget *budget;
    trip_volume *v;
    trip_volume_portion portion;
    assert_int_equal(trip_budget_create(&budget, 64 << 20), 0);
    int status = trip_volume_open(&v, path, params, budget);
    if (status == 0) {
        if (info)
            *info = *trip_volume_get_info(v);
        float *to = values;
        while ((status = trip_volume_next(v, slices, &portion)) > 0) {
            size_t n = (size_t)(portion.size[0] * portion.size[1] * portion.size[2]);
            assert_true((size_t)(to - values) + n <= count);
            assert_int_equal(
                trip_portion_decode(v, &portion, portion.origin, portion.size, to, NULL), 0);
            to += n;
            trip_portion_release(v, &portion);
        }
        assert_true(status < 0 || (size_t)(to - values) == count);
        trip_volume_close(v);
    }
    assert_int_equal(trip_budget_left_bytes(budget), trip_budget_limit_bytes(budget));
    trip_budget_destroy(budget);
    return status;
}

/* Checks that the file holds the sample volume, for any number of slices read at a time, and that
 * nothing is reported. */
static inline void assert_holds_sample(const char *path, const trip_volume_params *params,
                                       trip_scalar type)
{
    for (int slices = 1; slices <= NZ + 1; slices += 2) {
        float values[VOXELS];
        trip_volume_info info;
        catch_reports();
        int status = read_volume(path, params, slices, values, VOXELS, &info);
        trip_report_redirect(NULL, NULL);
        if (reports)
            fail_msg("%s", reported);
        assert_int_equal(status, 0);
        assert_int_equal(info.type, type);
        assert_int_equal(info.dims[0], NX);
        assert_int_equal(info.dims[1], NY);
        assert_int_equal(info.dims[2], NZ);
        for (int v = 0; v < VOXELS; v++)
            assert_true(values[v] == (float)sample(type, v % NX, v / NX % NY, v / NX / NY));
    }
}

/* Checks that reading fails with `status` and one line that contains `text`. */
static inline void assert_refused_as(int status, const char *path, const trip_volume_params *params,
                                     const char *text)
{
    static float values[VOXELS * 4];
    catch_reports();
    int got = read_volume(path, params, 2, values, VOXELS * 4, NULL);
    trip_report_redirect(NULL, NULL);
    if (got != status || reports != 1 || !strstr(reported, text))
        fail_msg("status %d (expected %d), %d reports, expected one with \"%s\": %s", got, status,
                 reports, text, reported);
}

static inline void assert_refused(const char *path, const char *text)
{
    assert_refused_as(TRIP_ERROR, path, NULL, text);
}

/* Checks that an interruption ends reading with one line that reports it. */
static inline void assert_interrupted(const char *path, const trip_volume_params *params)
{
    trip_scope cancelled = { .around = NULL };
    trip_scope *before = trip_scope_enter(&cancelled);
    trip_scope_cancel(&cancelled);
    assert_refused_as(TRIP_INTERRUPTED, path, params, "interrupted");
    trip_scope_enter(before);
}

/* Reads a truncated or corrupted file. Checks that reading succeeds or fails with a single line.
 * Returns whether it failed. */
static inline bool survives(const char *path, const trip_volume_params *params)
{
    static float values[VOXELS * 4];
    trip_budget *budget;
    trip_volume *v;
    trip_volume_portion portion;
    assert_int_equal(trip_budget_create(&budget, 64 << 20), 0);
    catch_reports();
    int status = trip_volume_open(&v, path, params, budget);
    if (status == 0) {
        while ((status = trip_volume_next(v, 3, &portion)) > 0) {
            int64_t one[3] = { 1, 1, 1 };
            assert_int_equal(trip_portion_decode(v, &portion, portion.origin, one, values, NULL),
                             0);
            trip_portion_release(v, &portion);
        }
        trip_volume_close(v);
    }
    trip_report_redirect(NULL, NULL);
    assert_int_equal(trip_budget_left_bytes(budget), trip_budget_limit_bytes(budget));
    trip_budget_destroy(budget);
    if (status < 0 && !strstr(reported, folder))
        fail_msg("the report names no file: %s", reported);
    return status < 0;
}

static inline void assert_map(const trip_affine *a, const double expected[3][4])
{
    for (int row = 0; row < 3; row++)
        for (int column = 0; column < 4; column++)
            if (!(fabs(a->m[row][column] - expected[row][column]) < 1e-6))
                fail_msg("map[%d][%d] is %.9g, expected %.9g", row, column, a->m[row][column],
                         expected[row][column]);
}

#endif
