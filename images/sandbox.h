/* What the helper gives up before it looks at a file, so that a decoder that a hostile file takes
 * over can do little: it may read files and answer, no more. One thread, before others start. */
#ifndef TRIP_SANDBOX_H
#define TRIP_SANDBOX_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* From here on, for this process and all its threads: no other program or process, no network, no
 * file opened for writing, made, changed, renamed or removed, no signal to others, and what else a
 * decoder has no use for (tracing, mounting, name spaces, kernel modules). Such calls fail with
 * EPERM. False, with nothing given up, where the kernel cannot do it. */
bool trip_sandbox_enter(void);

/* From here on memory that is more than `bytes` beyond what is held
 * already, with some room for the libraries' own needs, is refused. */
void trip_sandbox_limit_memory(uint64_t bytes);

#ifdef __cplusplus
}
#endif

#endif
