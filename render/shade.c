#include "shade.h"

/* World-space unit vector from a voxel to the eye: from their difference in index space, which is
 * exact however far the volume lies from the world's origin. */
static trip_vec3 towards_eye(const trip_camera *c, trip_vec3 voxel)
{
    if (c->ortho)
        return trip_scale(c->world_forward, -1);
    return trip_normalize(trip_affine_vector(&c->index_to_world, trip_sub(c->eye, voxel)));
}

void trip_shade(const trip_settings *s, const trip_camera *c, double gradient_full, trip_vec3 voxel,
                const double gradient[3], double rgb[3])
{
    trip_vec3 g = { gradient[0], gradient[1], gradient[2] };
    double magnitude = trip_length(g);
    if (!(magnitude > 0))
        return;
    trip_vec3 normal = trip_scale(g, 1 / magnitude);
    trip_vec3 eye = towards_eye(c, voxel);
    trip_vec3 light = s->headlight ? eye : s->light_direction;
    trip_vec3 half = trip_normalize(trip_add(light, eye));

    double strength = fmin(1, magnitude / gradient_full);
    double diffuse = fabs(trip_dot(normal, light));
    double facing = TRIP_FACING * trip_dot(normal, light) * trip_dot(normal, eye);
    double specular = pow(fabs(trip_dot(normal, half)), TRIP_SHININESS);
    specular *= fmin(1, fmax(0, facing));
    double matt = 1 + strength * (TRIP_AMBIENT + TRIP_DIFFUSE * diffuse - 1);
    for (int i = 0; i < 3; i++) {
        double lit = rgb[i] * matt + strength * TRIP_SPECULAR * specular;
        rgb[i] = fmin(1, fmax(0, lit));
    }
}
