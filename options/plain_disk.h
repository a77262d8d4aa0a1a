/* Measures the bandwidth of the disk for a program that only reads or writes. It transfers one
 * whole file in large parts by several threads, past the page cache if possible. The caller's
 * thread waits. */
#ifndef TRIP_CLI_PLAIN_DISK_H
#define TRIP_CLI_PLAIN_DISK_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { PLAIN_DISK_THREADS = 8, PLAIN_DISK_TRANSFER_BYTES = 1 << 20 };
#define PLAIN_DISK_MEMORY_BYTES ((size_t)PLAIN_DISK_THREADS * PLAIN_DISK_TRANSFER_BYTES)

/* Zeroed at first; seconds and bytes add up over the calls. */
typedef struct plain_disk {
    double seconds;
    uint64_t bytes;
    bool direct; /* true if O_DIRECT worked for the last file */
    bool look;   /* true: the reader also loads a byte of every cache line */
} plain_disk;

/* Reads a file. `memory` has PLAIN_DISK_MEMORY_BYTES and is aligned to 4096. */
int plain_disk_read(plain_disk *d, const char *path, void *memory);
/* Writes an unnamed file in `folder` and syncs it. Rounds `bytes` up to whole transfers. */
int plain_disk_write(plain_disk *d, const char *folder, uint64_t bytes, void *memory);

/* Advises the kernel to drop the cached pages of a file, if it exists. */
void plain_disk_forget(const char *path);

#endif
