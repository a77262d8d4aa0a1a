/* In the place of write_vdb.cpp, where OpenVDB is switched off. */
#include "report.h"
#include "write_vdb.h"

int trip_vdb_write(const char *path, const int64_t dims[3], trip_vdb_source *source, void *user)
{
    (void)dims, (void)source, (void)user;
    return trip_fail(TRIP_ERROR, "write", path, "this program was built without OpenVDB");
}
