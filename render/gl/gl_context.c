#include "gl/gl_context.h"

#include <epoxy/egl.h>
#include <epoxy/gl.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "report.h"

enum { MAX_DEVICES = 16, NEEDED_STORAGE_BLOCKS = 8 };

struct trip_gl_context {
    EGLDisplay display;
    EGLContext context;
    bool robust;
    trip_gl_limits limits;
    char device[256];
};

static bool has_word(const char *list, const char *word)
{
    return list && epoxy_extension_in_string(list, word);
}

#ifndef NDEBUG
static void GLAPIENTRY debug_message(GLenum source, GLenum type, GLuint id, GLenum severity,
                                     GLsizei length, const GLchar *message, const void *user)
{
    (void)id, (void)length, (void)user;
    /* program.c reports the messages of shader compilers, with file and line. */
    if (severity == GL_DEBUG_SEVERITY_NOTIFICATION || type == GL_DEBUG_TYPE_PERFORMANCE ||
        source == GL_DEBUG_SOURCE_SHADER_COMPILER)
        return;
    trip_warn("gl", "%s", message);
}
#endif

static void report_debug_messages(void)
{
#ifndef NDEBUG
    glEnable(GL_DEBUG_OUTPUT);
    glEnable(GL_DEBUG_OUTPUT_SYNCHRONOUS);
    glDebugMessageCallback(debug_message, NULL);
#endif
}

/* Creates a context that needs no surface. Some EGL versions require a configuration; then any
 * configuration for OpenGL will do. */
static EGLContext create_context(EGLDisplay display, bool robust)
{
#ifndef NDEBUG
    const EGLBoolean debug = EGL_TRUE;
#else
    const EGLBoolean debug = EGL_FALSE;
#endif
    EGLint attributes[] = {
        EGL_CONTEXT_MAJOR_VERSION,
        4,
        EGL_CONTEXT_MINOR_VERSION,
        5,
        EGL_CONTEXT_OPENGL_PROFILE_MASK,
        EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
        EGL_CONTEXT_OPENGL_DEBUG,
        (EGLint)debug,
        robust ? EGL_CONTEXT_OPENGL_RESET_NOTIFICATION_STRATEGY : EGL_NONE,
        EGL_LOSE_CONTEXT_ON_RESET,
        EGL_NONE,
    };
    static const EGLint wanted[] = { EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_SURFACE_TYPE,
                                     EGL_PBUFFER_BIT, EGL_NONE };
    EGLConfig config = EGL_NO_CONFIG_KHR;
    EGLint count = 0;
    if (!has_word(eglQueryString(display, EGL_EXTENSIONS), "EGL_KHR_no_config_context") &&
        !(eglChooseConfig(display, wanted, &config, 1, &count) && count > 0))
        return EGL_NO_CONTEXT;
    return eglCreateContext(display, config, EGL_NO_CONTEXT, attributes);
}

/* A process has one display for each platform, and other contexts may share it. So displays are
 * never terminated. */
static bool try_display(trip_gl_context *c, EGLDisplay display)
{
    if (display == EGL_NO_DISPLAY || !eglInitialize(display, NULL, NULL) ||
        !eglBindAPI(EGL_OPENGL_API))
        return false;
    EGLContext context = create_context(display, true);
    c->robust = context != EGL_NO_CONTEXT;
    if (!c->robust)
        context = create_context(display, false);
    if (context == EGL_NO_CONTEXT)
        return false;
    if (eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context) &&
        epoxy_gl_version() >= 45) {
        c->display = display;
        c->context = context;
        return true;
    }
    eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    eglDestroyContext(display, context);
    return false;
}

/* Tries hardware devices first. EGL also lists Mesa's software renderer as a device, which is
 * skipped here. */
static bool try_hardware_devices(trip_gl_context *c, const char *client_extensions)
{
    EGLDeviceEXT devices[MAX_DEVICES];
    EGLint count = 0;
    if (!has_word(client_extensions, "EGL_EXT_platform_device") ||
        !(has_word(client_extensions, "EGL_EXT_device_enumeration") ||
          has_word(client_extensions, "EGL_EXT_device_base")) ||
        !eglQueryDevicesEXT(MAX_DEVICES, devices, &count))
        return false;
    for (int i = 0; i < count; i++) {
        const char *extensions = eglQueryDeviceStringEXT(devices[i], EGL_EXTENSIONS);
        if (has_word(extensions, "EGL_MESA_device_software"))
            continue;
        if (try_display(c, eglGetPlatformDisplayEXT(EGL_PLATFORM_DEVICE_EXT, devices[i], NULL)))
            return true;
    }
    return false;
}

static bool try_all(trip_gl_context *c)
{
    const char *extensions = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
    if (try_hardware_devices(c, extensions))
        return true;
    if (has_word(extensions, "EGL_MESA_platform_surfaceless") &&
        try_display(c, eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA,
                                                (void *)EGL_DEFAULT_DISPLAY, NULL)))
        return true;
    return try_display(c, eglGetDisplay(EGL_DEFAULT_DISPLAY));
}

static void describe(trip_gl_context *c)
{
    const char *renderer = (const char *)glGetString(GL_RENDERER);
    const char *version = (const char *)glGetString(GL_VERSION);
    snprintf(c->device, sizeof c->device, "%s, OpenGL %s", renderer, version);
}

/* Recognises the device names of Mesa and SwiftShader. */
static bool is_software(const char *device)
{
    static const char *const names[] = { "llvmpipe", "softpipe", "swrast", "SwiftShader" };
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        if (strstr(device, names[i]))
            return true;
    return false;
}

static void read_limits(trip_gl_limits *limits, const char *device)
{
    GLfloat points[2] = { 0 };
    GLint viewport[2] = { 0 }, texture = 0;
    GLint64 block = 0;
    glGetFloatv(GL_POINT_SIZE_RANGE, points);
    glGetIntegerv(GL_MAX_VIEWPORT_DIMS, viewport);
    glGetIntegerv(GL_MAX_TEXTURE_SIZE, &texture);
    glGetInteger64v(GL_MAX_SHADER_STORAGE_BLOCK_SIZE, &block);
    int side = viewport[0] < viewport[1] ? viewport[0] : viewport[1];
    *limits = (trip_gl_limits){
        .point_size_px = points[1],
        .storage_block_bytes = (size_t)block,
        .image_px = side < texture ? side : texture,
        .software = is_software(device),
    };
}

/* OpenGL 4.5 allows drivers to offer no storage blocks to vertex shaders. */
static int check_storage_blocks(const trip_gl_context *c)
{
    GLint blocks = 0;
    glGetIntegerv(GL_MAX_VERTEX_SHADER_STORAGE_BLOCKS, &blocks);
    if (blocks >= NEEDED_STORAGE_BLOCKS)
        return TRIP_OK;
    return trip_fail(TRIP_ERROR, "gl", c->device,
                     "only %d of %d storage blocks for vertex shaders; use another renderer",
                     blocks, NEEDED_STORAGE_BLOCKS);
}

int trip_gl_context_create(trip_gl_context **out)
{
    trip_gl_context *c = calloc(1, sizeof *c);
    *out = NULL;
    if (!c)
        return trip_fail(TRIP_ERROR, "gl", "context", "out of memory");
    if (!epoxy_has_egl() || !try_all(c)) {
        free(c);
        return trip_fail(TRIP_ERROR, "gl", "EGL",
                         "no device offers OpenGL 4.5 core; install a driver "
                         "(libegl1 and libgl1-mesa-dri draw in software) or use another renderer");
    }
    report_debug_messages();
    describe(c);
    read_limits(&c->limits, c->device);
    if (check_storage_blocks(c)) {
        trip_gl_context_destroy(c);
        return TRIP_ERROR;
    }
    *out = c;
    return TRIP_OK;
}

void trip_gl_context_destroy(trip_gl_context *c)
{
    if (!c)
        return;
    eglMakeCurrent(c->display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    eglDestroyContext(c->display, c->context);
    free(c);
}

int trip_gl_context_use(trip_gl_context *c)
{
    if (eglGetCurrentContext() == c->context)
        return TRIP_OK;
    if (eglMakeCurrent(c->display, EGL_NO_SURFACE, EGL_NO_SURFACE, c->context))
        return TRIP_OK;
    return trip_fail(TRIP_ERROR, "gl", c->device,
                     "the context cannot be made current: EGL error %#x", (unsigned)eglGetError());
}

const char *trip_gl_context_device(const trip_gl_context *c)
{
    return c->device;
}

const trip_gl_limits *trip_gl_context_limits(const trip_gl_context *c)
{
    return &c->limits;
}

int trip_gl_check(const trip_gl_context *c, const char *where)
{
    GLenum error = glGetError();
    if (error == GL_CONTEXT_LOST || (c->robust && glGetGraphicsResetStatus() != GL_NO_ERROR))
        return trip_fail(TRIP_ERROR, "gl", where,
                         "the driver has lost the context: start the program again");
    if (error == GL_NO_ERROR)
        return TRIP_OK;
    for (int i = 0; i < 16 && glGetError() != GL_NO_ERROR; i++)
        ;
    if (error == GL_OUT_OF_MEMORY)
        return trip_fail(TRIP_ERROR, "gl", where,
                         "the driver is out of memory; draw a smaller image or use less --memory");
    return trip_fail(TRIP_ERROR, "gl", where, "OpenGL error %#x", error);
}
