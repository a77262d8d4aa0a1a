#include "size_print.h"

#include <inttypes.h>
#include <math.h>
#include <stdbool.h>
#include <stdio.h>

#include "budget.h"

void size_print(const data_set_size *s)
{
    char all[32], part[32];
    printf("%s on disk", trip_format_bytes(s->all, all));
    if (s->halo || s->levels)
        printf(": %s of kept voxels and index",
               trip_format_bytes(s->all - s->halo - s->levels, part));
    if (s->halo)
        printf(", %s of halo", trip_format_bytes(s->halo, part));
    if (s->levels)
        printf(", %s of coarse levels", trip_format_bytes(s->levels, part));
    putchar('\n');
}

const char *size_print_count(uint64_t count, char text[static 32])
{
    if (count < 1000000)
        snprintf(text, 32, "%" PRIu64, count);
    else
        snprintf(text, 32, "%.2f million", (double)count * 1e-6);
    return text;
}

const char *size_print_number(double value, char text[static 32])
{
    const bool whole = fabs(value) < 1e15 && floor(value) == value;
    snprintf(text, 32, whole ? "%.0f" : "%.7g", value + 0.0);
    return text;
}

void size_print_each(unsigned code_bytes, unsigned normal_bytes)
{
    printf("%u byte%s a value, ", code_bytes, code_bytes > 1 ? "s" : "");
    if (normal_bytes)
        printf("%u a normal", normal_bytes);
    else
        printf("no normals");
}
