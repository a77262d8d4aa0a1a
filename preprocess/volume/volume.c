#include "volume.h"

#include <strings.h>
#include <ctype.h>
#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "anatomy.h"
#include "byte_stream.h"
#include "dense_file.h"
#include "other_file.h"
#include "report.h"
#include "sampled.h"
#include "volume_coordinates.h"
#include "volume_reader.h"
#include "text.h"

#define HEAD_BYTES TRIP_OTHER_HEAD_BYTES
/* The default size of a portion. */
#define PORTION_BYTES ((int64_t)16 << 20)

/* In the order of probing. NIfTI files are also known by their names, and raw data by names alone.
 */
static const trip_volume_reader *const readers[] = {
    &trip_read_vdb, &trip_read_nrrd,   &trip_read_netcdf, &trip_read_netcdf4,
    &trip_read_vol, &trip_read_images, &trip_read_nifti,  &trip_read_raw,
};

/* The stored slices [first, first + count) of a portion, including one neighbour on each side. */
typedef struct stored_slices {
    int64_t first, count;
    unsigned char *slices;
    size_t bytes;
} stored_slices;

struct trip_volume {
    const trip_volume_reader *reader;
    void *state;
    trip_volume_info info;
    trip_budget *budget;
    char *path;

    const trip_ids *ids; /* decoding gives ranks of ids; NULL means values */
    bool exact_fills;    /* the user gave the fill value, so that not the nearest float counts */

    /* All further fields are for slice readers. */
    size_t slice_bytes;
    bool swap;
    int64_t next_slice;   /* first slice of the next portion */
    int64_t read_slices;  /* slices read so far: at most next_slice + 1 */
    unsigned char *carry; /* slices [next_slice - 1, read_slices), for the next portion */
    int broken;           /* status of a failed read, after which every portion fails */
    /* The memory of one released portion, reused for the next, since fresh pages cost about as much
     * as reading into them. Exchanged atomically, as any thread may release portions. */
    _Atomic(stored_slices *) spare;
};

static bool is_raw_option_given(const trip_volume_params *p)
{
    return p->raw_dims[0] || p->raw_dims[1] || p->raw_dims[2] || p->raw_type || p->raw_endian ||
           p->raw_offset_bytes;
}

/* Refuses options that do not apply to the format. */
static int check_options(const char *path, const char *format, const trip_volume_params *p)
{
    if (strcmp(format, "raw") != 0 && is_raw_option_given(p))
        return trip_fail(TRIP_USAGE, "read", path,
                         "its format is %s; --size, --type, --endian and --offset require raw data",
                         format);
    if (strcmp(format, "openvdb") != 0 && p->level_set)
        return trip_fail(TRIP_USAGE, "read", path, "its format is %s; --level-set requires OpenVDB",
                         format);
    if (strcmp(format, "openvdb") != 0 && strcmp(format, "netcdf") != 0 && p->grid)
        return trip_fail(TRIP_USAGE, "read", path,
                         "its format is %s; --grid requires OpenVDB or netCDF", format);
    if (strcmp(format, "openvdb") == 0 && p->coordinates)
        return trip_fail(TRIP_USAGE, "read", path,
                         "its format is openvdb, which has even spacing; --coordinates requires "
                         "another format");
    if (strcmp(format, "images") != 0 && p->allow_gaps)
        return trip_fail(TRIP_USAGE, "read", path,
                         "its format is %s; --allow-gaps requires a stack of slices", format);
    if (strcmp(format, "images") != 0 && p->series)
        return trip_fail(TRIP_USAGE, "read", path, "its format is %s; --series requires DICOM",
                         format);
    static const char *const several[] = { "nrrd", "nifti", "netcdf", "images" };
    bool may_have_several = false;
    for (size_t i = 0; i < sizeof several / sizeof *several; i++)
        may_have_several |= strcmp(format, several[i]) == 0;
    if (!may_have_several && (p->channel || p->time))
        return trip_fail(TRIP_USAGE, "read", path,
                         "its format is %s; --channel and --time require NRRD, NIfTI, netCDF or "
                         "a stack of slices",
                         format);
    trip_fills fills;
    if (p->fill && !trip_fills_parse(p->fill, &fills))
        return trip_fail(TRIP_USAGE, "read", path, "--fill takes a number or none");
    for (int a = 0; a < 3; a++)
        if (!isfinite(p->spacing[a]) || p->spacing[a] < 0 ||
            (p->spacing[a] == 0) != (p->spacing[0] == 0))
            return trip_fail(TRIP_USAGE, "read", path, "--spacing takes three positive lengths");
    if (p->axes && !trip_anatomy_axes_valid(p->axes))
        return trip_fail(TRIP_USAGE, "read", path, "--axes takes " TRIP_ANATOMY_AXES);
    return 0;
}

/* Reads the first bytes of a regular file, decompressed. A folder or a pattern has none. *encoding
 * gets the compression of the file. */
static int read_head(const char *path, unsigned char *head, size_t *bytes_out,
                     trip_byte_encoding *encoding)
{
    *bytes_out = 0;
    *encoding = TRIP_BYTES_PLAIN;
    struct stat st;
    if (stat(path, &st) != 0) {
        if (errno == ENOENT && strpbrk(path, "%*?["))
            return 0;
        return trip_fail_errno("read", path, "cannot open");
    }
    if (S_ISDIR(st.st_mode))
        return 0;
    if (!S_ISREG(st.st_mode))
        return trip_fail(TRIP_ERROR, "read", path, "is not a regular file");
    if (st.st_size == 0)
        return trip_fail(TRIP_ERROR, "read", path, "is empty");
    int fd = open(path, O_RDONLY | O_CLOEXEC);
    if (fd < 0)
        return trip_fail_errno("read", path, "cannot open");
    ssize_t n = pread(fd, head, HEAD_BYTES, 0);
    int status = n < 0 ? trip_fail_errno("read", path, "cannot read") : 0;
    close(fd);
    *bytes_out = n < 0 ? 0 : (size_t)n;
    *encoding = trip_byte_encoding_of_head(head, *bytes_out);
    if (status < 0 || *encoding == TRIP_BYTES_PLAIN)
        return status;
    unsigned char inner[HEAD_BYTES];
    size_t inner_bytes = 0;
    status = trip_byte_stream_head(path, inner, HEAD_BYTES, true, &inner_bytes);
    if (inner_bytes > 0) {
        memcpy(head, inner, inner_bytes);
        *bytes_out = inner_bytes;
    }
    return status;
}

/* Reports that the format cannot be read in order. */
static int refuse_compressed(const char *path, const char *format, trip_byte_encoding encoding)
{
    const char *program = trip_byte_encoding_name(encoding);
    return trip_fail(TRIP_ERROR, "read", path,
                     "is compressed with %s, and its format (%s) can only be read unpacked: unpack "
                     "it first, with `%s -dc FILE >NAME`",
                     program, format, program);
}

/* Reports that no reader knows the file, or that its compressed data are damaged. */
static int refuse_unknown(const char *path, const unsigned char *head, size_t bytes,
                          trip_byte_encoding encoding)
{
    unsigned char inner[HEAD_BYTES];
    size_t inner_bytes;
    char text[TRIP_OTHER_TEXT_BYTES];
    int status = encoding == TRIP_BYTES_PLAIN
                     ? 0
                     : trip_byte_stream_head(path, inner, sizeof inner, false, &inner_bytes);
    if (status < 0)
        return status;
    if (trip_other_file_tell(path, head, bytes, text))
        return trip_fail(TRIP_ERROR, "read", path, "%s", text);
    char *word = trip_text_word(path);
    status = trip_fail(TRIP_ERROR, "read", path,
                       "is of no known format (VDB, NRRD, NIfTI, netCDF, .vol, images); describe "
                       "raw data with `triptych brick %s --size X,Y,Z --type uint8`",
                       word ? word : "FILE");
    free(word);
    return status;
}

int trip_volume_choose_reader(const trip_volume_reader **out, const char *path,
                              const trip_volume_params *params)
{
    unsigned char head[HEAD_BYTES];
    size_t bytes;
    if (params->memory.data || params->memory.read_slices) {
        *out = &trip_read_memory;
        return check_options(path, trip_read_memory.format, params);
    }
    trip_byte_encoding encoding;
    int status = read_head(path, head, &bytes, &encoding);
    char text[TRIP_OTHER_TEXT_BYTES];
    if (status == 0 && bytes == 0 && trip_other_file_tell(path, head, 0, text))
        status = trip_fail(TRIP_ERROR, "read", path, "%s", text);
    if (status < 0)
        return status;
    for (size_t i = 0; i < sizeof readers / sizeof readers[0]; i++) {
        if (!readers[i]->probe(path, head, bytes, params))
            continue;
        *out = readers[i];
        if (encoding != TRIP_BYTES_PLAIN && !readers[i]->decompresses)
            return refuse_compressed(path, readers[i]->format, encoding);
        return check_options(path, readers[i]->format, params);
    }
    return refuse_unknown(path, head, bytes, encoding);
}

/* Returns the length of an index axis in world space, or 0 if the axis has no direction. */
static double axis_length(const trip_affine *m, int a)
{
    const double length = trip_length(trip_v3(m->m[0][a], m->m[1][a], m->m[2][a]));
    return isfinite(length) ? length : 0;
}

/* Returns whether every index axis with a direction is parallel to the same axis of world space. */
static bool lies_straight(const trip_affine *m)
{
    for (int a = 0; a < 3; a++)
        for (int row = 0; row < 3 && axis_length(m, a) > 0; row++)
            if (row != a && m->m[row][a] != 0)
                return false;
    return true;
}

/* Sets the lengths of the index axes in world space and keeps their directions. If all axes with a
 * direction are parallel to their axes of world space, so become axes without one. */
static void override_spacing(trip_affine *m, const double spacing[3])
{
    const bool straight = lies_straight(m);
    for (int a = 0; a < 3; a++) {
        const double length = axis_length(m, a), sign = m->m[a][a] < 0 ? -1 : 1;
        for (int row = 0; row < 3 && length > 0; row++)
            m->m[row][a] *= spacing[a] / length;
        for (int row = 0; row < 3 && length == 0 && straight; row++)
            m->m[row][a] = row == a ? sign * spacing[a] : 0;
    }
}

/* Returns whether a map is invertible once its axes have other lengths. */
static bool lacks_lengths_alone(trip_affine m)
{
    trip_affine inverse;
    override_spacing(&m, (const double[3]){ 1, 1, 1 });
    return trip_affine_invert(&m, &inverse);
}

/* Returns whether world space differs from index space only by origin and positive axis lengths. */
static bool is_upright(const trip_affine *m)
{
    for (int row = 0; row < 3; row++)
        for (int column = 0; column < 3; column++)
            if (row == column ? !(m->m[row][column] > 0) : m->m[row][column] != 0)
                return false;
    return true;
}

/* Turns a patient's world space into the one of all data sets, RAS: half a turn about z. */
static void turn_to_ras(trip_volume_info *info)
{
    if (strcmp(info->space, "LPS") != 0)
        return;
    for (int row = 0; row < 2; row++)
        for (int column = 0; column < 4; column++) /* without a negative zero */
            info->index_to_world.m[row][column] = 0 - info->index_to_world.m[row][column];
    snprintf(info->space, sizeof info->space, "RAS");
}

/* Turns world space into the patient's, as if the file gave the orientation. */
static int set_axes(trip_volume *v, const char *axes)
{
    trip_volume_info *info = &v->info;
    trip_affine turn = trip_affine_identity();
    if (info->space[0])
        return trip_fail(
            TRIP_USAGE, "read", v->path,
            "gives its orientation in the patient (%s); --axes requires a file without "
            "one",
            info->space);
    if (!is_upright(&info->index_to_world))
        return trip_fail(TRIP_USAGE, "read", v->path,
                         "gives the directions of its axes; --axes requires a file without them");
    snprintf(info->space, sizeof info->space, "RAS");
    info->oriented = true;
    for (int a = 0; a < 3; a++) {
        trip_vec3 to = trip_anatomy_direction(info->space, axes[a]);
        for (int row = 0; row < 3; row++)
            turn.m[row][a] = trip_component(to, row);
    }
    info->index_to_world = trip_affine_multiply(&turn, &info->index_to_world);
    return 0;
}

static int check_lengths(const trip_volume *v)
{
    const double(*m)[4] = v->info.index_to_world.m;
    for (int a = 0; a < 3; a++) {
        double length = trip_length(trip_v3(m[0][a], m[1][a], m[2][a]));
        if (!(length >= TRIP_VOXEL_WORLD_MIN && length <= TRIP_VOXEL_WORLD_MAX))
            return trip_fail(TRIP_ERROR, "read", v->path,
                             "its voxels are %.3g world units long along %c; %g to %g can be "
                             "drawn: set other lengths with --spacing X,Y,Z",
                             length, "ijk"[a], TRIP_VOXEL_WORLD_MIN, TRIP_VOXEL_WORLD_MAX);
    }
    const double dims[3] = { (double)v->info.dims[0], (double)v->info.dims[1],
                             (double)v->info.dims[2] };
    const double far = trip_affine_farthest_voxels(&v->info.index_to_world, dims);
    if (!(far <= TRIP_FARTHEST_VOXELS))
        return trip_fail(
            TRIP_ERROR, "read", v->path,
            "its voxels lie up to %.3g voxels from the origin of world space; %.3g can "
            "be told apart: move the origin in the file%s",
            far, TRIP_FARTHEST_VOXELS,
            v->info.index_to_world.m[0][3] == 0 ? " or set other lengths with "
                                                  "--spacing X,Y,Z"
                                                : "");
    return 0;
}

static int check_info(const trip_volume *v)
{
    const trip_volume_info *info = &v->info;
    trip_affine inverse;
    int status = trip_volume_check_dims(v->path, info);
    if (status < 0)
        return status;
    if (!trip_affine_invert(&info->index_to_world, &inverse))
        return trip_fail(TRIP_ERROR, "read", v->path,
                         "its map from index space to world space is singular or not finite%s",
                         lacks_lengths_alone(info->index_to_world)
                             ? ": set other lengths with --spacing X,Y,Z"
                             : "");
    if (!isfinite(info->slope) || info->slope == 0 || !isfinite(info->inter))
        return trip_fail(TRIP_ERROR, "read", v->path,
                         "cannot scale its values by %g and offset them by %g", info->slope,
                         info->inter);
    return check_lengths(v);
}

bool trip_volume_is_named_labels(const char *path)
{
    static const char *const words[] = { "label", "labels",       "labelmap", "seg",
                                         "dseg",  "segmentation", "aseg",     "parcellation" };
    const char *slash = strrchr(path, '/'), *word = slash ? slash + 1 : path;
    while (*word) {
        size_t length = 0;
        while (isalpha((unsigned char)word[length]))
            length++;
        for (size_t i = 0; i < sizeof words / sizeof *words; i++)
            if (strlen(words[i]) == length && !strncasecmp(word, words[i], length))
                return true;
        word += length + (word[length] != 0);
    }
    return false;
}

static int open_with_reader(trip_volume *v, const trip_volume_params *params)
{
    int status = trip_volume_choose_reader(&v->reader, v->path, params);
    if (status < 0)
        return status;
    v->info = (trip_volume_info){ .index_to_world = trip_affine_identity(),
                                  .slope = 1,
                                  .format = v->reader->format };
    v->exact_fills = params->fill && trip_fills_parse(params->fill, &v->info.fills);
    status = v->reader->open(v->path, params, v->budget, &v->info, &v->state);
    if (status < 0)
        return status;
    v->info.named_labels = trip_volume_is_named_labels(v->path);
    if (params->spacing[0] > 0)
        override_spacing(&v->info.index_to_world, params->spacing);
    if (params->coordinates && !(status = trip_volume_check_dims(v->path, &v->info)))
        status = trip_volume_read_coordinates(&v->info, params->coordinates, v->path);
    turn_to_ras(&v->info);
    if (!status && params->axes)
        status = set_axes(v, params->axes);
    if (!status)
        status = check_info(v);
    if (!status && params->max_voxels)
        status = trip_sampled_wrap(&v->reader, &v->state, &v->info, params->max_voxels, v->budget);
    if (!status)
        status = trip_volume_complete_coordinates(&v->info, v->path);
    if (status < 0 || !v->reader->read_slices)
        return status;
    v->slice_bytes = (size_t)(v->info.dims[0] * v->info.dims[1]) * trip_scalar_bytes(v->info.type);
    v->swap = v->reader->swap(v->state);
    return 0;
}

int trip_volume_open(trip_volume **out, const char *path, const trip_volume_params *params,
                     trip_budget *budget)
{
    static const trip_volume_params defaults;
    trip_volume *v = calloc(1, sizeof *v);
    if (!v || !(v->path = strdup(path))) {
        free(v);
        return trip_fail(TRIP_ERROR, "read", path, "out of memory");
    }
    v->budget = budget;
    int status = open_with_reader(v, params ? params : &defaults);
    if (status < 0) {
        trip_volume_close(v);
        return status;
    }
    *out = v;
    return 0;
}

const trip_volume_info *trip_volume_get_info(const trip_volume *v)
{
    return &v->info;
}

void trip_volume_set_fills(trip_volume *v, const trip_fills *fills)
{
    v->info.fills = *fills;
    v->exact_fills = false;
}

void trip_volume_set_ids(trip_volume *v, const trip_ids *ids)
{
    v->ids = ids;
}

void trip_volume_add_note(trip_volume *v, const char *note)
{
    char *to = v->info.note;
    const size_t used = strlen(to);
    snprintf(to + used, sizeof v->info.note - used, "%s%s", used ? "; " : "", note);
}

static void slices_free(trip_volume *v, stored_slices *s)
{
    if (!s)
        return;
    trip_budget_release(v->budget, s->slices, s->bytes);
    free(s);
}

static void drop_spare(trip_volume *v)
{
    slices_free(v, atomic_exchange(&v->spare, NULL));
}

/* Releases the memory that is kept between portions. */
static void drop_memory(trip_volume *v)
{
    drop_spare(v);
    if (v->carry)
        trip_budget_release(v->budget, v->carry, 2 * v->slice_bytes);
    v->carry = NULL;
}

static stored_slices *slices_take(trip_volume *v, int64_t first, int64_t count)
{
    size_t bytes;
    stored_slices *s = atomic_exchange(&v->spare, NULL);
    if (__builtin_mul_overflow(v->slice_bytes, (size_t)count, &bytes))
        bytes = SIZE_MAX / 2; /* refused below */
    if (s && s->bytes < bytes) {
        slices_free(v, s);
        s = NULL;
    }
    if (!s && (s = calloc(1, sizeof *s))) {
        s->bytes = bytes;
        s->slices = trip_budget_take(v->budget, bytes);
        if (!s->slices) {
            free(s);
            return NULL;
        }
    }
    if (s) {
        s->first = first;
        s->count = count;
    }
    return s;
}

static int refused(const trip_volume *v, int64_t slices)
{
    char needed[32], left[32];
    trip_format_bytes((uint64_t)slices * v->slice_bytes, needed);
    trip_format_bytes(trip_budget_left_bytes(v->budget), left);
    return trip_fail(TRIP_ERROR, "read", v->path,
                     "%" PRId64 " slices at a time need %s, but only %s of memory are left: "
                     "raise --memory",
                     slices, needed, left);
}

void trip_volume_close(trip_volume *v)
{
    if (!v)
        return;
    drop_memory(v);
    if (v->state)
        v->reader->close(v->state);
    trip_volume_free_coordinates(&v->info);
    free(v->info.parts);
    free(v->path);
    free(v);
}

int trip_volume_rewind(trip_volume *v)
{
    drop_memory(v);
    v->next_slice = v->read_slices = 0;
    v->broken = 0;
    return v->reader->rewind(v->state);
}

/* Fills *s with the last slices of the previous portion and with new slices from the reader. */
static int fill_slices(trip_volume *v, stored_slices *s, int64_t next_slice)
{
    int64_t kept = v->read_slices - s->first;
    size_t kept_bytes = (size_t)kept * v->slice_bytes;
    if (kept > 0)
        memcpy(s->slices, v->carry, kept_bytes);
    if (s->count > kept) {
        int status = v->reader->read_slices(v->state, s->count - kept, s->slices + kept_bytes);
        if (status < 0)
            return v->broken = status;
    }
    v->read_slices = s->first + s->count;
    v->next_slice = next_slice;
    if (next_slice < v->info.dims[2]) {
        size_t offset = (size_t)(next_slice - 1 - s->first) * v->slice_bytes;
        memcpy(v->carry, s->slices + offset,
               (size_t)(v->read_slices - next_slice + 1) * v->slice_bytes);
    }
    return 0;
}

static int next_slices(trip_volume *v, int64_t slices, trip_volume_portion *portion)
{
    int64_t begin = v->next_slice, depth = v->info.dims[2];
    int64_t end = slices < depth - begin ? begin + slices : depth;
    int64_t first = begin > 0 ? begin - 1 : 0, past = end < depth ? end + 1 : depth;
    if (end < depth && !v->carry && !(v->carry = trip_budget_take(v->budget, 2 * v->slice_bytes)))
        return refused(v, past - first + 2);
    stored_slices *s = slices_take(v, first, past - first);
    if (!s)
        return refused(v, past - first);
    int status = fill_slices(v, s, end);
    if (status < 0) {
        slices_free(v, s);
        return status;
    }
    *portion = (trip_volume_portion){ .origin = { 0, 0, begin },
                                      .size = { v->info.dims[0], v->info.dims[1], end - begin },
                                      .data = s };
    return 1;
}

int trip_volume_next(trip_volume *v, int64_t slices_hint, trip_volume_portion *portion)
{
    if (!v->reader->read_slices)
        return v->reader->next(v->state, portion);
    if (v->broken < 0)
        return v->broken;
    if (v->next_slice == v->info.dims[2])
        return 0;
    if (slices_hint < 1)
        slices_hint = PORTION_BYTES / (int64_t)v->slice_bytes;
    return next_slices(v, slices_hint < 1 ? 1 : slices_hint, portion);
}

int64_t trip_volume_skip(trip_volume *v, int64_t slices)
{
    int64_t depth = v->info.dims[2];
    if (!v->reader->read_slices || !v->reader->skip_slices || v->broken < 0)
        return 0;
    int64_t left = depth - v->next_slice, count = slices < left ? slices : left;
    int64_t first = v->next_slice + count - 1; /* the next portion's neighbour */
    if (first < v->read_slices)
        return 0;
    if (v->next_slice + count == depth) {
        v->next_slice = depth;
        return count;
    }
    int status = v->reader->skip_slices(v->state, first - v->read_slices);
    if (status < 0)
        return v->broken = status;
    v->read_slices = first;
    v->next_slice += count;
    return count;
}

static int64_t clamp(int64_t v, int64_t lo, int64_t hi)
{
    return v < lo ? lo : v > hi ? hi : v;
}

static uint64_t key_of(trip_scalar type, bool swap, const unsigned char *stored)
{
    const unsigned bytes = trip_scalar_bytes(type);
    const bool is_signed =
        type == TRIP_I8 || type == TRIP_I16 || type == TRIP_I32 || type == TRIP_I64;
    uint64_t key = 0;
    for (unsigned i = 0; i < bytes; i++) {
        const bool first_is_low = trip_machine_is_big_endian() == swap;
        key |= (uint64_t)stored[first_is_low ? i : bytes - 1 - i] << 8 * i;
    }
    if (is_signed && bytes < 8 && key >> (8 * bytes - 1))
        key |= UINT64_MAX << 8 * bytes;
    return is_signed ? key ^ UINT64_C(1) << 63 : key;
}

static void keys_of(const trip_volume *v, const unsigned char *stored, size_t count, uint64_t *keys)
{
    const unsigned bytes = trip_scalar_bytes(v->info.type);
    for (size_t i = 0; i < count; i++)
        keys[i] = key_of(v->info.type, v->swap, stored + i * bytes);
}

/* Replaces values by ranks. */
static void rank_values(const trip_volume *v, const unsigned char *stored, size_t count,
                        float *values)
{
    enum { SOME = 64 };
    uint64_t keys[SOME];
    float ranks[SOME];
    for (size_t i = 0, n; i < count; i += n) {
        n = count - i < SOME ? count - i : SOME;
        if (v->info.type < TRIP_F16)
            keys_of(v, stored + i * trip_scalar_bytes(v->info.type), n, keys);
        for (size_t k = 0; k < n && v->info.type >= TRIP_F16; k++) {
            bool integer = true;
            keys[k] = trip_id_key((double)values[i + k], &integer);
        }
        trip_ids_ranks(v->ids, keys, n, ranks);
        for (size_t k = 0; k < n; k++)
            values[i + k] = isnan(values[i + k]) ? NAN : ranks[k];
    }
}

static void drop_fills(const trip_fills *fills, float *values, size_t count)
{
    for (unsigned f = 0; f < fills->count; f++) {
        const float fill = (float)fills->values[f];
        for (size_t i = 0; i < count; i++)
            values[i] = values[i] == fill ? NAN : values[i];
    }
}

/* Integers of 32 bits and more share a float with their neighbours. */
static void drop_exact_fills(const trip_volume *v, const unsigned char *stored, size_t count,
                             float *values)
{
    const trip_volume_info *info = &v->info;
    const unsigned bytes = trip_scalar_bytes(info->type);
    const bool is_unsigned = info->type == TRIP_U32 || info->type == TRIP_U64;
    for (unsigned f = 0; f < info->fills.count; f++) {
        const double fill = info->fills.values[f];
        for (size_t i = 0; i < count; i++) {
            if (values[i] != (float)fill)
                continue;
            const uint64_t key = key_of(info->type, v->swap, stored + i * bytes);
            const double number =
                is_unsigned ? (double)key : (double)(int64_t)(key ^ UINT64_C(1) << 63);
            if (info->slope * number + info->inter == fill)
                values[i] = NAN;
        }
    }
}

static bool is_wide_integer(trip_scalar type)
{
    return type >= TRIP_U32 && type <= TRIP_I64;
}

/* Decodes stored values next to each other. */
static void decode_values(const trip_volume *v, const unsigned char *stored, size_t count,
                          float *values)
{
    const trip_volume_info *info = &v->info;
    trip_scalar_decode(info->type, v->swap, info->slope, info->inter, stored, count, values);
    if (v->exact_fills && is_wide_integer(info->type))
        drop_exact_fills(v, stored, count, values);
    else
        drop_fills(&info->fills, values, count);
    if (v->ids)
        rank_values(v, stored, count, values);
}

/* Decodes values [lo, lo + count) of a stored row of `width` values. Repeats the end values beyond
 * the ends. */
static void decode_row(const trip_volume *v, const unsigned char *row, int64_t width, int64_t lo,
                       int64_t count, float *values)
{
    int64_t begin = clamp(lo, 0, width - 1), end = clamp(lo + count, begin + 1, width);
    int64_t before = clamp(begin - lo, 0, count - 1);
    int64_t inside = clamp(end - begin, 1, count - before);
    decode_values(v, row + (size_t)begin * trip_scalar_bytes(v->info.type), (size_t)inside,
                  values + before);
    for (int64_t i = 0; i < before; i++)
        values[i] = values[before];
    for (int64_t i = before + inside; i < count; i++)
        values[i] = values[before + inside - 1];
}

static void mark_row(int64_t width, bool exists, int64_t lo, int64_t count, uint8_t *active)
{
    memset(active, 0, (size_t)count);
    int64_t begin = clamp(-lo, 0, count), end = clamp(width - lo, begin, count);
    if (exists)
        memset(active + begin, 1, (size_t)(end - begin));
}

static void decode_slices(const trip_volume *v, const stored_slices *s, const int64_t lo[3],
                          const int64_t size[3], float *values, uint8_t *active)
{
    const int64_t *dims = v->info.dims;
    size_t row_bytes = v->slice_bytes / (size_t)dims[1];
    for (int64_t k = 0; k < size[2]; k++)
        for (int64_t j = 0; j < size[1]; j++) {
            int64_t z = clamp(lo[2] + k, 0, dims[2] - 1), y = clamp(lo[1] + j, 0, dims[1] - 1);
            size_t to = (size_t)((k * size[1] + j) * size[0]);
            const unsigned char *slice = s->slices + (size_t)(z - s->first) * v->slice_bytes;
            decode_row(v, slice + (size_t)y * row_bytes, dims[0], lo[0], size[0], values + to);
            if (active)
                mark_row(dims[0], z == lo[2] + k && y == lo[1] + j, lo[0], size[0], active + to);
        }
}

int trip_portion_decode(const trip_volume *v, const trip_volume_portion *portion,
                        const int64_t lo[3], const int64_t size[3], float *values, uint8_t *active)
{
    for (int a = 0; a < 3; a++)
        if (lo[a] < portion->origin[a] - 1 || size[a] < 1 ||
            lo[a] + size[a] > portion->origin[a] + portion->size[a] + 1)
            return trip_fail(TRIP_ERROR, "read", v->path, "voxels outside the portion");
    if (v->reader->read_slices) {
        decode_slices(v, portion->data, lo, size, values, active);
        return 0;
    }
    int status = v->reader->decode(v->state, portion, lo, size, values, active);
    if (status == 0)
        drop_fills(&v->info.fills, values, (size_t)(size[0] * size[1] * size[2]));
    return status;
}

void trip_portion_keys(const trip_volume *v, const trip_volume_portion *portion,
                       const int64_t at[3], int64_t count, uint64_t *keys)
{
    const stored_slices *s = portion->data;
    const size_t row_bytes = v->slice_bytes / (size_t)v->info.dims[1];
    const unsigned char *row =
        s->slices + (size_t)(at[2] - s->first) * v->slice_bytes + (size_t)at[1] * row_bytes;
    keys_of(v, row + (size_t)at[0] * trip_scalar_bytes(v->info.type), (size_t)count, keys);
}

void trip_portion_release(trip_volume *v, trip_volume_portion *portion)
{
    if (!portion->data)
        return;
    if (v->reader->read_slices)
        slices_free(v, atomic_exchange(&v->spare, portion->data));
    else
        v->reader->release(v->state, portion);
    portion->data = NULL;
}
