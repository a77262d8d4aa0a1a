/* The blurred transfer function of `post` frames in GL memory (blurred_function.h). It is kept
 * while its table stays the same, because blurring takes long. Owned by one renderer; the context
 * must be current. Its bytes count against the budget. */
#ifndef TRIP_GL_SHEET_BLUR_H
#define TRIP_GL_SHEET_BLUR_H

#include <epoxy/gl.h>
#include <stdint.h>

#include "blurred_function.h"
#include "draw_codes.h"

typedef struct trip_gl_sheet_blur {
    trip_budget *budget;
    GLuint sums; /* the head and the entries, as in blurred.glsl; 0 before the first use */
    GLuint
        growths; /* growth of the deviation of each stored code; 0 if draw codes are stored ones */
    uint64_t table_hash[2];
    double units[TRIP_BLURRED_ROWS]; /* value of 1 in each row's sums, per world unit */
} trip_gl_sheet_blur;

/* Blurs a table of 65536 entries with extinction per world unit, one for each draw code. Fails if
 * the memory does not suffice. */
int trip_gl_sheet_blur_set(trip_gl_sheet_blur *b, const trip_tf_entry *table,
                           const trip_draw_codes *draw, double voxel_world);
/* Frees a function that this frame does not need, unless it takes a small part of the memory left.
 */
void trip_gl_sheet_blur_rest(trip_gl_sheet_blur *b);
void trip_gl_sheet_blur_bind(const trip_gl_sheet_blur *b);
void trip_gl_sheet_blur_release(trip_gl_sheet_blur *b);

#endif
