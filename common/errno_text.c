#include "errno_text.h"

#include <errno.h>
#include <string.h>

const char *trip_errno_text(int error, char *room, size_t bytes)
{
    if (error == EFBIG)
        return "the file would be larger than the limit on file sizes (ulimit -f) or the file "
               "system allows";
    if (error == EMFILE)
        return "too many open files; raise the limit (ulimit -n)";
    return strerror_r(error, room, bytes);
}
