#include "merge.h"

/* Restores the heap order below `at`: no parent has a greater key than its children. */
static void sift_down(trip_piece_source **heap, size_t count, size_t at)
{
    trip_piece_source *s = heap[at];
    for (;;) {
        size_t child = 2 * at + 1;
        if (child >= count)
            break;
        if (child + 1 < count && heap[child + 1]->piece->key < heap[child]->piece->key)
            child++;
        if (s->piece->key <= heap[child]->piece->key)
            break;
        heap[at] = heap[child];
        at = child;
    }
    heap[at] = s;
}

int trip_merge(trip_piece_source **sources, size_t count,
               int (*take)(void *user, const trip_piece *piece), void *user)
{
    size_t live = 0;
    for (size_t i = 0; i < count; i++)
        if (sources[i]->piece)
            sources[live++] = sources[i];
    for (size_t i = live / 2; i-- > 0;)
        sift_down(sources, live, i);
    while (live > 0) {
        int status = take(user, sources[0]->piece);
        if (status == 0)
            status = sources[0]->advance(sources[0]);
        if (status < 0)
            return status;
        if (!sources[0]->piece)
            sources[0] = sources[--live];
        if (live > 0)
            sift_down(sources, live, 0);
    }
    return 0;
}
