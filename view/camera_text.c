#include "camera_text.h"

#include <stdio.h>
#include <string.h>

#include "text.h"

static const char *point(const double p[3], char text[128])
{
    char x[32], y[32], z[32];
    snprintf(text, 128, "%s,%s,%s", trip_text_from_double(p[0], x), trip_text_from_double(p[1], y),
             trip_text_from_double(p[2], z));
    return text;
}

char *trip_camera_text_of(const triptych_camera *camera)
{
    char *options, eye[128], look[128], up[128], number[32];
    bool ortho = camera->ortho_height > 0;
    trip_text_from_double(ortho ? camera->ortho_height : camera->fov_degrees, number);
    if (asprintf(&options, "--eye %s --look %s --up %s --%s %s --size %dx%d",
                 point(camera->eye, eye), point(camera->look, look), point(camera->up, up),
                 ortho ? "ortho" : "fov", number, camera->width, camera->height) < 0)
        return NULL;
    return options;
}

char *trip_camera_text(const trip_navigation *n, int width, int height)
{
    triptych_camera camera = { .fov_degrees = n->fov_degrees,
                               .ortho_height = n->ortho_height,
                               .width = width,
                               .height = height };
    memcpy(camera.eye, n->eye, sizeof camera.eye);
    memcpy(camera.look, n->look, sizeof camera.look);
    memcpy(camera.up, n->up, sizeof camera.up);
    return trip_camera_text_of(&camera);
}
