/* Draws a data set with libtriptych. Build it with
 * cc example.c $(pkg-config --cflags --libs triptych)
 *
 *     example DATA.trip FUNCTION PICTURE.png
 *
 * FUNCTION is a preset or a file; "" selects the transfer function of the data set. Drawing
 * proceeds in steps of 10 ms. Between steps the program can do other work; here it counts the
 * steps. */
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
#include <triptych.h>

enum { WIDTH = 320, HEIGHT = 240 };

static uint64_t in_10_ms(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (uint64_t)t.tv_sec * 1000000000u + (uint64_t)t.tv_nsec + 10000000u;
}

static int set_up(triptych *t, const char *data, const char *function)
{
    const double dark_blue[4] = { 0, 0, 0.25, 1 };
    int status = triptych_open(t, data, &(triptych_resources){ .memory_bytes = 256u << 20 });
    if (!status)
        status = triptych_set_transfer_function(
            t, &(triptych_transfer_function){ .name = *function ? function : NULL });
    if (!status)
        status = triptych_set_settings(t, &(triptych_settings){ .background = dark_blue });
    if (!status)
        status = triptych_set_view(t, &(triptych_view){ .width = WIDTH,
                                                        .height = HEIGHT,
                                                        .side = TRIPTYCH_SIDE_ISO,
                                                        .azimuth_degrees = 30 });
    return status;
}

static int draw(triptych *t, float *rgba)
{
    int steps = 0, status = triptych_begin(t);
    while (!status && (status = triptych_step(t, in_10_ms())) > 0) {
        steps++;
        if (status == TRIPTYCH_STEP_WAITS)
            triptych_await(t, 10000000);
        status = triptych_picture(t, rgba); /* unfinished; a program would show it here */
    }
    if (!status)
        status = triptych_picture(t, rgba);
    triptych_end(t);
    printf("%d steps\n", steps);
    return status;
}

int main(int argc, char **argv)
{
    triptych *t;
    float *rgba = malloc(sizeof(float) * 4 * WIDTH * HEIGHT);
    if (argc != 4 || !rgba || triptych_create(&t))
        return 2;
    int status = set_up(t, argv[1], argv[2]);
    if (!status)
        status = draw(t, rgba);
    if (!status)
        status = triptych_write(t, argv[3], WIDTH, HEIGHT, rgba);
    if (status)
        fprintf(stderr, "%s\n", triptych_error(t));
    triptych_destroy(t);
    free(rgba);
    return status ? 1 : 0;
}
