#include "render_options.h"

#include <float.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

#include "cached_volume.h"
#include "clip_options.h"
#include "geometry.h"
#include "effects_options.h"
#include "options.h"
#include "quality_options.h"
#include "report.h"
#include "text.h"
#include "video.h"
#include "volume_options.h"

enum {
    KEY_GRID = 256,
    KEY_LEVEL_SET,
    KEY_SPACING,
    KEY_AXES,
    KEY_COORDINATES,
    KEY_ALLOW_GAPS,
    KEY_SIZE,
    KEY_EYE,
    KEY_LOOK,
    KEY_UP,
    KEY_FOV,
    KEY_ORTHO,
    KEY_ORBIT,
    KEY_PATH,
    KEY_FPS,
    KEY_IN_FLIGHT,
    KEY_VIEW,
    KEY_AZIMUTH,
    KEY_ELEVATION,
    KEY_ROLL,
    KEY_ZOOM,
    KEY_BACKGROUND,
    KEY_TF,
    KEY_OPACITY_SCALE,
    KEY_CLIP_BOX,
    KEY_CLIP_PLANE,
    KEY_SHOW,
    KEY_WINDOW,
    KEY_LEVEL,
    KEY_LIGHT,
    KEY_EFFECTS,
    KEY_ANISOTROPY,
    KEY_CUEING,
    KEY_LIGHT_CELLS,
    KEY_EMISSION,
    KEY_TEMPERATURE,
    KEY_NO_SHADING,
    KEY_H,
    KEY_EARLY_TERMINATION,
    KEY_KERNEL_RADIUS,
    KEY_LOW_PASS,
    KEY_FLATTEN,
    KEY_WEIGHTS,
    KEY_NORMALISE,
    KEY_TARGET,
    KEY_RENDERER,
    KEY_QUALITY,
    KEY_ERROR,
    KEY_REPORT,
    KEY_CLASSIFY,
    KEY_COMPOSITING,
    KEY_SAMPLES_PER_SHEET,
    KEY_LOD,
    KEY_MAX_BYTES,
    KEY_MAX_MS,
    KEY_METHOD,
    KEY_SUBMIT,
    KEY_TRAVERSAL,
    KEY_DEPTH,
    KEY_STATS,
    KEY_EXPLAIN,
    KEY_COUNT,
    KEY_OCCLUDED,
    KEY_MEMORY,
    KEY_ENGINE,
    KEY_THREADS,
    KEY_FIELD,
    KEY_KERNEL,
    KEY_TOLERANCE,
    KEY_SAMPLES,
};

static const struct argp_option options[] = {
    { NULL, 0, NULL, 0, "Picture:", 1 },
    { "background", KEY_BACKGROUND, "R,G,B[,A]|none", 0,
      "Sets the colour behind the volume; components are 0 to 1 (default: 0,0,0; for .exr none)",
      1 },
    { "output", 'o', "FILE", 0,
      "Writes this file: .png, .jpg, .tif or .exr; with --orbit or --path also a video, .mp4, "
      ".mov, .mkv or .webm, which needs ffmpeg",
      1 },
    { "size", KEY_SIZE, "WxH", 0,
      "Sets the picture size in pixels, 1 to 65536 a side (default: 1024x1024)", 1 },
    { NULL, 0, NULL, 0, "View:", 2 },
    { "azimuth", KEY_AZIMUTH, "DEGREES", 0,
      "Turns the eye around the object, to your right (default: 0)", 2 },
    { "elevation", KEY_ELEVATION, "DEGREES", 0, "Raises the eye around the object (default: 0)",
      2 },
    { "eye", KEY_EYE, "X,Y,Z", 0,
      "Sets the position of the eye (default: so that the whole object is in view); excludes "
      "--view, --azimuth and --elevation",
      2 },
    { "fov", KEY_FOV, "DEGREES", 0,
      "Sets the vertical angle of view, up to 179.999 (default: 30); excludes --ortho", 2 },
    { "look", KEY_LOOK, "X,Y,Z", 0,
      "Sets the point that the eye looks at (default: the middle of the visible object)", 2 },
    { "ortho", KEY_ORTHO, "HEIGHT|fit", 0,
      "Draws a parallel view, HEIGHT world units high; fit shows the whole object and excludes "
      "--eye",
      2 },
    { "roll", KEY_ROLL, "DEGREES", 0, "Turns the picture clockwise (default: 0)", 2 },
    { "up", KEY_UP, "X,Y,Z", 0,
      "Sets the direction that is up in the picture (default: by the orientation in the file, else "
      "0,0,1, for OpenVDB 0,1,0, or a guess that a note names)",
      2 },
    { "view", KEY_VIEW, "SIDE", 0,
      "Selects the side that you see: front, back, left, right, top, bottom or iso; left is the "
      "object's own left side (default: front, a little from the left and from above)",
      2 },
    { "zoom", KEY_ZOOM, "FACTOR", 0, "Magnifies the picture, as a longer lens does (default: 1)",
      2 },
    { NULL, 0, NULL, 0, "Turntables and camera paths:", 3 },
    { "fps", KEY_FPS, "N", 0,
      "Sets the frames per second of a video, 0.001 to 1000 (default: from the path, else 30)", 3 },
    { "in-flight", KEY_IN_FLIGHT, "N", 0,
      "Draws N pictures at once, 1 to 16; all of them share --memory (default: 2; with --stats or "
      "--explain 1)",
      3 },
    { "orbit", KEY_ORBIT, "N", 0,
      "Draws N pictures once around the object: FILE-000.png and so on, or a video", 3 },
    { "path", KEY_PATH, "FILE.json", 0,
      "Draws pictures along a camera path, which triptych-render(1) describes: FILE-000.png and so "
      "on, or a video; excludes --orbit and the options of the view",
      3 },
    { NULL, 0, NULL, 0, "Look:", 4 },
    { "level", KEY_LEVEL, "L", 0, "Sets the middle of the values that --window covers", 4 },
    { "opacity-scale", KEY_OPACITY_SCALE, "X", 0,
      "Multiplies the extinction: opacity o becomes 1-(1-o)^X (default: 1)", 4 },
    { "tf", KEY_TF, "NAME|FILE", 0,
      "Selects the transfer function (default: the one in the data set). From the histogram: auto, "
      "ct, mr, fog, labels, simulation. In Hounsfield units: ct-bone, ct-soft, ct-lung, ct-skin. "
      "Over the range of the data: grey, bone, hot-metal, viridis, vessels, xray. Other names are "
      "files",
      4 },
    { "window", KEY_WINDOW, "W", 0,
      "Stretches the transfer function over the values from L-W/2 to L+W/2; requires --level L",
      4 },
    { NULL, 0, NULL, 0, "Light and effects:", 5 },
    TRIP_OPTION_LIGHT(5),
    TRIP_OPTIONS_EFFECTS(5),
    TRIP_OPTIONS_EMISSION(5),
    TRIP_OPTION_NO_SHADING(KEY_NO_SHADING, 5),
    { NULL, 0, NULL, 0, "Clipping:", 6 },
    TRIP_OPTIONS_CLIP(6),
    { NULL, 0, NULL, 0, "Accuracy and speed:", 7 },
    { "classify", KEY_CLASSIFY, "pre|post|auto", 0,
      "Selects when values become colours. post interpolates values and classifies them at each "
      "pixel, close to the integral. pre classifies voxels and draws them as splats, as the papers "
      "do. auto is post, except with options that only splats have (default: auto)",
      7 },
    { "early-termination", KEY_EARLY_TERMINATION, "T", 0,
      "Stops a pixel once its transmittance is below T, 0 (never) to 0.1; no component is off by "
      "more than T (default: post 1/512, pre 1/8192)",
      7 },
    { "saturation", 0, NULL, OPTION_ALIAS | OPTION_HIDDEN, NULL, 7 },
    { "kernel", KEY_KERNEL, "NAME", 0,
      "Selects the interpolation of post and integral: linear, cubic or gaussian (post only) "
      "(default: linear); or the footprints of pre: exact, ewa or fixed (default: exact)",
      7 },
    { "lod", KEY_LOD, "PX", 0,
      "Draws distant parts by coarse levels with voxels at most PX pixels wide, 0 to 1000 "
      "(default: 0, only the finest level)",
      7 },
    { "max-bytes", KEY_MAX_BYTES, "SIZE", 0,
      "Draws coarser levels, so that at most SIZE of codes and normals is in view, for example 64M",
      7 },
    { "max-ms", KEY_MAX_MS, "MS", 0,
      "Draws coarser levels, so that a frame takes about MS milliseconds; the picture then depends "
      "on the machine",
      7 },
    TRIP_OPTIONS_QUALITY(7),
    { "samples", KEY_SAMPLES, "N", 0,
      "Draws N x N rays per pixel, for antialiasing, 1 to 64 (default: 1)", 7 },
    { "samples-per-sheet", KEY_SAMPLES_PER_SHEET, "N|auto", 0,
      "Sets the samples per sheet of post, 1 to 16; more come closer to the integral (default: "
      "automatic, 1 to 6)",
      7 },
    { "slices", 0, NULL, OPTION_ALIAS | OPTION_HIDDEN, NULL, 7 },
    { NULL, 0, NULL, 0, "Renderer and resources:", 8 },
    TRIP_OPTION_ENGINE(KEY_ENGINE, 8),
    TRIP_OPTION_MEMORY(KEY_MEMORY, 8),
    { "renderer", KEY_RENDERER, "NAME", 0,
      "Selects the renderer: gl, cpu, reference (slow), integral (exact, slower) or auto, which is "
      "gl on graphics hardware, else cpu (default: auto)",
      8 },
    TRIP_OPTION_THREADS(KEY_THREADS, 8),
    { NULL, 0, NULL, 0, "Results and diagnostics:", 9 },
    { "count", KEY_COUNT, NULL, 0,
      "Draws every frame once more, untimed, and counts its splats exactly; requires --stats or "
      "--explain",
      9 },
    { "depth", KEY_DEPTH, "FILE", 0,
      "Writes the mean distance from the eye to the visible object at each pixel, in world units: "
      ".exr or .tif; requires --samples 1; not with integral",
      9 },
    { "explain", KEY_EXPLAIN, NULL, 0,
      "Prints the view as options, the plan of the frame and its cost", 9 },
    { "occluded", KEY_OCCLUDED, "skip|draw", 0,
      "Selects whether cpu reads bricks behind opaque ones (default: skip); the picture is the "
      "same",
      9 },
    { "show", KEY_SHOW, "NAME", 0,
      "Selects the meaning of the colours: picture, lists (x red, y green, z blue), merge (weights "
      "of the lists) or levels (of detail) (default: picture)",
      9 },
    { "stats", KEY_STATS, "FILE", 0, "Writes counts and times as JSON; - is standard output", 9 },
    { NULL, 0, NULL, 0, "Volume (not for a data set, which has these fixed):", 10 },
    TRIP_OPTIONS_VOLUME(10),
    { NULL, 0, NULL, 0, "Integral (--renderer integral):", 11 },
    { "field", KEY_FIELD, "NAME", 0,
      "Selects the integrand: stored values, the values of the source (requires a volume, not "
      "a data set) or splats (default: stored)",
      11 },
    { "tolerance", KEY_TOLERANCE, "E", 0,
      "Bounds the error of each component of a pixel, 1e-12 to 0.1 (default: 1e-4)", 11 },
    { NULL, 0, NULL, 0, "Variants of the papers:", 12 },
    { "compositing", KEY_COMPOSITING, "splat|sheet", 0,
      "Selects the unit of compositing: each splat in list order, or the sum of the splats of a "
      "sheet "
      "(default: splat); pre only",
      12 },
    { "flatten", KEY_FLATTEN, "S", 0,
      "Flattens kernels along the gradient, up to S times, 1 to 100 (default: 1, round); requires "
      "--kernel ewa; not with --count",
      12 },
    { "h", KEY_H, "H", 0,
      "Sets where the lists of merge begin to blend, 0 to below 1 (default: post 0.99, pre 0.85)",
      12 },
    { "kernel-radius", KEY_KERNEL_RADIUS, "VOXELS", 0,
      "Sets the radius of a splat, 0.1 to 100 (default: 2); pre, and integral with --field splats",
      12 },
    { "low-pass", KEY_LOW_PASS, "NAME", 0,
      "Selects the filter for splats smaller than a pixel: ewa, uniform (requires --renderer "
      "reference --kernel ewa) or none (default: ewa); pre only",
      12 },
    { "method", KEY_METHOD, "NAME", 0,
      "Selects how lists become a picture: merge, clip, axis, or image, which implies --renderer "
      "reference and pre (default: merge)",
      12 },
    { "normalise", KEY_NORMALISE, NULL, 0,
      "Divides colours by the accumulated opacity: every covered pixel becomes opaque", 12 },
    { "submit", KEY_SUBMIT, "FORM", 0,
      "Selects how gl receives splats: replicated or indexed, sprites or triangles, or one of each "
      "(default: replicated,sprites); pre and gl only",
      12 },
    { "target", KEY_TARGET, "NAME", 0,
      "Selects the pixel format of layers: rgba32f, rgba16f or rgba8 (default: rgba32f); pre with "
      "gl or cpu only",
      12 },
    { "traversal", KEY_TRAVERSAL, "NAME", 0,
      "Selects the order of sheets: outward from the eye, or ascending as in the file (pre only) "
      "(default: outward)",
      12 },
    { "weights", KEY_WEIGHTS, "pixel|vertex", 0,
      "Selects the weights of merge: of the ray of each pixel, or interpolated from the corners of "
      "splats, which implies --renderer reference (default: pixel); pre only",
      12 },
    { 0 },
};

/* State of parsing: the options that were given, for the checks of combinations. */
typedef struct parse {
    render_options *o;
    quality_options quality;
    bool h, early_termination, target, background, lists, forms, side, light, level, kernel_radius;
    bool order; /* --method or --traversal */
    bool samples_per_sheet, compositing, classify;
    bool levels;           /* --lod, --max-bytes or --max-ms */
    bool kernel, integral; /* --kernel of values; options of the integral renderer */
    bool again;            /* second pass, over the settings that --quality or --error selected */
    bool footprint;        /* --kernel of splats, --low-pass or --flatten */
    bool weights;
} parse;

static int parse_footprint(int key, const char *arg, parse *p)
{
    static const char *const filters[] = { "ewa", "uniform", "none", NULL };
    static const char *const weights[] = { "pixel", "vertex", NULL };
    triptych_settings *s = &p->o->settings;
    int which = 0, status;
    if (key == KEY_WEIGHTS) {
        p->weights = true;
        return trip_option_choice("--weights", arg, weights, &s->vertex_weights);
    }
    p->footprint = true;
    if (key == KEY_FLATTEN)
        return trip_option_number("--flatten", arg, 1, 100, &s->flatten);
    status = trip_option_choice("--low-pass", arg, filters, &which);
    s->low_pass = (triptych_low_pass)which;
    return status;
}

static int parse_point(const char *option, const char *text, double point[3], bool *given)
{
    int count;
    *given = true;
    return trip_option_numbers(option, text, 3, 3, point, &count);
}

static bool is_zero(const double v[3])
{
    return !(trip_length(trip_v3(v[0], v[1], v[2])) > 0);
}

static int parse_max_bytes(const char *text, triptych_settings *s)
{
    uint64_t bytes = 0;
    int status = trip_option_bytes("--max-bytes", text, &bytes);
    s->max_bytes = (double)bytes;
    return status;
}

static int parse_background(const char *text, triptych_settings *s)
{
    int count;
    memset(s->background, 0, sizeof s->background);
    if (!strcmp(text, "none"))
        return 0;
    s->background[3] = 1;
    int status = trip_option_numbers("--background", text, 3, 4, s->background, &count);
    for (int i = 0; i < 4 && !status; i++)
        if (s->background[i] < 0 || s->background[i] > 1)
            return trip_option_fail("--background", "components must be between 0 and 1");
    return status;
}

static int parse_window(const char *text, triptych_transfer_function *look)
{
    int status = trip_option_number("--window", text, 0, DBL_MAX, &look->window);
    return !status && look->window == 0 ? trip_option_fail("--window", "must be above 0") : status;
}

/* Parses one or two of the four names, joined by a comma. */
static int parse_submit(const char *text, parse *p)
{
    static const char *const names[] = { "replicated", "indexed", "sprites", "triangles", NULL };
    for (const char *rest = text; rest;) {
        char name[16];
        const char *comma = strchr(rest, ',');
        int which, length = (int)(comma ? comma - rest : (long)strlen(rest));
        snprintf(name, sizeof name, "%.*s", length, rest);
        int status = trip_option_choice("--submit", name, names, &which);
        if (status)
            return status;
        bool *given = which < 2 ? &p->lists : &p->forms;
        if (*given)
            return trip_option_fail("--submit",
                                    "replicated excludes indexed, and sprites excludes triangles");
        *given = true;
        *(which < 2 ? &p->o->settings.indexed : &p->o->settings.triangles) = which % 2;
        rest = comma ? comma + 1 : NULL;
    }
    return 0;
}

static int parse_volume(int key, char *arg, triptych_brick_options *v)
{
    switch (key) {
    case KEY_GRID:
        return trip_option_grid(arg, &v->grid);
    case KEY_LEVEL_SET:
        return trip_option_level_set(arg, &v->level_set);
    case KEY_SPACING:
        return trip_option_spacing(arg, v->spacing);
    case KEY_AXES:
        return trip_option_axes(arg, &v->axes);
    case KEY_COORDINATES:
        v->coordinates = arg;
        return 0;
    case KEY_ALLOW_GAPS:
        v->allow_gaps = true;
        return 0;
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

static int parse_up(const char *text, render_options *o)
{
    int status = parse_point("--up", text, o->up, &o->up_given);
    if (!status && is_zero(o->up))
        return trip_option_fail("--up", "the direction is zero");
    return status;
}

static int parse_ortho(const char *text, render_options *o)
{
    double height;
    o->ortho_height = 0;
    o->ortho_fit = !strcmp(text, "fit");
    if (o->ortho_fit)
        return 0;
    if (!trip_text_to_double(text, &height))
        return trip_fail(TRIP_USAGE, "usage", "--ortho", "\"%s\" is neither a height nor fit",
                         text);
    return trip_option_number("--ortho", text, 1e-100, 1e100, &o->ortho_height);
}

static int parse_side(int key, char *arg, parse *p)
{
    static const char *const views[] = { "front", "back",   "left", "right",
                                         "top",   "bottom", "iso",  NULL };
    render_options *o = p->o;
    int which = 0, status;
    switch (key) {
    case KEY_VIEW:
        status = trip_option_choice("--view", arg, views, &which);
        o->side = (triptych_side)(TRIPTYCH_FRONT + which);
        break;
    case KEY_AZIMUTH:
        status = trip_option_number("--azimuth", arg, -3600, 3600, &o->azimuth_degrees);
        break;
    case KEY_ELEVATION:
        status = trip_option_number("--elevation", arg, -3600, 3600, &o->elevation_degrees);
        break;
    default:
        return ARGP_ERR_UNKNOWN;
    }
    p->side = true;
    return status;
}

static int parse_view(int key, char *arg, parse *p)
{
    render_options *o = p->o;
    switch (key) {
    case KEY_SIZE:
        return trip_option_size("--size", arg, &o->width, &o->height);
    case KEY_EYE:
        return parse_point("--eye", arg, o->eye, &o->eye_given);
    case KEY_LOOK:
        return parse_point("--look", arg, o->look, &o->look_given);
    case KEY_UP:
        return parse_up(arg, o);
    case KEY_ROLL:
        return trip_option_number("--roll", arg, -3600, 3600, &o->roll_degrees);
    case KEY_ZOOM:
        return trip_option_number("--zoom", arg, 1e-6, 1e6, &o->zoom);
    case KEY_FOV:
        return trip_option_number("--fov", arg, TRIPTYCH_FOV_MIN_DEGREES, TRIPTYCH_FOV_MAX_DEGREES,
                                  &o->fov_degrees);
    case KEY_ORTHO:
        return parse_ortho(arg, o);
    case KEY_ORBIT:
        return trip_option_integer("--orbit", arg, 1, 100000, &o->orbit);
    case KEY_PATH:
        o->path = arg;
        return 0;
    case KEY_FPS:
        return trip_option_number("--fps", arg, 0.001, 1000, &o->fps);
    default:
        return parse_side(key, arg, p);
    }
}

static int parse_method(int key, char *arg, parse *p)
{
    static const char *const compositings[] = { "splat", "sheet", NULL };
    static const char *const methods[] = { "merge", "clip", "axis", "image", NULL };
    static const char *const traversals[] = { "outward", "ascending", NULL };
    triptych_settings *s = &p->o->settings;
    int which = 0, status;
    switch (key) {
    case KEY_QUALITY:
        return quality_option_quality(arg, &p->quality);
    case KEY_ERROR:
        return quality_option_error(arg, &p->quality);
    case KEY_REPORT:
        p->quality.report = arg;
        return 0;
    case KEY_CLASSIFY:
        p->classify = true;
        status = trip_option_classify(arg, 3, &which);
        s->classify = (triptych_classify)which;
        return status;
    case KEY_COMPOSITING:
        p->compositing = true;
        status = trip_option_choice("--compositing", arg, compositings, &which);
        s->compositing = (triptych_compositing)which;
        return status;
    case KEY_WEIGHTS:
    case KEY_LOW_PASS:
    case KEY_FLATTEN:
        return parse_footprint(key, arg, p);
    case KEY_LOD:
        p->levels = true;
        return trip_option_number("--lod", arg, 0, 1000, &s->lod_px);
    case KEY_MAX_BYTES:
        p->levels = true;
        return parse_max_bytes(arg, s);
    case KEY_MAX_MS:
        p->levels = true;
        return trip_option_number("--max-ms", arg, 1e-3, 1e9, &s->max_ms);
    case KEY_SAMPLES_PER_SHEET:
        p->samples_per_sheet = true;
        s->samples_per_sheet = 0;
        return strcmp(arg, "auto")
                   ? trip_option_integer("--samples-per-sheet", arg, 1, 16, &s->samples_per_sheet)
                   : 0;
    case KEY_METHOD:
        status = trip_option_choice("--method", arg, methods, &which);
        s->method = (triptych_method)which;
        p->order = true;
        return status;
    case KEY_TRAVERSAL:
        status = trip_option_choice("--traversal", arg, traversals, &which);
        s->traversal = (triptych_traversal)which;
        p->order = true;
        return status;
    case KEY_H:
        p->h = true;
        status = trip_option_number("--h", arg, 0, 1, &s->h);
        return !status && s->h == 1 ? trip_option_fail("--h", "must be below 1") : status;
    case KEY_EARLY_TERMINATION:
        p->early_termination = true;
        return trip_option_number("--early-termination", arg, 0, 0.1, &s->early_termination);
    case KEY_KERNEL_RADIUS:
        p->kernel_radius = true;
        return trip_option_number("--kernel-radius", arg, 0.1, 100, &s->kernel_radius);
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

static int parse_cut(int key, char *arg, parse *p)
{
    static const char *const shows[] = { "picture", "lists", "merge", "levels", NULL };
    triptych_settings *s = &p->o->settings;
    int which = 0, status;
    switch (key) {
    case KEY_CLIP_BOX:
        return trip_option_clip_box(arg, &s->clip);
    case KEY_CLIP_PLANE:
        return trip_option_clip_plane(arg, &s->clip);
    case KEY_SHOW:
        status = trip_option_choice("--show", arg, shows, &which);
        s->show = (triptych_show)which;
        return status;
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

static int parse_look(int key, char *arg, parse *p)
{
    render_options *o = p->o;
    switch (key) {
    case KEY_TF:
        o->function.name = arg;
        return 0;
    case KEY_OPACITY_SCALE:
        return trip_option_number("--opacity-scale", arg, 1e-6, 1e6, &o->function.opacity_scale);
    case KEY_WINDOW:
        return parse_window(arg, &o->function);
    case KEY_LEVEL:
        p->level = true;
        return trip_option_number("--level", arg, -DBL_MAX, DBL_MAX, &o->function.level);
    case KEY_LIGHT:
        p->light = true;
        return trip_option_light(arg, &o->settings);
    case KEY_EFFECTS:
        return trip_option_effects(arg, &o->settings);
    case KEY_ANISOTROPY:
        return trip_option_anisotropy(arg, &o->settings);
    case KEY_CUEING:
        return trip_option_cueing(arg, &o->settings);
    case KEY_LIGHT_CELLS:
        return trip_option_light_cells(arg, &o->settings);
    case KEY_EMISSION:
        o->heat = arg;
        return 0;
    case KEY_TEMPERATURE:
        return trip_option_temperature(arg, &o->settings);
    case KEY_NO_SHADING:
        o->settings.shading = false;
        return 0;
    case KEY_NORMALISE:
        o->settings.normalise = true;
        return 0;
    case KEY_BACKGROUND:
        p->background = true;
        return parse_background(arg, &o->settings);
    default:
        return parse_cut(key, arg, p);
    }
}

/* Parses a kernel for values or for splats. */
static int parse_kernel(const char *arg, parse *p)
{
    static const char *const kernels[] = { "linear", "cubic", "gaussian", "exact",
                                           "ewa",    "fixed", NULL };
    triptych_settings *s = &p->o->settings;
    int which = 0, status = trip_option_choice("--kernel", arg, kernels, &which);
    bool of_values = which <= TRIPTYCH_GAUSSIAN;
    if (of_values)
        s->kernel = (triptych_kernel)which;
    else
        s->footprint = (triptych_footprint)(which - (TRIPTYCH_GAUSSIAN + 1));
    p->kernel |= of_values;
    p->footprint |= !of_values;
    return status;
}

static int parse_integral(int key, char *arg, parse *p)
{
    static const char *const fields[] = { "stored", "source", "splats", NULL };
    render_options *o = p->o;
    int which = 0, status;
    switch (key) {
    case KEY_FIELD:
        status = trip_option_choice("--field", arg, fields, &which);
        o->field = (render_field)(which + 1);
        break;
    case KEY_KERNEL:
        return parse_kernel(arg, p);
    case KEY_TOLERANCE:
        status = trip_option_number("--tolerance", arg, 1e-12, 0.1, &o->settings.tolerance);
        break;
    case KEY_SAMPLES:
        return trip_option_integer("--samples", arg, 1, 64, &o->settings.samples);
    default:
        return ARGP_ERR_UNKNOWN;
    }
    p->integral = true;
    return status;
}

static int parse_renderer(int key, char *arg, parse *p)
{
    static const char *const targets[] = { "rgba32f", "rgba16f", "rgba8", NULL };
    static const char *const occluded[] = { "skip", "draw", NULL };
    render_options *o = p->o;
    int which = 0, status;
    switch (key) {
    case KEY_RENDERER:
        status = trip_option_renderer(arg, 5, &which);
        o->renderer = (triptych_renderer)which;
        return status;
    case KEY_TARGET:
        p->target = true;
        status = trip_option_choice("--target", arg, targets, &which);
        o->settings.target = (triptych_target)which;
        return status;
    case KEY_SUBMIT:
        return parse_submit(arg, p);
    case KEY_OCCLUDED:
        status = trip_option_choice("--occluded", arg, occluded, &which);
        o->occluded = (render_occluded)(which + 1);
        return status;
    case KEY_MEMORY:
        return trip_option_memory(arg, &o->memory_bytes);
    case KEY_ENGINE:
        status = trip_option_engine(arg, 4, &which);
        o->engine = (triptych_engine)which;
        return status;
    case KEY_THREADS:
        return trip_option_threads(arg, &o->threads);
    case KEY_IN_FLIGHT:
        return trip_option_integer("--in-flight", arg, 1, 16, &o->in_flight);
    default:
        return parse_integral(key, arg, p);
    }
}

static int check_view(const parse *p)
{
    const render_options *o = p->o;
    bool parallel = o->ortho_height > 0 || o->ortho_fit;
    if (parallel && o->fov_degrees > 0)
        return trip_option_fail("--fov", "does not apply to a parallel view (--ortho)");
    if (o->eye_given && p->side)
        return trip_option_fail("--eye", "excludes --view, --azimuth and --elevation");
    if (o->eye_given && o->ortho_fit)
        return trip_option_fail("--ortho", "fit excludes --eye; give a height");
    return 0;
}

/* Checks that no option contradicts the views of a path. */
static int check_path(const parse *p)
{
    const render_options *o = p->o;
    bool other = p->side || o->eye_given || o->look_given || o->up_given || o->zoom > 0 ||
                 o->roll_degrees != 0 || o->fov_degrees > 0 || o->ortho_height > 0 || o->ortho_fit;
    if (o->path && (other || o->orbit))
        return trip_option_fail("--path",
                                "excludes --orbit and all options of the view except --size");
    return 0;
}

static int check_sequence(const parse *p)
{
    const render_options *o = p->o;
    bool several = o->orbit || o->path, moving = video_is_named(o->output);
    if (moving && !several)
        return trip_option_fail(o->output, "is a video, which requires --orbit or --path");
    if (o->fps > 0 && !moving)
        return trip_option_fail("--fps", "requires a video, -o NAME.mp4");
    if (o->in_flight && !several)
        return trip_option_fail("--in-flight", "requires --orbit or --path");
    if (o->in_flight > 1 && (o->stats || o->explain))
        return trip_option_fail("--in-flight", "must be 1 with --stats or --explain");
    return check_path(p);
}

/* Returns whether the settings allow coarse levels. */
static bool have_levels(const triptych_settings *s)
{
    return s->lod_px > 0 || s->max_bytes > 0 || s->max_ms > 0;
}

static int check_depth(const render_options *o)
{
    if (!o->depth)
        return 0;
    if (o->renderer == TRIPTYCH_RENDERER_INTEGRAL)
        return trip_option_fail("--depth", "does not apply to --renderer integral");
    if (o->settings.show == TRIPTYCH_SHOW_MERGE)
        return trip_option_fail("--depth",
                                "does not apply to --show merge, which does not draw the volume");
    if (o->settings.target != TRIPTYCH_RGBA32F)
        return trip_option_fail("--depth", "requires --target rgba32f");
    if (o->settings.samples > 1)
        return trip_option_fail("--depth", "requires --samples 1");
    return 0;
}

static int check_integral(parse *p)
{
    render_options *o = p->o;
    bool integral = o->renderer == TRIPTYCH_RENDERER_INTEGRAL;
    o->settings.field = o->field == RENDER_FIELD_SPLATS ? TRIPTYCH_SPLATS : TRIPTYCH_VALUES;
    if (p->integral && !integral)
        return trip_option_fail("--field, --tolerance", "require --renderer integral");
    if (p->kernel && o->field == RENDER_FIELD_SPLATS)
        return trip_option_fail("--kernel", "does not apply to --field splats");
    if (integral && o->settings.kernel == TRIPTYCH_GAUSSIAN)
        return trip_option_fail("--kernel", "must be linear or cubic with --renderer integral");
    if (o->field == RENDER_FIELD_SOURCE && !cached_volume_wanted(o->input))
        return trip_option_fail(
            "--field",
            "source requires a volume as input, because a data set does not hold its source");
    if (integral && p->classify && o->settings.classify != TRIPTYCH_CLASSIFY_AUTO)
        return trip_option_fail("--classify", "does not apply to --renderer integral");
    if (integral && p->samples_per_sheet)
        return trip_option_fail("--samples-per-sheet",
                                "does not apply to --renderer integral, which has no "
                                "sheets");
    if (integral && p->early_termination)
        return trip_option_fail("--early-termination",
                                "does not apply to --renderer integral; use --tolerance");
    if (integral && (p->h || p->order || p->compositing || p->weights))
        return trip_option_fail("--method, --h, --weights, --traversal, --compositing",
                                "do not apply to --renderer integral, which has no layers");
    if (integral && o->settings.show != TRIPTYCH_SHOW_PICTURE)
        return trip_option_fail("--show", "does not apply to --renderer integral, which has no "
                                          "lists and no levels");
    if (integral && have_levels(&o->settings))
        return trip_option_fail(
            "--lod, --max-bytes, --max-ms",
            "do not apply to --renderer integral, which draws the finest level");
    if (integral && p->kernel_radius && o->field != RENDER_FIELD_SPLATS)
        return trip_option_fail("--kernel-radius",
                                "requires --field splats with --renderer integral");
    return 0;
}

static int check_footprint(const parse *p)
{
    const render_options *o = p->o;
    const triptych_settings *s = &o->settings;
    bool ewa = s->footprint == TRIPTYCH_FOOTPRINT_EWA;
    bool reference = o->renderer == TRIPTYCH_RENDERER_REFERENCE;
    if (p->footprint && o->renderer == TRIPTYCH_RENDERER_INTEGRAL)
        return trip_option_fail("--kernel, --low-pass, --flatten",
                                "with footprints do not apply to --renderer integral");
    if (s->low_pass == TRIPTYCH_LOW_PASS_UNIFORM && !(reference && ewa))
        return trip_option_fail("--low-pass",
                                "uniform requires --renderer reference and --kernel ewa");
    if (s->flatten > 1 && !ewa)
        return trip_option_fail("--flatten", "requires --kernel ewa");
    if (s->flatten > 1 && o->count)
        return trip_option_fail("--flatten", "does not apply with --count");
    return 0;
}

/* Selects the renderer that an option requires, if --renderer is auto. */
static int choose_renderer(parse *p)
{
    render_options *o = p->o;
    const triptych_settings *s = &o->settings;
    const bool image = s->method == TRIPTYCH_IMAGE, reference = image || s->vertex_weights;
    const bool fixed = s->footprint == TRIPTYCH_FOOTPRINT_FIXED;
    if (s->vertex_weights && s->method != TRIPTYCH_MERGE)
        return trip_option_fail("--weights", "vertex requires --method merge");
    if (s->vertex_weights && s->compositing == TRIPTYCH_BY_SHEET)
        return trip_option_fail("--weights", "vertex requires --compositing splat");
    if (image && (p->compositing || s->traversal != TRIPTYCH_OUTWARD))
        return trip_option_fail("--method",
                                "image excludes --compositing and --traversal ascending");
    if ((image || fixed) && have_levels(s))
        return trip_option_fail(image ? "--method image" : "--kernel fixed",
                                "excludes --lod, --max-bytes and --max-ms");
    if (reference && o->renderer != TRIPTYCH_RENDERER_AUTO &&
        o->renderer != TRIPTYCH_RENDERER_REFERENCE)
        return trip_option_fail(image ? "--method image" : "--weights vertex",
                                "requires --renderer reference");
    if (fixed && o->renderer == TRIPTYCH_RENDERER_CPU)
        return trip_option_fail("--kernel fixed", "requires --renderer reference or gl");
    if (o->renderer == TRIPTYCH_RENDERER_AUTO && (reference || fixed))
        o->renderer = reference ? TRIPTYCH_RENDERER_REFERENCE : TRIPTYCH_RENDERER_GL;
    return 0;
}

/* Selects pre if an option for splats was given, even with its default value. Selects post if an
 * option for interpolated values was given. */
static int choose_classify(parse *p)
{
    render_options *o = p->o;
    bool splats = o->settings.traversal != TRIPTYCH_OUTWARD || p->kernel_radius || o->count ||
                  p->compositing || p->footprint || p->weights || p->target || p->lists ||
                  p->forms || o->settings.method == TRIPTYCH_IMAGE;
    if (o->settings.classify != TRIPTYCH_CLASSIFY_AUTO)
        return 0;
    const bool of_values = p->kernel && o->renderer != TRIPTYCH_RENDERER_INTEGRAL;
    if (splats && (p->samples_per_sheet || of_values))
        return trip_option_fail(
            p->samples_per_sheet ? "--samples-per-sheet" : "--kernel linear, cubic or gaussian",
            "does not apply with options for splats: --kernel exact, ewa or fixed, --low-pass, "
            "--flatten, --kernel-radius, --method image, --weights, --compositing, --target, "
            "--submit, --count and --traversal ascending");
    if (splats)
        o->settings.classify = TRIPTYCH_PRE;
    else if (p->samples_per_sheet || of_values)
        o->settings.classify = TRIPTYCH_POST;
    return 0;
}

static int check_classify(const parse *p)
{
    const render_options *o = p->o;
    if (o->count && o->renderer == TRIPTYCH_RENDERER_INTEGRAL)
        return trip_option_fail("--count", "does not apply to --renderer integral");
    if (o->settings.classify == TRIPTYCH_CLASSIFY_AUTO)
        return 0;
    if (o->settings.classify == TRIPTYCH_PRE && p->kernel &&
        o->renderer != TRIPTYCH_RENDERER_INTEGRAL)
        return trip_option_fail(
            "--kernel",
            "linear, cubic and gaussian require --classify post or --renderer integral");
    if (o->settings.classify == TRIPTYCH_PRE)
        return p->samples_per_sheet
                   ? trip_option_fail("--samples-per-sheet", "requires --classify post")
                   : 0;
    if (o->settings.traversal != TRIPTYCH_OUTWARD)
        return trip_option_fail("--traversal", "must be outward with --classify post");
    if (o->settings.method == TRIPTYCH_IMAGE)
        return trip_option_fail("--method", "image requires --classify pre");
    if (p->kernel_radius || p->compositing || p->footprint || p->weights)
        return trip_option_fail("--kernel, --low-pass, --flatten, --weights, --kernel-radius, "
                                "--compositing",
                                "for splats require --classify pre");
    if (o->count)
        return trip_option_fail("--count", "requires --classify pre");
    if (p->target || p->lists || p->forms)
        return trip_option_fail("--target, --submit", "require --classify pre");
    return 0;
}

static int add_input(render_options *o, const char *path)
{
    if (!o->input) {
        o->input = path;
        return 0;
    }
    if (o->more_count == RENDER_MORE_MAX)
        return trip_option_fail(path, "too many data sets; at most 64 are possible");
    o->more[o->more_count++] = path;
    return 0;
}

/* Several inputs must be data sets, not volumes. */
static int check_more(const parse *p)
{
    const render_options *o = p->o;
    for (int i = 0; i < o->more_count; i++) {
        const char *volume = cached_volume_wanted(o->input)     ? o->input
                             : cached_volume_wanted(o->more[i]) ? o->more[i]
                                                                : NULL;
        if (volume)
            return trip_option_fail(
                volume,
                TRIP_ONE_VOLUME "; several data sets are possible (see triptych brick --region)");
    }
    if (o->more_count && p->levels)
        return trip_option_fail(
            "--lod, --max-bytes, --max-ms",
            "do not apply to several data sets, which are drawn at the finest level");
    if (o->more_count && p->quality.error > 0)
        return trip_option_fail(
            "--error", "does not apply to several data sets; its settings were measured on one");
    return 0;
}

/* Checks combinations of options, and sets the options that others imply. */
static int check(parse *p)
{
    render_options *o = p->o;
    if (!o->input)
        return trip_option_fail("VOLUME",
                                "no volume given; use `triptych render VOLUME -o PICTURE.png`");
    if (!o->output)
        return trip_option_fail("-o",
                                "no picture given; use `triptych render VOLUME -o PICTURE.png`");
    int status = trip_option_check_volume(&o->volume, o->input);
    if (!status)
        status = check_more(p);
    if (!status)
        status = check_view(p);
    if (!status)
        status = check_sequence(p);
    if (status)
        return status;
    if (p->light && !o->settings.shading && !o->settings.effects)
        return trip_option_fail("--light", "does not apply with --no-shading");
    if (quality_options_given(&p->quality) && o->renderer == TRIPTYCH_RENDERER_INTEGRAL &&
        !p->again)
        return trip_option_fail("--quality, --error",
                                "do not apply to --renderer integral, which is exact");
    status = quality_options_check(&p->quality);
    if (!status)
        status = trip_option_check_effects(&o->settings, o->heat);
    if (status)
        return status;
    if (p->level != (o->function.window > 0))
        return trip_option_fail(p->level ? "--level" : "--window",
                                "give --window and --level together");
    if (p->early_termination && o->settings.traversal != TRIPTYCH_OUTWARD)
        return trip_option_fail("--early-termination", "requires --traversal outward");
    if (p->h && o->settings.method != TRIPTYCH_MERGE)
        return trip_option_fail("--h", "requires --method merge");
    status = check_integral(p);
    if (!status)
        status = check_footprint(p);
    if (!status)
        status = choose_renderer(p);
    if (!status)
        status = choose_classify(p);
    if (!status)
        status = check_classify(p);
    if (status)
        return status;
    if (p->target &&
        (o->renderer == TRIPTYCH_RENDERER_REFERENCE || o->renderer == TRIPTYCH_RENDERER_INTEGRAL))
        return trip_option_fail("--target", "requires --renderer gl or cpu");
    bool gl_only = p->lists || p->forms;
    if (gl_only && o->renderer != TRIPTYCH_RENDERER_AUTO && o->renderer != TRIPTYCH_RENDERER_GL)
        return trip_option_fail("--submit", "requires --renderer gl");
    if (gl_only)
        o->renderer = TRIPTYCH_RENDERER_GL;
    if (o->occluded && o->renderer != TRIPTYCH_RENDERER_AUTO &&
        o->renderer != TRIPTYCH_RENDERER_CPU)
        return trip_option_fail("--occluded", "requires --renderer cpu");
    if (o->occluded)
        o->renderer = TRIPTYCH_RENDERER_CPU;
    status = check_depth(o);
    if (status)
        return status;
    if (o->count && !o->stats && !o->explain)
        return trip_option_fail("--count", "requires --stats or --explain");
    const char *extension = strrchr(o->output, '.');
    if (!p->background && extension && !strcasecmp(extension, ".exr"))
        memset(o->settings.background, 0, sizeof o->settings.background);
    const bool coarse_splats = o->settings.classify == TRIPTYCH_PRE && have_levels(&o->settings);
    o->levels_for = quality_options_levels(&p->quality, coarse_splats);
    return 0;
}

/* Notes an option that sets a measured setting. The renderer is left out: --error selects settings
 * for a given renderer. */
static void note_measurable(int key, quality_options *q)
{
    static const int keys[] = { KEY_CLASSIFY,      KEY_COMPOSITING, KEY_SAMPLES_PER_SHEET,
                                KEY_LOD,           KEY_MAX_BYTES,   KEY_MAX_MS,
                                KEY_METHOD,        KEY_H,           KEY_EARLY_TERMINATION,
                                KEY_WEIGHTS,       KEY_NORMALISE,   KEY_TRAVERSAL,
                                KEY_KERNEL_RADIUS, KEY_LOW_PASS,    KEY_FLATTEN,
                                KEY_TARGET,        KEY_SUBMIT,      KEY_KERNEL,
                                KEY_FIELD,         KEY_TOLERANCE,   KEY_SAMPLES };
    bool measured = false;
    for (size_t i = 0; i < sizeof keys / sizeof *keys; i++)
        measured = measured || keys[i] == key;
    for (size_t row = 0; measured && row < sizeof options / sizeof *options; row++)
        if (options[row].key == key)
            q->measurable = options[row].name;
}

static error_t parse_key(int key, char *arg, struct argp_state *state)
{
    parse *p = state->input;
    switch (key) {
    case 'o':
        p->o->output = arg;
        return 0;
    case KEY_DEPTH:
        p->o->depth = arg;
        p->o->settings.depth = true;
        return 0;
    case KEY_STATS:
        p->o->stats = arg;
        return 0;
    case KEY_EXPLAIN:
        p->o->explain = true;
        return 0;
    case KEY_COUNT:
        p->o->count = true;
        return 0;
    case ARGP_KEY_ARG:
        return add_input(p->o, arg);
    case ARGP_KEY_END:
        return check(p);
    default:
        break;
    }
    note_measurable(key, &p->quality);
    int status = parse_volume(key, arg, &p->o->volume);
    if (status == ARGP_ERR_UNKNOWN)
        status = parse_view(key, arg, p);
    if (status == ARGP_ERR_UNKNOWN)
        status = parse_look(key, arg, p);
    if (status == ARGP_ERR_UNKNOWN)
        status = parse_method(key, arg, p);
    return status == ARGP_ERR_UNKNOWN ? parse_renderer(key, arg, p) : status;
}

int render_options_parse(render_options *o, int argc, char **argv)
{
    static const struct argp argp = {
        .options = options,
        .parser = parse_key,
        .args_doc = "VOLUME|NAME.trip [NAME.trip...]",
        .doc =
            "Draws a volume, or a data set made by `triptych brick`, into an image file. A volume "
            "is first bricked into a cache, so that its next picture starts at once; `triptych "
            "cache` lists and clears the cache. Several data sets are drawn in one picture if they "
            "are regions of one volume.\vPoints and lengths are in the world units of the data.",
    };
    const render_options defaults = { .width = 1024,
                                      .height = 1024,
                                      .settings = triptych_default_settings() };
    char *name = argv[0];
    *o = defaults;
    parse p = { .o = o };
    int status = trip_options_parse(&argp, argc, argv, &p);
    if (status || !quality_options_given(&p.quality))
        return status;
    /* Parse the options again over the selected settings, so that explicit options take precedence
     * in any order. */
    render_options chosen = defaults;
    chosen.renderer = o->renderer;
    chosen.settings.shading = o->settings.shading;
    status = quality_options_use(&p.quality, &(quality_drawn){ o->input, o->function.name },
                                 &chosen.settings, &chosen.renderer, true);
    if (status)
        return status;
    *o = chosen;
    memcpy(o->measured, p.quality.measured, sizeof o->measured);
    p = (parse){ .o = o, .again = true, .quality = p.quality };
    argv[0] = name;
    return trip_options_parse(&argp, argc, argv, &p);
}
