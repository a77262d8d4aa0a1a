/* Camera paths: key frames in time. Between keys the view moves along splines, and the transfer
 * functions and clipping are interpolated. One thread at a time may use a path. The file is JSON:
 *
 *   { "triptych_path": 1, "frames_per_second": 30, "keys": [
 *       { "seconds": 0, "eye": [x, y, z], "look": [x, y, z], "up": [x, y, z], "fov": 30,
 *         "function": "bone" },
 *       ... ] }
 *
 * - "ortho", the height of a parallel view, replaces "fov". All keys of a path have the same one.
 * - "function" names a preset or a file. "function_text" holds a transfer function as `.tf` text.
 *   A key without either continues with the previous key's; the first key uses the default.
 * - "clip" sets the clipping. Each part is optional. A key without "clip" continues with the
 *   previous key's clipping:
 *
 *   "clip": { "box": [x, y, z, x, y, z], "voxels": true, "planes": [[a, b, c, d], ...] }
 *
 * "voxels": true gives the box in voxel indices. If two keys have the same parts of clipping, the
 *   parts move; otherwise the clipping changes at the next key.
 * - "loop": SECONDS closes the path: the view moves from the last key to the first in that time. */
#ifndef TRIP_VIEW_CAMERA_PATH_H
#define TRIP_VIEW_CAMERA_PATH_H

#include <stddef.h>

#include "navigation.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { TRIP_CAMERA_PATH_KEYS = 10000, TRIP_CAMERA_PATH_FRAMES = 100000 };

typedef struct trip_path_key {
    double seconds;         /* strictly ascending */
    trip_navigation camera; /* the file does not store `upright` */
    char *function, *text;  /* of this key; at most one is not NULL */
    bool has_clip;          /* `clip` is set */
    triptych_clip clip;
} trip_path_key;

/* Zero-initialise it. */
typedef struct trip_camera_path {
    trip_path_key *keys;
    size_t count;
    double frames_per_second; /* 0 means 30 */
    double loop_seconds;      /* from the last key to the first; 0 if the path does not loop */
} trip_camera_path;

void trip_camera_path_release(trip_camera_path *p);

/* Appends a key. `text` may be NULL. Returns 0, or a reported failure. */
int trip_camera_path_add(trip_camera_path *p, double seconds, const trip_navigation *camera,
                         const char *text);

/* Returns the path as JSON, for free(), or NULL if memory is exhausted. */
char *trip_camera_path_print(const trip_camera_path *p);
int trip_camera_path_save(const trip_camera_path *p, const char *path);
/* Reads a path into *p, which must be zeroed. A reported failure leaves it zeroed. */
int trip_camera_path_parse(trip_camera_path *p, const char *name, const char *text);
int trip_camera_path_load(trip_camera_path *p, const char *path);

/* Returns the number of frames from the first to the last key, both included. A loop ends one frame
 * before the first key repeats. */
int trip_camera_path_frames(const trip_camera_path *p);
/* Returns the time of frame number `frame`. */
double trip_camera_path_seconds(const trip_camera_path *p, int frame);

/* Returns the view at a time. At a key it equals the key's view bit for bit. Between keys the point
 * looked at follows a Catmull-Rom spline, and so do the logarithms of distance and height of the
 * picture. The camera turns about an axis that changes smoothly. Equally spaced turns about one
 * axis give constant speed. */
trip_navigation trip_camera_path_view(const trip_camera_path *p, double seconds);

/* Two transfer functions to mix: the ones of keys `from` and `to`, where -1 means the default. `t`
 * is the share of `to`. */
typedef struct trip_path_mix {
    int from, to;
    double t;
} trip_path_mix;
trip_path_mix trip_camera_path_mix(const trip_camera_path *p, double seconds);

/* Sets the clipping at a time. Returns false if no key up to then sets clipping. */
bool trip_camera_path_clip(const trip_camera_path *p, double seconds, triptych_clip *clip);

#ifdef __cplusplus
}
#endif

#endif
