/* Reads the lines of a text file in order, in bounded memory, decompressed, and numbers in them,
 * whatever the locale. One thread at a time. */
#ifndef TRIP_TEXT_LINES_H
#define TRIP_TEXT_LINES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { TRIP_TEXT_COLUMNS_MAX = 64 };

typedef struct trip_text_lines trip_text_lines;

int trip_text_lines_open(trip_text_lines **out, const char *path);
void trip_text_lines_close(trip_text_lines *l); /* NULL is allowed */
int trip_text_lines_rewind(trip_text_lines *l);

/* Sets *line to the next line, without its end, or to NULL at the end of the file. The caller may
 * change the text until the next call. A line of more than 64 KiB or with a zero is a reported
 * failure. */
int trip_text_lines_next(trip_text_lines *l, char **line);
/* Returns the number of the last line, from 1. */
long trip_text_lines_number(const trip_text_lines *l);

/* Splits a line into words at blanks, commas and semicolons. Returns their number, at most
 * TRIP_TEXT_COLUMNS_MAX. */
unsigned trip_text_split(char *line, char *words[TRIP_TEXT_COLUMNS_MAX]);

/* Parses a number, also "nan" and "inf". Returns false for other words. */
bool trip_text_number(const char *word, double *out);

/* Parses the first words of a line, up to `room`. Returns the number of words. Returns -1 if a word
 * is no number, and sets *wrong to the first such word. */
int trip_text_row(char *line, double *values, unsigned room, const char **wrong);

/* Returns whether the words of a line have decimal commas: "1,5 2,25 3,0". */
bool trip_text_has_commas(const char *line);

#endif
