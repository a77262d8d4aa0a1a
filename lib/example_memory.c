/* Makes a data set of a computed volume with libtriptych, and draws it. Build it with
 * cc example_memory.c $(pkg-config --cflags --libs triptych)
 *
 *     example_memory DATA.trip PICTURE.png [slices]
 *
 * Without `slices`, the whole volume lies in memory. With `slices`, the library asks for a few
 * slices at a time, so that the volume may be larger than memory. Both give the same picture. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <triptych_brick.h>

enum { SIZE = 96, WIDTH = 320, HEIGHT = 240 };

/* The tanglecube, a body with eight corners and holes between them: positive inside. */
static float value_at(int64_t i, int64_t j, int64_t k)
{
    const int64_t voxel[3] = { i, j, k };
    double sum = -11.8;
    for (int a = 0; a < 3; a++) {
        double x = ((double)voxel[a] - (SIZE - 1) / 2.0) / 16;
        sum -= x * x * (x * x - 5);
    }
    return (float)sum;
}

/* Fills slices `first` to first + count - 1 along z, x fastest. */
static int fill_slices(void *user, int64_t first, int64_t count, void *values)
{
    float *to = values;
    (void)user;
    for (int64_t k = first; k < first + count; k++)
        for (int64_t j = 0; j < SIZE; j++)
            for (int64_t i = 0; i < SIZE; i++)
                *to++ = value_at(i, j, k);
    return 0; /* any other number makes triptych_brick() fail */
}

static int brick(triptych *t, const char *data, const float *values)
{
    const triptych_volume volume = { .type = "float",
                                     .dims = { SIZE, SIZE, SIZE },
                                     .data = values, /* if NULL, fill_slices() is called instead */
                                     .read_slices = fill_slices };
    const triptych_range inside = { 0, 100 }; /* the values to keep */
    return triptych_brick(
        t, "tanglecube", data,
        &(triptych_brick_options){
            .in_memory = &volume, .ranges = &inside, .range_count = 1, .replace = 1 },
        NULL);
}

static int draw(triptych *t, const char *data, const char *picture, float *rgba)
{
    int status = triptych_open(t, data, NULL);
    if (!status)
        status = triptych_set_view(t, &(triptych_view){ .width = WIDTH, .height = HEIGHT });
    if (!status)
        status = triptych_draw(t, rgba);
    return status ? status : triptych_write(t, picture, WIDTH, HEIGHT, rgba);
}

int main(int argc, char **argv)
{
    triptych *t;
    float *rgba = malloc(sizeof(float) * 4 * WIDTH * HEIGHT);
    float *values = argc == 3 ? malloc(sizeof(float) * SIZE * SIZE * SIZE) : NULL;
    if (argc < 3 || !rgba || (argc == 3 && !values) || triptych_create(&t))
        return 2;
    if (values)
        fill_slices(NULL, 0, SIZE, values);
    int status = brick(t, argv[1], values);
    if (!status)
        status = draw(t, argv[1], argv[2], rgba);
    if (status)
        fprintf(stderr, "%s\n", triptych_error(t));
    triptych_destroy(t);
    free(values);
    free(rgba);
    return status ? 1 : 0;
}
