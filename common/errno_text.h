/* What the system's numbers of errors mean, for people. */
#ifndef TRIP_ERRNO_TEXT_H
#define TRIP_ERRNO_TEXT_H

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Without a dot or a line's end; in `room`, or of static storage. */
const char *trip_errno_text(int error, char *room, size_t bytes);

#ifdef __cplusplus
}
#endif

#endif
