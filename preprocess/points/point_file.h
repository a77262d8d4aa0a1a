/* Reads the points of a cloud from a file, in the order of the file and in bounded memory. The
 * content and the name of a file tell its format. A cloud of range images may be a folder. One
 * thread at a time. */
#ifndef TRIP_POINT_FILE_H
#define TRIP_POINT_FILE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "point.h"

enum {
    TRIP_POINT_FORMAT_BYTES = 64,
    TRIP_POINT_TEXT_BYTES = 1024,
    TRIP_POINT_NOTES = 16,
    TRIP_POINT_NOTE_BYTES = 256,
};

/* The pose of a scan. */
typedef struct trip_point_scan {
    bool posed;             /* the file gives the position of the scanner */
    double scanner[3];      /* in the coordinates of the points */
    uint64_t width, height; /* of its range grid; 0 for a scan that is not organised */
} trip_point_scan;

typedef struct trip_point_info {
    char format[TRIP_POINT_FORMAT_BYTES]; /* "LAS 1.2, point format 3", ... */
    /* Rows of the file, also those that are left out. 0: unknown before trip_point_file_survey().
     */
    uint64_t count;
    unsigned attributes; /* TRIP_POINT_NORMAL and so on */
    /* The range of intensities that the file states; 0 and 0 if it states none. */
    float intensity_limits[2];
    /* The bounds that the file states, if `bounded`. trip_point_file_survey() replaces them. */
    bool bounded;
    double lo[3], hi[3];
    /* The scans that the header lists, or those up to the last point that was read. A cloud without
     * poses and grids has none. The array may move with every read. */
    uint32_t scan_count;
    const trip_point_scan *scans;
    char up[3]; /* the axis that points up: "y", "-y" or "z"; "": by the custom of the format */
    char extras[TRIP_POINT_TEXT_BYTES];   /* further attributes, by names; or "" */
    char comments[TRIP_POINT_TEXT_BYTES]; /* of the program that wrote the file; or "" */
    /* Choices and faults of the file, one sentence each. */
    unsigned note_count;
    char notes[TRIP_POINT_NOTES][TRIP_POINT_NOTE_BYTES];

    /* trip_point_file_survey() sets these. */
    bool surveyed;
    uint64_t points;   /* that are read in each pass */
    uint64_t left_out; /* with a position that is not finite, or marked as deleted */
    uint64_t empty;    /* cells of range grids without a point */
    float intensity_lo, intensity_hi;
    double time_lo, time_hi;
    uint64_t classes[256]; /* points of each classification */
    unsigned returns_max;
    double uncertainty; /* harmonic mean of the points' uncertainties above 0; 0: none */
} trip_point_info;

typedef struct trip_point_file trip_point_file;

/* Returns whether a file is a cloud of points that trip_point_file_open() reads. A damaged cloud
 * counts, and so does a mesh in PLY. Reports nothing. */
bool trip_point_file_is(const char *path);

/* Calls `add` with the path of each file of a cloud, until it returns a negative number. */
int trip_point_file_list(const char *path, int (*add)(void *user, const char *file), void *user);

/* Opens a cloud. The failure of a file that is no cloud is reported too. */
int trip_point_file_open(const char *path, trip_point_file **out);
void trip_point_file_close(trip_point_file *f); /* NULL is allowed */

const trip_point_info *trip_point_file_info(const trip_point_file *f);

/* Reads all points once, and rewinds. Then the info is exact: bounds, counts, ranges, and the
 * attributes. Colours and intensities that are all 0 are no attribute any more. Without a survey,
 * the first points decide whether colours of sixteen bits hold only eight. A cloud without any
 * point is a reported failure. */
int trip_point_file_survey(trip_point_file *f);

/* Reads up to `room` points. *got_out is 0 only at the end. Points without a finite position are
 * left out, and so are empty cells. Normals have length 1. */
int trip_point_file_read(trip_point_file *f, trip_point *out, size_t room, size_t *got_out);
int trip_point_file_rewind(trip_point_file *f);

/* Sets the axis that points up, such as "z" or "-y": the one that a comment of the file names, or
 * the usual one of the format. */
void trip_point_up(const trip_point_info *info, char up[3]);

/* Prints each note of the info with trip_note(). */
void trip_point_file_print_notes(const trip_point_file *f);

#endif
