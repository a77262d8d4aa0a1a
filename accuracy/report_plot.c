#include "accuracy_report.h"

#include <stdlib.h>
#include <string.h>

#include "plot.h"

/* The first family with the prefix of a name colours it. The last ones have no names. */
static const struct {
    const char *prefix, *name, *colour;
} families[] = {
    { "quality", "quality", "#c21f3a" },
    { "gl", "gl", "#2a9d4e" },
    { "reference", "reference, integral", "#888888" },
    { "integral", "reference, integral", "#888888" },
    { "post", "post", "#1f6fc4" },
    { "", "pre", "#e07b1a" },
    { NULL, "another program, with its own light", "#7b3fa0" },
    { NULL, "front", "#222222" },
};
enum { FAMILIES = sizeof families / sizeof *families, PROGRAMS = FAMILIES - 2, FRONT };

static int family_of(const cJSON *row)
{
    const char *name = cJSON_GetObjectItem(row, "name")->valuestring;
    int i = cJSON_HasObjectItem(row, "options") ? 0 : PROGRAMS;
    while (families[i].prefix && strncmp(name, families[i].prefix, strlen(families[i].prefix)) != 0)
        i++;
    return strncmp(families[i].name, "reference", 9) ? i : 2;
}

static int by_x(const void *a, const void *b)
{
    const double x = ((const measure_point *)a)->x, y = ((const measure_point *)b)->x;
    return (x > y) - (x < y);
}

char *accuracy_report_plot(const cJSON *rows, const char *error, const char *title)
{
    const size_t room = (size_t)cJSON_GetArraySize(rows) + 1;
    measure_point *points = calloc(FAMILIES * room, sizeof *points);
    measure_series series[FAMILIES];
    const cJSON *row;
    if (!points)
        return NULL;
    for (int i = 0; i < FAMILIES; i++)
        series[i] = (measure_series){ .name = families[i].name,
                                      .colour = families[i].colour,
                                      .points = points + (size_t)i * room,
                                      .square = i == PROGRAMS,
                                      .steps = i == FRONT };
    cJSON_ArrayForEach(row, rows)
    {
        const int i = family_of(row);
        const bool front = accuracy_is_on_front(rows, row, error);
        measure_point p = { .x = measure_number(row, "ms"), .y = measure_number(row, error) };
        if (front)
            points[FRONT * room + (size_t)series[FRONT].count++] = p;
        p.label = cJSON_GetObjectItem(row, "name")->valuestring;
        p.rank = front || i == PROGRAMS ? 0 : i == 0 ? 1 : 2;
        p.large = front;
        points[(size_t)i * room + (size_t)series[i].count++] = p;
    }
    series[FRONT].joined = series[FRONT].count;
    qsort(points + FRONT * room, (size_t)series[FRONT].count, sizeof *points, by_x);
    char *svg = measure_plot_svg(&(measure_plot){ .width = 860,
                                                  .height = 480,
                                                  .x_title = "median ms per frame",
                                                  .y_title = title,
                                                  .y_min = 0.01,
                                                  .series = series,
                                                  .count = FAMILIES });
    free(points);
    return svg;
}
