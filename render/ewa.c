#include "ewa.h"

trip_covariance trip_covariance_round(double sigma)
{
    double v = sigma * sigma;
    return (trip_covariance){ .xx = v, .yy = v, .zz = v };
}

trip_covariance trip_covariance_flattened(double sigma, trip_vec3 n, double share)
{
    double v = sigma * sigma, less = v * share;
    return (trip_covariance){
        .xx = v - less * n.x * n.x,
        .xy = -less * n.x * n.y,
        .xz = -less * n.x * n.z,
        .yy = v - less * n.y * n.y,
        .yz = -less * n.y * n.z,
        .zz = v - less * n.z * n.z,
    };
}

static trip_vec3 row_of(const trip_affine *m, int i)
{
    return trip_v3(m->m[i][0], m->m[i][1], m->m[i][2]);
}

static trip_vec3 times(const trip_covariance *v, trip_vec3 a)
{
    return trip_v3(v->xx * a.x + v->xy * a.y + v->xz * a.z, v->xy * a.x + v->yy * a.y + v->yz * a.z,
                   v->xz * a.x + v->yz * a.y + v->zz * a.z);
}

trip_covariance trip_covariance_mapped(const trip_covariance *v, const trip_affine *m)
{
    trip_vec3 x = row_of(m, 0), y = row_of(m, 1), z = row_of(m, 2);
    trip_vec3 vx = times(v, x), vy = times(v, y), vz = times(v, z);
    return (trip_covariance){
        .xx = trip_dot(x, vx),
        .xy = trip_dot(x, vy),
        .xz = trip_dot(x, vz),
        .yy = trip_dot(y, vy),
        .yz = trip_dot(y, vz),
        .zz = trip_dot(z, vz),
    };
}

/* Returns the gradient of |J c| for the linear part J of a map. */
static trip_vec3 gradient_of_length(const trip_affine *map, trip_vec3 c)
{
    return trip_affine_transpose_vector(map, trip_normalize(trip_affine_vector(map, c)));
}

trip_ray_space trip_ray_space_at(const trip_camera *camera, trip_vec3 from_eye)
{
    if (camera->ortho) {
        double length = trip_length(trip_affine_vector(&camera->index_to_world, camera->r0));
        return (trip_ray_space){ camera->to_x, camera->to_y, trip_scale(camera->forward, length) };
    }
    double inverse = 1 / trip_dot(camera->forward, from_eye);
    double x = trip_dot(camera->to_x, from_eye) * inverse;
    double y = trip_dot(camera->to_y, from_eye) * inverse;
    return (trip_ray_space){
        .x = trip_scale(trip_sub(camera->to_x, trip_scale(camera->forward, x)), inverse),
        .y = trip_scale(trip_sub(camera->to_y, trip_scale(camera->forward, y)), inverse),
        .along = gradient_of_length(&camera->index_to_world, from_eye),
    };
}

double trip_ray_space_volume(const trip_ray_space *j)
{
    return fabs(trip_dot(trip_cross(j->x, j->y), j->along));
}

/* Returns |V| V^-1, the adjugate. */
static trip_covariance adjugate(const trip_covariance *v)
{
    return (trip_covariance){
        .xx = v->yy * v->zz - v->yz * v->yz,
        .xy = v->xz * v->yz - v->xy * v->zz,
        .xz = v->xy * v->yz - v->xz * v->yy,
        .yy = v->xx * v->zz - v->xz * v->xz,
        .yz = v->xy * v->xz - v->xx * v->yz,
        .zz = v->xx * v->yy - v->xy * v->xy,
    };
}

/* Returns the determinant of P V P^T, where x and y are the rows of P: the quadratic form of the
 * adjugate at their cross product (Cauchy-Binet). */
trip_covariance2 trip_covariance_integrated(const trip_covariance *v, const trip_ray_space *j)
{
    trip_vec3 vx = times(v, j->x), vy = times(v, j->y), normal = trip_cross(j->x, j->y);
    trip_covariance cofactors = adjugate(v);
    return (trip_covariance2){
        .xx = trip_dot(j->x, vx),
        .xy = trip_dot(j->x, vy),
        .yy = trip_dot(j->y, vy),
        .det = trip_dot(normal, times(&cofactors, normal)),
    };
}

trip_covariance2 trip_covariance2_low_passed(const trip_covariance2 *s, double h2)
{
    return (trip_covariance2){
        .xx = s->xx + h2,
        .xy = s->xy,
        .yy = s->yy + h2,
        .det = s->det + h2 * (s->xx + s->yy) + h2 * h2,
    };
}

trip_covariance2 trip_covariance2_scaled(const trip_covariance2 *s, double h2)
{
    double largest = 0.5 * (s->xx + s->yy) + hypot(0.5 * (s->xx - s->yy), s->xy);
    double scale = fmax(1, h2 * largest / s->det);
    return (trip_covariance2){ scale * s->xx, scale * s->xy, scale * s->yy,
                               scale * scale * s->det };
}

trip_covariance2 trip_covariance2_inverse(const trip_covariance2 *s)
{
    return (trip_covariance2){ s->yy / s->det, -s->xy / s->det, s->xx / s->det, 1 / s->det };
}
