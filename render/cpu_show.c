#include "cpu_show.h"

/* Squares of a run, from the largest looked at to the least; and the fewest voxels whose square is
 * worth a closer look, which costs about as much as two splats. */
enum { LARGEST = 32, LEAST = 8, FEWEST = 6 };

/* Full squares are found at the first look, others by halving. */
uint32_t trip_cpu_square_count(const uint32_t *voxels, uint32_t count, unsigned edge, bool reversed)
{
    const uint32_t *first = reversed ? voxels + count - 1 : voxels;
    uint32_t same = 0x0101u * (256 - edge), square = *first & same;
    uint32_t in = 1, beyond = (count < edge * edge ? count : edge * edge) + 1;
    for (uint32_t look = beyond - 1; look > in; look = (in + beyond) / 2) {
        if (((reversed ? first[-(int64_t)(look - 1)] : first[look - 1]) & same) == square)
            in = look;
        else
            beyond = look;
    }
    return in;
}

/* What is found so far. */
typedef struct showing {
    const trip_cpu_view *view;
    const trip_cpu_mask *mask;
    const uint32_t *voxels; /* the batch's */
    bool reversed;
    trip_cpu_span all;
    trip_cpu_span *shown;
    uint32_t count, from; /* from: voxels shown from there on are not written yet */
} showing;

static void show_until(showing *s, uint32_t end)
{
    if (end > s->from)
        s->shown[s->count++] = trip_cpu_span_part(&s->all, s->reversed, s->from, end - s->from);
}

static trip_cpu_cover square_cover(const showing *s, uint32_t voxel, unsigned edge)
{
    const double half = 0.5 * (edge - 1);
    double u = s->all.run->u + (int)(trip_voxel_u(voxel) & ~(edge - 1));
    double v = s->all.run->v + (int)(trip_voxel_v(voxel) & ~(edge - 1));
    trip_cpu_box box = { { u + half, v + half, s->all.run->sheet }, { half, half, 0 } };
    return trip_cpu_box_cover(s->view, s->mask, &box);
}

/* Leaves out the squares between two of the voxels that are hidden. */
static void look_at_squares(showing *s, uint32_t at, uint32_t end, unsigned edge)
{
    while (at < end) {
        trip_cpu_span rest = trip_cpu_span_part(&s->all, s->reversed, at, end - at);
        const uint32_t *voxels = s->voxels + rest.first;
        uint32_t count = trip_cpu_square_count(voxels, rest.count, edge, s->reversed);
        trip_cpu_cover cover = square_cover(s, voxels[s->reversed ? rest.count - 1 : 0], edge);
        if (cover == TRIP_CPU_HIDDEN) {
            show_until(s, at);
            s->from = at + count;
        } else if (cover == TRIP_CPU_PARTLY && edge > LEAST && count >= FEWEST) {
            look_at_squares(s, at, at + count, edge / 2);
        }
        at += count;
    }
}

uint32_t trip_cpu_show(const trip_cpu_view *view, const trip_cpu_mask *mask,
                       const trip_batch *batch, const trip_cpu_span *span, trip_cpu_span *shown)
{
    const trip_run *run = span->run;
    trip_cpu_cover cover = TRIP_CPU_SHOWN;
    if (view->front_to_back) {
        trip_cpu_box box = trip_cpu_brick_box(view, run->brick, run->sheet, run->sheet);
        cover = trip_cpu_box_cover(view, mask, &box);
    }
    if (cover == TRIP_CPU_HIDDEN)
        return 0;
    showing s = { .view = view,
                  .mask = mask,
                  .voxels = batch->voxels,
                  .reversed = batch->selection->descending,
                  .all = *span,
                  .shown = shown };
    if (cover == TRIP_CPU_PARTLY)
        look_at_squares(&s, 0, span->count, LARGEST);
    show_until(&s, span->count);
    return s.count;
}
