#include "clipping.h"

#include <math.h>
#include <string.h>

static double half_diagonal(const triptych_info *info)
{
    double sum = 0;
    for (int a = 0; a < 3; a++)
        sum += (info->hi[a] - info->lo[a]) * (info->hi[a] - info->lo[a]);
    return sum > 0 ? 0.5 * sqrt(sum) : 1;
}

/* A flat scene gets a part of its diagonal along the axis without extent. */
static void set_box_of_scene(triptych_clip *c, const triptych_info *info)
{
    for (int a = 0; a < 3; a++) {
        const double size = info->hi[a] - info->lo[a];
        const double more = size > 0 ? size / 4 : half_diagonal(info) / 4;
        c->box_lo[a] = info->lo[a] - more;
        c->box_hi[a] = info->hi[a] + more;
    }
}

void trip_clipping_box_of_all(triptych_clip *c, const triptych_info *info, bool is_scene)
{
    c->box = 1;
    c->box_of_voxels = !is_scene;
    if (is_scene)
        set_box_of_scene(c, info);
    for (int a = 0; a < 3 && !is_scene; a++) {
        c->box_lo[a] = (double)info->first[a] - 0.5;
        c->box_hi[a] = (double)info->last[a] + 0.5;
    }
}

void trip_clipping_set_face(triptych_clip *c, int axis, int face, double position, double min)
{
    if (face)
        c->box_hi[axis] = fmax(position, c->box_lo[axis] + min);
    else
        c->box_lo[axis] = fmin(position, c->box_hi[axis] - min);
}

bool trip_clipping_add_plane(triptych_clip *c, const trip_navigation *n)
{
    if (c->planes == TRIP_CLIPPING_PLANES)
        return false;
    const trip_navigation_axes axes = trip_navigation_get_axes(n);
    double *plane = c->plane[c->planes++];
    plane[3] = 0;
    for (int a = 0; a < 3; a++) {
        plane[a] = axes.forward[a];
        plane[3] -= axes.forward[a] * n->look[a];
    }
    return true;
}

void trip_clipping_flip_plane(triptych_clip *c, int plane)
{
    for (int i = 0; i < 4; i++)
        c->plane[plane][i] = -c->plane[plane][i];
}

void trip_clipping_remove_plane(triptych_clip *c, int plane)
{
    c->planes--;
    memmove(c->plane[plane], c->plane[plane + 1], (size_t)(c->planes - plane) * sizeof *c->plane);
}

static double length_of(const double plane[4])
{
    return hypot(hypot(plane[0], plane[1]), plane[2]);
}

/* Evaluates the plane's linear function, without its constant, at the centre of the data. */
static double at_middle(const double plane[4], const triptych_info *info)
{
    double sum = 0;
    for (int a = 0; a < 3; a++)
        sum += plane[a] * 0.5 * (info->lo[a] + info->hi[a]);
    return sum;
}

double trip_clipping_depth(const triptych_clip *c, int plane, const triptych_info *info)
{
    const double *p = c->plane[plane];
    return -(at_middle(p, info) + p[3]) / (length_of(p) * half_diagonal(info));
}

void trip_clipping_set_depth(triptych_clip *c, int plane, const triptych_info *info, double depth)
{
    double *p = c->plane[plane];
    p[3] = -depth * length_of(p) * half_diagonal(info) - at_middle(p, info);
}

static double voxel_length(const triptych_info *info, int axis)
{
    const double(*m)[4] = info->index_to_world;
    return hypot(hypot(m[0][axis], m[1][axis]), m[2][axis]);
}

void trip_clipping_rescale(triptych_clip *c, const triptych_info *from, const triptych_info *to)
{
    for (int a = 0; a < 3 && c->box_of_voxels; a++) {
        const double scale = voxel_length(from, a) / voxel_length(to, a);
        c->box_lo[a] *= scale;
        c->box_hi[a] *= scale;
    }
}

bool trip_clipping_is_sound(const triptych_clip *c)
{
    for (int a = 0; a < 3 && c->box; a++)
        if (!(c->box_lo[a] < c->box_hi[a]))
            return false;
    for (int i = 0; i < c->planes; i++)
        if (!(length_of(c->plane[i]) > 0 && isfinite(length_of(c->plane[i]))))
            return false;
    return c->planes >= 0 && c->planes <= TRIP_CLIPPING_PLANES;
}

triptych_clip trip_clipping_mix(const triptych_clip *a, const triptych_clip *b, double t)
{
    bool alike = a->box == b->box && a->box_of_voxels == b->box_of_voxels && a->planes == b->planes;
    triptych_clip mix = t < 1 ? *a : *b;
    if (!alike || !(t > 0 && t < 1))
        return mix;
    for (int i = 0; i < 3; i++) {
        mix.box_lo[i] += t * (b->box_lo[i] - a->box_lo[i]);
        mix.box_hi[i] += t * (b->box_hi[i] - a->box_hi[i]);
    }
    for (int i = 0; i < a->planes; i++)
        for (int k = 0; k < 4; k++)
            mix.plane[i][k] += t * (b->plane[i][k] - a->plane[i][k]);
    return trip_clipping_is_sound(&mix) ? mix : *a; /* opposite planes have no mean */
}
