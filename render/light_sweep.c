#include "light_sweep.h"

#include <math.h>

/* Less is taken for nothing. */
#define DARK 1e-7

enum { BAND_ROWS = 4 }; /* of a task */

static size_t column_bytes(const trip_light_sweep *s)
{
    return (size_t)s->columns[0] * (size_t)s->columns[1] * sizeof *s->through;
}

size_t trip_light_sweep_most_bytes(const trip_light_grid *out)
{
    size_t most = 0;
    for (int axis = 0; axis < 3; axis++) {
        size_t columns = sizeof(double);
        for (int i = 1; i < 3; i++)
            columns *= (size_t)out->nodes[(axis + i) % 3] + (size_t)out->nodes[axis] + 2;
        most = columns > most ? columns : most;
    }
    return most;
}

bool trip_light_sweep_begin(trip_light_sweep *s, trip_vec3 to_light, double world_length,
                            trip_budget *budget)
{
    s->axis = 0;
    for (int a = 1; a < 3; a++)
        if (fabs(trip_component(to_light, a)) > fabs(trip_component(to_light, s->axis)))
            s->axis = a;
    s->across = (s->axis + 1) % 3;
    s->down = (s->axis + 2) % 3;
    s->budget = budget;
    s->layer = 0;
    const double along = trip_component(to_light, s->axis), layers = s->out->nodes[s->axis] - 1;
    s->descending = along > 0;
    s->length = s->out->spacing * world_length / fabs(along);
    for (int i = 0; i < 2; i++) {
        int nodes = s->out->nodes[i ? s->down : s->across];
        s->slope[i] = -trip_component(to_light, i ? s->down : s->across) / fabs(along);
        double moved = s->slope[i] * layers; /* columns begin so much before where they end */
        s->first[i] = (int)floor(fmin(0, -moved));
        s->columns[i] = (int)ceil(nodes - 1 + fmax(0, -moved)) - s->first[i] + 1;
    }
    s->through = trip_budget_take(budget, column_bytes(s));
    for (size_t i = 0; s->through && i < column_bytes(s) / sizeof *s->through; i++)
        s->through[i] = 1;
    return s->through != NULL;
}

void trip_light_sweep_end(trip_light_sweep *s)
{
    if (s->through)
        trip_budget_release(s->budget, s->through, column_bytes(s));
    s->through = NULL;
}

/* Cuts [*t0, *t1] to where from + t step is in [0, last]. */
static void cut(double from, double step, double last, double *t0, double *t1)
{
    if (step == 0) {
        *t1 = from >= 0 && from <= last ? *t1 : -1;
        return;
    }
    double a = -from / step, b = (last - from) / step;
    *t0 = fmax(*t0, fmin(a, b));
    *t1 = fmin(*t1, fmax(a, b));
}

/* The optical depth of a column from the layer before to this one: voxel indices. Two points of
 * Gauss: exact for cubics, as extinction is where the column stays in one cell. */
static double depth_of(const trip_light_sweep *s, const double from[3], const double step[3])
{
    static const double points[2] = { 0.21132486540518712, 0.78867513459481288 };
    double t0 = 0, t1 = 1, sum = 0;
    for (int a = 0; a < 3; a++)
        cut(from[a], step[a], s->last[a], &t0, &t1);
    if (!(t0 < t1))
        return 0;
    for (int n = 0; n < 2; n++) {
        double t = t0 + (t1 - t0) * points[n];
        sum +=
            trip_light_grid_at(s->extinction, trip_v3(from[0] + t * step[0], from[1] + t * step[1],
                                                      from[2] + t * step[2]));
    }
    return 0.5 * sum * (t1 - t0) * s->length;
}

static double layer_coordinate(const trip_light_sweep *s, int layer)
{
    return s->out->spacing * (s->descending ? s->out->nodes[s->axis] - 1 - layer : layer);
}

/* Of rows before `end`. */
static int end_of_band(unsigned band, int end)
{
    const int last = (int)(band + 1) * BAND_ROWS;
    return last < end ? last : end;
}

/* Some rows of columns from the layer before to this one. */
static void attenuate(void *sweep, unsigned band)
{
    const trip_light_sweep *s = sweep;
    const int first = (int)band * BAND_ROWS, end = end_of_band(band, s->columns[1]);
    const double spacing = s->out->spacing;
    double from[3], step[3];
    from[s->axis] = layer_coordinate(s, s->layer - 1);
    step[s->axis] = layer_coordinate(s, s->layer) - from[s->axis];
    step[s->across] = s->slope[0] * spacing;
    step[s->down] = s->slope[1] * spacing;
    double *through = s->through + (ptrdiff_t)first * s->columns[0];
    for (int row = first; row < end; row++) {
        from[s->down] = (s->first[1] + row + (s->layer - 1) * s->slope[1]) * spacing;
        for (int column = 0; column < s->columns[0]; column++, through++) {
            from[s->across] = (s->first[0] + column + (s->layer - 1) * s->slope[0]) * spacing;
            double depth = *through > 0 ? depth_of(s, from, step) : 0;
            if (depth > 0)
                *through *= exp(-depth);
            *through = *through > DARK ? *through : 0;
        }
    }
}

/* Some rows of the layer's nodes from the columns around them: all nodes lie alike between columns.
 */
static void give(void *sweep, unsigned band)
{
    const trip_light_sweep *s = sweep;
    const size_t strides[3] = { 1, (size_t)s->out->nodes[0],
                                (size_t)s->out->nodes[0] * (size_t)s->out->nodes[1] };
    const int layer = s->descending ? s->out->nodes[s->axis] - 1 - s->layer : s->layer;
    double part[2];
    int begin[2];
    for (int i = 0; i < 2; i++) {
        double at = -s->layer * s->slope[i] - s->first[i];
        begin[i] = (int)floor(at);
        part[i] = at - begin[i];
    }
    const int end = end_of_band(band, s->out->nodes[s->down]);
    for (int v = (int)band * BAND_ROWS; v < end; v++) {
        const int row = begin[1] + v, below = row + (part[1] > 0);
        const double *upper = s->through + (ptrdiff_t)row * s->columns[0] + begin[0];
        const double *lower = s->through + (ptrdiff_t)below * s->columns[0] + begin[0];
        float *to = s->out->at + (size_t)layer * strides[s->axis] + (size_t)v * strides[s->down];
        for (int u = 0; u < s->out->nodes[s->across]; u++, to += strides[s->across]) {
            const int next = u + (part[0] > 0);
            double first = upper[u] + part[0] * (upper[next] - upper[u]);
            double second = lower[u] + part[0] * (lower[next] - lower[u]);
            *to += (float)(s->weight * (first + part[1] * (second - first)));
        }
    }
}

static void run(const trip_task_runner *runner, void (*task)(void *context, unsigned number),
                trip_light_sweep *s, int rows)
{
    const unsigned bands = (unsigned)((rows + BAND_ROWS - 1) / BAND_ROWS);
    if (runner)
        runner->run(runner->user, task, s, bands);
    for (unsigned band = 0; band < bands && !runner; band++)
        task(s, band);
}

bool trip_light_sweep_step(trip_light_sweep *s, const trip_task_runner *runner)
{
    if (s->layer > 0)
        run(runner, attenuate, s, s->columns[1]);
    run(runner, give, s, s->out->nodes[s->down]);
    return ++s->layer < s->out->nodes[s->axis];
}
