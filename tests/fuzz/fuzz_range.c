/* Fuzzes the descriptions of range images. The first byte chooses the file that holds the other
 * bytes: transforms.json, a pose, or the intrinsics of a camera. The images exist, and stay unread.
 * All numbers of an accepted frame must be finite, except a centre that is not given. */
#include "fuzz.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "range_frames.h"

static const char *const names[] = { "transforms.json", "frame-000000.pose.txt",
                                     "camera-intrinsics.txt" };
static const char *const images[] = { "frame-000000.depth.png", "frame-000000.color.png" };
enum { NAMES = sizeof names / sizeof *names, IMAGES = sizeof images / sizeof *images };

static void write_file(const char *folder, const char *name, const uint8_t *bytes, size_t size)
{
    char path[128];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *f = fopen(path, "wb");
    FUZZ_PROMISE(f && (size == 0 || fwrite(bytes, 1, size, f) == size) && fclose(f) == 0);
}

static void remove_file(const char *folder, const char *name)
{
    char path[128];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    unlink(path);
}

static void check(const trip_range_frame *f)
{
    FUZZ_PROMISE(f->depth != NULL);
    for (int i = 0; i < 12; i++)
        FUZZ_PROMISE(isfinite(f->pose[i / 4][i % 4]));
    for (int i = 0; i < 2; i++)
        FUZZ_PROMISE(isfinite(f->focal[i]) && !isinf(f->centre[i]) && isfinite(f->size[i]));
    for (int i = 0; i < 4; i++)
        FUZZ_PROMISE(isfinite(f->distortion[i]));
    FUZZ_PROMISE(isfinite(f->scale) && isfinite(f->nearest) && isfinite(f->angle));
    FUZZ_PROMISE(isfinite(f->noise.a) && isfinite(f->noise.b) && isfinite(f->noise.c));
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static const uint8_t pose[] = "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n";
    char folder[64], json[96];
    trip_range_frames frames = { 0 };
    if (size < 1)
        return 0;
    const unsigned which = data[0] % NAMES;
    snprintf(folder, sizeof folder, "/dev/shm/fuzz-range-%d", (int)getpid());
    snprintf(json, sizeof json, "%s/%s", folder, names[0]);
    mkdir(folder, 0700);
    for (int i = 0; i < IMAGES; i++)
        write_file(folder, images[i], NULL, 0);
    if (which != 1)
        write_file(folder, names[1], pose, sizeof pose - 1);
    write_file(folder, names[which], data + 1, size - 1);
    if (trip_range_frames_find(&frames, which ? folder : json) == 0)
        for (uint32_t i = 0; i < frames.count; i++)
            check(&frames.frames[i]);
    trip_range_frames_free(&frames);
    for (int i = 0; i < IMAGES; i++)
        remove_file(folder, images[i]);
    for (int i = 0; i < NAMES; i++)
        remove_file(folder, names[i]);
    rmdir(folder);
    return 0;
}
