/* Reads Gaussian scenes in glTF (KHR_gaussian_splatting): primitives of points with linear
 * deviations, opacity from 0 to 1, quaternions from x on, and coefficients. Nodes place them. */
#include "gaussian_file_internal.h"

#include <cjson/cJSON.h>
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "byte_stream.h"
#include "gaussian_transform.h"
#include "gltf_file.h"
#include "report.h"

#define EXTENSION "KHR_gaussian_splatting"

enum { BATCH = 512, DEPTH_MAX = 64, NODES_MAX = 1 << 14, PARTS_MAX = 1024 };

typedef enum attribute { CENTRE, ROTATION, SCALE, OPACITY, HARMONICS } attribute;
enum { ATTRIBUTES = HARMONICS + TRIP_SH_MAX };

static const unsigned component_counts[] = { 3, 4, 3, 1, 3 };

/* A primitive at a node. */
typedef struct part {
    trip_gltf_accessor attributes[ATTRIBUTES];
    int degree;
    trip_gaussian_transform transform;
} part;

typedef struct scene {
    trip_gltf_file file;
    part **parts;
    size_t part_count, part; /* `part` is being read */
    uint64_t done;           /* Gaussians of it */
    int nodes;               /* visited */
    unsigned char room[BATCH * TRIP_GLTF_STRIDE_MAX];
    float values[ATTRIBUTES][BATCH * 4];
} scene;

#define FAULT(...) trip_fail(TRIP_ERROR, "read", f->path, __VA_ARGS__)

static const cJSON *member(const cJSON *object, const char *name)
{
    return cJSON_GetObjectItemCaseSensitive(object, name);
}

static bool probe(const trip_gaussian_head *head)
{
    return head->count >= 4 &&
           (memcmp(head->bytes, "glTF", 4) == 0 || memchr("{ \t\r\n", head->bytes[0], 5)) &&
           memmem(head->bytes, head->count, "\"" EXTENSION "\"", sizeof EXTENSION + 1);
}

/* ---- parts ---- */

/* Writes the name of an attribute. */
static void name_of(int which, char name[64])
{
    static const char *const names[] = { "POSITION", EXTENSION ":ROTATION", EXTENSION ":SCALE",
                                         EXTENSION ":OPACITY" };
    if (which < HARMONICS) {
        snprintf(name, 64, "%s", names[which]);
        return;
    }
    const int k = which - HARMONICS, degree = (int)sqrt(k);
    snprintf(name, 64, EXTENSION ":SH_DEGREE_%d_COEF_%d", degree, k - degree * degree);
}

/* Opens the attributes. Each degree of harmonics must be whole. */
static int open_attributes(const trip_gaussian_file *f, const cJSON *attributes, part *p)
{
    scene *s = f->state;
    int coefficients = 0;
    for (int i = 0; i < ATTRIBUTES; i++) {
        char name[64];
        name_of(i, name);
        const int index = trip_gltf_index(attributes, name);
        if (index < 0 && i <= HARMONICS)
            return FAULT("a primitive of Gaussians lacks the attribute %s", name);
        if (index < 0)
            continue;
        if (i >= HARMONICS && i - HARMONICS != coefficients++)
            return FAULT("has the attribute %s, but lacks others of its degree", name);
        int status = trip_gltf_accessor_open(&s->file, index,
                                             component_counts[i < HARMONICS ? i : HARMONICS], name,
                                             &p->attributes[i]);
        if (status < 0)
            return status;
        if (p->attributes[i].count != p->attributes[CENTRE].count)
            return FAULT("the attribute %s has %" PRIu64 " rows, but POSITION has %" PRIu64, name,
                         p->attributes[i].count, p->attributes[CENTRE].count);
    }
    while (trip_sh_count(p->degree) < coefficients)
        p->degree++;
    return trip_sh_count(p->degree) == coefficients
               ? 0
               : FAULT("has %d coefficients of harmonics; degrees 0 to 3 have 1, 4, 9 and 16",
                       coefficients);
}

/* Warns of properties that would need other drawing. */
static void note_properties(const trip_gaussian_file *f, const cJSON *extension)
{
    const char *kernel = cJSON_GetStringValue(member(extension, "kernel"));
    const char *space = cJSON_GetStringValue(member(extension, "colorSpace"));
    if (kernel && strcmp(kernel, "ellipse") != 0)
        trip_warn(f->path, "has the kernel %.40s; it is drawn as an ellipse", kernel);
    if (space && strncmp(space, "lin", 3) == 0)
        trip_warn(f->path, "has linear colours (%.40s); they are drawn as they are", space);
}

static int add_part(trip_gaussian_file *f, const cJSON *primitive, const cJSON *extension,
                    const trip_gaussian_transform *transform)
{
    scene *s = f->state;
    if (s->part_count == PARTS_MAX)
        return FAULT("has more than %d primitives of Gaussians", PARTS_MAX);
    part *p = calloc(1, sizeof *p);
    if (!p)
        return trip_gaussian_no_memory(f);
    s->parts[s->part_count++] = p;
    p->transform = *transform;
    if (s->part_count == 1)
        note_properties(f, extension);
    int status = open_attributes(f, member(primitive, "attributes"), p);
    if (status < 0)
        return status;
    f->info.count += p->attributes[CENTRE].count;
    f->info.degree = p->degree > f->info.degree ? p->degree : f->info.degree;
    return 0;
}

static int add_mesh(trip_gaussian_file *f, int mesh, const double m[3][4])
{
    const scene *s = f->state;
    const cJSON *primitive;
    const cJSON *primitives = member(trip_gltf_item(&s->file, "meshes", mesh), "primitives");
    cJSON_ArrayForEach(primitive, primitives)
    {
        const cJSON *extension = member(member(primitive, "extensions"), EXTENSION);
        trip_gaussian_transform transform;
        if (!extension)
            continue;
        if (!trip_gaussian_transform_make(&transform, m))
            return FAULT("a node mirrors, shears or flattens its Gaussians, which is not possible");
        int status = add_part(f, primitive, extension, &transform);
        if (status < 0)
            return status;
    }
    return 0;
}

/* ---- nodes ---- */

/* Reads `count` numbers of a member. Returns false if it is absent or something else. */
static bool numbers(const cJSON *object, const char *name, int count, double *out)
{
    const cJSON *array = member(object, name);
    if (cJSON_GetArraySize(array) != count)
        return false;
    const cJSON *item = array->child;
    for (int i = 0; i < count; i++, item = item->next) {
        if (!cJSON_IsNumber(item))
            return false;
        out[i] = item->valuedouble;
    }
    return true;
}

/* Reads the transform of a node: a matrix, or translation, rotation and scale. */
static void read_transform(const cJSON *node, double m[3][4])
{
    double c[16], t[3] = { 0 }, q[4] = { 0, 0, 0, 1 }, s[3] = { 1, 1, 1 };
    if (numbers(node, "matrix", 16, c)) {
        for (int i = 0; i < 3; i++)
            for (int k = 0; k < 4; k++)
                m[i][k] = c[4 * k + i];
        return;
    }
    numbers(node, "translation", 3, t);
    numbers(node, "rotation", 4, q);
    numbers(node, "scale", 3, s);
    const double x = q[0], y = q[1], z = q[2], w = q[3];
    const double r[3][3] = {
        { 1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y) },
        { 2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x) },
        { 2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y) },
    };
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++)
            m[i][k] = r[i][k] * s[k];
        m[i][3] = t[i];
    }
}

static void multiply(const double a[3][4], const double b[3][4], double out[3][4])
{
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 4; k++)
            out[i][k] =
                a[i][0] * b[0][k] + a[i][1] * b[1][k] + a[i][2] * b[2][k] + (k == 3 ? a[i][3] : 0);
}

static int visit(trip_gaussian_file *f, int index, const double parent[3][4], int depth)
{
    scene *s = f->state;
    const cJSON *node = trip_gltf_item(&s->file, "nodes", index), *child;
    double own[3][4], m[3][4];
    if (!node)
        return FAULT("names the node %d, which does not exist", index);
    if (depth > DEPTH_MAX || ++s->nodes > NODES_MAX)
        return FAULT("its nodes are nested too deep, or are too many");
    read_transform(node, own);
    multiply(parent, (const double(*)[4])own, m);
    const int mesh = trip_gltf_index(node, "mesh");
    int status = mesh < 0 ? 0 : add_mesh(f, mesh, (const double(*)[4])m);
    const cJSON *children = member(node, "children");
    for (child = children ? children->child : NULL; child && status == 0; child = child->next)
        status = visit(f, cJSON_IsNumber(child) ? child->valueint : -1, (const double(*)[4])m,
                       depth + 1);
    return status;
}

/* Visits the nodes of the default scene. Without scenes, all meshes are in their place. */
static int visit_scene(trip_gaussian_file *f)
{
    static const double unit[3][4] = { { 1, 0, 0, 0 }, { 0, 1, 0, 0 }, { 0, 0, 1, 0 } };
    const scene *s = f->state;
    const cJSON *root = s->file.json.root, *node;
    const int number = trip_gltf_index(root, "scene");
    const cJSON *chosen = trip_gltf_item(&s->file, "scenes", number < 0 ? 0 : number);
    int status = 0;
    const int meshes = chosen ? 0 : cJSON_GetArraySize(member(root, "meshes"));
    for (int i = 0; i < meshes && status == 0; i++)
        status = add_mesh(f, i, unit);
    const cJSON *nodes = member(chosen, "nodes");
    for (node = nodes ? nodes->child : NULL; node && status == 0; node = node->next)
        status = visit(f, cJSON_IsNumber(node) ? node->valueint : -1, unit, 0);
    return status;
}

/* ---- the reader ---- */

static int check_required(const trip_gaussian_file *f, const cJSON *root)
{
    static const char *const known[] = { EXTENSION, "KHR_mesh_quantization" };
    const cJSON *item;
    cJSON_ArrayForEach(item, member(root, "extensionsRequired"))
    {
        const char *name = cJSON_GetStringValue(item);
        bool found = false;
        for (size_t i = 0; name && i < sizeof known / sizeof *known; i++)
            found = found || !strcmp(name, known[i]);
        if (!found)
            return FAULT("needs the extension %.60s of glTF, which is not read",
                         name ? name : "\"\"");
    }
    return 0;
}

static int open_gltf(trip_gaussian_file *f)
{
    scene *s = f->state = calloc(1, sizeof *s);
    if (!s || !(s->parts = calloc(PARTS_MAX, sizeof(part *))))
        return trip_gaussian_no_memory(f);
    f->info.format = "glTF";
    int status = trip_byte_stream_refuse_compressed(f->path, f->info.format);
    if (status == 0)
        status = trip_gltf_open(&s->file, f->path);
    if (status < 0)
        return status;
    const cJSON *root = s->file.json.root;
    const char *generator = cJSON_GetStringValue(member(member(root, "asset"), "generator"));
    snprintf(f->info.trainer, sizeof f->info.trainer, "%s", generator ? generator : "");
    memcpy(f->info.up, "y", sizeof "y");
    status = check_required(f, root);
    return status == 0 ? visit_scene(f) : status;
}

static void decode(const trip_gaussian_file *f, const part *p, size_t i, trip_gaussian *g)
{
    const scene *s = f->state;
    const float *q = s->values[ROTATION] + 4 * i;
    for (size_t a = 0; a < 3; a++) {
        g->centre[a] = (double)s->values[CENTRE][3 * i + a];
        g->deviations[a] = s->values[SCALE][3 * i + a];
        for (int k = 0; k < trip_sh_count(p->degree); k++)
            g->sh[k][a] = s->values[HARMONICS + k][3 * i + a];
    }
    for (int k = 0; k < 4; k++)
        g->rotation[(k + 1) % 4] = q[k];
    g->opacity = s->values[OPACITY][i];
    trip_gaussian_transform_apply(&p->transform, p->degree, g);
}

static int read_rows(trip_gaussian_file *f, trip_gaussian *out, size_t count)
{
    scene *s = f->state;
    const part *p = s->parts[s->part];
    int status = 0;
    for (int i = 0; i < HARMONICS + trip_sh_count(p->degree) && status == 0; i++)
        status = trip_gltf_accessor_read(&s->file, &p->attributes[i], s->done, count, s->room,
                                         s->values[i]);
    for (size_t i = 0; i < count && status == 0; i++)
        decode(f, p, i, &out[i]);
    s->done += count;
    return status;
}

static int read_gltf(trip_gaussian_file *f, trip_gaussian *out, size_t count)
{
    scene *s = f->state;
    int status = 0;
    for (size_t done = 0; done < count && status == 0;) {
        const uint64_t left = s->parts[s->part]->attributes[CENTRE].count - s->done;
        size_t n = count - done < BATCH ? count - done : BATCH;
        n = left < n ? (size_t)left : n;
        if (n == 0) {
            s->part++;
            s->done = 0;
            continue;
        }
        status = read_rows(f, out + done, n);
        done += n;
    }
    return status;
}

static int rewind_gltf(trip_gaussian_file *f)
{
    scene *s = f->state;
    s->part = 0;
    s->done = 0;
    return 0;
}

static void close_gltf(trip_gaussian_file *f)
{
    scene *s = f->state;
    if (!s)
        return;
    for (size_t i = 0; i < s->part_count; i++)
        free(s->parts[i]);
    free(s->parts);
    trip_gltf_close(&s->file);
    free(s);
}

const trip_gaussian_reader trip_read_gltf_gaussians = { probe, open_gltf, read_gltf, rewind_gltf,
                                                        close_gltf };
