/* Takes the place of read_vdb.cpp where OpenVDB is switched off: recognises such files and refuses
 * them.
 */
#include <string.h>
#include <strings.h>

#include "report.h"
#include "volume_reader.h"

static bool probe(const char *path, const unsigned char *head, size_t bytes,
                  const trip_volume_params *params)
{
    (void)params;
    size_t length = strlen(path);
    return (bytes >= 4 && memcmp(head, " BDV", 4) == 0) ||
           (length > 4 && bytes > 0 && strcasecmp(path + length - 4, ".vdb") == 0);
}

static int refuse(const char *path, const trip_volume_params *params, trip_budget *budget,
                  trip_volume_info *info, void **state)
{
    (void)params, (void)budget, (void)info, (void)state;
    return trip_fail(TRIP_ERROR, "read", path, "this program was built without OpenVDB");
}

const trip_volume_reader trip_read_vdb = { .format = "openvdb", .probe = probe, .open = refuse };
