/* Small data sets for the tests of stream/: random sparse volumes, their lists sorted by plain
 * comparison, written by the writer into a fresh folder. */
#ifndef TRIP_TEST_FIXTURE_H
#define TRIP_TEST_FIXTURE_H

#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "dataset.h"
#include "reader.h"
#include "report.h"
#include "skips.h"
#include "writer.h"

typedef struct fixture_voxel {
    uint32_t p[3];
    uint32_t code, normal;
} fixture_voxel;

/* Zero means the default; density in [0, 1], 0 stands for 0.2. */
typedef struct fixture_params {
    int64_t dims[3];
    double density;
    unsigned seed;
    unsigned tile_voxels, slab_sheets, page_bytes;
    unsigned code_bytes, normal_bytes; /* of the latter, 4 where there are normals */
    bool normals, empty, replace;
    const trip_coordinates *coordinates; /* NULL: even spacing */
    bool in_memory; /* in /dev/shm where there is one: no waiting for the disk to sync */
} fixture_params;

typedef struct fixture {
    char folder[64]; /* in /tmp, removed at the end */
    char path[96];
    fixture_params params;
    size_t count;
    fixture_voxel *lists[3];
    trip_budget *budget;
} fixture;

uint64_t fixture_random(uint64_t *state);

/* Makes the voxels and their sorted lists, and an empty folder; then writes the data set. */
void fixture_make(fixture *f, const fixture_params *params);
int fixture_write(fixture *f, const char *path);
void fixture_free(fixture *f);

/* A run of an iterator, by plain reads of the plane files; without normals those are 0. */
void fixture_read_run(const trip_dataset *d, const trip_list *list, const trip_run *run,
                      uint32_t *voxels, uint32_t *normals);
/* The records of a run of a batch, likewise. */
void fixture_decode_run(const trip_batch *batch, const trip_run *run, uint32_t *voxels,
                        uint32_t *normals);

/* All lines reported while it is on, joined by newlines. */
void fixture_catch_reports(void);
const char *fixture_reports(void);

/* A shell command, which must succeed. */
void fixture_run_command(const char *format, ...) __attribute__((format(printf, 1, 2)));

#endif
