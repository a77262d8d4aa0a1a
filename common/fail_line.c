#include "fail_line.h"

#include <stdarg.h>
#include <stdio.h>

#include "report.h"

int trip_fail_line(const char *stage, const char *name, long line, const char *why, ...)
{
    char where[512], text[512];
    va_list args;
    va_start(args, why);
    vsnprintf(text, sizeof text, why, args);
    va_end(args);
    snprintf(where, sizeof where, "%.400s: line %ld", name, line);
    return trip_fail(TRIP_ERROR, stage, where, "%s", text);
}
