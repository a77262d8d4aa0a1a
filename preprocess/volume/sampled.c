#include "sampled.h"

#include <string.h>

#include "report.h"
#include "volume_coordinates.h"

typedef struct sampled {
    const trip_volume_reader *of;
    void *state; /* of the wrapped reader */
    trip_budget *budget;
    int64_t step;
    /* Only for slice readers: */
    int64_t dims[2]; /* of the slices of the wrapped reader */
    size_t value_bytes;
    unsigned char *slice; /* buffer for one slice of the wrapped reader */
    int64_t skip;         /* slices to skip before the next read */
} sampled;

static size_t slice_bytes(const sampled *s)
{
    return (size_t)s->dims[0] * (size_t)s->dims[1] * s->value_bytes;
}

static void close_sampled(void *opaque)
{
    sampled *s = opaque;
    s->of->close(s->state);
    if (s->slice)
        trip_budget_release(s->budget, s->slice, slice_bytes(s));
    trip_budget_release(s->budget, s, sizeof *s);
}

static int rewind_sampled(void *opaque)
{
    sampled *s = opaque;
    s->skip = 0;
    return s->of->rewind(s->state);
}

static int get_past(sampled *s)
{
    int status = 0;
    if (s->skip > 0 && s->of->skip_slices)
        status = s->of->skip_slices(s->state, s->skip);
    else
        for (int64_t i = 0; i < s->skip && !status; i++)
            status = s->of->read_slices(s->state, 1, s->slice);
    s->skip = 0;
    return status;
}

/* Copies every step-th value of every step-th row. Returns the end of the copied values. */
static unsigned char *pick(const sampled *s, unsigned char *to)
{
    const size_t row = (size_t)s->dims[0] * s->value_bytes;
    for (int64_t j = 0; j < s->dims[1]; j += s->step)
        for (int64_t i = 0; i < s->dims[0]; i += s->step, to += s->value_bytes)
            memcpy(to, s->slice + (size_t)j * row + (size_t)i * s->value_bytes, s->value_bytes);
    return to;
}

static int read_sampled(void *opaque, int64_t count, void *values)
{
    sampled *s = opaque;
    unsigned char *to = values;
    int status = 0;
    for (int64_t i = 0; i < count && !status; i++) {
        status = get_past(s);
        if (!status)
            status = s->of->read_slices(s->state, 1, s->slice);
        to = pick(s, to);
        s->skip = s->step - 1;
    }
    return status;
}

static int skip_sampled(void *opaque, int64_t count)
{
    sampled *s = opaque;
    s->skip += count * s->step;
    return 0;
}

static bool swap_sampled(const void *opaque)
{
    const sampled *s = opaque;
    return s->of->swap(s->state);
}

/* Takes the next portion of the wrapped reader that contains samples, with its bounds in samples.
 */
static int next_sampled(void *opaque, trip_volume_portion *portion)
{
    sampled *s = opaque;
    trip_volume_portion *of = trip_budget_take(s->budget, sizeof *of);
    if (!of)
        return trip_fail(TRIP_ERROR, "read", "portion", "does not fit in memory: raise --memory");
    for (;;) {
        bool some = true;
        int status = s->of->next(s->state, of);
        if (status <= 0) {
            trip_budget_release(s->budget, of, sizeof *of);
            return status;
        }
        for (int a = 0; a < 3; a++) {
            int64_t end = of->origin[a] + of->size[a];
            portion->origin[a] = (of->origin[a] + s->step - 1) / s->step;
            portion->size[a] = (end + s->step - 1) / s->step - portion->origin[a];
            some &= portion->size[a] > 0;
        }
        portion->data = of;
        if (some)
            return 1;
        s->of->release(s->state, of);
    }
}

static void release_sampled(void *opaque, trip_volume_portion *portion)
{
    sampled *s = opaque;
    trip_volume_portion *of = portion->data;
    s->of->release(s->state, of);
    trip_budget_release(s->budget, of, sizeof *of);
    portion->data = NULL;
}

/* The destination of decoded samples: arrays of the box [lo, lo + size). */
typedef struct sample_box {
    const int64_t *lo, *size;
    float *values;
    uint8_t *active;
} sample_box;

/* Copies the samples [lo, lo + size) out of an array of all voxels from the first sample to the
 * last. */
static void pick_box(const sampled *s, const int64_t lo[3], const int64_t size[3],
                     const int64_t voxels[3], const float *values, const uint8_t *active,
                     const sample_box *to)
{
    for (int64_t k = 0; k < size[2]; k++)
        for (int64_t j = 0; j < size[1]; j++)
            for (int64_t i = 0; i < size[0]; i++) {
                const int64_t from = ((k * voxels[1] + j) * voxels[0] + i) * s->step;
                const int64_t at =
                    ((lo[2] - to->lo[2] + k) * to->size[1] + lo[1] - to->lo[1] + j) * to->size[0] +
                    lo[0] - to->lo[0] + i;
                to->values[at] = values[from];
                if (to->active)
                    to->active[at] = active[from];
            }
}

static int decode_part(const sampled *s, const trip_volume_portion *of, const int64_t lo[3],
                       const int64_t size[3], const sample_box *to)
{
    int64_t first[3], voxels[3];
    size_t count = 1;
    for (int a = 0; a < 3; a++) {
        first[a] = lo[a] * s->step;
        voxels[a] = (size[a] - 1) * s->step + 1;
        count *= (size_t)voxels[a];
    }
    float *values = trip_budget_take(s->budget, count * sizeof *values);
    uint8_t *active = trip_budget_take(s->budget, count);
    int status = values && active ? s->of->decode(s->state, of, first, voxels, values, active)
                                  : trip_fail(TRIP_ERROR, "read", "portion",
                                              "does not fit in memory: raise --memory");
    if (!status)
        pick_box(s, lo, size, voxels, values, active, to);
    if (values)
        trip_budget_release(s->budget, values, count * sizeof *values);
    if (active)
        trip_budget_release(s->budget, active, count);
    return status;
}

/* Decodes samples beside the portion first, side by side. They may lie far from the portion, and
 * this way the voxels in between are not decoded. */
static int decode_sampled(const void *opaque, const trip_volume_portion *portion,
                          const int64_t lo[3], const int64_t size[3], float *values,
                          uint8_t *active)
{
    const sampled *s = opaque;
    const sample_box to = { lo, size, values, active };
    int64_t from[3] = { lo[0], lo[1], lo[2] }, left[3] = { size[0], size[1], size[2] };
    int status = 0;
    for (int n = 0; n < 6 && !status && left[n / 2] > 0; n++) {
        const int a = n / 2;
        const bool before = n % 2 == 0 && from[a] < portion->origin[a];
        const bool behind = n % 2 && from[a] + left[a] > portion->origin[a] + portion->size[a];
        if (!before && !behind)
            continue;
        int64_t side[3] = { from[0], from[1], from[2] }, part[3] = { left[0], left[1], left[2] };
        side[a] = before ? from[a] : from[a] + left[a] - 1;
        part[a] = 1;
        status = decode_part(s, portion->data, side, part, &to);
        from[a] += before;
        left[a]--;
    }
    const bool some = left[0] > 0 && left[1] > 0 && left[2] > 0;
    return !status && some ? decode_part(s, portion->data, from, left, &to) : status;
}

static const trip_volume_reader sampled_slices = {
    .close = close_sampled,
    .rewind = rewind_sampled,
    .read_slices = read_sampled,
    .skip_slices = skip_sampled,
    .swap = swap_sampled,
};

static const trip_volume_reader sampled_portions = {
    .close = close_sampled,
    .rewind = rewind_sampled,
    .next = next_sampled,
    .decode = decode_sampled,
    .release = release_sampled,
};

static int64_t samples_along(int64_t voxels, int64_t step)
{
    return (voxels - 1) / step + 1;
}

static int64_t step_for(const int64_t dims[3], uint64_t max_voxels)
{
    int64_t step = 1;
    while ((double)samples_along(dims[0], step) * (double)samples_along(dims[1], step) *
               (double)samples_along(dims[2], step) >
           (double)max_voxels)
        step++;
    return step;
}

int trip_sampled_wrap(const trip_volume_reader **reader, void **state, trip_volume_info *info,
                      uint64_t max_voxels, trip_budget *budget)
{
    const int64_t step = step_for(info->dims, max_voxels);
    if (step == 1)
        return 0;
    sampled *s = trip_budget_take(budget, sizeof *s);
    if (!s)
        return trip_fail(TRIP_ERROR, "read", "samples", "do not fit in memory: raise --memory");
    *s = (sampled){ .of = *reader,
                    .state = *state,
                    .budget = budget,
                    .step = step,
                    .dims = { info->dims[0], info->dims[1] },
                    .value_bytes = trip_scalar_bytes(info->type) };
    if ((*reader)->read_slices && !(s->slice = trip_budget_take(budget, slice_bytes(s)))) {
        trip_budget_release(budget, s, sizeof *s);
        return trip_fail(TRIP_ERROR, "read", "samples", "do not fit in memory: raise --memory");
    }
    *reader = (*reader)->read_slices ? &sampled_slices : &sampled_portions;
    *state = s;
    for (int a = 0; a < 3; a++) {
        info->dims[a] = samples_along(info->dims[a], step);
        trip_volume_sample_coordinates(info, a, step, info->dims[a]);
    }
    return 0;
}
