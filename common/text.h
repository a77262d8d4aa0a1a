/* Numbers as text, the same in every locale. Any thread may call these. */
#ifndef TRIP_TEXT_H
#define TRIP_TEXT_H

#include <stdbool.h>

/* The whole of `text` as a finite decimal number ("1", "-.5", "2.5e-3"); false for anything else:
 * blanks, trailing text, hexadecimal, "nan", "inf", or a value beyond the range of a double. */
bool trip_text_to_double(const char *text, double *out);

/* The shortest text that reads back as the same number, into `text` (at least 32 bytes). */
const char *trip_text_from_double(double value, char *text);

#endif
