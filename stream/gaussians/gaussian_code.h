/* The records of a brick: encoding and decoding. A record has 24 bytes, three little-endian words
 * of 64 bits; GAUSSIANS.md lists their bits. Coefficients of degree 1 to 3 are bytes in planes of
 * their own. All bits decode to finite values. Any thread. */
#ifndef TRIP_GAUSSIAN_CODE_H
#define TRIP_GAUSSIAN_CODE_H

#include "gaussian.h"
#include "gaussian_format.h"

/* Returns floor(log4(largest deviation)). A size of 0 has the least class. */
int trip_gaussian_size_class(const float deviations[3]);

/* Encodes records, in the given order, into planes[0 .. degree]. Sets the bounds and ranges
 * of *b, except first_record and size_class, and the checksums. Each pointer is the address of a
 * trip_gaussian that has only the coefficients up to `degree`. With a palette, the caller has
 * written planes[1]. */
void trip_gaussian_encode(trip_file_gaussian_brick *b, const trip_file_gaussian_header *h,
                          const unsigned char *const *splats, unsigned count,
                          unsigned char *const planes[]);
/* Encodes an entry of a palette. `sh` are the coefficients of a trip_gaussian. */
void trip_gaussian_encode_entry(const float sh[TRIP_SH_MAX][3], int degree, unsigned char *entry);
/* Sets the coefficients of degree 1 to `degree` from an entry. */
void trip_gaussian_decode_entry(const unsigned char *entry, int degree, float sh[TRIP_SH_MAX][3]);

/* Decodes the centre of a record. It lies within the brick's bounds. */
void trip_gaussian_decode_centre(const trip_file_gaussian_brick *b, const unsigned char *record,
                                 double centre[3]);
/* Decodes a record. `harmonics` are its bytes of degree 1 to `degree`, one plane after the other.
 */
void trip_gaussian_decode(const trip_file_gaussian_brick *b, const unsigned char *record,
                          const unsigned char *harmonics, int degree, trip_gaussian *out);

/* Sets the half extents along X, Y and Z of an ellipsoid of TRIP_GAUSSIAN_REACH deviations. */
void trip_gaussian_half_extents(const trip_gaussian *g, double half[3]);

/* Returns why no writer makes such a record of the brick, or NULL. */
const char *trip_gaussian_record_fault(const trip_file_gaussian_brick *b,
                                       const trip_file_gaussian_header *h,
                                       const unsigned char *record);
/* Returns the code of the centre along an axis, 0 to 2097151. It ascends with the coordinate. */
uint32_t trip_gaussian_centre_code(const unsigned char *record, int axis);

#endif
