#include "extent.h"

static uint64_t page_floor(const trip_planner *p, uint64_t offset)
{
    return offset & ~(uint64_t)(p->page_bytes - 1);
}

static uint64_t page_ceil(const trip_planner *p, uint64_t offset)
{
    return page_floor(p, offset + p->page_bytes - 1);
}

static const trip_selection *selection_of(const trip_planner *p)
{
    return &p->it.pass->selections[p->run.selection];
}

void trip_planner_begin(trip_planner *p, const trip_pass *pass, trip_pass_cursor *cursors)
{
    p->it = trip_pass_begin(pass, cursors);
    p->has_run = false;
    p->open = false;
}

/* The segment's place is known only now; its runs so far count from the file's start. */
static void close_segment(trip_planner *p, trip_extent *e)
{
    if (!p->open)
        return;
    uint64_t offset = page_floor(p, p->low);
    trip_segment *s = &e->segments[e->segment_count++];
    *s = (trip_segment){ .offset = offset,
                         .bytes = (size_t)(page_ceil(p, p->high) - offset),
                         .slot_offset = e->bytes,
                         .list = p->list };
    for (size_t i = p->first_run; i < e->run_count; i++)
        e->runs[i].first += e->bytes / TRIP_RECORD_BYTES - offset / TRIP_RECORD_BYTES;
    e->bytes += s->bytes;
    p->open = false;
}

static uint64_t gap_to(const trip_planner *p, uint64_t first, uint64_t end)
{
    return p->it.pass->descending ? p->low - end : first - p->high;
}

static bool open_segment(trip_planner *p, const trip_extent *e, uint64_t first, uint64_t end)
{
    if (e->segment_count == TRIP_SEGMENTS_MAX || e->bytes == p->slot_bytes)
        return false;
    p->open = true;
    p->list = selection_of(p)->list;
    p->first_run = e->run_count;
    p->anchor = p->it.pass->descending ? page_ceil(p, end) : page_floor(p, first);
    p->low = p->it.pass->descending ? end : first;
    p->high = p->low;
    return true;
}

/* Splats of the next run that fit the open segment: all of it, its first ones, or in a descending
 * pass its last ones. */
static uint32_t fitting(const trip_planner *p, const trip_extent *e, uint64_t first, uint64_t end)
{
    size_t room = p->slot_bytes - e->bytes;
    uint64_t bytes;
    if (p->it.pass->descending) {
        uint64_t limit = p->anchor > room ? p->anchor - room : 0;
        bytes = end <= limit ? 0 : end - (first > limit ? first : limit);
    } else {
        uint64_t limit = p->anchor + room;
        bytes = first >= limit ? 0 : (end < limit ? end : limit) - first;
    }
    return (uint32_t)(bytes / TRIP_RECORD_BYTES);
}

/* Moves the first (or last) `count` splats of the next run into the extent. */
static void take(trip_planner *p, trip_extent *e, uint32_t count)
{
    trip_run *run = &e->runs[e->run_count++];
    *run = p->run;
    run->count = count;
    if (p->it.pass->descending)
        run->first += p->run.count - count;
    else
        p->run.first += count;
    p->run.count -= count;
    p->has_run = p->run.count > 0;
    e->splats += count;
    uint64_t first = run->first * TRIP_RECORD_BYTES;
    uint64_t end = first + (uint64_t)count * TRIP_RECORD_BYTES;
    p->low = first < p->low ? first : p->low;
    p->high = end > p->high ? end : p->high;
}

/* Puts the next run, or what fits of it, into the extent; false when nothing fits. */
static bool place(trip_planner *p, trip_extent *e)
{
    uint64_t first = p->run.first * TRIP_RECORD_BYTES;
    uint64_t end = first + (uint64_t)p->run.count * TRIP_RECORD_BYTES;
    bool changes = p->open && p->list != selection_of(p)->list;
    if (changes && p->one_segment)
        return false;
    if (p->open && (changes || gap_to(p, first, end) > p->gap_bytes))
        close_segment(p, e);
    if (!p->open && !open_segment(p, e, first, end))
        return false;
    uint32_t count = fitting(p, e, first, end);
    if (count > 0)
        take(p, e, count);
    return count > 0;
}

static bool skip_run(trip_planner *p)
{
    if (!p->skip || !p->skip(p->skip_user, selection_of(p), p->run.brick))
        return false;
    p->runs_skipped++;
    p->splats_skipped += p->run.count;
    p->has_run = false;
    return true;
}

bool trip_planner_fill(trip_planner *p, trip_extent *e)
{
    e->segment_count = 0;
    e->run_count = e->bytes = 0;
    e->splats = 0;
    while (e->run_count < e->run_room) {
        if (!p->has_run && !(p->has_run = trip_pass_next(&p->it, &p->run)))
            break;
        if (!skip_run(p) && !place(p, e))
            break;
    }
    close_segment(p, e);
    return e->run_count > 0;
}
