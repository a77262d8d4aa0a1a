/* Reads grids of points of OpenVDB. The module in vdb/ decodes them. */
#include "point_file_internal.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "byte_stream.h"
#include "vdb/module.h"

typedef struct vdb {
    const trip_vdb_point_reader *reader;
    void *of_module;
} vdb;

/* The first grid of the file is one of points. */
static bool probe(const trip_point_head *head)
{
    enum { PLACE_MAX = 2048 }; /* of the type of the first grid */
    static const char type[] = "Tree_ptdataidx32_";
    const size_t bytes = head->count < PLACE_MAX ? head->count : PLACE_MAX;
    return bytes >= 4 && memcmp(head->bytes, " BDV", 4) == 0 &&
           memmem(head->bytes, bytes, type, strlen(type)) != NULL;
}

static int open_vdb(trip_point_file *f)
{
    const trip_vdb_readers *readers = NULL;
    trip_vdb_points_info info = { 0 };
    snprintf(f->info.format, sizeof f->info.format, "OpenVDB points");
    vdb *v = f->state = calloc(1, sizeof *v);
    if (!v)
        return trip_point_no_memory(f);
    int status = trip_byte_stream_refuse_compressed(f->path, f->info.format);
    if (status == 0)
        status = trip_vdb_load_module(&readers);
    if (status < 0)
        return status;
    v->reader = readers->points;
    status = v->reader->open(f->path, &info, &v->of_module);
    if (status < 0)
        return status;
    f->info.attributes = info.attributes;
    f->colour_form = TRIP_COLOUR_FLOAT;
    memcpy(f->info.extras, info.extras, sizeof f->info.extras);
    snprintf(f->info.comments, sizeof f->info.comments, "%s%sgrid %s", info.comments,
             *info.comments ? "; " : "", info.grid);
    return 0;
}

static int read_vdb(trip_point_file *f, trip_point *out, size_t room, size_t *got_out)
{
    const vdb *v = f->state;
    return v->reader->read(v->of_module, out, room, got_out);
}

static int rewind_vdb(trip_point_file *f)
{
    const vdb *v = f->state;
    return v->reader->rewind(v->of_module);
}

static void close_vdb(trip_point_file *f)
{
    vdb *v = f->state;
    if (v && v->of_module)
        v->reader->close(v->of_module);
    free(v);
}

const trip_point_reader trip_read_vdb_points = { probe, open_vdb, read_vdb, rewind_vdb, close_vdb };
