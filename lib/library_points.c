/* Describes clouds of points for triptych_brick.h. */
#include "triptych_brick.h"

#include <stdio.h>
#include <string.h>

#include "library_context.h"
#include "point_file.h"

_Static_assert((int)TRIPTYCH_POINT_NORMAL == (int)TRIP_POINT_NORMAL &&
                   (int)TRIPTYCH_POINT_RADIUS == (int)TRIP_POINT_RADIUS &&
                   (int)TRIPTYCH_POINT_COLOUR == (int)TRIP_POINT_COLOUR &&
                   (int)TRIPTYCH_POINT_INTENSITY == (int)TRIP_POINT_INTENSITY &&
                   (int)TRIPTYCH_POINT_CLASSIFICATION == (int)TRIP_POINT_CLASSIFICATION &&
                   (int)TRIPTYCH_POINT_RETURNS == (int)TRIP_POINT_RETURNS &&
                   (int)TRIPTYCH_POINT_TIME == (int)TRIP_POINT_TIME &&
                   (int)TRIPTYCH_POINT_SCAN == (int)TRIP_POINT_SCAN,
               "the library's attributes are those of point.h");

static void copy_scans(const trip_point_info *info, triptych_points *out)
{
    out->scans = info->scan_count;
    for (uint32_t i = 0; i < info->scan_count; i++)
        out->posed_scans += info->scans[i].posed;
    if (info->scan_count == 1) {
        out->width = info->scans[0].width;
        out->height = info->scans[0].height;
    }
}

static void copy_info(const trip_point_info *info, triptych_points *out)
{
    *out = (triptych_points){
        .points = info->points,
        .left_out = info->left_out,
        .empty = info->empty,
        .attributes = info->attributes,
        .intensity_min = (double)info->intensity_lo,
        .intensity_max = (double)info->intensity_hi,
        .time_min = info->time_lo,
        .time_max = info->time_hi,
        .returns_max = info->returns_max,
        .notes = info->note_count,
    };
    memcpy(out->format, info->format, sizeof out->format);
    memcpy(out->extras, info->extras, sizeof out->extras);
    memcpy(out->comments, info->comments, sizeof out->comments);
    memcpy(out->lo, info->lo, sizeof out->lo);
    memcpy(out->hi, info->hi, sizeof out->hi);
    memcpy(out->classes, info->classes, sizeof out->classes);
    memcpy(out->note, info->notes, sizeof out->note);
    copy_scans(info, out);
}

static int describe(const char *path, triptych_points *out)
{
    trip_point_file *f;
    int status = trip_point_file_open(path, &f);
    if (status < 0)
        return status;
    status = trip_point_file_survey(f);
    if (status == 0)
        copy_info(trip_point_file_info(f), out);
    trip_point_file_close(f);
    return status;
}

int triptych_is_points(triptych *t, const char *path)
{
    trip_scope *before = trip_context_enter_anew(t);
    return trip_context_leave(before, trip_point_file_is(path));
}

int triptych_describe_points(triptych *t, const char *path, triptych_points *out)
{
    trip_scope *before = trip_context_enter_anew(t);
    *out = (triptych_points){ 0 };
    return trip_context_leave(before, describe(path, out));
}
