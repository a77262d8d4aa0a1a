/* What is drawn: the transfer function, the settings and the view of triptych.h. */
#include "library_context.h"
#include "report.h"
#include "splat.h"
#include "library_view.h"

enum { DEFAULT_SIZE = 1024 };

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

/* More would make extinctions that are not finite. */
#define OPACITY_SCALE_MAX 1e6

static int check_function(const triptych_transfer_function *f)
{
    bool finite = isfinite(f->window) && isfinite(f->level);
    if (f->name && f->text)
        return trip_fail(TRIP_USAGE, "render", "function",
                         "is given by a name or as text, not both");
    if (!(f->opacity_scale >= 0 && f->opacity_scale <= OPACITY_SCALE_MAX))
        return trip_fail(TRIP_USAGE, "render", "function", "an opacity scale lies between 0 and %g",
                         OPACITY_SCALE_MAX);
    return finite && f->window >= 0
               ? 0
               : trip_fail(TRIP_USAGE, "render", "function",
                           "a window is finite and not below 0, and so is its level");
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
        return "there is no such field or kernel";
    if (!(s->tolerance >= 1e-12 && s->tolerance <= 0.1))
        return "the tolerance lies between 1e-12 and 0.1";
    if (!(s->samples >= 1 && s->samples <= 64))
        return "a pixel has 1 to 64 samples along each side";
    return NULL;
}

static const char *fault_of_splats(const triptych_settings *s)
{
    if (s->compositing < TRIPTYCH_BY_SPLAT || s->compositing > TRIPTYCH_BY_SHEET)
        return "there is no such compositing";
    if (s->footprint < TRIPTYCH_FOOTPRINT_EXACT || s->footprint > TRIPTYCH_FOOTPRINT_FIXED ||
        s->low_pass < TRIPTYCH_LOW_PASS_EWA || s->low_pass > TRIPTYCH_LOW_PASS_NONE)
        return "there is no such footprint or low-pass";
    if (!(s->kernel_radius >= 0.1 && s->kernel_radius <= 100))
        return "the kernel radius lies between 0.1 and 100 voxels";
    if (!(s->flatten >= 1 && s->flatten <= 100))
        return "kernels are 1 to 100 times as flat as round ones";
    return s->flatten > 1 && s->count ? "flat kernels are not counted" : NULL;
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
        return "the clipping box ends before it begins";
    if (!(c->planes >= 0 && c->planes <= TRIP_CLIP_GIVEN_PLANES))
        return "there are 0 to 6 clipping planes";
    for (int i = 0; i < c->planes; i++) {
        const double *p = c->plane[i];
        double length = trip_length(trip_v3(p[0], p[1], p[2]));
        if (!(length > 0 && isfinite(length) && isfinite(p[3])))
            return "the normal of a clipping plane is zero, or not finite";
    }
    return NULL;
}

static const char *fault_of_effects(const triptych_settings *s)
{
    const int all = TRIPTYCH_SHADOWS | TRIPTYCH_OCCLUSION | TRIPTYCH_CUEING |
                    TRIPTYCH_EFFECTS_AUTO | TRIPTYCH_EMISSION;
    if (s->effects & ~all)
        return "there is no such effect";
    if (s->effects & TRIPTYCH_SHADOWS && s->headlight)
        return "light from the eye casts no shadows that are seen; give its direction or place";
    if (!(s->anisotropy >= -0.95 && s->anisotropy <= 0.95))
        return "the anisotropy of scattering lies between -0.95 and 0.95";
    if (s->effects & TRIPTYCH_CUEING && !(s->cueing > 0 && s->cueing <= 1))
        return "depth cueing lies above 0 and up to 1";
    if (!(s->kelvin[0] >= 0 && s->kelvin[0] < s->kelvin[1] && s->kelvin[1] <= 100000))
        return "temperatures of emission lie between 0 and 100000 K, the smaller first";
    if (s->effects && !(s->light_cells >= 8 && s->light_cells <= TRIP_LIGHT_CELLS_MAX))
        return "the light's lattice has 8 to 1024 cells";
    return NULL;
}

static const char *fault_of_settings(const triptych_settings *s)
{
    trip_vec3 light = trip_v3(s->light[0], s->light[1], s->light[2]);
    double length = trip_length(light);
    if (s->method < TRIPTYCH_MERGE || s->method > TRIPTYCH_IMAGE ||
        s->traversal < TRIPTYCH_OUTWARD || s->traversal > TRIPTYCH_ASCENDING ||
        s->target < TRIPTYCH_RGBA32F || s->target > TRIPTYCH_RGBA8)
        return "there is no such method, traversal or target";
    if (s->classify < TRIPTYCH_PRE || s->classify > TRIPTYCH_CLASSIFY_AUTO)
        return "there is no such classification";
    if (!(s->samples_per_sheet >= 0 && s->samples_per_sheet <= TRIP_SHEET_SAMPLES_MAX))
        return "a sheet has 1 to 16 slices, or as many as the view calls for (0)";
    if (s->depth && s->target != TRIPTYCH_RGBA32F)
        return "rounded layers have no depth; leave the target at rgba32f";
    if (!(s->h >= 0 && s->h < 1) && s->h != TRIPTYCH_H_AUTO)
        return "h lies between 0 and below 1, or is by the classification (-1)";
    if (!(s->early_termination >= 0 && s->early_termination <= TRIP_EARLY_TERMINATION_MAX) &&
        s->early_termination != TRIPTYCH_EARLY_TERMINATION_AUTO)
        return "saturation lies between 0 and 0.1, or is by the classification (-1)";
    if ((s->shading || s->effects) && !s->headlight && !isfinite(length))
        return "the light is too far away, or not finite";
    if ((s->shading || s->effects) && !s->headlight && !s->point_light && !(length > 0))
        return "the direction to the light is zero";
    for (int i = 0; i < 4; i++)
        if (!(s->background[i] >= 0 && s->background[i] <= 1))
            return "components of the background lie between 0 and 1";
    if (!(s->lod_px >= 0 && s->lod_px <= 1000))
        return "levels are chosen by 0 to 1000 pixels a voxel";
    if (!(s->max_bytes >= 0 && s->max_bytes <= 1e18 && s->max_ms >= 0 && s->max_ms <= 1e9))
        return "bounds of bytes and milliseconds lie between 0 (none) and 1e18 and 1e9";
    if (s->show < TRIPTYCH_SHOW_PICTURE || s->show > TRIPTYCH_SHOW_LEVELS)
        return "there is nothing such to be shown";
    const char *fault = fault_of_splats(s);
    fault = fault ? fault : fault_of_clip(&s->clip);
    fault = fault ? fault : fault_of_effects(s);
    return fault ? fault : fault_of_integral(s);
}

typedef struct positions {
    double at[3];
} positions;

/* Of voxels; no bounds stay none. */
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

/* Splats of a smaller radius leave a pattern that shows. */
#define SMOOTH_KERNEL_VOXELS 1.5

static void warn_of_ripple(double kernel_radius)
{
    trip_splat_ripple own = trip_splat_ripple_of(kernel_radius);
    trip_splat_ripple defaults = trip_splat_ripple_of(TRIP_KERNEL_RADIUS_VOXELS);
    trip_warn("render",
              "a kernel radius of %g leaves a pattern of voxels: the extinction of constant fog is "
              "off by %+.0f %% through voxels and by %+.0f %% between them; at %g by %+.1f and "
              "%+.1f",
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
    /* What was taken for frames before may be in the way of the light's lattice. */
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

int trip_context_find_view(triptych *t, const triptych_view *given)
{
    const triptych_resources *r = &t->resources;
    trip_engine engine = (trip_engine)r->engine;
    const session_reader wanted = {
        .engine = engine == TRIP_ENGINE_NULL ? TRIP_ENGINE_AUTO : engine,
        .threads = (int)trip_context_threads(r->threads),
    };
    triptych_view view = *given;
    trip_found_view found;
    view.width = view.width ? view.width : DEFAULT_SIZE;
    view.height = view.height ? view.height : DEFAULT_SIZE;
    int status = t->has_function
                     ? 0
                     : trip_context_use_transfer_function(t, &(triptych_transfer_function){ 0 });
    if (!status)
        status = trip_view_find(&found, &view, &t->session, t->settings.kernel_radius, &wanted);
    if (status)
        return status;
    t->view = t->turned = found.params;
    t->axis = found.axis;
    t->fit_splats = found.splats;
    t->has_view = true;
    return 0;
}

int triptych_set_view(triptych *t, const triptych_view *view)
{
    trip_scope *before = trip_context_enter_anew(t);
    int status = trip_context_check_idle(t, true);
    return trip_context_leave(before, status ? status : trip_context_find_view(t, view));
}

int triptych_turn(triptych *t, double degrees)
{
    trip_scope *before = trip_context_enter_anew(t);
    int status = trip_context_check_idle(t, true);
    if (!status && !isfinite(degrees))
        status = trip_fail(TRIP_USAGE, "render", "view", "the angle is not finite");
    if (!status && !t->has_view)
        status = trip_context_find_view(t, &(triptych_view){ 0 });
    if (!status)
        t->turned = degrees != 0 ? trip_camera_turn(&t->view, t->axis, degrees) : t->view;
    return trip_context_leave(before, status);
}

static void put(double out[3], trip_vec3 v)
{
    out[0] = v.x;
    out[1] = v.y;
    out[2] = v.z;
}

int triptych_get_camera(triptych *t, triptych_camera *out)
{
    trip_scope *before = trip_context_enter(t);
    int status = trip_context_check_open(t);
    if (!status && !t->has_view)
        status = trip_context_check_idle(t, true);
    if (!status && !t->has_view)
        status = trip_context_find_view(t, &(triptych_view){ 0 });
    if (status)
        return trip_context_leave(before, status);
    *out = (triptych_camera){ .fov_degrees = t->turned.fov_degrees,
                              .ortho_height = t->turned.ortho_height,
                              .width = t->turned.width,
                              .height = t->turned.height,
                              .splats = t->fit_splats };
    put(out->eye, t->turned.eye);
    put(out->look, t->turned.look);
    put(out->up, t->turned.up);
    return trip_context_leave(before, 0);
}
