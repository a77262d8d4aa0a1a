#include "point_file.h"

#include <ctype.h>
#include <float.h>
#include <inttypes.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "byte_stream.h"
#include "point_file_internal.h"
#include "range_frames.h"
#include "report.h"

enum { HEAD_BYTES = 1 << 16, BATCH = 1024, SAMPLED_POINTS = 1 << 16 };

static const trip_point_reader *const readers[] = {
    &trip_read_point_ply,
    &trip_read_las,
    &trip_read_pcd,
    &trip_read_e57,
    &trip_read_vdb_points,
    &trip_read_range,
    /* without a magic number: */
    &trip_read_ptx,
    &trip_read_pts,
    &trip_read_xyz,
};

int trip_point_no_memory(const trip_point_file *f)
{
    return trip_fail(TRIP_ERROR, "read", f->path, "out of memory");
}

int trip_point_truncated(const trip_point_file *f)
{
    return trip_fail(TRIP_ERROR, "read", f->path, "ends early; is it truncated?");
}

void trip_point_drop(trip_point *p)
{
    p->position[0] = NAN;
}

void trip_point_note(trip_point_file *f, const char *text, ...)
{
    va_list args;
    if (f->info.note_count == TRIP_POINT_NOTES)
        return;
    va_start(args, text);
    vsnprintf(f->info.notes[f->info.note_count++], TRIP_POINT_NOTE_BYTES, text, args);
    va_end(args);
}

void trip_point_add_extra(trip_point_file *f, const char *name)
{
    const size_t used = strlen(f->info.extras);
    snprintf(f->info.extras + used, sizeof f->info.extras - used, "%s%s", used ? ", " : "", name);
}

trip_point_scan *trip_point_add_scan(trip_point_file *f)
{
    if (f->info.scan_count == TRIP_POINT_SCANS_MAX) {
        trip_fail(TRIP_ERROR, "read", f->path, "holds more than %d scans", TRIP_POINT_SCANS_MAX);
        return NULL;
    }
    if (f->info.scan_count == f->scan_room) {
        const uint32_t room = f->scan_room ? 2 * f->scan_room : 4;
        trip_point_scan *scans = realloc(f->scans, room * sizeof *scans);
        if (!scans) {
            trip_point_no_memory(f);
            return NULL;
        }
        f->info.scans = f->scans = scans;
        f->scan_room = room;
    }
    trip_point_scan *made = &f->scans[f->info.scan_count++];
    *made = (trip_point_scan){ 0 };
    return made;
}

/* Sets *out to the reader of a file, or to NULL. */
static int choose(const char *path, bool quiet, const trip_point_reader **out)
{
    *out = trip_range_is_folder(path) ? &trip_read_range : NULL;
    if (*out)
        return 0;
    unsigned char *bytes = malloc(HEAD_BYTES);
    if (!bytes)
        return quiet ? TRIP_ERROR : trip_fail(TRIP_ERROR, "read", path, "out of memory");
    size_t count = 0;
    trip_held_report held = { 0 };
    trip_report_hold(&held);
    int status = trip_byte_stream_head(path, bytes, HEAD_BYTES, true, &count);
    trip_report_release(&held);
    if (status < 0 && !quiet)
        trip_report_print(&held);
    const trip_point_head head = { .path = path, .bytes = bytes, .count = count };
    for (size_t i = 0; i < sizeof readers / sizeof *readers && status == 0 && !*out; i++)
        if (readers[i]->probe(&head))
            *out = readers[i];
    free(bytes);
    return status;
}

bool trip_point_file_is(const char *path)
{
    const trip_point_reader *reader;
    return choose(path, true, &reader) == 0 && reader;
}

int trip_point_file_list(const char *path, int (*add)(void *user, const char *file), void *user)
{
    const trip_point_reader *reader;
    const int status = choose(path, false, &reader);
    if (status < 0)
        return status;
    return reader == &trip_read_range ? trip_range_frames_list(path, add, user) : add(user, path);
}

/* Sets the factor from the colours of the reader to 0 to 1. */
static void scale_colours(trip_point_file *f, float largest)
{
    const bool sixteen = f->colour_form == TRIP_COLOUR_SIXTEEN;
    const bool eight = sixteen ? largest <= 255 : largest > 1 && largest <= 255;
    f->colour_factor = 1 / (eight ? 255.0f : sixteen || largest > 255 ? 65535.0f : 1.0f);
    if (f->colour_form == TRIP_COLOUR_UNIT)
        f->colour_factor = 1;
}

static float largest_of(const trip_point *p)
{
    const float *c = p->colour;
    const float two = c[0] > c[1] ? c[0] : c[1];
    return two > c[2] ? two : c[2];
}

/* Guesses the range of the colours from the first points. */
static int sample_colours(trip_point_file *f)
{
    scale_colours(f, 0);
    if (f->colour_form == TRIP_COLOUR_UNIT || !(f->info.attributes & TRIP_POINT_COLOUR))
        return 0;
    trip_point *batch = calloc(BATCH, sizeof *batch);
    float largest = 0;
    size_t got = 1;
    int status = batch ? 0 : trip_point_no_memory(f);
    for (size_t done = 0; done < SAMPLED_POINTS && got > 0 && status == 0; done += got) {
        memset(batch, 0, BATCH * sizeof *batch);
        status = f->reader->read(f, batch, BATCH, &got);
        for (size_t i = 0; i < got && status == 0; i++)
            if (largest_of(&batch[i]) > largest)
                largest = largest_of(&batch[i]);
    }
    free(batch);
    scale_colours(f, largest);
    return status < 0 ? status : trip_point_file_rewind(f);
}

int trip_point_file_open(const char *path, trip_point_file **out)
{
    const trip_point_reader *reader;
    *out = NULL;
    int status = choose(path, false, &reader);
    if (status < 0)
        return status;
    if (!reader)
        return trip_fail(TRIP_ERROR, "read", path,
                         "is no cloud of points; `triptych info FILE` tells the kind of a file");
    trip_point_file *f = calloc(1, sizeof *f);
    if (!f || !(f->path = strdup(path))) {
        free(f);
        return trip_fail(TRIP_ERROR, "read", path, "out of memory");
    }
    f->reader = reader;
    status = reader->open(f);
    if (status == 0)
        status = sample_colours(f);
    if (status < 0) {
        trip_point_file_close(f);
        return status;
    }
    *out = f;
    return 0;
}

void trip_point_file_close(trip_point_file *f)
{
    if (!f)
        return;
    f->reader->close(f);
    free(f->scans);
    free(f->path);
    free(f);
}

const trip_point_info *trip_point_file_info(const trip_point_file *f)
{
    return &f->info;
}

int trip_point_file_rewind(trip_point_file *f)
{
    f->left_out = f->empty = f->deleted = 0;
    return f->reader->rewind(f);
}

/* A normal that is too short or not finite counts as absent. */
static void normalise(float n[3])
{
    const double length = sqrt((double)n[0] * n[0] + (double)n[1] * n[1] + (double)n[2] * n[2]);
    const bool good = isfinite(length) && length > 1e-20;
    for (int a = 0; a < 3; a++)
        n[a] = good ? (float)(n[a] / length) : 0;
}

/* Returns false for a row that is left out. */
static bool check(trip_point_file *f, trip_point *p)
{
    for (int a = 0; a < 3; a++)
        if (!isfinite(p->position[a])) {
            *(f->gaps ? &f->empty : &f->left_out) += 1;
            return false;
        }
    if (f->info.attributes & TRIP_POINT_NORMAL)
        normalise(p->normal);
    for (int c = 0; c < 3; c++) {
        const float v = p->colour[c] * f->colour_factor;
        p->colour[c] = v > 1 ? 1 : v > 0 ? v : 0; /* 0 for NaN */
    }
    p->radius = isfinite(p->radius) && p->radius > 0 ? p->radius : 0;
    p->intensity = isfinite(p->intensity) ? p->intensity : 0;
    p->gps_time = isfinite(p->gps_time) ? p->gps_time : 0;
    p->uncertainty = isfinite(p->uncertainty) && p->uncertainty > 0 ? p->uncertainty : 0;
    p->footprint = isfinite(p->footprint) && p->footprint > 0 ? p->footprint : 0;
    return true;
}

int trip_point_file_read(trip_point_file *f, trip_point *out, size_t room, size_t *got_out)
{
    *got_out = 0;
    while (*got_out == 0 && room > 0) {
        size_t count = 0;
        if (trip_interrupted())
            return trip_fail(TRIP_INTERRUPTED, "read", f->path, "interrupted");
        memset(out, 0, room * sizeof *out);
        int status = f->reader->read(f, out, room, &count);
        if (status < 0)
            return status;
        if (count == 0)
            break;
        for (size_t i = 0; i < count; i++)
            if (check(f, &out[i]))
                out[(*got_out)++] = out[i];
    }
    return 0;
}

void trip_point_file_print_notes(const trip_point_file *f)
{
    for (unsigned i = 0; i < f->info.note_count; i++)
        trip_note(f->path, "%s", f->info.notes[i]);
}

/* ---- survey ---- */

typedef struct seen {
    trip_point_info info;
    float largest; /* of the colours, unscaled */
    uint64_t uncertain;
    double certainty; /* sum of 1 / uncertainty */
} seen;

/* Conditions are faster than fmin() and fmax() here. All values are finite. */
static void see(seen *s, const trip_point *p)
{
    trip_point_info *i = &s->info;
    const bool first = i->points++ == 0;
    for (int a = 0; a < 3; a++) {
        const double v = p->position[a];
        i->lo[a] = first || v < i->lo[a] ? v : i->lo[a];
        i->hi[a] = first || v > i->hi[a] ? v : i->hi[a];
    }
    const float v = p->intensity;
    const double t = p->gps_time;
    i->intensity_lo = first || v < i->intensity_lo ? v : i->intensity_lo;
    i->intensity_hi = first || v > i->intensity_hi ? v : i->intensity_hi;
    i->time_lo = first || t < i->time_lo ? t : i->time_lo;
    i->time_hi = first || t > i->time_hi ? t : i->time_hi;
    i->classes[p->classification]++;
    if (p->uncertainty > 0) {
        s->uncertain++;
        s->certainty += 1 / (double)p->uncertainty;
    }
    i->returns_max = p->returns > i->returns_max ? p->returns : i->returns_max;
}

/* Notes bounds of the header that differ from the points. A step of 1e-6 of the extent is allowed
 * for rounding. Bounds may contain deleted points. */
static void compare_bounds(trip_point_file *f, const seen *s)
{
    const trip_point_info *i = &f->info;
    for (int a = 0; a < 3 && i->bounded; a++) {
        const double extent = s->info.hi[a] - s->info.lo[a];
        const double step = fmax(1e-6 * extent, 1e-3 * (extent > 1 ? 1 : extent)) +
                            1e-9 * fmax(fabs(s->info.lo[a]), fabs(s->info.hi[a]));
        const double below = s->info.lo[a] - i->lo[a], above = i->hi[a] - s->info.hi[a];
        const double most = f->deleted > 0 ? INFINITY : step;
        if (below >= -step && below <= most && above >= -step && above <= most)
            continue;
        trip_point_note(f,
                        "the header states %c from %.10g to %.10g, but the points reach from "
                        "%.10g to %.10g; the bounds of the points are used",
                        'x' + a, i->lo[a], i->hi[a], s->info.lo[a], s->info.hi[a]);
        return;
    }
}

static void judge_colours(trip_point_file *f, const seen *s)
{
    if (!(f->info.attributes & TRIP_POINT_COLOUR))
        return;
    scale_colours(f, s->largest);
    if (s->largest <= 0) {
        f->info.attributes &= ~(unsigned)TRIP_POINT_COLOUR;
        trip_point_note(f, "the colours of all points are 0, so they count as absent");
    } else if (f->colour_form == TRIP_COLOUR_SIXTEEN && s->largest <= 255) {
        trip_point_note(f, "the colours use 8 of 16 bits (0 to %.0f), and are read as 8 bits",
                        (double)s->largest);
    } else if (f->colour_form == TRIP_COLOUR_FLOAT && s->largest > 1) {
        trip_point_note(f, "the colours reach %.7g, and are divided by %d", (double)s->largest,
                        s->largest > 255 ? 65535 : 255);
    }
}

static void settle(trip_point_file *f, const seen *s)
{
    trip_point_info *i = &f->info;
    const uint64_t rows = s->info.points + f->left_out + f->empty + f->deleted;
    compare_bounds(f, s);
    judge_colours(f, s);
    memcpy(i->lo, s->info.lo, sizeof i->lo);
    memcpy(i->hi, s->info.hi, sizeof i->hi);
    i->bounded = i->surveyed = true;
    i->count = rows;
    i->points = s->info.points;
    i->left_out = f->left_out + f->deleted;
    i->empty = f->empty;
    i->intensity_lo = s->info.intensity_lo;
    i->intensity_hi = s->info.intensity_hi;
    i->time_lo = s->info.time_lo;
    i->time_hi = s->info.time_hi;
    memcpy(i->classes, s->info.classes, sizeof i->classes);
    i->returns_max = s->info.returns_max;
    i->uncertainty = s->uncertain > 0 ? (double)s->uncertain / s->certainty : 0;
    if (i->intensity_lo == 0 && i->intensity_hi == 0)
        i->attributes &= ~(unsigned)TRIP_POINT_INTENSITY;
    if (f->left_out > 0)
        trip_point_note(f,
                        "%" PRIu64 " of %" PRIu64
                        " points have a position that is not finite; they are left out",
                        f->left_out, rows);
    if (f->deleted > 0)
        trip_point_note(
            f, "%" PRIu64 " of %" PRIu64 " points are marked as withheld; they are left out",
            f->deleted, rows);
}

/* Reads all points with the colours of the reader. */
static int look(trip_point_file *f, trip_point *batch, seen *s)
{
    size_t got = 1;
    int status = trip_point_file_rewind(f);
    while (status == 0 && got > 0) {
        status =
            trip_interrupted() ? trip_fail(TRIP_INTERRUPTED, "read", f->path, "interrupted") : 0;
        memset(batch, 0, BATCH * sizeof *batch);
        if (status == 0)
            status = f->reader->read(f, batch, BATCH, &got);
        for (size_t i = 0; i < got && status == 0; i++) {
            const float largest = largest_of(&batch[i]);
            if (!check(f, &batch[i]))
                continue;
            s->largest = isfinite(largest) && largest > s->largest ? largest : s->largest;
            see(s, &batch[i]);
        }
    }
    return status;
}

int trip_point_file_survey(trip_point_file *f)
{
    if (f->info.surveyed)
        return trip_point_file_rewind(f);
    trip_point *batch = malloc(BATCH * sizeof *batch);
    seen *s = calloc(1, sizeof *s);
    int status = batch && s ? look(f, batch, s) : trip_point_no_memory(f);
    if (status == 0 && s->info.points == 0)
        status = f->left_out > 0 ? trip_fail(TRIP_ERROR, "read", f->path,
                                             "holds no point with a finite position")
                                 : trip_fail(TRIP_ERROR, "read", f->path, "holds no points");
    if (status == 0)
        settle(f, s);
    free(batch);
    free(s);
    return status < 0 ? status : trip_point_file_rewind(f);
}

/* Scans of land and buildings have z up. So do E57, PTS and PTX by convention. */
static const char *usual_up(const trip_point_info *info)
{
    static const char *const z_up[] = { "LAS", "LAZ", "COPC", "E57", "PTS", "PTX", "XYZ" };
    if (*info->up)
        return info->up;
    for (size_t i = 0; i < sizeof z_up / sizeof *z_up; i++)
        if (!strncmp(info->format, z_up[i], strlen(z_up[i])))
            return "z";
    return "y";
}

void trip_point_up(const trip_point_info *info, char up[3])
{
    static const char name[] = "Vertical Axis:";
    const char *at = strcasestr(info->comments, name);
    snprintf(up, 3, "%s", usual_up(info));
    if (!at)
        return;
    at += strlen(name);
    while (*at == ' ')
        at++;
    const bool minus = *at == '-';
    const int axis = tolower((unsigned char)at[minus]);
    if (axis >= 'x' && axis <= 'z')
        snprintf(up, 3, "%s%c", minus ? "-" : "", axis);
}
