#include "piped_tf.h"

#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include "report.h"
#include "transfer_function.h"

static bool is_pipe(const char *name)
{
    struct stat st;
    return name && stat(name, &st) == 0 && (S_ISFIFO(st.st_mode) || S_ISSOCK(st.st_mode));
}

static int write_copy(piped_tf *p, const char *name, const char *text)
{
    size_t bytes = strlen(text), done = 0;
    p->fd = memfd_create("transfer function", MFD_CLOEXEC);
    ssize_t n = p->fd < 0 ? -1 : 0;
    while (n >= 0 && done < bytes)
        done += (size_t)((n = write(p->fd, text + done, bytes - done)) > 0 ? n : 0);
    if (p->fd >= 0)
        snprintf(p->path, sizeof p->path, "/proc/self/fd/%d", p->fd);
    return n < 0 ? trip_fail_errno("transfer function", name, "cannot keep a copy") : 0;
}

int piped_tf_keep(piped_tf *p, triptych *t, const char **name)
{
    char *text = NULL;
    if (!is_pipe(*name))
        return 0;
    int status = triptych_convert(t, &(triptych_conversion){ .function = *name }, &text);
    if (status == 0)
        status = write_copy(p, *name, text);
    if (status == 0)
        *name = p->path;
    free(text);
    return status;
}

void piped_tf_release(piped_tf *p)
{
    if (p->path[0])
        close(p->fd);
}
