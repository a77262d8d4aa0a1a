/* Describes and bricks clouds of points for triptych_brick.h. */
#include "triptych_brick.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "anatomy.h"
#include "brick_points.h"
#include "gaussian_format.h"
#include "hyperlines.h"
#include "library_context.h"
#include "library_points.h"
#include "neighbours.h"
#include "point_file.h"
#include "report.h"

_Static_assert((int)TRIPTYCH_POINT_NORMAL == (int)TRIP_POINT_NORMAL &&
                   (int)TRIPTYCH_POINT_RADIUS == (int)TRIP_POINT_RADIUS &&
                   (int)TRIPTYCH_POINT_COLOUR == (int)TRIP_POINT_COLOUR &&
                   (int)TRIPTYCH_POINT_INTENSITY == (int)TRIP_POINT_INTENSITY &&
                   (int)TRIPTYCH_POINT_CLASSIFICATION == (int)TRIP_POINT_CLASSIFICATION &&
                   (int)TRIPTYCH_POINT_RETURNS == (int)TRIP_POINT_RETURNS &&
                   (int)TRIPTYCH_POINT_TIME == (int)TRIP_POINT_TIME &&
                   (int)TRIPTYCH_POINT_SCAN == (int)TRIP_POINT_SCAN &&
                   (int)TRIPTYCH_POINT_UNCERTAINTY == (int)TRIP_POINT_UNCERTAINTY,
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

/* ---- bricking ---- */

_Static_assert((int)TRIPTYCH_POINT_COLOUR_AUTO == (int)TRIP_POINT_BY_AUTO &&
                   (int)TRIPTYCH_POINT_COLOUR_DENSITY == (int)TRIP_POINT_BY_DENSITY,
               "the library's colours are those of point_colour.h");

static bool has_options(const triptych_brick_options *o)
{
    return o->point_colour || o->point_neighbours || o->point_radius != 0 ||
           o->point_radius_factor != 0 || o->point_outliers != 0 || o->point_uncertainty ||
           o->point_hyperlines;
}

int trip_context_check_no_points(const char *path, const triptych_brick_options *o)
{
    return has_options(o)
               ? trip_fail(TRIP_USAGE, "brick", path,
                           "is no cloud of points; --color, --k, --radius, --outliers, "
                           "--uncertainty and --hyperlines apply to clouds of points only")
               : 0;
}

static const char *fault_of(const triptych_brick_options *o)
{
    if (o->point_colour < TRIPTYCH_POINT_COLOUR_AUTO ||
        o->point_colour > TRIPTYCH_POINT_COLOUR_DENSITY)
        return "unknown colour of points";
    if (o->point_neighbours &&
        (o->point_neighbours < TRIP_NEIGHBOURS_MIN || o->point_neighbours > TRIP_NEIGHBOURS_MAX))
        return "a point has 3 to 64 neighbours";
    if (!(o->point_radius >= 0 && o->point_radius <= 1e12 && o->point_radius_factor >= 0 &&
          o->point_radius_factor <= 1e6))
        return "the radius of points must be at least 0, up to 1e12, and its factor up to 1e6";
    if (!(o->point_outliers >= 0 && o->point_outliers <= 1000))
        return "outliers are points beyond 0 to 1000 deviations";
    if (o->point_uncertainty && (o->point_neighbours || o->point_radius > 0))
        return "the uncertainty of distances sets the shapes of points, so neighbours and a radius "
               "do not apply: leave out --k, and give --radius a factor";
    if (o->point_hyperlines && (o->point_neighbours || o->point_radius > 0))
        return "the pixels of range images set the radii of hyperlines, so neighbours and a radius "
               "do not apply: leave out --k, and give --radius a factor";
    if (o->point_hyperlines && o->point_uncertainty)
        return "the points of --hyperlines have no uncertainty: leave out one of the two options";
    if (o->point_hyperlines && o->point_outliers > 0)
        return "--outliers does not apply to --hyperlines: leave out one of the two options";
    if (o->point_hyperlines && o->point_colour > TRIPTYCH_POINT_COLOUR_RGB)
        return "hyperlines have the colours of their cameras: leave out --color";
    if (o->axes && !trip_anatomy_axes_valid(o->axes))
        return "the axes must be three letters: one of R and L, one of A and P, one of S and I";
    return NULL;
}

int trip_context_describe_points_form(const char *path, const triptych_brick_options *o,
                                      char text[256])
{
    const char *fault = fault_of(o);
    snprintf(text, 256, "points %d %u %a %a %a %d %d %s\n", (int)o->point_colour,
             o->point_neighbours, o->point_radius, o->point_radius_factor, o->point_outliers,
             o->point_uncertainty != 0, o->point_hyperlines != 0, o->axes ? o->axes : "");
    return fault ? trip_fail(TRIP_USAGE, "brick", path, "%s", fault) : 0;
}

/* Sets the axis that points up from --axes: the one with the letter S, or I with a minus. */
static int find_up(const trip_point_info *info, const char *path, const char *axes, char up[3])
{
    trip_point_up(info, up);
    for (int a = 0; axes && axes[a]; a++)
        if (axes[a] == 'S' || axes[a] == 'I')
            snprintf(up, 3, "%s%c", axes[a] == 'I' ? "-" : "", 'x' + a);
    return !strcmp(up, "y") || !strcmp(up, "-y") || !strcmp(up, "z")
               ? 0
               : trip_fail(TRIP_USAGE, "brick", path,
                           "is a cloud of points; y or z must point up, or y down: give --axes");
}

static void show_rows(void *user, uint64_t passed, uint64_t all)
{
    triptych *t = user;
    if (t->show)
        trip_context_show_stage(t, "brick", passed < all ? passed : all, all);
}

static void show_passed(void *user, uint64_t passed)
{
    show_rows(user, passed, 0);
}

static void describe_surfels(const trip_point_info *info, triptych_gaussians *out)
{
    snprintf(out->format, sizeof out->format, "%s", info->format);
    snprintf(out->trainer, sizeof out->trainer, "%.255s", info->comments);
    out->flat = 1;
    out->left_out = info->left_out;
    memcpy(out->lo, info->lo, sizeof out->lo);
    memcpy(out->hi, info->hi, sizeof out->hi);
}

/* Fails if a scan has no pose. */
static int check_poses(const trip_point_info *info, const char *path)
{
    uint32_t posed = 0;
    while (posed < info->scan_count && info->scans[posed].posed)
        posed++;
    if (posed < info->scan_count && info->scan_count > 1)
        return trip_fail(TRIP_USAGE, "brick", path,
                         "does not tell where the scanner of scan %u of %u stood, which "
                         "--uncertainty needs",
                         posed + 1, info->scan_count);
    return posed > 0 && posed == info->scan_count
               ? 0
               : trip_fail(TRIP_USAGE, "brick", path,
                           "does not tell where its scanner stood; --uncertainty applies to range "
                           "images, and to scans with poses in E57, PCD, PLY or PTX");
}

/* Bricks fused range images. */
static int brick_hyperlines(const trip_brick_points_params *p, trip_budget *budget,
                            trip_brick_gaussians_result *made)
{
    trip_hyperlines *h = NULL;
    int status = trip_hyperlines_open(&h, p->file_name, p->threads, budget);
    if (status == 0 && p->radius_factor > 0)
        trip_hyperlines_set_factor(h, p->radius_factor);
    if (status == 0)
        status = trip_brick_gaussians(
            &(trip_brick_gaussians_params){ .path = p->path,
                                            .replace = p->replace,
                                            .source = trip_hyperlines_read,
                                            .source_user = h,
                                            .source_name = p->file_name,
                                            .degree = TRIP_SH_DEGREE_MAX,
                                            .harmonics = TRIP_BRICK_HARMONICS_WHOLE,
                                            .flags = p->flags | TRIP_GAUSSIAN_FLAT |
                                                     TRIP_GAUSSIAN_CLOUD | TRIP_GAUSSIAN_HYPERLINES,
                                            .text = p->text,
                                            .threads = p->threads,
                                            .progress = show_passed,
                                            .progress_user = p->progress_user },
            budget, made);
    if (status == 0)
        trip_note(p->file_name, "%llu of %llu samples are in other frames too; they were fused",
                  (unsigned long long)trip_hyperlines_fused(h),
                  (unsigned long long)trip_hyperlines_samples(h));
    trip_hyperlines_close(h);
    return status;
}

static int brick_file(triptych *t, trip_point_file *f, const char *path, const char *data_set,
                      const triptych_brick_options *o, trip_budget *budget, triptych_gaussians *out)
{
    const trip_point_info *info = trip_point_file_info(f);
    trip_brick_points_params params = { .path = data_set,
                                        .replace = o->replace,
                                        .file = f,
                                        .file_name = path,
                                        .neighbours = o->point_neighbours,
                                        .radius = o->point_radius,
                                        .radius_factor = o->point_radius_factor,
                                        .outliers = o->point_outliers,
                                        .outliers_out = &out->outliers,
                                        .uncertain = o->point_uncertainty != 0,
                                        .threads = trip_context_threads(o->threads),
                                        .progress = show_rows,
                                        .progress_user = t };
    trip_brick_gaussians_result made = { 0 };
    int status = trip_point_choose_colouring(info, path, (trip_point_colouring)o->point_colour,
                                             &params.colouring);
    describe_surfels(info, out);
    out->flat = !o->point_uncertainty;
    const bool ranges = info->attributes & TRIP_POINT_UNCERTAINTY;
    if (status == 0 && o->point_hyperlines && !ranges)
        status = trip_fail(TRIP_USAGE, "brick", path,
                           "is no sequence of range images with poses; --hyperlines applies to "
                           "these alone");
    if (status == 0 && o->point_uncertainty && !ranges)
        status = check_poses(info, path);
    if (status == 0)
        status = find_up(info, path, o->axes, out->up);
    char *notes = status == 0 ? trip_context_scene_notes(path, out) : NULL;
    if (status == 0 && !notes)
        status = trip_fail(TRIP_ERROR, "brick", path, "out of memory");
    if (status < 0)
        return status;
    const bool down = *out->up == '-';
    params.up[out->up[down] - 'x'] = down ? -1 : 1;
    params.flags = out->up[0] == 'z' ? TRIP_GAUSSIAN_Z_UP : down ? TRIP_GAUSSIAN_Y_DOWN : 0;
    params.text = notes;
    status = o->point_hyperlines ? brick_hyperlines(&params, budget, &made)
                                 : trip_brick_points(&params, budget, &made);
    if (status == 0) {
        trip_point_file_print_notes(f);
        if (!o->point_colour && params.colouring != TRIP_POINT_BY_RGB)
            trip_point_note_colouring(path, params.colouring);
    }
    out->count = made.records;
    free(notes);
    return status;
}

int trip_context_brick_points(triptych *t, const char *path, const char *data_set,
                              const triptych_brick_options *options, triptych_gaussians *out)
{
    triptych_gaussians described = { 0 };
    trip_point_file *f = NULL;
    trip_budget *budget = NULL;
    char form[256];
    int status = trip_context_describe_points_form(path, options, form);
    if (status == 0)
        status = trip_point_file_open(path, &f);
    if (status == 0)
        status = trip_point_file_survey(f);
    if (status == 0)
        status = trip_budget_create(&budget, options->memory_bytes);
    if (status == 0)
        status = brick_file(t, f, path, data_set, options, budget, &described);
    if (out)
        *out = status ? (triptych_gaussians){ 0 } : described;
    trip_budget_destroy(budget);
    trip_point_file_close(f);
    return status;
}
