#include "scan_steps.h"

#include <math.h>
#include <string.h>

enum { OCTAVES = 48, PER_OCTAVE = 16, BINS = OCTAVES * PER_OCTAVE };

/* Counts tangents by their logarithms. Bin 0 begins at 2^-OCTAVES. */
typedef struct counts {
    uint32_t of[BINS];
    double median;
} counts;

struct trip_scan_steps {
    const trip_point_info *info;
    trip_budget *budget;
    counts *scans;
    size_t bytes;
    bool any;
    uint32_t last_scan;
    double last[3]; /* position */
};

trip_scan_steps *trip_scan_steps_begin(const trip_point_info *info, trip_budget *budget)
{
    trip_scan_steps *s = trip_budget_take(budget, sizeof *s);
    if (!s)
        return NULL;
    *s = (trip_scan_steps){ .info = info, .budget = budget };
    s->bytes = ((size_t)info->scan_count + 1) * sizeof *s->scans;
    s->scans = trip_budget_take(budget, s->bytes);
    if (s->scans)
        return s;
    trip_scan_steps_end(s);
    return NULL;
}

void trip_scan_steps_end(trip_scan_steps *s)
{
    if (!s)
        return;
    trip_budget *budget = s->budget;
    trip_budget_release(budget, s->scans, s->bytes);
    trip_budget_release(budget, s, sizeof *s);
}

static bool has_grid(const trip_scan_steps *s, uint32_t scan)
{
    return scan < s->info->scan_count && s->info->scans[scan].posed &&
           s->info->scans[scan].width > 1 && s->info->scans[scan].height > 1;
}

/* Returns the tangent of the angle between the rays of two points. */
static double tangent_of(const double scanner[3], const double p[3], const double q[3])
{
    double a[3], b[3], dot = 0, cross2 = 0;
    for (int i = 0; i < 3; i++) {
        a[i] = p[i] - scanner[i];
        b[i] = q[i] - p[i];
    }
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        const double part = a[j] * b[k] - a[k] * b[j]; /* of a x (a + b) */
        cross2 += part * part;
        dot += a[i] * (a[i] + b[i]);
    }
    return dot > 0 ? sqrt(cross2) / dot : INFINITY;
}

void trip_scan_steps_note(trip_scan_steps *s, const trip_point *p)
{
    if (s->any && s->last_scan == p->scan && has_grid(s, p->scan)) {
        const double tangent = tangent_of(s->info->scans[p->scan].scanner, s->last, p->position);
        const double bin = (log2(tangent) + OCTAVES) * PER_OCTAVE;
        if (bin >= 0 && bin < BINS)
            s->scans[p->scan].of[(int)bin]++;
    }
    memcpy(s->last, p->position, sizeof s->last);
    s->last_scan = p->scan;
    s->any = true;
}

static double median_of(const counts *c)
{
    uint64_t all = 0, below = 0;
    for (int i = 0; i < BINS; i++)
        all += c->of[i];
    for (int i = 0; i < BINS && all > 0; i++) {
        below += c->of[i];
        if (2 * below >= all)
            return exp2((i + 0.5) / PER_OCTAVE - OCTAVES);
    }
    return 0;
}

void trip_scan_steps_find(trip_scan_steps *s)
{
    for (uint32_t i = 0; i < s->info->scan_count; i++)
        s->scans[i].median = median_of(&s->scans[i]);
}

double trip_scan_steps_of(const trip_scan_steps *s, uint32_t scan)
{
    return s->scans[scan].median;
}
