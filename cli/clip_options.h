/* Clipping options of `render`, `view` and `serve`. Each function reports a bad value, naming the
 * option, and returns TRIP_USAGE. Main thread only. */
#ifndef TRIP_CLI_CLIP_OPTIONS_H
#define TRIP_CLI_CLIP_OPTIONS_H

#include "triptych.h"

/* Requires the keys KEY_CLIP_BOX and KEY_CLIP_PLANE. */
#define TRIP_OPTIONS_CLIP(group)                                                                   \
    { "clip-box",                                                                                  \
      KEY_CLIP_BOX,                                                                                \
      "X,Y,Z,X,Y,Z",                                                                               \
      0,                                                                                           \
      "Keeps only the inside of a box, from the first corner to the second, in world units; "      \
      "voxels:I,J,K,I,J,K counts in voxels",                                                       \
      group },                                                                                     \
    {                                                                                              \
        "clip-plane", KEY_CLIP_PLANE, "A,B,C,D", 0,                                                \
            "Keeps only the points with A x + B y + C z + D >= 0, in world units; up to 6 planes", \
            group                                                                                  \
    }

/* Parses "X,Y,Z,X,Y,Z" in world units, or "voxels:I,J,K,I,J,K". */
int trip_option_clip_box(const char *text, triptych_clip *clip);
/* Parses "A,B,C,D" and appends the plane. */
int trip_option_clip_plane(const char *text, triptych_clip *clip);

#endif
