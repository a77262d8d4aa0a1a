/* Chooses the resolution of moving frames from the times of the last ones. The model: a frame costs
 * a constant and an amount for each pixel of detail. A frame can have fewer pixels of detail than
 * pixels. Plain values, for one thread. */
#ifndef TRIP_VIEW_PACE_H
#define TRIP_VIEW_PACE_H

#ifdef __cplusplus
extern "C" {
#endif

/* Zero-initialise it. Weighted sums over past frames; older frames have smaller weights. */
typedef struct trip_pace {
    double weight, px, px_px, ms, px_ms, ms_ms;
} trip_pace;

/* Records the time of a frame. */
void trip_pace_note(trip_pace *p, double pixels, double ms);
/* Returns the expected time of a frame with `pixels` pixels, or 0 without records. */
double trip_pace_expect_ms(const trip_pace *p, double pixels);

/* The smallest resolution that is still useful, as a share of width and height. */
#define TRIP_PACE_MIN 0.03125

/* Returns the share of width and height, TRIP_PACE_MIN to 1, with which a frame should take
 * `target_ms`. `pixels` is the size of the full picture. Returns 0.5 without records. If the
 * constant cost alone exceeds the target, pixels get a quarter of it: fewer would gain little. The
 * result has at most three times the mean number of recorded pixels, because the cost of more is
 * unknown. */
double trip_pace_scale(const trip_pace *p, double pixels, double target_ms);

#ifdef __cplusplus
}
#endif

#endif
