/* Recognises OpenVDB files. The module in vdb/ reads them; it is loaded for the first file and
 * stays loaded. */
#include <dlfcn.h>
#include <stdlib.h>
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

typedef struct state {
    const trip_volume_reader *module;
    void *of_module;
} state;

int trip_vdb_load_module(const trip_vdb_readers **out)
{
    static const trip_vdb_host host = { TRIP_VERSION,           (trip_fail),
                                        trip_budget_take,       trip_budget_release,
                                        trip_budget_left_bytes, trip_format_bytes,
                                        trip_interrupted };
    char path[PATH_MAX];
    if (!trip_companion_find(path, MODULE, TRIP_VDB_MODULE_BUILT, R_OK))
        return trip_fail(
            TRIP_ERROR, "read", MODULE,
            "OpenVDB files need this module beside this program or in ../libexec/triptych");
    void *library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    if (!library)
        return trip_fail(TRIP_ERROR, "read", path, "cannot load: %s", dlerror());
    void *symbol = dlsym(library, TRIP_VDB_ENTRY);
    trip_vdb_entry_point entry;
    memcpy(&entry, &symbol, sizeof entry); /* ISO C cannot convert void * to a function pointer */
    *out = symbol ? entry(&host) : NULL;
    if (*out)
        return 0;
    return trip_fail(TRIP_ERROR, "read", path, "belongs to another version of this program");
}

static int open_vdb(const char *path, const trip_volume_params *params, trip_budget *budget,
                    trip_volume_info *info, void **out)
{
    const trip_vdb_readers *readers = NULL;
    int status = trip_vdb_load_module(&readers);
    if (status)
        return status;
    const trip_volume_reader *module = readers->volumes;
    state *s = malloc(sizeof *s);
    if (!s)
        return trip_fail(TRIP_ERROR, "read", path, "out of memory");
    s->module = module;
    status = module->open(path, params, budget, info, &s->of_module);
    if (status)
        free(s);
    else
        *out = s;
    return status;
}

static void close_vdb(void *opaque)
{
    state *s = opaque;
    s->module->close(s->of_module);
    free(s);
}

static int rewind_vdb(void *opaque)
{
    const state *s = opaque;
    return s->module->rewind(s->of_module);
}

static int next_box(void *opaque, trip_volume_portion *portion)
{
    const state *s = opaque;
    return s->module->next(s->of_module, portion);
}

static int decode_box(const void *opaque, const trip_volume_portion *portion, const int64_t lo[3],
                      const int64_t size[3], float *values, uint8_t *active)
{
    const state *s = opaque;
    return s->module->decode(s->of_module, portion, lo, size, values, active);
}

static void release_box(void *opaque, trip_volume_portion *portion)
{
    const state *s = opaque;
    s->module->release(s->of_module, portion);
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

int trip_vdb_load_module(const trip_vdb_readers **out)
{
    *out = NULL;
    return trip_fail(TRIP_ERROR, "read", MODULE, "this program was built without OpenVDB");
}

static int refuse(const char *path, const trip_volume_params *params, trip_budget *budget,
                  trip_volume_info *info, void **state)
{
    (void)params, (void)budget, (void)info, (void)state;
    return trip_fail(TRIP_ERROR, "read", path,
                     "cannot read OpenVDB files: this program was built without OpenVDB");
}

const trip_volume_reader trip_read_vdb = { .format = "openvdb", .probe = probe, .open = refuse };

#endif
