/* The structural similarity of two pictures: Wang, Bovik, Sheikh and Simoncelli, "Image quality
 * assessment: from error visibility to structural similarity", IEEE Transactions on Image
 * Processing 13 (2004). One thread. */
#ifndef TRIP_ACCURACY_SSIM_H
#define TRIP_ACCURACY_SSIM_H

#include "budget.h"

/* The mean of SSIM (their equation 13, with K1 = 0.01, K2 = 0.03) over windows of 11 x 11 pixels
 * with Gaussian weights of 1.5 pixels (equations 14 to 17) that lie in the picture, of the
 * luminance 0.299 r + 0.587 g + 0.114 b. Pictures are width * height times 4 floats over black. NaN
 * where a side is below 11 pixels. Fails, reported, without memory. */
int accuracy_ssim(const float *a, const float *b, int width, int height, trip_budget *budget,
                  double *out);

#endif
