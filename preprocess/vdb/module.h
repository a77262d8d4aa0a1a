/* The interface of the module triptych-openvdb.so, the only part that is linked with OpenVDB.
 * Loading OpenVDB takes longer than most commands take to run. read_vdb.c therefore loads the
 * module when the first OpenVDB file is opened. The program passes its functions to the module in a
 * table. Thus the module works with both the program and the library, which export no such symbols.
 */
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

/* The module's only symbol, TRIP_VDB_ENTRY. Returns NULL for another version. The module keeps the
 * pointer to the table. */
typedef const trip_volume_reader *(*trip_vdb_entry_point)(const trip_vdb_host *host);
#define TRIP_VDB_ENTRY "trip_vdb_module"
const trip_volume_reader *trip_vdb_module(const trip_vdb_host *host);

/* Only within the module. */
extern const trip_volume_reader trip_vdb_reader; /* read_vdb.cpp */

#ifdef __cplusplus
}
#endif

#endif
