#include "gl/sums.h"

#include "gl/frame_block.h"
#include "gl/shared.h"
#include "report.h"

void trip_gl_sums_begin_layer(trip_gl_sums *s, int axis)
{
    s->axis = axis;
    for (int i = 0; i < TRIP_GL_BANDS_MAX; i++)
        s->open[i] = TRIP_GL_NO_SHEET;
}

static uint64_t *open_of(trip_gl_sums *s, const trip_gl_band *band)
{
    return &s->open[band - s->target->bands];
}

/* Composites a band's open sheet and clears the sums. */
static int end_sheet(trip_gl_sums *s, const trip_gl_band *band)
{
    GLuint program;
    if (*open_of(s, band) == TRIP_GL_NO_SHEET)
        return TRIP_OK;
    const trip_gl_variant variant = { TRIP_GL_PASS_SUM, s->method,
                                      s->target->depth ? TRIP_GL_DEPTH : 0, 0 };
    int status = trip_gl_variants_get(s->variants, variant, &program);
    if (status)
        return status;
    trip_gl_target_bind(s->target, s->axis, band);
    glUseProgram(program);
    glEnable(GL_BLEND);
    if (s->front_to_back)
        glBlendFunc(GL_ONE_MINUS_DST_ALPHA, GL_ONE);
    else
        glBlendFunc(GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
    glBindTextureUnit(TRIP_GL_LAYER, band->sheet.colour);
    glBindTextureUnit(TRIP_GL_LAYER_DEPTH, band->sheet.depth);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    trip_gl_target_clear_sheet(s->target, band);
    *open_of(s, band) = TRIP_GL_NO_SHEET;
    return TRIP_OK;
}

int trip_gl_sums_use(trip_gl_sums *s, const trip_gl_band *band, unsigned level, int32_t sheet)
{
    uint64_t key = (uint64_t)level << 32 | (uint32_t)sheet;
    int status = *open_of(s, band) == key ? TRIP_OK : end_sheet(s, band);
    if (status)
        return status;
    *open_of(s, band) = key;
    trip_gl_target_bind_sheet(s->target, band);
    glEnable(GL_BLEND);
    glBlendFunc(GL_ONE, GL_ONE);
    return TRIP_OK;
}

int trip_gl_sums_end_layer(trip_gl_sums *s)
{
    int status = TRIP_OK;
    glDisable(GL_STENCIL_TEST);
    for (int i = 0; i < s->target->band_count && !status; i++)
        status = end_sheet(s, &s->target->bands[i]);
    return status;
}
