/* An opened data set of a Gaussian scene: its checked header and index. Read-only and shared by
 * threads after trip_gaussian_set_open(). Opening checks checksums, sizes, orders, sums and ranges
 * of the index. trip_gaussian_set_read() checks each brick that it reads. */
#ifndef TRIP_GAUSSIAN_SET_H
#define TRIP_GAUSSIAN_SET_H

#include <stdbool.h>

#include "budget.h"
#include "gaussian_format.h"

/* The records in the order of one axis. Bricks stand by node. The bricks of a node stand by
 * ascending class of size, then by slabs of ascending coordinate. */
typedef struct trip_gaussian_list {
    const trip_file_gaussian_brick *bricks;
    uint64_t brick_count;
    int fd[TRIP_GAUSSIAN_PLANES]; /* open for reading; -1 if absent */
} trip_gaussian_list;

typedef struct trip_gaussian_set {
    char *path;
    trip_file_gaussian_header header;
    const trip_file_gaussian_node *nodes;
    double finest_lo[3], finest_hi[3]; /* bounds of the ellipsoids of the finest level */
    const unsigned char *palette; /* entries; NULL without a palette */
    trip_gaussian_list lists[3];  /* along X, Y, Z */
    char *text;                   /* JSON, null-terminated */
    uint64_t bytes;               /* of all files */
    void *memory;                 /* the index and a terminator of its text; from the budget */
    size_t memory_bytes;
    trip_budget *budget;
} trip_gaussian_set;

/* Whether a folder's index begins as the index of a Gaussian scene. Reports nothing. */
bool trip_gaussian_set_is(const char *path);

int trip_gaussian_set_open(trip_gaussian_set **out, const char *path, trip_budget *budget);
void trip_gaussian_set_close(trip_gaussian_set *s);

/* Reads a brick's bytes of a plane and checks their checksum. `to` has room for
 * records * trip_gaussian_plane_bytes() bytes. Any thread. */
int trip_gaussian_set_read(const trip_gaussian_set *s, int axis, uint64_t brick, unsigned plane,
                           void *to);

/* Reads and checks all bricks. Reports the first fault. */
int trip_gaussian_set_verify(const trip_gaussian_set *s, trip_budget *budget);

/* Writes the name of a plane file, such as "x.gaussians", to `name` (at least 32 bytes). */
const char *trip_gaussian_plane_name(const trip_file_gaussian_header *h, int axis, unsigned plane,
                                     char *name);

#endif
