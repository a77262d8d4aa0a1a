/* Checks the bytes of index.trip, which may come from anyone. `where` names the file. Faults are
 * reported with their offset. No input or output, so that a fuzzer can call these functions. Any
 * thread. */
#ifndef TRIP_DATASET_CHECK_H
#define TRIP_DATASET_CHECK_H

#include "format.h"

/* Checks the header and its checksum. */
int trip_dataset_check_header(const trip_file_header *h, uint64_t file_bytes, const char *where);

/* Checks the bytes after the header against the page checksums. `index` is the whole file in
 * memory, aligned to 8 bytes. *h is its header, already checked. */
int trip_dataset_check_pages(const unsigned char *index, const trip_file_header *h,
                             const char *where);

/* Checks the meaning of undamaged bytes: offsets, sums, orders, bounds. */
int trip_dataset_check_tables(const unsigned char *index, const trip_file_header *h,
                              const char *where);

#endif
