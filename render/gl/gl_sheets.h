/* Frames that classify after interpolation (render/sheet.h): the runs of a pass are decoded into
 * sheets in GL memory; as soon as some in a row are complete, what lies between them is drawn into
 * the layer, and they are let go of. All of it is done in parts of a bounded cost. What a pixel
 * gets depends on the slices alone, never on how many are drawn at a time. Owned by one renderer;
 * needs its context current. */
#ifndef TRIP_GL_SHEETS_H
#define TRIP_GL_SHEETS_H

#include "gl/constants.h"
#include "gl/lattices.h"
#include "gl/ring.h"
#include "gl/sheet_tf.h"
#include "gl/sheet_pass.h"
#include "gl/sheet_positions.h"
#include "gl/sheet_textures.h"
#include "gl/target.h"
#include "gl/variant.h"

/* A sheet at hand; complete once another one begins. */
typedef struct trip_gl_sheet {
    int64_t number;
    int layer;         /* of the textures */
    unsigned min, max; /* codes lie in between; least > most: none */
    bool has_gradients;
} trip_gl_sheet;

/* The batch at hand, as it is in a slot of the ring. */
typedef struct trip_gl_sheet_batch {
    trip_gl_slot *slot;
    size_t codes_offset; /* behind the squares */
    size_t next_run;     /* not decoded */
    uint32_t next_square;
    bool begun;
} trip_gl_sheet_batch;

/* What is being drawn: from the front to sheet `to`. */
typedef struct trip_gl_sheet_drawing {
    int to;        /* the front or less: nothing */
    bool all;      /* then no sheet is held */
    bool in_group; /* up to `done` are being drawn */
    int done;
    int ends;
    int band, row; /* next */
} trip_gl_sheet_drawing;

typedef struct trip_gl_sheets {
    /* The renderer's. */
    const trip_gl_context *context;
    trip_gl_ring *ring;
    trip_gl_queue *queue;
    trip_gl_variants *variants;
    const trip_gl_constants *constants;
    const trip_gl_lattices *lattices;
    trip_gl_target *target;

    trip_gl_sheet_textures textures;
    trip_gl_sheet_tf function;
    trip_gl_sheet_positions positions;
    GLuint pass_block, ends_block;
    const trip_frame *frame;
    const trip_coordinates *coordinates;
    unsigned effects;
    int axis;
    const trip_pass *pass; /* being drawn; NULL: none */
    int64_t way;           /* from one sheet to the next: 1 or -1 */
    int64_t first[2], size[2];
    trip_gl_sheet_view view;
    double eye;                             /* along the sheets, as they are numbered */
    trip_gl_sheet held[TRIP_GL_SHEETS_MAX]; /* in a row; the last may not be complete */
    int count;
    int front; /* the first that is not drawn from: 1 where what lies before it reaches over it */
    trip_gl_sheet_batch batch;
    trip_gl_sheet_drawing drawing;
} trip_gl_sheets;

int trip_gl_sheets_begin_frame(trip_gl_sheets *s, const trip_frame *frame);
int trip_gl_sheets_begin_layer(trip_gl_sheets *s, int axis);
/* A part of the work that the batch calls for; 1: there is more. */
int trip_gl_sheets_draw(trip_gl_sheets *s, const trip_batch *batch);
/* Every batch of the layer was drawn: a part of its last sheets is; 1: there is more. */
int trip_gl_sheets_end_layer(trip_gl_sheets *s);
void trip_gl_sheets_release(trip_gl_sheets *s);

#endif
