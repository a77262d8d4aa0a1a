#include "read_data.h"

#include <string.h>

#include "cached_volume.h"

static int add_found(void *user, const char *path)
{
    return read_files_add(user, path);
}

/* Adds the files of the objects of a scene file. */
static int add_objects(read_files *r, triptych *t, const char *input,
                       const triptych_brick_options *options)
{
    triptych_object *objects;
    unsigned count;
    int status = triptych_read_scene_file(t, input, &objects, &count);
    for (unsigned i = 0; i < count && !status; i++)
        if (!i || strcmp(objects[i].path, objects[i - 1].path) != 0)
            status = read_files_add_data(r, t, objects[i].path, options);
    triptych_free_objects(objects, count);
    return status;
}

int read_files_add_data(read_files *r, triptych *t, const char *input,
                        const triptych_brick_options *options)
{
    int status = read_files_add(r, input); /* may be a folder of slices */
    if (status || !cached_volume_wanted(input))
        return status;
    if (triptych_is_scene_file(input))
        return add_objects(r, t, input, options);
    r->pattern = strpbrk(input, "*?[") ? input : NULL;
    return triptych_list_files(t, input, options, add_found, r);
}
