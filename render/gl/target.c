#include "gl/target.h"

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

static int charge(trip_gl_target *t, uint64_t bytes_per_pixel)
{
    uint64_t bytes = bytes_per_pixel * (uint64_t)t->width * (uint64_t)t->height;
    if (!trip_budget_charge(t->budget, bytes))
        return trip_fail(TRIP_ERROR, "gl", "image",
                         "layers of %d x %d px do not fit the memory given; raise --memory or draw "
                         "a smaller image",
                         t->width, t->height);
    t->bytes += bytes;
    return TRIP_OK;
}

/* A texture of the target's size with a framebuffer around it. */
static int make_texture(trip_gl_target *t, trip_target type, GLuint *texture, GLuint *framebuffer)
{
    int status = charge(t, pixel_bytes(type));
    if (status)
        return status;
    glCreateTextures(GL_TEXTURE_2D, 1, texture);
    glTextureStorage2D(*texture, 1, internal_format(type), t->width, t->height);
    if (glGetError() != GL_NO_ERROR)
        return trip_fail(TRIP_ERROR, "gl", "image",
                         "the driver has no memory for layers of %d x %d px; draw a smaller image",
                         t->width, t->height);
    glTextureParameteri(*texture, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTextureParameteri(*texture, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    glCreateFramebuffers(1, framebuffer);
    glNamedFramebufferTexture(*framebuffer, GL_COLOR_ATTACHMENT0, *texture, 0);
    return TRIP_OK;
}

static int make_stencil(trip_gl_target *t)
{
    if (t->stencil)
        return TRIP_OK;
    int status = charge(t, 4);
    if (status)
        return status;
    glCreateRenderbuffers(1, &t->stencil);
    glNamedRenderbufferStorage(t->stencil, GL_DEPTH24_STENCIL8, t->width, t->height);
    return TRIP_OK;
}

static int bind_complete(GLuint framebuffer, const char *name)
{
    GLenum state = glCheckNamedFramebufferStatus(framebuffer, GL_DRAW_FRAMEBUFFER);
    if (state != GL_FRAMEBUFFER_COMPLETE)
        return trip_fail(TRIP_ERROR, "gl", name, "the driver cannot draw into it: status %#x",
                         state);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, framebuffer);
    return TRIP_OK;
}

int trip_gl_target_resize(trip_gl_target *t, int width, int height, trip_target type)
{
    if (t->image && t->width == width && t->height == height && t->type == type)
        return TRIP_OK;
    trip_gl_target_release(t);
    t->width = width;
    t->height = height;
    t->type = type;
    return make_texture(t, TRIP_TARGET_RGBA32F, &t->image, &t->framebuffer);
}

int trip_gl_target_bind_layer(const trip_gl_target *t, int axis)
{
    glViewport(0, 0, t->width, t->height);
    return bind_complete(t->framebuffers[axis], "layer");
}

int trip_gl_target_begin_layer(trip_gl_target *t, int axis, bool stencil)
{
    static const GLfloat nothing[4] = { 0, 0, 0, 0 };
    static const GLint zero = 0;
    int status = TRIP_OK;
    if (!t->layers[axis])
        status = make_texture(t, t->type, &t->layers[axis], &t->framebuffers[axis]);
    if (!status && stencil)
        status = make_stencil(t);
    if (status)
        return status;
    GLuint framebuffer = t->framebuffers[axis];
    glNamedFramebufferRenderbuffer(framebuffer, GL_DEPTH_STENCIL_ATTACHMENT, GL_RENDERBUFFER,
                                   stencil ? t->stencil : 0);
    status = trip_gl_target_bind_layer(t, axis);
    if (status)
        return status;
    glClearNamedFramebufferfv(framebuffer, GL_COLOR, 0, nothing);
    if (stencil)
        glClearNamedFramebufferiv(framebuffer, GL_STENCIL, 0, &zero);
    return TRIP_OK;
}

int trip_gl_target_begin_image(trip_gl_target *t)
{
    glViewport(0, 0, t->width, t->height);
    return bind_complete(t->framebuffer, "image");
}

void trip_gl_target_read_rows(const trip_gl_target *t, int first, int count, float *rgba)
{
    glBindFramebuffer(GL_READ_FRAMEBUFFER, t->framebuffer);
    glReadPixels(0, first, t->width, count, GL_RGBA, GL_FLOAT, rgba);
}

void trip_gl_target_release(trip_gl_target *t)
{
    glDeleteFramebuffers(3, t->framebuffers);
    glDeleteFramebuffers(1, &t->framebuffer);
    glDeleteTextures(3, t->layers);
    glDeleteTextures(1, &t->image);
    glDeleteRenderbuffers(1, &t->stencil);
    trip_budget_discharge(t->budget, t->bytes);
    *t = (trip_gl_target){ .budget = t->budget };
}
