/* Names the files that `triptych render` writes, and checks that it may write them. Main thread
 * only. */
#ifndef TRIP_RENDER_FILES_H
#define TRIP_RENDER_FILES_H

#include "sequence.h"

enum { RENDER_FILE_BYTES = 4096 };

/* Returns the name of a frame's file. With several frames, image.png becomes image-007.png. A video
 * keeps its name. */
int render_file_name(const render_options *o, const char *output, int frame,
                     char path[RENDER_FILE_BYTES]);

/* Checks the outputs before any work, after the sequence is loaded. Fails if a file cannot be
 * written, would replace an input, or would be written twice. Returns 0 or a reported failure. */
int render_files_check(const sequence *s, triptych *t);

#endif
