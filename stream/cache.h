/* Verified pages kept in memory between passes, so that views of the same data one after another
 * read less. A page stays as long as passes keep asking for it: frames read their lists from end to
 * end, where replacing the page unused for longest would always drop the one needed next. Where
 * there is room for all of them, each has its own place, and the pages of a plane lie in order.
 *
 * The reader's thread looks up and reserves; engine threads store and copy the pages of requests
 * under way, which stay where they are: for TRIP_CACHE_STALE_PASSES passes at least. */
#ifndef TRIP_CACHE_H
#define TRIP_CACHE_H

#include "dataset.h"

/* Two frames of three lists with two sides: a page unused for longer may go. */
#define TRIP_CACHE_STALE_PASSES 12

typedef struct trip_cache trip_cache;

/* For the planes that are read, a bit each. A page is named by its number in a table of all pages
 * of these. */
int trip_cache_create(trip_cache **out, const trip_dataset *d, unsigned planes, size_t bytes,
                      trip_budget *budget);
void trip_cache_destroy(trip_cache *c);
/* Bytes that hold everything. */
uint64_t trip_cache_full_bytes(const trip_dataset *d, unsigned planes);
uint32_t trip_cache_page(const trip_cache *c, unsigned list, int plane, uint64_t offset);
/* Bytes of a plane from `offset` on, where there is room for all: valid where its pages are. */
const unsigned char *trip_cache_bytes(const trip_cache *c, unsigned list, int plane,
                                      uint64_t offset);

/* Reader's thread: nothing is under way. */
void trip_cache_settle(trip_cache *c);
/* Reader's thread: requests of at most TRIP_CACHE_STALE_PASSES passes before may be under way. */
void trip_cache_begin_pass(trip_cache *c);
/* Reader's thread: whether the page was there when trip_cache_settle() was last called; if so it
 * stays for this pass. Pages stored since then do not count: when they come is a matter of time. */
bool trip_cache_find(trip_cache *c, uint32_t page);
/* Reader's thread: makes room for a page that is not there, to be stored by `filler`, if some page
 * is not needed any more. */
void trip_cache_reserve(trip_cache *c, uint32_t page, const void *filler);

/* Engine threads: the page, which was found. */
const void *trip_cache_get(const trip_cache *c, uint32_t page);
/* Engine threads: stores the page if it was reserved for this filler. */
void trip_cache_store(trip_cache *c, uint32_t page, const void *filler, const void *data,
                      size_t bytes);

#endif
