#include "border.h"

#include <string.h>

static const trip_border *find_border(const trip_borders *b, const trip_byte_range *range,
                                      uint64_t offset)
{
    for (unsigned i = 0; i < b->count; i++)
        if (b->pages[i].list == range->list && b->pages[i].plane == range->plane &&
            b->pages[i].offset == offset)
            return &b->pages[i];
    return NULL;
}

static bool has_border(const trip_borders *b, const trip_byte_range *range)
{
    for (unsigned i = 0; i < b->count; i++)
        if (b->pages[i].list == range->list && b->pages[i].plane == range->plane)
            return true;
    return false;
}

void trip_borders_find(trip_borders *b, const trip_extent *e, bool descending, size_t page_bytes)
{
    b->count = 0;
    for (unsigned i = e->range_count; i > 0 && b->count < TRIP_BORDERS_MAX; i--) {
        const trip_byte_range *s = &e->ranges[i - 1];
        if (has_border(b, s)) /* of a later piece */
            continue;
        size_t at = descending ? 0 : s->bytes - page_bytes;
        b->pages[b->count++] =
            (trip_border){ s->list, s->plane, s->offset + at, s->slot_offset + at };
    }
}

static bool copy_page(const trip_borders *b, const trip_byte_range *range, size_t at,
                      trip_border_copies *copies)
{
    const trip_border *border = find_border(b, range, range->offset + at);
    if (border)
        copies->pages[copies->count++] =
            (trip_border_copy){ (unsigned)(border - b->pages), range->slot_offset + at };
    return border;
}

void trip_borders_trim(const trip_borders *b, const trip_byte_range *range, size_t page_bytes,
                       trip_border_copies *copies, size_t *first, size_t *end)
{
    *first = 0;
    *end = range->bytes;
    if (copy_page(b, range, 0, copies))
        *first = page_bytes;
    else if (copy_page(b, range, range->bytes - page_bytes, copies))
        *end -= page_bytes;
}

void trip_borders_fetch(const trip_border_copies *copies, const unsigned char *kept,
                        unsigned char *slot, size_t page_bytes)
{
    for (unsigned i = 0; i < copies->count; i++)
        memcpy(slot + copies->pages[i].slot_offset, kept + copies->pages[i].border * page_bytes,
               page_bytes);
}

void trip_borders_keep(const trip_borders *b, unsigned char *kept, const unsigned char *slot,
                       size_t page_bytes)
{
    for (unsigned i = 0; i < b->count; i++)
        memcpy(kept + i * page_bytes, slot + b->pages[i].slot_offset, page_bytes);
}
