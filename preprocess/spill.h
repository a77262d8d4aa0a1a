/* Temporary storage on disk for the pieces that do not fit into memory: the runs of an external
 * merge sort. A spill is a folder beside the data set that is being made. Its one data file holds
 * sorted sequences, which are written one after the other and later read at the same time. One
 * thread writes; any number of threads read finished sequences, one reader each. I/O is direct
 * where the file system allows it, which leaves the page cache to others. */
#ifndef TRIP_SPILL_H
#define TRIP_SPILL_H

#include "merge.h"

typedef struct trip_sequence {
    uint64_t offset;   /* in the data file, a multiple of 4096 */
    uint64_t bytes;    /* that its pieces take */
    uint64_t checksum; /* XXH64 of those bytes */
    uint32_t list;
    uint32_t retired; /* 1: merged into a later sequence */
} trip_sequence;

typedef struct trip_spill trip_spill;

/* Creates the folder `path`, or opens the one that an interrupted run left, and locks it; a lock
 * held by another process is a reported failure. Removes the files that an interrupted run left,
 * unless `resume`. */
int trip_spill_open(trip_spill **out, const char *path, bool resume, trip_budget *budget);
/* After opening with `resume`: adds sequences of the interrupted run, which follow those added
 * before. Returns 1; 0, with nothing added, when the data file is too short for them; a negative
 * status after reporting sequences that no run writes. */
int trip_spill_restore(trip_spill *s, const trip_sequence *sequences, size_t count);
/* Whether the folder remains after closing. Initially it does if it was opened with `resume` and
 * holds a journal, so that a run that is refused does not lose the work of the interrupted one. */
void trip_spill_keep(trip_spill *s, bool keep);
/* Removes the folder and the program's files in it, unless they are kept. */
void trip_spill_close(trip_spill *s);

const char *trip_spill_path(const trip_spill *s);
/* A file descriptor of the folder, owned by the spill. */
int trip_spill_folder(const trip_spill *s);

/* Write a sequence; its pieces are appended by ascending key. */
int trip_spill_begin(trip_spill *s, unsigned list);
int trip_spill_append(trip_spill *s, const void *piece, size_t bytes);
int trip_spill_end(trip_spill *s);

/* Finished sequences, in the order they were written. Retired ones are not read any more. */
size_t trip_spill_count(const trip_spill *s);
const trip_sequence *trip_spill_sequence(const trip_spill *s, size_t index);
void trip_spill_retire(trip_spill *s, size_t index);
/* Written so far; any thread. */
uint64_t trip_spill_bytes(const trip_spill *s);

/* Reads one sequence through the caller's buffer of at least trip_sequence_buffer_bytes(), aligned
 * to 4096. Bytes that differ from those written are a reported failure, at the end of the sequence
 * at the latest. */
typedef struct trip_sequence_reader {
    trip_piece_source source; /* the first member: what trip_merge() takes */
    const trip_spill *spill;
    trip_sequence sequence;
    const trip_piece_format *format;
    unsigned char *buffer;
    size_t buffer_bytes, head_bytes; /* the head holds what is left of the last read */
    size_t begin, end;               /* the unused bytes in the buffer */
    uint64_t next;                   /* byte of the sequence that is read next */
    void *hash;                      /* XXH64_state_t of the bytes read so far */
} trip_sequence_reader;

size_t trip_sequence_buffer_bytes(const trip_piece_format *f);
int trip_sequence_reader_open(trip_sequence_reader *r, const trip_spill *s, size_t index,
                              const trip_piece_format *format, void *buffer, size_t buffer_bytes);
void trip_sequence_reader_close(trip_sequence_reader *r);

#endif
