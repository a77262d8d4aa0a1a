#include "read_at.h"

#include <errno.h>
#include <unistd.h>

ssize_t trip_read_at(int fd, void *to, size_t bytes, size_t min, uint64_t offset)
{
    size_t done = 0;
    while (done < min) {
        ssize_t n = pread(fd, (char *)to + done, bytes - done, (off_t)(offset + done));
        if (n < 0 && errno == EINTR)
            continue;
        if (n < 0)
            return -1;
        if (n == 0)
            break;
        done += (size_t)n;
    }
    return (ssize_t)done;
}
