/* The trial of a promise of error: draws small pictures of the data, and finds the cheapest
 * choice with an error within the promise.
 *
 * - Places: parallel views from two fixed directions, at places where the transfer function shows
 *   something. A voxel is as wide as in the frame.
 * - Interpolation: linear, or nearest. Cubic and gaussian take the choice of linear, because their
 *   pictures take many times longer.
 * - Truth: the CPU renderer with 16 samples per sheet and many rays per pixel, at the finest level.
 * - Error: the mean difference of red, green, blue and opacity, over the pixels that the object
 *   covers. The error that the truth itself may have is added.
 * - Cost: a formula, so that choices do not depend on the machine. */
#ifndef TRIP_QUALITY_TRIAL_H
#define TRIP_QUALITY_TRIAL_H

#include "library_context.h"
#include "quality_choice.h"

typedef struct trip_trial {
    double voxel_px; /* width of a voxel */
    double promise;  /* mean error, of 255 */
    /* The choice of the default settings. It wins if it keeps the promise. NULL: not preferred. */
    const trip_choice *preferred;
    trip_choice given; /* numbers that the caller gave */
    bool has_samples, has_rays, has_lod;
} trip_trial;

/* Makes the choice, with a context of its own on the same data set. Returns TRIP_INTERRUPTED
 * (reported) if the caller's work is cancelled. Returns TRIP_ERROR if a picture fails, without a
 * report; `why` (512 bytes) then has the reason. */
int trip_quality_trial(triptych *t, const trip_trial *trial, trip_choice *out, char *why);

#endif
