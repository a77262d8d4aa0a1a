#include "range_frames.h"

#include <cjson/cJSON.h>
#include <dirent.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "file_path.h"
#include "json.h"
#include "report.h"
#include "text_lines.h"

enum {
    FRAMES_MAX = 1 << 16,
    JSON_BYTES_MAX = 1 << 26,
    ROOM = 16,
};

/* A layout of a folder. A frame has one name in all its folders. */
typedef struct layout {
    const char *name;
    const char *depth_folder, *depth_suffix;
    const char *colour_folder, *colour_suffixes[2];
    const char *pose_folder, *pose_suffix;
    const char *intrinsics;
    double camera[4]; /* focal lengths and centre, without a file; 0: none */
} layout;

static const layout layouts[] = {
    { "7-Scenes",
      ".",
      ".depth.png",
      ".",
      { ".color.jpg", ".color.png" },
      ".",
      ".pose.txt",
      "camera-intrinsics.txt",
      { 585, 585, 320, 240 } },
    { "ScanNet",
      "depth",
      ".png",
      "color",
      { ".jpg", ".png" },
      "pose",
      ".txt",
      "intrinsic/intrinsic_depth.txt",
      { 0 } },
};

/* The noise of the first Kinect without its grazing term (range_shape.h), in metres. */
static const trip_range_noise kinect = { 0.0012 + 0.0019 * 0.16, -0.0019 * 0.8, 0.0019 };

static int fail_memory(const char *path)
{
    return trip_fail(TRIP_ERROR, "read", path, "out of memory for its list of frames");
}

static trip_range_frame *add_frame(trip_range_frames *f, const char *path)
{
    if (f->count == FRAMES_MAX) {
        trip_fail(TRIP_ERROR, "read", path, "holds more than %d range images", FRAMES_MAX);
        return NULL;
    }
    if (f->count == f->room) {
        const uint32_t room = f->room ? 2 * f->room : ROOM;
        trip_range_frame *frames = realloc(f->frames, room * sizeof *frames);
        if (!frames) {
            fail_memory(path);
            return NULL;
        }
        f->frames = frames;
        f->room = room;
    }
    trip_range_frame *made = &f->frames[f->count++];
    *made = (trip_range_frame){ .noise = kinect };
    return made;
}

static void drop_frame(trip_range_frames *f)
{
    trip_range_frame *last = &f->frames[--f->count];
    free(last->depth);
    free(last->colour);
}

void trip_range_frames_free(trip_range_frames *f)
{
    while (f->count > 0)
        drop_frame(f);
    free(f->frames);
    *f = (trip_range_frames){ 0 };
}

static bool is_file(const char *path)
{
    struct stat st;
    return stat(path, &st) == 0 && S_ISREG(st.st_mode);
}

/* Reads a small regular file. Returns its text for free(), or NULL after a reported failure. */
static char *read_text(const char *path, size_t most)
{
    char *text = NULL;
    struct stat st;
    FILE *f = fopen(path, "re");
    if (!f || fstat(fileno(f), &st) < 0) {
        trip_fail_errno("read", path, "cannot read");
    } else if (!S_ISREG(st.st_mode) || (uint64_t)st.st_size > most) {
        trip_fail(TRIP_ERROR, "read", path, "is no text file of at most %zu bytes", most);
    } else if (!(text = calloc(1, (size_t)st.st_size + 1))) {
        fail_memory(path);
    } else if (fread(text, 1, (size_t)st.st_size, f) != (size_t)st.st_size) {
        trip_fail(TRIP_ERROR, "read", path, "cannot be read to its end");
        free(text);
        text = NULL;
    } else if (memchr(text, 0, (size_t)st.st_size)) {
        trip_fail(TRIP_ERROR, "read", path, "holds a zero byte; is it a text?");
        free(text);
        text = NULL;
    }
    if (f)
        fclose(f);
    return text;
}

/* ---- poses ---- */

/* Whether a matrix turns and shifts without changing sizes, up to one part in a hundred. A mirror
 * is none. */
static bool is_rigid(double m[3][4])
{
    double product = 0;
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) {
            const double dot = m[0][i] * m[0][k] + m[1][i] * m[1][k] + m[2][i] * m[2][k];
            if (!(fabs(dot - (i == k)) <= 0.01))
                return false;
        }
    for (int i = 0; i < 3; i++)
        product += m[0][i] *
                   (m[1][(i + 1) % 3] * m[2][(i + 2) % 3] - m[1][(i + 2) % 3] * m[2][(i + 1) % 3]);
    return product > 0;
}

static bool is_finite(double m[3][4])
{
    bool finite = true;
    for (int i = 0; i < 12; i++)
        finite = finite && fabs(m[i / 4][i % 4]) <= 1e15;
    return finite;
}

/* Checks a pose. Sets *usable to false for one that is not finite, as trackers write it. */
static int check_pose(const char *path, const char *frame, double m[3][4], bool *usable)
{
    *usable = is_finite(m);
    return !*usable || is_rigid(m)
               ? 0
               : trip_fail(TRIP_ERROR, "read", path,
                           "the pose of %s is no rotation with a shift; a pose leads from the "
                           "camera to the scene",
                           frame);
}

/* ---- folders ---- */

/* Reads the first numbers of a text file. */
static int read_numbers(const char *path, double *values, unsigned count)
{
    trip_text_lines *lines = NULL;
    unsigned got = 0;
    char *line = NULL;
    int status = is_file(path) ? trip_text_lines_open(&lines, path)
                               : trip_fail(TRIP_ERROR, "read", path, "is no file");
    while (status == 0 && got < count) {
        const char *wrong = NULL;
        status = trip_text_lines_next(lines, &line);
        if (status < 0 || !line)
            break;
        const int more = trip_text_row(line, values + got, count - got, &wrong);
        if (more < 0)
            status = trip_fail_line("read", path, trip_text_lines_number(lines),
                                    "\"%.40s\" is no number", wrong);
        got = more > 0 && (unsigned)more < count - got ? got + (unsigned)more
              : more > 0                               ? count
                                                       : got;
    }
    trip_text_lines_close(lines);
    return status < 0 || got == count
               ? status
               : trip_fail(TRIP_ERROR, "read", path, "holds %u numbers, and needs %u", got, count);
}

/* Returns FOLDER/PART/NAMESUFFIX for free(), or NULL after a reported failure. The name ends after
 * `bytes`. */
static char *join(const char *folder, const char *part, const char *name, size_t bytes,
                  const char *suffix)
{
    char *path = NULL;
    const bool here = !strcmp(part, ".");
    if (asprintf(&path, "%s/%s%s%.*s%s", folder, here ? "" : part, here ? "" : "/", (int)bytes,
                 name, suffix) < 0) {
        fail_memory(folder);
        return NULL;
    }
    return path;
}

static bool ends_in(const char *name, const char *end)
{
    const size_t length = strlen(name), tail = strlen(end);
    return length > tail && !strcmp(name + length - tail, end);
}

/* Sets the camera of all frames. The file may also stand beside the folder. */
static int read_camera(const char *folder, const layout *l, double m[4], bool *stated)
{
    char *path = join(folder, ".", l->intrinsics, strlen(l->intrinsics), "");
    if (path && !is_file(path)) {
        free(path);
        path = join(folder, "..", l->intrinsics, strlen(l->intrinsics), "");
    }
    if (!path)
        return TRIP_ERROR;
    int status = 0;
    *stated = is_file(path);
    if (*stated) {
        const bool wide = !strcmp(l->name, "ScanNet"); /* 4 x 4 */
        double row[8];
        status = read_numbers(path, row, wide ? 8 : 6);
        const double camera[4] = { row[0], wide ? row[5] : row[4], row[2], wide ? row[6] : row[5] };
        memcpy(m, camera, sizeof camera);
    } else if (l->camera[0] > 0) {
        memcpy(m, l->camera, 4 * sizeof *m);
    } else {
        status = trip_fail(TRIP_ERROR, "read", path,
                           "is missing; it holds the camera's focal "
                           "lengths");
    }
    if (status == 0 &&
        !(m[0] > 0 && m[1] > 0 && m[0] < 1e9 && m[1] < 1e9 && fabs(m[2]) < 1e9 && fabs(m[3]) < 1e9))
        status = trip_fail(TRIP_ERROR, "read", path,
                           "states no camera: its focal lengths are %g "
                           "and %g",
                           m[0], m[1]);
    free(path);
    return status;
}

static int add_named(trip_range_frames *f, const char *folder, const layout *l, const char *name,
                     const double camera[4])
{
    const size_t bytes = strlen(name) - strlen(l->depth_suffix);
    trip_range_frame *made = add_frame(f, folder);
    bool usable = false;
    if (!made)
        return TRIP_ERROR;
    made->depth = join(folder, l->depth_folder, name, bytes, l->depth_suffix);
    char *pose = join(folder, l->pose_folder, name, bytes, l->pose_suffix);
    int status = made->depth && pose ? 0 : TRIP_ERROR;
    for (int i = 0; i < 2 && status == 0 && !made->colour; i++) {
        char *colour = join(folder, l->colour_folder, name, bytes, l->colour_suffixes[i]);
        if (colour && is_file(colour))
            made->colour = colour;
        else
            free(colour);
    }
    /* Pixel i has its middle at i in these files. */
    for (int a = 0; a < 2; a++) {
        made->focal[a] = camera[a];
        made->centre[a] = camera[2 + a] + 0.5;
    }
    if (status == 0 && is_file(pose)) {
        double v[12];
        status = read_numbers(pose, v, 12);
        memcpy(made->pose, v, sizeof v);
        if (status == 0)
            status = check_pose(pose, "this frame", made->pose, &usable);
    }
    free(pose);
    if (status == 0 && !usable) {
        f->without_pose++;
        drop_frame(f);
    }
    return status;
}

static int compare_names(const struct dirent **a, const struct dirent **b)
{
    return versionsort(a, b);
}

static int find_in_folder(trip_range_frames *f, const char *path, const layout *l)
{
    char *folder = join(path, l->depth_folder, "", 0, "");
    struct dirent **names = NULL;
    double camera[4] = { 0 };
    bool stated = false;
    int status = folder ? read_camera(path, l, camera, &stated) : TRIP_ERROR;
    const int count = status == 0 ? scandir(folder, &names, NULL, compare_names) : 0;
    if (count < 0)
        status = trip_fail_errno("read", folder, "cannot list");
    for (int i = 0; i < count; i++) {
        if (status == 0 && ends_in(names[i]->d_name, l->depth_suffix))
            status = add_named(f, path, l, names[i]->d_name, camera);
        free(names[i]);
    }
    free(names);
    free(folder);
    f->default_camera = !stated;
    f->layout = l->name;
    return status;
}

/* Returns the layout of a folder, or NULL: it has a depth image and a pose of the same frame. */
static const layout *layout_of(const char *path)
{
    for (size_t i = 0; i < sizeof layouts / sizeof *layouts; i++) {
        const layout *l = &layouts[i];
        char folder[4096];
        const int length = snprintf(folder, sizeof folder, "%s/%s", path, l->depth_folder);
        DIR *d = length > 0 && (size_t)length < sizeof folder ? opendir(folder) : NULL;
        bool found = false;
        for (struct dirent *e; d && !found && (e = readdir(d));) {
            char pose[4096 + 512];
            const size_t bytes = strlen(e->d_name);
            if (!ends_in(e->d_name, l->depth_suffix))
                continue;
            snprintf(pose, sizeof pose, "%s/%s/%.*s%s", path, l->pose_folder,
                     (int)(bytes - strlen(l->depth_suffix)), e->d_name, l->pose_suffix);
            found = is_file(pose);
        }
        if (d)
            closedir(d);
        if (found)
            return l;
    }
    return NULL;
}

bool trip_range_is_folder(const char *path)
{
    struct stat st;
    return stat(path, &st) == 0 && S_ISDIR(st.st_mode) && layout_of(path);
}

/* ---- JSON ---- */

bool trip_range_is_json(const unsigned char *head, unsigned long count)
{
    unsigned long at = 0;
    while (at < count && strchr(" \t\r\n", head[at]) && head[at])
        at++;
    return at < count && head[at] == '{' &&
           memmem(head, count, "\"depth_file_path\"", strlen("\"depth_file_path\"")) &&
           memmem(head, count, "\"transform_matrix\"", strlen("\"transform_matrix\""));
}

/* Where the members are that describe a camera: in a frame, or else in the file. */
typedef struct json_frame {
    const char *path; /* of the file */
    const cJSON *root, *frame;
    unsigned number;
} json_frame;

static int fault(const json_frame *j, const char *name, const char *why)
{
    return trip_fail(TRIP_ERROR, "read", j->path, "frame %u: \"%s\" %s", j->number, name, why);
}

static const cJSON *member(const json_frame *j, const char *name)
{
    const cJSON *own = cJSON_GetObjectItemCaseSensitive(j->frame, name);
    return own ? own : cJSON_GetObjectItemCaseSensitive(j->root, name);
}

/* Reads a number from `lo` to `hi`. An absent one leaves *out. */
static int get_number(const json_frame *j, const char *name, double lo, double hi, double *out)
{
    const cJSON *n = member(j, name);
    char why[64];
    if (!n)
        return 0;
    snprintf(why, sizeof why, "must be a number from %g to %g", lo, hi);
    if (!cJSON_IsNumber(n) || !(n->valuedouble >= lo && n->valuedouble <= hi))
        return fault(j, name, why);
    *out = n->valuedouble;
    return 0;
}

static int get_noise(const json_frame *j, trip_range_noise *out)
{
    const cJSON *array = member(j, "depth_noise");
    double v[3] = { 0 };
    int i = 0;
    if (!array)
        return 0;
    bool good = cJSON_IsArray(array) && cJSON_GetArraySize(array) == 3;
    for (const cJSON *n = good ? array->child : NULL; n; n = n->next) {
        good = good && cJSON_IsNumber(n) && fabs(n->valuedouble) <= 1e6;
        v[i++] = n->valuedouble;
    }
    *out = (trip_range_noise){ v[0], v[1], v[2] };
    return good ? 0 : fault(j, "depth_noise", "must be three numbers a, b, c for a + b z + c z^2");
}

/* Reads a pose with x to the right, y up and z backward. */
static int get_pose(const json_frame *j, trip_range_frame *f, bool *usable)
{
    const cJSON *rows = cJSON_GetObjectItemCaseSensitive(j->frame, "transform_matrix");
    char name[32];
    int i = 0;
    bool good = cJSON_IsArray(rows) && cJSON_GetArraySize(rows) >= 3;
    for (const cJSON *row = good ? rows->child : NULL; row && i < 3; row = row->next, i++) {
        int k = 0;
        good = good && cJSON_IsArray(row) && cJSON_GetArraySize(row) == 4;
        for (const cJSON *n = good ? row->child : NULL; n; n = n->next, k++)
            f->pose[i][k] =
                (k == 1 || k == 2 ? -1 : 1) * (cJSON_IsNumber(n) ? n->valuedouble : NAN);
    }
    if (!good)
        return fault(j, "transform_matrix", "must be a matrix of 4 rows of 4 numbers");
    snprintf(name, sizeof name, "frame %u", j->number);
    return check_pose(j->path, name, f->pose, usable);
}

static int get_camera(const json_frame *j, trip_range_frame *f)
{
    static const char *const distortion[] = { "k1", "k2", "p1", "p2" };
    const cJSON *model = member(j, "camera_model");
    static const char *const models[] = { "OPENCV", "PINHOLE", "SIMPLE_PINHOLE", "SIMPLE_RADIAL",
                                          "RADIAL" };
    bool known = !model;
    for (size_t i = 0; i < sizeof models / sizeof *models && !known; i++)
        known = cJSON_IsString(model) && !strcmp(model->valuestring, models[i]);
    if (!known)
        return fault(j, "camera_model",
                     "is none of OPENCV, PINHOLE, SIMPLE_PINHOLE, RADIAL and "
                     "SIMPLE_RADIAL");
    int status = get_number(j, "fl_x", 1e-3, 1e9, &f->focal[0]);
    f->focal[1] = f->focal[0];
    if (status == 0)
        status = get_number(j, "fl_y", 1e-3, 1e9, &f->focal[1]);
    if (status == 0)
        status = get_number(j, "camera_angle_x", 1e-3, 3.1, &f->angle);
    if (status == 0)
        status = get_number(j, "w", 1, 1e9, &f->size[0]);
    if (status == 0)
        status = get_number(j, "h", 1, 1e9, &f->size[1]);
    f->centre[0] = f->centre[1] = NAN;
    if (status == 0)
        status = get_number(j, "cx", -1e9, 1e9, &f->centre[0]);
    if (status == 0)
        status = get_number(j, "cy", -1e9, 1e9, &f->centre[1]);
    for (int i = 0; i < 4 && status == 0; i++)
        status = get_number(j, distortion[i], -10, 10, &f->distortion[i]);
    if (status == 0 && !(f->focal[0] > 0) && !(f->angle > 0))
        status = fault(j, "fl_x",
                       "is missing, and so is \"camera_angle_x\": give the focal "
                       "length in pixels");
    if (status == 0 && !(f->focal[1] > 0))
        f->focal[1] = f->focal[0];
    return status;
}

/* Returns a path beside the JSON file for free(), or NULL. Some files leave ".png" out. */
static char *path_of(const json_frame *j, const char *name)
{
    const cJSON *text = cJSON_GetObjectItemCaseSensitive(j->frame, name);
    char *path = cJSON_IsString(text) && *text->valuestring
                     ? trip_path_beside(j->path, text->valuestring)
                     : NULL;
    char *longer = NULL;
    if (path && !is_file(path) && asprintf(&longer, "%s.png", path) >= 0 && is_file(longer)) {
        free(path);
        return longer;
    }
    free(longer);
    return path;
}

static int add_json_frame(trip_range_frames *list, const json_frame *j)
{
    trip_range_frame *f = add_frame(list, j->path);
    bool usable = false;
    if (!f)
        return TRIP_ERROR;
    if (!cJSON_IsObject(j->frame))
        return fault(j, "frames", "must hold objects");
    f->depth = path_of(j, "depth_file_path");
    f->colour = path_of(j, "file_path");
    if (!f->depth) {
        list->without_depth++;
        drop_frame(list);
        return 0;
    }
    int status = get_pose(j, f, &usable);
    if (status == 0)
        status = get_camera(j, f);
    if (status == 0)
        status = get_number(j, "depth_unit_scale_factor", 1e-9, 1e9, &f->scale);
    if (status == 0 && !(f->scale > 0))
        status = get_number(j, "integer_depth_scale", 1e-9, 1e9, &f->scale);
    if (status == 0)
        status = get_number(j, "depth_near", 0, 1e9, &f->nearest);
    if (status == 0)
        status = get_number(j, "depth_far", 0, 1e9, &f->farthest);
    if (status == 0)
        status = get_noise(j, &f->noise);
    list->noisy = list->noisy || member(j, "depth_noise");
    if (status == 0 && f->colour && !is_file(f->colour)) {
        free(f->colour);
        f->colour = NULL;
    }
    if (status == 0 && !usable) {
        list->without_pose++;
        drop_frame(list);
    }
    return status;
}

static int find_in_json(trip_range_frames *list, const char *path)
{
    trip_json json = { 0 };
    char *text = read_text(path, JSON_BYTES_MAX);
    int status = text ? trip_json_parse(&json, text, path, NULL) : TRIP_ERROR;
    const cJSON *frames = json.root ? cJSON_GetObjectItemCaseSensitive(json.root, "frames") : NULL;
    list->layout = "transforms.json";
    if (status == 0 && !json.root)
        status = trip_fail(TRIP_ERROR, "read", path, "is not JSON at byte %zu",
                           (size_t)(json.end - text));
    else if (status == 0 && !cJSON_IsArray(frames))
        status = trip_fail(TRIP_ERROR, "read", path, "has no list \"frames\"");
    json_frame j = { .path = path, .root = json.root, .frame = frames ? frames->child : NULL };
    for (; status == 0 && j.frame; j.frame = j.frame->next) {
        j.number++;
        status = add_json_frame(list, &j);
    }
    trip_json_free(&json);
    free(text);
    return status;
}

/* ---- any ---- */

int trip_range_frames_find(trip_range_frames *out, const char *path)
{
    const layout *l = layout_of(path);
    int status = l ? find_in_folder(out, path, l) : find_in_json(out, path);
    if (status == 0 && out->count == 0)
        status = trip_fail(TRIP_ERROR, "read", path,
                           "has no range image with a pose: %u frames lack a pose, and %u a depth "
                           "image",
                           out->without_pose, out->without_depth);
    if (status < 0)
        trip_range_frames_free(out);
    return status;
}

int trip_range_frames_list(const char *path, int (*add)(void *user, const char *file), void *user)
{
    trip_range_frames f = { 0 };
    const bool folder = trip_range_is_folder(path);
    const layout *l = folder ? layout_of(path) : NULL;
    int status = trip_range_frames_find(&f, path);
    if (status == 0 && !folder)
        status = add(user, path);
    for (uint32_t i = 0; i < f.count && status == 0; i++) {
        status = add(user, f.frames[i].depth);
        if (status == 0 && f.frames[i].colour)
            status = add(user, f.frames[i].colour);
        if (status == 0 && l) {
            const char *name = strrchr(f.frames[i].depth, '/') + 1;
            char *pose = join(path, l->pose_folder, name, strlen(name) - strlen(l->depth_suffix),
                              l->pose_suffix);
            status = pose ? add(user, pose) : TRIP_ERROR;
            free(pose);
        }
    }
    for (int up = 0; up < 2 && status == 0 && l; up++) {
        char *camera = join(path, up ? ".." : ".", l->intrinsics, strlen(l->intrinsics), "");
        status = !camera ? TRIP_ERROR : is_file(camera) ? add(user, camera) : 0;
        free(camera);
    }
    trip_range_frames_free(&f);
    return status;
}
