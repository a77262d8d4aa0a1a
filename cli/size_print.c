#include "size_print.h"

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

void size_print_each(unsigned code_bytes, unsigned normal_bytes)
{
    printf("%u byte%s a value, ", code_bytes, code_bytes > 1 ? "s" : "");
    if (normal_bytes)
        printf("%u a normal", normal_bytes);
    else
        printf("no normals");
}
