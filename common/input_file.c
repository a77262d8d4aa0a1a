#include "input_file.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdbool.h>
#include <unistd.h>

#include "report.h"

enum { WAIT_MS = 100 }; /* between checks for an interruption */

int trip_input_open(const char *path)
{
    return open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
}

/* Waits until there is data or the file ends. Returns false after an interruption. A pipe without a
 * writer is not at its end. */
static bool wait_for_data(int fd)
{
    while (!trip_interrupted()) {
        struct pollfd p = { .fd = fd, .events = POLLIN };
        if (poll(&p, 1, WAIT_MS) > 0)
            return true;
    }
    errno = EINTR;
    return false;
}

ssize_t trip_input_read(int fd, void *to, size_t bytes)
{
    size_t done = 0;
    while (done < bytes) {
        if (!wait_for_data(fd))
            return -1;
        ssize_t n = read(fd, (char *)to + done, bytes - done);
        if (n == 0)
            break;
        if (n < 0 && errno != EAGAIN && errno != EINTR)
            return -1;
        done += n > 0 ? (size_t)n : 0;
    }
    return (ssize_t)done;
}
