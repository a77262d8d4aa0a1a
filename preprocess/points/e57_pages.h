/* Reads the bytes of an E57 file (ASTM E2807). The file consists of pages, and each page ends in a
 * checksum (CRC-32C), which is verified. Logical offsets count the bytes without checksums. One
 * thread at a time. */
#ifndef TRIP_E57_PAGES_H
#define TRIP_E57_PAGES_H

#include <stddef.h>
#include <stdint.h>

typedef struct trip_e57_pages trip_e57_pages;

/* Opens a file and reads its header. */
int trip_e57_pages_open(trip_e57_pages **out, const char *path);
void trip_e57_pages_close(trip_e57_pages *p); /* NULL is allowed */

/* Return the place of the text that describes the file. */
uint64_t trip_e57_pages_text_at(const trip_e57_pages *p);
uint64_t trip_e57_pages_text_bytes(const trip_e57_pages *p);

/* Returns the logical offset of a place in the file. */
uint64_t trip_e57_pages_logical(const trip_e57_pages *p, uint64_t physical);
/* Returns the number of logical bytes. */
uint64_t trip_e57_pages_bytes(const trip_e57_pages *p);

/* Reads bytes from a logical offset. A wrong checksum and a read beyond the end are reported
 * failures. */
int trip_e57_pages_read(trip_e57_pages *p, void *to, size_t bytes, uint64_t logical);

#endif
