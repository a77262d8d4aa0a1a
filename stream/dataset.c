#include "dataset.h"

#include "dataset_check.h"
#include "read_at.h"
#include "report.h"

#include <errno.h>
#include <fcntl.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

const char *trip_plane_file_name(int axis, unsigned level, trip_kind kind, int plane, char *name)
{
    snprintf(name, 32, "%c%u.%s", 'x' + axis, level, trip_kind_of(kind)->plane_names[plane]);
    return name;
}

/* Whether a Gaussian scene has a file of this name, such as "x.gaussians" or "x.harmonics1". */
static bool is_gaussian_file(const char *name)
{
    if (!*name || !strchr("xyz", *name))
        return false;
    if (!strcmp(name + 1, ".gaussians") || !strcmp(name + 1, ".palette"))
        return true;
    return !strncmp(name + 1, ".harmonics", 10) && name[11] >= '1' && name[11] <= '3' && !name[12];
}

bool trip_plane_file_is_named(const char *name)
{
    if (is_gaussian_file(name))
        return true;
    char own[32], *end;
    unsigned long level = strtoul(name + (*name != 0), &end, 10);
    if (level > UINT32_MAX)
        return false;
    for (int axis = 0; axis < 3; axis++)
        for (int kind = 0; kind < TRIP_KINDS; kind++)
            for (int plane = 0; plane < TRIP_PLANES; plane++)
                if (trip_kind_of((trip_kind)kind)->planes >> plane & 1 &&
                    !strcmp(name, trip_plane_file_name(axis, (unsigned)level, (trip_kind)kind,
                                                       plane, own)))
                    return true;
    return false;
}

const char *trip_list_plane_name(const trip_list *list, int plane, char *name)
{
    return trip_plane_file_name(list->axis, list->level, list->kind, plane, name);
}

static void set_path(char *where, size_t room, const trip_dataset *d, const char *name)
{
    snprintf(where, room, "%s/%s", d->path, name);
}

/* REPLACED is not a failure: another data set replaced the folder while it was being opened. */
enum { REPLACED = 1, REPLACED_TRIES = 100 };

static bool was_replaced(const trip_dataset *d, int folder)
{
    struct stat opened, named;
    return fstat(folder, &opened) == 0 && stat(d->path, &named) == 0 &&
           (opened.st_dev != named.st_dev || opened.st_ino != named.st_ino);
}

/* Opens a regular file of the data set and returns its size. Never waits, as opening a pipe would.
 */
static int open_file(const trip_dataset *d, int folder, const char *name, int *fd, uint64_t *bytes)
{
    char where[4096];
    struct stat st;
    set_path(where, sizeof where, d, name);
    *fd = openat(folder, name, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (*fd < 0 && errno == ENOENT && was_replaced(d, folder))
        return REPLACED;
    if (*fd < 0 && errno == ENOENT)
        return trip_fail(
            TRIP_ERROR, "open", where,
            "the file is missing, so this is not a data set; make one with `triptych brick`");
    if (*fd < 0 || fstat(*fd, &st) < 0)
        return trip_fail_errno("open", where, "cannot open");
    if (!S_ISREG(st.st_mode))
        return trip_fail(TRIP_ERROR, "open", where, "not a regular file");
    *bytes = (uint64_t)st.st_size;
    return TRIP_OK;
}

static int read_at(int fd, const char *where, uint64_t offset, void *data, uint64_t bytes)
{
    const ssize_t n = trip_read_at(fd, data, bytes, bytes, offset);
    if (n < 0)
        return trip_fail_errno("open", where, "cannot read");
    if ((uint64_t)n < bytes)
        return trip_fail(TRIP_ERROR, "open", where, "ends early, at byte %llu",
                         (unsigned long long)(offset + (uint64_t)n));
    return TRIP_OK;
}

/* Reads the whole index into memory. */
static int read_index(trip_dataset *d, int fd, uint64_t file_bytes)
{
    char where[4096];
    set_path(where, sizeof where, d, TRIP_INDEX_NAME);
    if (file_bytes < TRIP_HEADER_BYTES)
        return trip_fail(TRIP_ERROR, "open", where, "%llu bytes, shorter than its header of %d",
                         (unsigned long long)file_bytes, TRIP_HEADER_BYTES);
    int status = read_at(fd, where, 0, &d->header, TRIP_HEADER_BYTES);
    if (status == TRIP_OK)
        status = trip_dataset_check_header(&d->header, file_bytes, where);
    if (status < 0)
        return status;
    d->memory = trip_budget_take(d->budget, file_bytes);
    d->memory_bytes = file_bytes;
    if (!d->memory)
        return trip_fail(TRIP_ERROR, "open", where,
                         "no memory for the index of %llu bytes; raise --memory",
                         (unsigned long long)file_bytes);
    status = read_at(fd, where, 0, d->memory, file_bytes);
    if (status == TRIP_OK)
        status = trip_dataset_check_pages(d->memory, &d->header, where);
    return status == TRIP_OK ? trip_dataset_check_tables(d->memory, &d->header, where) : status;
}

static const void *table(const trip_dataset *d, uint64_t offset)
{
    return (const unsigned char *)d->memory + offset;
}

static void set_list(trip_dataset *d, trip_list *l, const trip_file_list *f)
{
    l->axis = (int)f->axis;
    l->level = f->level;
    l->kind = (trip_kind)f->kind;
    l->planes = f->planes;
    for (int a = 0; a < 3; a++)
        l->dims[a] = (int64_t)f->dims[a];
    memcpy(l->index_to_world.m, f->index_to_world, sizeof l->index_to_world.m);
    l->sheet_first = f->sheet_first;
    l->sheet_step = f->sheet_step;
    l->records = f->records;
    l->slab_count = f->slab_count;
    l->brick_count = f->brick_count;
    l->slabs = table(d, f->slabs_offset);
    l->bricks = table(d, f->bricks_offset);
    l->runs = table(d, f->runs_offset);
    for (int plane = 0; plane < TRIP_PLANES; plane++)
        if (l->planes >> plane & 1) {
            l->page_checksums[plane] = table(d, f->page_checksums_offset[plane]);
            l->plane_bytes[plane] = f->plane_bytes[plane];
        }
}

static void set_coordinates(trip_dataset *d)
{
    const uint64_t *dims = d->header.dims;
    const int64_t voxels[3] = { (int64_t)dims[0], (int64_t)dims[1], (int64_t)dims[2] };
    const bool uneven = d->header.coordinates_offset != 0;
    const double *first = uneven ? table(d, d->header.coordinates_offset) : NULL;
    d->coordinates = trip_coordinates_make(
        uneven ? (const double *const[3]){ first, first + dims[0], first + dims[0] + dims[1] }
               : NULL,
        voxels);
}

static void set_codes(trip_dataset *d)
{
    const uint64_t offset = d->header.code_table_offset;
    d->codes = trip_codes_of(&d->header, offset ? table(d, offset) : NULL);
}

static int set_lists(trip_dataset *d)
{
    const trip_file_list *files = table(d, d->header.lists_offset);
    unsigned count = d->header.list_count;
    d->lists = trip_budget_take(d->budget, count * sizeof *d->lists); /* zeroed */
    if (!d->lists)
        return trip_fail(TRIP_ERROR, "open", d->path, "no memory for its %u lists; raise --memory",
                         count);
    memcpy(d->index_to_world.m, d->header.index_to_world, sizeof d->index_to_world.m);
    set_coordinates(d);
    set_codes(d);
    for (; d->list_count < count; d->list_count++) {
        trip_list *l = &d->lists[d->list_count];
        l->index = d->list_count;
        l->path = d->path;
        for (int plane = 0; plane < TRIP_PLANES; plane++)
            l->plane_fd[plane] = -1;
        set_list(d, l, &files[d->list_count]);
    }
    return TRIP_OK;
}

static int set_text(trip_dataset *d)
{
    d->text = trip_budget_take(d->budget, d->header.text_bytes + 1); /* zeroed */
    if (!d->text)
        return trip_fail(TRIP_ERROR, "open", d->path,
                         "no memory for its text of %llu bytes; raise --memory",
                         (unsigned long long)d->header.text_bytes);
    memcpy(d->text, table(d, d->header.text_offset), d->header.text_bytes);
    return TRIP_OK;
}

static int open_plane(trip_dataset *d, int folder, trip_list *list, int plane)
{
    char name[32], where[4096];
    uint64_t bytes = 0, wanted = list->plane_bytes[plane];
    trip_list_plane_name(list, plane, name);
    int status = open_file(d, folder, name, &list->plane_fd[plane], &bytes);
    if (status != TRIP_OK)
        return status;
    d->bytes += bytes;
    if (bytes == wanted)
        return TRIP_OK;
    set_path(where, sizeof where, d, name);
    return trip_fail(TRIP_ERROR, "open", where, "%llu bytes instead of %llu",
                     (unsigned long long)bytes, (unsigned long long)wanted);
}

static int open_files(trip_dataset *d, int folder)
{
    int fd;
    int status = open_file(d, folder, TRIP_INDEX_NAME, &fd, &d->bytes);
    if (status == TRIP_OK)
        status = read_index(d, fd, d->bytes);
    if (fd >= 0)
        close(fd);
    if (status == TRIP_OK)
        status = set_lists(d);
    if (status == TRIP_OK)
        status = set_text(d);
    for (unsigned i = 0; i < d->list_count; i++)
        for (int plane = 0; plane < TRIP_PLANES; plane++)
            if (status == TRIP_OK && d->lists[i].planes >> plane & 1)
                status = open_plane(d, folder, &d->lists[i], plane);
    return status;
}

static trip_dataset *allocate(const char *path, trip_budget *budget)
{
    size_t length = strlen(path);
    trip_dataset *d = calloc(1, sizeof *d);
    while (length > 1 && path[length - 1] == '/')
        length--;
    if (!d || !(d->path = strndup(path, length))) {
        free(d);
        return NULL;
    }
    d->budget = budget;
    return d;
}

/* Opens the files relative to the folder. All files thus belong to one data set, even if another
 * takes its name. */
static int open_once(trip_dataset **out, const char *path, trip_budget *budget)
{
    trip_dataset *d = allocate(path, budget);
    if (!d)
        return trip_fail(TRIP_ERROR, "open", path, "out of memory");
    int folder = open(path, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    int status = TRIP_OK;
    if (folder < 0 && errno == ENOTDIR)
        status = trip_fail(TRIP_ERROR, "open", path,
                           "is not a data set; make one, NAME.trip, with `triptych brick`");
    else if (folder < 0)
        status = trip_fail_errno("open", path, "cannot open");
    else
        status = open_files(d, folder);
    if (folder >= 0)
        close(folder);
    if (status != TRIP_OK)
        trip_dataset_close(d);
    else
        *out = d;
    return status;
}

int trip_dataset_open(trip_dataset **out, const char *path, trip_budget *budget)
{
    int status = REPLACED;
    *out = NULL;
    for (int i = 0; i < REPLACED_TRIES && status == REPLACED; i++)
        status = open_once(out, path, budget);
    if (status == REPLACED)
        return trip_fail(TRIP_ERROR, "open", path,
                         "is replaced again and again by another process");
    return status;
}

void trip_dataset_close(trip_dataset *d)
{
    if (!d)
        return;
    for (unsigned i = 0; i < d->list_count; i++)
        for (int plane = 0; plane < TRIP_PLANES; plane++)
            if (d->lists[i].plane_fd[plane] >= 0)
                close(d->lists[i].plane_fd[plane]);
    if (d->lists)
        trip_budget_release(d->budget, d->lists, d->header.list_count * sizeof *d->lists);
    trip_budget_release(d->budget, d->memory, d->memory_bytes);
    if (d->text)
        trip_budget_release(d->budget, d->text, d->header.text_bytes + 1);
    free(d->path);
    free(d);
}

const trip_list *trip_dataset_find(const trip_dataset *d, int axis, unsigned level, trip_kind kind)
{
    return trip_dataset_next(d, NULL, axis, level, kind);
}

const trip_list *trip_dataset_next(const trip_dataset *d, const trip_list *list, int axis,
                                   unsigned level, trip_kind kind)
{
    for (unsigned i = list ? list->index + 1 : 0; i < d->list_count; i++) {
        const trip_list *l = &d->lists[i];
        if (l->axis == axis && l->level == level && l->kind == kind)
            return l;
    }
    return NULL;
}

const trip_list *trip_dataset_along(const trip_dataset *d, const trip_list *list, int axis)
{
    const trip_list *along = NULL;
    do
        along = trip_dataset_next(d, along, axis, list->level, list->kind);
    while (along && along->part != list->part);
    return along;
}

/* Extends the box by the bricks of the list along z. */
static void add_kept(const trip_dataset *d, const trip_list *list, double lo[3], double hi[3])
{
    for (uint64_t i = 0; i < list->slab_count; i++) {
        const trip_file_slab *slab = &list->slabs[i];
        double sheet = (double)slab->slab * d->header.slab_sheets;
        for (uint64_t j = slab->first_brick; j < slab->first_brick + slab->brick_count; j++) {
            const trip_file_brick *b = &list->bricks[j];
            double u = (double)((uint64_t)b->tile_u << d->header.tile_log2);
            double v = (double)((uint64_t)b->tile_v << d->header.tile_log2);
            lo[0] = fmin(lo[0], u + b->u_min);
            hi[0] = fmax(hi[0], u + b->u_max);
            lo[1] = fmin(lo[1], v + b->v_min);
            hi[1] = fmax(hi[1], v + b->v_max);
            lo[2] = fmin(lo[2], sheet + b->sheet_min);
            hi[2] = fmax(hi[2], sheet + b->sheet_max);
        }
    }
}

/* Uses the bricks along one axis, since the lists along all axes hold the same splats. */
void trip_dataset_kept_bounds(const trip_dataset *d, double lo[3], double hi[3])
{
    const trip_list *list = NULL;
    for (int a = 0; a < 3; a++) {
        lo[a] = INFINITY;
        hi[a] = -INFINITY;
    }
    while ((list = trip_dataset_next(d, list, 2, 0, TRIP_KIND_VOXELS)))
        add_kept(d, list, lo, hi);
    const bool some = lo[0] <= hi[0];
    for (int a = 0; a < 3 && !some; a++) {
        lo[a] = 0;
        hi[a] = (double)d->header.dims[a] - 1;
    }
}
