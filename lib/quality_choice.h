/* The choice that keeps a promise of error: samples per sheet, rays per pixel, and levels of
 * detail. A choice depends on the data, the transfer function, the settings and the width of a
 * voxel in pixels. It never depends on time, memory or threads. quality_trial.h makes choices.
 *
 * Choices are kept in the context and, if the caller names a folder, in a small text file there:
 *
 *     triptych-quality 1
 *     LOOK SAMPLES RAYS LOD ERROR
 *
 * LOOK has 16 hexadecimal digits: a hash of everything but the data. The file's name has the
 * checksum of the data. A file with a fault counts as empty. Plain values; one thread. */
#ifndef TRIP_QUALITY_CHOICE_H
#define TRIP_QUALITY_CHOICE_H

#include <stdbool.h>
#include <stdint.h>

typedef struct trip_choice {
    int samples_per_sheet; /* 0: by the view (sheet_samples.h) */
    int rays;              /* along each side of a pixel */
    double lod_px;         /* 0: the finest level */
    double error;          /* expected mean, of 255; -1: not known */
} trip_choice;

typedef struct trip_choice_key {
    uint64_t data, look;
} trip_choice_key;

enum { TRIP_CHOICES_MAX = 256 };

/* Choices, oldest first. Zero it before use. */
typedef struct trip_choices {
    unsigned count;
    trip_choice_key key[TRIP_CHOICES_MAX];
    trip_choice choice[TRIP_CHOICES_MAX];
} trip_choices;

/* Widths of voxels are divided into steps of half an octave. Step 0 begins at one pixel. */
enum { TRIP_CHOICE_STEP_MIN = -12, TRIP_CHOICE_STEP_MAX = 6 };
int trip_choice_step(double voxel_px);
/* Returns the least width of a step. */
double trip_choice_step_px(int step);

bool trip_choices_find(const trip_choices *all, trip_choice_key key, trip_choice *out);
/* Adds a choice. Drops the oldest one if there is no room. */
void trip_choices_add(trip_choices *all, trip_choice_key key, const trip_choice *choice);

/* Reads the choices of a data set from the folder's file into *all. Adds nothing if there is no
 * file, or if the file has a fault. */
void trip_choices_read(trip_choices *all, const char *folder, uint64_t data);
/* Adds a choice to the folder's file. Reports nothing: without the file, the next program tries
 * again. */
void trip_choices_write(const char *folder, trip_choice_key key, const trip_choice *choice);

#endif
