/* Restricts the helper process before it opens a file. A hostile file that takes over a decoder can
 * then only read files and answer. Call it with one thread, before others start. */
#ifndef TRIP_SANDBOX_H
#define TRIP_SANDBOX_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Restricts this process and all its threads permanently. Forbidden calls fail with EPERM:
 * - starting programs or processes, and signals to other processes,
 * - network,
 * - opening files for writing, and creating, changing, renaming or removing files,
 * - calls that no decoder needs, such as tracing, mounting, name spaces and kernel modules.
 * Returns false, without any restriction, if the kernel does not support it. */
bool trip_sandbox_enter(void);

/* Limits the memory that this process may allocate from now on to `bytes`, plus some room for the
 * libraries' own needs. */
void trip_sandbox_limit_memory(uint64_t bytes);

#ifdef __cplusplus
}
#endif

#endif
