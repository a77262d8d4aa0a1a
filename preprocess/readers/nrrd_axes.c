#include <stdio.h>
#include <string.h>
#include <strings.h>

#include "nrrd_header.h"

/* How little an axis fits as an axis of the volume. */
typedef enum rank {
    SPATIAL, /* or of a kind that says nothing */
    ORDERED, /* a list or times; the entries can be slices */
    WITHIN,  /* components of a vector, a colour or the like */
} rank;

/* An axis during the choice. */
typedef struct axis {
    rank rank;
    const char *kind; /* "" if unknown */
    bool dropped;
} axis;

static rank rank_of_kind(const char *kind)
{
    static const char *const spatial[] = { "domain", "space", "scalar", "stub", "none", "???", "" };
    for (size_t i = 0; i < sizeof spatial / sizeof spatial[0]; i++)
        if (strcasecmp(kind, spatial[i]) == 0)
            return SPATIAL;
    return strcasecmp(kind, "time") == 0 || strcasecmp(kind, "list") == 0 ? ORDERED : WITHIN;
}

/* Copies the words of a field, so that the parser of the field can read them again. */
static char *copy_words(const trip_nrrd_parser *p, trip_nrrd_field f, char *room, size_t bytes)
{
    snprintf(room, bytes, "%s", p->values[f] ? p->values[f] : "");
    return room;
}

/* Marks axes without a direction or a spacing. An axis of the volume may lack a spacing, so it
 * counts only if exactly three axes have one. */
static void mark_axes_outside_space(const trip_nrrd_parser *p, axis axes[TRIP_NRRD_AXES_MAX])
{
    char room[4096];
    bool outside[TRIP_NRRD_AXES_MAX] = { false };
    const bool directions = p->values[TRIP_NRRD_DIRECTIONS] != NULL;
    char *text =
        copy_words(p, directions ? TRIP_NRRD_DIRECTIONS : TRIP_NRRD_SPACINGS, room, sizeof room);
    int inside = 0;
    for (int a = 0; a < p->axes && *text; a++) {
        text += strspn(text, " \t");
        outside[a] = strncasecmp(text, directions ? "none" : "nan", directions ? 4 : 3) == 0;
        inside += !outside[a] && *text;
        text += *text == '(' ? strcspn(text, ")") : strcspn(text, " \t");
        text += *text == ')';
    }
    for (int a = 0; a < p->axes && (directions || inside == 3); a++)
        if (outside[a] && axes[a].rank == SPATIAL)
            axes[a].rank = WITHIN;
}

/* Returns the axis that fits least, or -1. Components go first, then lists and times, then axes of
 * one sample, the slowest first in each case. Then the slowest axis goes. */
static int worst_axis(const trip_nrrd_header *h, const axis axes[TRIP_NRRD_AXES_MAX])
{
    int worst = -1, most = -1;
    for (int a = 0; a < h->axes; a++) {
        const int badness = 2 * (int)axes[a].rank + (h->sizes[a] == 1);
        if (!axes[a].dropped && badness >= most) {
            worst = a;
            most = badness;
        }
    }
    return worst;
}

/* Gives the dropped axes with several entries to --channel and --time. */
static int give_to_options(const trip_nrrd_parser *p, trip_nrrd_header *h,
                           const axis axes[TRIP_NRRD_AXES_MAX])
{
    h->channel_axis = h->time_axis = -1;
    for (int a = 0; a < h->axes; a++) {
        if (!axes[a].dropped || h->sizes[a] == 1)
            continue;
        const bool time = strcasecmp(axes[a].kind, "time") == 0;
        int *chosen = time ? &h->time_axis : &h->channel_axis;
        if (*chosen >= 0)
            return trip_nrrd_fail(p, p->lines[TRIP_NRRD_SIZES],
                                  "axes %d and %d both have several entries beside the three axes "
                                  "of a volume: only one such axis can be read",
                                  *chosen, a);
        *chosen = a;
    }
    const int c = h->channel_axis;
    const char *kind = c >= 0 ? axes[c].kind : "";
    h->colour = c >= 0 && c < h->kept[0] &&
                ((h->sizes[c] == 3 && strcasecmp(kind, "RGB-color") == 0) ||
                 (h->sizes[c] == 4 && strcasecmp(kind, "RGBA-color") == 0));
    return 0;
}

static int choose_axes(trip_nrrd_parser *p, trip_nrrd_header *h)
{
    char room[4096], *kinds = copy_words(p, TRIP_NRRD_KINDS, room, sizeof room);
    axis axes[TRIP_NRRD_AXES_MAX] = { { SPATIAL, "", false } };
    for (int a = 0; a < p->axes; a++) {
        axes[a].kind = trip_nrrd_next_word(&kinds);
        axes[a].rank = rank_of_kind(axes[a].kind);
    }
    mark_axes_outside_space(p, axes);
    for (int left = p->axes; left > 3; left--)
        axes[worst_axis(h, axes)].dropped = true;
    int found = 0;
    for (int a = 0; a < p->axes && found < 3; a++)
        if (!axes[a].dropped) {
            h->kept[found] = p->kept[found] = a;
            found++;
        }
    if (found < 3)
        return trip_nrrd_fail(p, p->lines[TRIP_NRRD_SIZES],
                              "the data have %d axes: a volume has three", p->axes);
    for (int a = 0; a < 3; a++)
        if (rank_of_kind(axes[h->kept[a]].kind) == WITHIN)
            return trip_nrrd_fail(p, p->lines[TRIP_NRRD_KINDS],
                                  "axis %d is of kind \"%.40s\", but a volume has three axes in "
                                  "space",
                                  h->kept[a], axes[h->kept[a]].kind);
    return give_to_options(p, h, axes);
}

int trip_nrrd_parse_axes(trip_nrrd_parser *p, trip_nrrd_header *h)
{
    int64_t axes, values = 1;
    int status = trip_nrrd_require(p, TRIP_NRRD_DIMENSION, "dimension");
    if (status < 0 || (status = trip_nrrd_require(p, TRIP_NRRD_SIZES, "sizes")) < 0)
        return status;
    if (!trip_nrrd_parse_lone_integer(p->values[TRIP_NRRD_DIMENSION], &axes) || axes < 1 ||
        axes > TRIP_NRRD_AXES_MAX)
        return trip_nrrd_fail(p, p->lines[TRIP_NRRD_DIMENSION],
                              "\"dimension\" must be a number from 1 to %d", TRIP_NRRD_AXES_MAX);
    p->axes = h->axes = (int)axes;
    char *text = p->values[TRIP_NRRD_SIZES];
    for (int a = 0; a < p->axes; a++)
        if (!trip_nrrd_parse_integer(&text, &h->sizes[a]) || h->sizes[a] < 1)
            return trip_nrrd_fail(p, p->lines[TRIP_NRRD_SIZES],
                                  "\"sizes\" must be %d numbers of at least 1", p->axes);
    if (*trip_nrrd_trim(text))
        return trip_nrrd_fail(p, p->lines[TRIP_NRRD_SIZES], "\"sizes\" has more than %d numbers",
                              p->axes);
    for (int a = 0; a < p->axes; a++)
        if (__builtin_mul_overflow(values, h->sizes[a], &values))
            return trip_nrrd_fail(p, p->lines[TRIP_NRRD_SIZES], "the sizes are impossibly large");
    if ((status = choose_axes(p, h)) < 0)
        return status;
    for (int a = 0; a < 3; a++)
        h->dims[a] = h->sizes[h->kept[a]];
    return 0;
}

void trip_nrrd_header_layout(const trip_nrrd_header *h, int64_t channel, int64_t time,
                             trip_dense_layout *out)
{
    *out = (trip_dense_layout){ .count = { 1, 1, 1, 1 }, .luma = h->colour, .stored = h->type };
    int place = 0;
    for (int a = 0; a < h->axes; a++) {
        if (place < 3 && a == h->kept[place]) {
            place++;
            continue;
        }
        const int64_t index = a == h->channel_axis ? channel : a == h->time_axis ? time : 0;
        out->index[place] += index * out->count[place];
        out->count[place] *= h->sizes[a];
    }
}
