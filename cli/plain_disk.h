/* What the disk gives a program that does nothing else: a file from end to end, past the page cache
 * where that is possible, in large transfers, several at once. */
#ifndef TRIP_CLI_PLAIN_DISK_H
#define TRIP_CLI_PLAIN_DISK_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { PLAIN_DISK_THREADS = 8, PLAIN_DISK_TRANSFER_BYTES = 1 << 20 };
#define PLAIN_DISK_MEMORY_BYTES ((size_t)PLAIN_DISK_THREADS * PLAIN_DISK_TRANSFER_BYTES)

/* Adds up over calls. */
typedef struct plain_disk {
    double seconds;
    uint64_t bytes;
    bool direct; /* the last file was opened with O_DIRECT */
    bool look;   /* a byte of every cache line that is read is looked at */
} plain_disk;

/* `memory`: PLAIN_DISK_MEMORY_BYTES, aligned to 4096. */
int plain_disk_read(plain_disk *d, const char *path, void *memory);
/* `bytes` of an unnamed file in `folder`, up to whole transfers, until the disk has them. */
int plain_disk_write(plain_disk *d, const char *folder, uint64_t bytes, void *memory);

/* Advises the system to drop what it holds of a file, if that is one. */
void plain_disk_forget(const char *path);

#endif
