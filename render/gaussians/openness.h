/* Ambient occlusion of clouds of points: the share of its surroundings that a surfel sees. A
 * lattice over the cloud holds it. It is made once, from the finest level of the data set.
 *
 * Lattice. Its cells have the length D, and it reaches TRIP_OPENNESS_MARGIN cells beyond the box of
 * most centres. Each surfel gives its optical depth, seen face-on, to the nodes around it, as many
 * times as the cells that it covers. The depth depends on the area, so equal surfaces of more
 * points have equal depths. Light sweeps (light_sweep.h) compute the transmittance T(x, d) of each
 * node x from TRIP_OPENNESS_DIRECTIONS even directions d. Light that matter at the distance r
 * takes away counts exp(-r / R) times (obscurance: Zhukov, Iones & Kronin, An ambient light
 * illumination model, 1998). R is TRIP_OPENNESS_RANGE times the diagonal of the box, so closed
 * rooms are not dark.
 *
 * Openness. A surfel with the normal n towards the eye has the openness
 *
 *     (1/pi) integral of T(x, d) max(0, n . d) over the directions d
 *
 * at the point x, which lies TRIP_OPENNESS_BIAS cells outside: the surfel does not hide its own
 * surroundings. Nodes hold the harmonics of T up to degree 2. The factor max(0, n . d) hardly has
 * others (Ramamoorthi & Hanrahan, An efficient representation for irradiance environment maps,
 * 2001). Interpolation is a normalized convolution (Knutsson & Westin, Normalized and differential
 * convolution, 1993), in which nodes inside matter count less.
 *
 * One thread calls; a complete lattice is read by any thread. Its size depends on the data and the
 * number of cells alone. */
#ifndef TRIP_OPENNESS_H
#define TRIP_OPENNESS_H

#include "camera.h"
#include "light_map.h"
#include "placed_stream.h"
#include "task_runner.h"

#define TRIP_OPENNESS_MARGIN 4
#define TRIP_OPENNESS_DIRECTIONS 96
#define TRIP_OPENNESS_RANGE 0.25
#define TRIP_OPENNESS_BIAS 2.0

typedef struct trip_openness trip_openness;

/* Takes the memory, with `light_cells` / TRIP_OPEN_STRIDE cells along the longest side of the box.
 * The set must outlive the lattice. Fails (reported) if the budget is too small. */
int trip_openness_begin(trip_openness **out, const trip_gaussian_set *set, int light_cells,
                        trip_budget *budget);
/* Does a piece of the work. Returns TRIP_FRAME_DONE, TRIP_FRAME_MORE (renderer.h), or a failure. */
int trip_openness_step(trip_openness *o, const trip_task_runner *runner);
void trip_openness_end(trip_openness *o); /* NULL is allowed */

bool trip_openness_is_complete(const trip_openness *o);
int trip_openness_light_cells(const trip_openness *o);
/* The lattice, and the length of a cell in units of the scene. */
const trip_light_grid *trip_openness_grid(const trip_openness *o, double *cell);
trip_light_stats trip_openness_stats(const trip_openness *o);

/* Returns the openness, 0 to 1, at a centre with a normal of unit length. */
double trip_openness_at(const trip_openness *o, const double centre[3], const double normal[3]);

/* A complete lattice, seen by a camera, in the space of the set. */
typedef struct trip_openness_view {
    const trip_openness *openness;
    bool parallel;
    double eye[3]; /* the position of the eye, or the direction to it */
} trip_openness_view;

trip_openness_view trip_openness_view_of(const trip_openness *o, const trip_camera *c,
                                         const trip_gaussian_transform *placement);
/* A trip_gaussian_change: sets `hidden` of a surfel. */
void trip_openness_change(const void *view, trip_gaussian *g);

#endif
