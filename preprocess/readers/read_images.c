/* Reads stacks of pictures as slices: a folder, a pattern, or one file with several slices. The
 * helper program (image_helper.h) reads the files, one slice at a time.
 *
 * Voxel (i, j, k) is pixel i from the left in row j from the top of slice k. DICOM metadata give
 * the spacing and the position of the voxels. Without metadata the spacing is 1. */
#include <dirent.h>
#include <glob.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "anatomy.h"
#include "helper_slices.h"
#include "report.h"
#include "volume_coordinates.h"
#include "volume_reader.h"

static bool probe(const char *path, const unsigned char *head, size_t bytes,
                  const trip_volume_params *params)
{
    (void)path, (void)params;
    return bytes == 0 || trip_image_kind_of(head, bytes) != TRIP_IMAGE_OTHER;
}

/* Returns whether the text is a code string as the DICOM standard defines it. */
static bool is_modality(const char *text, size_t room)
{
    static const char letters[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789 _";
    size_t length = strnlen(text, room);
    return length <= 16 && strspn(text, letters) == length;
}

/* Returns the fault in the helper's answer, or NULL. A later check refuses sizes that exceed the
 * memory. */
static const char *fault_of(const trip_image_stack *stack)
{
    bool finite = isfinite(stack->slope) && isfinite(stack->inter);
    for (int i = 0; i < 12; i++)
        finite = finite && isfinite(stack->index_to_world[i / 4][i % 4]);
    if (stack->type < 0 || stack->type >= TRIP_SCALARS)
        return "slices of an unknown type";
    if (stack->dims[0] < 1 || stack->dims[1] < 1 || stack->dims[2] < 1)
        return "slices without a size";
    if (!memchr(stack->space, '\0', sizeof stack->space) || (stack->oriented & ~1) ||
        (stack->space[0] && !trip_anatomy_known(stack->space)))
        return "an unknown space";
    if (!memchr(stack->up, '\0', sizeof stack->up) || (stack->up[0] && strcmp(stack->up, "+z")))
        return "an unknown direction";
    if (!memchr(stack->note, '\0', sizeof stack->note) || (stack->uneven & ~1))
        return "an invalid note";
    if (!is_modality(stack->modality, sizeof stack->modality))
        return "an invalid modality";
    return finite ? NULL : "a map that is not finite";
}

/* Receives the description of the stack. */
static int open_stack(trip_helper_slices *s, const trip_volume_params *params,
                      trip_image_stack *stack)
{
    const int64_t numbers[5] = { (int64_t)trip_budget_left_bytes(s->budget), params->allow_gaps,
                                 params->series, params->time, params->channel };
    uint64_t bytes = 0, expected = 0;
    int status = trip_image_helper_start(&s->helper, "read");
    if (status == 0)
        status = trip_image_helper_request(s->helper, TRIP_IMAGE_OPEN_STACK, s->path, numbers, -1);
    if (status == 0)
        status = trip_image_helper_outcome(s->helper, &bytes);
    if (status < 0)
        return status;
    if (bytes < sizeof *stack)
        return trip_image_helper_distrust(s->helper, "data of the wrong size");
    status = trip_image_helper_receive(s->helper, stack, sizeof *stack);
    const char *fault = status == 0 ? fault_of(stack) : NULL;
    if (!fault && status == 0 &&
        (__builtin_mul_overflow((uint64_t)stack->dims[2], stack->uneven ? sizeof(double) : 0,
                                &expected) ||
         stack->parts_bytes > TRIP_IMAGE_PARTS_MAX || bytes - sizeof *stack < expected ||
         bytes - sizeof *stack - expected != stack->parts_bytes))
        fault = "data of the wrong size";
    return fault ? trip_image_helper_distrust(s->helper, fault) : status;
}

/* Receives the positions of slices at uneven distances. */
static int take_positions(trip_helper_slices *s, trip_volume_info *info)
{
    int status = trip_volume_check_axes(s->path, info);
    if (status < 0)
        return status;
    const size_t bytes = (size_t)info->dims[2] * sizeof(double);
    double *positions = trip_budget_take(s->budget, bytes);
    if (!positions)
        return trip_fail(TRIP_ERROR, "read", s->path,
                         "its positions do not fit in memory: raise --memory");
    status = trip_image_helper_receive(s->helper, positions, bytes);
    if (status == 0)
        status = trip_volume_set_positions(info, 2, positions, s->path);
    trip_budget_release(s->budget, positions, bytes);
    return status;
}

/* Receives the list of series. */
static int take_parts(trip_helper_slices *s, uint32_t bytes, trip_volume_info *info)
{
    if (!(info->parts = calloc(1, (size_t)bytes + 1)))
        return trip_fail(TRIP_ERROR, "read", s->path, "out of memory");
    return trip_image_helper_receive(s->helper, info->parts, bytes);
}

static void describe(const trip_image_stack *stack, trip_volume_info *info)
{
    memcpy(info->dims, stack->dims, sizeof info->dims);
    memcpy(info->index_to_world.m, stack->index_to_world, sizeof info->index_to_world.m);
    snprintf(info->space, sizeof info->space, "%s", stack->space);
    snprintf(info->up, sizeof info->up, "%.2s", stack->up);
    memcpy(info->modality, stack->modality, sizeof info->modality);
    snprintf(info->note, sizeof info->note, "%s", stack->note);
    if (stack->dims[2] == 1 && !stack->modality[0])
        trip_append_note(info->note, sizeof info->note,
                         "a single picture, drawn as one slice; a stack is a folder of slices or a "
                         "pattern such as slice%03d.png");
    info->oriented = stack->oriented != 0;
    info->type = (trip_scalar)stack->type;
    info->slope = stack->slope;
    info->inter = stack->inter;
    info->sparse = false;
    info->background = 0;
    info->format = "images";
    info->name[0] = 0;
}

static int open_images(const char *path, const trip_volume_params *params, trip_budget *budget,
                       trip_volume_info *info, void **out)
{
    trip_helper_slices *s = trip_helper_slices_create(path, budget);
    if (!s)
        return TRIP_ERROR;
    trip_image_stack stack = { 0 };
    int status = open_stack(s, params, &stack);
    if (status == 0)
        describe(&stack, info);
    if (status == 0 && stack.uneven)
        status = take_positions(s, info);
    if (status == 0 && stack.parts_bytes)
        status = take_parts(s, stack.parts_bytes, info);
    if (status == 0)
        status =
            trip_helper_slices_reserve(s, stack.dims, (trip_scalar)stack.type, stack.helper_bytes);
    if (status < 0) {
        trip_helper_slices_close(s);
        return status;
    }
    *out = s;
    return 0;
}

typedef int visit_file(void *user, const char *file);

static int by_name(const void *a, const void *b)
{
    return strcmp(*(char *const *)a, *(char *const *)b);
}

/* Visits the files of a folder except hidden ones. Files that are no slices are included, since
 * only their content tells. */
static int list_folder(const char *path, visit_file *visit, void *user)
{
    struct dirent **names;
    int count = scandir(path, &names, NULL, NULL), status = 0;
    char **files = count > 0 ? calloc((size_t)count, sizeof *files) : NULL;
    if (count < 0 || !files)
        return trip_fail_errno("read", path, "cannot list");
    for (int i = 0; i < count; i++) {
        if (asprintf(&files[i], "%s/%s", path, names[i]->d_name) < 0)
            files[i] = NULL;
        status = files[i] ? status
                          : trip_fail(TRIP_ERROR, "read", path, "out of memory while listing it");
    }
    if (status == 0)
        qsort(files, (size_t)count, sizeof *files, by_name);
    for (int i = 0; i < count && status == 0; i++) {
        struct stat st;
        if (strrchr(files[i], '/')[1] != '.' && stat(files[i], &st) == 0 && S_ISREG(st.st_mode))
            status = visit(user, files[i]);
    }
    for (int i = 0; i < count; i++) {
        free(files[i]);
        free(names[i]);
    }
    free(files);
    free(names);
    return status;
}

/* Turns "s%03d.tif" into the glob pattern "s*.tif", and copies other paths. The caller frees the
 * result. */
static char *glob_pattern(const char *path)
{
    const char *percent = strrchr(path, '%');
    if (!percent || strchr(percent, '/'))
        return strdup(path);
    const char *after = percent + 1 + strspn(percent + 1, "0123456789");
    size_t room = 2 * strlen(path) + 2, used = 0;
    char *pattern = malloc(room);
    for (const char *p = path; pattern && *p; p++) {
        if (p == percent) {
            pattern[used++] = '*';
            p = *after ? after : after - 1;
            continue;
        }
        if (strchr("*?[\\", *p))
            pattern[used++] = '\\';
        pattern[used++] = *p;
    }
    if (pattern)
        pattern[used] = 0;
    return pattern;
}

static int list_pattern(const char *path, visit_file *visit, void *user)
{
    glob_t found = { 0 };
    char *pattern = glob_pattern(path);
    int status = 0, failed = pattern ? glob(pattern, 0, NULL, &found) : GLOB_NOSPACE;
    if (failed == GLOB_NOMATCH)
        status = trip_fail(TRIP_ERROR, "read", path, "no file matches this pattern");
    else if (failed)
        status = trip_fail(TRIP_ERROR, "read", path, "cannot search for files of this pattern");
    for (size_t i = 0; i < found.gl_pathc && status == 0; i++)
        status = visit(user, found.gl_pathv[i]);
    globfree(&found);
    free(pattern);
    return status;
}

static int list_images(const char *path, visit_file *visit, void *user)
{
    struct stat st;
    if (stat(path, &st) != 0)
        return list_pattern(path, visit, user);
    return S_ISDIR(st.st_mode) ? list_folder(path, visit, user) : visit(user, path);
}

const trip_volume_reader trip_read_images = {
    .format = "images",
    .probe = probe,
    .list = list_images,
    .open = open_images,
    .close = trip_helper_slices_close,
    .rewind = trip_helper_slices_rewind,
    .read_slices = trip_helper_slices_read,
    .skip_slices = trip_helper_slices_skip,
    .swap = trip_helper_slices_swap,
};
