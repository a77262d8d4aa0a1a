#include "video.h"

#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include "new_file.h"
#include "report.h"
#include "start_program.h"
#include "text.h"

extern char **environ;

struct video {
    trip_new_file file;
    const char *path;
    pid_t encoder;
    int frames, errors; /* frames: socket to ffmpeg; errors: file with the messages of ffmpeg */
    size_t pixels;
    unsigned char *rgb;
};

/* Arguments of ffmpeg for each kind of file. */
static const struct format {
    const char *extension, *name, *codec, *quality;
} formats[] = {
    { ".mp4", "mp4", "libx264", "18" },
    { ".mov", "mov", "libx264", "18" },
    { ".mkv", "matroska", "libx264", "18" },
    { ".webm", "webm", "libvpx-vp9", "24" },
};

static const struct format *format_of(const char *path)
{
    const char *extension = strrchr(path, '.');
    for (size_t i = 0; extension && i < sizeof formats / sizeof *formats; i++)
        if (!strcasecmp(extension, formats[i].extension))
            return &formats[i];
    return NULL;
}

bool video_is_named(const char *path)
{
    return format_of(path) != NULL;
}

static bool is_installed(void)
{
    const char *folders = getenv("PATH");
    char path[4096];
    for (const char *p = folders; p && *p;) {
        int length = (int)strcspn(p, ":");
        int bytes = snprintf(path, sizeof path, "%.*s/ffmpeg", length, p);
        if (bytes < (int)sizeof path && access(path, X_OK) == 0)
            return true;
        p += length + (p[length] == ':');
    }
    return false;
}

int video_check(const char *path, int width, int height)
{
    if (width % 2 || height % 2)
        return trip_fail(TRIP_USAGE, "usage", "--size",
                         "%dx%d: width and height of a video must be even", width, height);
    if (!is_installed())
        return trip_fail(
            TRIP_ERROR, "write", path,
            "videos require ffmpeg, which is not installed; -o NAME.png writes numbered pictures");
    return 0;
}

static int spawn(video *v, int frames, char *const *arguments)
{
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, frames, 0);
    posix_spawn_file_actions_addopen(&actions, 1, "/dev/null", O_WRONLY, 0);
    posix_spawn_file_actions_adddup2(&actions, v->errors, 2);
    int fault = trip_start_program(&v->encoder, &actions, arguments);
    if (fault)
        v->encoder = 0;
    return fault
               ? trip_fail(TRIP_ERROR, "write", v->path, "cannot start ffmpeg: %s", strerror(fault))
               : 0;
}

static int start(video *v, int width, int height, double frames_per_second)
{
    const struct format *f = format_of(v->path);
    char size[32], rate[32], file[sizeof v->file.temporary + 8];
    int ends[2];
    snprintf(size, sizeof size, "%dx%d", width, height);
    snprintf(file, sizeof file, "file:%s", v->file.temporary); /* protects colons in the name */
    trip_text_from_double(frames_per_second, rate);
    const char *arguments[] = {
        "ffmpeg",      "-hide_banner", "-loglevel",
        "error",       "-y",           "-f",
        "rawvideo",    "-pix_fmt",     "rgb24",
        "-video_size", size,           "-framerate",
        rate,          "-i",           "pipe:0",
        "-an",         "-vf",          "scale=out_color_matrix=bt709:out_range=tv,format=yuv420p",
        "-colorspace", "bt709",        "-color_primaries",
        "bt709",       "-color_trc",   "bt709",
        "-c:v",        f->codec,       "-crf",
        f->quality,    "-b:v",         "0",
        "-f",          f->name,        file,
        NULL
    };
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends))
        return trip_fail_errno("write", v->path, "cannot start ffmpeg");
    v->frames = ends[0];
    char *copies[sizeof arguments / sizeof *arguments];
    memcpy(copies, arguments, sizeof copies);
    int status = spawn(v, ends[1], copies);
    close(ends[1]);
    return status;
}

int video_create(video **out, const char *path, int width, int height, double frames_per_second)
{
    video *v = calloc(1, sizeof *v);
    *out = NULL;
    if (!v)
        return trip_fail(TRIP_ERROR, "write", path, "out of memory");
    *v = (video){ .path = path, .frames = -1, .errors = -1, .file.fd = -1 };
    v->pixels = (size_t)width * (size_t)height;
    v->rgb = malloc(3 * v->pixels);
    v->errors = memfd_create("ffmpeg", MFD_CLOEXEC);
    int status = v->rgb && v->errors >= 0 ? trip_new_file_begin(&v->file, "write", path)
                                          : trip_fail(TRIP_ERROR, "write", path, "out of memory");
    if (!status)
        status = start(v, width, height, frames_per_second);
    if (status)
        video_abandon(v);
    else
        *out = v;
    return status;
}

/* Describes the end of ffmpeg by the last line of its messages, or by its signal. */
static void reason_of(const video *v, int how, char text[256])
{
    off_t end = lseek(v->errors, 0, SEEK_END);
    char tail[256] = "";
    ssize_t n = pread(v->errors, tail, sizeof tail - 1, end > 255 ? end - 255 : 0);
    for (; n > 0 && (tail[n - 1] == '\n' || tail[n - 1] == '\r'); n--)
        tail[n - 1] = 0;
    char *line = strrchr(tail, '\n');
    if (*tail)
        snprintf(text, 256, "%s", line ? line + 1 : tail);
    else if (WIFSIGNALED(how))
        snprintf(text, 256, "a signal ended it (%s)", strsignal(WTERMSIG(how)));
    else
        snprintf(text, 256, "it ended early, with status %d", WEXITSTATUS(how));
}

static void wait_for_end(video *v, int *how)
{
    *how = 0;
    while (v->encoder > 0 && waitpid(v->encoder, how, 0) < 0 && errno == EINTR)
        ;
    v->encoder = 0;
}

static int fail_of_encoder(video *v)
{
    char why[256];
    int how;
    close(v->frames);
    v->frames = -1;
    wait_for_end(v, &how);
    reason_of(v, how, why);
    return trip_fail(TRIP_ERROR, "write", v->path, "ffmpeg failed: %s", why);
}

/* Rounds to the nearest 8-bit value, clamped, as image files do. */
static unsigned char rounded(float x)
{
    return (unsigned char)floorf(fminf(fmaxf(x, 0), 1) * 255 + 0.5f);
}

int video_add(video *v, const float *rgba)
{
    for (size_t i = 0; i < v->pixels; i++)
        for (int c = 0; c < 3; c++)
            v->rgb[3 * i + (size_t)c] = rounded(rgba[4 * i + (size_t)c]);
    for (size_t done = 0; done < 3 * v->pixels;) {
        ssize_t n = send(v->frames, v->rgb + done, 3 * v->pixels - done, MSG_NOSIGNAL);
        if (trip_interrupted())
            return trip_fail(TRIP_INTERRUPTED, "write", v->path, "interrupted");
        if (n < 0 && errno != EINTR)
            return fail_of_encoder(v);
        done += n > 0 ? (size_t)n : 0;
    }
    return 0;
}

static void release(video *v)
{
    if (v->frames >= 0)
        close(v->frames);
    if (v->errors >= 0)
        close(v->errors);
    free(v->rgb);
    free(v);
}

int video_finish(video *v)
{
    int how, status = 0;
    char why[256];
    close(v->frames);
    v->frames = -1;
    wait_for_end(v, &how);
    reason_of(v, how, why);
    if (how)
        status = trip_fail(TRIP_ERROR, "write", v->path, "ffmpeg failed: %s", why);
    if (!status)
        status = trip_new_file_finish(&v->file);
    else
        trip_new_file_abandon(&v->file);
    release(v);
    return status;
}

void video_abandon(video *v)
{
    int how;
    if (!v)
        return;
    if (v->frames >= 0)
        close(v->frames);
    v->frames = -1;
    if (v->encoder > 0)
        kill(v->encoder, SIGTERM);
    wait_for_end(v, &how);
    trip_new_file_abandon(&v->file);
    release(v);
}
