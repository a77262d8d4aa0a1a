/* Writes the surfels of a data set to the standard output, as 6 doubles each: centre and normal. */
#include <stdio.h>

#include "gaussian_set.h"
#include "gaussian_stream.h"

enum { ROOM = 500 };

static void write_one(const trip_gaussian *g)
{
    const double w = (double)g->rotation[0], x = (double)g->rotation[1];
    const double y = (double)g->rotation[2], z = (double)g->rotation[3];
    const double v[] = { g->centre[0],        g->centre[1],        g->centre[2],
                         2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y) };
    fwrite(v, sizeof v, 1, stdout);
}

int main(int argc, char **argv)
{
    static trip_gaussian batch[ROOM];
    static double keys[ROOM];
    trip_budget *budget;
    trip_gaussian_set *set;
    trip_gaussian_stream *stream;
    trip_gaussian_stream_params p = { .axis = 0, .key.direction = { 1, 0, 0 } };
    if (argc != 2 || trip_budget_create(&budget, 0) ||
        trip_gaussian_set_open(&set, argv[1], budget) ||
        trip_gaussian_stream_open(&stream, set, &p, budget))
        return 1;
    for (size_t got = 1; got > 0;) {
        if (trip_gaussian_stream_next(stream, batch, keys, ROOM, &got))
            return 1;
        for (size_t i = 0; i < got; i++)
            write_one(&batch[i]);
    }
    trip_gaussian_stream_close(stream);
    trip_gaussian_set_close(set);
    trip_budget_destroy(budget);
    return 0;
}
