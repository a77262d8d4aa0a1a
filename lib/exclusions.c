/* The rules of which settings exclude one another, with their reasons. */
#include <limits.h>
#include <math.h>
#include <stdio.h>

#include "draw_settings.h"
#include "report.h"

#define ROW(name) (UINT64_C(1) << DRAW_##name)
#define RENDERER(name) (1u << TRIPTYCH_RENDERER_##name)
#define ALL 0x1fu

/* Facts about the settings. */
enum {
    PRE = 1 << 0, /* asked for */
    POST = 1 << 1,
    FOR_SPLATS = 1 << 2, /* a setting that only splats have */
    MERGE = 1 << 3,
    IMAGE = 1 << 4,
    ASCENDING = 1 << 5,
    BY_SHEET = 1 << 6,
    VERTEX = 1 << 7,
    EWA = 1 << 8,
    FIXED = 1 << 9,
    UNIFORM = 1 << 10,
    FLATTENED = 1 << 11,
    GAUSSIAN = 1 << 12,
    FIELD_OF_SPLATS = 1 << 13,
    DEBUG_VIEW = 1 << 14,
    SHOW_MERGE = 1 << 15,
    COUNTED = 1 << 16,
    PLAIN = 1 << 17,     /* neither shading nor effects */
    HEADLIGHT = 1 << 18, /* asked for */
    SHADOWS = 1 << 19,
    MAY_SHADOW = 1 << 20, /* shadows or automatic effects */
    MAY_CUE = 1 << 21,
    MAY_LATTICE = 1 << 22,
    NARROW_TARGET = 1 << 23,
    SEVERAL_SAMPLES = 1 << 24,
    STAYING = 1 << 25, /* lists stay in GPU memory */
    MAY_EMIT = 1 << 26,
    NEAREST = 1 << 27,
    UNFILTERED = 1 << 28,
    BY_SHEETS = 1 << 29,
    MAY_EDL = 1 << 30,
    DEFERRED = INT_MIN, /* bit 31 */
};

static const uint64_t of_splats =
    ROW(COMPOSITING) | ROW(FOOTPRINT) | ROW(LOW_PASS) | ROW(LOW_PASS_WIDTH) | ROW(FLATTEN) |
    ROW(WEIGHTS) | ROW(KERNEL_RADIUS) | ROW(TARGET) | ROW(LISTS) | ROW(PRIMITIVES) | ROW(COUNT);
static const uint64_t of_levels = ROW(LOD) | ROW(MAX_BYTES) | ROW(MAX_MS);

/* A rule refuses the rows `given`, if any is set, for these renderers, if all facts `with` hold and
 * none of `without`. */
static const struct rule {
    uint64_t given;
    unsigned renderers;
    int with, without;
    const char *why;
    enum verdict {
        CONFLICT,
        IDLE
    } verdict; /* idle settings have no effect; drawing ignores them */
} rules[] = {
    { ROW(LIGHT), ALL, PLAIN, 0, "does not apply with --no-shading", IDLE },
    { ROW(QUALITY), RENDERER(INTEGRAL), 0, 0,
      "does not apply to --renderer integral, which is exact", IDLE },
    { ROW(ANISOTROPY), ALL, 0, MAY_SHADOW, "requires --effects shadows or auto", IDLE },
    { ROW(CUEING), ALL, 0, MAY_CUE, "requires --effects cueing or auto", IDLE },
    { ROW(TEMPERATURE), ALL, 0, MAY_EMIT, "requires --effects emission or auto", IDLE },
    { ROW(EDL_STRENGTH) | ROW(EDL_RADIUS), ALL, 0, MAY_EDL, "requires --effects edl or auto",
      IDLE },
    { ROW(EFFECTS), RENDERER(INTEGRAL), MAY_EDL, MAY_SHADOW, /* edl without auto */
      "edl does not apply to --renderer integral, which has no distances", CONFLICT },
    { ROW(LIGHT_CELLS), ALL, 0, MAY_LATTICE,
      "requires --effects shadows, occlusion, emission or auto", IDLE },
    { ROW(EFFECTS), ALL, SHADOWS | HEADLIGHT, 0,
      "shadows cannot be seen with --light head; leave out --light or give another light, such as "
      "--light 1,1,1",
      CONFLICT },
    { ROW(EARLY_TERMINATION), ALL, ASCENDING, 0, "requires --traversal outward", IDLE },
    { ROW(H), ALL, 0, MERGE, "requires --method merge", IDLE },
    /* the integral renderer */
    { ROW(FIELD) | ROW(TOLERANCE), ALL & ~RENDERER(INTEGRAL), 0, 0, "requires --renderer integral",
      true },
    { ROW(INTERPOLATION), RENDERER(INTEGRAL), FIELD_OF_SPLATS, 0,
      "does not apply to --field splats", true },
    { ROW(INTERPOLATION), RENDERER(INTEGRAL), GAUSSIAN, 0,
      "must be nearest, linear or cubic with --renderer integral", CONFLICT },
    { ROW(CLASSIFY), RENDERER(INTEGRAL), 0, 0, "does not apply to --renderer integral", IDLE },
    { ROW(SAMPLES_PER_SHEET), RENDERER(INTEGRAL), 0, 0,
      "does not apply to --renderer integral, which has no sheets", IDLE },
    { ROW(EARLY_TERMINATION), RENDERER(INTEGRAL), 0, 0,
      "does not apply to --renderer integral; use --tolerance", IDLE },
    { ROW(METHOD) | ROW(H) | ROW(WEIGHTS) | ROW(TRAVERSAL) | ROW(COMPOSITING), RENDERER(INTEGRAL),
      0, 0, "does not apply to --renderer integral, which has no layers", IDLE },
    { ROW(ORDER) | ROW(SHEET), RENDERER(INTEGRAL), 0, 0,
      "does not apply to --renderer integral, which has no order", IDLE },
    { ROW(SIDES), RENDERER(INTEGRAL), 0, 0,
      "requires --order deferred, so --renderer cpu, gl or reference", CONFLICT },
    { ROW(ORDER), RENDERER(GL), BY_SHEETS, 0, "sheets requires --renderer cpu or reference",
      CONFLICT },
    { ROW(FOOTPRINT) | ROW(EARLY_TERMINATION), ALL, DEFERRED, 0,
      "does not apply to --order deferred, which blends at each pixel what is nearest", CONFLICT },
    { ROW(SHEET), ALL, 0, BY_SHEETS, "requires --order sheets", IDLE },
    { ROW(LOD), ALL, BY_SHEETS, 0, "does not apply to --order sheets, which draws the finest level",
      IDLE },
    { ROW(SHOW), RENDERER(INTEGRAL), DEBUG_VIEW, 0,
      "does not apply to --renderer integral, which has no lists and no levels", CONFLICT },
    { of_levels, RENDERER(INTEGRAL), 0, 0,
      "does not apply to --renderer integral, which draws the finest level", IDLE },
    { ROW(KERNEL_RADIUS), RENDERER(INTEGRAL), 0, FIELD_OF_SPLATS,
      "requires --field splats with --renderer integral", IDLE },
    { ROW(FOOTPRINT) | ROW(LOW_PASS) | ROW(LOW_PASS_WIDTH) | ROW(FLATTEN), RENDERER(INTEGRAL), 0, 0,
      "is for footprints, which --renderer integral does not have", CONFLICT },
    { ROW(COUNT), RENDERER(INTEGRAL), 0, 0, "does not apply to --renderer integral", IDLE },
    /* footprints and methods */
    { ROW(LOW_PASS), ALL & ~RENDERER(REFERENCE), UNIFORM, 0,
      "uniform requires --renderer reference and --kernel ewa", CONFLICT },
    { ROW(LOW_PASS), ALL, UNIFORM, EWA, "uniform requires --renderer reference and --kernel ewa",
      CONFLICT },
    { ROW(LOW_PASS_WIDTH), ALL, UNFILTERED, 0, "does not apply to --low-pass none", IDLE },
    { ROW(FLATTEN), ALL, FLATTENED, EWA, "requires --kernel ewa", CONFLICT },
    { ROW(FLATTEN), ALL, FLATTENED | COUNTED, 0, "does not apply with --count", CONFLICT },
    { ROW(WEIGHTS), ALL, VERTEX, MERGE, "vertex requires --method merge", CONFLICT },
    { ROW(WEIGHTS), ALL, VERTEX | BY_SHEET, 0, "vertex requires --compositing splat", CONFLICT },
    { ROW(COMPOSITING), ALL, IMAGE, 0, "does not apply to --method image", CONFLICT },
    { ROW(TRAVERSAL), ALL, IMAGE | ASCENDING, 0, "must be outward with --method image", CONFLICT },
    { of_levels, ALL, IMAGE, 0, "does not apply to --method image", CONFLICT },
    { of_levels, ALL, FIXED, 0, "does not apply to --kernel fixed", CONFLICT },
    { of_levels, ALL, STAYING, 0, "does not apply to --submit indexed or resident", CONFLICT },
    { ROW(METHOD), RENDERER(GL) | RENDERER(CPU), IMAGE, 0, "image requires --renderer reference",
      CONFLICT },
    { ROW(WEIGHTS), RENDERER(GL) | RENDERER(CPU), VERTEX, 0, "vertex requires --renderer reference",
      CONFLICT },
    { ROW(FOOTPRINT), RENDERER(CPU), FIXED, 0, "fixed requires --renderer reference or gl",
      CONFLICT },
    /* pre and post */
    { ROW(SAMPLES_PER_SHEET) | ROW(INTERPOLATION), ALL & ~RENDERER(INTEGRAL), FOR_SPLATS,
      PRE | POST,
      "does not apply with options for splats: --kernel exact, ewa or fixed, --low-pass, "
      "--low-pass-width, --flatten, --kernel-radius, --method image, --weights, --compositing, "
      "--target, --submit, "
      "--count and --traversal ascending",
      true },
    { ROW(INTERPOLATION), ALL & ~RENDERER(INTEGRAL), PRE, 0,
      "requires --classify post or --renderer integral", IDLE },
    { ROW(SAMPLES_PER_SHEET), ALL, NEAREST, 0,
      "does not apply to --interpolation nearest, which follows rays from voxel to voxel", IDLE },
    { ROW(SAMPLES_PER_SHEET), ALL, PRE, 0, "requires --classify post", IDLE },
    { ROW(TRAVERSAL), ALL, POST | ASCENDING, 0, "must be outward with --classify post", CONFLICT },
    { ROW(METHOD), ALL, POST | IMAGE, 0, "image requires --classify pre", CONFLICT },
    { of_splats, ALL, POST, 0, "requires --classify pre", CONFLICT },
    { ROW(TARGET), RENDERER(REFERENCE) | RENDERER(INTEGRAL), 0, 0, "requires --renderer gl or cpu",
      true },
    { ROW(LISTS) | ROW(PRIMITIVES), ALL & ~(RENDERER(AUTO) | RENDERER(GL)), 0, 0,
      "requires --renderer gl", IDLE },
    /* distances */
    { ROW(DEPTH), RENDERER(INTEGRAL), 0, 0, "does not apply to --renderer integral", CONFLICT },
    { ROW(DEPTH), ALL, SHOW_MERGE, 0,
      "does not apply to --show merge, which does not draw the volume", CONFLICT },
    { ROW(DEPTH), ALL, NARROW_TARGET, 0, "requires --target rgba32f", CONFLICT },
    { ROW(DEPTH), ALL, SEVERAL_SAMPLES, 0, "requires --samples 1", CONFLICT },
};

static uint64_t given_rows(const draw_settings *s)
{
    uint64_t given = 0;
    for (int i = 0; i < DRAW_OPTIONS; i++)
        given |= (uint64_t)trip_option_is_set(&draw_settings_table.rows[i], s) << i;
    return given;
}

static int facts_of_effects(const draw_settings *s)
{
    const int which = s->effects.which, some = which & TRIPTYCH_EFFECT_AUTO ? ~0 : which;
    const int lattices =
        TRIPTYCH_EFFECT_SHADOWS | TRIPTYCH_EFFECT_OCCLUSION | TRIPTYCH_EFFECT_EMISSION;
    return (s->light.no_shading && !(which & ~TRIPTYCH_EFFECT_EDL) ? PLAIN : 0) |
           (s->light.kind == TRIPTYCH_LIGHT_HEAD ? HEADLIGHT : 0) |
           (which & TRIPTYCH_EFFECT_SHADOWS ? SHADOWS : 0) |
           (some & TRIPTYCH_EFFECT_SHADOWS ? MAY_SHADOW : 0) |
           (some & TRIPTYCH_EFFECT_CUEING ? MAY_CUE : 0) |
           (some & TRIPTYCH_EFFECT_EMISSION ? MAY_EMIT : 0) |
           (some & TRIPTYCH_EFFECT_EDL ? MAY_EDL : 0) | (some & lattices ? MAY_LATTICE : 0);
}

static int facts_of_splats(const draw_settings *s)
{
    const triptych_splat_settings *p = &s->splat;
    return (p->compositing == TRIPTYCH_COMPOSITING_SHEET ? BY_SHEET : 0) |
           (p->weights == TRIPTYCH_WEIGHTS_VERTEX ? VERTEX : 0) |
           (p->footprint == TRIPTYCH_FOOTPRINT_EWA ? EWA : 0) |
           (p->footprint == TRIPTYCH_FOOTPRINT_FIXED ? FIXED : 0) |
           (p->low_pass == TRIPTYCH_LOW_PASS_UNIFORM ? UNIFORM : 0) |
           (p->low_pass == TRIPTYCH_LOW_PASS_NONE ? UNFILTERED : 0) |
           (p->flatten > 1 ? FLATTENED : 0) |
           (p->target > TRIPTYCH_TARGET_RGBA32F ? NARROW_TARGET : 0) |
           (p->lists >= TRIPTYCH_SUBMIT_INDEXED ? STAYING : 0);
}

triptych_classify draw_settings_classify(const draw_settings *s)
{
    const bool post =
        s->all.quality == TRIPTYCH_QUALITY_DRAFT || s->all.quality >= TRIPTYCH_QUALITY_HIGH;
    return s->all.classify == TRIPTYCH_CLASSIFY_AUTO && post ? TRIPTYCH_CLASSIFY_POST
                                                             : s->all.classify;
}

const char *draw_settings_of_splats(const draw_settings *s)
{
    const uint64_t given = given_rows(s) & of_splats;
    for (int i = 0; i < DRAW_OPTIONS; i++)
        if (given >> i & 1)
            return draw_settings_table.rows[i].name;
    return s->all.method == TRIPTYCH_METHOD_IMAGE             ? "method"
           : s->all.traversal == TRIPTYCH_TRAVERSAL_ASCENDING ? "traversal"
                                                              : NULL;
}

static int facts_of(const draw_settings *s)
{
    const triptych_classify classify = draw_settings_classify(s);
    return (classify == TRIPTYCH_CLASSIFY_PRE ? PRE : 0) |
           (classify == TRIPTYCH_CLASSIFY_POST ? POST : 0) |
           (draw_settings_of_splats(s) ? FOR_SPLATS : 0) |
           (s->all.method <= TRIPTYCH_METHOD_MERGE ? MERGE : 0) |
           (s->all.method == TRIPTYCH_METHOD_IMAGE ? IMAGE : 0) |
           (s->all.traversal == TRIPTYCH_TRAVERSAL_ASCENDING ? ASCENDING : 0) |
           (s->all.interpolation == TRIPTYCH_INTERPOLATION_GAUSSIAN ? GAUSSIAN : 0) |
           (s->all.interpolation == TRIPTYCH_INTERPOLATION_NEAREST ? NEAREST : 0) |
           (s->integral.field == TRIPTYCH_FIELD_SPLATS ? FIELD_OF_SPLATS : 0) |
           (s->all.show > TRIPTYCH_SHOW_PICTURE ? DEBUG_VIEW : 0) |
           (s->all.show == TRIPTYCH_SHOW_MERGE ? SHOW_MERGE : 0) |
           (s->scene.order == TRIPTYCH_ORDER_SHEETS ? BY_SHEETS : 0) |
           (s->scene.order == TRIPTYCH_ORDER_DEFERRED ? DEFERRED : 0) |
           (s->all.count_exactly ? COUNTED : 0) | (s->all.samples > 1 ? SEVERAL_SAMPLES : 0) |
           facts_of_splats(s) | facts_of_effects(s);
}

/* Returns the first rule that the settings break, or NULL. */
static const struct rule *find_broken(const draw_settings *s, triptych_renderer renderer,
                                      bool idle_too)
{
    const uint64_t given = given_rows(s);
    const int facts = facts_of(s);
    for (size_t i = 0; i < sizeof rules / sizeof *rules; i++) {
        const struct rule *r = &rules[i];
        if ((idle_too || r->verdict == CONFLICT) && r->given & given &&
            r->renderers >> renderer & 1 && !(r->with & ~facts) && !(r->without & facts))
            return r;
    }
    return NULL;
}

static int fail_rule(const struct rule *r, uint64_t given)
{
    char option[64];
    int i = 0;
    while (!((r->given & given) >> i & 1))
        i++;
    snprintf(option, sizeof option, "--%s", draw_settings_table.rows[i].name);
    return trip_option_fail(option, r->why);
}

/* Returns the renderer that the settings require, or auto. */
static triptych_renderer required_renderer(const draw_settings *s)
{
    const bool reference =
        s->all.method == TRIPTYCH_METHOD_IMAGE || s->splat.weights == TRIPTYCH_WEIGHTS_VERTEX;
    const bool gl =
        s->splat.footprint == TRIPTYCH_FOOTPRINT_FIXED || s->splat.lists || s->splat.primitives;
    return reference ? TRIPTYCH_RENDERER_REFERENCE
           : gl      ? TRIPTYCH_RENDERER_GL
                     : TRIPTYCH_RENDERER_AUTO;
}

static int check_light(const triptych_light *l)
{
    const double length = hypot(hypot(l->toward[0], l->toward[1]), l->toward[2]);
    if (l->kind < TRIPTYCH_LIGHT_DEFAULT || l->kind > TRIPTYCH_LIGHT_VIEW)
        return trip_option_fail("--light", "unknown kind of light");
    if (l->kind >= TRIPTYCH_LIGHT_DIRECTION && !isfinite(length))
        return trip_option_fail("--light", "the light is too far away or not finite");
    if (l->kind >= TRIPTYCH_LIGHT_DIRECTION && l->kind != TRIPTYCH_LIGHT_POINT && !(length > 0))
        return trip_option_fail("--light", "the direction to the light is zero");
    return 0;
}

static int check_clip(const triptych_clip *c)
{
    for (int a = 0; c->box && a < 3; a++)
        if (!(c->box_lo[a] < c->box_hi[a]))
            return trip_option_fail("--clip-box",
                                    "the clipping box has its minimum not below its maximum");
    if (!(c->planes >= 0 && c->planes <= 6))
        return trip_option_fail("--clip-plane", "the number of clipping planes must be 0 to 6");
    for (int i = 0; i < c->planes; i++) {
        const double *p = c->plane[i], length = hypot(hypot(p[0], p[1]), p[2]);
        if (!(length > 0 && isfinite(length) && isfinite(p[3])))
            return trip_option_fail("--clip-plane",
                                    "the normal of a clipping plane is zero or not finite");
    }
    return 0;
}

int draw_settings_check_ranges(const draw_settings *s)
{
    const int effects = TRIPTYCH_EFFECT_SHADOWS | TRIPTYCH_EFFECT_OCCLUSION |
                        TRIPTYCH_EFFECT_CUEING | TRIPTYCH_EFFECT_AUTO | TRIPTYCH_EFFECT_EMISSION |
                        TRIPTYCH_EFFECT_EDL;
    int status = 0;
    for (int i = 0; i < DRAW_OPTIONS && !status; i++)
        status = trip_option_check(&draw_settings_table.rows[i], s);
    for (int i = 0; i < 4 && !status && s->has_background; i++)
        if (!(s->background[i] >= 0 && s->background[i] <= 1))
            return trip_option_fail("--background", "components must be between 0 and 1");
    if (!status && s->effects.which & ~effects)
        return trip_option_fail("--effects", "unknown effect");
    if (!status)
        status = check_light(&s->light);
    return status ? status : check_clip(&s->clip);
}

int draw_settings_check(const draw_settings *s, triptych_renderer *renderer, bool idle_too)
{
    int status = draw_settings_check_ranges(s);
    if (status)
        return status;
    if (*renderer == TRIPTYCH_RENDERER_AUTO)
        *renderer = required_renderer(s);
    const struct rule *broken = find_broken(s, *renderer, idle_too);
    return broken ? fail_rule(broken, given_rows(s)) : 0;
}

/* ---- kinds of data ---- */

static const uint64_t of_scenes =
    ROW(ORDER) | ROW(SHEET) | ROW(HARMONICS) | ROW(EDL_STRENGTH) | ROW(EDL_RADIUS);
static const uint64_t of_both = ROW(BACKGROUND) | ROW(CLIP_BOX) | ROW(CLIP_PLANE) |
                                ROW(EARLY_TERMINATION) | ROW(FOOTPRINT) | ROW(SAMPLES) |
                                ROW(DEPTH) | ROW(NORMALISE) | ROW(METHOD) | ROW(H) | ROW(LOD) |
                                ROW(TOLERANCE) | ROW(EFFECTS) | ROW(SHOW);

static const uint64_t of_clouds = ROW(LIGHT) | ROW(NO_SHADING) | ROW(SIDES) | ROW(LIGHT_CELLS);

static const uint64_t not_of_objects = ROW(SHEET) | ROW(LOD) | ROW(MAX_BYTES) | ROW(MAX_MS) |
                                       ROW(SHOW) | ROW(COUNT) | ROW(TEMPERATURE) |
                                       ROW(EDL_STRENGTH) | ROW(EDL_RADIUS);

#define NOT_OF_OBJECTS "does not apply to a picture with volumes beside other objects"

/* These kinds do not have these choices, for these reasons. */
static const struct choice {
    draw_kind kind;  /* scenes stand for clouds too, but clouds have all orders */
    int row, choice; /* index in trip_option.choices */
    const char *why;
} missing[] = {
    { DRAW_KIND_SCENE, DRAW_FOOTPRINT, TRIPTYCH_FOOTPRINT_FIXED - 1,
      "fixed does not apply to Gaussian scenes" },
    { DRAW_KIND_SCENE, DRAW_METHOD, TRIPTYCH_METHOD_IMAGE - 1,
      "image does not apply to Gaussian scenes" },
    { DRAW_KIND_SCENE, DRAW_SHOW, TRIPTYCH_SHOW_LEVELS - TRIPTYCH_SHOW_PICTURE,
      "levels does not apply to Gaussian scenes" },
    { DRAW_KIND_SCENE, DRAW_ORDER, TRIPTYCH_ORDER_DEFERRED - 1,
      "deferred requires clouds of points alone, not ellipsoids" },
    { DRAW_KIND_OBJECTS, DRAW_ORDER, TRIPTYCH_ORDER_DEFERRED - 1, "deferred " NOT_OF_OBJECTS },
    { DRAW_KIND_OBJECTS, DRAW_ORDER, TRIPTYCH_ORDER_LISTS - 1, "lists " NOT_OF_OBJECTS },
    { DRAW_KIND_OBJECTS, DRAW_ORDER, TRIPTYCH_ORDER_SHEETS - 1, "sheets " NOT_OF_OBJECTS },
};

/* The order by depth has one layer, so nothing is merged. Deferred pictures have one, too. */
static bool has_one_layer(const draw_settings *s)
{
    return s->scene.order <= TRIPTYCH_ORDER_DEPTH || s->scene.order == TRIPTYCH_ORDER_DEFERRED;
}

/* The default order of clouds is deferred, too. */
static bool has_sides(const draw_settings *s, int kind)
{
    return kind == DRAW_KIND_CLOUD &&
           (s->scene.order == TRIPTYCH_ORDER_DEFAULT || s->scene.order == TRIPTYCH_ORDER_DEFERRED);
}

static uint64_t rows_of_kind(const draw_settings *s, int kind)
{
    const uint64_t merging = ROW(METHOD) | ROW(H) | ROW(SHOW);
    const uint64_t own = of_scenes | of_both | (kind == DRAW_KIND_CLOUD ? of_clouds : 0);
    const uint64_t others = has_sides(s, kind) ? 0 : ROW(SIDES);
    if (kind == DRAW_KIND_OBJECTS) /* the finest level can be asked for */
        return (~not_of_objects & ~others) | (s->lod.voxel_px == TRIPTYCH_ZERO ? ROW(LOD) : 0);
    return (kind ? own & (has_one_layer(s) ? ~merging : ~0ULL) : ~of_scenes) & ~others;
}

int draw_settings_effects_of_kind(int kind)
{
    return kind == DRAW_KIND_SCENE ? TRIPTYCH_EFFECT_EDL
           : kind == DRAW_KIND_CLOUD
               ? TRIPTYCH_EFFECT_EDL | TRIPTYCH_EFFECT_AUTO | TRIPTYCH_EFFECT_OCCLUSION
               : ~TRIPTYCH_EFFECT_EDL;
}

bool draw_settings_applies(const draw_settings *s, int row, int kind)
{
    return rows_of_kind(s, kind) >> row & 1;
}

static bool concerns(const struct choice *c, int kind)
{
    return kind == DRAW_KIND_CLOUD ? c->kind == DRAW_KIND_SCENE && c->row != DRAW_ORDER
                                   : (int)c->kind == kind;
}

bool draw_settings_choice_applies(int row, int choice, int kind)
{
    for (size_t i = 0; i < sizeof missing / sizeof *missing; i++)
        if (concerns(&missing[i], kind) && missing[i].row == row && missing[i].choice == choice)
            return false;
    return true;
}

/* Returns the first choice of the settings that the kind does not have, or NULL. */
static const struct choice *find_missing(const draw_settings *s, int kind)
{
    for (size_t i = 0; i < sizeof missing / sizeof *missing; i++) {
        const trip_option *row = &draw_settings_table.rows[missing[i].row];
        if (concerns(&missing[i], kind) &&
            *(const int *)((const char *)s + row->at) - row->first == missing[i].choice)
            return &missing[i];
    }
    return NULL;
}

/* Scenes are read by pread, and every Gaussian in view is drawn until its pixels are full. */
static int check_resources_of_scenes(const triptych_resources *r)
{
    if (r->engine != TRIPTYCH_ENGINE_AUTO && r->engine != TRIPTYCH_ENGINE_PREAD)
        return trip_option_fail("--engine", "must be pread for Gaussian scenes");
    if (r->read_occluded)
        return trip_option_fail("--occluded", "does not apply to Gaussian scenes");
    return 0;
}

int draw_settings_check_kind(const draw_settings *s, const triptych_resources *r, draw_kind kind)
{
    const struct rule of_kinds[] = {
        [DRAW_KIND_VOLUME] = { .given = of_scenes, .why = "applies to Gaussian scenes only" },
        [DRAW_KIND_SCENE] = { .given = ~(of_scenes | of_both),
                              .why = "does not apply to Gaussian scenes" },
        [DRAW_KIND_CLOUD] = { .given = ~(of_scenes | of_both | of_clouds),
                              .why = "does not apply to clouds of points" },
        [DRAW_KIND_OBJECTS] = { .given = ~rows_of_kind(s, DRAW_KIND_OBJECTS),
                                .why = NOT_OF_OBJECTS },
    };
    const struct rule of_sides = {
        .given = has_sides(s, kind) ? 0 : ROW(SIDES),
        .why = kind == DRAW_KIND_CLOUD ? "requires --order deferred"
                                       : "applies to clouds of points only, not to ellipsoids"
    };
    static const char *const wrong_effects[] = {
        [DRAW_KIND_VOLUME] = "edl applies to Gaussian scenes and clouds of points only",
        [DRAW_KIND_SCENE] =
            "must be edl or none for Gaussian scenes and ellipsoids; clouds of points have "
            "occlusion and auto too",
        [DRAW_KIND_CLOUD] = "must be occlusion, edl, auto or none for clouds of points",
        [DRAW_KIND_OBJECTS] = "edl " NOT_OF_OBJECTS,
    };
    const bool objects = kind == DRAW_KIND_OBJECTS;
    const uint64_t given = given_rows(s);
    const struct choice *choice = find_missing(s, kind);
    const struct rule of_layers = {
        .given = ~rows_of_kind(s, kind),
        .why =
            "does not apply to scenes with --order depth or deferred, which have nothing to merge",
    };
    if (of_sides.given & given)
        return fail_rule(&of_sides, given);
    if (of_kinds[kind].given & given)
        return fail_rule(&of_kinds[kind], given);
    if (s->effects.which & ~draw_settings_effects_of_kind(kind))
        return trip_option_fail("--effects", wrong_effects[kind]);
    if (choice) {
        char option[64];
        snprintf(option, sizeof option, "--%s", draw_settings_table.rows[choice->row].name);
        return trip_option_fail(option, choice->why);
    }
    if (of_layers.given & given)
        return fail_rule(&of_layers, given);
    if (kind && s->clip.box && s->clip.box_of_voxels)
        return trip_option_fail("--clip-box", objects
                                                  ? "voxels: " NOT_OF_OBJECTS
                                                  : "voxels: does not apply to Gaussian scenes");
    return kind && !objects ? check_resources_of_scenes(r) : 0;
}

void draw_settings_drop_kind(draw_settings *s, int kind)
{
    const struct choice *choice;
    while ((choice = find_missing(s, kind)))
        draw_settings_unset(s, choice->row);
    s->effects.which &= draw_settings_effects_of_kind(kind);
    for (int i = 0; i < DRAW_OPTIONS; i++)
        if (!draw_settings_applies(s, i, kind))
            draw_settings_unset(s, i);
    if (kind && s->clip.box_of_voxels)
        draw_settings_unset(s, DRAW_CLIP_BOX);
}

void draw_settings_drop_excluded(draw_settings *s, triptych_renderer renderer)
{
    const draw_settings unset = { 0 };
    const struct rule *broken;
    while ((broken = find_broken(s, renderer, true)))
        for (int i = 0; i < DRAW_OPTIONS; i++)
            if (broken->given >> i & 1)
                trip_option_copy(&draw_settings_table.rows[i], s, &unset);
}
