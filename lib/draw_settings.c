#include "draw_settings.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "geometry.h"
#include "report.h"
#include "text.h"

#define AT(member) .at = offsetof(draw_settings, member)

/* ---- light, effects, clipping, background ---- */

/* The words before the numbers of a light. */
static const char *prefix_of(triptych_light_kind kind)
{
    return kind == TRIPTYCH_LIGHT_POINT       ? "point:"
           : kind == TRIPTYCH_LIGHT_DIRECTION ? "world:"
                                              : "";
}

static int read_light(const trip_option *row, const char *text, void *base)
{
    static const triptych_light_kind kinds[] = { TRIPTYCH_LIGHT_POINT, TRIPTYCH_LIGHT_DIRECTION,
                                                 TRIPTYCH_LIGHT_VIEW };
    triptych_light *l = &((draw_settings *)base)->light;
    double v[3];
    int count, kind = 0;
    (void)row;
    if (!strcmp(text, "head")) {
        l->kind = TRIPTYCH_LIGHT_HEAD;
        return 0;
    }
    while (strncmp(text, prefix_of(kinds[kind]), strlen(prefix_of(kinds[kind]))) != 0)
        kind++; /* the last prefix is empty */
    int status =
        trip_option_numbers("--light", text + strlen(prefix_of(kinds[kind])), 3, 3, v, &count);
    if (!status && kind > 0 && !(v[0] != 0 || v[1] != 0 || v[2] != 0))
        return trip_option_fail("--light", "the direction is zero");
    l->kind = kinds[kind];
    for (int i = 0; i < 3 && !status; i++)
        l->toward[i] = v[i];
    return status;
}

static void print_numbers(const double *numbers, int count, char *text, size_t bytes)
{
    char part[32];
    size_t at = strlen(text);
    for (int i = 0; i < count && at < bytes; i++)
        at += (size_t)snprintf(text + at, bytes - at, "%s%s", i ? "," : "",
                               trip_text_from_double(numbers[i], part));
}

static void print_light(const void *base, char *text, size_t bytes)
{
    const triptych_light *l = &((const draw_settings *)base)->light;
    snprintf(text, bytes, "%s", l->kind < TRIPTYCH_LIGHT_DIRECTION ? "head" : prefix_of(l->kind));
    if (l->kind >= TRIPTYCH_LIGHT_DIRECTION)
        print_numbers(l->toward, 3, text, bytes);
}

static bool same_light(const void *a, const void *b)
{
    const triptych_light *k = &((const draw_settings *)a)->light;
    const triptych_light *l = &((const draw_settings *)b)->light;
    return k->kind < TRIPTYCH_LIGHT_DIRECTION || !memcmp(k->toward, l->toward, sizeof k->toward);
}

static const char *const effect_names[] = { "shadows",  "occlusion", "cueing", "auto",
                                            "emission", "edl",       "none",   NULL };

static int read_effects(const trip_option *row, const char *text, void *base)
{
    int effects = 0, count = 0;
    bool none = false;
    (void)row;
    for (const char *rest = text; rest; count++) {
        char name[16];
        const char *comma = strchr(rest, ',');
        const size_t length = comma ? (size_t)(comma - rest) : strlen(rest);
        int which;
        snprintf(name, sizeof name, "%.*s", (int)(length < sizeof name ? length : sizeof name - 1),
                 rest);
        int status = trip_option_choice("--effects", name, effect_names, &which);
        if (status)
            return status;
        none |= !strcmp(name, "none");
        effects |= none ? 0 : 1 << which;
        rest = comma ? comma + 1 : NULL;
    }
    if (none && count > 1)
        return trip_option_fail("--effects", "none cannot be joined with other effects");
    ((draw_settings *)base)->effects.which = effects;
    return 0;
}

static void print_effects(const void *base, char *text, size_t bytes)
{
    const int which = ((const draw_settings *)base)->effects.which;
    size_t at = 0;
    text[0] = 0;
    for (int i = 0; strcmp(effect_names[i], "none"); i++)
        if (which >> i & 1)
            at += (size_t)snprintf(text + at, bytes - at, "%s%s", at ? "," : "", effect_names[i]);
}

static int read_clip_box(const trip_option *row, const char *text, void *base)
{
    static const char voxels[] = "voxels:";
    triptych_clip *clip = &((draw_settings *)base)->clip;
    double corners[6];
    int count;
    (void)row;
    clip->box = 1;
    clip->box_of_voxels = !strncmp(text, voxels, strlen(voxels));
    int status = trip_option_numbers(
        "--clip-box", clip->box_of_voxels ? text + strlen(voxels) : text, 6, 6, corners, &count);
    for (int a = 0; a < 3 && !status; a++) {
        if (!(corners[a] < corners[3 + a]))
            return trip_option_fail(
                "--clip-box", "the second corner must be greater than the first along each axis");
        clip->box_lo[a] = corners[a];
        clip->box_hi[a] = corners[3 + a];
    }
    return status;
}

static void print_clip_box(const void *base, char *text, size_t bytes)
{
    const triptych_clip *c = &((const draw_settings *)base)->clip;
    double corners[6];
    memcpy(corners, c->box_lo, sizeof c->box_lo);
    memcpy(corners + 3, c->box_hi, sizeof c->box_hi);
    snprintf(text, bytes, "%s", c->box_of_voxels ? "voxels:" : "");
    print_numbers(corners, 6, text, bytes);
}

static bool same_clip_box(const void *a, const void *b)
{
    const triptych_clip *c = &((const draw_settings *)a)->clip;
    const triptych_clip *d = &((const draw_settings *)b)->clip;
    return !c->box || (c->box_of_voxels == d->box_of_voxels &&
                       !memcmp(c->box_lo, d->box_lo, sizeof c->box_lo) &&
                       !memcmp(c->box_hi, d->box_hi, sizeof c->box_hi));
}

static int read_clip_plane(const trip_option *row, const char *text, void *base)
{
    triptych_clip *clip = &((draw_settings *)base)->clip;
    const int max = (int)(sizeof clip->plane / sizeof *clip->plane);
    int count;
    (void)row;
    if (clip->planes == max)
        return trip_option_fail("--clip-plane", "given too often; at most 6 planes are possible");
    double *plane = clip->plane[clip->planes++];
    int status = trip_option_numbers("--clip-plane", text, 4, 4, plane, &count);
    if (!status && plane[0] == 0 && plane[1] == 0 && plane[2] == 0)
        return trip_option_fail("--clip-plane", "the direction A,B,C is zero");
    return status;
}

/* Writes the planes with " --clip-plane " between them. */
static void print_clip_planes(const void *base, char *text, size_t bytes)
{
    const triptych_clip *c = &((const draw_settings *)base)->clip;
    text[0] = 0;
    for (int i = 0; i < c->planes; i++) {
        const size_t at = strlen(text);
        snprintf(text + at, bytes - at, "%s", i ? " --clip-plane " : "");
        print_numbers(c->plane[i], 4, text, bytes);
    }
}

static bool same_clip_planes(const void *a, const void *b)
{
    const triptych_clip *c = &((const draw_settings *)a)->clip;
    const triptych_clip *d = &((const draw_settings *)b)->clip;
    return !memcmp(c->plane, d->plane, (size_t)c->planes * sizeof *c->plane);
}

/* The basic colours of CSS. */
static const struct {
    const char *name;
    unsigned rgb;
} colours[] = {
    { "black", 0 },          { "white", 0xffffff }, { "grey", 0x808080 },   { "gray", 0x808080 },
    { "silver", 0xc0c0c0 },  { "red", 0xff0000 },   { "green", 0x008000 },  { "blue", 0x0000ff },
    { "navy", 0x000080 },    { "teal", 0x008080 },  { "aqua", 0x00ffff },   { "lime", 0x00ff00 },
    { "yellow", 0xffff00 },  { "olive", 0x808000 }, { "maroon", 0x800000 }, { "purple", 0x800080 },
    { "fuchsia", 0xff00ff },
};

/* Parses "transparent", its older name "none", or a colour of CSS. Returns false for others. */
static bool read_colour_name(const char *text, double colour[4])
{
    if (!strcmp(text, "transparent") || !strcmp(text, "none")) {
        colour[3] = 0;
        return true;
    }
    for (size_t i = 0; i < sizeof colours / sizeof *colours; i++)
        if (!strcmp(text, colours[i].name)) {
            for (int c = 0; c < 3; c++)
                colour[c] = (colours[i].rgb >> (16 - 8 * c) & 255) / 255.0;
            return true;
        }
    return false;
}

/* Parses #RGB, #RGBA, #RRGGBB or #RRGGBBAA. */
static bool read_hex_colour(const char *text, double colour[4])
{
    static const char digits[] = "0123456789abcdef0123456789ABCDEF";
    const size_t length = strlen(text + 1);
    const size_t each = length > 4 ? 2 : 1;
    if ((length != 3 && length != 4 && length != 6 && length != 8) ||
        strspn(text + 1, digits) != length)
        return false;
    for (size_t i = 0; i < length; i += each) {
        const int high = (int)((strchr(digits, text[1 + i]) - digits) % 16);
        const int low = (int)((strchr(digits, text[each + i]) - digits) % 16);
        colour[i / each] = (16 * high + low) / 255.0;
    }
    return true;
}

static int fail_colour(const char *text)
{
    trip_text_nearest nearest = { .text = text };
    for (size_t i = 0; i < sizeof colours / sizeof *colours; i++)
        trip_text_nearest_try(&nearest, colours[i].name);
    trip_text_nearest_try(&nearest, "transparent");
    return trip_fail(TRIP_USAGE, "usage", "--background",
                     "\"%s\" is not a colour;%s%s%s use a name like white, '#RRGGBB', R,G,B[,A] "
                     "from 0 to 1, or transparent",
                     text, nearest.name ? " did you mean " : "", nearest.name ? nearest.name : "",
                     nearest.name ? "?" : "");
}

static int read_background(const trip_option *row, const char *text, void *base)
{
    draw_settings *s = base;
    double colour[4] = { 0, 0, 0, 1 };
    int count, status = 0;
    (void)row;
    if (*text && strspn(text, "+-.0123456789") == 0) {
        if (!(*text == '#' ? read_hex_colour(text, colour) : read_colour_name(text, colour)))
            return fail_colour(text);
    } else {
        status = trip_option_numbers("--background", text, 3, 4, colour, &count);
    }
    for (int i = 0; i < 4 && !status; i++)
        if (colour[i] < 0 || colour[i] > 1)
            return trip_option_fail("--background",
                                    "components must be between 0 and 1; for values up to 255 use "
                                    "'#RRGGBB'");
    memcpy(s->background, colour, sizeof colour);
    s->has_background = 1;
    return status;
}

static void print_background(const void *base, char *text, size_t bytes)
{
    text[0] = 0;
    print_numbers(((const draw_settings *)base)->background, 4, text, bytes);
}

static bool same_background(const void *a, const void *b)
{
    const draw_settings *s = a, *t = b;
    return !s->has_background || !memcmp(s->background, t->background, sizeof s->background);
}

/* ---- the table ---- */

static const char *const qualities[] = { "draft", "normal", "high", "exact", NULL };
static const char *const classifies[] = { "auto", "pre", "post", NULL };
static const char *const interpolations[] = { "linear", "cubic", "gaussian", "nearest", NULL };
static const char *const footprints[] = { "exact", "ewa", "fixed", NULL };
static const char *const shows[] = { "picture", "lists", "merge", "levels", NULL };
static const char *const fields[] = { "stored", "splats", NULL };
static const char *const compositings[] = { "splat", "sheet", NULL };
static const char *const low_passes[] = { "ewa", "uniform", "none", NULL };
static const char *const methods[] = { "merge", "clip", "axis", "image", NULL };
static const char *const lists[] = { "replicated", "indexed", "resident", NULL };
static const char *const primitives[] = { "sprites", "triangles", NULL };
static const char *const targets[] = { "rgba32f", "rgba16f", "rgba8", NULL };
static const char *const traversals[] = { "outward", "ascending", NULL };
static const char *const weights[] = { "pixel", "vertex", NULL };
static const char *const orders[] = { "depth", "lists", "sheets", "deferred", NULL };
static const char *const sides[] = { "both", "front", NULL };
static const char *const degrees[] = { "0", "1", "2", "3", NULL };

#define CHOICE(names) .type = TRIP_OPTION_CHOICE, .choices = (names), .first = 1

static const trip_option rows[DRAW_OPTIONS] = {
    [DRAW_BACKGROUND] = { "background", "COLOUR",
                          "Sets the colour behind the volume: a name such as white, '#RRGGBB', "
                          "R,G,B[,A] from 0 to 1, or transparent (.png, .tif and .exr only)",
                          "black; for .exr transparent",
                          .brief = "Sets the colour: white, '#RRGGBB', transparent, ...",
                          .group = DRAW_GROUP_PICTURE, .type = TRIP_OPTION_CUSTOM,
                          AT(has_background), .read = read_background, .print = print_background,
                          .same = same_background },
    [DRAW_LIGHT] = { "light", "LEFT,UP,FRONT|world:X,Y,Z|point:X,Y,Z|head",
                     "Sets the direction to the light as seen in the picture (1,1,1 is the upper "
                     "left front), or in the world; the position of the light; or a light at the "
                     "eye",
                     "head; with shadows 1,1,1",
                     .brief = "Sets the light (default: head, at the eye)",
                     .group = DRAW_GROUP_LIGHT, .type = TRIP_OPTION_CUSTOM, AT(light.kind),
                     .read = read_light, .print = print_light, .same = same_light },
    [DRAW_EFFECTS] = { "effects", "auto|none|LIST",
                       "Switches effects on: shadows (not with --light head), "
                       "occlusion, emission (requires --emission) and cueing, joined by commas; "
                       "edl for Gaussian scenes; occlusion and edl for clouds of points; "
                       "auto chooses by the kind of data",
                       "none", .brief = "Switches on shadows, occlusion, cueing, edl, ...",
                       .group = DRAW_GROUP_LIGHT, .type = TRIP_OPTION_CUSTOM, AT(effects.which),
                       .read = read_effects, .print = print_effects },
    [DRAW_ANISOTROPY] = { "anisotropy", "G",
                          "Sets how fog scatters light, from backwards to forwards", "0, equally",
                          "requires --effects shadows or auto", .group = DRAW_GROUP_LIGHT,
                          .type = TRIP_OPTION_NUMBER, AT(effects.anisotropy), .lo = -0.95,
                          .hi = 0.95 },
    [DRAW_CUEING] = { "cueing", "SHARE",
                      "Sets the share of the background in the colour of the farthest parts", "0.6",
                      "requires --effects cueing or auto", .group = DRAW_GROUP_LIGHT,
                      .type = TRIP_OPTION_ABOVE, AT(effects.cueing), .lo = 0, .hi = 1 },
    [DRAW_LIGHT_CELLS] = { "light-cells", "N",
                           "Sets the number of lattice cells for shadows, occlusion and emission "
                           "along the longest side",
                           "128", .group = DRAW_GROUP_LIGHT, .type = TRIP_OPTION_INTEGER,
                           AT(effects.light_cells), .lo = 8, .hi = 1024 },
    [DRAW_TEMPERATURE] = { "temperature", "LO:HI",
                           "Sets the temperatures in kelvin of heat 0 and of the greatest heat",
                           "0:2500", "requires --emission", .group = DRAW_GROUP_LIGHT,
                           .type = TRIP_OPTION_RANGE, AT(effects.kelvin), .lo = 0, .hi = 100000 },
    [DRAW_EDL_STRENGTH] = { "edl-strength", "S",
                            "Sets how much eye-dome lighting darkens pixels behind their "
                            "neighbours",
                            "0.4", "requires --effects edl or auto", .group = DRAW_GROUP_LIGHT,
                            .type = TRIP_OPTION_ABOVE, AT(effects.edl_strength), .lo = 0,
                            .hi = 100 },
    [DRAW_EDL_RADIUS] = { "edl-radius", "PX",
                          "Sets the distance of the neighbours for eye-dome lighting in pixels",
                          "1.4", "requires --effects edl or auto", .group = DRAW_GROUP_LIGHT,
                          .type = TRIP_OPTION_NUMBER, AT(effects.edl_radius_px), .lo = 1,
                          .hi = 64 },
    [DRAW_NO_SHADING] = { "no-shading", NULL,
                          "Draws the plain colours of the transfer function, and reads no normals",
                          .brief = "Draws the plain colours of the transfer function",
                          .group = DRAW_GROUP_LIGHT, .type = TRIP_OPTION_FLAG,
                          AT(light.no_shading) },
    [DRAW_CLIP_BOX] = { "clip-box", "X,Y,Z,X,Y,Z",
                        "Keeps only the inside of a box, from the first corner to the second, in "
                        "world units; voxels:I,J,K,I,J,K counts in voxels",
                        .brief = "Keeps only the inside of a box", .group = DRAW_GROUP_CLIP,
                        .type = TRIP_OPTION_CUSTOM, AT(clip.box), .read = read_clip_box,
                        .print = print_clip_box, .same = same_clip_box },
    [DRAW_CLIP_PLANE] = { "clip-plane", "A,B,C,D",
                          "Keeps only the points with A x + B y + C z + D >= 0, in world units; up "
                          "to 6 planes",
                          .brief = "Keeps only one side of a plane", .group = DRAW_GROUP_CLIP,
                          .type = TRIP_OPTION_CUSTOM, AT(clip.planes), .read = read_clip_plane,
                          .print = print_clip_planes, .same = same_clip_planes },
    [DRAW_QUALITY] = { "quality", "NAME",
                       "Selects how close the picture comes to the exact integral: draft, normal, "
                       "high or exact; closer takes longer",
                       "normal", .brief = "Selects draft, normal, high or exact",
                       .group = DRAW_GROUP_ACCURACY, AT(all.quality), CHOICE(qualities) },
    [DRAW_CLASSIFY] = { "classify", "pre|post|auto",
                        "Selects when values become colours. post interpolates values and "
                        "classifies them at each pixel, close to the integral. pre classifies "
                        "voxels and draws them as splats, as the papers do. auto is post, except "
                        "with options that only splats have",
                        "auto", .group = DRAW_GROUP_ACCURACY, .measured = true,
                        .type = TRIP_OPTION_CHOICE, .choices = classifies, AT(all.classify) },
    [DRAW_EARLY_TERMINATION] = { "early-termination", "T",
                                 "Stops a pixel once its transmittance is below T",
                                 "post 1/512, pre 1/8192",
                                 "no component is off by more than T; 0 never stops",
                                 .alias = "saturation", .group = DRAW_GROUP_ACCURACY,
                                 .measured = true, .type = TRIP_OPTION_PART,
                                 AT(all.early_termination), .lo = 0, .hi = 0.1 },
    [DRAW_FOOTPRINT] = { "kernel", "NAME", "Selects the footprints of splats: exact, ewa or fixed",
                         "exact", "pre only", .group = DRAW_GROUP_ACCURACY, .measured = true,
                         AT(splat.footprint), CHOICE(footprints) },
    [DRAW_INTERPOLATION] = { "interpolation", "NAME",
                             "Selects the interpolation of post and integral: nearest (for "
                             "labels), "
                             "linear, cubic or gaussian (post only)",
                             "nearest for labels, otherwise linear", .alias = "kernel",
                             .group = DRAW_GROUP_ACCURACY, .measured = true, AT(all.interpolation),
                             CHOICE(interpolations) },
    [DRAW_LOD] = { "lod", "PX|auto",
                   "Draws distant parts by coarse levels with voxels at most PX pixels wide",
                   "auto, as --quality needs; 1 for Gaussian scenes",
                   "0 draws the finest level only", .group = DRAW_GROUP_ACCURACY, .measured = true,
                   .type = TRIP_OPTION_AUTO_NUMBER, AT(lod.voxel_px), .lo = 0, .hi = 1000 },
    [DRAW_MAX_BYTES] = { "max-bytes", "SIZE",
                         "Draws coarser levels, so that at most SIZE of codes and normals is in "
                         "view, for example 64M",
                         .group = DRAW_GROUP_ACCURACY, .measured = true, .type = TRIP_OPTION_BYTES,
                         AT(lod.max_bytes) },
    [DRAW_MAX_MS] = { "max-ms", "MS",
                      "Draws coarser levels, so that a frame takes about MS milliseconds; the "
                      "picture then depends on the machine",
                      .group = DRAW_GROUP_ACCURACY, .measured = true, .type = TRIP_OPTION_NUMBER,
                      AT(lod.max_ms), .lo = 1e-3, .hi = 1e9 },
    [DRAW_SAMPLES] = { "samples", "N|auto", "Draws N x N rays per pixel, for antialiasing",
                       "auto, as --quality needs; with integral, the mean over the pixel's area",
                       .brief = "Draws N x N rays per pixel, for antialiasing",
                       .group = DRAW_GROUP_ACCURACY, .measured = true, .type = TRIP_OPTION_AUTO,
                       AT(all.samples), .lo = 1, .hi = 64 },
    [DRAW_SAMPLES_PER_SHEET] = { "samples-per-sheet", "N|auto",
                                 "Sets the samples per sheet of post; more come closer to the "
                                 "integral",
                                 "auto, as --quality needs", .alias = "slices",
                                 .group = DRAW_GROUP_ACCURACY, .measured = true,
                                 .type = TRIP_OPTION_AUTO, AT(sheet.samples), .lo = 1, .hi = 16 },
    [DRAW_DEPTH] = { "depth", "FILE",
                     "Writes the mean distance from the eye to the visible object at each pixel, "
                     "in world units: .exr or .tif",
                     NULL, "requires --samples 1; not with integral", .group = DRAW_GROUP_RESULTS,
                     .type = TRIP_OPTION_FLAG, AT(all.depth) },
    [DRAW_COUNT] = { "count", NULL,
                     "Draws every frame once more, untimed, and counts its splats exactly", NULL,
                     "requires --stats or --explain", .group = DRAW_GROUP_RESULTS,
                     .type = TRIP_OPTION_FLAG, AT(all.count_exactly) },
    [DRAW_SHOW] = { "show", "NAME",
                    "Selects the meaning of the colours: picture, lists (x red, y green, z blue), "
                    "merge (weights of the lists) or levels (of detail)",
                    "picture", .group = DRAW_GROUP_RESULTS, AT(all.show), CHOICE(shows) },
    [DRAW_FIELD] = { "field", "NAME", "Selects the integrand: stored values or splats", "stored",
                     .group = DRAW_GROUP_INTEGRAL, .measured = true, AT(integral.field),
                     CHOICE(fields) },
    [DRAW_TOLERANCE] = { "tolerance", "E", "Bounds the error of each component of a pixel",
                         "1e-3; with --samples 1e-4; for Gaussian scenes 5e-5",
                         .group = DRAW_GROUP_INTEGRAL, .measured = true, .type = TRIP_OPTION_NUMBER,
                         AT(integral.tolerance), .lo = 1e-12, .hi = 0.1 },
    [DRAW_COMPOSITING] = { "compositing", "splat|sheet",
                           "Selects the unit of compositing: each splat in list order, or the sum "
                           "of the splats of a sheet",
                           "splat", "pre only", .group = DRAW_GROUP_PAPERS, .measured = true,
                           AT(splat.compositing), CHOICE(compositings) },
    [DRAW_FLATTEN] = { "flatten", "S", "Flattens kernels along the gradient, up to S times",
                       "1, round", "requires --kernel ewa; not with --count",
                       .group = DRAW_GROUP_PAPERS, .measured = true, .type = TRIP_OPTION_NUMBER,
                       AT(splat.flatten), .lo = 1, .hi = 100 },
    [DRAW_H] = { "h", "H", "Sets where the lists of merge begin to blend", "post 0.99, pre 0.85",
                 .group = DRAW_GROUP_PAPERS, .measured = true, .type = TRIP_OPTION_BELOW, AT(all.h),
                 .lo = 0, .hi = 1 },
    [DRAW_KERNEL_RADIUS] = { "kernel-radius", "VOXELS", "Sets the radius of a splat", "2",
                             "pre, and integral with --field splats", .group = DRAW_GROUP_PAPERS,
                             .measured = true, .type = TRIP_OPTION_NUMBER, AT(splat.kernel_radius),
                             .lo = 0.1, .hi = 100 },
    [DRAW_LOW_PASS] = { "low-pass", "NAME",
                        "Selects the filter for splats smaller than a pixel: ewa, uniform "
                        "(requires --renderer reference --kernel ewa) or none",
                        "ewa", "pre only", .group = DRAW_GROUP_PAPERS, .measured = true,
                        AT(splat.low_pass), CHOICE(low_passes) },
    [DRAW_LOW_PASS_WIDTH] = { "low-pass-width", "PX",
                              "Sets the standard deviation of the low-pass filter in pixels; 0 "
                              "draws plain splats, 1 is the width of the EWA paper",
                              "0.4", "pre only, without --low-pass none",
                              .group = DRAW_GROUP_PAPERS, .measured = true,
                              .type = TRIP_OPTION_PART, AT(splat.low_pass_px), .lo = 0, .hi = 16 },
    [DRAW_METHOD] = { "method", "NAME",
                      "Selects how lists become a picture: merge, clip, axis, or image, which "
                      "implies --renderer reference and pre",
                      "merge", .group = DRAW_GROUP_PAPERS, .measured = true, AT(all.method),
                      CHOICE(methods) },
    [DRAW_NORMALISE] = { "normalise", NULL,
                         "Divides colours by the accumulated opacity: every covered pixel becomes "
                         "opaque",
                         .group = DRAW_GROUP_PAPERS, .measured = true, .type = TRIP_OPTION_FLAG,
                         AT(all.normalise) },
    [DRAW_LISTS] = { "submit", "FORM",
                     "Selects how gl receives splats: replicated, indexed or resident lists, "
                     "sprites or triangles, or one of each",
                     "replicated,sprites", "pre and gl only", .group = DRAW_GROUP_PAPERS,
                     .measured = true, AT(splat.lists), CHOICE(lists) },
    [DRAW_PRIMITIVES] = { "submit", .group = DRAW_GROUP_PAPERS, .measured = true,
                          AT(splat.primitives), CHOICE(primitives) },
    [DRAW_TARGET] = { "target", "NAME",
                      "Selects the pixel format of layers: rgba32f, rgba16f or rgba8", "rgba32f",
                      "pre with gl or cpu only", .group = DRAW_GROUP_PAPERS, .measured = true,
                      AT(splat.target), CHOICE(targets) },
    [DRAW_TRAVERSAL] = { "traversal", "NAME",
                         "Selects the order of sheets: outward from the eye, or ascending as in "
                         "the file (pre only)",
                         "outward", .group = DRAW_GROUP_PAPERS, .measured = true, AT(all.traversal),
                         CHOICE(traversals) },
    [DRAW_WEIGHTS] = { "weights", "pixel|vertex",
                       "Selects the weights of merge: of the ray of each pixel, or interpolated "
                       "from the corners of splats, which implies --renderer reference",
                       "pixel", "pre only", .group = DRAW_GROUP_PAPERS, .measured = true,
                       AT(splat.weights), CHOICE(weights) },
    [DRAW_ORDER] = { "order", "NAME",
                     "Selects the order of the Gaussians of a scene: depth (of their centres), "
                     "lists, or sheets, in which they overlap; or deferred, the default of "
                     "clouds of points: only the nearest surfels are drawn",
                     "depth", "Gaussian scenes only", .group = DRAW_GROUP_ACCURACY,
                     .measured = true, AT(scene.order), CHOICE(orders) },
    [DRAW_SHEET] = { "sheet", "LENGTH",
                     "Sets the thickness of the sheets in units of the scene; thinner ones come "
                     "closer to the integral and take longer",
                     "a 1024th of the scene's radius", "requires --order sheets",
                     .group = DRAW_GROUP_ACCURACY, .measured = true, .type = TRIP_OPTION_NUMBER,
                     AT(scene.sheet), .lo = 1e-12, .hi = 1e12 },
    [DRAW_HARMONICS] = { "sh", "DEGREE",
                         "Reads spherical harmonics up to this degree: 0, 1, 2 or 3",
                         "all of the scene", "Gaussian scenes only", .group = DRAW_GROUP_ACCURACY,
                         .measured = true, AT(scene.harmonics), CHOICE(degrees) },
    [DRAW_SIDES] = { "sides", "both|front",
                     "Draws the surfels of a cloud from both sides, or from the front alone: the "
                     "side of their normals. Backs are then invisible, and bricks of backs are not "
                     "read",
                     "both", "clouds of points with --order deferred only",
                     .brief = "Draws both sides of surfels, or the front alone",
                     .group = DRAW_GROUP_ACCURACY, .measured = true, AT(scene.sides),
                     CHOICE(sides) },
};

const trip_option_table draw_settings_table = { rows, DRAW_OPTIONS };

/* ---- conversions ---- */

triptych_settings draw_settings_public(const draw_settings *s)
{
    triptych_settings out = s->all;
    out.background = s->has_background ? s->background : NULL;
    out.splat = &s->splat;
    out.sheet = &s->sheet;
    out.scene = &s->scene;
    out.integral = &s->integral;
    out.lod = &s->lod;
    out.light = &s->light;
    out.effects = &s->effects;
    out.clip = &s->clip;
    return out;
}

draw_settings draw_settings_of(const triptych_settings *s)
{
    draw_settings out = { 0 };
    if (!s)
        return out;
    out.all = *s;
    out.all.background = NULL;
    out.has_background = s->background != NULL;
    if (s->background)
        memcpy(out.background, s->background, sizeof out.background);
#define TAKE(group)                                                                                \
    if (s->group)                                                                                  \
        out.group = *s->group;                                                                     \
    out.all.group = NULL
    TAKE(splat);
    TAKE(sheet);
    TAKE(scene);
    TAKE(integral);
    TAKE(lod);
    TAKE(light);
    TAKE(effects);
    TAKE(clip);
#undef TAKE
    return out;
}

int draw_settings_use(triptych *t, const draw_settings *s)
{
    const triptych_settings settings = draw_settings_public(s);
    return triptych_set_settings(t, &settings);
}

bool draw_settings_same(const draw_settings *a, const draw_settings *b)
{
    for (int i = 0; i < DRAW_OPTIONS; i++)
        if (!trip_option_same(&rows[i], a, b))
            return false;
    return true;
}

char *draw_settings_text(const draw_settings *s)
{
    char *text = NULL, value[TRIP_OPTION_TEXT_BYTES];
    size_t bytes;
    FILE *out = open_memstream(&text, &bytes);
    if (!out)
        return NULL;
    for (int i = 0; i < DRAW_OPTIONS; i++)
        if (trip_option_is_set(&rows[i], s)) {
            trip_option_print(&rows[i], s, value);
            fprintf(out, " --%s%s%s", rows[i].name, value[0] ? " " : "", value);
        }
    if (fclose(out) == 0)
        return text;
    free(text);
    return NULL;
}

double draw_settings_promise(triptych_quality quality)
{
    return quality == TRIPTYCH_QUALITY_DRAFT   ? 4
           : quality == TRIPTYCH_QUALITY_HIGH  ? 0.3
           : quality == TRIPTYCH_QUALITY_EXACT ? 0
                                               : 1;
}

const char *draw_settings_choice(const draw_settings *s, int row)
{
    const int value = *(const int *)((const char *)s + rows[row].at) - rows[row].first;
    return rows[row].choices[value > 0 ? value : 0];
}

void draw_settings_unset(draw_settings *s, int row)
{
    const draw_settings unset = { 0 };
    trip_option_copy(&rows[row], s, &unset);
}

const double *draw_settings_background(const draw_settings *s)
{
    static const double black[4] = { 0, 0, 0, 1 };
    return s->has_background ? s->background : black;
}

/* Returns whether the option takes an argument, or -1 for an unknown name. */
static int takes_argument(const char *name)
{
    for (int i = 0; i < DRAW_OPTIONS; i++)
        if (!strcmp(rows[i].name, name))
            return rows[i].type != TRIP_OPTION_FLAG;
    return -1;
}

int draw_settings_read_text(draw_settings *s, const char *text)
{
    char *copy = strdup(text), *rest = copy;
    uint64_t given = 0;
    int status = copy ? 0 : trip_fail(TRIP_ERROR, "usage", "settings", "out of memory");
    for (char *word; !status && (word = strtok_r(rest, " ", &rest));) {
        const bool is_option = !strncmp(word, "--", 2);
        const int takes = is_option ? takes_argument(word + 2) : -1;
        const char *value = takes > 0 ? strtok_r(rest, " ", &rest) : "";
        if (takes < 0 || !value)
            status = trip_option_fail(word, takes < 0 ? "unknown option" : "takes an argument");
        else
            status = trip_option_read(&draw_settings_table, word + 2, value, s, &given);
    }
    free(copy);
    return status;
}
