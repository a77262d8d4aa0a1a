/* Reads the records of a LAZ file in order, in bounded memory: the chunks of points, and the table
 * of their sizes, which is decoded along with them. One thread at a time. */
#ifndef TRIP_LAZ_FILE_H
#define TRIP_LAZ_FILE_H

#include <stddef.h>
#include <stdint.h>

typedef struct trip_laz_params {
    const char *path;
    int fd;           /* stays open as long as the reader */
    uint64_t data_at; /* the begin of the points */
    uint64_t end;     /* of the file */
    uint64_t count;   /* of points */
    uint8_t format;   /* of the points, 0 to 10 */
    uint16_t record_bytes;
    /* The record of the header that describes the compression. */
    const unsigned char *description;
    size_t description_bytes;
} trip_laz_params;

typedef struct trip_laz_file trip_laz_file;

int trip_laz_file_open(trip_laz_file **out, const trip_laz_params *params);
void trip_laz_file_close(trip_laz_file *z); /* NULL is allowed */

/* Reads the next `count` records, as LAS stores them. */
int trip_laz_file_read(trip_laz_file *z, unsigned char *records, size_t count);
int trip_laz_file_rewind(trip_laz_file *z);

#endif
