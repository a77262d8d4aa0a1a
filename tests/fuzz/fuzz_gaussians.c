/* Fuzzes complete files of Gaussian scenes, in every format. All values that are read must be
 * finite, and a second pass must give as many Gaussians. The first byte chooses the file extension.
 */
#include "fuzz.h"

#include <math.h>
#include <stdio.h>
#include <unistd.h>

#include "gaussian_file.h"

static const char *const extensions[] = { "ply", "spz", "splat", "ksplat", "sog", "glb" };

static void check(const trip_gaussian *g)
{
    double length = 0;
    for (int a = 0; a < 3; a++)
        FUZZ_PROMISE(isfinite(g->centre[a]) && isfinite(g->deviations[a]) && g->deviations[a] >= 0);
    for (int i = 0; i < 4; i++)
        length += (double)g->rotation[i] * g->rotation[i];
    FUZZ_PROMISE(fabs(length - 1) < 1e-5);
    FUZZ_PROMISE(g->opacity >= 0 && g->opacity <= 1);
    for (int k = 0; k < TRIP_SH_MAX; k++)
        for (int c = 0; c < 3; c++)
            FUZZ_PROMISE(isfinite(g->sh[k][c]));
}

/* Reads up to a bound of Gaussians. Returns their number. */
static size_t read_through(trip_gaussian_file *f)
{
    enum { ROOM = 100, MOST = 20000 };
    trip_gaussian batch[ROOM];
    size_t got = 1, sum = 0;
    while (got > 0 && sum < MOST && trip_gaussian_file_read(f, batch, ROOM, &got) == 0) {
        for (size_t i = 0; i < got; i++)
            check(&batch[i]);
        sum += got;
    }
    return sum;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    char path[64];
    trip_gaussian_file *file;
    if (size < 1)
        return 0;
    snprintf(path, sizeof path, "/dev/shm/fuzz-%d.%s", (int)getpid(),
             extensions[data[0] % (sizeof extensions / sizeof *extensions)]);
    FILE *f = fopen(path, "wb");
    FUZZ_PROMISE(f && fwrite(data + 1, 1, size - 1, f) == size - 1 && fclose(f) == 0);
    if (trip_gaussian_file_open(path, &file) == 0) {
        const size_t count = read_through(file);
        FUZZ_PROMISE(count <= trip_gaussian_file_info(file)->count);
        if (trip_gaussian_file_rewind(file) == 0)
            FUZZ_PROMISE(read_through(file) == count);
        trip_gaussian_file_close(file);
    }
    unlink(path);
    return 0;
}
