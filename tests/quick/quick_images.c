/* Stands in for triptych-images in tests that draw hundreds of small pictures to read their pixels.
 * It loads no libraries, so that it starts in a hundredth of the time. It writes OpenEXR files of
 * float RGBA in uncompressed chunks. For any other request, triptych-images replaces this process,
 * before any byte of the request is taken from the connection. test_image_file and test_formats
 * test triptych-images itself. Refuses pictures with values that are not finite. */
#include <errno.h>
#include <limits.h>
#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/socket.h>
#include <unistd.h>

#include "image_file.h"
#include "image_helper.h"

enum { CONNECTION = TRIP_IMAGE_HELPER_FD, CHANNELS = 4, CHUNK_ROWS = 16, ZIP = 3 };

/* Ends the process, because the other end is gone or its request cannot be met. */
static void give_up(void)
{
    _exit(1);
}

static void receive(void *data, size_t bytes, int flags)
{
    for (size_t done = 0; done < bytes;) {
        ssize_t n = recv(CONNECTION, (char *)data + done, bytes - done, flags);
        if (n == 0 || (n < 0 && errno != EINTR))
            give_up();
        done += n > 0 ? (size_t)n : 0;
    }
}

/* Sets the offset at which the next MSG_PEEK begins. -1 ends peeking. */
static void set_look(int offset)
{
    if (setsockopt(CONNECTION, SOL_SOCKET, SO_PEEK_OFF, &offset, sizeof offset) != 0)
        give_up();
}

/* Peeks at the next request. Returns whether this process can answer it. */
static bool is_ours(void)
{
    char byte, path[PATH_MAX];
    trip_image_request r;
    set_look(0);
    receive(&byte, 1, MSG_PEEK);
    receive(&r, sizeof r, MSG_PEEK);
    if (r.path_bytes >= sizeof path)
        give_up();
    receive(path, r.path_bytes, MSG_PEEK);
    set_look(-1);
    path[r.path_bytes] = 0;
    const char *dot = strrchr(path, '.');
    bool exr = dot && strcasecmp(dot, ".exr") == 0;
    bool floats = r.numbers[2] == TRIP_IMAGE_DEPTH_DEFAULT || r.numbers[2] == TRIP_IMAGE_FLOAT;
    return r.task == TRIP_IMAGE_WRITE && exr && floats && r.numbers[3] == TRIP_IMAGE_FORM_RGBA;
}

/* Takes the file descriptor that comes with a request. */
static int take_descriptor(void)
{
    union {
        struct cmsghdr header;
        char bytes[CMSG_SPACE(sizeof(int))];
    } control;
    struct iovec one = { .iov_base = (char[]){ 0 }, .iov_len = 1 };
    struct msghdr message = {
        .msg_iov = &one, .msg_iovlen = 1, .msg_control = &control, .msg_controllen = sizeof control
    };
    int fd;
    if (recvmsg(CONNECTION, &message, MSG_CMSG_CLOEXEC) != 1 || !CMSG_FIRSTHDR(&message))
        give_up();
    memcpy(&fd, CMSG_DATA(CMSG_FIRSTHDR(&message)), sizeof fd);
    return fd;
}

/* The bytes of the file, in memory. */
typedef struct output {
    unsigned char *data;
    size_t bytes;
} output;

static void put(output *o, const void *data, size_t bytes)
{
    memcpy(o->data + o->bytes, data, bytes);
    o->bytes += bytes;
}

static void put_number(output *o, int32_t number)
{
    put(o, &number, sizeof number);
}

static void put_attribute(output *o, const char *name, const char *type, const void *value,
                          int32_t bytes)
{
    put(o, name, strlen(name) + 1);
    put(o, type, strlen(type) + 1);
    put_number(o, bytes);
    put(o, value, (size_t)bytes);
}

/* Puts the header of the file, up to the table of chunk offsets. */
static void put_head(output *o, int width, int height)
{
    unsigned char channels[CHANNELS * 18 + 1] = { 0 };
    const int32_t box[4] = { 0, 0, width - 1, height - 1 };
    const float one = 1, centre[2] = { 0, 0 };
    for (int c = 0; c < CHANNELS; c++) { /* name, float, linear, every pixel in both directions */
        const int32_t fields[4] = { 2, 0, 1, 1 };
        channels[18 * c] = (unsigned char)"ABGR"[c];
        memcpy(channels + 18 * c + 2, fields, sizeof fields);
    }
    put_number(o, 20000630);
    put_number(o, 2);
    put_attribute(o, "channels", "chlist", channels, sizeof channels);
    put_attribute(o, "compression", "compression", (char[]){ ZIP }, 1);
    put_attribute(o, "dataWindow", "box2i", box, sizeof box);
    put_attribute(o, "displayWindow", "box2i", box, sizeof box);
    put_attribute(o, "lineOrder", "lineOrder", (char[]){ 0 }, 1);
    put_attribute(o, "pixelAspectRatio", "float", &one, sizeof one);
    put_attribute(o, "screenWindowCenter", "v2f", centre, sizeof centre);
    put_attribute(o, "screenWindowWidth", "float", &one, sizeof one);
    put(o, "", 1);
}

/* Inverts the sRGB transfer function (IEC 61966-2-1). Negative numbers mirror positive ones. */
static float linear_of_display(float v)
{
    double x = fabs((double)v);
    return (float)copysign(x <= 0.04045 ? x / 12.92 : pow((x + 0.055) / 1.055, 2.4), (double)v);
}

/* Converts a row of premultiplied display values to channels of linear light, one after the other.
 */
static void put_row(output *o, int width, const float *rgba)
{
    for (int c = CHANNELS - 1; c >= 0; c--)
        for (int x = 0; x < width; x++) {
            const float *pixel = rgba + CHANNELS * x;
            float alpha = pixel[3] > 0 ? pixel[3] : 1;
            float value = c == 3 ? pixel[3] : linear_of_display(pixel[c] / alpha) * alpha;
            put(o, &value, sizeof value);
        }
}

/* Puts a chunk. Readers take a chunk of full length as uncompressed, for every compression. */
static void put_block(output *o, int y, int rows, int width, float *rgba)
{
    size_t row_bytes = (size_t)width * CHANNELS * sizeof *rgba;
    put_number(o, y);
    put_number(o, (int32_t)((size_t)rows * row_bytes));
    for (int i = 0; i < rows; i++) {
        receive(rgba, row_bytes, 0);
        for (int k = 0; k < CHANNELS * width; k++)
            if (!isfinite(rgba[k])) {
                fprintf(stderr, "quick: row %d of the picture holds %g\n", y + i, (double)rgba[k]);
                give_up();
            }
        put_row(o, width, rgba);
    }
}

static void write_all(int fd, const output *o)
{
    for (size_t done = 0; done < o->bytes;) {
        ssize_t n = write(fd, o->data + done, o->bytes - done);
        if (n < 0 && errno != EINTR)
            give_up();
        done += n > 0 ? (size_t)n : 0;
    }
}

static void write_picture(int fd, int width, int height)
{
    int chunks = (height + CHUNK_ROWS - 1) / CHUNK_ROWS;
    size_t row_bytes = (size_t)width * CHANNELS * sizeof(float);
    output o = { .data = malloc(1024 + 16 * (size_t)chunks + (size_t)height * row_bytes) };
    float *rgba = malloc(row_bytes);
    if (!o.data || !rgba)
        give_up();
    put_head(&o, width, height);
    for (int i = 0; i < chunks; i++) {
        uint64_t at = o.bytes + 8 * (size_t)(chunks - i) + (size_t)i * (8 + CHUNK_ROWS * row_bytes);
        put(&o, &at, sizeof at);
    }
    for (int y = 0; y < height; y += CHUNK_ROWS)
        put_block(&o, y, height - y < CHUNK_ROWS ? height - y : CHUNK_ROWS, width, rgba);
    write_all(fd, &o);
    free(rgba);
    free(o.data);
}

static void answer(void)
{
    trip_image_request r;
    const trip_image_reply done = { .outcome = TRIP_IMAGE_DONE };
    char path[PATH_MAX];
    int fd = take_descriptor();
    receive(&r, sizeof r, 0);
    receive(path, r.path_bytes, 0);
    write_picture(fd, (int)r.numbers[0], (int)r.numbers[1]);
    close(fd);
    if (send(CONNECTION, &done, sizeof done, MSG_NOSIGNAL) != sizeof done)
        give_up();
}

int main(void)
{
    while (is_ours())
        answer();
    execl(TEST_IMAGES, "triptych-images", (char *)NULL);
    return 1;
}
