/* The journal of a run of `brick`. A later run uses it to resume an interrupted one. It has two
 * files in the spill's folder: "journal" holds records with checksums, the last of which may be
 * truncated; "runs" holds the runs appended to the ordered list. Only the same machine reads them
 * back, but they are not trusted: everything is checked against the volume and the parameters. One
 * thread at a time. */
#ifndef TRIP_JOURNAL_H
#define TRIP_JOURNAL_H

#include "format.h"
#include "scan.h"
#include "spill.h"

/* Written once, before the volume is read into pieces. */
typedef struct trip_journal_start {
    uint64_t identity; /* hash of the input and all parameters that determine the output */
    uint64_t scanned;  /* 1 if a scan filled `tally`; 0 if `tally` is zero */
    trip_tally tally;
    trip_fills fills; /* undeclared fill values, and the number of finite values with them */
    uint64_t finite_before;
    uint64_t ids; /* 1 if the values are ids (ids.h) */
} trip_journal_start;

/* A checkpoint: all pieces of the first part of the volume are on disk, in sequences or in the
 * ordered list. */
typedef struct trip_checkpoint {
    uint64_t done;                 /* length of the first part, as trip_walk() counts */
    uint64_t kept, halo;           /* splats of the first part */
    uint64_t sequences;            /* number of sequences in the spill */
    uint64_t runs, ordered_splats; /* runs and splats appended to the ordered list */
    uint64_t ordered_bytes[TRIP_PLANES_OF_VOXELS]; /* bytes of the ordered list's planes */
    trip_tally tally; /* tally of the first part's values, unless scanned */
} trip_checkpoint;

/* Identifies the folder of the output. Written before the data set gets its final name. */
typedef struct trip_journal_output {
    uint64_t device, inode;
} trip_journal_output;

/* One run of the ordered list. */
typedef struct trip_run_record {
    uint64_t key;
    uint32_t splats;
    uint32_t checksum; /* trip_run_checksum() of its records */
} trip_run_record;

uint32_t trip_run_checksum(const uint32_t *voxels, const uint32_t *normals, uint32_t splats);

typedef struct trip_journal trip_journal;

typedef struct trip_journal_params {
    bool resume;
    uint64_t identity;
    bool scanned;          /* a run with these parameters scans the volume first */
    uint64_t voxels;       /* voxels in the grid */
    uint64_t slice_voxels; /* voxels in a slice; 0 for a sparse volume */
    bool halo;             /* the data set has a halo */
    uint64_t ordered_bytes[TRIP_PLANES_OF_VOXELS]; /* bytes of the ordered list's planes that the
                                            interrupted run left */
} trip_journal_params;

/* Opens the journal in the folder of `spill`. With `resume`, reads an existing journal up to the
 * last checkpoint with complete data, adds its sequences to the spill, and truncates the rest.
 * Another identity and impossible numbers are reported failures. Without `resume`, or without a
 * journal, starts a new one. */
int trip_journal_open(trip_journal **out, trip_spill *spill, const trip_journal_params *params,
                      trip_budget *budget);
void trip_journal_close(trip_journal *j);

/* Each function returns a record, or NULL if there is none. The start was read back or written; the
 * last checkpoint and the output were read back. */
const trip_journal_start *trip_journal_get_start(const trip_journal *j);
const trip_checkpoint *trip_journal_get_checkpoint(const trip_journal *j);
const trip_journal_output *trip_journal_get_output(const trip_journal *j);
/* Reads back `count` runs from number `index` on, among the runs up to the checkpoint. */
int trip_journal_read_runs(const trip_journal *j, uint64_t index, trip_run_record *runs,
                           size_t count);

int trip_journal_write_start(trip_journal *j, const trip_journal_start *start);
int trip_journal_add_run(trip_journal *j, const trip_run_record *run);
/* Writes a checkpoint. Sets sequences, runs and ordered_splats; the caller sets the rest. */
int trip_journal_write_checkpoint(trip_journal *j, trip_checkpoint *c, const trip_spill *spill);
/* Writes the last record. */
int trip_journal_write_output(trip_journal *j, const trip_journal_output *output);

#endif
