/* What the viewer measures of itself, and that as JSON. The window's thread only. */
#ifndef TRIP_VIEW_GAUGES_H
#define TRIP_VIEW_GAUGES_H

#include "viewer.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { TRIP_GAUGES_ANSWERS = 4096 };

/* Zeroed at first. */
typedef struct trip_gauges {
    float answers[TRIP_GAUGES_ANSWERS]; /* round: ms from input to a picture of the window */
    uint64_t answered;                  /* how many there were */
} trip_gauges;

void trip_gauges_note_answer(trip_gauges *g, double ms);

/* The value that so large a part of them does not exceed, 0 to 1; reorders them. 0 of none. */
double trip_gauges_quantile(float *values, int count, double part);

/* 0, or a reported failure. */
int trip_gauges_write(const trip_gauges *g, trip_viewer *v, const char *path);

#ifdef __cplusplus
}
#endif

#endif
