/* Reports faults in a line of a text file. */
#ifndef TRIP_FAIL_LINE_H
#define TRIP_FAIL_LINE_H

/* Calls trip_fail(TRIP_ERROR, stage, "NAME: line N", why, ...). */
__attribute__((format(printf, 4, 5))) int trip_fail_line(const char *stage, const char *name,
                                                         long line, const char *why, ...);

#endif
