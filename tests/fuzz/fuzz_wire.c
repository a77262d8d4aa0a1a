/* A helper that answers anything: no crash, no hang and no leak, and what is accepted is a volume
 * or a picture of its own size. The first byte chooses the request: odd, a picture; else slices, of
 * netCDF-4 where it is 2 more than a multiple of 4. */
#include "fuzz.h"

#include "image_file.h"
#include "image_helper.h"
#include "volume.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <unistd.h>

enum { MEMORY_BYTES = 64 << 20, MAX_BYTES = 100000, PATIENCE_MS = 1 };

static struct {
    const uint8_t *data;
    size_t size;
    int fd;
} answer;

/* All of the answer at once, which the connection holds, and no more after it. */
static int answer_at_once(int fd)
{
    answer.fd = dup(fd);
    bool sent = answer.size == 0 ||
                send(answer.fd, answer.data, answer.size, MSG_NOSIGNAL) == (ssize_t)answer.size;
    shutdown(answer.fd, SHUT_WR);
    return sent ? 0 : EIO;
}

/* No further helper: what is kept of the last one fails, and is dropped. */
static int refuse(int fd)
{
    (void)fd;
    return EIO;
}

/* The name of a file that begins as one of netCDF-4. */
static const char *netcdf_file(void)
{
    static char path[64];
    if (!path[0]) {
        const int fd = memfd_create("netcdf", MFD_CLOEXEC);
        FUZZ_PROMISE(fd >= 0 && write(fd, "\x89HDF\r\n\x1a\n", 8) == 8);
        snprintf(path, sizeof path, "/proc/self/fd/%d", fd);
    }
    return path;
}

static void read_slices(const char *path)
{
    trip_budget *budget;
    trip_volume *v;
    trip_volume_portion b;
    FUZZ_PROMISE(trip_budget_create(&budget, MEMORY_BYTES) == 0);
    if (trip_volume_open(&v, path, NULL, budget) == 0) {
        const trip_volume_info *info = trip_volume_get_info(v);
        FUZZ_PROMISE(info->dims[0] >= 1 && info->dims[1] >= 1 && info->dims[2] >= 1);
        FUZZ_PROMISE(info->type >= 0 && info->type < TRIP_SCALARS);
        for (int i = 0; i < 4 && trip_volume_next(v, 1, &b) == 1; i++)
            trip_portion_release(v, &b);
        trip_volume_close(v);
    }
    FUZZ_PROMISE(trip_budget_left_bytes(budget) == MEMORY_BYTES);
    trip_budget_destroy(budget);
}

static void read_picture(trip_image_files *files)
{
    int width, height;
    float *rgba;
    volatile float sum = 0;
    if (trip_image_read(files, "some.png", &width, &height, &rgba) < 0)
        return;
    FUZZ_PROMISE(width >= 1 && height >= 1);
    for (size_t i = 0; i < (size_t)width * (size_t)height * 4; i++)
        sum += rgba[i]; /* all of it can be read */
    free(rgba);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (size < 1 || size > MAX_BYTES)
        return -1;
    trip_image_files files = { 0 };
    answer.data = data + 1;
    answer.size = size - 1;
    answer.fd = -1;
    trip_image_helper_replace(answer_at_once, PATIENCE_MS);
    if (data[0] % 2)
        read_picture(&files);
    else
        read_slices(data[0] & 2 ? netcdf_file() : "/");
    trip_image_helper_replace(refuse, PATIENCE_MS);
    FUZZ_PROMISE(trip_image_read(&files, "", &(int){ 0 }, &(int){ 0 }, &(float *){ NULL }) < 0);
    trip_image_close(&files);
    if (answer.fd >= 0)
        close(answer.fd);
    return 0;
}
