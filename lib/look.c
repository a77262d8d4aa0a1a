/* The appearance of a picture: transfer function and settings (triptych.h). */
#include "library_context.h"
#include "report.h"
#include "splat.h"

int trip_context_use_transfer_function(triptych *t, const triptych_transfer_function *f)
{
    bool missing = false;
    const session_look look = { .tf = f->name,
                                .tf_text = f->text,
                                .opacity_scale = f->opacity_scale,
                                .window = f->window,
                                .level = f->level,
                                .missing = f->left_out ? &missing : NULL };
    int status = session_use_function(&t->session, &look);
    if (f->left_out)
        *f->left_out = missing;
    t->rounding_checked = false;
    t->has_function |= !status && !missing;
    return status;
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

int triptych_set_transfer_function(triptych *t, const triptych_transfer_function *function)
{
    trip_scope *before = trip_context_enter_anew(t);
    const triptych_transfer_function defaults = { 0 };
    const triptych_transfer_function *f = function ? function : &defaults;
    int status = trip_context_check_idle(t, true);
    if (!status)
        status = check_function(f);
    return trip_context_leave(before, status ? status : trip_context_use_transfer_function(t, f));
}

triptych_settings triptych_default_settings(void)
{
    const trip_settings s = trip_settings_default();
    return (triptych_settings){
        .classify = TRIPTYCH_CLASSIFY_AUTO,
        .compositing = (triptych_compositing)s.compositing,
        .footprint = (triptych_footprint)s.footprint,
        .low_pass = (triptych_low_pass)s.low_pass,
        .flatten = s.flatten,
        .method = (triptych_method)s.method,
        .traversal = (triptych_traversal)s.traversal,
        .target = (triptych_target)s.target,
        .shading = s.shading,
        .headlight = s.headlight,
        .light = { s.light_direction.x, s.light_direction.y, s.light_direction.z },
        .h = s.h,
        .early_termination = s.early_termination,
        .kernel_radius = s.kernel_radius,
        .background = { s.background[0], s.background[1], s.background[2], s.background[3] },
        .lod_px = s.lod_px,
        .field = (triptych_field)s.field,
        .kernel = (triptych_kernel)s.kernel,
        .tolerance = s.tolerance,
        .samples = s.samples,
        .anisotropy = s.effects.anisotropy,
        .cueing = 0.6,
        .kelvin = { 0, 2500 },
        .light_cells = s.effects.cells,
    };
}

int triptych_set_quality(triptych_settings *s, triptych_quality quality)
{
    const triptych_settings defaults = triptych_default_settings();
    if (quality < TRIPTYCH_DRAFT || quality > TRIPTYCH_EXACT)
        return TRIPTYCH_USAGE;
    s->classify = quality == TRIPTYCH_NORMAL ? defaults.classify : TRIPTYCH_POST;
    s->compositing = defaults.compositing;
    s->footprint = defaults.footprint;
    s->low_pass = defaults.low_pass;
    s->flatten = defaults.flatten;
    s->vertex_weights = defaults.vertex_weights;
    s->samples_per_sheet = quality == TRIPTYCH_DRAFT ? 1 : quality == TRIPTYCH_HIGH ? 8 : 0;
    s->samples_per_sheet = quality == TRIPTYCH_EXACT ? 16 : s->samples_per_sheet;
    s->method = defaults.method;
    s->h = defaults.h;
    s->early_termination =
        quality == TRIPTYCH_EXACT ? TRIP_EARLY_TERMINATION_PRE : defaults.early_termination;
    s->target = defaults.target;
    s->kernel_radius = defaults.kernel_radius;
    s->lod_px = defaults.lod_px;
    s->max_bytes = s->max_ms = 0;
    s->samples = defaults.samples;
    return TRIPTYCH_OK;
}

static const char *fault_of_integral(const triptych_settings *s)
{
    if (s->field < TRIPTYCH_VALUES || s->field > TRIPTYCH_SPLATS || s->kernel < TRIPTYCH_LINEAR ||
        s->kernel > TRIPTYCH_GAUSSIAN)
        return "unknown field or kernel";
    if (!(s->tolerance >= 1e-12 && s->tolerance <= 0.1))
        return "the tolerance must be 1e-12 to 0.1";
    if (!(s->samples >= 1 && s->samples <= 64))
        return "the samples along each side of a pixel must be 1 to 64";
    return NULL;
}

static const char *fault_of_splats(const triptych_settings *s)
{
    if (s->compositing < TRIPTYCH_BY_SPLAT || s->compositing > TRIPTYCH_BY_SHEET)
        return "unknown compositing";
    if (s->footprint < TRIPTYCH_FOOTPRINT_EXACT || s->footprint > TRIPTYCH_FOOTPRINT_FIXED ||
        s->low_pass < TRIPTYCH_LOW_PASS_EWA || s->low_pass > TRIPTYCH_LOW_PASS_NONE)
        return "unknown footprint or low-pass filter";
    if (!(s->kernel_radius >= 0.1 && s->kernel_radius <= 100))
        return "the kernel radius must be 0.1 to 100 voxels";
    if (!(s->flatten >= 1 && s->flatten <= 100))
        return "the flattening of kernels must be 1 to 100";
    return s->flatten > 1 && s->count ? "count requires round kernels; set the flattening to 1"
                                      : NULL;
}

static bool is_a_box(const double lo[3], const double hi[3])
{
    for (int a = 0; a < 3; a++)
        if (!(lo[a] < hi[a]))
            return false;
    return true;
}

static const char *fault_of_clip(const triptych_clip *c)
{
    if (c->box && !is_a_box(c->box_lo, c->box_hi))
        return "the clipping box has its minimum not below its maximum";
    if (!(c->planes >= 0 && c->planes <= TRIP_CLIP_GIVEN_PLANES))
        return "the number of clipping planes must be 0 to 6";
    for (int i = 0; i < c->planes; i++) {
        const double *p = c->plane[i];
        double length = trip_length(trip_v3(p[0], p[1], p[2]));
        if (!(length > 0 && isfinite(length) && isfinite(p[3])))
            return "the normal of a clipping plane is zero or not finite";
    }
    return NULL;
}

static const char *fault_of_effects(const triptych_settings *s)
{
    const int all = TRIPTYCH_SHADOWS | TRIPTYCH_OCCLUSION | TRIPTYCH_CUEING |
                    TRIPTYCH_EFFECTS_AUTO | TRIPTYCH_EMISSION;
    if (s->effects & ~all)
        return "unknown effect";
    if (s->effects & TRIPTYCH_SHADOWS && s->headlight)
        return "light from the eye casts no visible shadows; give the light a direction or "
               "position";
    if (!(s->anisotropy >= -0.95 && s->anisotropy <= 0.95))
        return "the anisotropy must be -0.95 to 0.95";
    if (s->effects & TRIPTYCH_CUEING && !(s->cueing > 0 && s->cueing <= 1))
        return "depth cueing must be above 0 and at most 1";
    if (!(s->kelvin[0] >= 0 && s->kelvin[0] < s->kelvin[1] && s->kelvin[1] <= 100000))
        return "the temperatures of emission must be 0 to 100000 K in ascending order";
    if (s->effects && !(s->light_cells >= 8 && s->light_cells <= TRIP_LIGHT_CELLS_MAX))
        return "the light lattice must have 8 to 1024 cells";
    return NULL;
}

static const char *fault_of_settings(const triptych_settings *s)
{
    trip_vec3 light = trip_v3(s->light[0], s->light[1], s->light[2]);
    double length = trip_length(light);
    if (s->method < TRIPTYCH_MERGE || s->method > TRIPTYCH_IMAGE ||
        s->traversal < TRIPTYCH_OUTWARD || s->traversal > TRIPTYCH_ASCENDING ||
        s->target < TRIPTYCH_RGBA32F || s->target > TRIPTYCH_RGBA8)
        return "unknown method, traversal or target";
    if (s->classify < TRIPTYCH_PRE || s->classify > TRIPTYCH_CLASSIFY_AUTO)
        return "unknown classification";
    if (!(s->samples_per_sheet >= 0 && s->samples_per_sheet <= TRIP_SHEET_SAMPLES_MAX))
        return "the samples per sheet must be 1 to 16, or 0 to let the view decide";
    if (s->depth && s->target != TRIPTYCH_RGBA32F)
        return "depth requires the target rgba32f";
    if (!(s->h >= 0 && s->h < 1) && s->h != TRIPTYCH_H_AUTO)
        return "h must be 0 to below 1, or -1 to let the classification decide";
    if (!(s->early_termination >= 0 && s->early_termination <= TRIP_EARLY_TERMINATION_MAX) &&
        s->early_termination != TRIPTYCH_EARLY_TERMINATION_AUTO)
        return "early termination must be 0 to 0.1, or -1 to let the classification decide";
    if ((s->shading || s->effects) && !s->headlight && !isfinite(length))
        return "the light is too far away or not finite";
    if ((s->shading || s->effects) && !s->headlight && !s->point_light && !(length > 0))
        return "the direction to the light is zero";
    for (int i = 0; i < 4; i++)
        if (!(s->background[i] >= 0 && s->background[i] <= 1))
            return "the components of the background must be 0 to 1";
    if (!(s->lod_px >= 0 && s->lod_px <= 1000))
        return "the voxel width that selects levels must be 0 to 1000 pixels";
    if (!(s->max_bytes >= 0 && s->max_bytes <= 1e18 && s->max_ms >= 0 && s->max_ms <= 1e9))
        return "the bound of bytes must be 0 (none) to 1e18, the bound of milliseconds 0 (none) to "
               "1e9";
    if (s->show < TRIPTYCH_SHOW_PICTURE || s->show > TRIPTYCH_SHOW_LEVELS)
        return "unknown value to show";
    const char *fault = fault_of_splats(s);
    fault = fault ? fault : fault_of_clip(&s->clip);
    fault = fault ? fault : fault_of_effects(s);
    return fault ? fault : fault_of_integral(s);
}

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
    const triptych_clip *c = &t->clip;
    trip_affine to_box = trip_affine_identity();
    trip_clip clip = { 0 };
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

static void set_light(trip_settings *out, const triptych_settings *s)
{
    const trip_vec3 light = trip_v3(s->light[0], s->light[1], s->light[2]);
    out->headlight = s->headlight;
    out->point_light = s->point_light && !s->headlight;
    if (out->point_light)
        out->light_position = light;
    else if (!s->headlight)
        out->light_direction = trip_normalize(light);
}

int triptych_set_settings(triptych *t, const triptych_settings *s)
{
    trip_scope *before = trip_context_enter_anew(t);
    const char *fault = fault_of_settings(s);
    int status = trip_context_check_idle(t, false);
    if (!status && fault)
        status = trip_fail(TRIP_USAGE, "render", "settings", "%s", fault);
    if (status)
        return trip_context_leave(before, status);
    if (s->kernel_radius < SMOOTH_KERNEL_VOXELS && s->kernel_radius != t->settings.kernel_radius)
        warn_of_ripple(s->kernel_radius);
    t->rounding_checked &= (trip_target)s->target == t->settings.target &&
                           (trip_compositing)s->compositing == t->settings.compositing;
    t->kernel_warned &= (trip_kernel)s->kernel == t->settings.kernel;
    /* The memory of earlier frames may be needed for the light map. */
    if (s->effects != t->effects || s->light_cells != t->settings.effects.cells)
        trip_context_drop_renderer(t);
    t->effects = s->effects;
    for (int i = 0; i < 2; i++)
        t->kelvin[i] = s->kelvin[i];
    t->classify_auto = s->classify == TRIPTYCH_CLASSIFY_AUTO;
    t->settings = (trip_settings){
        .classify = s->classify == TRIPTYCH_PRE ? TRIP_CLASSIFY_PRE : TRIP_CLASSIFY_POST,
        .compositing = (trip_compositing)s->compositing,
        .footprint = (trip_footprint)s->footprint,
        .low_pass = (trip_low_pass)s->low_pass,
        .flatten = s->flatten,
        .vertex_weights = s->vertex_weights,
        .samples_per_sheet = s->samples_per_sheet,
        .method = (trip_method)s->method,
        .traversal = (trip_traversal)s->traversal,
        .target = (trip_target)s->target,
        .indexed = s->indexed,
        .triangles = s->triangles,
        .depth = s->depth,
        .shading = s->shading,
        .h = s->h,
        .early_termination = s->early_termination,
        .kernel_radius = s->kernel_radius,
        .background = { s->background[0], s->background[1], s->background[2], s->background[3] },
        .lod_px = s->lod_px,
        .max_bytes = s->max_bytes,
        .field = (trip_field_kind)s->field,
        .kernel = (trip_kernel)s->kernel,
        .tolerance = s->tolerance,
        .samples = s->samples,
        .show = (trip_show)s->show,
        .effects = { .cueing = s->cueing, .anisotropy = s->anisotropy, .cells = s->light_cells },
    };
    t->max_ms = s->max_ms;
    t->clip = s->clip;
    t->counting = s->count;
    t->normalise = s->normalise;
    set_light(&t->settings, s);
    return trip_context_leave(before, 0);
}
