/* Reads Gaussian scenes in SOG (PlayCanvas): meta.json and pictures in WebP, in a ZIP archive or in
 * a folder. A pixel of each picture belongs to one Gaussian. The decoder of WebP
 * needs a whole picture. All pictures are kept in memory. They take 20 bytes for each Gaussian, and
 * 4 more with harmonics. */
#include "gaussian_file_internal.h"

#include <cjson/cJSON.h>
#include <fcntl.h>
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include <unzip.h>
#include <webp/decode.h>

#include "byte_stream.h"
#include "json.h"
#include "read_at.h"
#include "report.h"

enum { META_BYTES = 1 << 20, CODES = 256, PALETTE_ROW = 64, NAME_BYTES = 128 };

/* The pictures, in the order of their names in meta.json. */
typedef enum picture_name {
    CENTRES_LOW,
    CENTRES_HIGH,
    ROTATIONS,
    SCALES,
    COLOURS,
    PALETTE,
    LABELS,
    PICTURES
} picture_name;

typedef struct picture {
    unsigned char *pixels; /* red, green, blue, alpha */
    size_t bytes;
    int width, height;
} picture;

typedef struct sog {
    trip_budget *budget;
    trip_json meta;
    unzFile archive; /* NULL for a folder */
    int version;
    picture pictures[PICTURES];
    double centre[2][3]; /* minima and maxima of logarithms */
    /* Values of the bytes of each channel: log scales, colours and the logit of the opacity. */
    double scales[3][CODES], colours[4][CODES], coefficients[CODES];
    uint32_t palette_count;
} sog;

static bool is_folder_meta(const trip_gaussian_head *head)
{
    return head->bytes[0] == '{' && memmem(head->bytes, head->count, "\"means\"", 7) &&
           memmem(head->bytes, head->count, ".webp\"", 6);
}

static bool probe(const trip_gaussian_head *head)
{
    if (head->count < 4)
        return false;
    if (memcmp(head->bytes, "PK\3\4", 4) != 0)
        return is_folder_meta(head);
    return trip_byte_suffix(head->path, ".sog") ||
           memmem(head->bytes, head->count, "means_l.webp", 12);
}

#define FAULT(...) trip_fail(TRIP_ERROR, "read", f->path, __VA_ARGS__)

/* A part of the scene as bytes, from the budget. */
typedef struct part {
    unsigned char *bytes;
    size_t count;
} part;

static void release(const sog *s, part *p)
{
    if (p->bytes)
        trip_budget_release(s->budget, p->bytes, p->count + 1);
    *p = (part){ 0 };
}

static int take(const trip_gaussian_file *f, const sog *s, uint64_t bytes, const char *name,
                part *p)
{
    if (bytes < SIZE_MAX / 2)
        p->bytes = trip_budget_take(s->budget, (size_t)bytes + 1);
    p->count = (size_t)bytes;
    return p->bytes ? 0
                    : FAULT("its part %s needs %" PRIu64 " bytes of memory, which are too many",
                            name, bytes);
}

static int load_from_archive(const trip_gaussian_file *f, const sog *s, const char *name, part *p)
{
    unz_file_info64 info;
    if (unzLocateFile(s->archive, name, 1) != UNZ_OK ||
        unzGetCurrentFileInfo64(s->archive, &info, NULL, 0, NULL, 0, NULL, 0) != UNZ_OK)
        return FAULT("lacks its part %s", name);
    /* The text of meta.json is small. Compression by more than 1032 is not possible. */
    if (info.uncompressed_size / 1032 > info.compressed_size)
        return FAULT("its part %s states a wrong size; is the file damaged?", name);
    int status = take(f, s, info.uncompressed_size, name, p);
    if (status < 0)
        return status;
    bool good = unzOpenCurrentFile(s->archive) == UNZ_OK;
    for (size_t done = 0; good && done < p->count;) {
        const size_t left = p->count - done, want = left < 1 << 20 ? left : 1 << 20;
        const int got = unzReadCurrentFile(s->archive, p->bytes + done, (unsigned)want);
        good = got > 0;
        done += good ? (size_t)got : 0;
    }
    good = unzCloseCurrentFile(s->archive) == UNZ_OK && good;
    return good ? 0 : FAULT("its part %s is damaged", name);
}

static int read_file(const trip_gaussian_file *f, const sog *s, const char *path, const char *name,
                     part *p)
{
    struct stat st;
    const int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (fd < 0)
        return trip_fail_errno("read", path, "cannot open");
    int status = fstat(fd, &st) == 0 && S_ISREG(st.st_mode)
                     ? take(f, s, (uint64_t)st.st_size, name, p)
                     : trip_fail(TRIP_ERROR, "read", path, "is not a regular file");
    if (status == 0 && trip_read_at(fd, p->bytes, p->count, p->count, 0) != (ssize_t)p->count)
        status = trip_fail(TRIP_ERROR, "read", path, "cannot be read to its end");
    close(fd);
    return status;
}

/* Loads a part of the scene: from the archive, or from the folder of meta.json. */
static int load(const trip_gaussian_file *f, const sog *s, const char *name, part *p)
{
    *p = (part){ 0 };
    if (s->archive)
        return load_from_archive(f, s, name, p);
    const char *slash = strrchr(f->path, '/');
    char *path;
    if (asprintf(&path, "%.*s%s", slash ? (int)(slash + 1 - f->path) : 0, f->path, name) < 0)
        return trip_gaussian_no_memory(f);
    int status = read_file(f, s, path, name, p);
    free(path);
    return status;
}

static const cJSON *member(const cJSON *object, const char *name)
{
    return cJSON_GetObjectItemCaseSensitive(object, name);
}

/* Reads `count` numbers of an array. */
static int numbers(const trip_gaussian_file *f, const char *group, const char *name, int count,
                   double *out)
{
    const sog *s = f->state;
    const cJSON *array = member(member(s->meta.root, group), name);
    if (cJSON_GetArraySize(array) < count)
        return FAULT("meta.json lacks %d numbers in %s.%s", count, group, name);
    const cJSON *item = array->child;
    for (int i = 0; i < count; i++, item = item->next) {
        if (!cJSON_IsNumber(item))
            return FAULT("meta.json has something else than numbers in %s.%s", group, name);
        out[i] = item->valuedouble;
    }
    return 0;
}

/* Pictures are padded to rectangles. The labels of a palette have 16 bits. */
static int decode_picture(const trip_gaussian_file *f, const sog *s, const char *name,
                          const part *p, bool palette, picture *out)
{
    const uint64_t most = palette ? 65536 * 15 : 4 * f->info.count + 65536;
    if (!WebPGetInfo(p->bytes, p->count, &out->width, &out->height))
        return FAULT("its part %s is no WebP picture", name);
    out->bytes = 4 * (size_t)out->width * (size_t)out->height;
    if (out->bytes / 4 > most)
        return FAULT("its picture %s has %d x %d pixels, which are too many for %" PRIu64
                     " Gaussians",
                     name, out->width, out->height, f->info.count);
    /* The decoder takes as much again. */
    const bool fits = trip_budget_charge(s->budget, out->bytes);
    out->pixels = fits ? trip_budget_take(s->budget, out->bytes) : NULL;
    if (fits)
        trip_budget_discharge(s->budget, out->bytes);
    if (!out->pixels)
        return FAULT("its picture %s needs %zu bytes of memory, which are too many", name,
                     2 * out->bytes);
    return WebPDecodeRGBAInto(p->bytes, p->count, out->pixels, out->bytes, 4 * out->width)
               ? 0
               : FAULT("its picture %s is damaged", name);
}

/* Loads picture number `index` of a group. */
static int load_picture(trip_gaussian_file *f, const char *group, int index, picture_name which)
{
    sog *s = f->state;
    const char *name = cJSON_GetStringValue(
        cJSON_GetArrayItem(member(member(s->meta.root, group), "files"), index));
    part p;
    if (!name || !*name || strchr(name, '/') || strlen(name) >= NAME_BYTES)
        return FAULT("meta.json lacks the name of a file in %s.files", group);
    int status = load(f, s, name, &p);
    if (status == 0)
        status = decode_picture(f, s, name, &p, which == PALETTE, &s->pictures[which]);
    release(s, &p);
    const picture *made = &s->pictures[which];
    if (status == 0 && which != PALETTE &&
        (uint64_t)made->width * (uint64_t)made->height < f->info.count)
        status =
            FAULT("its picture %s has %d x %d pixels, which are too few for %" PRIu64 " Gaussians",
                  name, made->width, made->height, f->info.count);
    return status;
}

/* Reads values of bytes: a table for all channels, or in version 1 the ends of a range for each. */
static int read_codes(const trip_gaussian_file *f, const char *group, int channels,
                      double out[][CODES])
{
    const sog *s = f->state;
    double lo[4], hi[4];
    if (s->version == 2) {
        int status = numbers(f, group, "codebook", CODES, out[0]);
        for (int c = 1; c < channels && status == 0; c++)
            memcpy(out[c], out[0], sizeof out[0]);
        return status;
    }
    int status = numbers(f, group, "mins", channels, lo);
    if (status == 0)
        status = numbers(f, group, "maxs", channels, hi);
    for (int c = 0; c < channels && status == 0; c++)
        for (int i = 0; i < CODES; i++)
            out[c][i] = lo[c] + (hi[c] - lo[c]) * i / (CODES - 1);
    return status;
}

/* In version 1 one range holds for all coefficients. */
static int read_range(const trip_gaussian_file *f, double out[CODES])
{
    const sog *s = f->state;
    const cJSON *group = member(s->meta.root, "shN");
    const cJSON *lo = member(group, "mins"), *hi = member(group, "maxs");
    if (!cJSON_IsNumber(lo) || !cJSON_IsNumber(hi))
        return FAULT("meta.json lacks shN.mins or shN.maxs");
    for (int i = 0; i < CODES; i++)
        out[i] = lo->valuedouble + (hi->valuedouble - lo->valuedouble) * i / (CODES - 1);
    return 0;
}

static int load_harmonics(trip_gaussian_file *f, sog *s)
{
    if (!cJSON_IsObject(member(s->meta.root, "shN")))
        return 0;
    int status = s->version == 2 ? read_codes(f, "shN", 1, &s->coefficients)
                                 : read_range(f, s->coefficients);
    if (status == 0)
        status = load_picture(f, "shN", 0, PALETTE);
    if (status == 0)
        status = load_picture(f, "shN", 1, LABELS);
    if (status < 0)
        return status;
    const picture *p = &s->pictures[PALETTE];
    for (int degree = 1; degree <= TRIP_SH_DEGREE_MAX; degree++)
        if (p->width == PALETTE_ROW * (trip_sh_count(degree) - 1))
            f->info.degree = degree;
    s->palette_count = PALETTE_ROW * (uint32_t)p->height;
    return f->info.degree
               ? 0
               : FAULT("its palette of harmonics is %d pixels wide; widths of 192, 512 and 960 are "
                       "read",
                       p->width);
}

static int load_pictures(trip_gaussian_file *f, sog *s)
{
    static const struct {
        const char *group;
        int index;
    } files[] = { { "means", 0 }, { "means", 1 }, { "quats", 0 }, { "scales", 0 }, { "sh0", 0 } };
    int status = numbers(f, "means", "mins", 3, s->centre[0]);
    if (status == 0)
        status = numbers(f, "means", "maxs", 3, s->centre[1]);
    if (status == 0)
        status = read_codes(f, "scales", 3, s->scales);
    if (status == 0)
        status = read_codes(f, "sh0", s->version == 2 ? 3 : 4, s->colours);
    for (picture_name i = 0; i <= COLOURS && status == 0; i++)
        status = load_picture(f, files[i].group, files[i].index, i);
    return status == 0 ? load_harmonics(f, s) : status;
}

/* Reads the count, the version and the model. */
static int describe(trip_gaussian_file *f, sog *s)
{
    const cJSON *root = s->meta.root, *version = member(root, "version");
    const cJSON *count = member(root, "count");
    const char *model = cJSON_GetStringValue(member(root, "model"));
    const char *generator = cJSON_GetStringValue(member(member(root, "asset"), "generator"));
    s->version = version ? (cJSON_IsNumber(version) ? version->valueint : 0) : 1;
    if (s->version != 1 && s->version != 2)
        return FAULT("has version %d of SOG; versions 1 and 2 are read", s->version);
    if (s->version == 1)
        count = cJSON_GetArrayItem(member(member(root, "means"), "shape"), 0);
    if (!cJSON_IsNumber(count) || !(count->valuedouble >= 0 && count->valuedouble < 0x1p32))
        return FAULT("meta.json lacks the count of Gaussians");
    f->info.format = s->version == 1 ? "SOG 1" : "SOG 2";
    f->info.count = (uint64_t)count->valuedouble;
    f->info.antialiased = model && !strcmp(model, "antialiased");
    f->info.flat = model && !strcmp(model, "2dgs");
    snprintf(f->info.trainer, sizeof f->info.trainer, "%s", generator ? generator : "");
    return 0;
}

static int load_meta(trip_gaussian_file *f, sog *s)
{
    const char *slash = strrchr(f->path, '/');
    part text;
    int status = load(f, s, s->archive ? "meta.json" : slash ? slash + 1 : f->path, &text);
    if (status == 0 && text.count > META_BYTES)
        status = FAULT("meta.json has %zu bytes, which are too many", text.count);
    if (status == 0)
        status = trip_json_parse(&s->meta, (const char *)text.bytes, f->path, s->budget);
    release(s, &text);
    if (status == 0 && !cJSON_IsObject(s->meta.root))
        status = FAULT("meta.json is not JSON");
    return status;
}

static int open_sog(trip_gaussian_file *f)
{
    sog *s = f->state = calloc(1, sizeof *s);
    unsigned char mark[4] = { 0 };
    if (!s)
        return trip_gaussian_no_memory(f);
    f->info.format = "SOG";
    int status = trip_byte_stream_refuse_compressed(f->path, f->info.format);
    if (status == 0)
        status = trip_budget_create(&s->budget, 0);
    if (status < 0)
        return status;
    const int fd = open(f->path, O_RDONLY | O_CLOEXEC);
    const bool archive =
        fd >= 0 && trip_read_at(fd, mark, 4, 4, 0) == 4 && memcmp(mark, "PK\3\4", 4) == 0;
    if (fd >= 0)
        close(fd);
    if (archive && !(s->archive = unzOpen64(f->path)))
        return FAULT("is a damaged ZIP archive; is it truncated?");
    status = load_meta(f, s);
    if (status == 0)
        status = describe(f, s);
    return status == 0 && f->info.count > 0 ? load_pictures(f, s) : status;
}

/* Returns the inverse of sign(x) ln(1 + |x|). */
static double unlogarithm(double v)
{
    return copysign(expm1(fabs(v)), v);
}

/* Alpha names the largest component. The others lie within sqrt(1/2). */
static void decode_rotation(const unsigned char *p, float q[4])
{
    const int largest = p[3] - 252;
    double rest = 1;
    if (largest < 0)
        return; /* no rotation, as for a quaternion of length 0 */
    for (int i = 0, k = 0; i < 4; i++) {
        if (i == largest)
            continue;
        const double v = (p[k++] / 127.5 - 1) * M_SQRT1_2;
        q[i] = (float)v;
        rest -= v * v;
    }
    q[largest] = rest > 0 ? (float)sqrt(rest) : 0;
}

/* A row of the palette has 64 entries. Each one has a pixel for each coefficient. */
static void decode_harmonics(const trip_gaussian_file *f, const sog *s, uint64_t i,
                             trip_gaussian *g)
{
    const picture *palette = &s->pictures[PALETTE];
    const int count = trip_sh_count(f->info.degree);
    const unsigned char *p = s->pictures[LABELS].pixels + 4 * i;
    const uint32_t label = p[0] | (uint32_t)p[1] << 8;
    if (label >= s->palette_count)
        return;
    p = palette->pixels + 4 * ((size_t)(label / PALETTE_ROW) * (size_t)palette->width +
                               (size_t)(label % PALETTE_ROW) * (size_t)(count - 1));
    for (int k = 1; k < count; k++, p += 4)
        for (int c = 0; c < 3; c++)
            g->sh[k][c] = (float)s->coefficients[p[c]];
}

static void decode(const trip_gaussian_file *f, uint64_t i, trip_gaussian *g)
{
    const sog *s = f->state;
    const unsigned char *low = s->pictures[CENTRES_LOW].pixels + 4 * i;
    const unsigned char *high = s->pictures[CENTRES_HIGH].pixels + 4 * i;
    const unsigned char *scale = s->pictures[SCALES].pixels + 4 * i;
    const unsigned char *colour = s->pictures[COLOURS].pixels + 4 * i;
    for (int a = 0; a < 3; a++) {
        const double t = (low[a] | high[a] << 8) / 65535.0;
        g->centre[a] = unlogarithm(s->centre[0][a] + (s->centre[1][a] - s->centre[0][a]) * t);
        g->deviations[a] = (float)exp(s->scales[a][scale[a]]);
        g->sh[0][a] = (float)s->colours[a][colour[a]];
    }
    if (f->info.flat)
        g->deviations[2] = 0;
    g->opacity = s->version == 2 ? colour[3] / 255.0f : trip_sigmoid(s->colours[3][colour[3]]);
    decode_rotation(s->pictures[ROTATIONS].pixels + 4 * i, g->rotation);
    if (f->info.degree > 0)
        decode_harmonics(f, s, i, g);
}

static int read_sog(trip_gaussian_file *f, trip_gaussian *out, size_t count)
{
    for (size_t i = 0; i < count; i++)
        decode(f, f->done + i, &out[i]);
    return 0;
}

static int rewind_sog(trip_gaussian_file *f)
{
    (void)f;
    return 0;
}

static void close_sog(trip_gaussian_file *f)
{
    sog *s = f->state;
    if (!s)
        return;
    trip_json_free(&s->meta);
    for (picture_name i = 0; i < PICTURES; i++)
        if (s->pictures[i].pixels)
            trip_budget_release(s->budget, s->pictures[i].pixels, s->pictures[i].bytes);
    if (s->archive)
        unzClose(s->archive);
    if (s->budget)
        trip_budget_destroy(s->budget);
    free(s);
}

const trip_gaussian_reader trip_read_sog = { probe, open_sog, read_sog, rewind_sog, close_sog };
