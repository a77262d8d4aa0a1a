/* Helpers for tests of the bricker. They make a temporary folder, write raw volumes, and read data
 * sets back into one dense array for each list. Reading uses the iterators of stream/. */
#ifndef TRIP_TEST_BRICK_FILES_H
#define TRIP_TEST_BRICK_FILES_H

#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "brick.h"
#include "block.h"
#include "dataset.h"
#include "report.h"
#include "selection.h"

static char test_folder[64];
static char test_report[8192];

static inline void test_catch(const char *line, void *user)
{
    (void)user;
    size_t used = strlen(test_report);
    snprintf(test_report + used, sizeof test_report - used, "%s\n", line);
}

/* cmocka's setup and teardown. They make and remove an empty folder, and catch reports. */
static inline int test_begin(void **state)
{
    (void)state;
    strcpy(test_folder,
           access("/dev/shm", W_OK) == 0 ? "/dev/shm/trip-XXXXXX" : "/tmp/trip-XXXXXX");
    test_report[0] = 0;
    trip_report_redirect(test_catch, NULL);
    return mkdtemp(test_folder) ? 0 : -1;
}

static inline int test_end(void **state)
{
    (void)state;
    char command[128];
    trip_report_redirect(NULL, NULL);
    snprintf(command, sizeof command, "rm -rf '%s'", test_folder);
    return system(command);
}

/* Returns FOLDER/NAME. The string stays valid for the next seven calls. */
static inline const char *test_path(const char *name)
{
    static char paths[8][128];
    static unsigned next;
    char *path = paths[next++ % 8];
    snprintf(path, sizeof paths[0], "%s/%s", test_folder, name);
    return path;
}

static inline void test_write(const char *name, const void *data, size_t bytes)
{
    FILE *f = fopen(test_path(name), "wb");
    assert_non_null(f);
    assert_int_equal(fwrite(data, 1, bytes, f), bytes);
    assert_int_equal(fclose(f), 0);
}

static inline uint32_t test_random(uint64_t *state)
{
    *state = *state * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (uint32_t)(*state >> 33);
}

static inline bool test_exists(const char *name)
{
    return access(test_path(name), F_OK) == 0;
}

enum { TEST_LISTS = 6 };

/* The lists of level 0 as dense arrays [k][j][i]. The first three are the X, Y and Z lists of kept
 * voxels, then come the lists of the halo. Code -1 means no splat. */
typedef struct test_lists {
    trip_file_header header;
    size_t voxels;
    unsigned lists;
    int32_t *codes[TEST_LISTS];
    uint32_t *normals[TEST_LISTS];
    uint64_t splats[TEST_LISTS];
    uint64_t out_of_order; /* splats not in order of sheet and Morton code */
    char *text;
    double *table; /* copy of the table of codes */
    trip_codes scale;
} test_lists;

static inline void test_read_run(const trip_dataset *d, unsigned number, const trip_run *run,
                                 test_lists *l, uint64_t *last_key)
{
    static uint64_t words[TRIP_BLOCK_WORDS_MAX];
    static unsigned char packed[4 * TRIP_RUN_RECORDS_MAX];
    uint32_t voxels[TRIP_RUN_RECORDS_MAX], normals[TRIP_RUN_RECORDS_MAX] = { 0 };
    const trip_list *list = &d->lists[number];
    const int axis = list->axis;
    const trip_block_form form = trip_block_form_of(&d->header, list->kind);
    size_t bytes = 8 * (size_t)run->words, normal_bytes = run->count * form.normal_bytes;
    bool has_normals = list->plane_fd[1] >= 0;
    assert_int_equal(pread(list->plane_fd[0], words, bytes, (off_t)run->at[0]), bytes);
    if (has_normals)
        assert_int_equal(pread(list->plane_fd[1], packed, normal_bytes, (off_t)run->at[1]),
                         normal_bytes);
    const trip_block block =
        trip_block_make(&form, run->count, run->words, words, has_normals ? packed : NULL);
    trip_block_voxels(&block, 0, run->count, voxels);
    if (has_normals)
        trip_block_normals(&block, 0, run->count, normals);
    for (uint32_t n = 0; n < run->count; n++) {
        int64_t p[3];
        p[axis] = run->sheet;
        p[(axis + 1) % 3] = run->u + trip_voxel_u(voxels[n]);
        p[(axis + 2) % 3] = run->v + trip_voxel_v(voxels[n]);
        size_t at =
            (size_t)((p[2] * (int64_t)l->header.dims[1] + p[1]) * (int64_t)l->header.dims[0] +
                     p[0]);
        uint64_t key = (uint64_t)run->sheet << 40 |
                       trip_morton((uint32_t)p[(axis + 1) % 3], (uint32_t)p[(axis + 2) % 3]);
        l->out_of_order += l->splats[number] > 0 && key <= *last_key;
        *last_key = key;
        assert_int_equal(l->codes[number][at], -1);
        l->codes[number][at] = (int32_t)trip_voxel_code(voxels[n]);
        l->normals[number][at] = normals[n];
        l->splats[number]++;
    }
}

static inline void test_read_lists(const char *name, test_lists *l)
{
    trip_budget *budget;
    trip_dataset *d;
    assert_int_equal(trip_budget_create(&budget, (uint64_t)1 << 30), 0);
    assert_int_equal(trip_dataset_open(&d, test_path(name), budget), 0);
    assert_int_equal(trip_dataset_verify(d, budget), 0);
    *l = (test_lists){ .header = d->header, .text = strdup(d->text) };
    l->table = malloc((d->codes.entries + 1) * sizeof *l->table);
    if (d->codes.entries)
        memcpy(l->table, d->codes.table, d->codes.entries * sizeof *l->table);
    l->scale = trip_codes_of(&d->header, d->codes.table ? l->table : NULL);
    l->voxels = (size_t)(d->header.dims[0] * d->header.dims[1] * d->header.dims[2]);
    while (l->lists < d->list_count && d->lists[l->lists].level == 0)
        l->lists++;
    assert_true(l->lists == 3 || l->lists == TEST_LISTS);
    for (unsigned i = 0; i < l->lists; i++) {
        const trip_list *list = &d->lists[i];
        uint64_t last_key = 0;
        trip_selection s;
        trip_run run;
        l->codes[i] = malloc(l->voxels * sizeof(int32_t));
        l->normals[i] = calloc(l->voxels, sizeof(uint32_t));
        memset(l->codes[i], 0xff, l->voxels * sizeof(int32_t));
        assert_int_equal(
            trip_selection_create(&s, d, list, false, 0, list->dims[list->axis] - 1, budget), 0);
        for (uint64_t brick = 0; brick < list->brick_count; brick++)
            trip_selection_add(&s, brick);
        trip_run_iterator it = trip_run_begin(&s);
        while (trip_run_next(&it, &run))
            test_read_run(d, i, &run, l, &last_key);
        trip_selection_destroy(&s, budget);
    }
    trip_dataset_close(d);
    trip_budget_destroy(budget);
}

static inline void test_free_lists(test_lists *l)
{
    for (unsigned i = 0; i < l->lists; i++) {
        free(l->codes[i]);
        free(l->normals[i]);
    }
    free(l->text);
    free(l->table);
}

/* Checks that the lists are valid and in order, and that all three lists of a kind have the same
 * splats. */
static inline void test_check_lists(const test_lists *l)
{
    assert_int_equal(l->out_of_order, 0);
    for (unsigned i = 0; i < l->lists; i++) {
        const unsigned first = i - i % 3;
        assert_int_equal(l->splats[i], first ? l->header.halo : l->header.kept);
        assert_memory_equal(l->codes[i], l->codes[first], l->voxels * sizeof(int32_t));
        assert_memory_equal(l->normals[i], l->normals[first], l->voxels * sizeof(uint32_t));
    }
}

static inline bool test_same_file(const char *a, const char *b)
{
    FILE *f = fopen(a, "rb"), *g = fopen(b, "rb");
    int c = 0, d = 0;
    assert_true(f && g);
    while (c == d && c != EOF) {
        c = getc(f);
        d = getc(g);
    }
    fclose(f);
    fclose(g);
    return c == d;
}

/* Bricks a raw volume of bytes and keeps the values from 100 on. `p` gives the other parameters.
 * Returns the data set's text, which the caller frees. */
static inline char *test_brick_bytes(trip_brick_params p, const uint8_t *bytes, const int dims[3],
                                     trip_brick_summary *s)
{
    static const trip_value_range high = { 100, 255 };
    test_lists lists;
    test_write("bytes.raw", bytes, (size_t)dims[0] * (size_t)dims[1] * (size_t)dims[2]);
    p.input = test_path("bytes.raw");
    p.output = test_path("bytes.trip");
    p.ranges = &high;
    p.range_count = 1;
    p.replace = true;
    p.volume.raw_type = "uint8";
    for (int a = 0; a < 3; a++)
        p.volume.raw_dims[a] = dims[a];
    if (trip_brick(&p, s) != 0)
        fail_msg("%s", test_report);
    test_read_lists("bytes.trip", &lists);
    char *text = strdup(lists.text);
    assert_non_null(text);
    test_free_lists(&lists);
    return text;
}

/* Checks that all files of two data sets are equal byte for byte. */
static inline void test_same_dataset(const char *a, const char *b)
{
    static const char *const files[] = { "index.trip", "x0.voxels",  "y0.voxels",  "z0.voxels",
                                         "x0.normals", "y0.normals", "z0.normals", "x0.halo",
                                         "y0.halo",    "z0.halo" };
    for (size_t i = 0; i < sizeof files / sizeof *files; i++) {
        char first[256], second[256];
        snprintf(first, sizeof first, "%s/%s", test_path(a), files[i]);
        snprintf(second, sizeof second, "%s/%s", test_path(b), files[i]);
        if (access(first, F_OK) != 0 && access(second, F_OK) != 0)
            continue;
        if (!test_same_file(first, second))
            fail_msg("%s and %s differ", first, second);
    }
}

#endif
