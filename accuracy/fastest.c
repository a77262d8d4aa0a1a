#include "fastest.h"

#include <cjson/cJSON.h>
#include <errno.h>
#include <inttypes.h>
#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "input_file.h"
#include "json.h"
#include "command_line.h"
#include "report.h"

enum { MAX_BYTES = 16 << 20 };

char *accuracy_report_path(const char *data)
{
    size_t length = strlen(data);
    while (length > 1 && data[length - 1] == '/')
        length--;
    size_t end = length;
    while (end > 0 && data[end - 1] != '.' && data[end - 1] != '/')
        end--;
    if (end > 1 && data[end - 1] == '.' && data[end - 2] != '/')
        length = end - 1;
    char *path = malloc(length + sizeof ".accuracy");
    if (path)
        sprintf(path, "%.*s.accuracy", (int)length, data);
    return path;
}

void accuracy_checksum_text(uint64_t checksum, char text[ACCURACY_CHECKSUM_BYTES])
{
    snprintf(text, ACCURACY_CHECKSUM_BYTES, "%016" PRIx64, checksum);
}

/* ---- one row ---- */

static double number_of(const cJSON *object, const char *name)
{
    const cJSON *item = cJSON_GetObjectItemCaseSensitive(object, name);
    return cJSON_IsNumber(item) ? item->valuedouble : NAN;
}

static const char *text_of(const cJSON *object, const char *name)
{
    return cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(object, name));
}

static bool is_same(const char *a, const char *b)
{
    return a && b ? !strcmp(a, b) : a == b;
}

/* Returns false if the row is for another data set, has an unknown option, or lacks its error or
 * time. */
static bool read_row(const cJSON *row, const char *data_set, accuracy_found *out)
{
    const cJSON *options = cJSON_GetObjectItemCaseSensitive(row, "options"), *option;
    const char *name = text_of(row, "name");
    if (!name || !cJSON_IsObject(options) || !is_same(text_of(row, "data_set"), data_set))
        return false;
    snprintf(out->setting.name, sizeof out->setting.name, "%s", name);
    out->setting.renderer = TRIPTYCH_RENDERER_AUTO;
    cJSON_ArrayForEach(option, options)
    {
        const char *value = cJSON_GetStringValue(option);
        if (!value || !accuracy_setting_read_option(&out->setting, option->string, value))
            return false;
    }
    out->error = number_of(row, "error");
    out->ms = number_of(row, "ms");
    return out->error >= 0 && out->ms >= 0;
}

/* ---- the report ---- */

static void warn_of_differences(const cJSON *root, const char *path, const accuracy_wanted *w,
                                const draw_settings *s)
{
    const char *function = text_of(root, "transfer_function");
    if (!is_same(function, w->function))
        trip_warn(path, "was measured with %s%s, not with %s%s; errors and times differ",
                  function ? "--tf " : "the data set's own transfer function",
                  function ? function : "", w->function ? "--tf " : "the data set's own",
                  w->function ? w->function : "");
    if (cJSON_IsTrue(cJSON_GetObjectItemCaseSensitive(root, "shading")) != !s->light.no_shading)
        trip_warn(path, "was measured %s; errors and times differ",
                  s->light.no_shading ? "with light" : "without light");
}

int accuracy_check_data(const char *measured, const char *drawn, const char *path)
{
    return !strcmp(measured, drawn)
               ? 0
               : trip_fail(TRIP_ERROR, "--error", path,
                           "the report measured another data set, or an earlier version of this "
                           "one; run `triptych accuracy` again");
}

/* Older reports have no checksum, and may have measured any data set. */
static int check_data(const cJSON *root, const char *path, const accuracy_wanted *w)
{
    const char *checksum = text_of(root, "checksum");
    if (w->checksum && !checksum)
        trip_warn(path, "does not name its data set; run `triptych accuracy` again");
    return w->checksum && checksum ? accuracy_check_data(checksum, w->checksum, path) : 0;
}

static void read_levels(const cJSON *root, accuracy_found *out)
{
    const char *name = text_of(root, "levels_for");
    for (int i = 0; name && trip_levels_for_names[i]; i++)
        if (!strcmp(name, trip_levels_for_names[i])) {
            out->says_levels = true;
            out->levels_for = (triptych_levels_for)i;
        }
}

static int choose(const cJSON *root, const char *path, const accuracy_wanted *w,
                  accuracy_found *out)
{
    const cJSON *row;
    const draw_settings defaults = out->setting.settings;
    const char *data_set = text_of(root, "data_set");
    accuracy_found best = { .ms = INFINITY }, closest = { .error = INFINITY };
    cJSON_ArrayForEach(row, cJSON_GetObjectItemCaseSensitive(root, "rows"))
    {
        accuracy_found one = { .setting.settings = defaults };
        if (!read_row(row, data_set, &one) ||
            (w->renderers && !(w->renderers & 1u << one.setting.renderer)))
            continue;
        if (one.error <= w->error && one.ms < best.ms)
            best = one;
        if (one.error < closest.error)
            closest = one;
    }
    if (isinf(closest.error))
        return trip_fail(TRIP_ERROR, "--error", path,
                         "has no settings for this renderer; choose another --renderer");
    if (isinf(best.ms))
        return trip_fail(TRIP_ERROR, "--error", path,
                         "no setting has an error of at most %g; %s has the smallest, %.2f",
                         w->error, closest.setting.name, closest.error);
    warn_of_differences(root, path, w, &defaults);
    *out = best;
    const char *checksum = text_of(root, "checksum");
    snprintf(out->checksum, sizeof out->checksum, "%s", checksum ? checksum : "");
    read_levels(root, out);
    return 0;
}

int accuracy_fastest_in(const char *text, const char *path, const accuracy_wanted *wanted,
                        accuracy_found *out)
{
    trip_json json = { 0 };
    int status = trip_json_parse(&json, text, path, NULL);
    const double version = status ? NAN : number_of(json.root, "triptych_accuracy");
    if (!status && version != ACCURACY_VERSION)
        status = trip_fail(TRIP_ERROR, "--error", path,
                           version > 0 ? "comes from another version of Triptych; run `triptych "
                                         "accuracy` again"
                                       : "is not an accuracy.json of `triptych accuracy`");
    if (!status)
        status = check_data(json.root, path, wanted);
    if (!status)
        status = choose(json.root, path, wanted, out);
    trip_json_free(&json);
    return status;
}

static int read_text(const char *path, char *text)
{
    int fd = trip_input_open(path);
    ssize_t bytes = fd >= 0 ? trip_input_read(fd, text, MAX_BYTES + 1) : -1;
    int status = fd < 0 && errno == ENOENT
                     ? trip_fail(TRIP_ERROR, "--error", path,
                                 "does not exist; `triptych accuracy NAME.trip` makes this report")
                 : bytes < 0 ? trip_fail_errno("--error", path, "cannot read")
                 : bytes > MAX_BYTES
                     ? trip_fail(TRIP_ERROR, "--error", path,
                                 "is too large for a report; at most 16 MiB are possible")
                     : 0;
    if (fd >= 0)
        close(fd);
    if (!status)
        text[bytes] = 0;
    return status;
}

int accuracy_fastest(const char *path, const accuracy_wanted *wanted, accuracy_found *out)
{
    char file[PATH_MAX];
    struct stat st;
    bool is_file = stat(path, &st) == 0 && !S_ISDIR(st.st_mode);
    if (snprintf(file, sizeof file, "%s%s", path, is_file ? "" : "/accuracy.json") >=
        (int)sizeof file)
        return trip_fail(TRIP_USAGE, "--error", path, "the name is too long");
    char *text = malloc(MAX_BYTES + 1);
    if (!text)
        return trip_fail(TRIP_ERROR, "--error", path, "out of memory");
    int status = read_text(file, text);
    if (!status)
        status = accuracy_fastest_in(text, file, wanted, out);
    free(text);
    return status;
}
