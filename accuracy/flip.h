/* How far apart two pictures look when they are shown in turns: Andersson, Nilsson,
 * Akenine-Moeller, Oskarsson, Astroem and Fairchild, "FLIP: A Difference Evaluator for Alternating
 * Images", Proceedings of the ACM on Computer Graphics and Interactive Techniques 3 (2020), for
 * pictures of low dynamic range. One thread. */
#ifndef TRIP_ACCURACY_FLIP_H
#define TRIP_ACCURACY_FLIP_H

#include "budget.h"

/* The paper's 67 pixels a degree: 0.7 m from a display 0.7 m wide with 3840 pixels. */
#define ACCURACY_FLIP_PIXELS_PER_DEGREE 67.0

/* The mean over the picture, 0 to 1. Pictures are width * height times 4 floats, display values
 * over black; what lies beyond 0 to 1 is clamped. Beyond the edges pixels repeat. Fails, reported,
 * without memory. */
int accuracy_flip(const float *a, const float *b, int width, int height, trip_budget *budget,
                  double *out);

#endif
