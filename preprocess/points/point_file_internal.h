/* The readers of point clouds, one for each format. */
#ifndef TRIP_POINT_FILE_INTERNAL_H
#define TRIP_POINT_FILE_INTERNAL_H

#include "point_file.h"

/* The first bytes of a file, decompressed. */
typedef struct trip_point_head {
    const char *path;
    const unsigned char *bytes;
    size_t count;
} trip_point_head;

typedef struct trip_point_reader {
    bool (*probe)(const trip_point_head *head);
    /* Sets f->info and f->state. After a failure, the caller calls close(). */
    int (*open)(trip_point_file *f);
    /* Reads up to `room` points, and sets *got_out to 0 only at the end. `out` is zeroed. The
     * values may be anything. trip_point_drop() marks a row that holds no point. */
    int (*read)(trip_point_file *f, trip_point *out, size_t room, size_t *got_out);
    int (*rewind)(trip_point_file *f);
    void (*close)(trip_point_file *f); /* f->state may be NULL */
} trip_point_reader;

/* The range of the colours that a reader delivers. */
typedef enum trip_colour_form {
    TRIP_COLOUR_UNIT,    /* 0 to 1 */
    TRIP_COLOUR_SIXTEEN, /* 0 to 65535; some programs write 0 to 255 */
    TRIP_COLOUR_FLOAT,   /* 0 to 1; some programs write 0 to 255 or 0 to 65535 */
} trip_colour_form;

struct trip_point_file {
    const trip_point_reader *reader;
    char *path;
    trip_point_info info;
    trip_colour_form colour_form;
    bool gaps;   /* rows of a range grid may be empty */
    void *state; /* of the reader */

    /* of point_file.c: */
    float colour_factor;
    trip_point_scan *scans; /* of the info */
    uint32_t scan_room;
    uint64_t left_out, empty; /* in this pass */
    uint64_t deleted;         /* points that the reader left out in this pass, as their marks ask */
};

extern const trip_point_reader trip_read_point_ply, trip_read_las, trip_read_pcd, trip_read_ptx,
    trip_read_pts, trip_read_xyz, trip_read_e57, trip_read_vdb_points, trip_read_range;

/* Marks a point that is left out. */
void trip_point_drop(trip_point *p);

/* Adds a note to the info. Notes beyond the room are dropped. */
__attribute__((format(printf, 2, 3))) void trip_point_note(trip_point_file *f, const char *text,
                                                           ...);

/* Adds the name of a further attribute to the info. */
void trip_point_add_extra(trip_point_file *f, const char *name);

enum { TRIP_POINT_SCANS_MAX = 1 << 16 };

/* Adds a zeroed scan to the info. Returns it, or NULL after a reported failure. */
trip_point_scan *trip_point_add_scan(trip_point_file *f);

/* Reports that memory is exhausted. */
int trip_point_no_memory(const trip_point_file *f);

/* Reports that the file ends early. */
int trip_point_truncated(const trip_point_file *f);

#endif
