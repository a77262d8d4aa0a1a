/* What a run of `brick` notes down beside its spilled pieces, so that another one can go on where
 * it was when it was killed. Two files in the spill's folder: "journal", records with checksums of
 * which the last may be cut off, and "runs", what was appended to the list that is written in
 * order. They are read back on the machine that wrote them only, and believed no more than any file
 * from outside: what is read is checked against the volume and the parameters. One thread at a
 * time. */
#ifndef TRIP_JOURNAL_H
#define TRIP_JOURNAL_H

#include "format.h"
#include "scan.h"
#include "spill.h"

/* Written once, when the way of working is settled. */
typedef struct trip_journal_start {
    uint64_t identity; /* of the input and all parameters that the output depends on */
    uint64_t scanned;  /* 1: the tally is of all values; 0: it is clear */
    trip_tally tally;
} trip_journal_start;

/* All pieces of the first part of the volume are in segments or in the list in order. */
typedef struct trip_checkpoint {
    uint64_t done;                 /* that part, counted as by trip_walk() */
    uint64_t kept, halo;           /* splats of it */
    uint64_t segments;             /* that there are */
    uint64_t runs, ordered_splats; /* of the list in order */
    uint64_t ordered_bytes[TRIP_PLANES];
    trip_tally tally; /* of the part, unless scanned */
} trip_checkpoint;

/* One run of the list in order. */
typedef struct trip_run_record {
    uint64_t key;
    uint32_t splats;
    uint32_t checksum; /* of its records, trip_run_checksum() */
} trip_run_record;

uint32_t trip_run_checksum(const uint32_t *voxels, const uint32_t *normals, uint32_t splats);

typedef struct trip_journal trip_journal;

typedef struct trip_journal_params {
    bool resume;
    uint64_t identity;
    bool scanned;          /* such a run needs a tally of all values first */
    uint64_t voxels;       /* of the grid */
    uint64_t slice_voxels; /* of a slice, all of which exist; 0: the volume is sparse */
    bool halo;             /* there are lists of a halo */
    uint64_t ordered_bytes[TRIP_PLANES]; /* at hand of the list in order */
} trip_journal_params;

/* Opens the journal in the folder of `spill`. With `resume`, what stands there is read: up to the
 * last checkpoint for which all is still at hand, and its segments are handed to the spill; what is
 * after it is cut off. Another identity, and numbers that no such run writes, are reported
 * failures. Without `resume`, or when nothing stands there, the journal is new. */
int trip_journal_open(trip_journal **out, trip_spill *spill, const trip_journal_params *params,
                      trip_budget *budget);
void trip_journal_close(trip_journal *j);

/* What was read back; NULL when the journal is new, or has no checkpoint. */
const trip_journal_start *trip_journal_get_start(const trip_journal *j);
const trip_checkpoint *trip_journal_get_checkpoint(const trip_journal *j);
/* Reads back run `index` of those up to the checkpoint. */
int trip_journal_read_runs(const trip_journal *j, uint64_t index, trip_run_record *runs,
                           size_t count);

int trip_journal_write_start(trip_journal *j, const trip_journal_start *start);
int trip_journal_add_run(trip_journal *j, const trip_run_record *run);
/* Fills in segments, runs and ordered_splats; the caller the rest. */
int trip_journal_write_checkpoint(trip_journal *j, trip_checkpoint *c, const trip_spill *spill);

#endif
