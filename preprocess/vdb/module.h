/* The interface of the module triptych-openvdb.so, the only part that is linked with OpenVDB.
 * Loading OpenVDB takes longer than most commands take to run. read_vdb.c therefore loads the
 * module when the first OpenVDB file is opened. The program passes its functions to the module in a
 * table. Thus the module works with both the program and the library, which export no such symbols.
 */
#ifndef TRIP_VDB_MODULE_H
#define TRIP_VDB_MODULE_H

#include <stddef.h>

#include "point.h"
#include "report.h"
#include "volume_reader.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct trip_vdb_host {
    const char *version; /* of the program; a module of another version refuses it */
    int (*fail)(int status, const char *stage, const char *where, const char *why, ...);
    void *(*take)(trip_budget *budget, size_t bytes);
    void (*release)(trip_budget *budget, void *memory, size_t bytes);
    uint64_t (*left_bytes)(const trip_budget *budget);
    const char *(*format_bytes)(uint64_t bytes, char *text);
    int (*interrupted)(void);
} trip_vdb_host;

/* A grid of points. */
typedef struct trip_vdb_points_info {
    char grid[128];      /* its name */
    char extras[1024];   /* names of attributes that are not read */
    char comments[256];  /* the program that wrote the file */
    unsigned attributes; /* TRIP_POINT_NORMAL and so on; colours are as in the file */
} trip_vdb_points_info;

/* Reads the first grid of points of a file. Failures are reported. */
typedef struct trip_vdb_point_reader {
    int (*open)(const char *path, trip_vdb_points_info *info, void **out);
    /* Reads up to `room` points into zeroed memory. *got_out is 0 only at the end. */
    int (*read)(void *state, trip_point *out, size_t room, size_t *got_out);
    int (*rewind)(void *state);
    void (*close)(void *state);
} trip_vdb_point_reader;

typedef struct trip_vdb_readers {
    const trip_volume_reader *volumes;
    const trip_vdb_point_reader *points;
} trip_vdb_readers;

/* The module's only symbol, TRIP_VDB_ENTRY. Returns NULL for another version. The module keeps the
 * pointer to the table. */
typedef const trip_vdb_readers *(*trip_vdb_entry_point)(const trip_vdb_host *host);
#define TRIP_VDB_ENTRY "trip_vdb_module"
const trip_vdb_readers *trip_vdb_module(const trip_vdb_host *host);

/* Only within the module. */
extern const trip_volume_reader trip_vdb_reader;           /* read_vdb.cpp */
extern const trip_vdb_point_reader trip_vdb_points_reader; /* vdb_points.cpp */

/* Only outside of the module: loads it, unless it is loaded already. Reports a failure. It is never
 * closed. */
int trip_vdb_load_module(const trip_vdb_readers **out);

#ifdef __cplusplus
}
#endif

#endif
