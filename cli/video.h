/* Writes frames into a video file by the program ffmpeg, which must be installed. The file gets its
 * name when it is complete. One thread at a time. */
#ifndef TRIP_CLI_VIDEO_H
#define TRIP_CLI_VIDEO_H

#include <stdbool.h>

typedef struct video video;

/* Returns whether a path ends in .mp4, .mov, .mkv or .webm. */
bool video_is_named(const char *path);
/* Checks, before any work, that ffmpeg is installed and that the size is possible for a video. */
int video_check(const char *path, int width, int height);

int video_create(video **out, const char *path, int width, int height, double frames_per_second);
/* Adds a frame of width * height * 4 floats, as triptych_draw() returns it. The frame is shown over
 * black and rounded to 8 bits as in image files. */
int video_add(video *v, const float *rgba);
/* Completes the file. Releases *v also after a failure. */
int video_finish(video *v);
/* Ends ffmpeg, removes the file and releases *v, which may be NULL. */
void video_abandon(video *v);

#endif
