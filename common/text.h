/* Numbers as text, independent of the locale; safe printing of text from outside; similarity of
 * texts. Any thread. */
#ifndef TRIP_TEXT_H
#define TRIP_TEXT_H

#include <locale.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

/* The whole of `text` as a finite decimal number ("1", "-.5", "2.5e-3"); false for anything else:
 * blanks, trailing text, hexadecimal, "nan", "inf", or a value beyond the range of a double. */
bool trip_text_to_double(const char *text, double *out);

/* The shortest text that reads back as the same number, into `text` (at least 32 bytes). */
const char *trip_text_from_double(double value, char *text);

/* Numbers that this thread prints have decimal points from here on, until what is returned is given
 * to uselocale(). */
locale_t trip_text_use_points(void);

/* A character of a text. Printable are all characters of valid UTF-8 but for those that terminals
 * act on: control characters, also those of two bytes, line separators, and marks that change the
 * direction of writing; the codes of these are below 0x10000. A byte that is not valid UTF-8 counts
 * as a character of code U+FFFD that is not printable. */
typedef struct trip_text_character {
    uint32_t code;
    uint8_t bytes;
    bool printable;
} trip_text_character;

/* The first character of a text that is not empty. */
trip_text_character trip_text_next(const char *text);

/* Room for the longest output of trip_text_show(), with its final zero. */
enum { TRIP_TEXT_SHOWN_BYTES = 20 };
/* Writes a character in visible form, without line breaks: \n, \t, or \xNN for each byte of what is
 * not printable. Returns the length. */
unsigned trip_text_show(const char *text, trip_text_character c, char *shown);

/* Writes a whole text in that form. */
void trip_text_write(FILE *f, const char *text);

/* As one word of a shell: in single quotes where it would be read as something else. */
void trip_text_write_word(FILE *f, const char *word);

/* The Levenshtein distance of two texts, in bytes; SIZE_MAX for texts of more than 63. */
size_t trip_text_distance(const char *a, const char *b);

#endif
