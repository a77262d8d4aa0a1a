#include "extent.h"

#include "block.h"

static uint64_t page_floor(const trip_planner *p, uint64_t offset)
{
    return offset & ~(uint64_t)(p->page_bytes - 1);
}

/* Returns the bytes of the pages that hold [low, high). */
static size_t paged_bytes(const trip_planner *p, uint64_t low, uint64_t high)
{
    return (size_t)(page_floor(p, high + p->page_bytes - 1) - page_floor(p, low));
}

size_t trip_planner_min_slot(const trip_dataset *d, unsigned planes)
{
    const size_t page = (size_t)1 << d->header.page_log2;
    size_t bytes = 0, words = 0;
    for (unsigned i = 0; i < d->list_count; i++) {
        const trip_block_form form = trip_block_form_of(&d->header, d->lists[i].kind);
        const size_t own = trip_kind_of(d->lists[i].kind)->max_words(&form);
        words = own > words ? own : words;
    }
    const size_t records = (size_t)1 << 2 * d->header.tile_log2;
    const size_t max[TRIP_PLANES] = { 8 * words, records * d->header.normal_bytes, records };
    for (int plane = 0; plane < TRIP_PLANES; plane++)
        if (planes >> plane & 1) /* a run may start anywhere in a page */
            bytes += (max[plane] + page - 1) / page * page + page;
    return bytes;
}

static const trip_selection *selection_of(const trip_planner *p)
{
    return &p->it.pass->selections[p->run.selection];
}

/* Whether a plane of the list is read. */
static bool is_read(const trip_planner *p, const trip_list *list, int plane)
{
    return p->planes & list->planes & 1u << plane;
}

void trip_planner_begin(trip_planner *p, const trip_pass *pass, trip_pass_cursor *cursors)
{
    p->it = trip_pass_begin(pass, cursors);
    p->has_run = false;
}

static size_t run_bytes(const trip_planner *p, const trip_run *run, int plane)
{
    switch (plane) {
    case TRIP_PLANE_VOXELS:
        return 8 * (size_t)run->words;
    case TRIP_PLANE_NORMALS:
        return run->count * p->normal_bytes;
    default:
        return run->count;
    }
}

/* Returns the next run as a piece of its own. */
static trip_piece piece_of(const trip_planner *p)
{
    const trip_run *run = &p->run;
    trip_piece piece = { .list = selection_of(p)->list };
    for (int plane = 0; plane < TRIP_PLANES; plane++)
        if (is_read(p, piece.list, plane)) {
            piece.low[plane] = run->at[plane];
            piece.high[plane] = run->at[plane] + run_bytes(p, run, plane);
        }
    return piece;
}

static size_t piece_bytes(const trip_planner *p, const trip_piece *piece)
{
    size_t bytes = 0;
    for (int plane = 0; plane < TRIP_PLANES; plane++)
        bytes += paged_bytes(p, piece->low[plane], piece->high[plane]);
    return bytes;
}

/* Returns the last piece of the same list, if the gap to `next` is small enough to read through. */
static trip_piece *find_piece(const trip_planner *p, trip_extent *e, const trip_piece *next)
{
    trip_piece *piece = NULL;
    for (unsigned i = e->piece_count; i > 0 && !piece; i--)
        if (e->pieces[i - 1].list == next->list)
            piece = &e->pieces[i - 1];
    for (int plane = 0; piece && plane < TRIP_PLANES; plane++) {
        uint64_t gap = p->it.pass->descending ? piece->low[plane] - next->high[plane]
                                              : next->low[plane] - piece->high[plane];
        if (gap > p->gap_bytes)
            return NULL;
    }
    return piece;
}

static uint64_t lesser(uint64_t a, uint64_t b)
{
    return a < b ? a : b;
}

static uint64_t greater(uint64_t a, uint64_t b)
{
    return a > b ? a : b;
}

/* Returns the number of bytes that a piece grows by if it includes `next`. */
static size_t bytes_more(const trip_planner *p, const trip_piece *piece, const trip_piece *next)
{
    size_t bytes = 0;
    for (int plane = 0; plane < TRIP_PLANES; plane++)
        bytes += paged_bytes(p, lesser(piece->low[plane], next->low[plane]),
                             greater(piece->high[plane], next->high[plane]));
    return bytes - piece_bytes(p, piece);
}

static void join(trip_piece *piece, const trip_piece *next)
{
    for (int plane = 0; plane < TRIP_PLANES; plane++) {
        piece->low[plane] = lesser(piece->low[plane], next->low[plane]);
        piece->high[plane] = greater(piece->high[plane], next->high[plane]);
    }
}

/* Adds the next run to the extent. Returns false if it does not fit. */
static bool position(trip_planner *p, trip_extent *e)
{
    const trip_piece next = piece_of(p);
    trip_piece *piece = find_piece(p, e, &next);
    unsigned max = p->one_piece ? 1 : TRIP_PIECES_MAX;
    if (!piece && e->piece_count == max)
        return false;
    size_t bytes = e->bytes + (piece ? bytes_more(p, piece, &next) : piece_bytes(p, &next));
    if (bytes > p->slot_bytes && e->run_count > 0)
        return false;
    if (piece)
        join(piece, &next);
    else
        e->pieces[e->piece_count++] = next;
    e->bytes = bytes;
    e->runs[e->run_count++] = p->run;
    e->records += p->run.count;
    p->has_run = false;
    return true;
}

static bool skip_run(trip_planner *p)
{
    if (!p->skip || !p->skip(p->skip_user, selection_of(p), &p->run))
        return false;
    trip_piece piece = piece_of(p);
    for (int plane = 0; plane < TRIP_PLANES; plane++)
        p->bytes_skipped += piece.high[plane] - piece.low[plane];
    p->runs_skipped++;
    p->has_run = false;
    return true;
}

/* Assigns the pieces to the slot, plane by plane. */
static void place_pieces(const trip_planner *p, trip_extent *e)
{
    size_t at = 0;
    for (int plane = 0; plane < TRIP_PLANES; plane++) {
        e->plane_at[plane] = at;
        for (unsigned i = 0; i < e->piece_count; i++) {
            const trip_piece *piece = &e->pieces[i];
            if (!is_read(p, piece->list, plane))
                continue;
            trip_byte_range *s = &e->ranges[e->range_count++];
            *s = (trip_byte_range){ .offset = page_floor(p, piece->low[plane]),
                                    .bytes = paged_bytes(p, piece->low[plane], piece->high[plane]),
                                    .slot_offset = at,
                                    .list = piece->list,
                                    .plane = plane };
            at += s->bytes;
        }
        e->plane_bytes[plane] = at - e->plane_at[plane];
    }
}

/* Whether the range includes all these bytes. Ranges may share a page, since a gap between two
 * pieces may be large in one plane and small in another. */
static bool is_in(const trip_byte_range *s, const trip_list *list, int plane, uint64_t offset,
                  size_t bytes)
{
    return s->list == list && s->plane == plane && offset >= s->offset &&
           offset - s->offset + bytes <= s->bytes;
}

/* Converts an offset in a plane file to an offset in the slot's part for the plane. `from` is the
 * range of the last offset, which neighbours usually share. */
static size_t position_in_slot(const trip_extent *e, const trip_list *list, int plane,
                               uint64_t offset, size_t bytes, unsigned *from)
{
    unsigned i = *from;
    while (!is_in(&e->ranges[i], list, plane, offset, bytes))
        i = i + 1 < e->range_count ? i + 1 : 0;
    *from = i;
    const trip_byte_range *s = &e->ranges[i];
    return s->slot_offset - e->plane_at[plane] + (size_t)(offset - s->offset);
}

static void place_runs(const trip_planner *p, trip_extent *e)
{
    unsigned from[TRIP_PLANES] = { 0 };
    for (size_t i = 0; i < e->run_count; i++) {
        trip_run *run = &e->runs[i];
        const trip_list *list = p->it.pass->selections[run->selection].list;
        for (int plane = 0; plane < TRIP_PLANES; plane++) {
            size_t bytes = run_bytes(p, run, plane);
            run->at[plane] =
                is_read(p, list, plane)
                    ? position_in_slot(e, list, plane, run->at[plane], bytes, &from[plane])
                    : 0;
        }
    }
}

bool trip_planner_fill(trip_planner *p, trip_extent *e)
{
    e->piece_count = e->range_count = 0;
    e->run_count = e->bytes = 0;
    e->records = 0;
    while (e->run_count < e->run_room) {
        if (!p->has_run && !(p->has_run = trip_pass_next(&p->it, &p->run)))
            break;
        if (!skip_run(p) && !position(p, e))
            break;
    }
    place_pieces(p, e);
    place_runs(p, e);
    return e->run_count > 0;
}
