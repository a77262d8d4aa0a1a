#include "gl/variant.h"

#include <assert.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>

#include "gaussian_picture.h"
#include "gl/frame_block.h"
#include "gl/program.h"
#include "report.h"
#include "shade.h"
#include "sheet.h"
#include "splat.h"
#include "surfel_picture.h"
#include "text.h"

static const struct {
    const char *vertex, *fragment, *compute;
    unsigned effects; /* that the pass uses */
    bool in_double;
} passes[] = {
    [TRIP_GL_PASS_SPLAT] = { "splat.vert", "splat.frag", NULL, TRIP_GL_EFFECT_SETS - 1, false },
    [TRIP_GL_PASS_SUM] = { "screen.vert", "sum.frag", NULL, TRIP_GL_DEPTH, false },
    [TRIP_GL_PASS_COUNT] = { NULL, NULL, "count.comp",
                             TRIP_GL_PARALLEL | TRIP_GL_INDEXED | TRIP_GL_RESIDENT |
                                 TRIP_GL_AFFINE | TRIP_GL_FIXED | TRIP_GL_UNEVEN |
                                 TRIP_GL_TWO_POINTS,
                             true },
    [TRIP_GL_PASS_REGION] = { "screen.vert", "region.frag", NULL, 0, true },
    [TRIP_GL_PASS_MERGE] = { "screen.vert", "merge.frag", NULL, TRIP_GL_DEPTH, true },
    [TRIP_GL_PASS_SHEET_DECODE] = { NULL, NULL, "sheet_decode.comp",
                                    TRIP_GL_EXACT | TRIP_GL_BLURRED, false },
    [TRIP_GL_PASS_SHEET_GRADIENT] = { NULL, NULL, "sheet_gradient.comp",
                                      TRIP_GL_UNEVEN | TRIP_GL_EXACT | TRIP_GL_NEAREST, false },
    [TRIP_GL_PASS_SHEET_DRAW] = { NULL, NULL, "sheet_draw.comp",
                                  TRIP_GL_PARALLEL | TRIP_GL_SHADED | TRIP_GL_HEADLIGHT |
                                      TRIP_GL_DEPTH | TRIP_GL_WIDE | TRIP_GL_CUED | TRIP_GL_UNEVEN |
                                      TRIP_GL_EXACT | TRIP_GL_SHADOWS | TRIP_GL_OCCLUSION |
                                      TRIP_GL_EMISSION | TRIP_GL_CLOSED | TRIP_GL_NEAREST |
                                      TRIP_GL_BLURRED,
                                  false },
    [TRIP_GL_PASS_TILES] = { NULL, NULL, "tiles.comp", TRIP_GL_DEPTH | TRIP_GL_CURVED, false },
    [TRIP_GL_PASS_TILE_CLEAR] = { NULL, NULL, "tile_clear.comp", TRIP_GL_DEPTH, false },
    [TRIP_GL_PASS_SURFEL_DEPTH] = { "surfel_depth.vert", "surfel_depth.frag", NULL,
                                    TRIP_GL_PARALLEL, false },
    [TRIP_GL_PASS_SURFEL_SELECT] = { NULL, NULL, "surfel_select.comp", 0, false },
    [TRIP_GL_PASS_SURFEL_BLOCKS] = { NULL, NULL, "surfel_blocks.comp", 0, false },
    [TRIP_GL_PASS_SURFEL_BLEND] = { "surfel_blend.vert", "surfel_blend.frag", NULL,
                                    TRIP_GL_PARALLEL, false },
};

static void write_effects(FILE *out, unsigned effects)
{
    static const struct {
        unsigned effect;
        const char *name;
    } names[] = {
        { TRIP_GL_PARALLEL, "PARALLEL" },     { TRIP_GL_ANISOTROPIC, "ANISOTROPIC" },
        { TRIP_GL_SHADED, "SHADED" },         { TRIP_GL_HEADLIGHT, "HEADLIGHT" },
        { TRIP_GL_INDEXED, "INDEXED" },       { TRIP_GL_QUADS, "QUADS" },
        { TRIP_GL_UNCULLED, "UNCULLED" },     { TRIP_GL_COMPACT, "COMPACT" },
        { TRIP_GL_DEPTH, "DEPTH" },           { TRIP_GL_NEAR, "NEAR" },
        { TRIP_GL_SUMMED, "SUMS" },           { TRIP_GL_AFFINE, "AFFINE" },
        { TRIP_GL_FLATTENED, "FLATTENED" },   { TRIP_GL_WIDE, "WIDE" },
        { TRIP_GL_FIXED, "FIXED" },           { TRIP_GL_CUED, "CUED" },
        { TRIP_GL_UNEVEN, "UNEVEN" },         { TRIP_GL_SHADOWS, "SHADOWS" },
        { TRIP_GL_OCCLUSION, "OCCLUSION" },   { TRIP_GL_EMISSION, "EMISSION" },
        { TRIP_GL_CLOSED, "CLOSED" },         { TRIP_GL_EXACT, "EXACT" },
        { TRIP_GL_NEAREST, "NEAREST" },       { TRIP_GL_RESIDENT, "RESIDENT" },
        { TRIP_GL_TWO_POINTS, "TWO_POINTS" }, { TRIP_GL_BLURRED, "BLURRED" },
        { TRIP_GL_CURVED, "CURVED" },
    };
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        if (effects & names[i].effect)
            fprintf(out, "#define %s\n", names[i].name);
}

static void write_defines(FILE *out, const trip_gl_variant *variant)
{
    locale_t before = trip_text_use_points();
    if (passes[variant->pass].in_double)
        fprintf(out, "#define TRIP_DOUBLE\n");
    fprintf(out, "#define METHOD %d\n#define LAYERS %u\n", (int)variant->method, variant->layers);
    fprintf(out, "#define AFFINE_MAX %f\n#define AFFINE_REACH %f\n", TRIP_SPLAT_AFFINE,
            TRIP_SPLAT_AFFINE_REACH);
    write_effects(out, variant->effects);
    if (variant->pass == TRIP_GL_PASS_TILES)
        fprintf(out, "#define ALPHA_MIN %.9f\n#define ALPHA_MAX %.9f\n", TRIP_GAUSSIAN_ALPHA_MIN,
                TRIP_GAUSSIAN_ALPHA_MAX);
    if (variant->pass >= TRIP_GL_PASS_SURFEL_DEPTH)
        fprintf(out, "#define RIM %.9g\n#define REACH %.9f\n", TRIP_SURFEL_RIM, TRIP_SURFEL_REACH);
    if (variant->effects & TRIP_GL_WIDE)
        fprintf(out, "#define CUBIC %d\n#define CUTOFF %.9f\n", (int)TRIP_KERNEL_CUBIC,
                TRIP_CUTOFF);
    if (variant->effects & TRIP_GL_NEAREST)
        fprintf(out, "#define BOX_POINT %.9f\n", TRIP_SHEET_BOX_POINT);
    if (variant->effects & (TRIP_GL_SHADED | TRIP_GL_SHADOWS | TRIP_GL_OCCLUSION))
        fprintf(out,
                "#define AMBIENT %f\n#define DIFFUSE %f\n#define SPECULAR %f\n"
                "#define SHININESS %f\n#define FACING %f\n",
                TRIP_AMBIENT, TRIP_DIFFUSE, TRIP_SPECULAR, TRIP_SHININESS, TRIP_FACING);
    uselocale(before);
}

static int build(const trip_gl_variant *variant, GLuint *program)
{
    char defines[1536] = "";
    FILE *out = fmemopen(defines, sizeof defines, "w");
    if (!out)
        return trip_fail(TRIP_ERROR, "gl", "shaders", "out of memory");
    write_defines(out, variant);
    fclose(out);
    return trip_gl_program_build(program, &(trip_gl_program_source){
                                              .vertex = passes[variant->pass].vertex,
                                              .fragment = passes[variant->pass].fragment,
                                              .compute = passes[variant->pass].compute,
                                              .defines = defines,
                                          });
}

static_assert(TRIP_GL_PASS_SURFEL_BLEND < 1 << 4, "a pass is 4 bits of a key");
static_assert(TRIP_GL_EFFECT_SETS <= 1 << 30, "effects are 32 bits of a key");
static uint64_t key_of(const trip_gl_variant *v)
{
    return (uint64_t)v->pass | (uint64_t)v->method << 4 | (uint64_t)v->effects << 8 |
           (uint64_t)v->layers << 40;
}

int trip_gl_variants_get(trip_gl_variants *v, trip_gl_variant variant, GLuint *program)
{
    variant.effects &= passes[variant.pass].effects;
    uint64_t key = key_of(&variant);
    for (size_t i = 0; i < v->count; i++) {
        if (v->built[i].key == key) {
            *program = v->built[i].program;
            return TRIP_OK;
        }
    }
    trip_gl_built *built = realloc(v->built, (v->count + 1) * sizeof *built);
    if (!built)
        return trip_fail(TRIP_ERROR, "gl", "shaders", "out of memory");
    v->built = built;
    int status = build(&variant, program);
    if (!status)
        v->built[v->count++] = (trip_gl_built){ key, *program };
    return status;
}

void trip_gl_variants_release(trip_gl_variants *v)
{
    for (size_t i = 0; i < v->count; i++)
        glDeleteProgram(v->built[i].program);
    free(v->built);
    *v = (trip_gl_variants){ 0 };
}
