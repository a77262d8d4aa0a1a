/* Flights of the camera: keys in time, between which the view moves along splines, and a transfer
 * function goes over into the next. A path is kept as JSON:
 *
 *   { "triptych_path": 1, "frames_per_second": 30, "keys": [
 *       { "seconds": 0, "eye": [x, y, z], "look": [x, y, z], "up": [x, y, z], "fov": 30,
 *         "function": "bone" },
 *       ... ] }
 *
 * "ortho", the height of a parallel view, stands in the place of "fov"; all keys have the one or
 * all the other. "function" names a preset or a file, "function_text" has one as the text of a
 * `.tf`; a key without goes on with that of the key before it, the first with the default. So it is
 * with "clip", what is cut away, whose parts may be left out:
 *
 *   "clip": { "box": [x, y, z, x, y, z], "voxels": true, "planes": [[a, b, c, d], ...] }
 *
 * "voxels" says that the box is of voxels. Between keys with parts of the same kinds these move;
 * else the next key's come with it. "loop": SECONDS closes the path: it goes on from the last key
 * to the first, in so many seconds, as smoothly as between others. One thread. */
#ifndef TRIP_VIEW_CAMERA_PATH_H
#define TRIP_VIEW_CAMERA_PATH_H

#include <stddef.h>

#include "navigation.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { TRIP_CAMERA_PATH_KEYS = 10000, TRIP_CAMERA_PATH_FRAMES = 100000 };

typedef struct trip_path_key {
    double seconds;         /* more than at the key before */
    trip_navigation camera; /* upright is not kept */
    char *function, *text;  /* the key's own; NULL: none, at most one of them is there */
    bool has_clip;          /* of its own, */
    triptych_clip clip;     /* that */
} trip_path_key;

/* Starts zeroed. */
typedef struct trip_camera_path {
    trip_path_key *keys;
    size_t count;
    double frames_per_second; /* 0: 30 */
    double loop_seconds;      /* from the last key to the first again; 0: it ends */
} trip_camera_path;

void trip_camera_path_release(trip_camera_path *p);

/* Behind the last key. `text` may be NULL. 0, or a reported failure. */
int trip_camera_path_add(trip_camera_path *p, double seconds, const trip_navigation *camera,
                         const char *text);

/* The path as JSON, for free(); NULL without memory. */
char *trip_camera_path_print(const trip_camera_path *p);
int trip_camera_path_save(const trip_camera_path *p, const char *path);
/* Of a path that is zeroed; a reported failure leaves it so. */
int trip_camera_path_parse(trip_camera_path *p, const char *name, const char *text);
int trip_camera_path_load(trip_camera_path *p, const char *path);

/* Frames from the first to the last key, both included; of a loop up to the last before the first
 * key comes again. */
int trip_camera_path_frames(const trip_camera_path *p);
/* When frame number `frame` is. */
double trip_camera_path_seconds(const trip_camera_path *p, int frame);

/* What is seen at a time. At a key it is the key's view to the last bit; between keys the point
 * looked at goes along a Catmull-Rom spline, so does the logarithm of the distance and of the
 * picture's height, and the camera turns about an axis that changes smoothly, at constant speed
 * where the keys are equally spaced turns about one axis. */
trip_navigation trip_camera_path_view(const trip_camera_path *p, double seconds);

/* The functions to mix then: those of keys `from` and `to`, -1 for the default, with share `t` of
 * the latter. */
typedef struct trip_path_mix {
    int from, to;
    double t;
} trip_path_mix;
trip_path_mix trip_camera_path_mix(const trip_camera_path *p, double seconds);

/* What is cut away then; false where no key up to there says so. */
bool trip_camera_path_clip(const trip_camera_path *p, double seconds, triptych_clip *clip);

#ifdef __cplusplus
}
#endif

#endif
