/* FLIP estimates how different two pictures look when they alternate on a display. The
 * implementation is for pictures of low dynamic range. Source: Andersson, Nilsson, Akenine-Moeller,
 * Oskarsson, Astroem and Fairchild, "FLIP: A Difference Evaluator for Alternating Images",
 * Proceedings of the ACM on Computer Graphics and Interactive Techniques 3 (2020). One thread. */
#ifndef TRIP_ACCURACY_FLIP_H
#define TRIP_ACCURACY_FLIP_H

#include "budget.h"

/* 67 pixels per degree, as in the paper: a display 0.7 m wide with 3840 pixels, 0.7 m away. */
#define ACCURACY_FLIP_PIXELS_PER_DEGREE 67.0

/* Returns the mean over the picture, 0 to 1. Pictures are width * height * 4 floats, display values
 * over black, clamped to 0 to 1. Border pixels repeat. Reports a failure if memory is exhausted. */
int accuracy_flip(const float *a, const float *b, int width, int height, trip_budget *budget,
                  double *out);

#endif
