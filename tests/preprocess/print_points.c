/* Writes the points of a file to the standard output, as 18 doubles each: position, normal, radius,
 * colour, intensity, scan, classification, return, returns, time, uncertainty, footprint. A second
 * pass, in other portions, must give the same. Then writes a line with the info to stderr. */
#include <stdbool.h>
#include <stdio.h>
#include <string.h>

#include "point_file.h"

enum { DOUBLES = 18, FIRST = 1000, SECOND = 7 };

static void write_one(const trip_point *p, FILE *to)
{
    const double v[DOUBLES] = {
        p->position[0],         p->position[1],       p->position[2],       (double)p->normal[0],
        (double)p->normal[1],   (double)p->normal[2], (double)p->radius,    (double)p->colour[0],
        (double)p->colour[1],   (double)p->colour[2], (double)p->intensity, p->scan,
        p->classification,      p->return_number,     p->returns,           p->gps_time,
        (double)p->uncertainty, (double)p->footprint
    };
    fwrite(v, sizeof v, 1, to);
}

/* Returns 0, or 1 after a reported failure. */
static int pass(trip_point_file *f, size_t room, FILE *to)
{
    static _Thread_local trip_point batch[FIRST];
    for (size_t got = 1; got > 0;) {
        if (trip_point_file_read(f, batch, room, &got) < 0)
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

static int print(trip_point_file *f)
{
    FILE *first = tmpfile(), *second = tmpfile();
    int status = !first || !second || pass(f, FIRST, first);
    if (!status)
        status = trip_point_file_rewind(f) < 0 || pass(f, SECOND, second);
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
    trip_point_file *f;
    if (argc != 2 || trip_point_file_open(argv[1], &f) < 0)
        return 1;
    int status = trip_point_file_survey(f) < 0 || print(f);
    const trip_point_info *info = trip_point_file_info(f);
    if (!status) {
        for (uint32_t i = 0; i < info->scan_count; i++)
            fprintf(stderr, "scan|%d|%.17g|%.17g|%.17g|%llu|%llu\n", info->scans[i].posed,
                    info->scans[i].scanner[0], info->scans[i].scanner[1], info->scans[i].scanner[2],
                    (unsigned long long)info->scans[i].width,
                    (unsigned long long)info->scans[i].height);
        for (unsigned i = 0; i < info->note_count; i++)
            fprintf(stderr, "note|%s\n", info->notes[i]);
        fprintf(stderr, "%s|%llu|%u|%llu|%llu|%s|%s\n", info->format,
                (unsigned long long)info->points, info->attributes,
                (unsigned long long)info->left_out, (unsigned long long)info->empty, info->extras,
                info->comments);
    }
    trip_point_file_close(f);
    return status;
}
