/* Pages at the borders of slots. A slot usually ends inside a page, and the next slot of the same
 * plane starts with that page. The page is read once, for the first slot. It is copied to the
 * second slot when that slot is handed out, right after the first. Owned by the reader's thread. */
#ifndef TRIP_BORDER_H
#define TRIP_BORDER_H

#include "extent.h"

/* Pages of as many planes. With more lists, some pages are read twice. */
#define TRIP_BORDERS_MAX 4

/* The page at the end of a slot, in draw order, and its offset in the slot. */
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

/* A page to copy: index of the border, and the offset of the copy in the slot. */
typedef struct trip_border_copy {
    unsigned border;
    size_t slot_offset;
} trip_border_copy;

typedef struct trip_border_copies {
    trip_border_copy pages[TRIP_RANGES_MAX];
    unsigned count;
} trip_border_copies;

/* Finds the pages at the end of an extent. */
void trip_borders_find(trip_borders *b, const trip_extent *e, bool descending, size_t page_bytes);
/* Finds the bytes [*first, *end) of a range that must be read. If the page at either end is a
 * border, adds it to the copies and leaves it out. */
void trip_borders_trim(const trip_borders *b, const trip_byte_range *range, size_t page_bytes,
                       trip_border_copies *copies, size_t *first, size_t *end);
/* Copy between a slot and the kept pages of the slot before, at most TRIP_BORDERS_MAX pages. */
void trip_borders_fetch(const trip_border_copies *copies, const unsigned char *kept,
                        unsigned char *slot, size_t page_bytes);
void trip_borders_keep(const trip_borders *b, unsigned char *kept, const unsigned char *slot,
                       size_t page_bytes);

#endif
