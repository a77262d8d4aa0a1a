#include "new_file.h"

#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

#include "report.h"

enum { TRIES = 100 };

/* Chooses a new random name beside `path`. Returns false if it is too long. */
static bool choose_name(trip_new_file *f)
{
    uint64_t number = 0;
    const char *slash = strrchr(f->path, '/');
    int folder = slash ? (int)(slash + 1 - f->path) : 0;
    if (getrandom(&number, sizeof number, 0) != sizeof number)
        number = (uint64_t)getpid();
    int length = snprintf(f->temporary, sizeof f->temporary, "%.*s.triptych-%016" PRIx64 ".tmp",
                          folder, f->path, number);
    return length < (int)sizeof f->temporary;
}

/* Copies the mode of a file that will be replaced. New files get their mode from the umask. */
static void keep_mode(const trip_new_file *f)
{
    struct stat old;
    if (lstat(f->path, &old) == 0 && S_ISREG(old.st_mode))
        (void)!fchmod(f->fd, old.st_mode & 0777);
}

/* Links into /proc, such as /dev/stdout, stand for open files. */
static bool leads_to_open_file(const char *path)
{
    static const char proc[] = "/proc/";
    char target[sizeof proc];
    const ssize_t length = readlink(path, target, sizeof target - 1);
    return length == sizeof proc - 1 && memcmp(target, proc, sizeof proc - 1) == 0;
}

static int refuse_special(const char *stage, const char *path)
{
    struct stat st;
    if (leads_to_open_file(path) ||
        (stat(path, &st) == 0 && !S_ISREG(st.st_mode) && !S_ISDIR(st.st_mode)))
        return trip_fail(TRIP_ERROR, stage, path,
                         "is a device, a pipe or a socket, which a file cannot replace");
    return 0;
}

int trip_new_file_begin(trip_new_file *f, const char *stage, const char *path)
{
    *f = (trip_new_file){ .stage = stage, .path = path, .fd = -1 };
    int status = refuse_special(stage, path);
    if (status)
        return status;
    errno = EEXIST;
    for (int i = 0; i < TRIES && f->fd < 0 && errno == EEXIST; i++) {
        if (!choose_name(f))
            return trip_fail(TRIP_ERROR, stage, path, "the name is too long");
        f->fd = open(f->temporary, O_RDWR | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666);
    }
    if (f->fd < 0)
        return trip_fail_errno(stage, path, "cannot create a file beside it");
    keep_mode(f);
    return 0;
}

int trip_new_file_check(const char *stage, const char *path)
{
    char folder[PATH_MAX];
    struct stat st;
    const char *slash = strrchr(path, '/');
    int length = slash ? snprintf(folder, sizeof folder, "%.*s", (int)(slash + 1 - path), path)
                       : snprintf(folder, sizeof folder, ".");
    if (length >= (int)sizeof folder)
        return trip_fail(TRIP_ERROR, stage, path, "the name is too long");
    if (stat(folder, &st) != 0 || access(folder, W_OK | X_OK) != 0)
        return trip_fail_errno(stage, path, "cannot create a file in its folder");
    if (stat(path, &st) == 0 && S_ISDIR(st.st_mode))
        return trip_fail(TRIP_ERROR, stage, path, "is a folder");
    return refuse_special(stage, path);
}

int trip_new_file_finish(trip_new_file *f)
{
    int closed = close(f->fd);
    f->fd = -1;
    if (closed == 0 && rename(f->temporary, f->path) == 0)
        return 0;
    int status = trip_fail_errno(f->stage, f->path, "cannot write");
    unlink(f->temporary);
    return status;
}

void trip_new_file_abandon(trip_new_file *f)
{
    if (f->fd < 0)
        return;
    close(f->fd);
    f->fd = -1;
    unlink(f->temporary);
}

static int write_text(const trip_new_file *f, const char *text)
{
    for (size_t left = strlen(text); left > 0;) {
        ssize_t written = write(f->fd, text, left);
        if (written < 0 && errno != EINTR)
            return trip_fail_errno(f->stage, f->path, NULL);
        text += written > 0 ? written : 0;
        left -= written > 0 ? (size_t)written : 0;
    }
    return fsync(f->fd) == 0 ? 0 : trip_fail_errno(f->stage, f->path, NULL);
}

int trip_new_file_of_text(const char *stage, const char *path, const char *text)
{
    trip_new_file file;
    int status = trip_new_file_begin(&file, stage, path);
    if (status)
        return status;
    status = write_text(&file, text);
    if (!status)
        return trip_new_file_finish(&file);
    trip_new_file_abandon(&file);
    return status;
}
