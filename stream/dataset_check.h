/* Checks of index.trip: bytes from outside, nothing in them is believed. `where` names the file;
 * faults are reported here with their place in it. No input or output, so that a fuzzer can call
 * these; any thread. */
#ifndef TRIP_DATASET_CHECK_H
#define TRIP_DATASET_CHECK_H

#include "format.h"

/* The header by itself, its checksum included. */
int trip_dataset_check_header(const trip_file_header *h, uint64_t file_bytes, const char *where);

/* What follows the header, by the page checksums. `index` is the whole file in memory, aligned to 8
 * bytes; its header has been checked and stands in *h. */
int trip_dataset_check_pages(const unsigned char *index, const trip_file_header *h,
                             const char *where);

/* The meaning of bytes that are as they were written: places, sums, orders, bounds. */
int trip_dataset_check_tables(const unsigned char *index, const trip_file_header *h,
                              const char *where);

#endif
