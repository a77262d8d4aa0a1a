/* Pieces on disk: what does not fit into memory while a volume is read. A spill is a folder beside
 * the data set to be; its one data file holds sorted segments, written one after the other and read
 * side by side. One thread writes; any number of readers, one thread each, read finished segments.
 * Direct I/O where the file system takes it, so that the system's memory is left alone. */
#ifndef TRIP_SPILL_H
#define TRIP_SPILL_H

#include "merge.h"

typedef struct trip_segment {
    uint64_t offset;   /* in the file, a multiple of 4096 */
    uint64_t bytes;    /* of pieces */
    uint64_t checksum; /* XXH64 of those bytes */
    uint32_t list;
    uint32_t retired; /* 1: merged into a later segment */
} trip_segment;

typedef struct trip_spill trip_spill;

/* Makes the folder PATH, or takes over the one that an interrupted run left, and locks it: another
 * process at work there is a reported failure. What an interrupted run left in it is removed,
 * unless `resume`. */
int trip_spill_open(trip_spill **out, const char *path, bool resume, trip_budget *budget);
/* After opening with `resume`: takes over these segments of the interrupted run, which follow those
 * taken over before. Returns 1; 0, with nothing taken over, when the file does not reach as far as
 * they do; a negative status after reporting segments that no run writes. */
int trip_spill_restore(trip_spill *s, const trip_segment *segments, size_t count);
/* Whether what is in the folder outlives closing. At first it does where an interrupted run is to
 * be gone on with: a refusal must not cost what that run did. */
void trip_spill_keep(trip_spill *s, bool keep);
/* Removes the folder and what this program put into it, unless that is to be kept. */
void trip_spill_close(trip_spill *s);

const char *trip_spill_path(const trip_spill *s);
/* A descriptor of the folder. */
int trip_spill_folder(const trip_spill *s);

/* Pieces of a segment are appended by ascending key. */
int trip_spill_begin(trip_spill *s, unsigned list);
int trip_spill_append(trip_spill *s, const void *piece, size_t bytes);
int trip_spill_end(trip_spill *s);

/* Finished segments, in the order they were written. */
size_t trip_spill_count(const trip_spill *s);
const trip_segment *trip_spill_segment(const trip_spill *s, size_t index);
void trip_spill_retire(trip_spill *s, size_t index);
uint64_t trip_spill_bytes(const trip_spill *s);

/* Reads one segment through a buffer of at least trip_segment_buffer_bytes(), aligned to 4096, that
 * belongs to the caller. Bytes that are not those written are a reported failure, at the end of the
 * segment at the latest. */
typedef struct trip_segment_reader {
    trip_piece_source source; /* first: this is what a merge takes */
    const trip_spill *spill;
    trip_segment segment;
    const trip_piece_format *format;
    unsigned char *buffer;
    size_t buffer_bytes, head_bytes; /* the head takes what is left of the last read */
    size_t begin, end;               /* bytes at hand */
    uint64_t next;                   /* of the segment, to be read */
    void *hash;
} trip_segment_reader;

size_t trip_segment_buffer_bytes(const trip_piece_format *f);
int trip_segment_reader_open(trip_segment_reader *r, const trip_spill *s, size_t index,
                             const trip_piece_format *format, void *buffer, size_t buffer_bytes);
void trip_segment_reader_close(trip_segment_reader *r);

#endif
