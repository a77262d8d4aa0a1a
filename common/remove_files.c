#include "remove_files.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdint.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include "scope.h"

enum { HELD_MAX = 64, LOOK_MS = 10 };

/* Files that stay open while their names are removed. */
typedef struct held {
    int files[HELD_MAX], count;
    int64_t bytes;
} held;

/* Holds a file open if it has no other name. */
static void hold(held *h, int folder, const char *name)
{
    struct stat st;
    if (h->count == HELD_MAX)
        return;
    int fd = openat(folder, name, O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
    if (fd < 0)
        return;
    if (fstat(fd, &st) < 0 || !S_ISREG(st.st_mode) || st.st_nlink != 1) {
        close(fd);
        return;
    }
    h->files[h->count++] = fd;
    h->bytes += (int64_t)st.st_blocks * 512;
}

static void let_go(const held *h)
{
    for (int i = 0; i < h->count; i++)
        close(h->files[i]);
}

/* Forks without pthread_atfork() handlers and without SIGCHLD, which are not meant for this
 * process. */
static pid_t fork_silently(void)
{
    return (pid_t)syscall(SYS_clone, 0, NULL, NULL, NULL, NULL);
}

static bool is_held(const held *h, int fd)
{
    for (int i = 0; i < h->count; i++)
        if (h->files[i] == fd)
            return true;
    return false;
}

/* Closes the other files. Otherwise this process's locks and pipes would not end when it closes
 * them. */
static void close_all_but(const held *h, int in, int out)
{
    int last = in > out ? in : out;
    for (int i = 0; i < h->count; i++)
        last = h->files[i] > last ? h->files[i] : last;
    for (int fd = 0; fd <= last; fd++)
        if (fd != in && fd != out && !is_held(h, fd))
            close(fd);
    closefrom(last + 1);
}

/* Runs in the new process. Writes a byte once only these files are open. When `names_gone` ends,
 * closes the files, which frees their space, and then ends `freed`. */
static void free_them(const held *h, int names_gone, int freed)
{
    char byte = 0;
    close_all_but(h, names_gone, freed);
    if (write(freed, &byte, 1) == 1 && read(names_gone, &byte, 1) == 0)
        let_go(h);
    _exit(0);
}

/* Detaches the process from this one, so that no caller finds it among its children. */
static bool start_freeing(const held *h, int names_gone, int freed)
{
    pid_t between = fork_silently();
    if (between == 0) {
        pid_t last = fork_silently();
        if (last == 0)
            free_them(h, names_gone, freed);
        _exit(last < 0);
    }
    int outcome = 1;
    while (between > 0 && waitpid(between, &outcome, __WALL) < 0 && errno == EINTR)
        ;
    return between > 0 && outcome == 0;
}

static void await_end(int fd)
{
    struct pollfd end = { .fd = fd };
    while (!trip_interrupted() && poll(&end, 1, LOOK_MS) <= 0)
        ;
}

static bool has_begun(int freed)
{
    char byte;
    ssize_t got;
    while ((got = read(freed, &byte, 1)) < 0 && errno == EINTR)
        ;
    return got == 1;
}

/* Starts a process that frees the held files after the first descriptor is closed. The second
 * descriptor ends when they are freed. Returns false if there is no such process; closing the files
 * then frees them. */
static bool free_apart(const held *h, int *names_gone, int *freed)
{
    int gone[2], done[2];
    if (h->bytes <= TRIP_REMOVE_APART_BYTES || pipe2(gone, O_CLOEXEC) < 0)
        return false;
    if (pipe2(done, O_CLOEXEC) < 0) {
        close(gone[0]);
        close(gone[1]);
        return false;
    }
    bool started = start_freeing(h, gone[0], done[1]);
    close(gone[0]);
    close(done[1]);
    *names_gone = gone[1];
    *freed = done[0];
    if (started && has_begun(done[0]))
        return true;
    close(gone[1]);
    close(done[0]);
    return false;
}

/* Calls `run` with the names in a folder that `ours` selects. */
static void for_files(int folder, bool (*ours)(const char *name), held *h,
                      void (*run)(held *h, int folder, const char *name))
{
    int copy = openat(folder, ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    DIR *dir = copy < 0 ? NULL : fdopendir(copy);
    for (struct dirent *e; dir && (e = readdir(dir));)
        if (ours(e->d_name))
            run(h, folder, e->d_name);
    if (dir)
        closedir(dir);
    else if (copy >= 0)
        close(copy);
}

static void remove_name(held *h, int folder, const char *name)
{
    (void)h;
    unlinkat(folder, name, 0);
}

void trip_remove_files(int folder, bool (*ours)(const char *name))
{
    held h = { .count = 0 };
    int names_gone, freed;
    for_files(folder, ours, &h, hold);
    bool apart = free_apart(&h, &names_gone, &freed);
    for_files(folder, ours, &h, remove_name);
    let_go(&h);
    if (!apart)
        return;
    close(names_gone);
    await_end(freed);
    close(freed);
}
