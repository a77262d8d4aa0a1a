/* Where left, front and head are: how the axes of world space lie in the patient. A convention is
 * three letters, the ends of the body that x, y and z point to: "LPS" as in DICOM (Left, Posterior,
 * Superior) or "RAS" as in NIfTI (Right, Anterior, Superior). World space is right-handed, so that
 * pictures are no mirror images, and these are the only two. "" where nothing is given. */
#ifndef TRIP_ANATOMY_H
#define TRIP_ANATOMY_H

#include <stdbool.h>

#include "geometry.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Whether `space` is one of the two; NULL is not. */
bool trip_anatomy_known(const char *space);

/* The unit vector of world space towards 'R', 'L', 'A', 'P', 'S' or 'I'; zero where the space or
 * the end is none of those known. */
trip_vec3 trip_anatomy_direction(const char *space, char end);

/* "right", "left", "anterior", "posterior", "superior", "inferior"; "" for other letters. */
const char *trip_anatomy_end_name(char end);

/* The ends of the body that a world vector points to, the one it points to most first: "L", "SP".
 * Less than TRIP_ANATOMY_LEAST of its length towards an end is none. "" for an unknown space or a
 * vector that is zero or not finite. */
#define TRIP_ANATOMY_LEAST 1e-4
const char *trip_anatomy_ends(const char *space, trip_vec3 v, char ends[4]);

/* The same in words: "left", "superior, 20 degrees to posterior", for lines of text. */
enum { TRIP_ANATOMY_WORDS = 80 };
const char *trip_anatomy_words(const char *space, trip_vec3 v, char words[TRIP_ANATOMY_WORDS]);

#ifdef __cplusplus
}
#endif

#endif
