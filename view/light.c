#include "light.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "text.h"

#define DEGREE 0.017453292519943295

static double half_diagonal(const triptych_info *info)
{
    double sum = 0;
    for (int i = 0; i < 3; i++)
        sum += (info->hi[i] - info->lo[i]) * (info->hi[i] - info->lo[i]);
    return 0.5 * sqrt(sum);
}

static double middle(const triptych_info *info, int i)
{
    return 0.5 * (info->lo[i] + info->hi[i]);
}

trip_light_control trip_light_control_of(const triptych_settings *s, const triptych_info *info)
{
    double way[3];
    for (int i = 0; i < 3; i++)
        way[i] = s->light[i] - (s->point_light ? middle(info, i) : 0);
    const double length = hypot(hypot(way[0], way[1]), way[2]), unit = half_diagonal(info);
    return (trip_light_control){
        .round = atan2(way[1], way[0]) / DEGREE,
        .up = length > 0 ? asin(way[2] / length) / DEGREE : 90,
        .distance = s->point_light && unit > 0 ? length / unit : TRIP_LIGHT_FARTHEST,
    };
}

void trip_light_control_set(triptych_settings *s, const triptych_info *info,
                            const trip_light_control *control)
{
    const double round = control->round * DEGREE, up = control->up * DEGREE;
    const double way[3] = { cos(up) * cos(round), cos(up) * sin(round), sin(up) };
    const double distance = control->distance * half_diagonal(info);
    s->headlight = 0;
    s->point_light = control->distance < TRIP_LIGHT_FARTHEST;
    for (int i = 0; i < 3; i++)
        s->light[i] = s->point_light ? middle(info, i) + distance * way[i] : way[i];
}

char *trip_light_text(const triptych_settings *s)
{
    char *text = NULL, x[32], y[32], z[32];
    if (s->headlight || !(s->shading || s->effects))
        return strdup("");
    if (asprintf(&text, " --light %s%s,%s,%s", s->point_light ? "point:" : "",
                 trip_text_from_double(s->light[0], x), trip_text_from_double(s->light[1], y),
                 trip_text_from_double(s->light[2], z)) < 0)
        return NULL;
    return text;
}
