#include "accuracy_report.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <linux/fs.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "remove_files.h"
#include "report.h"

/* Returns whether a report has files with this name. */
static bool is_ours(const char *name)
{
    const char *extension = strrchr(name, '.');
    return !strcmp(name, "accuracy.json") || !strcmp(name, "accuracy.csv") ||
           !strcmp(name, "index.html") || (extension && !strcmp(extension, ".exr"));
}

/* Returns whether a folder is empty or contains only a report. */
static bool is_report(const char *path)
{
    DIR *folder = opendir(path);
    bool ours = folder != NULL, has_report = false, empty = true;
    for (struct dirent *e; ours && (e = readdir(folder));) {
        if (!strcmp(e->d_name, ".") || !strcmp(e->d_name, ".."))
            continue;
        empty = false;
        ours = is_ours(e->d_name);
        has_report |= !strcmp(e->d_name, "accuracy.json");
    }
    if (folder)
        closedir(folder);
    return ours && (has_report || empty);
}

static void remove_folder(const char *path)
{
    int folder = open(path, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
    if (folder >= 0) {
        trip_remove_files(folder, is_ours);
        close(folder);
        rmdir(path);
    }
}

int accuracy_folder_begin(accuracy_folder *f, const char *path, bool force)
{
    struct stat st;
    size_t length = strlen(path);
    *f = (accuracy_folder){ .path = path };
    while (length > 1 && path[length - 1] == '/')
        length--;
    if (snprintf(f->temporary, sizeof f->temporary, "%.*s.triptych-XXXXXX", (int)length, path) >=
        (int)sizeof f->temporary) {
        *f->temporary = 0;
        return trip_fail(TRIP_USAGE, "accuracy", path, "the name is too long");
    }
    bool there = lstat(path, &st) == 0;
    const char *fault = there && !force ? "exists already; --force replaces a report"
                        : there && !is_report(path)
                            ? "is not a report of this program; --force replaces only reports"
                            : NULL;
    if (fault || !mkdtemp(f->temporary)) {
        int status = fault ? trip_fail(TRIP_ERROR, "accuracy", path, "%s", fault)
                           : trip_fail_errno("accuracy", path, "cannot create a folder beside it");
        *f->temporary = 0;
        return status;
    }
    mode_t mask = umask(0);
    umask(mask);
    chmod(f->temporary, 0777 & ~mask);
    return 0;
}

int accuracy_folder_finish(accuracy_folder *f)
{
    bool swapped = false;
    if (syscall(SYS_renameat2, AT_FDCWD, f->temporary, AT_FDCWD, f->path, RENAME_NOREPLACE) != 0) {
        swapped = errno == EEXIST && syscall(SYS_renameat2, AT_FDCWD, f->temporary, AT_FDCWD,
                                             f->path, RENAME_EXCHANGE) == 0;
        if (!swapped && (errno != EINVAL || rename(f->temporary, f->path) != 0))
            return trip_fail_errno("accuracy", f->path, "cannot rename the folder made beside it");
    }
    if (swapped)
        remove_folder(f->temporary);
    *f->temporary = 0;
    return 0;
}

void accuracy_folder_abandon(accuracy_folder *f)
{
    if (*f->temporary)
        remove_folder(f->temporary);
    *f->temporary = 0;
}
