/* Draws `post` frames (render/sheet.h). It decodes the runs of a pass into sheets in GL memory.
 * When enough consecutive sheets are complete, it draws the intervals between them into the layer
 * and releases them. All work is split into parts of bounded cost. The result at a pixel does not
 * depend on how many sheets are drawn at once. Owned by one renderer; the context must be current.
 */
#ifndef TRIP_GL_SHEETS_H
#define TRIP_GL_SHEETS_H

#include "gl/constants.h"
#include "gl/lattices.h"
#include "gl/ring.h"
#include "gl/sheet_blur.h"
#include "gl/sheet_tf.h"
#include "gl/sheet_pass.h"
#include "gl/sheet_positions.h"
#include "gl/sheet_textures.h"
#include "gl/target.h"
#include "gl/variant.h"

/* A sheet in GL memory. It is complete once the next sheet begins. */
typedef struct trip_gl_sheet {
    int64_t number;
    int layer;          /* index in the textures */
    unsigned min, max;  /* bounds of its codes; min > max if it is empty */
    unsigned deviation; /* maximum of its deviation codes; 0 if nothing is blurred */
    bool has_gradients;
} trip_gl_sheet;

/* The current batch, copied into a slot of the ring. */
typedef struct trip_gl_sheet_batch {
    trip_gl_slot *slot;
    size_t codes_offset; /* offset of the codes and deviations, which follow the squares */
    size_t next_run;     /* the first run not yet decoded */
    uint32_t next_square;
    bool begun;
} trip_gl_sheet_batch;

/* The current drawing, from `front` to sheet `to` of held[]. */
typedef struct trip_gl_sheet_drawing {
    int to;        /* nothing is drawn if to <= front */
    bool all;      /* releases all sheets afterwards */
    bool in_group; /* the sheets up to `done` are being drawn */
    int done;
    int ends;
    int band, row; /* of the next draw call */
} trip_gl_sheet_drawing;

typedef struct trip_gl_sheets {
    /* Owned by the renderer. */
    const trip_gl_context *context;
    trip_gl_ring *ring;
    trip_gl_queue *queue;
    trip_gl_variants *variants;
    const trip_gl_constants *constants;
    const trip_gl_lattices *lattices;
    trip_gl_target *target;

    trip_gl_sheet_textures textures;
    trip_gl_sheet_tf function;
    trip_gl_sheet_blur blur;
    trip_gl_sheet_positions positions;
    GLuint pass_block, ends_block;
    const trip_frame *frame;
    const trip_coordinates *coordinates;
    unsigned effects;
    int axis;
    const trip_pass *pass; /* the current pass; NULL before the first */
    int64_t way;           /* step from one sheet to the next: 1 or -1 */
    int64_t first[2], size[2];
    trip_gl_sheet_view view;
    double eye; /* the eye's coordinate along the list, in sheet numbers */
    trip_gl_sheet held[TRIP_GL_SHEETS_MAX]; /* consecutive sheets; the last may be incomplete */
    int count;
    int front; /* first sheet not yet drawn from; 1 if the kernel still needs held[0] */
    trip_gl_sheet_batch batch;
    trip_gl_sheet_drawing drawing;
} trip_gl_sheets;

int trip_gl_sheets_begin_frame(trip_gl_sheets *s, const trip_frame *frame);
int trip_gl_sheets_begin_layer(trip_gl_sheets *s, int axis);
/* Does one part of the work for the batch. Returns 1 if more is left. */
int trip_gl_sheets_draw(trip_gl_sheets *s, const trip_batch *batch);
/* Draws one part of the last sheets, after all batches of the layer. Returns 1 if more is left. */
int trip_gl_sheets_end_layer(trip_gl_sheets *s);
void trip_gl_sheets_release(trip_gl_sheets *s);

#endif
