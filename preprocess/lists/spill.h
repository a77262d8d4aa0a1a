/* Temporary storage on disk for pieces that do not fit in memory: the runs of an external merge
 * sort. A spill is a folder beside the new data set. Its one data file holds sorted sequences,
 * which are written one after the other and later read in parallel. One thread writes. Any number
 * of threads read finished sequences, one reader each. I/O bypasses the page cache if the file
 * system allows it. */
#ifndef TRIP_SPILL_H
#define TRIP_SPILL_H

#include "merge.h"

typedef struct trip_sequence {
    uint64_t offset;   /* in the data file, a multiple of 4096 */
    uint64_t bytes;    /* length of the pieces */
    uint64_t checksum; /* XXH64 of the pieces' bytes */
    uint32_t list;
    uint32_t retired; /* 1 after it was merged into a later sequence */
} trip_sequence;

typedef struct trip_spill trip_spill;

/* Creates the folder `path`, or opens the folder of an interrupted run, and locks it. Fails if
 * another process holds the lock. Removes the files of an interrupted run unless `resume` is set.
 */
int trip_spill_open(trip_spill **out, const char *path, bool resume, trip_budget *budget);
/* Adds sequences of the interrupted run after those added before. Call it only after opening with
 * `resume`. Returns 1; or 0, with nothing added, if the data file is too short for them. Reports
 * sequences that no run can have written and returns a negative status. */
int trip_spill_restore(trip_spill *s, const trip_sequence *sequences, size_t count);
/* Sets whether the folder remains after closing. By default it remains if it was opened with
 * `resume` and holds a journal. Thus a refused run does not lose the work of the interrupted run.
 */
void trip_spill_keep(trip_spill *s, bool keep);
/* Removes the folder and the program's files in it, unless they are kept. */
void trip_spill_close(trip_spill *s);

const char *trip_spill_path(const trip_spill *s);
/* Returns a file descriptor of the folder. The spill owns it. */
int trip_spill_folder(const trip_spill *s);

/* Write one sequence. Append its pieces by ascending key. */
int trip_spill_begin(trip_spill *s, unsigned list);
int trip_spill_append(trip_spill *s, const void *piece, size_t bytes);
int trip_spill_end(trip_spill *s);

/* Finished sequences in the order of writing. Retired sequences are not read again. */
size_t trip_spill_count(const trip_spill *s);
const trip_sequence *trip_spill_sequence(const trip_spill *s, size_t index);
void trip_spill_retire(trip_spill *s, size_t index);
/* Returns the bytes written so far. Any thread may call it. */
uint64_t trip_spill_bytes(const trip_spill *s);

/* Reads one sequence through the caller's buffer, which has at least trip_sequence_buffer_bytes()
 * and is aligned to 4096. Detects changed bytes at the end of the sequence at the latest, and
 * fails. */
typedef struct trip_sequence_reader {
    trip_piece_source source; /* must be the first member */
    const trip_spill *spill;
    trip_sequence sequence;
    const trip_piece_format *format;
    unsigned char *buffer;
    size_t buffer_bytes, head_bytes; /* the head holds the rest of the previous read */
    size_t begin, end;               /* the unused bytes in the buffer */
    uint64_t next;                   /* next byte of the sequence to read */
    void *hash;                      /* XXH64_state_t of the bytes read so far */
} trip_sequence_reader;

size_t trip_sequence_buffer_bytes(const trip_piece_format *f);
int trip_sequence_reader_open(trip_sequence_reader *r, const trip_spill *s, size_t index,
                              const trip_piece_format *format, void *buffer, size_t buffer_bytes);
void trip_sequence_reader_close(trip_sequence_reader *r);

#endif
