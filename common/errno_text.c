#include "errno_text.h"

#include <errno.h>
#include <string.h>

const char *trip_errno_text(int error, char *room, size_t bytes)
{
    if (error == EFBIG)
        return "larger than files may be here: see the limit on file sizes (ulimit -f) and the "
               "file system's own";
    if (error == EMFILE)
        return "too many open files: see the limit on them (ulimit -n)";
    return strerror_r(error, room, bytes);
}
