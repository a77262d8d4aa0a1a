/* Describes the images of a range data set: a sequence of depth images with cameras. Two layouts
 * are folders, and one is a JSON file:
 *
 * - 7-Scenes: frame-*.depth.png, frame-*.color.jpg or .png, frame-*.pose.txt and
 *   camera-intrinsics.txt
 * - ScanNet: depth/N.png, color/N.jpg, pose/N.txt and intrinsic/intrinsic_depth.txt
 * - transforms.json of instant-ngp and nerfstudio, with depth_file_path
 *
 * A pose is a 4 x 4 matrix from the camera to the scene. Cameras of the folders have x to the
 * right, y down and z forward. Cameras of the JSON file have x to the right, y up and z backward. A
 * frame with a missing depth image, or with a pose that is not finite, is left out and counted. */
#ifndef TRIP_RANGE_FRAMES_H
#define TRIP_RANGE_FRAMES_H

#include <stdbool.h>
#include <stdint.h>

/* The standard deviation of a distance z is a + b z + c z^2 (range_shape.h). */
typedef struct trip_range_noise {
    double a, b, c;
} trip_range_noise;

typedef struct trip_range_frame {
    char *depth;       /* path */
    char *colour;      /* path, or NULL */
    double pose[3][4]; /* to the scene, from x to the right, y down, z forward */
    /* In pixels of an image of size[0] x size[1]; sizes of 0 mean the depth image. Pixel i reaches
     * from i to i + 1. A centre that is not a number means the middle of the image. */
    double focal[2], centre[2], size[2];
    double angle; /* field of view in x, in radians, if focal[0] is 0 */
    /* Lens distortion as in OpenCV: k1, k2, p1, p2. */
    double distortion[4];
    double scale;             /* of the stored numbers; 0: 0.001 for integers, 1 for floats */
    double nearest, farthest; /* distances that count; 0: no limit */
    trip_range_noise noise;
} trip_range_frame;

typedef struct trip_range_frames {
    trip_range_frame *frames;
    uint32_t count, room;
    uint32_t without_depth, without_pose; /* frames that are left out */
    bool default_camera;                  /* intrinsics of the layout, since no file has them */
    bool noisy;                           /* the file states the noise */
    const char *layout;                   /* "7-Scenes", "ScanNet" or "transforms.json" */
} trip_range_frames;

/* Whether a folder has one of the layouts. Reports nothing. */
bool trip_range_is_folder(const char *path);
/* Whether the first bytes of a file are of a JSON file with depth images. */
bool trip_range_is_json(const unsigned char *head, unsigned long count);

/* Finds the frames of a folder or of a JSON file. *out must be zeroed. */
int trip_range_frames_find(trip_range_frames *out, const char *path);
void trip_range_frames_free(trip_range_frames *f);

/* Calls `add` with the path of each file of the data set, until it returns a negative number.
 * `path` is the folder or the JSON file. */
int trip_range_frames_list(const char *path, int (*add)(void *user, const char *file), void *user);

#endif
