/* Pages at the borders of slots. A slot mostly ends in mid page, with which the next slot of that
 * plane begins: it is read once, for the first of the two, and copied for the second when both are
 * handed out, which they are one right after the other. Belongs to the reader's thread. */
#ifndef TRIP_BORDER_H
#define TRIP_BORDER_H

#include "extent.h"

#define TRIP_BORDERS_MAX 4 /* pages of as many planes; slots of more lists read some twice */

/* A page that a slot ends with, by draw order, and where it lies in the slot. */
typedef struct trip_border {
    const trip_list *list;
    int plane;
    uint64_t offset;
    size_t slot_offset;
} trip_border;

typedef struct trip_borders {
    trip_border pages[TRIP_BORDERS_MAX];
    unsigned count;
} trip_borders;

/* A page to copy: the number of the border, and where it goes. */
typedef struct trip_border_copy {
    unsigned border;
    size_t slot_offset;
} trip_border_copy;

typedef struct trip_border_copies {
    trip_border_copy pages[TRIP_RANGES_MAX];
    unsigned count;
} trip_border_copies;

/* The pages that an extent ends with. */
void trip_borders_find(trip_borders *b, const trip_extent *e, bool descending, size_t page_bytes);
/* The bytes of a range that are left to read, [*first, *end), when a page at either end is among
 * the borders, which is added to the copies. */
void trip_borders_trim(const trip_borders *b, const trip_byte_range *range, size_t page_bytes,
                       trip_border_copies *copies, size_t *first, size_t *end);
/* Copies between a slot's memory and the pages kept of the slot before, TRIP_BORDERS_MAX of them.
 */
void trip_borders_fetch(const trip_border_copies *copies, const unsigned char *kept,
                        unsigned char *slot, size_t page_bytes);
void trip_borders_keep(const trip_borders *b, unsigned char *kept, const unsigned char *slot,
                       size_t page_bytes);

#endif
