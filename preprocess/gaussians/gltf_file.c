#include "gltf_file.h"

#include <cjson/cJSON.h>
#include <ctype.h>
#include <fcntl.h>
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "little_endian.h"
#include "read_at.h"
#include "report.h"

enum {
    TEXT_BYTES = 64 << 20,
    BUFFERS_MAX = 256,
    CHUNK_JSON = 0x4e4f534a,
    CHUNK_BINARY = 0x004e4942
};

#define FAULT(...) trip_fail(TRIP_ERROR, "read", g->path, __VA_ARGS__)

static const cJSON *member(const cJSON *object, const char *name)
{
    return cJSON_GetObjectItemCaseSensitive(object, name);
}

const cJSON *trip_gltf_item(const trip_gltf_file *g, const char *array, int index)
{
    return index < 0 ? NULL : cJSON_GetArrayItem(member(g->json.root, array), index);
}

/* Returns a whole number from 0 to 2^53 of a member, `missing` if there is none, or -1. */
static double whole(const cJSON *object, const char *name, double missing)
{
    const cJSON *item = member(object, name);
    if (!item)
        return missing;
    const double v = cJSON_IsNumber(item) ? item->valuedouble : -1;
    return v >= 0 && v <= 0x1p53 && floor(v) >= v ? v : -1;
}

int trip_gltf_index(const cJSON *object, const char *name)
{
    const double v = whole(object, name, -1);
    return v < INT32_MAX ? (int)v : -1;
}

static int open_regular(const trip_gltf_file *g, const char *path, int *fd, uint64_t *bytes)
{
    struct stat st;
    *fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (*fd < 0)
        return trip_fail_errno("read", path, "cannot open");
    if (fstat(*fd, &st) != 0 || !S_ISREG(st.st_mode))
        return FAULT("its buffer %s is not a regular file", path);
    *bytes = (uint64_t)st.st_size;
    return 0;
}

/* Finds the text in the file: all of it, or the first chunk of a .glb. */
static int find_text(trip_gltf_file *g, int fd, uint64_t file_bytes, uint64_t *at, uint64_t *bytes)
{
    unsigned char h[20] = { 0 }, c[8];
    const ssize_t got = trip_read_at(fd, h, sizeof h, sizeof h, 0);
    *at = 0;
    *bytes = file_bytes;
    if (got < 4 || memcmp(h, "glTF", 4) != 0)
        return 0;
    *at = sizeof h;
    *bytes = trip_le_u32(h + 12);
    if (got < (ssize_t)sizeof h || trip_le_u32(h + 4) != 2 || trip_le_u32(h + 16) != CHUNK_JSON)
        return FAULT("is not a binary glTF of version 2");
    if (*bytes > file_bytes - *at)
        return FAULT("ends in its text; is it truncated?");
    const uint64_t next = *at + *bytes;
    if (trip_read_at(fd, c, sizeof c, sizeof c, next) != sizeof c ||
        trip_le_u32(c + 4) != CHUNK_BINARY)
        return 0;
    g->chunk_at = next + sizeof c;
    g->chunk_bytes = trip_le_u32(c);
    return g->chunk_bytes > file_bytes - g->chunk_at
               ? FAULT("states a binary chunk of %" PRIu64 " bytes, but %" PRIu64
                       " follow; is it truncated?",
                       g->chunk_bytes, file_bytes - g->chunk_at)
               : 0;
}

static int read_text(trip_gltf_file *g, int fd, uint64_t at, uint64_t bytes)
{
    if (bytes > TEXT_BYTES)
        return FAULT("its text of %" PRIu64 " bytes is too long", bytes);
    char *text = trip_budget_take(g->budget, bytes + 1);
    if (!text)
        return FAULT("out of memory");
    int status = trip_read_at(fd, text, bytes, bytes, at) == (ssize_t)bytes
                     ? trip_json_parse(&g->json, text, g->path, g->budget)
                     : trip_fail_errno("read", g->path, "cannot read");
    trip_budget_release(g->budget, text, bytes + 1);
    return status == 0 && !cJSON_IsObject(g->json.root) ? FAULT("its text is not JSON") : status;
}

/* Returns the path of a buffer beside the file, for free(), or NULL. */
static char *path_of(const char *file, const char *uri)
{
    const char *slash = strrchr(file, '/');
    const int folder = slash ? (int)(slash + 1 - file) : 0;
    char *path = malloc((size_t)folder + strlen(uri) + 1), *to = path;
    if (!path)
        return NULL;
    memcpy(path, file, (size_t)folder);
    to += folder;
    for (const char *p = uri; *p; p++) {
        char hex[3] = "";
        if (*p == '%' && isxdigit((unsigned char)p[1]) && isxdigit((unsigned char)p[2])) {
            memcpy(hex, p + 1, 2);
            *to++ = (char)strtol(hex, NULL, 16);
            p += 2;
        } else {
            *to++ = *p;
        }
    }
    *to = 0;
    return path;
}

static int open_buffer(trip_gltf_file *g, int index)
{
    trip_gltf_buffer *b = &g->buffers[index];
    const cJSON *item = trip_gltf_item(g, "buffers", index);
    const char *uri = cJSON_GetStringValue(member(item, "uri"));
    const double stated = whole(item, "byteLength", -1);
    uint64_t file_bytes;
    if (stated < 0)
        return FAULT("buffer %d lacks its byteLength", index);
    if (uri && (strncmp(uri, "data:", 5) == 0 || strstr(uri, "://") || *uri == '/'))
        return FAULT("buffer %d is no file beside it; a .glb holds its data, and so does a folder "
                     "of .gltf and .bin",
                     index);
    char *path = uri ? path_of(g->path, uri) : strdup(g->path);
    int status = path ? open_regular(g, path, &b->fd, &file_bytes) : FAULT("out of memory");
    free(path);
    if (status < 0)
        return status;
    b->at = uri ? 0 : g->chunk_at;
    b->bytes = uri ? file_bytes : g->chunk_bytes;
    if (stated > (double)b->bytes)
        return FAULT("buffer %d states %.0f bytes, but has %" PRIu64 "; is it truncated?", index,
                     stated, b->bytes);
    b->bytes = (uint64_t)stated;
    return 0;
}

int trip_gltf_open(trip_gltf_file *g, const char *path)
{
    uint64_t file_bytes, at, bytes;
    int fd;
    *g = (trip_gltf_file){ .path = path };
    int status = trip_budget_create(&g->budget, 0);
    if (status < 0)
        return status;
    status = open_regular(g, path, &fd, &file_bytes);
    if (status == 0)
        status = find_text(g, fd, file_bytes, &at, &bytes);
    if (status == 0)
        status = read_text(g, fd, at, bytes);
    if (fd >= 0)
        close(fd);
    if (status < 0)
        return status;
    const int count = cJSON_GetArraySize(member(g->json.root, "buffers"));
    if (count > BUFFERS_MAX)
        return FAULT("has %d buffers; up to %d are read", count, BUFFERS_MAX);
    if (!(g->buffers = calloc((size_t)count + 1, sizeof *g->buffers)))
        return FAULT("out of memory");
    for (g->buffer_count = 0; g->buffer_count < count; g->buffer_count++)
        g->buffers[g->buffer_count].fd = -1;
    return 0;
}

void trip_gltf_close(trip_gltf_file *g)
{
    for (int i = 0; i < g->buffer_count; i++)
        if (g->buffers[i].fd >= 0)
            close(g->buffers[i].fd);
    free(g->buffers);
    trip_json_free(&g->json);
    if (g->budget)
        trip_budget_destroy(g->budget);
}

static unsigned bytes_of(int type)
{
    return type == 5120 || type == 5121   ? 1
           : type == 5122 || type == 5123 ? 2
           : type == 5125 || type == 5126 ? 4
                                          : 0;
}

/* Finds the place of the rows in the buffer. They must lie inside. */
static int place(trip_gltf_file *g, const cJSON *item, const char *name, trip_gltf_accessor *a)
{
    const cJSON *view = trip_gltf_item(g, "bufferViews", trip_gltf_index(item, "bufferView"));
    const int buffer = trip_gltf_index(view, "buffer");
    const double inside = whole(item, "byteOffset", 0), at = whole(view, "byteOffset", 0);
    const double length = whole(view, "byteLength", -1);
    const unsigned row = a->components * a->number_bytes;
    const double stride = whole(view, "byteStride", row);
    if (!view || buffer < 0 || buffer >= g->buffer_count || inside < 0 || at < 0 || length < 0)
        return FAULT("the attribute %s has no valid buffer", name);
    if (stride < row || stride > TRIP_GLTF_STRIDE_MAX)
        return FAULT("the attribute %s has a byteStride of %.0f; %u to %d are possible", name,
                     stride, row, TRIP_GLTF_STRIDE_MAX);
    if (g->buffers[buffer].fd < 0) {
        int status = open_buffer(g, buffer);
        if (status < 0)
            return status;
    }
    a->buffer = &g->buffers[buffer];
    a->stride = (unsigned)stride;
    a->at = a->buffer->at + (uint64_t)at + (uint64_t)inside;
    const double end = a->count ? inside + (double)(a->count - 1) * stride + row : 0;
    if (end > length || at + length > (double)a->buffer->bytes)
        return FAULT("the attribute %s ends at byte %.0f, beyond its buffer; is the file damaged?",
                     name, at + end);
    return 0;
}

int trip_gltf_accessor_open(trip_gltf_file *g, int index, unsigned components, const char *name,
                            trip_gltf_accessor *out)
{
    static const char *const shapes[] = { "", "SCALAR", "VEC2", "VEC3", "VEC4" };
    const cJSON *item = trip_gltf_item(g, "accessors", index);
    const char *shape = cJSON_GetStringValue(member(item, "type"));
    const double count = whole(item, "count", -1);
    *out = (trip_gltf_accessor){ .components = components,
                                 .type = trip_gltf_index(item, "componentType"),
                                 .normalised = cJSON_IsTrue(member(item, "normalized")) };
    out->number_bytes = bytes_of(out->type);
    if (!item || count < 0 || !out->number_bytes)
        return FAULT("the attribute %s has no valid accessor", name);
    if (member(item, "sparse"))
        return FAULT("the attribute %s is sparse, which is not read", name);
    if (!shape || strcmp(shape, shapes[components]) != 0)
        return FAULT("the attribute %s has the type %.20s; %s is read", name,
                     shape ? shape : "\"\"", shapes[components]);
    out->count = (uint64_t)count;
    return place(g, item, name, out);
}

static float number(const trip_gltf_accessor *a, const unsigned char *p)
{
    const bool n = a->normalised;
    switch (a->type) {
    case 5120:
        return n ? fmaxf((float)(int8_t)p[0] / 127, -1) : (float)(int8_t)p[0];
    case 5121:
        return n ? (float)p[0] / 255 : (float)p[0];
    case 5122:
        return n ? fmaxf((float)(int16_t)trip_le_u16(p) / 32767, -1)
                 : (float)(int16_t)trip_le_u16(p);
    case 5123:
        return n ? (float)trip_le_u16(p) / 65535 : (float)trip_le_u16(p);
    case 5125:
        return (float)trip_le_u32(p);
    default:
        return trip_le_float(p);
    }
}

int trip_gltf_accessor_read(const trip_gltf_file *g, const trip_gltf_accessor *a, uint64_t first,
                            size_t rows, unsigned char *room, float *out)
{
    const size_t bytes = (rows - 1) * a->stride + a->components * a->number_bytes;
    const ssize_t got = trip_read_at(a->buffer->fd, room, bytes, bytes, a->at + first * a->stride);
    if (got < 0)
        return trip_fail_errno("read", g->path, "cannot read");
    if ((size_t)got < bytes)
        return FAULT("ends within its data; is it truncated?");
    for (size_t i = 0; i < rows; i++)
        for (unsigned c = 0; c < a->components; c++)
            *out++ = number(a, room + i * a->stride + c * a->number_bytes);
    return 0;
}
