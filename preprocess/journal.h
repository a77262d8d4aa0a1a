/* The journal of a run of `brick`, with which a later run resumes one that was interrupted. Two
 * files in the spill's folder: "journal", records with checksums, of which the last may be cut off,
 * and "runs", what was appended to the ordered list. They are read back only on the machine that
 * wrote them, but are trusted no more than any file from outside: everything read is checked
 * against the volume and the parameters. One thread at a time. */
#ifndef TRIP_JOURNAL_H
#define TRIP_JOURNAL_H

#include "format.h"
#include "scan.h"
#include "spill.h"

/* Written once, before the volume is read into pieces. */
typedef struct trip_journal_start {
    uint64_t identity; /* of the input and all parameters that the output depends on */
    uint64_t scanned;  /* 1: the volume was scanned, into `tally`; 0: that is clear */
    trip_tally tally;
} trip_journal_start;

/* All pieces of the first part of the volume are in sequences or in the ordered list. */
typedef struct trip_checkpoint {
    uint64_t done;                       /* the length of that part, as trip_walk() counts it */
    uint64_t kept, halo;                 /* its splats */
    uint64_t sequences;                  /* of the spill */
    uint64_t runs, ordered_splats;       /* appended to the ordered list */
    uint64_t ordered_bytes[TRIP_PLANES]; /* of the ordered list's planes */
    trip_tally tally;                    /* of that part's values, unless scanned */
} trip_checkpoint;

/* Written before the data set takes its name: the folder that does. */
typedef struct trip_journal_output {
    uint64_t device, inode;
} trip_journal_output;

/* One run of the ordered list. */
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
    bool scanned;                        /* a run with these parameters scans the volume first */
    uint64_t voxels;                     /* of the grid */
    uint64_t slice_voxels;               /* of a slice of a dense volume; 0: the volume is sparse */
    bool halo;                           /* there are lists of a halo */
    uint64_t ordered_bytes[TRIP_PLANES]; /* what is left of the ordered list's planes */
} trip_journal_params;

/* Opens the journal in the folder of `spill`. With `resume`, an existing one is read up to the last
 * checkpoint whose data are all there; its sequences are added to the spill, and what follows it is
 * cut off. Another identity, and numbers that no such run writes, are reported failures. Without
 * `resume`, or if there is none, the journal is new. */
int trip_journal_open(trip_journal **out, trip_spill *spill, const trip_journal_params *params,
                      trip_budget *budget);
void trip_journal_close(trip_journal *j);

/* The records read back or written; NULL where there is none. The checkpoint is the last one that
 * was read back, and the output is one that was. */
const trip_journal_start *trip_journal_get_start(const trip_journal *j);
const trip_checkpoint *trip_journal_get_checkpoint(const trip_journal *j);
const trip_journal_output *trip_journal_get_output(const trip_journal *j);
/* Reads back `count` runs from number `index` on, of those up to the checkpoint. */
int trip_journal_read_runs(const trip_journal *j, uint64_t index, trip_run_record *runs,
                           size_t count);

int trip_journal_write_start(trip_journal *j, const trip_journal_start *start);
int trip_journal_add_run(trip_journal *j, const trip_run_record *run);
/* Fills in sequences, runs and ordered_splats; the caller fills the rest. */
int trip_journal_write_checkpoint(trip_journal *j, trip_checkpoint *c, const trip_spill *spill);
/* The last record. */
int trip_journal_write_output(trip_journal *j, const trip_journal_output *output);

#endif
