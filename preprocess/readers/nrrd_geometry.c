#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "nrrd_header.h"
#include "text.h"

/* A named space: the directions of the axes of world space. */
typedef struct space {
    const char *name;       /* without blanks and hyphens */
    const char *convention; /* as in anatomy.h, for a right-handed space */
    bool left_handed;
    bool has_time; /* vectors have a fourth component, time */
} space;

static const space spaces[] = {
    { "rightanteriorsuperior", "RAS", false, false },
    { "RAS", "RAS", false, false },
    { "leftposteriorsuperior", "LPS", false, false },
    { "LPS", "LPS", false, false },
    { "leftanteriorsuperior", "RAS", true, false },
    { "LAS", "RAS", true, false },
    { "scannerxyz", "", false, false },
    { "3Drighthanded", "", false, false },
    { "3Dlefthanded", "", true, false },
};

/* Finds the space that the header names. The spelling is free: any case, words apart or together,
 * and "time" or "t" may follow. The result has a NULL name if the header names no known space. */
static space find_space(const trip_nrrd_parser *p)
{
    char name[64] = "";
    size_t length = 0;
    const char *text = p->values[TRIP_NRRD_SPACE] ? p->values[TRIP_NRRD_SPACE] : "";
    for (; *text && length + 1 < sizeof name; text++)
        if (!strchr("- _", *text))
            name[length++] = *text;
    for (size_t i = 0; i < sizeof spaces / sizeof spaces[0] && !*text; i++) {
        space s = spaces[i];
        const char *rest = name + strlen(s.name);
        if (strncasecmp(name, s.name, strlen(s.name)) != 0)
            continue;
        s.has_time = strcasecmp(rest, "time") == 0 || strcasecmp(rest, "t") == 0;
        if (!*rest || s.has_time)
            return s;
    }
    if (p->values[TRIP_NRRD_SPACE])
        trip_nrrd_warn_unknown(p, p->lines[TRIP_NRRD_SPACE], "space", p->values[TRIP_NRRD_SPACE]);
    return (space){ 0 };
}

/* Parses a number of `length` bytes. Accepts "nan", which means unknown, and infinities. A later
 * check refuses a map with a value that is not finite, unless the user gives the spacing. */
static bool parse_number(const char *text, size_t length, double *v)
{
    static const struct {
        const char *name;
        double value;
    } others[] = { { "nan", NAN }, { "inf", INFINITY }, { "-inf", -INFINITY } };
    char word[64];
    if (length >= sizeof word)
        return false;
    memcpy(word, text, length);
    word[length] = '\0';
    for (size_t i = 0; i < sizeof others / sizeof others[0]; i++)
        if (strcasecmp(word, others[i].name) == 0) {
            *v = others[i].value;
            return true;
        }
    return trip_text_to_double(word, v);
}

static bool parse_word(char **text, double *v)
{
    const char *word = trip_nrrd_next_word(text);
    return parse_number(word, strlen(word), v);
}

/* Parses "(x,y,z)", or "(x,y,z,t)" if the space has time, into v. */
static bool parse_vector(char **text, const space *s, double v[4])
{
    char *at = *text + strspn(*text, " \t");
    v[3] = 0;
    for (int i = 0; i < (s->has_time ? 4 : 3); i++) {
        if (*at != "(,,,"[i])
            return false;
        at += 1 + strspn(at + 1, " \t");
        const size_t length = strcspn(at, " \t,)");
        if (!parse_number(at, length, &v[i]))
            return false;
        at += length + strspn(at + length, " \t");
    }
    if (*at != ')')
        return false;
    *text = at + 1;
    return true;
}

static int parse_directions(const trip_nrrd_parser *p, const space *s, trip_nrrd_header *h)
{
    char *text = p->values[TRIP_NRRD_DIRECTIONS];
    for (int axis = 0; axis < p->axes; axis++) {
        double v[4];
        text += strspn(text, " \t");
        bool none = strncasecmp(text, "none", 4) == 0;
        if (none)
            text += 4;
        else if (!parse_vector(&text, s, v))
            return trip_nrrd_fail(
                p, p->lines[TRIP_NRRD_DIRECTIONS],
                "\"space directions\" must be \"(x,y,z%s)\" or \"none\" for each of "
                "%d axes",
                s->has_time ? ",t" : "", p->axes);
        for (int a = 0; a < 3; a++) {
            if (axis == p->kept[a] && none)
                return trip_nrrd_fail(
                    p, p->lines[TRIP_NRRD_DIRECTIONS],
                    "axis %d has no direction in space: only scalar volumes can be "
                    "read",
                    axis);
            if (axis == p->kept[a] && v[3] != 0)
                return trip_nrrd_fail(
                    p, p->lines[TRIP_NRRD_DIRECTIONS],
                    "axis %d runs through time: only volumes of a single time can be read", axis);
            for (int row = 0; axis == p->kept[a] && row < 3; row++)
                h->index_to_world.m[row][a] = v[row];
        }
    }
    return 0;
}

/* Parses one number for each axis. An absent field gives NaN, which means unknown. */
static int parse_numbers(const trip_nrrd_parser *p, trip_nrrd_field f, const char *name,
                         double v[TRIP_NRRD_AXES_MAX])
{
    char *text = p->values[f];
    for (int axis = 0; axis < p->axes; axis++) {
        v[axis] = NAN;
        if (text && !parse_word(&text, &v[axis]))
            return trip_nrrd_fail(p, p->lines[f], "\"%s\" must be %d numbers", name, p->axes);
    }
    return 0;
}

/* Sets `node` for axes with samples at the ends of the axis. The default is samples in the middle
 * of cells. */
static void parse_centers(const trip_nrrd_parser *p, bool node[TRIP_NRRD_AXES_MAX])
{
    char *text = p->values[TRIP_NRRD_CENTERS];
    for (int axis = 0; axis < p->axes; axis++)
        node[axis] = text && strcasecmp(trip_nrrd_next_word(&text), "node") == 0;
}

/* Sets the map from the spacings, or from the extents if spacings are missing. */
static int parse_spacings(const trip_nrrd_parser *p, trip_nrrd_header *h)
{
    double spacing[TRIP_NRRD_AXES_MAX], min[TRIP_NRRD_AXES_MAX], max[TRIP_NRRD_AXES_MAX];
    bool node[TRIP_NRRD_AXES_MAX];
    int status;
    if ((status = parse_numbers(p, TRIP_NRRD_SPACINGS, "spacings", spacing)) < 0 ||
        (status = parse_numbers(p, TRIP_NRRD_MINS, "axis mins", min)) < 0 ||
        (status = parse_numbers(p, TRIP_NRRD_MAXS, "axis maxs", max)) < 0)
        return status;
    parse_centers(p, node);
    for (int a = 0; a < 3; a++) {
        int axis = p->kept[a];
        int64_t steps = h->dims[a] - node[axis];
        double step = spacing[axis];
        if (isnan(step))
            step = steps > 0 ? (max[axis] - min[axis]) / (double)steps : 1;
        if (isnan(step))
            step = 1;
        h->index_to_world.m[a][a] = step;
        h->index_to_world.m[a][3] = isnan(min[axis]) ? 0 : min[axis] + (node[axis] ? 0 : step / 2);
    }
    return 0;
}

/* Parses one coordinate for each sample of the axis. */
static int parse_coordinates(const trip_nrrd_parser *p, trip_nrrd_header *h, int a)
{
    const int axis = p->kept[a];
    char *text = p->coordinates[axis];
    /* Each number takes at least a digit and a blank. */
    if (text && (uint64_t)h->dims[a] <= strlen(text))
        h->coordinates[a] = calloc((size_t)h->dims[a], sizeof(double));
    for (int64_t i = 0; h->coordinates[a] && i < h->dims[a]; i++) {
        if (!parse_word(&text, &h->coordinates[a][i])) {
            free(h->coordinates[a]);
            h->coordinates[a] = NULL;
        }
    }
    if (p->coordinates[axis] && (!h->coordinates[a] || *trip_nrrd_trim(text)))
        return trip_nrrd_fail(p, p->coordinate_lines[axis],
                              "\"coordinates %d\" must be %lld numbers", axis,
                              (long long)h->dims[a]);
    return 0;
}

/* Makes world space right-handed: negates x of a left-handed space. */
static void set_space(trip_nrrd_header *h, const space *s)
{
    snprintf(h->space, sizeof h->space, "%s", s->name ? s->convention : "");
    for (int column = 0; column < 4 && s->left_handed; column++)
        h->index_to_world.m[0][column] = 0 - h->index_to_world.m[0][column];
    for (int64_t i = 0; h->coordinates[0] && s->left_handed && i < h->dims[0]; i++)
        h->coordinates[0][i] = 0 - h->coordinates[0][i];
}

int trip_nrrd_parse_geometry(const trip_nrrd_parser *p, trip_nrrd_header *h)
{
    double origin[4];
    char *text = p->values[TRIP_NRRD_ORIGIN];
    const space s = find_space(p);
    h->index_to_world = trip_affine_identity();
    h->segments = p->segments;
    h->oriented = s.name || p->values[TRIP_NRRD_DIRECTIONS];
    int status =
        p->values[TRIP_NRRD_DIRECTIONS] ? parse_directions(p, &s, h) : parse_spacings(p, h);
    if (status < 0)
        return status;
    if (text && (!parse_vector(&text, &s, origin) || *text))
        return trip_nrrd_fail(p, p->lines[TRIP_NRRD_ORIGIN],
                              "\"space origin\" must be \"(x,y,z%s)\"", s.has_time ? ",t" : "");
    for (int row = 0; row < 3 && p->values[TRIP_NRRD_ORIGIN]; row++)
        h->index_to_world.m[row][3] = origin[row];
    for (int a = 0; a < 3; a++)
        if ((status = parse_coordinates(p, h, a)) < 0)
            return status;
    set_space(h, &s);
    return 0;
}
