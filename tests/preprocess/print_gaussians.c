/* Writes the Gaussians of a file to the standard output, as 59 doubles each: centre, deviations,
 * rotation, opacity, and 16 coefficients of three channels. A second pass, in other portions, must
 * give the same. */
#include <stdbool.h>
#include <stdio.h>
#include <string.h>

#include "gaussian_file.h"

enum { DOUBLES = 59, FIRST = 1000, SECOND = 7 };

static void write_one(const trip_gaussian *g, FILE *to)
{
    double v[DOUBLES];
    int n = 0;
    for (int a = 0; a < 3; a++)
        v[n++] = g->centre[a];
    for (int a = 0; a < 3; a++)
        v[n++] = g->deviations[a];
    for (int i = 0; i < 4; i++)
        v[n++] = g->rotation[i];
    v[n++] = g->opacity;
    for (int k = 0; k < TRIP_SH_MAX; k++)
        for (int c = 0; c < 3; c++)
            v[n++] = g->sh[k][c];
    fwrite(v, sizeof v, 1, to);
}

/* Returns 0, or 1 after a reported failure. */
static int pass(trip_gaussian_file *f, size_t room, FILE *to)
{
    static _Thread_local trip_gaussian batch[FIRST];
    for (size_t got = 1; got > 0;) {
        if (trip_gaussian_file_read(f, batch, room, &got) < 0)
            return 1;
        for (size_t i = 0; i < got; i++)
            write_one(&batch[i], to);
    }
    return 0;
}

static bool equal(FILE *a, FILE *b)
{
    int x = 0;
    rewind(a);
    rewind(b);
    while (x != EOF)
        if ((x = getc(a)) != getc(b))
            return false;
    return true;
}

static int print(trip_gaussian_file *f)
{
    FILE *first = tmpfile(), *second = tmpfile();
    int status = !first || !second || pass(f, FIRST, first);
    if (!status)
        status = trip_gaussian_file_rewind(f) < 0 || pass(f, SECOND, second);
    if (!status && !equal(first, second)) {
        fputs("the second pass differs\n", stderr);
        status = 3;
    }
    if (!status) {
        rewind(first);
        for (int c; (c = getc(first)) != EOF;)
            putchar(c);
    }
    if (first)
        fclose(first);
    if (second)
        fclose(second);
    return status;
}

int main(int argc, char **argv)
{
    trip_gaussian_file *f;
    if (argc != 2 || trip_gaussian_file_open(argv[1], &f) < 0)
        return 1;
    const trip_gaussian_info *info = trip_gaussian_file_info(f);
    int status = print(f);
    if (!status)
        fprintf(stderr, "%s|%llu|%d|%d|%d|%s|%s\n", info->format, (unsigned long long)info->count,
                info->degree, info->antialiased, info->flat, info->up, info->trainer);
    trip_gaussian_file_close(f);
    return status;
}
