#include "gl/target.h"

#include "gl/shared.h"
#include "renderer.h"
#include "report.h"

static GLenum internal_format(trip_target type)
{
    static const GLenum formats[] = { [TRIP_TARGET_RGBA32F] = GL_RGBA32F,
                                      [TRIP_TARGET_RGBA16F] = GL_RGBA16F,
                                      [TRIP_TARGET_RGBA8] = GL_RGBA8 };
    return formats[type];
}

static uint64_t pixel_bytes(GLenum format)
{
    switch (format) {
    case GL_RGBA32F:
        return 16;
    case GL_RGBA16F:
        return 8;
    default:
        return 4; /* rgba8, r32f, depth24_stencil8 */
    }
}

static int charge(const trip_gl_target *t, GLenum format, int rows, uint64_t *charged)
{
    uint64_t bytes = pixel_bytes(format) * (uint64_t)t->width * (uint64_t)rows;
    if (!trip_budget_charge(t->budget, bytes))
        return trip_fail(TRIP_ERROR, "gl", "image",
                         "layers of %d x %d px do not fit the memory given; raise --memory or draw "
                         "a smaller image",
                         t->width, t->height);
    *charged += bytes;
    return TRIP_OK;
}

static int check_complete(GLuint framebuffer, const char *name)
{
    GLenum state = glCheckNamedFramebufferStatus(framebuffer, GL_DRAW_FRAMEBUFFER);
    if (state == GL_FRAMEBUFFER_COMPLETE)
        return TRIP_OK;
    return trip_fail(TRIP_ERROR, "gl", name, "the driver cannot draw into it: status %#x", state);
}

/* Creates a texture of the target's width and attaches it as output `out` of a surface. */
static int make_texture(const trip_gl_target *t, trip_gl_surface *s, GLenum format, int rows,
                        GLuint *texture, unsigned out)
{
    int status = charge(t, format, rows, &s->bytes);
    if (status)
        return status;
    glCreateTextures(GL_TEXTURE_2D, 1, texture);
    glTextureStorage2D(*texture, 1, format, t->width, rows);
    if (glGetError() != GL_NO_ERROR)
        return trip_fail(TRIP_ERROR, "gl", "image",
                         "the driver has no memory for layers of %d x %d px; draw a smaller image",
                         t->width, t->height);
    glTextureParameteri(*texture, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTextureParameteri(*texture, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    glNamedFramebufferTexture(s->framebuffer, GL_COLOR_ATTACHMENT0 + out, *texture, 0);
    return TRIP_OK;
}

static int make_surface(const trip_gl_target *t, trip_gl_surface *s, int rows, GLenum colour,
                        GLenum depth)
{
    static const GLenum outs[] = { [TRIP_GL_OUT_COLOUR] = GL_COLOR_ATTACHMENT0 + TRIP_GL_OUT_COLOUR,
                                   [TRIP_GL_OUT_DEPTH] = GL_COLOR_ATTACHMENT0 + TRIP_GL_OUT_DEPTH };
    glCreateFramebuffers(1, &s->framebuffer);
    int status = make_texture(t, s, colour, rows, &s->colour, TRIP_GL_OUT_COLOUR);
    if (!status && t->depth)
        status = make_texture(t, s, depth, rows, &s->depth, TRIP_GL_OUT_DEPTH);
    if (status)
        return status;
    glNamedFramebufferDrawBuffers(s->framebuffer, t->depth ? 2 : 1, outs);
    return check_complete(s->framebuffer, "layer");
}

static void release_surface(const trip_gl_target *t, trip_gl_surface *s)
{
    glDeleteFramebuffers(1, &s->framebuffer);
    glDeleteTextures(1, &s->colour);
    glDeleteTextures(1, &s->depth);
    trip_budget_discharge(t->budget, s->bytes);
    *s = (trip_gl_surface){ 0 };
}

static int make_stencil(const trip_gl_target *t, trip_gl_band *band)
{
    if (band->stencil)
        return TRIP_OK;
    int status = charge(t, GL_DEPTH24_STENCIL8, band->rows, &band->stencil_bytes);
    if (status)
        return status;
    glCreateRenderbuffers(1, &band->stencil);
    glNamedRenderbufferStorage(band->stencil, GL_DEPTH24_STENCIL8, t->width, band->rows);
    return TRIP_OK;
}

static int at_least_one_at_most(int count, int max)
{
    return count < 1 ? 1 : count > max ? max : count;
}

static void lay_out(trip_gl_target *t)
{
    int pixels = t->software ? TRIP_GL_SOFTWARE_BAND_PIXELS : TRIP_GL_BAND_PIXELS;
    int min = (t->height + TRIP_GL_BANDS_MAX - 1) / TRIP_GL_BANDS_MAX;
    int rows = at_least_one_at_most(pixels / t->width, t->height);
    rows = rows < min ? min : rows;
    for (int y = 0; y < t->height; y += rows) {
        int left = t->height - y;
        t->bands[t->band_count++] =
            (trip_gl_band){ .first_row = y, .rows = left < rows ? left : rows };
    }
    t->strip_rows = at_least_one_at_most(TRIP_GL_STRIP_PIXELS / t->width, t->height);
}

int trip_gl_target_resize(trip_gl_target *t, int width, int height, trip_target type, bool depth)
{
    if (t->band_count && t->width == width && t->height == height && t->type == type &&
        t->depth == depth)
        return TRIP_OK;
    trip_gl_target_release(t);
    t->width = width;
    t->height = height;
    t->type = type;
    t->depth = depth;
    lay_out(t);
    int status = make_surface(t, &t->strip, t->strip_rows, GL_RGBA32F, GL_R32F);
    if (status)
        trip_gl_target_release(t);
    return status;
}

/* Allocates the layer's surface if it does not exist. */
static int fit_layer(const trip_gl_target *t, trip_gl_band *band, int axis)
{
    trip_gl_surface *layer = &band->layers[axis];
    if (layer->framebuffer)
        return TRIP_OK;
    int status = make_surface(t, layer, band->rows, internal_format(t->type), GL_RGBA32F);
    if (status)
        release_surface(t, layer);
    return status;
}

static const GLfloat nothing[4] = { 0, 0, 0, 0 };

static int set_stencil(GLuint framebuffer, GLuint stencil)
{
    glNamedFramebufferRenderbuffer(framebuffer, GL_DEPTH_STENCIL_ATTACHMENT, GL_RENDERBUFFER,
                                   stencil);
    return check_complete(framebuffer, "layer");
}

static void clear(const trip_gl_target *t, const trip_gl_surface *s)
{
    glClearNamedFramebufferfv(s->framebuffer, GL_COLOR, TRIP_GL_OUT_COLOUR, nothing);
    if (t->depth)
        glClearNamedFramebufferfv(s->framebuffer, GL_COLOR, TRIP_GL_OUT_DEPTH, nothing);
}

void trip_gl_target_clear_sheet(const trip_gl_target *t, const trip_gl_band *band)
{
    clear(t, &band->sheet);
}

/* Sheets are floats for all target types. */
static int begin_sheet(const trip_gl_target *t, trip_gl_band *band, bool stencil)
{
    trip_gl_surface *sheet = &band->sheet;
    int status =
        sheet->framebuffer ? TRIP_OK : make_surface(t, sheet, band->rows, GL_RGBA32F, GL_R32F);
    if (!status)
        status = set_stencil(sheet->framebuffer, stencil ? band->stencil : 0);
    if (status)
        release_surface(t, sheet);
    else
        clear(t, sheet);
    return status;
}

static int begin_band(const trip_gl_target *t, trip_gl_band *band, int axis, bool stencil,
                      bool sums)
{
    static const GLint zero = 0;
    int status = fit_layer(t, band, axis);
    if (!status && stencil)
        status = make_stencil(t, band);
    if (status)
        return status;
    GLuint framebuffer = band->layers[axis].framebuffer;
    status = set_stencil(framebuffer, stencil ? band->stencil : 0);
    if (!status && sums)
        status = begin_sheet(t, band, stencil);
    if (status)
        return status;
    clear(t, &band->layers[axis]);
    if (stencil)
        glClearNamedFramebufferiv(framebuffer, GL_STENCIL, 0, &zero);
    if (t->software)
        glFinish(); /* a cancelled frame then leaves at most one band to clear */
    return trip_frame_poll();
}

int trip_gl_target_begin_layer(trip_gl_target *t, int axis, bool stencil, bool sums)
{
    int status = TRIP_OK;
    for (int i = 0; i < t->band_count && !status; i++)
        status = begin_band(t, &t->bands[i], axis, stencil, sums);
    return status;
}

void trip_gl_target_bind(const trip_gl_target *t, int axis, const trip_gl_band *band)
{
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, band->layers[axis].framebuffer);
    glViewport(0, -band->first_row, t->width, t->height);
}

void trip_gl_target_bind_sheet(const trip_gl_target *t, const trip_gl_band *band)
{
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, band->sheet.framebuffer);
    glViewport(0, -band->first_row, t->width, t->height);
}

void trip_gl_target_bind_strip(const trip_gl_target *t, int rows)
{
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, t->strip.framebuffer);
    glViewport(0, 0, t->width, rows);
}

void trip_gl_target_read_strip(const trip_gl_target *t, int rows, float *rgba, float *depth)
{
    glBindFramebuffer(GL_READ_FRAMEBUFFER, t->strip.framebuffer);
    glReadBuffer(GL_COLOR_ATTACHMENT0 + TRIP_GL_OUT_COLOUR);
    glReadPixels(0, 0, t->width, rows, GL_RGBA, GL_FLOAT, rgba);
    if (!t->depth)
        return;
    glReadBuffer(GL_COLOR_ATTACHMENT0 + TRIP_GL_OUT_DEPTH);
    glReadPixels(0, 0, t->width, rows, GL_RED, GL_FLOAT, depth);
}

void trip_gl_target_release(trip_gl_target *t)
{
    for (int i = 0; i < t->band_count; i++) {
        for (int axis = 0; axis < 3; axis++)
            release_surface(t, &t->bands[i].layers[axis]);
        release_surface(t, &t->bands[i].sheet);
        glDeleteRenderbuffers(1, &t->bands[i].stencil);
        trip_budget_discharge(t->budget, t->bands[i].stencil_bytes);
    }
    release_surface(t, &t->strip);
    *t = (trip_gl_target){ .budget = t->budget, .software = t->software };
}
