#include "views.h"

#include <math.h>

static const double degree = 3.14159265358979323846 / 180;

/* a += share * (b - a). */
static void move(double a[3], const double b[3], double share)
{
    for (int i = 0; i < 3; i++)
        a[i] += share * (b[i] - a[i]);
}

static double distance(const triptych_camera *c)
{
    double sum = 0;
    for (int i = 0; i < 3; i++)
        sum += (c->look[i] - c->eye[i]) * (c->look[i] - c->eye[i]);
    return sqrt(sum);
}

static void look_from_inside(triptych_camera *c)
{
    double beyond[3] = { c->eye[0], c->eye[1], c->eye[2] };
    move(beyond, c->look, 1.3);
    move(c->eye, c->look, 0.93);
    for (int i = 0; i < 3; i++)
        c->look[i] = beyond[i];
    c->fov_degrees = 60;
}

static void look_from_near(triptych_camera *c)
{
    move(c->eye, c->look, 0.82);
    c->fov_degrees = 110;
}

int accuracy_view_find(triptych *t, int width, int height, int index, int count, accuracy_view *out)
{
    static const char *const names[] = { "perspective", "parallel", "from inside", "wide, near" };
    const triptych_view whole = {
        .width = width, .height = height, .azimuth_degrees = 360.0 * index / count, .turntable = 1
    };
    triptych_camera *c = &out->camera;
    int status = triptych_set_view(t, &whole);
    if (!status)
        status = triptych_get_camera(t, c);
    if (status)
        return status;
    out->name = names[index % 4];
    if (index % 4 == 1)
        c->ortho_height = 2 * distance(c) * tan(c->fov_degrees / 2 * degree);
    else if (index % 4 == 2)
        look_from_inside(c);
    else if (index % 4 == 3)
        look_from_near(c);
    return 0;
}

int accuracy_view_use(triptych *t, const accuracy_view *view)
{
    const triptych_camera *c = &view->camera;
    return triptych_set_view(
        t, &(triptych_view){ .width = c->width,
                             .height = c->height,
                             .eye = c->eye,
                             .look = c->look,
                             .up = c->up,
                             .fov_degrees = c->ortho_height > 0 ? 0 : c->fov_degrees,
                             .ortho_height = c->ortho_height });
}
