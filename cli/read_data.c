#include "read_data.h"

#include <string.h>

#include "cached_volume.h"

static int add_found(void *user, const char *path)
{
    return read_files_add(user, path);
}

int read_files_add_data(read_files *r, triptych *t, const char *input,
                        const triptych_brick_options *options)
{
    int status = read_files_add(r, input); /* may be a folder of slices */
    if (status || !cached_volume_wanted(input))
        return status;
    r->pattern = strpbrk(input, "*?[") ? input : NULL;
    return triptych_list_files(t, input, options, add_found, r);
}
