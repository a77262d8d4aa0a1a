/* How much detail frames may have while the view moves, from how long the last ones took: a frame
 * costs something whatever its detail, and something for each pixel that it has detail for, of
 * which there may be fewer than it has pixels. Plain values, one thread. */
#ifndef TRIP_VIEW_PACE_H
#define TRIP_VIEW_PACE_H

#ifdef __cplusplus
extern "C" {
#endif

/* Zeroed at first: nothing is known. Sums over the frames noted, of which older ones count less. */
typedef struct trip_pace {
    double weight, px, px_px, ms, px_ms, ms_ms;
} trip_pace;

/* A frame of so many pixels took so long. */
void trip_pace_note(trip_pace *p, double pixels, double ms);
/* What a frame of so many pixels would take; 0 where nothing is known. */
double trip_pace_expect_ms(const trip_pace *p, double pixels);

/* Less shows nothing. */
#define TRIP_PACE_MIN 0.03125

/* The part of the width and height of a picture of so many pixels with which a frame keeps to
 * `target_ms`, TRIP_PACE_MIN to 1; a half where nothing is known. Where what every frame costs
 * leaves too little, pixels get a quarter of that cost: fewer would gain nothing. A frame has at
 * most three times the pixels of those noted, in the mean: beyond them the cost is not known. */
double trip_pace_scale(const trip_pace *p, double pixels, double target_ms);

#ifdef __cplusplus
}
#endif

#endif
