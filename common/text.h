/* Numbers as text, the same in every locale; text from outside; how alike texts are. Any thread may
 * call these. */
#ifndef TRIP_TEXT_H
#define TRIP_TEXT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

/* The whole of `text` as a finite decimal number ("1", "-.5", "2.5e-3"); false for anything else:
 * blanks, trailing text, hexadecimal, "nan", "inf", or a value beyond the range of a double. */
bool trip_text_to_double(const char *text, double *out);

/* The shortest text that reads back as the same number, into `text` (at least 32 bytes). */
const char *trip_text_from_double(double value, char *text);

/* The first character of a text that is not empty. Printable are those of valid UTF-8 but for what
 * terminals act on: control characters, of two bytes too, line separators, and marks that turn the
 * direction of writing. Their code is below 0x10000. A byte that is no UTF-8 is a character of code
 * U+FFFD, and not printable. */
typedef struct trip_text_character {
    uint32_t code;
    uint8_t bytes;
    bool printable;
} trip_text_character;

trip_text_character trip_text_next(const char *text);

/* Room for the longest way trip_text_show() shows a character, and the zero behind it. */
enum { TRIP_TEXT_SHOWN_BYTES = 20 };
/* A character as people are shown it, on one line: \n, \t, or \xNN for each byte of what is not
 * printable. Returns the length. */
unsigned trip_text_show(const char *text, trip_text_character c, char *shown);

/* All of a text in that way. */
void trip_text_write(FILE *f, const char *text);

/* How many characters have to be put in, left out or changed to make one text of the other; of
 * texts longer than 63 characters, SIZE_MAX. */
size_t trip_text_distance(const char *a, const char *b);

#endif
