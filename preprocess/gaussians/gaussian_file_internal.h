/* The readers of Gaussian scenes, one for each format, and their conversions. */
#ifndef TRIP_GAUSSIAN_FILE_INTERNAL_H
#define TRIP_GAUSSIAN_FILE_INTERNAL_H

#include "gaussian_file.h"

/* The first bytes of a file, decompressed. */
typedef struct trip_gaussian_head {
    const char *path;
    const unsigned char *bytes;
    size_t count;
} trip_gaussian_head;

typedef struct trip_gaussian_reader {
    bool (*probe)(const trip_gaussian_head *head);
    /* Sets f->info and f->state. After a failure, the caller calls close(). */
    int (*open)(trip_gaussian_file *f);
    /* Reads the next `count` Gaussians, which the file holds by its info. The values may be
     * anything, and rotations have any length. */
    int (*read)(trip_gaussian_file *f, trip_gaussian *out, size_t count);
    int (*rewind)(trip_gaussian_file *f);
    void (*close)(trip_gaussian_file *f); /* f->state may be NULL */
} trip_gaussian_reader;

struct trip_gaussian_file {
    const trip_gaussian_reader *reader;
    char *path;
    trip_gaussian_info info;
    void *state;   /* of the reader */
    uint64_t done; /* Gaussians read in this pass */
    uint64_t left_out, unturned;
    bool warned;
};

extern const trip_gaussian_reader trip_read_gaussian_ply, trip_read_compressed_ply, trip_read_spz,
    trip_read_splat, trip_read_ksplat, trip_read_sog, trip_read_gltf_gaussians;

static inline float trip_sigmoid(double logit)
{
    return (float)(1 / (1 + __builtin_exp(-logit)));
}

struct trip_ply_header;
/* Sets the parts of f->info that comments of a PLY tell: trainer, antialiasing and axis. */
void trip_ply_describe(const struct trip_ply_header *h, trip_gaussian_file *f);

/* Reports that memory is exhausted. */
int trip_gaussian_no_memory(const trip_gaussian_file *f);

#endif
