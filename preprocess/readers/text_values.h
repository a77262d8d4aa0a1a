/* Decodes values that a file stores as text: hexadecimal digits, or decimal numbers separated by
 * blanks, commas or line ends. The text may come in pieces. The parser works on memory only, so
 * that it can be fuzzed. One thread at a time. */
#ifndef TRIP_TEXT_VALUES_H
#define TRIP_TEXT_VALUES_H

#include <stdbool.h>
#include <stddef.h>

#include "volume_info.h"

typedef enum trip_text_form {
    TRIP_TEXT_NONE,    /* the bytes are the values */
    TRIP_TEXT_HEX,     /* two digits for each byte */
    TRIP_TEXT_NUMBERS, /* a number for each value */
} trip_text_form;

/* Must be zeroed at first, except for form and type. */
typedef struct trip_text_decoder {
    trip_text_form form; /* HEX or NUMBERS */
    trip_scalar type;    /* of NUMBERS; a half is not possible */
    char word[64];       /* the started number or byte */
    size_t length;
    unsigned char value[8]; /* the last value; its bytes from `given` on are not delivered yet */
    size_t given, value_bytes;
} trip_text_decoder;

/* Decodes characters from[0 .. count) into at most `bytes` bytes, values in this machine's byte
 * order. Sets the numbers of characters used and of bytes made. Returns false at text that is no
 * value of the type; `word` then holds it. */
bool trip_text_decode(trip_text_decoder *d, const char *from, size_t count, size_t *used, char *to,
                      size_t bytes, size_t *made);
/* Returns the number of characters that `bytes` bytes of values take at least. */
uint64_t trip_text_min_bytes(const trip_text_decoder *d, uint64_t bytes);

#endif
