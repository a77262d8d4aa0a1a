/* Statistics of the viewer, and their JSON file. Only the window's thread uses them. */
#ifndef TRIP_VIEW_GAUGES_H
#define TRIP_VIEW_GAUGES_H

#include "viewer.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { TRIP_GAUGES_ANSWERS = 4096 };

/* Zero-initialise it. */
typedef struct trip_gauges {
    float answers[TRIP_GAUGES_ANSWERS]; /* ring buffer: ms from an input to the picture that shows
                                           it */
    uint64_t answered;                  /* answers so far */
} trip_gauges;

void trip_gauges_note_answer(trip_gauges *g, double ms);

/* Returns the quantile `part` (0 to 1) of the values, or 0 if there are none. Reorders them. */
double trip_gauges_quantile(float *values, int count, double part);

/* Writes the statistics as JSON, with the labels of the panel's controls, `count` of them. Returns
 * 0, or a reported failure. */
int trip_gauges_write(const trip_gauges *g, trip_viewer *v, const char *const *labels, int count,
                      const char *path);

#ifdef __cplusplus
}
#endif

#endif
