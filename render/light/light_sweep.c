#include "light_sweep.h"

#include <math.h>

/* Smaller transmittances count as 0. */
#define DARK 1e-7

enum {
    BAND_ROWS = 4,  /* rows per task */
    PIECE = 1 << 14 /* columns or nodes per step */
};

static size_t column_bytes(const trip_light_sweep *s)
{
    return (size_t)s->columns[0] * (size_t)s->columns[1] * sizeof *s->through;
}

/* Columns of a point light spread most if its distance is half the lattice's width. */
size_t trip_light_sweep_max_bytes(const trip_light_grid *out)
{
    size_t max = 0;
    for (int axis = 0; axis < 3; axis++) {
        size_t columns = sizeof(double);
        for (int i = 1; i < 3; i++)
            columns *= (size_t)out->nodes[(axis + i) % 3] + 2 * (size_t)out->nodes[axis] + 4;
        max = columns > max ? columns : max;
    }
    return max;
}

static void set_axes(trip_light_sweep *s, int axis, bool descending)
{
    s->axis = axis;
    s->across = (axis + 1) % 3;
    s->down = (axis + 2) % 3;
    s->descending = descending;
}

static int last_layer(const trip_light_sweep *s)
{
    return s->out->nodes[s->axis] - 1;
}

/* Converts between layers and nodes along the sweep's axis. A layer may be fractional. */
static double node_of(const trip_light_sweep *s, double layer)
{
    return s->descending ? last_layer(s) - layer : layer;
}

/* Returns the position at the last layer of a ray through a node of a layer: across (0) or down
 * (1). */
static double column_of(const trip_light_sweep *s, int i, double node, int layer)
{
    const double back = layer - last_layer(s);
    return (node - back * s->slope[i]) / (1 + back * s->spread);
}

/* Returns a range of columns, plus one on each side. */
static void set_columns(trip_light_sweep *s, int i, double from, double to)
{
    s->first[i] = (int)floor(from) - 1;
    s->columns[i] = (int)ceil(to) + 1 - s->first[i] + 1;
}

static bool take_columns(trip_light_sweep *s, trip_budget *budget)
{
    s->budget = budget;
    s->layer = s->start;
    s->through = trip_budget_take(budget, column_bytes(s));
    return s->through != NULL;
}

/* Returns the world length of a difference of voxel indices. */
static double length_of(const trip_light_sweep *s, const double step[3])
{
    return trip_length(trip_affine_vector(s->index_to_world, trip_v3(step[0], step[1], step[2])));
}

bool trip_light_sweep_begin(trip_light_sweep *s, trip_vec3 to_light, trip_budget *budget)
{
    int axis = 0;
    for (int a = 1; a < 3; a++)
        if (fabs(trip_component(to_light, a)) > fabs(trip_component(to_light, axis)))
            axis = a;
    const double along = trip_component(to_light, axis);
    const double way[3] = { to_light.x, to_light.y, to_light.z };
    set_axes(s, axis, along > 0);
    s->length = length_of(s, way) / fabs(along) * s->out->spacing;
    s->per_voxel = 1 / s->out->spacing;
    s->kept = s->range > 0 ? exp(-s->length / s->range) : 1;
    for (int i = 0; i < 2; i++) {
        const double last = s->out->nodes[i ? s->down : s->across] - 1;
        s->slope[i] = -trip_component(to_light, i ? s->down : s->across) / fabs(along);
        set_columns(s, i, fmin(0, column_of(s, i, 0, 0)), fmax(last, column_of(s, i, last, 0)));
    }
    return take_columns(s, budget);
}

/* Finds the layers on the region's side of the light; layers at the light count as above it.
 * Returns false if there are none. */
static bool set_start(trip_light_sweep *s)
{
    const double above = ceil(s->light[s->axis]);
    const double start = s->descending ? last_layer(s) - (above - 1) : above;
    if (start > last_layer(s))
        return false;
    s->start = start > 0 ? (int)start : 0;
    s->before = start >= 0 ? fabs(node_of(s, s->start) - s->light[s->axis]) : 0;
    return true;
}

/* Finds the columns that pass nodes of the region. Returns false if there are none. */
static bool set_spread(trip_light_sweep *s)
{
    const double far = fabs(node_of(s, last_layer(s)) - s->light[s->axis]);
    bool some = true;
    s->spread = far > 0 ? 1 / far : 0;
    for (int i = 0; i < 2; i++) {
        const int axis = i ? s->down : s->across;
        const double last = s->out->nodes[axis] - 1, middle = s->light[axis];
        s->slope[i] = -middle * s->spread;
        double from = fmax(middle - far, fmin(0, column_of(s, i, 0, s->start)));
        double to = fmin(middle + far, fmax(last, column_of(s, i, last, s->start)));
        some &= from <= to;
        if (some)
            set_columns(s, i, from, to);
    }
    return some;
}

bool trip_light_sweep_begin_at(trip_light_sweep *s, trip_vec3 light, int region,
                               trip_budget *budget)
{
    s->point = true;
    s->per_voxel = 1 / s->out->spacing;
    s->kept = 1;
    set_axes(s, region / 2, region % 2);
    for (int a = 0; a < 3; a++)
        s->light[a] = trip_component(light, a) / s->out->spacing;
    return !set_start(s) || !set_spread(s) || take_columns(s, budget);
}

void trip_light_sweep_end(trip_light_sweep *s)
{
    if (s->through)
        trip_budget_release(s->budget, s->through, column_bytes(s));
    s->through = NULL;
}

/* Narrows [*t0, *t1] to the t with from + t step in [0, last]. */
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

/* Returns whether a step meets no extinction. It stays within the cells around its middle, since no
 * other axis moves by more than a layer. */
static bool is_clear(const trip_light_sweep *s, const double from[3], const double step[3])
{
    size_t cell = 0;
    for (int a = 2; a >= 0; a--) {
        const int cells = s->out->nodes[a] - 1;
        const double at = (from[a] + 0.5 * step[a]) * s->per_voxel;
        if (at < -0.5 || at > cells + 0.5)
            return true; /* all of it lies outside */
        if (!(at >= 0 && at < cells))
            return false;
        cell = cell * (size_t)cells + (size_t)at;
    }
    return s->clear[cell] != 0;
}

/* Returns the optical depth of a column's step, in voxel indices. Two-point Gauss quadrature is
 * exact for cubics, and extinction is cubic within a cell. */
static double depth_of(const trip_light_sweep *s, const double from[3], const double step[3])
{
    static const double points[2] = { 0.21132486540518712, 0.78867513459481288 };
    double t0 = 0, t1 = 1, sum = 0;
    const int parts = s->parts > 1 ? s->parts : 1;
    if (s->clear && is_clear(s, from, step))
        return 0;
    for (int a = 0; a < 3; a++)
        cut(from[a], step[a], s->last[a], &t0, &t1);
    if (!(t0 < t1))
        return 0;
    for (int n = 0; n < 2 * parts; n++) {
        double t = t0 + (t1 - t0) * (points[n % 2] + n / 2) / parts;
        sum +=
            trip_light_grid_at(s->extinction, trip_v3(from[0] + t * step[0], from[1] + t * step[1],
                                                      from[2] + t * step[2]));
    }
    return 0.5 / parts * sum * (t1 - t0) * (s->point ? length_of(s, step) : s->length);
}

/* Computes the rows of a task: `from` to below `to`. */
static void band_of(const trip_light_sweep *s, unsigned band, int rows[2])
{
    rows[0] = s->rows[0] + (int)band * BAND_ROWS;
    rows[1] = rows[0] + BAND_ROWS < s->rows[1] ? rows[0] + BAND_ROWS : s->rows[1];
}

/* Computes the position at the previous layer of a column at w on the last layer, and its step, in
 * voxels. */
static void place_column(const trip_light_sweep *s, int i, double w, double passed, double from[3],
                         double step[3])
{
    const int axis = i ? s->down : s->across;
    const double moved = s->slope[i] + s->spread * w;
    from[axis] = (w + (s->layer - passed - last_layer(s)) * moved) * s->out->spacing;
    step[axis] = passed * moved * s->out->spacing;
}

/* Returns the remaining light of a column after the light that returns over a step. */
static double returned(const trip_light_sweep *s, double through)
{
    return s->kept < 1 ? 1 - (1 - through) * s->kept : through;
}

/* Advances some rows of columns from the previous layer to this one. Before the first layer all
 * light is left. */
static void attenuate(void *sweep, unsigned band)
{
    const trip_light_sweep *s = sweep;
    const bool begins = s->layer == s->start;
    const double passed = begins ? s->before : 1;
    double from[3], step[3];
    int rows[2];
    band_of(s, band, rows);
    from[s->axis] = node_of(s, s->layer - passed) * s->out->spacing;
    step[s->axis] = node_of(s, s->layer) * s->out->spacing - from[s->axis];
    double *through = s->through + (ptrdiff_t)rows[0] * s->columns[0];
    for (int row = rows[0]; row < rows[1]; row++) {
        place_column(s, 1, s->first[1] + row, passed, from, step);
        for (int column = 0; column < s->columns[0]; column++, through++) {
            place_column(s, 0, s->first[0] + column, passed, from, step);
            const double before = begins ? 1 : returned(s, *through);
            const double depth = before > 0 && passed > 0 ? depth_of(s, from, step) : 0;
            const double left = depth > 0 ? before * exp(-depth) : before;
            *through = left > DARK ? left : 0;
        }
    }
}

/* Returns the column before a position, and the remaining fraction, 0 to 1. */
static int column_before(const trip_light_sweep *s, int i, double at, double *part)
{
    const double last = s->columns[i] - 2;
    double x = at - s->first[i];
    x = x > 0 ? x < last ? x : last : 0; /* NaN becomes 0 */
    const int before = (int)x;
    *part = x - before;
    return before;
}

/* Computes some rows of the layer's nodes from the columns around them. */
static void give(void *sweep, unsigned band)
{
    const trip_light_sweep *s = sweep;
    const size_t strides[3] = { 1, (size_t)s->out->nodes[0],
                                (size_t)s->out->nodes[0] * (size_t)s->out->nodes[1] };
    float *layer = s->out->at + (size_t)node_of(s, s->layer) * strides[s->axis];
    double part[2];
    int rows[2];
    band_of(s, band, rows);
    for (int v = rows[0]; v < rows[1]; v++) {
        const int row = column_before(s, 1, column_of(s, 1, v, s->layer), &part[1]);
        const double *upper = s->through + (ptrdiff_t)row * s->columns[0];
        const double *lower = upper + s->columns[0];
        for (int u = s->nodes[0][0]; u < s->nodes[0][1]; u++) {
            const int n = column_before(s, 0, column_of(s, 0, u, s->layer), &part[0]);
            double above = upper[n] + part[0] * (upper[n + 1] - upper[n]);
            double below = lower[n] + part[0] * (lower[n + 1] - lower[n]);
            layer[(size_t)v * strides[s->down] + (size_t)u * strides[s->across]] +=
                (float)(s->weight * (above + part[1] * (below - above)));
        }
    }
}

/* Returns whether an axis admits a node to the region. If two axes are equally long, the first one
 * wins. */
static bool is_in_region(const trip_light_sweep *s, int axis, int node)
{
    const double along = fabs(node_of(s, s->layer) - s->light[s->axis]);
    const double beside = fabs(node - s->light[axis]);
    return beside < along || (beside == along && s->axis < axis);
}

/* Finds the region's nodes in the layer. */
static void find_nodes(trip_light_sweep *s)
{
    for (int i = 0; i < 2; i++) {
        const int axis = i ? s->down : s->across;
        int from = 0, to = s->out->nodes[axis];
        while (s->point && from < to && !is_in_region(s, axis, from))
            from++;
        while (s->point && from < to && !is_in_region(s, axis, to - 1))
            to--;
        s->nodes[i][0] = from;
        s->nodes[i][1] = to;
    }
}

/* Does the next rows of a layer, as many as one thread does in a few milliseconds. Returns whether
 * none are left. */
static bool do_rows(trip_light_sweep *s, const trip_task_runner *runner,
                    void (*task)(void *sweep, unsigned band), int end, int length)
{
    const int bands = PIECE / (BAND_ROWS * length + 1);
    const int max = BAND_ROWS * (bands > 1 ? bands : 1);
    s->rows[0] = s->rows[1];
    s->rows[1] = end - s->rows[0] < max ? end : s->rows[0] + max;
    const int rows = s->rows[1] - s->rows[0];
    trip_run_tasks(runner, task, s, (unsigned)((rows + BAND_ROWS - 1) / BAND_ROWS));
    return s->rows[1] == end;
}

bool trip_light_sweep_step(trip_light_sweep *s, const trip_task_runner *runner)
{
    if (!s->through)
        return false;
    if (!s->attenuated) {
        s->attenuated = do_rows(s, runner, attenuate, s->columns[1], s->columns[0]);
        if (s->attenuated) {
            find_nodes(s);
            s->rows[1] = s->nodes[1][0];
        }
        return true;
    }
    if (!do_rows(s, runner, give, s->nodes[1][1], s->nodes[0][1] - s->nodes[0][0]))
        return true;
    s->attenuated = false;
    s->rows[1] = 0;
    return ++s->layer <= last_layer(s);
}
