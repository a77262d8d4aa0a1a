/* Bricks a Gaussian scene: writes its data set from a source of splats, in the memory of a budget.
 * The data set depends on the splats and their order alone, not on memory and threads. An
 * interruption, a failure or a full disk leaves no file. */
#ifndef TRIP_BRICK_GAUSSIANS_H
#define TRIP_BRICK_GAUSSIANS_H

#include <stdbool.h>

#include "budget.h"
#include "gaussian.h"
#include "gaussian_octree.h"

/* Writes up to `room` splats to `out` and sets *got to their number; 0 means the end. Returns 0 or
 * a negative trip_status after a report. */
typedef int trip_gaussian_source(void *user, trip_gaussian *out, size_t room, size_t *got);

/* How coefficients of degree 1 and above are stored. */
typedef enum trip_brick_harmonics {
    TRIP_BRICK_HARMONICS_AUTO,    /* by a palette if the error of colours is below 0.5 of 255 */
    TRIP_BRICK_HARMONICS_PALETTE, /* by the number of an entry of a palette */
    TRIP_BRICK_HARMONICS_WHOLE,   /* each by itself */
} trip_brick_harmonics;

/* Zero means the default. */
typedef struct trip_brick_gaussians_params {
    const char *path; /* of the data set */
    bool replace;     /* replaces an existing data set */
    trip_gaussian_source *source;
    void *source_user;
    /* If the source gives its splats in the order of an octree (gaussian_octree.h), this octree and
     * the number of splats, at most. Otherwise NULL and 0. */
    const trip_octree *octree;
    uint64_t octree_records;
    const char *source_name; /* for messages; NULL means `path` */
    int degree;              /* of the spherical harmonics that are kept, 0 to 3 */
    trip_brick_harmonics harmonics;
    uint32_t flags;   /* trip_gaussian_flag (gaussian_format.h) */
    const char *text; /* JSON that the data set keeps; NULL means "{}" */
    unsigned threads; /* 0 means one for each processor */
    /* Folder for temporary files, which have no names. NULL means the new data set's folder. */
    const char *temporary;
    /* Called now and then by the bricking thread. A scene is done when it has passed about 6 times:
     * it is read, sorted by the octree, merged, and sorted by three axes. May be NULL. */
    void (*progress)(void *user, uint64_t passed);
    void *progress_user;
} trip_brick_gaussians_params;

typedef struct trip_brick_gaussians_result {
    uint64_t records;
    uint64_t coarse;  /* splats of coarse levels */
    uint64_t palette; /* entries; 0 without a palette */
    /* Mean error of colours by the palette of the file, of 1; 0 if none was tried. */
    double palette_error;
    uint64_t dropped; /* splats without finite values; a warning tells their number */
} trip_brick_gaussians_result;

/* `result` may be NULL. */
int trip_brick_gaussians(const trip_brick_gaussians_params *params, trip_budget *budget,
                         trip_brick_gaussians_result *result);

#endif
