/* Frames into a video file by the program ffmpeg, which has to be installed. The file gets its name
 * when it is complete. One thread at a time. */
#ifndef TRIP_CLI_VIDEO_H
#define TRIP_CLI_VIDEO_H

#include <stdbool.h>

typedef struct video video;

/* Whether a file so named is a video: .mp4, .mov, .mkv or .webm. */
bool video_is_named(const char *path);
/* Before any work: whether there is an ffmpeg, and the size is one that videos have. */
int video_check(const char *path, int width, int height);

int video_create(video **out, const char *path, int width, int height, double frames_per_second);
/* width * height * 4 floats, as triptych_draw() gives them; shown over black, rounded to 8 bits as
 * in pictures. */
int video_add(video *v, const float *rgba);
/* 0 once the file is there; releases *v in any case. */
int video_finish(video *v);
/* NULL is fine. */
void video_abandon(video *v);

#endif
