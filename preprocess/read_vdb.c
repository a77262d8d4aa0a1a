/* OpenVDB grids: recognised here, read by the module in vdb/, which is loaded for the first of them
 * and stays. */
#include <dlfcn.h>
#include <pthread.h>
#include <string.h>
#include <strings.h>
#include <unistd.h>

#include "companion.h"
#include "report.h"
#include "vdb/module.h"
#include "volume_reader.h"

#define MODULE "triptych-openvdb.so"

static bool probe(const char *path, const unsigned char *head, size_t bytes,
                  const trip_volume_params *params)
{
    (void)params;
    size_t length = strlen(path);
    return (bytes >= 4 && memcmp(head, " BDV", 4) == 0) ||
           (length > 4 && bytes > 0 && strcasecmp(path + length - 4, ".vdb") == 0);
}

#ifdef TRIP_VDB_MODULE_BUILT

static const trip_volume_reader *module;

static int load_module(void)
{
    static const trip_vdb_host host = { TRIP_VERSION,           (trip_fail),
                                        trip_budget_take,       trip_budget_release,
                                        trip_budget_left_bytes, trip_format_bytes };
    char path[PATH_MAX];
    if (!trip_companion_find(path, MODULE, TRIP_VDB_MODULE_BUILT, R_OK))
        return trip_fail(TRIP_ERROR, "read", MODULE,
                         "is not beside this program nor in ../libexec/triptych; it reads OpenVDB");
    void *library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    if (!library)
        return trip_fail(TRIP_ERROR, "read", path, "cannot load: %s", dlerror());
    void *symbol = dlsym(library, TRIP_VDB_ENTRY);
    trip_vdb_entry_point entry;
    memcpy(&entry, &symbol, sizeof entry); /* ISO C converts no void * into a function */
    module = symbol ? entry(&host) : NULL;
    if (module)
        return 0;
    dlclose(library);
    return trip_fail(TRIP_ERROR, "read", path, "belongs to another version of this program");
}

static int open_vdb(const char *path, const trip_volume_params *params, trip_budget *budget,
                    trip_volume_info *info, void **state)
{
    static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
    pthread_mutex_lock(&lock);
    int status = module ? 0 : load_module();
    pthread_mutex_unlock(&lock);
    return status ? status : module->open(path, params, budget, info, state);
}

static void close_vdb(void *state)
{
    module->close(state);
}

static int rewind_vdb(void *state)
{
    return module->rewind(state);
}

static int next_box(void *state, trip_volume_portion *portion)
{
    return module->next(state, portion);
}

static int decode_box(const void *state, const trip_volume_portion *portion, const int64_t lo[3],
                      const int64_t size[3], float *values, uint8_t *active)
{
    return module->decode(state, portion, lo, size, values, active);
}

static void release_box(void *state, trip_volume_portion *portion)
{
    module->release(state, portion);
}

const trip_volume_reader trip_read_vdb = {
    .format = "openvdb",
    .probe = probe,
    .open = open_vdb,
    .close = close_vdb,
    .rewind = rewind_vdb,
    .next = next_box,
    .decode = decode_box,
    .release = release_box,
};

#else

static int refuse(const char *path, const trip_volume_params *params, trip_budget *budget,
                  trip_volume_info *info, void **state)
{
    (void)params, (void)budget, (void)info, (void)state;
    return trip_fail(TRIP_ERROR, "read", path, "this program was built without OpenVDB");
}

const trip_volume_reader trip_read_vdb = { .format = "openvdb", .probe = probe, .open = refuse };

#endif
