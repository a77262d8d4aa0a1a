/* Prints the size of a data set for people, alike in `brick` and `info`. */
#ifndef TRIP_CLI_SIZE_PRINT_H
#define TRIP_CLI_SIZE_PRINT_H

#include <stdint.h>

/* The parts of a data set on disk, in bytes. */
typedef struct data_set_size {
    uint64_t all; /* of all files */
    uint64_t halo, levels;
} data_set_size;

/* Prints "8.97 MB on disk: 2.98 MB of kept voxels and index, 4.47 MB of halo, ..." and ends the
 * line. */
void size_print(const data_set_size *size);
/* Writes "4975" or, from a million on, "35.27 million" into `text`. Returns it. */
const char *size_print_count(uint64_t count, char text[static 32]);
/* Writes a number with 7 digits, or a whole one below 10^15 with all digits, into `text`. Writes a
 * negative zero as 0. Returns `text`. */
const char *size_print_number(double value, char text[static 32]);
/* Prints "2 bytes a value, 3 a normal", without an end of line. */
void size_print_each(unsigned code_bytes, unsigned normal_bytes);

#endif
