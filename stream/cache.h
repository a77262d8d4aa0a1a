/* Verified pages kept in memory between frames, so that views of the same data one after another
 * read less. A page stays as long as passes find it: frames read their lists from end to end, where
 * replacing the page unused for longest would always drop the one needed next. Where there is room
 * for all of them, each has its own place, and the pages of a plane lie in order.
 *
 * The reader's thread looks up and reserves; engine threads store and copy the pages of requests
 * under way. Pages that a request under way copies or stores stay where they are. */
#ifndef TRIP_CACHE_H
#define TRIP_CACHE_H

#include "dataset.h"

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

/* Reader's thread: a frame begins. trip_cache_end_passes() follows. */
void trip_cache_begin_frame(trip_cache *c);
/* Reader's thread: the next pass of the frame; returns its number, which only rises. */
uint32_t trip_cache_begin_pass(trip_cache *c);
/* Reader's thread: of requests made in the frames before this one, only those of `first_pass` and
 * later passes may be under way; UINT32_MAX: none. */
void trip_cache_end_passes(trip_cache *c, uint32_t first_pass);
/* Reader's thread: whether the page is there, and was reserved in a frame before this one; if so it
 * stays for this pass. Whether a page reserved in this frame is there yet is a matter of time. */
bool trip_cache_find(trip_cache *c, uint32_t page);
/* Reader's thread: makes room for a page that was not found, to be stored by `filler`, a request of
 * this pass, if some page is not needed any more. A page that an earlier request may yet store is
 * not reserved anew. */
void trip_cache_reserve(trip_cache *c, uint32_t page, const void *filler);

/* Engine threads: the page, which was found. */
const void *trip_cache_get(const trip_cache *c, uint32_t page);
/* Engine threads: stores the page if it was reserved for this filler and is not there yet. */
void trip_cache_store(trip_cache *c, uint32_t page, const void *filler, const void *data,
                      size_t bytes);

#endif
