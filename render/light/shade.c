#include "shade.h"

#include <assert.h>

#include "report.h"

/* Returns the world-space unit vector from a voxel to the eye. Their difference is taken in index
 * space, where it is exact however far the volume lies from the world's origin. */
static trip_vec3 towards_eye(const trip_camera *c, trip_vec3 voxel)
{
    if (c->ortho)
        return trip_scale(c->world_forward, -1);
    return trip_normalize(trip_affine_vector(&c->index_to_world, trip_sub(c->eye, voxel)));
}

/* Returns the vector from the first voxel to the light in world space. */
static trip_vec3 from_first_voxel(const trip_settings *s, const trip_affine *m)
{
    return trip_sub(s->light_position, trip_v3(m->m[0][3], m->m[1][3], m->m[2][3]));
}

trip_vec3 trip_light_position(const trip_settings *s, const trip_affine *index_to_world)
{
    trip_affine to_index;
    trip_affine_invert(index_to_world, &to_index); /* invertible: checked on opening */
    return trip_affine_vector(&to_index, from_first_voxel(s, index_to_world));
}

int trip_light_check(const trip_settings *s, const trip_affine *index_to_world)
{
    double far = s->point_light ? trip_length(trip_light_position(s, index_to_world)) : 0;
    return far <= TRIP_LIGHT_FARTHEST_VOXELS
               ? 0
               : trip_fail(TRIP_USAGE, "render", "light",
                           "its position is too far from the volume; give its direction instead");
}

static trip_vec3 towards_light(const trip_settings *s, const trip_affine *m, trip_vec3 voxel)
{
    if (!s->point_light)
        return s->light_direction;
    return trip_normalize(trip_sub(from_first_voxel(s, m), trip_affine_vector(m, voxel)));
}

trip_light trip_light_at(const trip_settings *s, const trip_camera *c, double gradient_full,
                         trip_vec3 voxel)
{
    trip_vec3 eye = towards_eye(c, voxel);
    trip_vec3 light = s->headlight ? eye : towards_light(s, &c->index_to_world, voxel);
    return (trip_light){ eye, light, trip_normalize(trip_add(light, eye)), gradient_full };
}

/* Returns x to the power TRIP_SHININESS. */
static double shininess_power(double x)
{
    static_assert((int)TRIP_SHININESS == 24, "the power below");
    double x2 = x * x, x4 = x2 * x2, x8 = x4 * x4;
    return x8 * x8 * x8;
}

static double clamp(double x)
{
    return x > 0 ? x < 1 ? x : 1 : 0;
}

trip_lit trip_light_on(const trip_light *l, const double gradient[3])
{
    trip_vec3 g = { gradient[0], gradient[1], gradient[2] };
    double magnitude = trip_length(g), scale = 1 / magnitude;
    if (!(magnitude > 0))
        return (trip_lit){ 0 };
    double light = scale * trip_dot(g, l->light), eye = scale * trip_dot(g, l->eye);
    double half = scale * trip_dot(g, l->half);
    return (trip_lit){ .strength = clamp(magnitude / l->gradient_full),
                       .diffuse = fabs(light),
                       .specular = clamp(TRIP_FACING * light * eye) * shininess_power(half),
                       .behind = light < 0 };
}

unsigned trip_light_colour(const trip_light *l, const double gradient[3], double rgb[3])
{
    const trip_lit lit = trip_light_on(l, gradient);
    if (!(lit.strength > 0))
        return 0;
    double matt = 1 + lit.strength * (TRIP_AMBIENT + TRIP_DIFFUSE * lit.diffuse - 1);
    unsigned form = 1 + lit.behind + 2 * (lit.strength < 1);
    for (int i = 0; i < 3; i++) {
        double colour = rgb[i] * matt + lit.strength * TRIP_SPECULAR * lit.specular;
        rgb[i] = clamp(colour);
        form += 4u * (colour < 1) << i;
    }
    return form;
}

void trip_shade(const trip_settings *s, const trip_camera *c, double gradient_full, trip_vec3 voxel,
                const double gradient[3], double rgb[3])
{
    const trip_light light = trip_light_at(s, c, gradient_full, voxel);
    trip_light_colour(&light, gradient, rgb);
}
