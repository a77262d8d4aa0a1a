/* Reads netCDF-4 files, which are HDF5 files. The rules for variables, coordinates and missing
 * values are the same as in read_netcdf.c. The helper program triptych-netcdf (image_helper.h)
 * reads the files with libnetcdf, one slice at a time. libnetcdf crashes on damaged files, so all
 * replies of the helper are checked. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "helper_slices.h"
#include "report.h"
#include "volume_coordinates.h"

static bool probe(const char *path, const unsigned char *head, size_t bytes,
                  const trip_volume_params *params)
{
    (void)path, (void)params;
    return bytes >= 8 && memcmp(head, "\x89HDF\r\n\x1a\n", 8) == 0;
}

#ifdef TRIP_NETCDF_READ

/* Returns whether a name is valid for a netCDF variable: no control characters. */
static bool is_name(const char *name, size_t room)
{
    const size_t length = strnlen(name, room);
    bool good = length < room;
    for (size_t i = 0; i < length; i++)
        good &= (unsigned char)name[i] >= ' ' && name[i] != 127;
    return good;
}

/* Returns the fault in the helper's answer, or NULL. A later check refuses sizes that exceed the
 * memory. */
static const char *fault_of(const trip_image_netcdf *v)
{
    if (v->type < 0 || v->type >= TRIP_SCALARS)
        return "slices of an unknown type";
    if (v->dims[0] < 1 || v->dims[1] < 1 || v->dims[2] < 1)
        return "slices without a size";
    if (!is_name(v->name, sizeof v->name))
        return "a variable without a name";
    if (v->times < 1 || v->channels < 1)
        return "no times or channels";
    if ((v->placed & ~7) || (v->others & ~1) || (v->deeper & ~1))
        return "coordinates of an unknown axis";
    return isfinite(v->slope) && isfinite(v->inter) ? NULL : "values that are not finite";
}

/* Computes the size of the coordinates of all axes that have some. Returns false on overflow. */
static bool coordinate_bytes(const trip_image_netcdf *v, uint64_t *out)
{
    uint64_t count = 0;
    for (int a = 0; a < 3; a++)
        if (v->placed >> a & 1 && __builtin_add_overflow(count, (uint64_t)v->dims[a], &count))
            return false;
    return !__builtin_mul_overflow(count, sizeof(double), out);
}

/* Receives the description of the variable. `left` gets the number of bytes that follow it. */
static int open_variable(trip_helper_slices *s, const trip_volume_params *params,
                         trip_image_netcdf *v, uint64_t *left)
{
    const char *name = params->grid;
    const size_t length = name ? strlen(name) : 0;
    const int64_t numbers[5] = { (int64_t)trip_budget_left_bytes(s->budget), (int64_t)length,
                                 params->time, params->channel };
    uint64_t bytes = 0, expected = 0;
    int status = trip_image_helper_start_netcdf(&s->helper, "read");
    if (status == 0)
        status = trip_image_helper_request(s->helper, TRIP_IMAGE_OPEN_NETCDF, s->path, numbers, -1);
    if (status == 0)
        status = trip_image_helper_send(s->helper, name, length);
    if (status == 0)
        status = trip_image_helper_outcome(s->helper, &bytes);
    if (status < 0)
        return status;
    if (bytes < sizeof *v)
        return trip_image_helper_distrust(s->helper, "data of a wrong size");
    status = trip_image_helper_receive(s->helper, v, sizeof *v);
    if (status < 0)
        return status;
    *left = bytes - sizeof *v;
    const char *fault = fault_of(v);
    if (!fault && (!coordinate_bytes(v, &expected) || expected != *left))
        fault = "coordinates of a wrong size";
    return fault ? trip_image_helper_distrust(s->helper, fault) : 0;
}

static int take_coordinates(trip_helper_slices *s, int axis, trip_volume_info *info)
{
    const size_t bytes = (size_t)info->dims[axis] * sizeof(double);
    int status = trip_volume_check_axes(s->path, info);
    if (status < 0)
        return status;
    double *values = trip_budget_take(s->budget, bytes);
    if (!values)
        return trip_fail(TRIP_ERROR, "read", s->path,
                         "its coordinates do not fit in memory: raise --memory");
    status = trip_image_helper_receive(s->helper, values, bytes);
    if (status == 0)
        status = trip_volume_set_coordinates(info, axis, values, s->path);
    trip_budget_release(s->budget, values, bytes);
    return status;
}

static void describe(const trip_image_netcdf *v, trip_volume_info *info)
{
    snprintf(info->name, sizeof info->name, "%s", v->name);
    if (v->others || v->deeper)
        snprintf(info->note, sizeof info->note, "variable \"%s\"%s%s", v->name,
                 v->others ? ", one of several (--grid NAME selects another)" : "",
                 v->deeper ? ", at the first index of its other dimensions" : "");
}

static int open_file(trip_helper_slices *s, const trip_volume_params *params,
                     trip_volume_info *info)
{
    trip_image_netcdf v;
    uint64_t left;
    int status = open_variable(s, params, &v, &left);
    if (status < 0)
        return status;
    memcpy(info->dims, v.dims, sizeof info->dims);
    info->type = (trip_scalar)v.type;
    info->slope = v.slope;
    info->inter = v.inter;
    status = trip_volume_check_dims(s->path, info);
    for (int a = 0; a < 3 && status == 0; a++)
        if (v.placed >> a & 1)
            status = take_coordinates(s, a, info);
    if (status == 0)
        status = trip_helper_slices_reserve(s, v.dims, info->type, v.helper_bytes);
    if (status == 0)
        describe(&v, info);
    if (status == 0)
        status = trip_volume_check_entry(s->path, "time", params->time, v.times);
    if (status == 0)
        status = trip_volume_check_entry(s->path, "channel", params->channel, v.channels);
    trip_entry_note(info->note, sizeof info->note, "time", params->time, v.times, "");
    trip_entry_note(info->note, sizeof info->note, "channel", params->channel, v.channels, "");
    return status;
}

static int open_netcdf4(const char *path, const trip_volume_params *params, trip_budget *budget,
                        trip_volume_info *info, void **out)
{
    trip_helper_slices *s = trip_helper_slices_create(path, budget);
    if (!s)
        return TRIP_ERROR;
    int status = open_file(s, params, info);
    if (status < 0)
        trip_helper_slices_close(s);
    else
        *out = s;
    return status;
}

const trip_volume_reader trip_read_netcdf4 = {
    .format = "netcdf",
    .probe = probe,
    .open = open_netcdf4,
    .close = trip_helper_slices_close,
    .rewind = trip_helper_slices_rewind,
    .read_slices = trip_helper_slices_read,
    .skip_slices = trip_helper_slices_skip,
    .swap = trip_helper_slices_swap,
};

#else

static int refuse(const char *path, const trip_volume_params *params, trip_budget *budget,
                  trip_volume_info *info, void **state)
{
    (void)params, (void)budget, (void)info, (void)state;
    return trip_fail(TRIP_ERROR, "read", path,
                     "is netCDF-4 or another HDF5 file, and this program was built without "
                     "libnetcdf: convert it with `nccopy -k cdf5`");
}

const trip_volume_reader trip_read_netcdf4 = { .format = "netcdf", .probe = probe, .open = refuse };

#endif
