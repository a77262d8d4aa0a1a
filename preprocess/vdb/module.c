#include "module.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

/* The program passes the same table each time. */
static const trip_vdb_host *_Atomic host;

static const trip_vdb_readers readers = { &trip_vdb_reader, &trip_vdb_points_reader };

__attribute__((visibility("default"))) const trip_vdb_readers *
trip_vdb_module(const trip_vdb_host *program)
{
    if (strcmp(program->version, TRIP_VERSION) != 0)
        return NULL;
    host = program;
    return &readers;
}

/* The program's functions under the names that the module calls. */

int(trip_fail)(int status, const char *stage, const char *where, const char *why, ...)
{
    char text[2048];
    va_list args;
    va_start(args, why);
    vsnprintf(text, sizeof text, why, args);
    va_end(args);
    return host->fail(status, stage, where, "%s", text);
}

void *trip_budget_take(trip_budget *b, size_t bytes)
{
    return host->take(b, bytes);
}

void trip_budget_release(trip_budget *b, void *memory, size_t bytes)
{
    host->release(b, memory, bytes);
}

uint64_t trip_budget_left_bytes(const trip_budget *b)
{
    return host->left_bytes(b);
}

const char *trip_format_bytes(uint64_t bytes, char *text)
{
    return host->format_bytes(bytes, text);
}

int trip_interrupted(void)
{
    return host->interrupted();
}
