#include "folder.h"

#include "dataset.h"
#include "remove_files.h"
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

static bool is_own_file(const char *name)
{
    return !strcmp(name, TRIP_INDEX_NAME) || trip_plane_file_is_named(name) ||
           !strncmp(name, TRIP_SPOOL_PREFIX, strlen(TRIP_SPOOL_PREFIX));
}

/* Removes a data set. A folder with other files stays. */
static int remove_dataset(const char *path)
{
    int fd = open(path, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
    if (fd < 0)
        return -1;
    trip_remove_files(fd, is_own_file);
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

static bool is_dataset_file(const char *name)
{
    return strcmp(name, TRIP_INDEX_NAME) == 0 || strcmp(name, ".") == 0 ||
           strcmp(name, "..") == 0 || trip_plane_file_is_named(name);
}

/* Fails if the folder holds other files, which could be neither kept nor removed. */
static int check_all_known(const char *path)
{
    DIR *dir = opendir(path);
    int status = dir ? TRIP_OK : trip_fail_errno("write", path, "cannot list the folder");
    for (struct dirent *e; status == TRIP_OK && (e = readdir(dir));)
        if (!is_dataset_file(e->d_name))
            status = trip_fail(TRIP_ERROR, "write", path,
                               "contains %s, which does not belong to a data set, so it is not "
                               "replaced; move that file elsewhere",
                               e->d_name);
    if (dir)
        closedir(dir);
    return status;
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

/* Undoes a replacement that was interrupted between its two renames. Completes a replacement that
 * was interrupted after them, since the old data set would obstruct the next. Requires the lock. */
static void restore_aside(const trip_folder *f)
{
    if (!is_dataset(f->aside))
        return;
    if (!exists(f->path))
        rename(f->aside, f->path);
    else if (is_dataset(f->path))
        remove_dataset(f->aside);
}

static int check_target(const trip_folder *f)
{
    if (!exists(f->path))
        return TRIP_OK;
    if (!f->replace)
        return trip_fail(TRIP_ERROR, "write", f->path,
                         "exists already; use --force to replace it or -o for another name");
    if (!is_dataset(f->path))
        return trip_fail(
            TRIP_ERROR, "write", f->path,
            "exists and is not a data set, so it is not replaced; use -o for another name");
    return check_all_known(f->path);
}

static int check_own(int fd, const char *path, const char *stage)
{
    struct stat st;
    if (fstat(fd, &st) < 0)
        return trip_fail_errno(stage, path, "cannot open");
    if (st.st_uid != geteuid())
        return trip_fail(TRIP_ERROR, stage, path,
                         "belongs to another user; remove it or write elsewhere");
    return TRIP_OK;
}

/* A folder just created is not checked, since some file servers assign it to another user. */
int trip_folder_open_own(int *fd, const char *path, mode_t mode, const char *stage,
                         const char *busy)
{
    bool made = mkdir(path, mode) == 0;
    if (!made && errno != EEXIST)
        return trip_fail_errno(stage, path, "cannot create");
    *fd = open(path, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
    if (*fd < 0)
        return trip_fail_errno(stage, path, "cannot open");
    int status = made ? TRIP_OK : check_own(*fd, path, stage);
    if (status == TRIP_OK && flock(*fd, LOCK_EX | LOCK_NB) < 0 && errno == EWOULDBLOCK)
        status = trip_fail(TRIP_ERROR, stage, path, "%s", busy);
    if (status < 0) {
        close(*fd);
        *fd = -1;
    }
    return status;
}

static int check_file(int fd, const char *where, const char *stage)
{
    struct stat st;
    int status = check_own(fd, where, stage);
    if (status == TRIP_OK && (fstat(fd, &st) < 0 || !S_ISREG(st.st_mode) || st.st_nlink != 1))
        status = trip_fail(TRIP_ERROR, stage, where, "is not a file of this program; remove it");
    return status;
}

int trip_folder_open_file(int *fd, int folder, const char *path, const char *name, int flags,
                          const char *stage)
{
    char where[4096];
    snprintf(where, sizeof where, "%s/%s", path, name);
    flags |= O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC;
    *fd = flags & O_CREAT ? openat(folder, name, flags | O_EXCL, 0666) : -1;
    if (*fd >= 0)
        return TRIP_OK;
    *fd = openat(folder, name, flags & ~O_CREAT);
    if (*fd < 0 && errno == ENOENT && !(flags & O_CREAT))
        return TRIP_OK;
    if (*fd < 0 && errno == ELOOP)
        return trip_fail(TRIP_ERROR, stage, where, "is a link, which is not followed; remove it");
    if (*fd < 0)
        return trip_fail_errno(stage, where, "cannot open");
    int status = check_file(*fd, where, stage);
    if (status < 0) {
        close(*fd);
        *fd = -1;
    }
    return status;
}

static bool same_folder(int fd, const char *path)
{
    struct stat a, b;
    return fstat(fd, &a) == 0 && lstat(path, &b) == 0 && a.st_dev == b.st_dev &&
           a.st_ino == b.st_ino;
}

/* Opens and locks the partial folder. Another writer may rename it in between. The lock then
 * belongs to the other writer's finished data set. A new folder must be created. */
static int open_partial(trip_folder *f)
{
    do {
        if (f->fd >= 0)
            close(f->fd);
        int status = trip_folder_open_own(&f->fd, f->partial, 0777, "write",
                                          "another process is writing it");
        if (status < 0)
            return status;
    } while (!same_folder(f->fd, f->partial));
    trip_remove_files(f->fd, is_own_file);
    if (!is_empty(f->fd))
        return trip_fail(TRIP_ERROR, "write", f->partial,
                         "contains files that do not belong to a data set; remove it");
    return TRIP_OK;
}

static bool is_link(const char *path)
{
    struct stat st;
    return lstat(path, &st) == 0 && S_ISLNK(st.st_mode);
}

/* Returns the path without slashes at its end. A link is resolved, so that its target is replaced
 * and the link stays. */
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
        return trip_fail(TRIP_ERROR, "write", path, "is not a valid name for a data set");
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

static int check_parent(const trip_folder *f)
{
    struct stat st;
    char *copy = strdup(f->path);
    const char *parent = copy ? dirname(copy) : "";
    int status = TRIP_OK;
    if (copy && stat(parent, &st) < 0 && errno == ENOENT)
        status = trip_fail(TRIP_ERROR, "write", f->path,
                           "the folder %s does not exist: No such file or directory", parent);
    free(copy);
    return status;
}

int trip_folder_check(const char *path, bool replace)
{
    trip_folder f = { .fd = -1, .replace = replace };
    int status = set_paths(&f, path);
    if (status == TRIP_OK)
        status = check_parent(&f);
    if (status == TRIP_OK)
        status = check_target(&f);
    free_folder(&f);
    return status;
}

int trip_folder_begin(trip_folder *f, const char *path, bool replace)
{
    *f = (trip_folder){ .fd = -1, .replace = replace };
    int status = set_paths(f, path);
    if (status == TRIP_OK)
        status = check_target(f);
    if (status == TRIP_OK)
        status = open_partial(f);
    if (status == TRIP_OK) {
        restore_aside(f);
        status = check_target(f);
    }
    if (status < 0)
        trip_folder_close(f);
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
    /* Some file systems refuse to sync a folder, and sync it on their own. */
    return status < 0 && errno != EINVAL && errno != EACCES
               ? trip_fail_errno("write", f->path, "cannot sync its parent folder")
               : TRIP_OK;
}

static void remove_old(const trip_folder *f, const char *path)
{
    char reason[256];
    if (remove_dataset(path) < 0 && errno != ENOENT)
        trip_warn(path, "the replaced %s could not be removed: %s", f->path,
                  trip_errno_text(errno, reason, sizeof reason));
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
        return trip_fail_errno("write", f->aside, "cannot move the old data set there");
    if (rename(f->partial, f->path) < 0) {
        trip_fail_errno("write", f->path, "cannot replace");
        restore_aside(f);
        return TRIP_ERROR;
    }
    remove_old(f, f->aside);
    return TRIP_OK;
}

/* The lock keeps other writers of this name out, so the result of exists() stays valid. */
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
        trip_remove_files(f->fd, is_own_file);
        rmdir(f->partial);
    }
    free_folder(f);
}
