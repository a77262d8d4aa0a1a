/* Structural similarity of two pictures: Wang, Bovik, Sheikh and Simoncelli, "Image quality
 * assessment: from error visibility to structural similarity", IEEE Transactions on Image
 * Processing 13 (2004). One thread. */
#ifndef TRIP_ACCURACY_SSIM_H
#define TRIP_ACCURACY_SSIM_H

#include "budget.h"

/* Returns the mean SSIM (equation 13, with K1 = 0.01 and K2 = 0.03) over all windows of 11 x 11
 * pixels inside the picture. The windows have Gaussian weights of 1.5 pixels (equations 14 to 17).
 * The luminance is 0.299 r + 0.587 g + 0.114 b. Pictures are width * height * 4 floats over black.
 * Returns NaN if a side is below 11 pixels. Reports a failure if memory is exhausted. */
int accuracy_ssim(const float *a, const float *b, int width, int height, trip_budget *budget,
                  double *out);

#endif
