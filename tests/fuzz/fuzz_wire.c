/* Fuzzes the answers of a helper. Accepted answers must give a volume or a picture of the declared
 * size.
 *
 * The lowest two bits of the first byte choose the request. Odd numbers request a picture, 2
 * requests netCDF-4 slices, and 0 other slices. */
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

/* Sends the whole answer at once, and nothing after it. The buffer of the connection holds it. */
static int answer_at_once(int fd)
{
    answer.fd = dup(fd);
    bool sent = answer.size == 0 ||
                send(answer.fd, answer.data, answer.size, MSG_NOSIGNAL) == (ssize_t)answer.size;
    shutdown(answer.fd, SHUT_WR);
    return sent ? 0 : EIO;
}

/* Refuses to start a helper. The kept connection to the last helper then fails and closes. */
static int refuse(int fd)
{
    (void)fd;
    return EIO;
}

/* Returns the path of a file with the signature of netCDF-4. */
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
        sum += rgba[i]; /* the whole picture must be readable */
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
