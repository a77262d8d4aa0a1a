/* The appearance of a picture: transfer function and settings (triptych.h). */
#include "library_context.h"
#include "report.h"
#include "splat.h"

#define DEFAULT_CUEING 0.6

int trip_context_use_transfer_function(triptych *t, const triptych_transfer_function *f)
{
    bool missing = false;
    const session_look look = { .tf = f->name,
                                .tf_text = f->text,
                                .opacity_scale = f->opacity_scale,
                                .window = f->window,
                                .level = f->level,
                                .missing = f->all_values ? &missing : NULL };
    int status = session_use_function(&t->session, &look);
    t->rounding_checked = false;
    t->has_function |= !status && !missing;
    if (missing)
        snprintf(t->error, sizeof t->error,
                 "triptych: render: %s: lacks values that the transfer "
                 "function shows",
                 t->name);
    return missing ? TRIPTYCH_LEFT_OUT : status;
}

/* A larger scale could make extinctions infinite. */
#define OPACITY_SCALE_MAX 1e6

static int check_function(const triptych_transfer_function *f)
{
    bool finite = isfinite(f->window) && isfinite(f->level);
    if (f->name && f->text)
        return trip_fail(TRIP_USAGE, "render", "function", "give a name or a text, not both");
    if (!(f->opacity_scale >= 0 && f->opacity_scale <= OPACITY_SCALE_MAX))
        return trip_fail(TRIP_USAGE, "render", "function", "the opacity scale must be 0 to %g",
                         OPACITY_SCALE_MAX);
    return finite && f->window >= 0
               ? 0
               : trip_fail(TRIP_USAGE, "render", "function",
                           "the window must be finite and at least 0, and its level finite");
}

/* A Gaussian scene has colours of its own. */
static int use_scene_function(triptych *t, const triptych_transfer_function *f)
{
    if (f->name || f->text || f->window > 0)
        return trip_fail(
            TRIP_USAGE, "render", t->name,
            "is a Gaussian scene with colours of its own; leave out --tf and --window");
    t->scene_opacity = f->opacity_scale;
    return 0;
}

int triptych_set_transfer_function(triptych *t, const triptych_transfer_function *function)
{
    trip_scope *before = trip_context_enter_anew(t);
    const triptych_transfer_function defaults = { 0 };
    const triptych_transfer_function *f = function ? function : &defaults;
    int status = trip_context_check_idle(t, true);
    if (!status)
        status = check_function(f);
    if (!status && t->mixed)
        status = trip_context_use_mixed_function(t, f);
    else if (!status && t->scene)
        status = use_scene_function(t, f);
    else if (!status)
        status = trip_context_use_transfer_function(t, f);
    return trip_context_leave(before, status);
}

/* ---- settings ---- */

static double number_or(double given, double standard)
{
    return given == 0 ? standard : given == TRIPTYCH_ZERO ? 0 : given;
}

/* The number of samples per sheet, unless another one is chosen; 0 lets the view select. */
static int samples_per_sheet(const draw_settings *s)
{
    const int of_quality = s->all.quality == TRIPTYCH_QUALITY_DRAFT   ? 1
                           : s->all.quality == TRIPTYCH_QUALITY_HIGH  ? 8
                           : s->all.quality == TRIPTYCH_QUALITY_EXACT ? 16
                                                                      : 0;
    return s->sheet.samples > 0 ? s->sheet.samples : of_quality;
}

static void set_light(trip_settings *out, const triptych_light *light)
{
    const trip_vec3 toward = trip_v3(light->toward[0], light->toward[1], light->toward[2]);
    out->shading = !light->no_shading;
    out->headlight = light->kind < TRIPTYCH_LIGHT_DIRECTION;
    out->point_light = light->kind == TRIPTYCH_LIGHT_POINT;
    if (out->point_light)
        out->light_position = toward;
    else if (!out->headlight) /* the view turns TRIPTYCH_LIGHT_VIEW for each frame */
        out->light_direction = trip_normalize(toward);
}

/* A choice of the renderers: the library's value without the default. */
#define CHOSEN(type, value) ((type)((value) ? (int)(value)-1 : 0))

trip_settings trip_settings_of(const draw_settings *s)
{
    static const double black[4] = { 0, 0, 0, 1 };
    const double *background = s->has_background ? s->background : black;
    const triptych_splat_settings *splat = &s->splat;
    const bool exact = s->all.quality == TRIPTYCH_QUALITY_EXACT;
    trip_settings out = trip_settings_default();
    out.classify =
        draw_settings_classify(s) == TRIPTYCH_CLASSIFY_PRE ? TRIP_CLASSIFY_PRE : TRIP_CLASSIFY_POST;
    out.compositing = CHOSEN(trip_compositing, splat->compositing);
    out.footprint = CHOSEN(trip_footprint, splat->footprint);
    out.low_pass = CHOSEN(trip_low_pass, splat->low_pass);
    out.low_pass_px = number_or(splat->low_pass_px, out.low_pass_px);
    out.flatten = number_or(splat->flatten, out.flatten);
    out.vertex_weights = splat->weights == TRIPTYCH_WEIGHTS_VERTEX;
    out.samples_per_sheet = samples_per_sheet(s);
    out.method = CHOSEN(trip_method, s->all.method);
    out.traversal = CHOSEN(trip_traversal, s->all.traversal);
    out.target = CHOSEN(trip_target, splat->target);
    out.indexed = splat->lists == TRIPTYCH_SUBMIT_INDEXED;
    out.resident = splat->lists == TRIPTYCH_SUBMIT_RESIDENT;
    out.triangles = splat->primitives == TRIPTYCH_SUBMIT_TRIANGLES;
    out.depth = s->all.depth;
    out.h = number_or(s->all.h, TRIP_H_AUTO);
    out.early_termination = number_or(
        s->all.early_termination, exact ? TRIP_EARLY_TERMINATION_PRE : TRIP_EARLY_TERMINATION_AUTO);
    out.kernel_radius = number_or(splat->kernel_radius, out.kernel_radius);
    for (int i = 0; i < 4; i++)
        out.background[i] = background[i];
    out.lod_px = fmax(s->lod.voxel_px, 0);
    out.max_bytes = s->lod.max_bytes;
    out.field = CHOSEN(trip_field_kind, s->integral.field);
    out.kernel = CHOSEN(trip_kernel, s->all.interpolation);
    out.tolerance = number_or(s->integral.tolerance, out.tolerance);
    out.samples = s->all.samples > 0 ? s->all.samples : 1;
    out.show = CHOSEN(trip_show, s->all.show);
    out.effects = (trip_effects){
        .cueing = number_or(s->effects.cueing, DEFAULT_CUEING),
        .anisotropy = s->effects.anisotropy,
        .cells = s->effects.light_cells ? s->effects.light_cells : TRIP_LIGHT_CELLS,
    };
    set_light(&out, &s->light);
    return out;
}

/* Splats with a smaller radius leave a visible pattern. */
#define SMOOTH_KERNEL_VOXELS 1.5

static void warn_of_ripple(double kernel_radius)
{
    trip_splat_ripple own = trip_splat_ripple_of(kernel_radius);
    trip_splat_ripple defaults = trip_splat_ripple_of(TRIP_KERNEL_RADIUS_VOXELS);
    trip_warn("render",
              "a kernel radius of %g leaves a visible pattern of voxels: the extinction of "
              "constant fog is off by %+.0f %% through voxels and %+.0f %% between them; a radius "
              "of %g gives %+.1f and %+.1f",
              kernel_radius, 100 * (own.through - 1), 100 * (own.between - 1),
              TRIP_KERNEL_RADIUS_VOXELS, 100 * (defaults.through - 1),
              100 * (defaults.between - 1));
}

static void use_settings(triptych *t, const draw_settings *s)
{
    const trip_settings next = trip_settings_of(s);
    const bool has_heat = s->effects.kelvin[1] > 0;
    if (next.kernel_radius < SMOOTH_KERNEL_VOXELS &&
        next.kernel_radius != t->settings.kernel_radius)
        warn_of_ripple(next.kernel_radius);
    t->rounding_checked &=
        next.target == t->settings.target && next.compositing == t->settings.compositing;
    t->kernel_warned &= next.kernel == t->settings.kernel;
    /* The memory of earlier frames may be needed for the light map. */
    if ((s->effects.which ^ t->given.effects.which) & ~TRIPTYCH_EFFECT_EDL ||
        next.effects.cells != t->settings.effects.cells)
        trip_context_drop_renderer(t);
    t->given = *s;
    t->kelvin[0] = s->effects.kelvin[0];
    t->kelvin[1] = has_heat ? s->effects.kelvin[1] : TRIP_HOTTEST_KELVIN;
    t->settings = next;
}

int triptych_set_settings(triptych *t, const triptych_settings *settings)
{
    trip_scope *before = trip_context_enter_anew(t);
    const draw_settings given = draw_settings_of(settings);
    int status = trip_context_check_idle(t, false);
    if (!status)
        status = draw_settings_check_ranges(&given);
    if (!status)
        use_settings(t, &given);
    return trip_context_leave(before, status);
}

int triptych_check_settings(triptych *t, const triptych_settings *settings,
                            triptych_renderer *renderer)
{
    trip_scope *before = trip_context_enter_anew(t);
    const draw_settings given = draw_settings_of(settings);
    return trip_context_leave(before, draw_settings_check(&given, renderer, true));
}

/* ---- clipping ---- */

typedef struct positions {
    double at[3];
} positions;

/* Converts indices to positions. Infinite bounds stay infinite. */
static positions positions_of(const triptych *t, const double voxels[3])
{
    positions out;
    for (int a = 0; a < 3; a++)
        out.at[a] = isfinite(voxels[a])
                        ? trip_coordinates_position(&t->session.data->coordinates, a, voxels[a])
                        : voxels[a];
    return out;
}

trip_clip trip_context_clip(const triptych *t)
{
    const triptych_clip *c = &t->given.clip;
    trip_affine to_box = trip_affine_identity();
    trip_clip clip = t->cut;
    if (c->box && c->box_of_voxels) /* the map was checked on opening */
        trip_affine_invert(&t->session.data->index_to_world, &to_box);
    if (c->box && c->box_of_voxels)
        trip_clip_add_box(&clip, positions_of(t, c->box_lo).at, positions_of(t, c->box_hi).at,
                          &to_box);
    else if (c->box)
        trip_clip_add_box(&clip, c->box_lo, c->box_hi, &to_box);
    for (int i = 0; i < c->planes; i++)
        trip_clip_add(&clip, trip_v3(c->plane[i][0], c->plane[i][1], c->plane[i][2]),
                      c->plane[i][3]);
    return clip;
}
