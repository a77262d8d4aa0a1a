/* Numbers as text, independent of the locale; safe printing of text from outside; similarity of
 * texts. Any thread. */
#ifndef TRIP_TEXT_H
#define TRIP_TEXT_H

#include <locale.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Parses the whole of `text` as a finite decimal number ("1", "-.5", "2.5e-3"). Returns false for
 * anything else: blanks, trailing text, hexadecimal, "nan", "inf", or a value beyond the range of a
 * double. */
bool trip_text_to_double(const char *text, double *out);

/* Writes the shortest text that reads back as the same number into `text` (at least 32 bytes). */
const char *trip_text_from_double(double value, char *text);

/* Makes this thread print numbers with decimal points. Pass the result to uselocale() to end this.
 */
locale_t trip_text_use_points(void);

/* A character of a text. Valid UTF-8 is printable, except for characters that terminals act on:
 * - control characters, also with two bytes
 * - line separators
 * - marks that change the direction of writing
 * All these have codes below 0x10000. A byte that is not valid UTF-8 counts as one character with
 * code U+FFFD that is not printable. */
typedef struct trip_text_character {
    uint32_t code;
    uint8_t bytes;
    bool printable;
} trip_text_character;

/* Returns the first character of a text that is not empty. */
trip_text_character trip_text_next(const char *text);

/* Size of the longest output of trip_text_show(), with its final zero. */
enum { TRIP_TEXT_SHOWN_BYTES = 20 };
/* Writes a character in visible form, without line feeds: \n, \t, or \xNN for each byte of a
 * character that is not printable. Returns the length. */
unsigned trip_text_show(const char *text, trip_text_character c, char *shown);

/* Writes a whole text in visible form. */
void trip_text_write(FILE *f, const char *text);

/* Writes a text as one word of a shell, in single quotes if a shell would interpret it otherwise.
 * The form $'...' of bash holds characters that are not printable. */
void trip_text_write_word(FILE *f, const char *word);

/* Returns such a word for free(), or NULL without memory. */
char *trip_text_word(const char *word);

/* Returns the Levenshtein distance of two texts in bytes, or SIZE_MAX if one has more than 63
 * bytes. ASCII letters are equal to their capitals. */
size_t trip_text_distance(const char *a, const char *b);

/* Finds the name that a mistyped text means. Zeroed at first, except `text`. */
typedef struct trip_text_nearest {
    const char *text;
    const char *name; /* the most similar name so far, or NULL if none is similar */
    size_t distance;
} trip_text_nearest;

/* Compares the text with one more name. The first of equally similar names is kept. Similar names
 * differ in at most one letter from texts up to 3 letters, in 2 from texts up to 8, else in 3. */
void trip_text_nearest_try(trip_text_nearest *nearest, const char *name);

#ifdef __cplusplus
}
#endif

#endif
