#include "own_file_info.h"

#include <cjson/cJSON.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "camera_path.h"
#include "input_file.h"
#include "json.h"
#include "other_file.h"
#include "report.h"
#include "script.h"
#include "text.h"
#include "transfer_function.h"

static trip_other_kind kind_of(const char *path, char text[TRIP_OTHER_TEXT_BYTES])
{
    unsigned char head[TRIP_OTHER_HEAD_BYTES];
    struct stat st;
    *text = 0;
    if (stat(path, &st) != 0 || !S_ISREG(st.st_mode))
        return TRIP_OTHER_UNKNOWN;
    const int fd = trip_input_open(path);
    const ssize_t bytes = fd < 0 ? -1 : trip_input_read(fd, head, sizeof head);
    if (fd >= 0)
        close(fd);
    return bytes <= 0 ? TRIP_OTHER_UNKNOWN : trip_other_file_tell(path, head, (size_t)bytes, text);
}

bool own_file_wanted(const char *path)
{
    char text[TRIP_OTHER_TEXT_BYTES];
    const trip_other_kind kind = kind_of(path, text);
    return kind > TRIP_OTHER_FOREIGN && kind != TRIP_OTHER_INDEX;
}

/* The functions below read a file as its option does, and write a line about its contents. */

static int describe_function(const char *path, char *line, size_t room)
{
    trip_tf *tf = NULL;
    size_t count = 0;
    int status = trip_tf_load(&tf, path);
    if (status)
        return status;
    const trip_tf_point *points = trip_tf_points(tf, &count);
    if (count > 0)
        snprintf(line, room, "%zu points from %.7g to %.7g, %s", count, points[0].value,
                 points[count - 1].value,
                 trip_tf_is_normalised(tf) ? "in parts of the data's range"
                                           : "in the data's units");
    trip_tf_destroy(tf);
    return 0;
}

static int describe_path(const char *path, char *line, size_t room)
{
    trip_camera_path p = { 0 };
    int status = trip_camera_path_load(&p, path);
    if (status)
        return status;
    snprintf(line, room, "%zu key frame%s, %.7g seconds, %d frames", p.count,
             p.count == 1 ? "" : "s",
             p.keys[p.count - 1].seconds - p.keys[0].seconds + p.loop_seconds,
             trip_camera_path_frames(&p));
    trip_camera_path_release(&p);
    return 0;
}

static int describe_script(const char *path, char *line, size_t room)
{
    trip_script s = { 0 };
    int status = trip_script_load(&s, path);
    if (!status)
        snprintf(line, room, "%zu event%s", s.count, s.count == 1 ? "" : "s");
    trip_script_free(&s);
    return status;
}

static int describe(trip_other_kind kind, const char *path, char *line, size_t room)
{
    switch (kind) {
    case TRIP_OTHER_FUNCTION:
        return describe_function(path, line, room);
    case TRIP_OTHER_PATH:
        return describe_path(path, line, room);
    case TRIP_OTHER_SCRIPT:
        return describe_script(path, line, room);
    default:
        return 0;
    }
}

static const char *name_of(trip_other_kind kind)
{
    switch (kind) {
    case TRIP_OTHER_FUNCTION:
        return "transfer function";
    case TRIP_OTHER_PATH:
        return "camera path";
    case TRIP_OTHER_SCRIPT:
        return "script";
    case TRIP_OTHER_VIEW:
        return "stored view";
    default:
        return "report";
    }
}

static int print_json(trip_other_kind kind, const char *path, const char *line, const char *text)
{
    cJSON *root = cJSON_CreateObject();
    cJSON_AddStringToObject(root, "kind", name_of(kind));
    if (*line)
        cJSON_AddStringToObject(root, "contents", line);
    cJSON_AddStringToObject(root, "about", text);
    char *out = trip_json_print(root, true);
    cJSON_Delete(root);
    if (!out)
        return trip_fail(TRIP_ERROR, "info", path, "out of memory");
    puts(out);
    free(out);
    return 0;
}

int own_file_info(const char *path, bool json)
{
    char text[TRIP_OTHER_TEXT_BYTES], line[128] = "";
    const trip_other_kind kind = kind_of(path, text);
    int status = describe(kind, path, line, sizeof line);
    if (status)
        return status;
    if (json)
        return print_json(kind, path, line, text);
    trip_text_write(stdout, path);
    printf(" %s\n", text);
    if (*line)
        printf("%-12s %s\n", "contents", line);
    return 0;
}
