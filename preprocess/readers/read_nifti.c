/* Reads NIfTI-1 and NIfTI-2 files, .nii or a pair .hdr/.img, gzipped or not, in either byte order.
 * The library libnifti provides the header's layout, byte swapping and the conversion of the
 * quaternion. This reader streams the values itself, since libnifti reads whole images. */
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <unistd.h>

#include <nifti2_io.h>

#include "byte_stream.h"
#include "dense_file.h"
#include "other_file.h"
#include "report.h"
#include "volume_reader.h"

#define MAGIC_1_OFFSET offsetof(nifti_1_header, magic)
#define MAGIC_2_OFFSET offsetof(nifti_2_header, magic)

_Static_assert(sizeof(nifti_1_header) == 348, "as on disk");
_Static_assert(sizeof(nifti_2_header) == 540, "as on disk");

/* A header of either version, widened to version 2, in the machine's byte order. */
typedef struct header {
    nifti_2_header n;
    bool swapped;  /* the file's byte order differs from the machine's */
    bool own_file; /* the values are in an .img file */
} header;

static bool has_magic(const unsigned char *head, size_t bytes)
{
    const unsigned char *m1 = head + MAGIC_1_OFFSET, *m2 = head + MAGIC_2_OFFSET;
    if (bytes >= sizeof(nifti_1_header) && (!memcmp(m1, "n+1", 4) || !memcmp(m1, "ni1", 4)))
        return true;
    return bytes >= sizeof(nifti_2_header) && (!memcmp(m2, "n+2", 4) || !memcmp(m2, "ni2", 4));
}

/* Returns whether the path ends in `suffix` or in `suffix` and ".gz". */
static bool ends_in(const char *path, const char *suffix)
{
    size_t length = strlen(path), n = strlen(suffix);
    if (length >= 3 && strcasecmp(path + length - 3, ".gz") == 0)
        length -= 3;
    return length > n && strncasecmp(path + length - n, suffix, n) == 0;
}

static bool nifti_probe(const char *path, const unsigned char *head, size_t bytes,
                        const trip_volume_params *params)
{
    (void)params;
    if (bytes == 0)
        return false;
    return has_magic(head, bytes) || ends_in(path, ".nii") || ends_in(path, ".hdr") ||
           ends_in(path, ".img");
}

/* Returns the other path of a pair: exchanges ".hdr" and ".img" and keeps ".gz". Keeps the case of
 * each letter. If no such file exists, tries lower case, and with or without ".gz". The caller
 * frees the path. */
static char *partner(const char *path, const char *from, const char *to)
{
    size_t length = strlen(path);
    char *copy = malloc(length + sizeof ".gz");
    if (!copy)
        return NULL;
    memcpy(copy, path, length + 1);
    if (!ends_in(path, from))
        return copy;
    const bool compressed = strcasecmp(copy + length - 3, ".gz") == 0;
    if (compressed)
        length -= 3;
    char *suffix = copy + length - strlen(to);
    for (size_t i = 0; to[i]; i++) {
        const bool is_capital = suffix[i] >= 'A' && suffix[i] <= 'Z';
        suffix[i] = (char)(is_capital ? to[i] - 'a' + 'A' : to[i]);
    }
    if (access(copy, F_OK) != 0)
        memcpy(suffix, to, strlen(to));
    if (access(copy, F_OK) == 0)
        return copy;
    snprintf(copy + length, sizeof ".gz", "%s", compressed ? "" : ".gz");
    if (access(copy, F_OK) != 0)
        snprintf(copy + length, sizeof ".gz", "%s", compressed ? ".gz" : "");
    return copy;
}

static int read_head(const char *path, unsigned char *head, size_t bytes)
{
    trip_byte_stream *stream;
    trip_byte_source source = {
        .path = path, .encoding = trip_byte_encoding_of(path), .size_bytes = bytes, .warned = true
    };
    int status = trip_byte_stream_open(&stream, &source);
    if (status < 0)
        return status;
    status = trip_byte_stream_read(stream, head, bytes);
    trip_byte_stream_close(stream);
    return status;
}

/* Copies the used fields of version 1. */
static nifti_2_header widen(const nifti_1_header *h)
{
    nifti_2_header n = { 0 };
    memcpy(n.magic, h->magic, 4);
    for (int i = 0; i < 8; i++) {
        n.dim[i] = h->dim[i];
        n.pixdim[i] = h->pixdim[i];
    }
    for (int i = 0; i < 4; i++) {
        n.srow_x[i] = h->srow_x[i];
        n.srow_y[i] = h->srow_y[i];
        n.srow_z[i] = h->srow_z[i];
    }
    n.datatype = h->datatype;
    n.intent_code = h->intent_code;
    /* The offset is a float on disk. An impossible one becomes negative, which a later check
     * refuses. */
    n.vox_offset = h->vox_offset >= 0 && h->vox_offset < 0x1p62f ? (int64_t)h->vox_offset : -1;
    n.scl_slope = h->scl_slope;
    n.scl_inter = h->scl_inter;
    n.qform_code = h->qform_code;
    n.sform_code = h->sform_code;
    n.quatern_b = h->quatern_b;
    n.quatern_c = h->quatern_c;
    n.quatern_d = h->quatern_d;
    n.qoffset_x = h->qoffset_x;
    n.qoffset_y = h->qoffset_y;
    n.qoffset_z = h->qoffset_z;
    return n;
}

static int not_nifti(const char *path)
{
    unsigned char head[TRIP_OTHER_HEAD_BYTES];
    char text[TRIP_OTHER_TEXT_BYTES];
    size_t bytes = 0;
    if (trip_byte_stream_head(path, head, sizeof head, true, &bytes) == 0 &&
        trip_other_file_tell(path, head, bytes, text))
        return trip_fail(TRIP_ERROR, "read", path, "%s", text);
    return trip_fail(TRIP_ERROR, "read", path, "is not a NIfTI-1 or NIfTI-2 header");
}

static int read_version_1(const char *path, header *h)
{
    nifti_1_header n;
    int status = read_head(path, (unsigned char *)&n, sizeof n);
    if (status < 0)
        return status;
    if (!has_magic((const unsigned char *)&n, sizeof n))
        return not_nifti(path);
    h->swapped = n.sizeof_hdr != (int)sizeof n;
    if (h->swapped)
        swap_nifti_header(&n, 1);
    h->own_file = n.magic[1] == 'i';
    h->n = widen(&n);
    return n.sizeof_hdr == (int)sizeof n ? 0 : not_nifti(path);
}

static int read_version_2(const char *path, header *h)
{
    int status = read_head(path, (unsigned char *)&h->n, sizeof h->n);
    if (status < 0)
        return status;
    if (memcmp(h->n.magic + 4, "\r\n\032\n", 4) != 0)
        return trip_fail(TRIP_ERROR, "read", path,
                         "its NIfTI-2 magic is damaged, perhaps by a transfer in text mode");
    h->swapped = h->n.sizeof_hdr != (int)sizeof h->n;
    if (h->swapped)
        swap_nifti_header(&h->n, 2);
    h->own_file = h->n.magic[1] == 'i';
    return h->n.sizeof_hdr == (int)sizeof h->n ? 0 : not_nifti(path);
}

static int read_header(const char *path, header *h)
{
    unsigned char head[MAGIC_2_OFFSET + 4];
    int status = read_head(path, head, sizeof head);
    if (status < 0)
        return status;
    const unsigned char *magic = head + MAGIC_2_OFFSET;
    return memcmp(magic, "n+2", 4) == 0 || memcmp(magic, "ni2", 4) == 0 ? read_version_2(path, h)
                                                                        : read_version_1(path, h);
}

/* Sets the sizes and chooses the volume: axis 4 is time, axis 5 has the components of a value. */
static int set_dims(const char *path, const nifti_2_header *n, const trip_volume_params *params,
                    trip_volume_info *info, trip_dense_layout *layout)
{
    int64_t sizes[8] = { 0, 1, 1, 1, 1, 1, 1, 1 }, volumes = 1;
    if (n->dim[0] < 1 || n->dim[0] > 7)
        return trip_fail(TRIP_ERROR, "read", path, "has %" PRId64 " axes; NIfTI allows 1 to 7",
                         n->dim[0]);
    for (int i = 1; i <= n->dim[0]; i++) {
        if (n->dim[i] < 1)
            return trip_fail(TRIP_ERROR, "read", path, "axis %d has size %" PRId64, i, n->dim[i]);
        sizes[i] = n->dim[i];
    }
    for (int i = 4; i <= 7; i++)
        if (__builtin_mul_overflow(volumes, sizes[i], &volumes))
            return trip_fail(TRIP_ERROR, "read", path, "has impossibly many volumes");
    int status = trip_volume_check_entry(path, "time", params->time, sizes[4]);
    if (status == 0)
        status = trip_volume_check_entry(path, "channel", params->channel, sizes[5]);
    memcpy(info->dims, sizes + 1, sizeof info->dims);
    layout->count[TRIP_DENSE_AFTER_VOLUMES] = volumes;
    layout->index[TRIP_DENSE_AFTER_VOLUMES] = params->time + params->channel * sizes[4];
    trip_entry_note(info->note, sizeof info->note, "time", params->time, sizes[4], "");
    trip_entry_note(info->note, sizeof info->note, "channel", params->channel, sizes[5], "");
    for (int i = 6; i <= 7 && status == 0; i++)
        if (sizes[i] > 1)
            trip_warn(path, "axis %d has %" PRId64 " entries; only the first is read", i, sizes[i]);
    return status;
}

static int set_type(const char *path, const nifti_2_header *n, trip_volume_info *info,
                    trip_dense_layout *layout)
{
    static const struct {
        int datatype;
        trip_scalar type;
        int64_t colours; /* entries in a voxel; 1 if it is no colour */
    } known[] = {
        { DT_UINT8, TRIP_U8, 1 },    { DT_INT8, TRIP_I8, 1 },    { DT_UINT16, TRIP_U16, 1 },
        { DT_INT16, TRIP_I16, 1 },   { DT_UINT32, TRIP_U32, 1 }, { DT_INT32, TRIP_I32, 1 },
        { DT_UINT64, TRIP_U64, 1 },  { DT_INT64, TRIP_I64, 1 },  { DT_FLOAT32, TRIP_F32, 1 },
        { DT_FLOAT64, TRIP_F64, 1 }, { DT_RGB24, TRIP_U8, 3 },   { DT_RGBA32, TRIP_U8, 4 },
    };
    for (size_t i = 0; i < sizeof known / sizeof known[0]; i++) {
        if (n->datatype != known[i].datatype)
            continue;
        layout->luma = known[i].colours > 1;
        layout->stored = known[i].type;
        layout->count[TRIP_DENSE_IN_VOXEL] = known[i].colours;
        info->type = layout->luma ? TRIP_F32 : known[i].type;
        if (layout->luma)
            trip_append_note(info->note, sizeof info->note, TRIP_VOLUME_COLOUR_NOTE);
        return 0;
    }
    return trip_fail(TRIP_ERROR, "read", path,
                     "cannot read datatype %d (%s): convert it to integers, float or double",
                     n->datatype, nifti_datatype_string(n->datatype));
}

static trip_affine from_sform(const nifti_2_header *n)
{
    trip_affine a;
    for (int i = 0; i < 4; i++) {
        a.m[0][i] = n->srow_x[i];
        a.m[1][i] = n->srow_y[i];
        a.m[2][i] = n->srow_z[i];
    }
    return a;
}

/* Uses the quaternion if there is one, else the voxel sizes alone. */
static trip_affine from_qform(const nifti_2_header *n)
{
    double size[3];
    for (int i = 0; i < 3; i++) {
        size[i] = fabs(n->pixdim[i + 1]);
        if (!(size[i] > 0 && isfinite(size[i])))
            size[i] = 1; /* an unknown size */
    }
    trip_affine a = trip_affine_identity();
    if (n->qform_code <= 0) {
        for (int i = 0; i < 3; i++)
            a.m[i][i] = size[i];
        return a;
    }
    nifti_dmat44 q = nifti_quatern_to_dmat44(n->quatern_b, n->quatern_c, n->quatern_d, n->qoffset_x,
                                             n->qoffset_y, n->qoffset_z, size[0], size[1], size[2],
                                             n->pixdim[0] < 0 ? -1 : 1);
    for (int row = 0; row < 3; row++)
        for (int column = 0; column < 4; column++)
            a.m[row][column] = q.m[row][column];
    return a;
}

/* Prefers the sform. Without sform and qform the orientation in the patient is unknown. */
static void set_map(const char *path, const nifti_2_header *n, trip_volume_info *info)
{
    trip_affine sform = from_sform(n), inverse;
    bool has_sform = n->sform_code > 0;
    if (has_sform && !trip_affine_invert(&sform, &inverse)) {
        trip_warn(path,
                  "its sform is singular or not finite; the qform or the voxel sizes are used");
        has_sform = false;
    }
    info->index_to_world = has_sform ? sform : from_qform(n);
    info->oriented = has_sform || n->qform_code > 0;
    info->labels = n->intent_code == NIFTI_INTENT_LABEL;
    snprintf(info->space, sizeof info->space, "%s", info->oriented ? "RAS" : "");
}

static void set_scaling(const nifti_2_header *n, trip_volume_info *info)
{
    if (n->scl_slope == 0 || !isfinite(n->scl_slope))
        return; /* the standard defines this as no scaling */
    info->slope = n->scl_slope;
    info->inter = isfinite(n->scl_inter) ? n->scl_inter : 0;
}

static int open_values(const char *path, const header *h, const trip_volume_info *info,
                       const trip_dense_layout *layout, void **state)
{
    char *data_path = h->own_file ? partner(path, ".hdr", ".img") : strdup(path);
    if (!data_path)
        return trip_fail(TRIP_ERROR, "read", path, "out of memory");
    /* A file that says it is the header of a pair may hold the values, whatever its name. */
    const bool own_file = strcmp(path, data_path) != 0;
    const int64_t min = own_file ? 0 : h->n.magic[2] == '2' ? 544 : 352;
    trip_byte_source source = { .path = data_path,
                                .encoding = trip_byte_encoding_of(data_path),
                                .skip_bytes = (uint64_t)h->n.vox_offset };
    int status = h->n.vox_offset >= min
                     ? trip_dense_open(state, &source, 1, info, layout, h->swapped)
                     : trip_fail(TRIP_ERROR, "read", path,
                                 "vox_offset is invalid: the values would start inside the header");
    free(data_path);
    return status;
}

static int nifti_open(const char *path, const trip_volume_params *params, trip_budget *budget,
                      trip_volume_info *info, void **state)
{
    (void)budget;
    header h = { 0 };
    trip_dense_layout layout = { .count = { 1, 1, 1, 1 } };
    char *header_path = partner(path, ".img", ".hdr");
    if (!header_path)
        return trip_fail(TRIP_ERROR, "read", path, "out of memory");
    nifti_set_debug_level(0); /* disables libnifti's own messages */
    int status = read_header(header_path, &h);
    if (status == 0)
        status = set_dims(header_path, &h.n, params, info, &layout);
    if (status == 0)
        status = set_type(header_path, &h.n, info, &layout);
    if (status == 0) {
        set_map(header_path, &h.n, info);
        if (!layout.luma)
            set_scaling(&h.n, info);
        status = open_values(header_path, &h, info, &layout, state);
    }
    free(header_path);
    return status;
}

/* Visits both files of a pair that contains `path`, or a single file once. */
static int nifti_list(const char *path, int (*visit)(void *user, const char *file), void *user)
{
    char *head = partner(path, ".img", ".hdr"), *values = partner(path, ".hdr", ".img");
    int status =
        head && values ? visit(user, head) : trip_fail(TRIP_ERROR, "read", path, "out of memory");
    if (status == 0 && strcmp(head, values))
        status = visit(user, values);
    free(head);
    free(values);
    return status;
}

const trip_volume_reader trip_read_nifti = {
    .format = "nifti",
    .probe = nifti_probe,
    .list = nifti_list,
    .open = nifti_open,
    .decompresses = true,
    .close = trip_dense_close,
    .rewind = trip_dense_rewind,
    .read_slices = trip_dense_read_slices,
    .skip_slices = trip_dense_skip_slices,
    .swap = trip_dense_swap,
};
