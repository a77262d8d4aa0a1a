#include "anatomy.h"

#include <stdio.h>
#include <string.h>

#define DEGREES_PER_RADIAN 57.29577951308232

bool trip_anatomy_known(const char *space)
{
    return space && (strcmp(space, "LPS") == 0 || strcmp(space, "RAS") == 0);
}

static char opposite(char end)
{
    static const char pairs[] = "RLAPSI";
    const char *at = end ? strchr(pairs, end) : NULL;
    return at ? pairs[(at - pairs) ^ 1] : '\0';
}

bool trip_anatomy_axes_valid(const char *axes)
{
    unsigned pairs = 0;
    for (int a = 0; a < 3; a++) {
        if (!opposite(axes[a]))
            return false;
        pairs |= axes[a] == 'R' || axes[a] == 'L' ? 1 : axes[a] == 'A' || axes[a] == 'P' ? 2 : 4;
    }
    return pairs == 7 && axes[3] == '\0';
}

trip_vec3 trip_anatomy_direction(const char *space, char end)
{
    double v[3] = { 0, 0, 0 };
    for (int a = 0; a < 3 && trip_anatomy_known(space); a++)
        v[a] = space[a] == end ? 1 : space[a] == opposite(end) ? -1 : 0;
    return trip_v3(v[0], v[1], v[2]);
}

bool trip_anatomy_is_scan_from_above(const trip_affine *index_to_world)
{
    const double(*m)[4] = index_to_world->m;
    double min = INFINITY, max = 0;
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 4; j++)
            if (i != j && m[i][j] != 0)
                return false;
        min = fmin(min, m[i][i]);
        max = fmax(max, m[i][i]);
    }
    return min > 0 && max >= 1.5 * min;
}

const char *trip_anatomy_end_name(char end)
{
    switch (end) {
    case 'R':
        return "right";
    case 'L':
        return "left";
    case 'A':
        return "anterior";
    case 'P':
        return "posterior";
    case 'S':
        return "superior";
    case 'I':
        return "inferior";
    default:
        return "";
    }
}

const char *trip_anatomy_ends(const char *space, trip_vec3 v, char ends[4])
{
    double length = trip_length(v), max[3] = { 0, 0, 0 };
    int count = 0;
    ends[0] = '\0';
    if (!trip_anatomy_known(space) || !(length > 0 && isfinite(length)))
        return ends;
    for (int a = 0; a < 3; a++) {
        double part = trip_component(v, a) / length;
        if (fabs(part) < TRIP_ANATOMY_MIN)
            continue;
        int at = count++;
        for (; at > 0 && max[at - 1] < fabs(part); at--) {
            max[at] = max[at - 1];
            ends[at] = ends[at - 1];
        }
        max[at] = fabs(part);
        ends[at] = part > 0 ? space[a] : opposite(space[a]);
    }
    ends[count] = '\0';
    return ends;
}

const char *trip_anatomy_words(const char *space, trip_vec3 v, char words[TRIP_ANATOMY_WORDS])
{
    char ends[4];
    trip_anatomy_ends(space, v, ends);
    const char *first = trip_anatomy_end_name(ends[0]);
    if (!ends[0] || !ends[1]) {
        snprintf(words, TRIP_ANATOMY_WORDS, "%s", first);
        return words;
    }
    double along = trip_dot(trip_anatomy_direction(space, ends[0]), v) / trip_length(v);
    double degrees = acos(fmin(along, 1)) * DEGREES_PER_RADIAN;
    snprintf(words, TRIP_ANATOMY_WORDS, "%s, %.3g degrees to %s%s%s", first, degrees,
             trip_anatomy_end_name(ends[1]), ends[2] ? " and " : "",
             trip_anatomy_end_name(ends[2]));
    return words;
}
