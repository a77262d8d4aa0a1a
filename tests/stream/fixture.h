/* Makes small data sets for the tests of stream/. The volumes are sparse and random. Their lists
 * are sorted by plain comparison, and the writer writes them to a temporary folder. */
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

/* Zero selects the default. density is in [0, 1], with a default of 0.2. */
typedef struct fixture_params {
    int64_t dims[3];
    double density;
    unsigned seed;
    unsigned tile_voxels, slab_sheets, page_bytes;
    unsigned code_bytes, normal_bytes; /* default of normal_bytes: 4 if there are normals */
    bool normals, empty, replace;
    const trip_coordinates *coordinates; /* NULL selects even spacing */
    bool in_memory; /* uses /dev/shm if it exists, which saves waiting for the disk */
} fixture_params;

typedef struct fixture {
    char folder[64]; /* temporary; fixture_free() removes it */
    char path[96];
    fixture_params params;
    size_t count;
    fixture_voxel *lists[3];
    trip_budget *budget;
} fixture;

uint64_t fixture_random(uint64_t *state);

/* Makes the voxels, their sorted lists and an empty folder, then writes the data set. */
void fixture_make(fixture *f, const fixture_params *params);
int fixture_write(fixture *f, const char *path);
void fixture_free(fixture *f);

/* Reads a run of an iterator directly from the plane files. Sets normals to 0 if the data set has
 * none. */
void fixture_read_run(const trip_dataset *d, const trip_list *list, const trip_run *run,
                      uint32_t *voxels, uint32_t *normals);
/* Decodes the records of a run of a batch. Sets normals to 0 if the batch has none. */
void fixture_decode_run(const trip_batch *batch, const trip_run *run, uint32_t *voxels,
                        uint32_t *normals);

/* Catches reports until fixture_reports(), which returns all lines joined by newlines. */
void fixture_catch_reports(void);
const char *fixture_reports(void);

/* Runs a shell command and checks that it succeeds. */
void fixture_run_command(const char *format, ...) __attribute__((format(printf, 1, 2)));

#endif
