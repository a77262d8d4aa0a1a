/* The files that `triptych render` writes: their names, and that these may be taken. */
#ifndef TRIP_RENDER_FILES_H
#define TRIP_RENDER_FILES_H

#include "sequence.h"

enum { RENDER_FILE_BYTES = 4096 };

/* Of several frames image.png -> image-007.png; a video has them all. */
int render_file_name(const render_options *o, const char *output, int frame,
                     char path[RENDER_FILE_BYTES]);

/* What cannot be written at the end, or would replace what is read or what else is written: 0, or a
 * reported failure. Once the sequence is loaded, before any work. */
int render_files_check(const sequence *s, triptych *t);

#endif
