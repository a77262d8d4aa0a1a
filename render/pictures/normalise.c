#include "normalise.h"

void trip_normalise(float *rgba, size_t pixels, const double background[4])
{
    for (size_t i = 0; i < pixels; i++, rgba += 4) {
        const double alpha = (double)rgba[3];
        const int covered = alpha > TRIP_NORMALISE_MIN;
        for (int c = 0; c < 3; c++)
            rgba[c] = (float)(covered ? (double)rgba[c] / alpha : background[c] * background[3]);
        rgba[3] = covered ? 1 : (float)background[3];
    }
}

void trip_put_behind(float *rgba, size_t pixels, const double background[4])
{
    float behind[4];
    for (int c = 0; c < 4; c++)
        behind[c] = (float)((c < 3 ? background[c] : 1) * background[3]);
    for (size_t i = 0; i < pixels; i++, rgba += 4) {
        const float through = 1 - rgba[3];
        for (int c = 0; c < 4; c++)
            rgba[c] += through * behind[c];
    }
}
