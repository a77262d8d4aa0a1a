#include "effects.h"

/* The directions lie on a spiral from pole to pole with equal areas (Fibonacci lattice). */
trip_vec3 trip_even_direction(int number, int count)
{
    const double golden = 2.39996322972865332; /* pi (3 - sqrt(5)) */
    double z = 1 - (2 * number + 1.0) / count, r = sqrt(1 - z * z);
    return trip_v3(r * cos(golden * number), r * sin(golden * number), z);
}

/* Computes the plane of depth cueing, from 0 at the nearest to 1 at the farthest point of the box.
 */
static void set_cue(trip_effects_view *e, const trip_camera *c, const uint64_t dims[3])
{
    double near = INFINITY, far = 0;
    for (int n = 0; n < 8; n++) {
        trip_vec3 corner = trip_v3(n & 1 ? (double)dims[0] - 1 : 0, n & 2 ? (double)dims[1] - 1 : 0,
                                   n & 4 ? (double)dims[2] - 1 : 0);
        double z = trip_dot(c->forward, trip_sub(corner, c->eye));
        near = fmin(near, fmax(0, z));
        far = fmax(far, z);
    }
    double scale = far > near ? 1 / (far - near) : 0;
    for (int a = 0; a < 3; a++)
        e->cue[a] = trip_component(c->forward, a) * scale;
    e->cue[3] = -(trip_dot(c->forward, c->eye) + near) * scale;
}

trip_effects_view trip_effects_view_make(const trip_settings *s, const trip_camera *camera,
                                         const uint64_t dims[3])
{
    trip_effects_view e = { .effects = s->effects };
    if (!trip_effects_some(&s->effects))
        return e;
    const trip_light_grid grid = trip_light_grid_over(dims, s->effects.cells, 1);
    e.bias = TRIP_LIGHT_BIAS * grid.spacing * camera->voxel_world;
    trip_affine_invert(&camera->index_to_world, &e.to_index); /* checked when opened */
    e.point_light = s->point_light;
    e.light = s->point_light ? trip_light_position(s, &camera->index_to_world)
                             : trip_affine_vector(&e.to_index, s->light_direction);
    for (int k = 0; k < 3; k++)
        e.cue_rgb[k] = s->background[k];
    set_cue(&e, camera, dims);
    return e;
}

double trip_effects_phase(double g, double cosine)
{
    double d = 1 + g * g - 2 * g * cosine;
    return (1 - g * g) / (d * sqrt(d));
}

static double clamp(double x)
{
    return x > 0 ? x < 1 ? x : 1 : 0;
}

/* Returns the openness at a point with a unit normal in world space. */
static double openness(const trip_effects_view *e, trip_vec3 voxel, double strength,
                       trip_vec3 normal)
{
    if (!(strength > 0))
        return e->open(e->user, voxel);
    trip_vec3 aside = trip_scale(trip_affine_vector(&e->to_index, normal), strength * e->bias);
    double one = e->open(e->user, trip_add(voxel, aside));
    double other = e->open(e->user, trip_sub(voxel, aside));
    return fmin(1, (1 + strength) * fmax(one, other));
}

/* Returns a point moved towards the light by `distance` world units, but not past a point light.
 * `direction` has unit length. */
static trip_vec3 nearer(const trip_effects_view *e, trip_vec3 voxel, trip_vec3 direction,
                        double distance)
{
    const trip_vec3 step = trip_affine_vector(&e->to_index, trip_scale(direction, distance));
    const trip_vec3 whole = trip_sub(e->light, voxel);
    if (e->point_light && trip_dot(step, step) > trip_dot(whole, whole))
        return e->light;
    return trip_add(voxel, step);
}

static void light_colour(const trip_effects_view *e, const trip_light *light, trip_vec3 voxel,
                         const double *gradient, double rgb[3])
{
    trip_lit lit = { 0 };
    double reached = 1, open = 1, phase = 1;
    trip_vec3 normal = { 0, 0, 0 };
    if (gradient) {
        lit = trip_light_on(light, gradient);
        normal = trip_normalize(trip_v3(gradient[0], gradient[1], gradient[2]));
    }
    if (e->effects.shadows) {
        reached = e->reached(e->user, nearer(e, voxel, light->light, lit.strength * e->bias));
        phase = trip_effects_phase(e->effects.anisotropy, -trip_dot(light->light, light->eye));
    }
    if (e->effects.occlusion)
        open = openness(e, voxel, lit.strength, normal);
    double matt =
        TRIP_AMBIENT * open +
        TRIP_DIFFUSE * reached * ((1 - lit.strength) * phase + lit.strength * lit.diffuse);
    for (int i = 0; i < 3; i++)
        rgb[i] = clamp(rgb[i] * matt + lit.strength * reached * TRIP_SPECULAR * lit.specular);
}

/* Returns 1 inside the data set, falling to 0 at one voxel outside. */
static double inside(const trip_emission_view *v, trip_vec3 at)
{
    double share = 1;
    for (int a = 0; a < 3; a++) {
        const double x = trip_component(at, a);
        share *= fmax(0, 1 - fmax(0, fmax(-x, x - v->last[a])));
    }
    return share;
}

/* Adds E at a point in the drawn data set's index space. */
static void add_emission(const trip_emission_view *v, trip_vec3 voxel, double rgb[3])
{
    const trip_vec3 at = trip_affine_point(&v->to_heat, voxel);
    const double share = inside(v, at);
    const double heat = share > 0 ? share * trip_light_grid_at(v->heat, at) : 0;
    const double x = heat * TRIP_EMISSION_STEPS;
    const int step = x < TRIP_EMISSION_STEPS ? (int)x : TRIP_EMISSION_STEPS - 1;
    const float *entry = v->rgb + 4 * step;
    for (int k = 0; k < 3; k++) {
        const double below = (double)entry[k], above = (double)entry[k + 4];
        rgb[k] += below + (x - step) * (above - below);
    }
}

void trip_effects_colour(const trip_effects_view *e, const trip_light *light, trip_vec3 voxel,
                         const double *gradient, double rgb[3])
{
    if (trip_effects_light(&e->effects))
        light_colour(e, light, voxel, gradient, rgb);
    else if (gradient)
        trip_light_colour(light, gradient, rgb);
    if (e->effects.emission)
        add_emission(&e->emission, voxel, rgb);
    if (!(e->effects.cueing > 0))
        return;
    double f = e->effects.cueing *
               clamp(e->cue[0] * voxel.x + e->cue[1] * voxel.y + e->cue[2] * voxel.z + e->cue[3]);
    for (int i = 0; i < 3; i++)
        rgb[i] += (e->cue_rgb[i] - rgb[i]) * f;
}
