#include "gl/target.h"

#include "renderer.h"
#include "report.h"

static GLenum internal_format(trip_target type)
{
    static const GLenum formats[] = { [TRIP_TARGET_RGBA32F] = GL_RGBA32F,
                                      [TRIP_TARGET_RGBA16F] = GL_RGBA16F,
                                      [TRIP_TARGET_RGBA8] = GL_RGBA8 };
    return formats[type];
}

static uint64_t pixel_bytes(trip_target type)
{
    static const uint64_t bytes[] = {
        [TRIP_TARGET_RGBA32F] = 16, [TRIP_TARGET_RGBA16F] = 8, [TRIP_TARGET_RGBA8] = 4
    };
    return bytes[type];
}

static int charge(trip_gl_target *t, uint64_t bytes_per_pixel, int rows)
{
    uint64_t bytes = bytes_per_pixel * (uint64_t)t->width * (uint64_t)rows;
    if (!trip_budget_charge(t->budget, bytes))
        return trip_fail(TRIP_ERROR, "gl", "image",
                         "layers of %d x %d px do not fit the memory given; raise --memory or draw "
                         "a smaller image",
                         t->width, t->height);
    t->bytes += bytes;
    return TRIP_OK;
}

static int check_complete(GLuint framebuffer, const char *name)
{
    GLenum state = glCheckNamedFramebufferStatus(framebuffer, GL_DRAW_FRAMEBUFFER);
    if (state == GL_FRAMEBUFFER_COMPLETE)
        return TRIP_OK;
    return trip_fail(TRIP_ERROR, "gl", name, "the driver cannot draw into it: status %#x", state);
}

/* A texture of the target's width with a framebuffer around it. */
static int make_texture(trip_gl_target *t, trip_target type, int rows, GLuint *texture,
                        GLuint *framebuffer)
{
    int status = charge(t, pixel_bytes(type), rows);
    if (status)
        return status;
    glCreateTextures(GL_TEXTURE_2D, 1, texture);
    glTextureStorage2D(*texture, 1, internal_format(type), t->width, rows);
    if (glGetError() != GL_NO_ERROR)
        return trip_fail(TRIP_ERROR, "gl", "image",
                         "the driver has no memory for layers of %d x %d px; draw a smaller image",
                         t->width, t->height);
    glTextureParameteri(*texture, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTextureParameteri(*texture, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    glCreateFramebuffers(1, framebuffer);
    glNamedFramebufferTexture(*framebuffer, GL_COLOR_ATTACHMENT0, *texture, 0);
    return check_complete(*framebuffer, "layer");
}

static int make_stencil(trip_gl_target *t, trip_gl_band *band)
{
    if (band->stencil)
        return TRIP_OK;
    int status = charge(t, 4, band->rows);
    if (status)
        return status;
    glCreateRenderbuffers(1, &band->stencil);
    glNamedRenderbufferStorage(band->stencil, GL_DEPTH24_STENCIL8, t->width, band->rows);
    return TRIP_OK;
}

static int at_least_one_at_most(int count, int most)
{
    return count < 1 ? 1 : count > most ? most : count;
}

static void lay_out(trip_gl_target *t)
{
    int least = (t->height + TRIP_GL_BANDS_MAX - 1) / TRIP_GL_BANDS_MAX;
    int rows = at_least_one_at_most(TRIP_GL_BAND_PIXELS / t->width, t->height);
    rows = rows < least ? least : rows;
    for (int y = 0; y < t->height; y += rows) {
        int left = t->height - y;
        t->bands[t->band_count++] =
            (trip_gl_band){ .first_row = y, .rows = left < rows ? left : rows };
    }
    t->strip_rows = at_least_one_at_most(TRIP_GL_STRIP_PIXELS / t->width, t->height);
}

int trip_gl_target_resize(trip_gl_target *t, int width, int height, trip_target type)
{
    if (t->strip && t->width == width && t->height == height && t->type == type)
        return TRIP_OK;
    trip_gl_target_release(t);
    t->width = width;
    t->height = height;
    t->type = type;
    lay_out(t);
    return make_texture(t, TRIP_TARGET_RGBA32F, t->strip_rows, &t->strip, &t->strip_framebuffer);
}

static int begin_band(trip_gl_target *t, trip_gl_band *band, int axis, bool stencil)
{
    static const GLfloat nothing[4] = { 0, 0, 0, 0 };
    static const GLint zero = 0;
    int status = TRIP_OK;
    if (!band->layers[axis])
        status =
            make_texture(t, t->type, band->rows, &band->layers[axis], &band->framebuffers[axis]);
    if (!status && stencil)
        status = make_stencil(t, band);
    if (status)
        return status;
    GLuint framebuffer = band->framebuffers[axis];
    glNamedFramebufferRenderbuffer(framebuffer, GL_DEPTH_STENCIL_ATTACHMENT, GL_RENDERBUFFER,
                                   stencil ? band->stencil : 0);
    status = check_complete(framebuffer, "layer");
    if (status)
        return status;
    glClearNamedFramebufferfv(framebuffer, GL_COLOR, 0, nothing);
    if (stencil)
        glClearNamedFramebufferiv(framebuffer, GL_STENCIL, 0, &zero);
    return trip_frame_poll();
}

int trip_gl_target_begin_layer(trip_gl_target *t, int axis, bool stencil)
{
    int status = TRIP_OK;
    for (int i = 0; i < t->band_count && !status; i++)
        status = begin_band(t, &t->bands[i], axis, stencil);
    return status;
}

void trip_gl_target_bind(const trip_gl_target *t, int axis, const trip_gl_band *band)
{
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, band->framebuffers[axis]);
    glViewport(0, -band->first_row, t->width, t->height);
}

void trip_gl_target_bind_strip(const trip_gl_target *t, int rows)
{
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, t->strip_framebuffer);
    glViewport(0, 0, t->width, rows);
}

void trip_gl_target_read_strip(const trip_gl_target *t, int rows, float *rgba)
{
    glBindFramebuffer(GL_READ_FRAMEBUFFER, t->strip_framebuffer);
    glReadPixels(0, 0, t->width, rows, GL_RGBA, GL_FLOAT, rgba);
}

void trip_gl_target_release(trip_gl_target *t)
{
    for (int i = 0; i < t->band_count; i++) {
        glDeleteFramebuffers(3, t->bands[i].framebuffers);
        glDeleteTextures(3, t->bands[i].layers);
        glDeleteRenderbuffers(1, &t->bands[i].stencil);
    }
    glDeleteFramebuffers(1, &t->strip_framebuffer);
    glDeleteTextures(1, &t->strip);
    trip_budget_discharge(t->budget, t->bytes);
    *t = (trip_gl_target){ .budget = t->budget };
}
