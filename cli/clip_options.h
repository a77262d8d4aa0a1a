/* Options that say what is cut away, of `render`, `view` and `serve`. Each reports a bad value,
 * naming the option, and returns TRIP_USAGE. Main thread only. */
#ifndef TRIP_CLI_CLIP_OPTIONS_H
#define TRIP_CLI_CLIP_OPTIONS_H

#include "triptych.h"

/* The keys are KEY_CLIP_BOX and KEY_CLIP_PLANE. */
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

/* "X,Y,Z,X,Y,Z", or the same in voxels behind "voxels:". */
int trip_option_clip_box(const char *text, triptych_clip *clip);
/* "A,B,C,D"; one plane more each time. */
int trip_option_clip_plane(const char *text, triptych_clip *clip);

#endif
