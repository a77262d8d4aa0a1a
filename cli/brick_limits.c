#include "brick_limits.h"

#include <libgen.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "report.h"

/* The write measurement stops at this size; the time for more bytes is extrapolated. */
static const uint64_t max_written_bytes = (uint64_t)4 << 30;

static const char *const stage_names[TRIPTYCH_STAGES] = { "scan", "read", "merge", "levels",
                                                          "finish" };

double brick_seconds(const triptych_brick_summary *s)
{
    double seconds = 0;
    for (int i = 0; i < TRIPTYCH_STAGES; i++)
        seconds += s->stages[i].seconds;
    return seconds;
}

/* Returns whether `path` itself contains the voxel values. Folders, patterns and headers with a
 * separate data file do not. A compressed file may be smaller than its values, but not a thousand
 * times. */
static bool holds_values(const char *path, const triptych_brick_summary *s)
{
    struct stat st;
    return stat(path, &st) == 0 && S_ISREG(st.st_mode) &&
           (uint64_t)st.st_size >= s->input_bytes / 1000 + 1;
}

static int measure_write(plain_disk *d, const char *output, uint64_t bytes, void *memory)
{
    uint64_t part = bytes < max_written_bytes ? bytes : max_written_bytes;
    char *copy = strdup(output);
    int status = copy ? plain_disk_write(d, dirname(copy), part, memory)
                      : trip_fail(TRIP_ERROR, "brick", output, "out of memory");
    free(copy);
    if (status == 0 && d->bytes > 0)
        d->seconds *= (double)bytes / (double)d->bytes;
    d->bytes = bytes;
    return status;
}

int brick_limits_measure(brick_limits *l, const char *volume, const char *data_set,
                         const triptych_brick_summary *s)
{
    *l = (brick_limits){ 0 };
    void *memory = aligned_alloc(4096, PLAIN_DISK_MEMORY_BYTES);
    if (!memory)
        return trip_fail(TRIP_ERROR, "brick", volume, "out of memory");
    memset(memory, 1, PLAIN_DISK_MEMORY_BYTES);
    int status = holds_values(volume, s) ? plain_disk_read(&l->read, volume, memory) : 0;
    if (status == 0)
        status = measure_write(&l->write, data_set, s->bytes, memory);
    free(memory);
    return status;
}

/* Returns the time of bricking divided by the time of both plain transfers, or 0 without a plain
 * read. */
static double ratio(const brick_limits *l, const triptych_brick_summary *s)
{
    double limit = l->read.seconds + l->write.seconds;
    return l->read.bytes > 0 && limit > 0 ? brick_seconds(s) / limit : 0;
}

static void print_row(const char *name, double seconds, uint64_t read, uint64_t written)
{
    double rate = seconds > 0 ? (double)(read + written) / 1e6 / seconds : 0;
    printf("%-12s %9.3f %10.1f %10.1f %8.0f\n", name, seconds, (double)read / 1e6,
           (double)written / 1e6, rate);
}

void brick_limits_print(const brick_limits *l, const triptych_brick_summary *s)
{
    printf("\n%-12s %9s %10s %10s %8s\n", "stage", "seconds", "MB read", "MB written", "MB/s");
    for (int i = 0; i < TRIPTYCH_STAGES; i++)
        print_row(stage_names[i], s->stages[i].seconds, s->stages[i].bytes_read,
                  s->stages[i].bytes_written);
    print_row("together", brick_seconds(s), s->input_bytes, s->bytes);
    if (l->read.bytes > 0)
        print_row(l->read.direct ? "plain read" : "cached read", l->read.seconds, l->read.bytes, 0);
    print_row(l->write.direct ? "plain write" : "cached write", l->write.seconds, 0,
              l->write.bytes);
    if (ratio(l, s) > 0)
        printf("%.2f times the plain read plus the plain write\n", ratio(l, s));
    else
        printf("no plain read: the input is not a single file with the values\n");
}

static cJSON *row(const char *name, double seconds, uint64_t read, uint64_t written)
{
    cJSON *object = cJSON_CreateObject();
    cJSON_AddStringToObject(object, "stage", name);
    cJSON_AddNumberToObject(object, "seconds", seconds);
    cJSON_AddNumberToObject(object, "bytes_read", (double)read);
    cJSON_AddNumberToObject(object, "bytes_written", (double)written);
    return object;
}

cJSON *brick_limits_to_json(const brick_limits *l, const triptych_brick_summary *s)
{
    cJSON *root = cJSON_CreateObject(), *stages = cJSON_AddArrayToObject(root, "stages");
    for (int i = 0; i < TRIPTYCH_STAGES; i++)
        cJSON_AddItemToArray(stages, row(stage_names[i], s->stages[i].seconds,
                                         s->stages[i].bytes_read, s->stages[i].bytes_written));
    if (l->read.bytes > 0) {
        cJSON_AddItemToArray(stages, row("plain read", l->read.seconds, l->read.bytes, 0));
        cJSON_AddBoolToObject(root, "direct_read", l->read.direct);
        cJSON_AddNumberToObject(root, "ratio", ratio(l, s));
    }
    cJSON_AddItemToArray(stages, row("plain write", l->write.seconds, 0, l->write.bytes));
    cJSON_AddBoolToObject(root, "direct_write", l->write.direct);
    return root;
}
