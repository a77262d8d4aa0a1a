#include "opengl.h"

#include <stddef.h>

#ifdef TRIP_WITHOUT_GL

const char *test_opengl(void)
{
    return NULL;
}

#else

#include <stdio.h>

#include <EGL/egl.h>
#include <EGL/eglext.h>

enum { MAX_DEVICES = 16, GL_NAME_OF_RENDERER = 0x1F01 };

typedef const unsigned char *(*get_string)(unsigned name);

/* Returns the driver's name, or NULL. */
static const char *try_display(EGLDisplay display)
{
    static char name[256];
    const EGLint core45[] = { EGL_CONTEXT_MAJOR_VERSION,
                              4,
                              EGL_CONTEXT_MINOR_VERSION,
                              5,
                              EGL_CONTEXT_OPENGL_PROFILE_MASK,
                              EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                              EGL_NONE };
    if (!display || !eglInitialize(display, NULL, NULL) || !eglBindAPI(EGL_OPENGL_API))
        return NULL;
    EGLContext context = eglCreateContext(display, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, core45);
    name[0] = 0;
    if (context && eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context)) {
        get_string get = (get_string)eglGetProcAddress("glGetString");
        snprintf(name, sizeof name, "%s", (const char *)get(GL_NAME_OF_RENDERER));
        eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    }
    if (context)
        eglDestroyContext(display, context);
    return name[0] ? name : NULL;
}

const char *test_opengl(void)
{
    PFNEGLGETPLATFORMDISPLAYEXTPROC get =
        (PFNEGLGETPLATFORMDISPLAYEXTPROC)eglGetProcAddress("eglGetPlatformDisplayEXT");
    PFNEGLQUERYDEVICESEXTPROC query =
        (PFNEGLQUERYDEVICESEXTPROC)eglGetProcAddress("eglQueryDevicesEXT");
    EGLDeviceEXT devices[MAX_DEVICES];
    EGLint count = 0;
    const char *name = get ? try_display(get(EGL_PLATFORM_SURFACELESS_MESA, NULL, NULL)) : NULL;
    if (!name && get && query && query(MAX_DEVICES, devices, &count))
        for (int i = 0; i < count && !name; i++)
            name = try_display(get(EGL_PLATFORM_DEVICE_EXT, devices[i], NULL));
    return name;
}

#endif
