#include "draw_options.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "anatomy.h"
#include "geometry.h"
#include "report.h"
#include "text.h"

#define COUNT(rows) (sizeof(rows) / sizeof *(rows))

/* ---- view ---- */

static int read_size(const trip_option *row, const char *text, void *base)
{
    triptych_view *v = &((view_options *)base)->view;
    (void)row;
    return trip_option_size("--size", text, &v->width, &v->height);
}

static int read_point(const char *option, const char *text, double point[3], int *given)
{
    int count;
    *given = 1;
    return trip_option_numbers(option, text, 3, 3, point, &count);
}

static int read_eye(const trip_option *row, const char *text, void *base)
{
    view_options *o = base;
    (void)row;
    return read_point("--eye", text, o->eye, &o->has_eye);
}

static int read_look(const trip_option *row, const char *text, void *base)
{
    view_options *o = base;
    (void)row;
    return read_point("--look", text, o->look, &o->has_look);
}

static int read_up(const trip_option *row, const char *text, void *base)
{
    view_options *o = base;
    int status = read_point("--up", text, o->up, &o->has_up);
    (void)row;
    if (!status && !(trip_length(trip_v3(o->up[0], o->up[1], o->up[2])) > 0))
        return trip_option_fail("--up", "the direction is zero");
    return status;
}

static int read_ortho(const trip_option *row, const char *text, void *base)
{
    triptych_view *v = &((view_options *)base)->view;
    double height;
    (void)row;
    v->ortho_height = 0;
    v->ortho_fit = !strcmp(text, "fit");
    if (v->ortho_fit)
        return 0;
    if (!trip_text_to_double(text, &height))
        return trip_fail(TRIP_USAGE, "usage", "--ortho", "\"%s\" is neither a height nor fit",
                         text);
    return trip_option_number("--ortho", text, 1e-100, 1e100, &v->ortho_height);
}

static const char *const sides[] = {
    "front", "back", "left", "right", "top", "bottom", "iso", NULL
};

#define AT(member) .at = offsetof(view_options, member)
#define CUSTOM(function) .type = TRIP_OPTION_CUSTOM, .read = (function)

static const trip_option view_rows[VIEW_OPTIONS] = {
    [VIEW_SIZE] = { "size", "WxH|N",
                    "Sets the picture size in pixels, 1 to 65536 a side; N is a square",
                    "1024x1024", .brief = "Sets the picture size in pixels (default: 1024x1024)",
                    .group = DRAW_GROUP_PICTURE, AT(view.width), CUSTOM(read_size) },
    [VIEW_AZIMUTH] = { "azimuth", "DEGREES", "Turns the eye around the object, to your right", "0",
                       .brief = "Turns the eye around the object, to your right",
                       .group = DRAW_GROUP_VIEW, .type = TRIP_OPTION_NUMBER,
                       AT(view.azimuth_degrees), .lo = -3600, .hi = 3600 },
    [VIEW_ELEVATION] = { "elevation", "DEGREES", "Raises the eye around the object", "0",
                         .brief = "Raises the eye around the object", .group = DRAW_GROUP_VIEW,
                         .type = TRIP_OPTION_NUMBER, AT(view.elevation_degrees), .lo = -3600,
                         .hi = 3600 },
    [VIEW_EYE] = { "eye", "X,Y,Z", "Sets the position of the eye",
                   "so that the whole object is in view",
                   "excludes --view, --azimuth and --elevation", .group = DRAW_GROUP_VIEW,
                   AT(has_eye), CUSTOM(read_eye) },
    [VIEW_FOV] = { "fov", "DEGREES", "Sets the vertical angle of view", "30", "excludes --ortho",
                   .group = DRAW_GROUP_VIEW, .type = TRIP_OPTION_NUMBER, AT(view.fov_degrees),
                   .lo = TRIPTYCH_FOV_MIN_DEGREES, .hi = TRIPTYCH_FOV_MAX_DEGREES },
    [VIEW_LOOK] = { "look", "X,Y,Z", "Sets the point that the eye looks at",
                    "the middle of the visible object", .group = DRAW_GROUP_VIEW, AT(has_look),
                    CUSTOM(read_look) },
    [VIEW_ORTHO] = { "ortho", "HEIGHT|fit",
                     "Draws a parallel view, HEIGHT world units high; fit shows the whole object "
                     "and excludes --eye",
                     .brief = "Draws a parallel view", .group = DRAW_GROUP_VIEW,
                     .type = TRIP_OPTION_CUSTOM, AT(view.ortho_fit), .read = read_ortho },
    [VIEW_ROLL] = { "roll", "DEGREES", "Turns the picture clockwise", "0", .group = DRAW_GROUP_VIEW,
                    .type = TRIP_OPTION_NUMBER, AT(view.roll_degrees), .lo = -3600, .hi = 3600 },
    [VIEW_UP] = { "up", "X,Y,Z", "Sets the direction that is up in the picture",
                  "by the orientation in the file, else 0,0,1, for OpenVDB 0,1,0, or a guess that "
                  "a note names",
                  .group = DRAW_GROUP_VIEW, AT(has_up), CUSTOM(read_up) },
    [VIEW_SIDE] = { "view", "SIDE",
                    "Selects the side that you see: front, back, left, right, top, bottom or iso; "
                    "left is the object's own left side",
                    "front, a little from the left and from above",
                    .brief = "Selects front, back, left, right, top, bottom or iso",
                    .group = DRAW_GROUP_VIEW, .type = TRIP_OPTION_CHOICE, AT(view.side),
                    .choices = sides, .first = TRIPTYCH_SIDE_FRONT },
    [VIEW_ZOOM] = { "zoom", "FACTOR", "Magnifies the picture, as a longer lens does", "1",
                    .brief = "Magnifies the picture", .group = DRAW_GROUP_VIEW,
                    .type = TRIP_OPTION_NUMBER, AT(view.zoom), .lo = 1e-6, .hi = 1e6 },
};
#undef AT

const trip_option_table view_options_table = { view_rows, VIEW_OPTIONS };

triptych_view view_options_view(const view_options *o)
{
    triptych_view v = o->view;
    v.eye = o->has_eye ? o->eye : NULL;
    v.look = o->has_look ? o->look : NULL;
    v.up = o->has_up ? o->up : NULL;
    return v;
}

int view_options_check(const view_options *o)
{
    const triptych_view *v = &o->view;
    if ((v->ortho_height > 0 || v->ortho_fit) && v->fov_degrees > 0)
        return trip_option_fail("--fov", "does not apply to a parallel view (--ortho)");
    if (o->has_eye && (v->side || v->azimuth_degrees != 0 || v->elevation_degrees != 0))
        return trip_option_fail("--eye", "excludes --view, --azimuth and --elevation");
    if (o->has_eye && v->ortho_fit)
        return trip_option_fail("--ortho", "fit excludes --eye; give a height");
    return 0;
}

/* ---- renderer and resources ---- */

static const char *const engines[] = { "auto", "io_uring", "pread", "null", NULL };
static const char *const renderers[] = { "auto", "gl", "cpu", "reference", "integral", NULL };
static const char *const viewer_renderers[] = { "auto", "gl", "cpu", NULL };
static const char *const occluded[] = { "skip", "draw", NULL };

#define AT(member) .at = offsetof(triptych_resources, member)

static const trip_option resource_rows[RESOURCE_OPTIONS] = {
    [RESOURCE_ENGINE] = { "engine", "NAME",
                          "Selects how files are read: io_uring, pread, null (from memory) or auto",
                          "auto", .group = DRAW_GROUP_RENDERER, .type = TRIP_OPTION_CHOICE,
                          AT(engine), .choices = engines },
    [RESOURCE_MEMORY] = { "memory", "SIZE",
                          "Limits the memory for data, for example 256M (MiB) or 2G (GiB)",
                          "a quarter of the memory that the process may use",
                          .brief = "Limits the memory for data, for example 2G",
                          .group = DRAW_GROUP_RENDERER, .type = TRIP_OPTION_BYTES_64,
                          AT(memory_bytes) },
    [RESOURCE_RENDERER] = { "renderer", "NAME",
                            "Selects the renderer: gl, cpu, reference (slow), integral (exact, "
                            "slower) or auto, which is gl on graphics hardware, else cpu",
                            "auto", .brief = "Selects gl, cpu, reference, integral or auto",
                            .group = DRAW_GROUP_RENDERER, .type = TRIP_OPTION_CHOICE, AT(renderer),
                            .choices = renderers },
    [RESOURCE_THREADS] = { "threads", "N", "Sets the number of threads that draw and read",
                           "one per processor",
                           .brief = "Sets the number of threads (default: all processors)",
                           .group = DRAW_GROUP_RENDERER, .type = TRIP_OPTION_INTEGER, AT(threads),
                           .lo = 1, .hi = 256 },
    [RESOURCE_OCCLUDED] = { "occluded", "skip|draw",
                            "Selects whether cpu reads bricks behind opaque ones", "skip",
                            "the picture is the same", .group = DRAW_GROUP_RESULTS,
                            .type = TRIP_OPTION_CHOICE, AT(read_occluded), .choices = occluded },
};
static const trip_option viewer_rows[] = {
    { "renderer", "NAME",
      "Selects the renderer: gl, cpu or auto, which is gl on graphics "
      "hardware, else cpu",
      "auto", .brief = "Selects gl, cpu or auto", .group = DRAW_GROUP_RENDERER,
      .type = TRIP_OPTION_CHOICE, AT(renderer), .choices = viewer_renderers },
};
#undef AT

const trip_option_table resource_table = { resource_rows, RESOURCE_OPTIONS };
const trip_option_table viewer_renderer_table = { viewer_rows, COUNT(viewer_rows) };

/* ---- transfer function ---- */

#define AT(member) .at = offsetof(triptych_transfer_function, member)

static const trip_option look_rows[LOOK_OPTIONS] = {
    [LOOK_LEVEL] = { "level", "L", "Sets the middle of the values that --window covers",
                     .brief = "Sets the middle of the values that --window covers",
                     .group = DRAW_GROUP_LOOK, .type = TRIP_OPTION_NUMBER, AT(level),
                     .lo = -DBL_MAX, .hi = DBL_MAX },
    [LOOK_OPACITY_SCALE] = { "opacity-scale", "X",
                             "Multiplies the extinction: opacity o becomes 1-(1-o)^X", "1",
                             .brief = "Makes the volume denser (above 1) or thinner",
                             .group = DRAW_GROUP_LOOK, .type = TRIP_OPTION_NUMBER,
                             AT(opacity_scale), .lo = 1e-6, .hi = 1e6 },
    [LOOK_TF] = { "tf", "NAME|FILE",
                  "Selects the transfer function. From the histogram: auto, ct, mr, fog, labels, "
                  "simulation. In Hounsfield units: ct-bone, ct-soft, ct-lung, ct-skin. Over the "
                  "range of the data: grey, bone, hot-metal, viridis, vessels, xray. Other names "
                  "are files",
                  "the one in the data set",
                  .brief = "Selects the transfer function (`triptych tf list`)",
                  .group = DRAW_GROUP_LOOK, .type = TRIP_OPTION_TEXT, AT(name) },
    [LOOK_WINDOW] = { "window", "W",
                      "Stretches the transfer function over the values from L-W/2 to L+W/2", NULL,
                      "requires --level L",
                      .brief = "Stretches the transfer function over W values",
                      .group = DRAW_GROUP_LOOK, .type = TRIP_OPTION_ABOVE, AT(window), .lo = 0,
                      .hi = DBL_MAX },
};
#undef AT

const trip_option_table look_table = { look_rows, LOOK_OPTIONS };

int look_options_check(uint64_t given)
{
    const bool level = given >> LOOK_LEVEL & 1, window = given >> LOOK_WINDOW & 1;
    return level == window ? 0
                           : trip_option_fail(level ? "--level" : "--window",
                                              "give --window and --level together");
}

/* ---- volumes ---- */

static int read_grid(const trip_option *row, const char *text, void *base)
{
    triptych_brick_options *v = base;
    (void)row;
    if (v->grid)
        return trip_option_fail("--grid", "given twice; only one grid is possible");
    v->grid = text;
    return 0;
}

static int read_spacing(const trip_option *row, const char *text, void *base)
{
    double *spacing = ((triptych_brick_options *)base)->spacing;
    int count, status = trip_option_numbers("--spacing", text, 3, 3, spacing, &count);
    (void)row;
    for (int a = 0; a < 3 && status == 0; a++)
        if (!(spacing[a] > 0))
            return trip_option_fail("--spacing", "takes three positive lengths");
    return status;
}

static int read_axes(const trip_option *row, const char *text, void *base)
{
    (void)row;
    ((triptych_brick_options *)base)->axes = text;
    return trip_anatomy_axes_valid(text) ? 0
                                         : trip_option_fail("--axes", "takes " TRIP_ANATOMY_AXES);
}

static int read_fill(const trip_option *row, const char *text, void *base)
{
    double value;
    (void)row;
    ((triptych_brick_options *)base)->fill = text;
    return !strcmp(text, "none") || (trip_text_to_double(text, &value) && isfinite(value))
               ? 0
               : trip_option_fail("--fill", "takes a number or none");
}

/* Parses "R", a length, or "Fx", a factor. */
static int read_radius(const trip_option *row, const char *text, void *base)
{
    triptych_brick_options *v = base;
    const size_t length = strlen(text);
    const bool factor = length > 1 && text[length - 1] == 'x';
    char number[64] = "";
    double value = 0;
    (void)row;
    if (length < sizeof number)
        memcpy(number, text, factor ? length - 1 : length);
    if (!trip_text_to_double(number, &value) || !(value > 0) || value > (factor ? 1e6 : 1e12))
        return trip_option_fail("--radius", "takes a length above 0, or a factor with an x behind "
                                            "it, such as 1.5x");
    *(factor ? &v->point_radius_factor : &v->point_radius) = value;
    return 0;
}

static const char *const point_colours[] = {
    "auto", "rgb", "intensity", "height", "classification", "return", "time", "density", NULL
};
_Static_assert(TRIPTYCH_POINT_COLOUR_AUTO == 0 && TRIPTYCH_POINT_COLOUR_DENSITY == 7,
               "point_colours");

static const char *const level_sets[] = { "filled", "band", NULL };

#define AT(member) .at = offsetof(triptych_brick_options, member)

static const trip_option volume_rows[] = {
    { "grid", "NAME", "Selects a grid of an OpenVDB file or a variable of a netCDF file",
      "density, else the first fog volume or grid of scalars; the netCDF variable with the most "
      "numbers",
      .group = DRAW_GROUP_VOLUME, AT(grid), CUSTOM(read_grid) },
    { "level-set", "HOW", "Selects how an OpenVDB level set becomes a density: filled or band",
      "filled", .group = DRAW_GROUP_VOLUME, .type = TRIP_OPTION_CHOICE, AT(level_set),
      .choices = level_sets, .first = TRIPTYCH_LEVEL_SET_FILLED },
    { "series", "N", "Selects a series of a DICOM folder by the number in the list of `info`",
      "the largest", .group = DRAW_GROUP_VOLUME, .type = TRIP_OPTION_INTEGER, AT(series), .lo = 1,
      .hi = INT32_MAX },
    { "spacing", "X,Y,Z", "Sets the distance of neighbouring voxels along each axis",
      "the distance in the file, else 1", .group = DRAW_GROUP_VOLUME, AT(spacing),
      CUSTOM(read_spacing) },
    { "coordinates", "X.txt,Y.txt,Z.txt",
      "Reads the position of each voxel along each axis from files of numbers; an axis without a "
      "file is even",
      .group = DRAW_GROUP_VOLUME, .type = TRIP_OPTION_TEXT, AT(coordinates) },
    { "axes", "PIR",
      "Gives the orientation of a patient if the file does not: where x, y and z point to, here "
      "posterior, inferior and right",
      .group = DRAW_GROUP_VOLUME, AT(axes), CUSTOM(read_axes) },
    { "allow-gaps", NULL,
      "Accepts a stack with missing slices: the neighbours of a gap touch, but DICOM slices stay "
      "where they are",
      .group = DRAW_GROUP_VOLUME, .type = TRIP_OPTION_FLAG, AT(allow_gaps) },
    { "channel", "N", "Selects the channel or component of a file with several, from 0", "0",
      .group = DRAW_GROUP_VOLUME, .type = TRIP_OPTION_INTEGER, AT(channel), .lo = 0,
      .hi = INT32_MAX },
    { "time", "N", "Selects the time of a file with several, from 0", "0",
      .group = DRAW_GROUP_VOLUME, .type = TRIP_OPTION_INTEGER, AT(time), .lo = 0, .hi = INT32_MAX },
    { "fill", "VALUE|none",
      "Names the value that stands for \"no value\", or keeps all values with none",
      "known fill values far outside of all other values: 1e20, -9999, -32768, ...",
      .group = DRAW_GROUP_VOLUME, AT(fill), CUSTOM(read_fill) },
};

static const trip_option point_rows[] = {
    { "color", "HOW",
      "Colors the points by rgb (their own colors), intensity, height, "
      "classification, return, time or density",
      "auto: rgb, else intensity, else height", .group = DRAW_GROUP_POINTS,
      .type = TRIP_OPTION_CHOICE, AT(point_colour), .choices = point_colours },
    { "k", "N",
      "Sets how many neighbours tell the radius and the normal of a point "
      "without them: 3 to 64",
      "12", .group = DRAW_GROUP_POINTS, .type = TRIP_OPTION_INTEGER, AT(point_neighbours), .lo = 3,
      .hi = 64 },
    { "outliers", "N",
      "Leaves out points whose neighbours are farther away on average than the mean of all points "
      "and N standard deviations",
      "keeps all points", .group = DRAW_GROUP_POINTS, .type = TRIP_OPTION_ABOVE, AT(point_outliers),
      .lo = 0, .hi = 1000 },
    { "radius", "R|Fx",
      "Sets the radius of all points, in units of the cloud, or multiplies "
      "all radii by F",
      "from the file, else from neighbours", .group = DRAW_GROUP_POINTS, AT(point_radius),
      CUSTOM(read_radius) },
    { "uncertainty", NULL,
      "Draws each sample of range images, or of scans with poses, as an "
      "ellipsoid along its ray, as long as its distance is uncertain",
      "surfels", .group = DRAW_GROUP_POINTS, .type = TRIP_OPTION_FLAG, AT(point_uncertainty) },
    { "hyperlines", NULL,
      "Fuses range images into points that look as the cameras nearest to the "
      "view saw them",
      "each sample is a point", .group = DRAW_GROUP_POINTS, .type = TRIP_OPTION_FLAG,
      AT(point_hyperlines) },
};
#undef AT

const trip_option_table volume_options_table = { volume_rows, COUNT(volume_rows) };
const trip_option_table point_options_table = { point_rows, COUNT(point_rows) };

/* ---- heat ---- */

static const trip_option heat_rows[] = {
    { "emission", "HEAT.trip",
      "Reads heat from a second data set, for --effects emission or auto: hot matter glows",
      .group = DRAW_GROUP_LIGHT, .type = TRIP_OPTION_TEXT },
};

const trip_option_table heat_table = { heat_rows, COUNT(heat_rows) };

int heat_options_check(const draw_settings *s, const char *heat)
{
    const int some = s->effects.which & TRIPTYCH_EFFECT_AUTO ? ~0 : s->effects.which;
    if (s->effects.which & TRIPTYCH_EFFECT_EMISSION && !heat)
        return trip_option_fail("--effects",
                                "emission requires a data set of heat, --emission HEAT.trip");
    if (heat && !(some & TRIPTYCH_EFFECT_EMISSION))
        return trip_option_fail("--emission", "requires --effects emission or auto");
    if (!heat && s->effects.kelvin[1] > 0)
        return trip_option_fail("--temperature", "requires --emission");
    return 0;
}
