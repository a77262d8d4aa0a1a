/* Texts for the error numbers of the system. */
#ifndef TRIP_ERRNO_TEXT_H
#define TRIP_ERRNO_TEXT_H

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Returns the text, without a dot or a line feed. It lies in `room` or in static storage. */
const char *trip_errno_text(int error, char *room, size_t bytes);

#ifdef __cplusplus
}
#endif

#endif
