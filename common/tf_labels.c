/* Makes the automatic function for labels, integers that name objects. Each integer has its own
 * colour. Values between two integers show neither colour. */
#include "tf_internal.h"

#include "report.h"

#include <math.h>
#include <stdlib.h>

enum { BINS = 1024 };

static const double label_opacity = 0.5;

/* Returns a hue a golden section away from the previous label's hue, so that neighbours differ.
 * Lightness alternates. */
static trip_rgba colour_of(double label)
{
    double hue = fmod(label * 0.61803398875, 1), x = 6 * hue, rgb[3];
    double chroma = fmod(label, 3) < 1 ? 0.55 : fmod(label, 3) < 2 ? 0.7 : 0.45;
    const double distance[3] = { fabs(x - 3) - 1, 2 - fabs(x - 2), 2 - fabs(x - 4) };
    for (int k = 0; k < 3; k++)
        rgb[k] = 0.95 - chroma * (1 - fmin(1, fmax(0, distance[k])));
    return (trip_rgba){ rgb[0], rgb[1], rgb[2], label_opacity };
}

/* Returns 0, or the most frequent value if the range does not include 0. */
static double background_of(const trip_histogram *h)
{
    int max = 0;
    for (int i = 1; i < BINS; i++)
        if (h->counts[i] > h->counts[max])
            max = i;
    if (h->value_min <= 0)
        return 0;
    return ceil(h->value_min + (h->value_max - h->value_min) * max / BINS);
}

/* Adds a label. Its colour holds half way to the neighbouring integers. */
static size_t add_label(trip_tf_point *points, size_t count, double label, double background)
{
    trip_rgba colour = colour_of(label);
    colour.opacity = label == background ? 0 : label_opacity;
    points[count++] = (trip_tf_point){ label - 0.5, colour };
    points[count++] = (trip_tf_point){ label + 0.5, colour };
    return count;
}

/* Adds the integers of a bin. An integer on the lower edge may already belong to the bin before. */
static size_t add_bin(trip_tf_point *points, size_t count, const trip_histogram *h, int bin,
                      double background)
{
    double width = (h->value_max - h->value_min) / BINS;
    double from = ceil(h->value_min + width * bin - 1e-6), to = h->value_min + width * (bin + 1);
    for (double label = from; label < to || (bin == BINS - 1 && label <= h->value_max); label++)
        if (count == 0 || label > points[count - 1].value)
            count = add_label(points, count, label, background);
    return count;
}

/* Returns 0 or, if all ids are above 0, the first one of the most frequent bin. */
static double background_id(const trip_histogram *h)
{
    const double range = h->value_max - h->value_min;
    int max = 0;
    uint32_t i = 0;
    for (int b = 1; b < BINS; b++)
        if (h->counts[b] > h->counts[max])
            max = b;
    while (h->ids[0] > 0 && i + 1 < h->id_count && h->ids[i] < h->value_min + range * max / BINS)
        i++;
    return h->ids[0] > 0 ? h->ids[i] : 0;
}

/* Returns the end of an id's colour: half a unit away, or half way to the next id if that is
 * nearer. */
static double end_of(const trip_histogram *h, uint32_t i, int step)
{
    const bool alone = step < 0 ? i == 0 : i + 1 == h->id_count;
    const double gap = alone ? 1 : fabs(h->ids[step < 0 ? i - 1 : i + 1] - h->ids[i]);
    return h->ids[i] + step * fmin(0.5, gap / 2);
}

/* Makes the function from the ids themselves. Each has its colour over one unit or, if there are
 * too many for two points each, at the id. */
static int make_from_ids(trip_tf **out, const trip_histogram *h)
{
    const bool wide = h->id_count <= TRIP_TF_MAX_POINTS / 2;
    const double background = background_id(h);
    trip_tf_point *points = calloc(2 * (size_t)h->id_count, sizeof *points);
    if (!points)
        return trip_fail(TRIP_ERROR, TRIP_TF_STAGE, "", "out of memory");
    size_t count = 0;
    for (uint32_t i = 0; i < h->id_count; i++) {
        trip_rgba colour = colour_of(h->ids[i]);
        colour.opacity = h->ids[i] == background ? 0 : label_opacity;
        points[count++] = (trip_tf_point){ wide ? end_of(h, i, -1) : h->ids[i], colour };
        if (wide)
            points[count++] = (trip_tf_point){ end_of(h, i, 1), colour };
    }
    int status = trip_tf_from_points(out, points, count, false, 0);
    free(points);
    return status;
}

int trip_tf_labels_from_histogram(trip_tf **out, const trip_histogram *h)
{
    double range = h->value_max - h->value_min, background = background_of(h);
    int occurring = 0;
    if (h->ids && h->id_count > 2)
        return make_from_ids(out, h);
    for (int i = 0; i < BINS; i++)
        occurring += h->counts[i] > 0;
    const bool counts =
        fmax(fabs(h->value_min), fabs(h->value_max)) < 0x1p52;       /* integers are exact */
    if (occurring <= 2 || !(range >= 1 && range < 16384) || !counts) /* solid, or not labels */
        return trip_tf_from_histogram(out, h);
    trip_tf_point *points = calloc(2 * (size_t)range + 4, sizeof *points);
    if (!points)
        return trip_fail(TRIP_ERROR, TRIP_TF_STAGE, "", "out of memory");
    size_t count = 0;
    for (int i = 0; i < BINS; i++)
        if (h->counts[i] > 0)
            count = add_bin(points, count, h, i, background);
    int status = trip_tf_from_points(out, points, count, false, 0);
    free(points);
    return status;
}
