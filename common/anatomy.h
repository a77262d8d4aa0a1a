/* How the axes of world space lie in the patient. A space is three letters, the ends of the body
 * that x, y and z point to: "LPS" as in DICOM (left, posterior, superior) or "RAS" as in NIfTI
 * (right, anterior, superior). These are the only two, as world space is right-handed, so that
 * pictures are no mirror images. "" stands for an unknown space. Pure functions. */
#ifndef TRIP_ANATOMY_H
#define TRIP_ANATOMY_H

#include <stdbool.h>

#include "geometry.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Whether `space` is one of the two; false for NULL. */
bool trip_anatomy_known(const char *space);

/* The unit vector of world space towards 'R', 'L', 'A', 'P', 'S' or 'I'; zero for an unknown
 * space or end. */
trip_vec3 trip_anatomy_direction(const char *space, char end);

/* Whether these are the ends that three axes of a grid point to, one of each pair: "PIR". */
#define TRIP_ANATOMY_AXES                                                                          \
    "three letters, where x, y and z point to: one of R and L, one of A and P, one of S and I"
bool trip_anatomy_axes_valid(const char *axes);

/* Whether a grid whose file gives no orientation is taken for a scan from the top of the head down,
 * with the face in the first rows, as most are: its axes are those of the world, and its voxels
 * clearly longer along one than along another. */
bool trip_anatomy_is_scan_from_above(const trip_affine *index_to_world);

/* "right", "left", "anterior", "posterior", "superior", "inferior"; "" for other letters. */
const char *trip_anatomy_end_name(char end);

/* The ends of the body that a world vector points to, the main one first: "L", "SP". An end counts
 * if the component towards it is at least TRIP_ANATOMY_MIN of the vector's length. "" for an
 * unknown space and for a vector that is zero or not finite. */
#define TRIP_ANATOMY_MIN 1e-4
const char *trip_anatomy_ends(const char *space, trip_vec3 v, char ends[4]);

/* The same in words: "left", "superior, 20 degrees to posterior", for messages. */
enum { TRIP_ANATOMY_WORDS = 80 };
const char *trip_anatomy_words(const char *space, trip_vec3 v, char words[TRIP_ANATOMY_WORDS]);

#ifdef __cplusplus
}
#endif

#endif
