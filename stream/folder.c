#include "folder.h"

#include "dataset.h"
#include "report.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <libgen.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

static void remove_files(int fd)
{
    char name[32];
    for (int axis = 0; axis < 3; axis++)
        for (int plane = 0; plane < TRIP_PLANES; plane++)
            unlinkat(fd, trip_dataset_plane_name(axis, plane, name), 0);
    unlinkat(fd, TRIP_INDEX_NAME, 0);
    unlinkat(fd, TRIP_SPOOL_NAME, 0);
}

/* Removes a data set; a folder that holds anything else stays. */
static int remove_dataset(const char *path)
{
    int fd = open(path, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
    if (fd < 0)
        return -1;
    remove_files(fd);
    close(fd);
    return rmdir(path);
}

static bool is_empty(int fd)
{
    int copy = openat(fd, ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    DIR *dir = copy < 0 ? NULL : fdopendir(copy);
    bool empty = dir != NULL;
    for (struct dirent *e; empty && (e = readdir(dir));)
        empty = strcmp(e->d_name, ".") == 0 || strcmp(e->d_name, "..") == 0;
    if (dir)
        closedir(dir);
    else if (copy >= 0)
        close(copy);
    return empty;
}

static bool is_dataset(const char *path)
{
    char *index;
    struct stat st;
    if (asprintf(&index, "%s/" TRIP_INDEX_NAME, path) < 0)
        return false;
    bool found = lstat(index, &st) == 0 && S_ISREG(st.st_mode);
    free(index);
    return found;
}

static bool exists(const char *path)
{
    struct stat st;
    return lstat(path, &st) == 0;
}

/* A replacement that was cut off between its two renames is undone. */
static void restore_aside(const trip_folder *f)
{
    if (!exists(f->path) && is_dataset(f->aside))
        rename(f->aside, f->path);
}

static int check_target(const trip_folder *f)
{
    if (!exists(f->path))
        return TRIP_OK;
    if (!f->replace)
        return trip_fail(TRIP_ERROR, "write", f->path,
                         "exists already: remove it, or allow that it is replaced");
    if (!is_dataset(f->path))
        return trip_fail(TRIP_ERROR, "write", f->path,
                         "exists and is not a data set, so it is not replaced");
    return TRIP_OK;
}

static bool same_folder(int fd, const char *path)
{
    struct stat a, b;
    return fstat(fd, &a) == 0 && lstat(path, &b) == 0 && a.st_dev == b.st_dev &&
           a.st_ino == b.st_ino;
}

/* Opens and locks the partial folder. Another writer may rename it between the two: then the lock
 * is on its finished data set, and another folder has to be made. */
static int open_partial(trip_folder *f)
{
    do {
        if (f->fd >= 0)
            close(f->fd);
        if (mkdir(f->partial, 0777) < 0 && errno != EEXIST)
            return trip_fail_errno("write", f->partial, "cannot create");
        f->fd = open(f->partial, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
        if (f->fd < 0)
            return trip_fail_errno("write", f->partial, "cannot open");
        if (flock(f->fd, LOCK_EX | LOCK_NB) < 0 && errno == EWOULDBLOCK)
            return trip_fail(TRIP_ERROR, "write", f->partial, "another process is writing it");
    } while (!same_folder(f->fd, f->partial));
    remove_files(f->fd);
    if (!is_empty(f->fd))
        return trip_fail(TRIP_ERROR, "write", f->partial,
                         "holds files that are not a data set's: remove it");
    return TRIP_OK;
}

static bool is_link(const char *path)
{
    struct stat st;
    return lstat(path, &st) == 0 && S_ISLNK(st.st_mode);
}

/* The name without slashes at its end; where it is a link, what it leads to, so that the link stays
 * and that is replaced. */
static char *plain_path(const char *path)
{
    size_t length = strlen(path);
    while (length > 1 && path[length - 1] == '/')
        length--;
    char *plain = strndup(path, length);
    char *target = plain && is_link(plain) ? realpath(plain, NULL) : NULL;
    if (!target)
        return plain;
    free(plain);
    return target;
}

static int set_paths(trip_folder *f, const char *path)
{
    f->path = plain_path(path);
    if (!f->path || asprintf(&f->partial, "%s.partial", f->path) < 0)
        f->partial = NULL;
    if (!f->path || asprintf(&f->aside, "%s.replaced", f->path) < 0)
        f->aside = NULL;
    if (!f->path || !f->partial || !f->aside)
        return trip_fail(TRIP_ERROR, "write", path, "out of memory");
    if (!*f->path || strcmp(f->path, "/") == 0)
        return trip_fail(TRIP_ERROR, "write", path, "not a name for a data set");
    return TRIP_OK;
}

static void free_folder(trip_folder *f)
{
    if (f->fd >= 0)
        close(f->fd);
    free(f->path);
    free(f->partial);
    free(f->aside);
    *f = (trip_folder){ .fd = -1 };
}

int trip_folder_begin(trip_folder *f, const char *path, bool replace)
{
    *f = (trip_folder){ .fd = -1, .replace = replace };
    int status = set_paths(f, path);
    if (status == TRIP_OK) {
        restore_aside(f);
        status = check_target(f);
    }
    if (status == TRIP_OK)
        status = open_partial(f);
    if (status < 0)
        free_folder(f);
    return status;
}

static int sync_parent(const trip_folder *f)
{
    char *copy = strdup(f->path);
    int fd = copy ? open(dirname(copy), O_RDONLY | O_DIRECTORY | O_CLOEXEC) : -1;
    int status = fd < 0 ? -1 : fsync(fd);
    if (fd >= 0)
        close(fd);
    free(copy);
    /* Some file systems refuse to sync a folder and do so by themselves. */
    return status < 0 && errno != EINVAL && errno != EACCES
               ? trip_fail_errno("write", f->path, "cannot sync the folder it is in")
               : TRIP_OK;
}

static void remove_old(const trip_folder *f, const char *path)
{
    if (remove_dataset(path) < 0)
        trip_warn(path, "the replaced %s could not be removed: %s", f->path, strerror(errno));
}

static int replace_old(const trip_folder *f)
{
    if (renameat2(AT_FDCWD, f->partial, AT_FDCWD, f->path, RENAME_EXCHANGE) == 0) {
        remove_old(f, f->partial);
        return TRIP_OK;
    }
    if (errno != EINVAL && errno != ENOSYS)
        return trip_fail_errno("write", f->path, "cannot replace");
    if (rename(f->path, f->aside) < 0)
        return trip_fail_errno("write", f->path, "cannot rename");
    if (rename(f->partial, f->path) < 0) {
        trip_fail_errno("write", f->path, "cannot replace");
        restore_aside(f);
        return TRIP_ERROR;
    }
    remove_old(f, f->aside);
    return TRIP_OK;
}

/* The lock keeps other writers of this name out, so what exists() says holds. */
int trip_folder_commit(trip_folder *f)
{
    if (fsync(f->fd) < 0 && errno != EINVAL)
        return trip_fail_errno("write", f->partial, "cannot sync");
    int status = check_target(f);
    if (status == TRIP_OK && exists(f->path))
        status = replace_old(f);
    else if (status == TRIP_OK && rename(f->partial, f->path) < 0)
        status = trip_fail_errno("write", f->path, "cannot rename");
    return status == TRIP_OK ? sync_parent(f) : status;
}

void trip_folder_close(trip_folder *f)
{
    if (f->fd >= 0 && same_folder(f->fd, f->partial)) {
        remove_files(f->fd);
        rmdir(f->partial);
    }
    free_folder(f);
}
