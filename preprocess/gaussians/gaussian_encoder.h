/* Encodes pieces of the lists as bricks. The workers encode some pieces while the caller fills the
 * next ones. The bricks reach the writer in the order of the pieces. One thread owns an encoder. */
#ifndef TRIP_GAUSSIAN_ENCODER_H
#define TRIP_GAUSSIAN_ENCODER_H

#include <stdbool.h>

#include "gaussian_piece.h"
#include "workers.h"

typedef struct trip_gaussian_encoder trip_gaussian_encoder;

/* Takes at most an eighth of the budget's free memory, but room for one piece at least. Returns
 * false if the budget is too small. */
bool trip_gaussian_encoder_create(trip_gaussian_encoder **out, trip_gaussian_writer *writer,
                                  trip_workers *workers, int degree, trip_budget *budget);
/* Returns the room for the spilled splats of the next piece (gaussian_sort.h). */
unsigned char *trip_gaussian_encoder_room(const trip_gaussian_encoder *e);
/* Takes the piece in the room. A piece with a wide gap becomes several bricks. */
int trip_gaussian_encoder_send(trip_gaussian_encoder *e, const trip_gaussian_piece *piece);
/* Waits until the writer has all bricks. No loop runs then. */
int trip_gaussian_encoder_finish(trip_gaussian_encoder *e);
void trip_gaussian_encoder_free(trip_gaussian_encoder *e);

#endif
