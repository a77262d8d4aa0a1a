#include "clip_options.h"

#include <string.h>

#include "options.h"

int trip_option_clip_box(const char *text, triptych_clip *clip)
{
    static const char voxels[] = "voxels:";
    double corners[6];
    int count;
    clip->box = 1;
    clip->box_of_voxels = !strncmp(text, voxels, strlen(voxels));
    int status = trip_option_numbers(
        "--clip-box", clip->box_of_voxels ? text + strlen(voxels) : text, 6, 6, corners, &count);
    for (int a = 0; a < 3 && !status; a++) {
        if (!(corners[a] < corners[3 + a]))
            return trip_option_fail(
                "--clip-box", "the second corner must be greater than the first along each axis");
        clip->box_lo[a] = corners[a];
        clip->box_hi[a] = corners[3 + a];
    }
    return status;
}

int trip_option_clip_plane(const char *text, triptych_clip *clip)
{
    const int max = (int)(sizeof clip->plane / sizeof *clip->plane);
    int count;
    if (clip->planes == max)
        return trip_option_fail("--clip-plane", "given too often; at most 6 planes are possible");
    double *plane = clip->plane[clip->planes++];
    int status = trip_option_numbers("--clip-plane", text, 4, 4, plane, &count);
    if (!status && plane[0] == 0 && plane[1] == 0 && plane[2] == 0)
        return trip_option_fail("--clip-plane", "the direction A,B,C is zero");
    return status;
}
