/* Makes journals of `brick` with valid checksums from few bytes. Each record has one byte of kind,
 * two bytes of length, then that many bytes. */
#ifndef TRIP_JOURNAL_FILE_H
#define TRIP_JOURNAL_FILE_H

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <xxhash.h>

#include "journal.h"

enum { RAW, START, CHECKPOINT, CHECKPOINT_WITH_SEQUENCES, OUTPUT, KINDS };

/* Writes a record. The data give its first bytes, and the rest is zero. Data of a checkpoint with
 * sequences begin with a count byte and the sequences. */
static void write_record(FILE *f, unsigned kind, const uint8_t *data, size_t size)
{
    size_t sequences = kind == CHECKPOINT_WITH_SEQUENCES && size ? data[0] % 8 : 0;
    size_t body = kind == RAW      ? size
                  : kind == START  ? sizeof(trip_journal_start)
                  : kind == OUTPUT ? sizeof(trip_journal_output)
                                   : sizeof(trip_checkpoint);
    size_t bytes = body + sequences * sizeof(trip_sequence);
    unsigned char *record = calloc(1, bytes + 1);
    if (sequences && size > 1 + sequences * sizeof(trip_sequence)) {
        memcpy(record + body, data + 1, sequences * sizeof(trip_sequence));
        data += 1 + sequences * sizeof(trip_sequence);
        size -= 1 + sequences * sizeof(trip_sequence);
    }
    memcpy(record, data, size < body ? size : body);
    const uint64_t number = kind == CHECKPOINT_WITH_SEQUENCES ? CHECKPOINT
                            : kind == OUTPUT                  ? 3
                                                              : kind;
    const uint64_t head[3] = { number, bytes, XXH64(record, bytes, number) };
    fwrite(head, sizeof head, 1, f);
    fwrite(record, bytes, 1, f);
    free(record);
}

static void write_journal(FILE *journal, const uint8_t *data, size_t size)
{
    while (size >= 3) {
        size_t bytes = data[1] | (size_t)data[2] << 8;
        bytes = bytes < size - 3 ? bytes : size - 3;
        write_record(journal, data[0] % KINDS, data + 3, bytes);
        data += 3 + bytes;
        size -= 3 + bytes;
    }
}

#endif
