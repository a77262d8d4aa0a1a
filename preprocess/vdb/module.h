/* The module triptych-openvdb.so: all that is linked with OpenVDB, which takes longer to load than
 * most commands take to run. read_vdb.c loads it when the first such file is opened. What it calls
 * of the program comes in a table, so that it works with the program and the library alike, which
 * show no symbols of their own. */
#ifndef TRIP_VDB_MODULE_H
#define TRIP_VDB_MODULE_H

#include <stddef.h>

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

/* The module's one symbol, TRIP_VDB_ENTRY. NULL: of another version. The table is kept. */
typedef const trip_volume_reader *(*trip_vdb_entry_point)(const trip_vdb_host *host);
#define TRIP_VDB_ENTRY "trip_vdb_module"
const trip_volume_reader *trip_vdb_module(const trip_vdb_host *host);

/* Within the module. */
extern const trip_volume_reader trip_vdb_reader; /* read_vdb.cpp */

#ifdef __cplusplus
}
#endif

#endif
