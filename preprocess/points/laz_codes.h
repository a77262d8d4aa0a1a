/* Decodes the adaptive codes of LAZ (Isenburg, LASzip, 2013): an arithmetic decoder with models of
 * bits and symbols that adapt (Said, 2004), and corrections of predicted integers. The decoder
 * reads a range of a file through a small buffer. One thread at a time. */
#ifndef TRIP_LAZ_CODES_H
#define TRIP_LAZ_CODES_H

#include <stdbool.h>
#include <stdint.h>

enum { TRIP_LAZ_BUFFER_BYTES = 1 << 14, TRIP_LAZ_CONTEXTS_MAX = 22 };

/* Models. They must be zeroed at first. A model begins anew with each chunk: when its epoch differs
 * from the epoch of the decoder. */
typedef struct trip_laz_bit_model {
    uint32_t epoch, zeros, all, share, cycle, left;
} trip_laz_bit_model;

typedef struct trip_laz_model {
    uint32_t epoch, symbols, total, cycle, left;
    uint16_t *counts; /* of the symbols; then the start of each one's share */
} trip_laz_model;

/* Corrections of integers with up to 32 bits. */
typedef struct trip_laz_integers {
    trip_laz_model lengths[TRIP_LAZ_CONTEXTS_MAX];
    trip_laz_model corrections[33]; /* by length */
    trip_laz_bit_model shortest;
    uint32_t length; /* bits of the last correction */
} trip_laz_integers;

/* Memory of the models of one file. */
typedef struct trip_laz_room trip_laz_room;
int trip_laz_room_create(trip_laz_room **out, const char *path);
void trip_laz_room_destroy(trip_laz_room *r); /* NULL is allowed */

typedef struct trip_laz_decoder {
    trip_laz_room *room;
    uint32_t epoch;
    uint32_t value, width;
    /* Bytes of the file from `at` to `end`, and the buffered ones before `at`. */
    int fd;
    uint64_t at, end;
    unsigned char *buffer;
    uint32_t used, have;
    uint32_t beyond; /* bytes that were asked for after the end */
    bool failed;     /* no memory, a read error, or bytes that no encoder writes */
} trip_laz_decoder;

/* Prepares a decoder. Reports a failure. */
int trip_laz_decoder_create(trip_laz_decoder *d, trip_laz_room *room, int fd, const char *path);
void trip_laz_decoder_release(trip_laz_decoder *d);

/* Moves to a range of the file. `begin` reads the first value of a code; a decoder of raw bytes
 * does without. Models begin anew if `epoch` differs from the one before. */
void trip_laz_decoder_aim(trip_laz_decoder *d, uint64_t from, uint64_t to, uint32_t epoch);
void trip_laz_decoder_begin(trip_laz_decoder *d);

/* Returns the position in the file of the next byte. */
uint64_t trip_laz_position(const trip_laz_decoder *d);
/* Returns the next byte of the range, or 0 after its end. */
unsigned trip_laz_byte(trip_laz_decoder *d);
/* Returns whether all values so far came from bytes of the range. */
bool trip_laz_sound(const trip_laz_decoder *d);

uint32_t trip_laz_symbol(trip_laz_decoder *d, trip_laz_model *m, uint32_t symbols);
uint32_t trip_laz_bit(trip_laz_decoder *d, trip_laz_bit_model *m);
/* Returns a number of 1 to 32 bits without a model. */
uint32_t trip_laz_raw_bits(trip_laz_decoder *d, unsigned bits);
/* Returns an integer of 16 or 32 bits near a prediction. */
int32_t trip_laz_integer(trip_laz_decoder *d, trip_laz_integers *i, unsigned bits,
                         int32_t prediction, unsigned context);

#endif
