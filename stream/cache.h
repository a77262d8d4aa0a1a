/* Keeps verified pages in memory between frames, so that similar views read less. A page stays as
 * long as passes use it. Evicting the least recently used page would not work: frames read their
 * lists from end to end, so the page evicted would always be the page needed next. If all pages
 * fit, each page has its own position, and the pages of a plane lie in order.
 *
 * The reader's thread looks up and reserves pages. Engine threads store and copy the pages of
 * running requests. A page in use by a running request does not move. */
#ifndef TRIP_CACHE_H
#define TRIP_CACHE_H

#include "dataset.h"

typedef struct trip_cache trip_cache;

/* Creates a cache for the planes in the bit mask. A page is identified by its index in a table of
 * all pages. */
int trip_cache_create(trip_cache **out, const trip_dataset *d, unsigned planes, size_t bytes,
                      trip_budget *budget);
void trip_cache_destroy(trip_cache *c);
/* Returns the bytes that hold all pages. */
uint64_t trip_cache_full_bytes(const trip_dataset *d, unsigned planes);
uint32_t trip_cache_page(const trip_cache *c, unsigned list, int plane, uint64_t offset);
/* Returns the bytes of a plane from `offset` on, in a cache that holds all pages. Valid where the
 * pages are stored. */
const unsigned char *trip_cache_bytes(const trip_cache *c, unsigned list, int plane,
                                      uint64_t offset);

/* Reader's thread: begins a frame. Call trip_cache_end_passes() next. */
void trip_cache_begin_frame(trip_cache *c);
/* Reader's thread: begins the next pass of the frame. Returns its number, which only rises. */
uint32_t trip_cache_begin_pass(trip_cache *c);
/* Reader's thread: declares that requests from earlier frames only run if their pass is
 * `first_pass` or later. UINT32_MAX means that none run. */
void trip_cache_end_passes(trip_cache *c, uint32_t first_pass);
/* Reader's thread: whether the page is stored and was reserved before this frame. If so, it stays
 * for this pass. Pages reserved in this frame do not count, since the time at which they arrive
 * varies. */
bool trip_cache_find(trip_cache *c, uint32_t page);
/* Reader's thread: reserves room for a page that was not found, if some page is no longer needed.
 * `filler`, a request of this pass, will store it. A page that an earlier request may still store
 * is not reserved again. */
void trip_cache_reserve(trip_cache *c, uint32_t page, const void *filler);

/* Engine threads: returns a page that was found. */
const void *trip_cache_get(const trip_cache *c, uint32_t page);
/* Engine threads: stores the page if it was reserved for this filler and is not stored yet. */
void trip_cache_store(trip_cache *c, uint32_t page, const void *filler, const void *data,
                      size_t bytes);

#endif
