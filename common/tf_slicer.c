/* Reads volume properties of 3D Slicer as text (.vp). They have nine lines; the seventh holds the
 * opacities and the ninth the colours. */
#include "tf_curves.h"

#include "report.h"
#include "text.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { LINES = 9, OPACITY_LINE = 6, GRADIENT_LINE = 7, COLOUR_LINE = 8 };

void trip_tf_warn_of_gradient(const trip_tf_nodes *gradient, const char *where)
{
    for (size_t i = 0; i < gradient->count; i++) {
        if (gradient->data[i].part[0] == 1)
            continue;
        trip_warn(where, "opacity by gradient is ignored; parts that it hides are visible");
        return;
    }
}

/* Splits the text into lines in place. Returns the number of lines, at most LINES. */
static int split(char *text, char *lines[LINES])
{
    int count = 0;
    for (char *next = text; next && count < LINES;) {
        lines[count++] = next;
        next = strchr(next, '\n');
        if (next)
            *next++ = 0;
    }
    return count;
}

static int read_lines(trip_tf_curves *c, char *const lines[LINES], const char *name)
{
    trip_tf_nodes gradient = { 0 };
    int status =
        trip_tf_nodes_add_text(&c->opacities, lines[OPACITY_LINE], 2, name, "opacities (line 7)");
    if (!status && strspn(lines[GRADIENT_LINE], " \t\r") < strlen(lines[GRADIENT_LINE]))
        status = trip_tf_nodes_add_text(&gradient, lines[GRADIENT_LINE], 2, name,
                                        "gradient opacities (line 8)");
    if (!status)
        status =
            trip_tf_nodes_add_text(&c->colours, lines[COLOUR_LINE], 4, name, "colours (line 9)");
    if (!status)
        trip_tf_warn_of_gradient(&gradient, name);
    free(gradient.data);
    return status;
}

int trip_tf_parse_vp(trip_tf **out, const char *name, const char *text, size_t bytes)
{
    trip_tf_curves curves = { .space = TRIP_COLOUR_RGB };
    char *lines[LINES], *copy = strndup(text, bytes); /* up to a zero byte */
    int status;
    *out = NULL;
    if (!copy)
        return trip_fail(TRIP_ERROR, TRIP_TF_STAGE, name, "out of memory");
    if (strlen(copy) < bytes)
        status = trip_fail(TRIP_ERROR, TRIP_TF_STAGE, name, "a zero byte; this is not a text file");
    else if (split(copy, lines) < LINES)
        status = trip_fail(TRIP_ERROR, TRIP_TF_STAGE, name,
                           "fewer than %d lines; a volume property has exactly that many", LINES);
    else
        status = read_lines(&curves, lines, name);
    if (!status)
        status = trip_tf_curves_build(out, &curves, name);
    trip_tf_curves_free(&curves);
    free(copy);
    return status;
}
