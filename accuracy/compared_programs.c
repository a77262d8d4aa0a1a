#include "compared_programs.h"

#include <cjson/cJSON.h>
#include <errno.h>
#include <limits.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include "report.h"
#include "start_program.h"

extern char **environ;

static int fail(char why[256], const char *stage)
{
    snprintf(why, 256, "%s", stage);
    return trip_interrupted() ? trip_fail(TRIP_INTERRUPTED, "accuracy", "compare", "interrupted")
                              : TRIP_ERROR;
}

static int spawn(accuracy_program *b, const char *command, char why[256])
{
    int ends[2];
    char shell[] = "sh", run[] = "-c";
    char *copy = strdup(command), *const arguments[] = { shell, run, copy, NULL };
    if (!copy || socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends)) {
        free(copy);
        return fail(why, "cannot start the program");
    }
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, ends[1], 0);
    posix_spawn_file_actions_adddup2(&actions, ends[1], 1);
    pid_t process;
    int fault = trip_start_program(&process, &actions, arguments);
    close(ends[1]);
    free(copy);
    if (fault) {
        close(ends[0]);
        return fail(why, strerror(fault));
    }
    b->process = process;
    b->socket = ends[0];
    int reading = dup(ends[0]);
    b->answers = reading >= 0 ? fdopen(reading, "r") : NULL;
    return b->answers ? 0 : fail(why, "out of memory");
}

static int send_text(const accuracy_program *b, const char *text, char why[256])
{
    size_t left = strlen(text);
    while (left > 0) {
        ssize_t sent = send(b->socket, text, left, MSG_NOSIGNAL);
        if (sent < 0 && errno == EINTR && !trip_interrupted())
            continue;
        if (sent <= 0)
            return fail(why, "the program has ended");
        text += sent;
        left -= (size_t)sent;
    }
    return 0;
}

/* Sends a line of JSON and frees `stage`. */
static int send_json(const accuracy_program *b, cJSON *stage, char why[256])
{
    char *text = cJSON_PrintUnformatted(stage);
    cJSON_Delete(stage);
    int status = text ? send_text(b, text, why) : fail(why, "out of memory");
    if (!status)
        status = send_text(b, "\n", why);
    free(text);
    return status;
}

/* Reads the next line as a JSON object; the caller frees it. */
static int receive(accuracy_program *b, cJSON **out, char why[256])
{
    *out = NULL;
    if (getline(&b->line, &b->line_bytes, b->answers) < 0)
        return fail(why, "the program has ended without an answer");
    *out = cJSON_Parse(b->line);
    if (cJSON_IsObject(*out))
        return 0;
    cJSON_Delete(*out);
    *out = NULL;
    return fail(why, "the program's answer is not a line of JSON");
}

static void keep_text(const cJSON *object, const char *name,
                      char out[ACCURACY_COMPARED_PROGRAMS_TEXT])
{
    const char *text = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(object, name));
    int n = 0;
    for (; text && *text && n < ACCURACY_COMPARED_PROGRAMS_TEXT - 1; text++)
        if ((unsigned char)*text >= ' ' && *text != '"' && *text != '<' && *text != '&')
            out[n++] = *text;
    out[n] = 0;
}

static cJSON *describe(const accuracy_options *o, const triptych_info *info, const char *tf)
{
    cJSON *job = cJSON_CreateObject();
    const int dims[3] = { (int)info->dims[0], (int)info->dims[1], (int)info->dims[2] };
    char path[PATH_MAX];
    cJSON_AddStringToObject(job, "volume", realpath(o->source, path) ? path : o->source);
    cJSON_AddItemToObject(job, "dims", cJSON_CreateIntArray(dims, 3));
    cJSON *rows = cJSON_AddArrayToObject(job, "index_to_world");
    for (int i = 0; i < 3; i++)
        cJSON_AddItemToArray(rows, cJSON_CreateDoubleArray(info->index_to_world[i], 4));
    cJSON_AddStringToObject(job, "tf", tf);
    cJSON_AddBoolToObject(job, "shading", o->shading);
    cJSON_AddNumberToObject(job, "threads",
                            o->threads ? o->threads : (double)sysconf(_SC_NPROCESSORS_ONLN));
    return job;
}

static int introduce(accuracy_program *b, const accuracy_options *o, triptych *t, char why[256])
{
    triptych_info info;
    char *tf = NULL;
    cJSON *about = NULL;
    const triptych_conversion wanted = { .function = o->tf, .form = TRIPTYCH_FORM_TF };
    if (triptych_get_info(t, &info) || triptych_convert(t, &wanted, &tf))
        return fail(why, triptych_error(t));
    int status = send_json(b, describe(o, &info, tf), why);
    free(tf);
    if (!status)
        status = receive(b, &about, why);
    keep_text(about, "name", b->name);
    keep_text(about, "version", b->about);
    if (!status && !b->name[0])
        status = fail(why, "the program's answer has no \"name\"");
    cJSON_Delete(about);
    return status;
}

int accuracy_program_start(accuracy_program *b, const accuracy_options *o, triptych *t,
                           char why[256])
{
    *b = (accuracy_program){ .socket = -1, .command = b->command };
    if (!o->source)
        return fail(why, "requires --source, the volume to draw");
    int status = spawn(b, b->command, why);
    return status ? status : introduce(b, o, t, why);
}

static cJSON *job_of(const accuracy_view *view, const char *picture)
{
    const triptych_camera *c = &view->camera;
    const int size[2] = { c->width, c->height };
    cJSON *job = cJSON_CreateObject();
    cJSON_AddItemToObject(job, "eye", cJSON_CreateDoubleArray(c->eye, 3));
    cJSON_AddItemToObject(job, "look", cJSON_CreateDoubleArray(c->look, 3));
    cJSON_AddItemToObject(job, "up", cJSON_CreateDoubleArray(c->up, 3));
    if (c->ortho_height > 0)
        cJSON_AddNumberToObject(job, "ortho_height", c->ortho_height);
    else
        cJSON_AddNumberToObject(job, "fov_degrees", c->fov_degrees);
    cJSON_AddItemToObject(job, "size", cJSON_CreateIntArray(size, 2));
    if (picture)
        cJSON_AddStringToObject(job, "picture", picture);
    return job;
}

static int draw(accuracy_program *b, const accuracy_view *view, const char *picture, double *ms,
                char why[256])
{
    cJSON *answer = NULL, *written = NULL;
    int status = send_json(b, job_of(view, picture), why);
    if (!status)
        status = receive(b, &answer, why);
    const cJSON *time = cJSON_GetObjectItemCaseSensitive(answer, "ms");
    if (!status && !(cJSON_IsNumber(time) && time->valuedouble >= 0))
        status = fail(why, "the program's answer has no \"ms\"");
    if (!status)
        *ms = time->valuedouble;
    if (!status && picture)
        status = receive(b, &written, why);
    cJSON_Delete(answer);
    cJSON_Delete(written);
    return status;
}

int accuracy_program_draw(accuracy_program *b, const accuracy_view *view, double *ms, char why[256])
{
    return draw(b, view, NULL, ms, why);
}

static int read_picture(const char *path, size_t values, float *rgba, char why[256])
{
    FILE *f = fopen(path, "rb");
    unsigned char *bytes = malloc(values + 1);
    bool whole = f && bytes && fread(bytes, 1, values + 1, f) == values;
    for (size_t i = 0; i < values && whole; i++)
        rgba[i] = (float)bytes[i] / 255;
    if (f)
        fclose(f);
    free(bytes);
    unlink(path);
    return whole ? 0 : fail(why, "the program's picture has the wrong size");
}

int accuracy_program_picture(accuracy_program *b, const accuracy_view *view, const char *folder,
                             float *rgba, double *ms, char why[256])
{
    char whole[PATH_MAX], path[PATH_MAX + 16];
    if (!realpath(folder, whole))
        return fail(why, "the folder for its picture does not exist");
    snprintf(path, sizeof path, "%s/program.raw", whole);
    int status = draw(b, view, path, ms, why);
    const size_t pixels = (size_t)view->camera.width * (size_t)view->camera.height;
    return status ? status : read_picture(path, 4 * pixels, rgba, why);
}

void accuracy_program_end(accuracy_program *b)
{
    if (b->socket >= 0 && b->process)
        shutdown(b->socket, SHUT_WR);
    if (b->answers)
        fclose(b->answers);
    if (b->socket >= 0 && b->process) {
        close(b->socket);
        waitpid(b->process, NULL, 0);
    }
    free(b->line);
    *b = (accuracy_program){ .socket = -1 };
}
