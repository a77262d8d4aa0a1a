/* Anatomical directions of the axes of world space. A space is three letters, the ends of the body
 * that x, y and z point to. "LPS" (left, posterior, superior) is the space of DICOM and of most
 * NRRD files, "RAS" (right, anterior, superior) the space of NIfTI and of all data sets. These two
 * are the only ones, since world space is right-handed and pictures must not be mirrored. "" stands
 * for an unknown space. Pure functions.
 */
#ifndef TRIP_ANATOMY_H
#define TRIP_ANATOMY_H

#include <stdbool.h>

#include "geometry.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Whether `space` is "LPS" or "RAS". False for NULL. */
bool trip_anatomy_known(const char *space);

/* Returns the unit vector of world space towards end 'R', 'L', 'A', 'P', 'S' or 'I'. Returns zero
 * for an unknown space or end. */
trip_vec3 trip_anatomy_direction(const char *space, char end);

/* Whether `axes` has three letters for the axes of a grid, one from each pair of ends, such as
 * "PIR". */
#define TRIP_ANATOMY_AXES                                                                          \
    "three letters, where x, y and z point to: one of R and L, one of A and P, one of S and I"
bool trip_anatomy_axes_valid(const char *axes);

/* Returns whether a grid without orientation counts as a scan from the top of the head down. The
 * face is then in the first rows, as in most such scans. Its axes must be the axes of world space,
 * and its voxels clearly longer along one axis than along another. */
bool trip_anatomy_is_scan_from_above(const trip_affine *index_to_world);

/* Returns "right", "left", "anterior", "posterior", "superior" or "inferior", or "" for other
 * letters. */
const char *trip_anatomy_end_name(char end);

/* Writes the ends of the body that a world vector points to, the main end first, such as "L" or
 * "SP". An end counts if the component towards it is at least TRIP_ANATOMY_MIN of the vector's
 * length. Writes
 * "" for an unknown space and for a vector that is zero or not finite. */
#define TRIP_ANATOMY_MIN 1e-4
const char *trip_anatomy_ends(const char *space, trip_vec3 v, char ends[4]);

/* Writes these ends in words for messages, such as "left" or "superior, 20 degrees to posterior".
 */
enum { TRIP_ANATOMY_WORDS = 80 };
const char *trip_anatomy_words(const char *space, trip_vec3 v, char words[TRIP_ANATOMY_WORDS]);

#ifdef __cplusplus
}
#endif

#endif
