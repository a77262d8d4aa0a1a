/* A stream of a Gaussian scene's splats in exact ascending order of a key. The key is an affine
 * function of the centre: the view depth, or the coordinate of a list in either direction. Equal
 * keys keep the order of the list's records.
 *
 * The stream reads bricks in order of the least key of their box. A splat is final if its key is
 * below the least key of all bricks that are not yet read. A window holds the splats that are not
 * final. The index tells beforehand how many these can be. One thread. */
#ifndef TRIP_GAUSSIAN_STREAM_H
#define TRIP_GAUSSIAN_STREAM_H

#include "gaussian.h"
#include "gaussian_set.h"

typedef struct trip_gaussian_stream trip_gaussian_stream;

/* The key of a centre: direction * centre + offset. */
typedef struct trip_gaussian_key {
    double direction[3], offset;
} trip_gaussian_key;

/* Leaves out bricks that lie behind a plane: no centre c of the brick has
 * normal * c + offset + reach * radius >= 0. The radius is TRIP_GAUSSIAN_REACH times the largest
 * deviation of the brick. */
typedef struct trip_gaussian_plane {
    double normal[3], offset, reach;
} trip_gaussian_plane;

enum { TRIP_GAUSSIAN_SIDES = 4, TRIP_GAUSSIAN_PLANES_MAX = 16 };

/* The level of detail. A node is drawn instead of the nodes inside it if its voxels are at most
 * `voxel_px` pixels wide. The point of the node's box that is nearest to the eye decides. Over the
 * last quarter of an octave before that width, both are drawn, and share out the optical depth. So
 * each Gaussian of the scene is drawn once, by itself or by coarse ones. */
typedef struct trip_gaussian_lod {
    double voxel_px; /* 0: the Gaussians of the scene alone */
    double eye[3];
    bool parallel;
    /* Pixels of a unit of length: in perspective at distance 1 in the picture's corners, otherwise
     * anywhere. */
    double px;
} trip_gaussian_lod;

/* Returns whether a brick may still change the picture. All its centres lie in the box, and its
 * deviations are at most `deviation`. A brick that is not needed once must not be needed later. */
typedef struct trip_gaussian_need {
    bool (*is_needed)(const void *context, const double lo[3], const double hi[3],
                      double deviation); /* NULL: all bricks are needed */
    const void *context;
} trip_gaussian_need;

/* Zero means the default. */
typedef struct trip_gaussian_stream_params {
    int axis; /* of the list that is read: 0, 1, 2 */
    trip_gaussian_key key;
    /* Splats with other keys are left out. Both 0 means all keys. */
    double key_min, key_max;
    /* Keys are less by `reach` times the largest deviation of the brick, plus the greatest value of
     * `spread` in the brick. So splats come in the order in which a plane meets them. Only for keys
     * with a direction of unit length. trip_gaussian_plan.held_records counts for a plane that
     * makes steps of the length `hold`. */
    double reach, hold;
    trip_gaussian_key spread;
    const trip_gaussian_plane *planes; /* at most TRIP_GAUSSIAN_PLANES_MAX */
    unsigned plane_count;
    trip_gaussian_need need; /* asked just before a brick is read; others are left out */
    trip_gaussian_lod lod;
    int degree; /* of the spherical harmonics to read; above the scene's means the scene's */
} trip_gaussian_stream_params;

/* A walk over the nodes that are drawn. Begin with zeros. */
typedef struct trip_gaussian_walk {
    uint64_t node; /* the node found */
    double share;  /* of its optical depth that is drawn, above 0 */
    uint64_t next; /* node to look at */
    uint64_t end;  /* the nodes up to here have the share `rest` */
    double rest;
} trip_gaussian_walk;

/* Finds the next node that is drawn. Returns false after the last one. */
bool trip_gaussian_walk_next(const trip_gaussian_set *set, const trip_gaussian_lod *lod,
                             trip_gaussian_walk *walk);

/* A view for trip_gaussian_view_planes(). right, down and forward have unit length and are
 * orthogonal. */
typedef struct trip_gaussian_view {
    double eye[3], right[3], down[3], forward[3];
    bool parallel;
    /* Half the picture's width and height: tangents of angles in perspective, lengths in parallel
     * projection. */
    double half_width, half_height;
    unsigned width_px, height_px;
} trip_gaussian_view;

/* Sets the planes of the four sides of a view. They keep all splats that reach into the picture,
 * with the Jacobian clamped at 1.3 times the tangents and 0.3 square pixels added. */
void trip_gaussian_view_planes(const trip_gaussian_view *view,
                               trip_gaussian_plane planes[TRIP_GAUSSIAN_SIDES]);

/* Returns the key of a centre, exactly as the stream computes it. */
double trip_gaussian_key_of(const trip_gaussian_key *key, const double centre[3]);

/* The size of a stream, from the index alone. */
typedef struct trip_gaussian_plan {
    uint64_t bricks, records; /* that will be read */
    uint64_t coarse_records;  /* of these */
    uint64_t window_records;  /* greatest number of splats in the window */
    /* With `reach`: greatest number of splats that meet the plane during a step. */
    uint64_t held_records;
    uint64_t bytes;      /* of memory that the stream takes from its budget */
    uint64_t read_bytes; /* from the disk */
} trip_gaussian_plan;

/* The records and bytes read so far. Its plan has at least these numbers. */
typedef struct trip_gaussian_progress {
    uint64_t bricks, records, bytes;
    uint64_t unneeded_records; /* in bricks that were not needed */
} trip_gaussian_progress;

/* Sets *plan. Takes 96 bytes a brick from the budget meanwhile. */
int trip_gaussian_stream_plan(const trip_gaussian_set *set,
                              const trip_gaussian_stream_params *params, trip_budget *budget,
                              trip_gaussian_plan *plan);

/* Fails before it reads anything if the budget is too small. The set must outlive the stream. */
int trip_gaussian_stream_open(trip_gaussian_stream **out, const trip_gaussian_set *set,
                              const trip_gaussian_stream_params *params, trip_budget *budget);
/* Writes the next splats, and their keys unless `keys` is NULL. Sets *got to their number; 0 means
 * the end. Splats of coarse levels are marked as merged. */
int trip_gaussian_stream_next(trip_gaussian_stream *s, trip_gaussian *out, double *keys,
                              size_t room, size_t *got);
const trip_gaussian_plan *trip_gaussian_stream_planned(const trip_gaussian_stream *s);
trip_gaussian_progress trip_gaussian_stream_progress(const trip_gaussian_stream *s);
void trip_gaussian_stream_close(trip_gaussian_stream *s);

#endif
