/* Writes the data set of a Gaussian scene: bricks of the lists along X, Y and Z, then the index.
 * The folder gets its name only when all bytes are on the disk. One thread. */
#ifndef TRIP_GAUSSIAN_WRITER_H
#define TRIP_GAUSSIAN_WRITER_H

#include <stdbool.h>

#include "budget.h"
#include "gaussian_format.h"

typedef struct trip_gaussian_writer trip_gaussian_writer;

typedef struct trip_gaussian_writer_params {
    const char *path;
    bool replace; /* replaces an existing data set, of any kind */
    int degree;
    uint32_t flags;   /* trip_gaussian_flag */
    const char *text; /* JSON; NULL means "{}" */
} trip_gaussian_writer_params;

int trip_gaussian_writer_open(trip_gaussian_writer **out, const trip_gaussian_writer_params *params,
                              trip_budget *budget);
/* Returns the folder that is being written. Temporary files may lie there. */
const char *trip_gaussian_writer_folder(const trip_gaussian_writer *w);
/* The palette of a scene. */
typedef struct trip_gaussian_palette {
    const unsigned char *entries; /* see trip_gaussian_encode_entry() */
    uint64_t count;
    /* Returns the number of the entry for a splat. */
    unsigned (*find)(const void *user, const unsigned char *splat);
    const void *user;
} trip_gaussian_palette;

/* Stores the coefficients by a palette. Call it before the first brick. All that the palette points
 * to must outlive the writer. */
void trip_gaussian_writer_set_palette(trip_gaussian_writer *w,
                                      const trip_gaussian_palette *palette);
/* Gives the nodes, which the writer completes with their bricks. They must outlive the writer. */
void trip_gaussian_writer_set_nodes(trip_gaussian_writer *w, trip_file_gaussian_node *nodes,
                                    uint64_t count);
/* Returns the bytes of a brick in all planes, at most. */
size_t trip_gaussian_writer_codes_bytes(const trip_gaussian_writer *w);
/* Encodes a brick into `codes`, for trip_gaussian_writer_append(). Its records are in order; see
 * trip_gaussian_encode(). Any thread, even while another appends a brick. */
void trip_gaussian_writer_encode(const trip_gaussian_writer *w, int size_class,
                                 const unsigned char *const *splats, unsigned count,
                                 trip_file_gaussian_brick *brick, unsigned char *codes);
/* Appends a brick to a list. Nodes ascend along an axis. */
int trip_gaussian_writer_append(trip_gaussian_writer *w, int axis, uint64_t node,
                                const trip_file_gaussian_brick *brick, const unsigned char *codes);
/* Writes the index and gives the folder its name. The header gets the `typical` bounds. */
int trip_gaussian_writer_finish(trip_gaussian_writer *w, const double typical_lo[3],
                                const double typical_hi[3]);
/* Removes the folder unless it is finished, and frees the writer. */
void trip_gaussian_writer_close(trip_gaussian_writer *w);

#endif
