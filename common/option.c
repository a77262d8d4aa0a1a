#include "option.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "budget.h"
#include "report.h"
#include "text.h"

/* ---- kinds of values ---- */

int trip_option_fail(const char *option, const char *why)
{
    return trip_fail(TRIP_USAGE, "usage", option, "%s", why);
}

int trip_option_number(const char *option, const char *text, double lo, double hi, double *out)
{
    if (!trip_text_to_double(text, out))
        return trip_fail(TRIP_USAGE, "usage", option, "\"%s\" is not a number", text);
    if (*out < lo || *out > hi)
        return trip_fail(TRIP_USAGE, "usage", option, "%s is not between %g and %g", text, lo, hi);
    return 0;
}

int trip_option_integer(const char *option, const char *text, int lo, int hi, int *out)
{
    double number;
    if (!trip_text_to_double(text, &number) || number != floor(number))
        return trip_fail(TRIP_USAGE, "usage", option, "\"%s\" is not a whole number", text);
    if (number < lo || number > hi)
        return trip_fail(TRIP_USAGE, "usage", option, "%s is not between %d and %d", text, lo, hi);
    *out = (int)number;
    return 0;
}

int trip_option_range(const char *option, const char *text, double *lo, double *hi)
{
    char first[64] = "";
    const char *colon = strchr(text, ':');
    if (!colon || colon - text >= (int)sizeof first)
        return trip_option_fail(option, "takes two values with a colon between them, LO:HI");
    memcpy(first, text, (size_t)(colon - text));
    if (!trip_text_to_double(first, lo) || !trip_text_to_double(colon + 1, hi) || *lo >= *hi)
        return trip_option_fail(option, "takes two numbers, the smaller first, as LO:HI");
    return 0;
}

int trip_option_numbers(const char *option, const char *text, int min, int max, double *out,
                        int *count)
{
    const char *rest = text;
    *count = 0;
    while (rest) {
        char number[64];
        const char *comma = strchr(rest, ',');
        size_t length = comma ? (size_t)(comma - rest) : strlen(rest);
        snprintf(number, sizeof number, "%.*s", (int)(length < 64 ? length : 63), rest);
        if (*count == max || length >= sizeof number || !trip_text_to_double(number, &out[*count]))
            break;
        (*count)++;
        rest = comma ? comma + 1 : NULL;
    }
    if (!rest && *count >= min)
        return 0;
    if (min == max)
        return trip_fail(TRIP_USAGE, "usage", option,
                         "\"%s\" is not a list of %d numbers joined by commas", text, max);
    return trip_fail(TRIP_USAGE, "usage", option,
                     "\"%s\" is not a list of %d to %d numbers joined by commas", text, min, max);
}

int trip_option_bytes(const char *option, const char *text, uint64_t *out)
{
    if (trip_parse_bytes(text, out) && *out > 0)
        return 0;
    return trip_fail(TRIP_USAGE, "usage", option, "\"%s\" is not a size like 512M or 2G", text);
}

/* Parses one side of a picture, and moves *text behind it. */
static bool read_side(const char **text, int *pixels)
{
    const size_t digits = strspn(*text, "0123456789");
    if (digits < 1 || digits > 5)
        return false;
    *pixels = atoi(*text);
    *text += digits;
    return *pixels >= 1 && *pixels <= 65536;
}

int trip_option_size(const char *option, const char *text, int *width, int *height)
{
    const char *rest = text;
    bool good = read_side(&rest, width);
    *height = *width;
    if (good && *rest == 'x') {
        rest++;
        good = read_side(&rest, height);
    }
    if (good && !*rest)
        return 0;
    return trip_fail(TRIP_USAGE, "usage", option,
                     "\"%s\" is not a size like 512 or 1024x768, with 1 to 65536 pixels a side",
                     text);
}

int trip_option_choice(const char *option, const char *text, const char *const *names, int *out)
{
    char list[256] = "";
    trip_text_nearest nearest = { .text = text };
    for (int i = 0; names[i]; i++) {
        if (!strcmp(text, names[i])) {
            *out = i;
            return 0;
        }
        size_t used = strlen(list);
        snprintf(list + used, sizeof list - used, "%s%s", i ? ", " : "", names[i]);
        trip_text_nearest_try(&nearest, names[i]);
    }
    return trip_fail(TRIP_USAGE, "usage", option, "invalid value \"%s\";%s%s%s use one of %s", text,
                     nearest.name ? " did you mean " : "", nearest.name ? nearest.name : "",
                     nearest.name ? "?" : "", list);
}

/* ---- rows ---- */

static size_t size_of(const trip_option *row)
{
    switch (row->type) {
    case TRIP_OPTION_TEXT:
        return sizeof(char *);
    case TRIP_OPTION_BYTES_64:
        return sizeof(uint64_t);
    case TRIP_OPTION_POINT:
        return 3 * sizeof(double);
    case TRIP_OPTION_RANGE:
        return 2 * sizeof(double);
    case TRIP_OPTION_FLAG:
    case TRIP_OPTION_INTEGER:
    case TRIP_OPTION_AUTO:
    case TRIP_OPTION_CHOICE:
    case TRIP_OPTION_CUSTOM:
        return sizeof(int);
    default:
        return sizeof(double);
    }
}

static bool is_integer(const trip_option *row)
{
    return size_of(row) == sizeof(int);
}

static void *member(const trip_option *row, void *base)
{
    return (char *)base + row->at;
}

static const void *const_member(const trip_option *row, const void *base)
{
    return (const char *)base + row->at;
}

bool trip_option_is_set(const trip_option *row, const void *base)
{
    static const char unset[3 * sizeof(double)] = { 0 };
    return memcmp(const_member(row, base), unset, size_of(row)) != 0;
}

bool trip_option_same(const trip_option *row, const void *a, const void *b)
{
    const bool same = memcmp(const_member(row, a), const_member(row, b), size_of(row)) == 0;
    return same && (!row->same || row->same(a, b));
}

void trip_option_copy(const trip_option *row, void *to, const void *from)
{
    memcpy(member(row, to), const_member(row, from), size_of(row));
}

static void find_option(const trip_option *row, char option[64])
{
    snprintf(option, 64, "--%s", row->name);
}

static int check_number(const trip_option *row, const char *option, double number)
{
    if (row->type == TRIP_OPTION_ABOVE && !(number > row->lo))
        return trip_fail(TRIP_USAGE, "usage", option, "must be above %g", row->lo);
    if (row->type == TRIP_OPTION_BELOW && !(number < row->hi))
        return trip_fail(TRIP_USAGE, "usage", option, "must be below %g", row->hi);
    return 0;
}

static int read_number(const trip_option *row, const char *option, const char *text, double *out)
{
    const bool automatic = row->type == TRIP_OPTION_AUTO_NUMBER;
    const bool keeps_zero =
        row->type == TRIP_OPTION_BELOW || row->type == TRIP_OPTION_PART || automatic;
    double number = 0;
    if (automatic && !strcmp(text, "auto"))
        return *out = TRIP_OPTION_AUTOMATIC, 0;
    int status = trip_option_number(option, text, row->lo, row->hi, &number);
    if (!status)
        status = check_number(row, option, number);
    if (!status)
        *out = keeps_zero && number == 0 ? TRIP_OPTION_ZERO : number;
    return status;
}

static int read_bytes(const trip_option *row, const char *option, const char *text, void *out)
{
    uint64_t bytes = 0;
    int status = trip_option_bytes(option, text, &bytes);
    if (!status && row->type == TRIP_OPTION_BYTES_64)
        *(uint64_t *)out = bytes;
    else if (!status)
        *(double *)out = (double)bytes;
    return status;
}

static int read_range(const trip_option *row, const char *option, const char *text, double *k)
{
    double lo, hi;
    int status = trip_option_range(option, text, &lo, &hi);
    if (status)
        return status;
    if (!(lo >= row->lo && hi <= row->hi))
        return trip_fail(TRIP_USAGE, "usage", option,
                         "takes numbers from %g to %g, the smaller first, as LO:HI", row->lo,
                         row->hi);
    k[0] = lo;
    k[1] = hi;
    return 0;
}

/* Reads the value of a row that has no namesake. */
static int read_row(const trip_option *row, const char *text, void *base)
{
    char option[64];
    void *out = member(row, base);
    int which = 0, status, count;
    find_option(row, option);
    switch (row->type) {
    case TRIP_OPTION_FLAG:
        *(int *)out = 1;
        return 0;
    case TRIP_OPTION_TEXT:
        *(const char **)out = text;
        return 0;
    case TRIP_OPTION_AUTO:
        if (!strcmp(text, "auto"))
            return *(int *)out = -1, 0;
        return trip_option_integer(option, text, (int)row->lo, (int)row->hi, out);
    case TRIP_OPTION_INTEGER:
        return trip_option_integer(option, text, (int)row->lo, (int)row->hi, out);
    case TRIP_OPTION_BYTES:
    case TRIP_OPTION_BYTES_64:
        return read_bytes(row, option, text, out);
    case TRIP_OPTION_CHOICE:
        status = trip_option_choice(option, text, row->choices, &which);
        if (!status)
            *(int *)out = row->first + which;
        return status;
    case TRIP_OPTION_POINT:
        return trip_option_numbers(option, text, 3, 3, out, &count);
    case TRIP_OPTION_RANGE:
        return read_range(row, option, text, out);
    case TRIP_OPTION_CUSTOM:
        return row->read(row, text, base);
    default:
        return read_number(row, option, text, out);
    }
}

static bool has_choice(const trip_option *row, const char *text)
{
    for (int i = 0; row->choices && row->choices[i]; i++)
        if (!strcmp(row->choices[i], text))
            return true;
    return false;
}

static bool is_named(const trip_option *row, const char *name)
{
    return !strcmp(row->name, name) || (row->alias && !strcmp(row->alias, name));
}

static int fail_choice(const trip_option_table *t, const char *name, const char *text)
{
    const char *all[16] = { NULL };
    char option[64];
    int count = 0, which;
    for (size_t i = 0; i < t->count; i++)
        for (int j = 0; is_named(&t->rows[i], name) && t->rows[i].choices[j] && count < 15; j++)
            all[count++] = t->rows[i].choices[j];
    snprintf(option, sizeof option, "--%s", name);
    return trip_option_choice(option, text, all, &which);
}

/* Reads the parts of a value joined by commas, each into its own row of this name. */
static int read_shared(const trip_option_table *t, const char *name, const char *text, void *base,
                       uint64_t *given)
{
    uint64_t taken = 0;
    for (const char *rest = text; rest;) {
        char part[32];
        const char *comma = strchr(rest, ',');
        size_t i = 0;
        snprintf(part, sizeof part, "%.*s", (int)(comma ? comma - rest : (long)strlen(rest)), rest);
        while (i < t->count && !(is_named(&t->rows[i], name) && has_choice(&t->rows[i], part)))
            i++;
        if (i == t->count)
            return fail_choice(t, name, part);
        if (taken >> i & 1)
            return trip_fail(TRIP_USAGE, "usage", name, "\"%s\" names two values of one kind",
                             text);
        taken |= UINT64_C(1) << i;
        read_row(&t->rows[i], part, base);
        rest = comma ? comma + 1 : NULL;
    }
    *given |= taken;
    return 0;
}

int trip_option_read(const trip_option_table *t, const char *name, const char *text, void *base,
                     uint64_t *given)
{
    size_t found = t->count;
    int namesakes = 0;
    for (size_t i = 0; i < t->count; i++)
        if (is_named(&t->rows[i], name)) {
            found = namesakes++ ? found : i;
        }
    if (!namesakes)
        return 1;
    if (namesakes > 1)
        return read_shared(t, name, text, base, given);
    *given |= UINT64_C(1) << found;
    return read_row(&t->rows[found], text, base);
}

void trip_option_print(const trip_option *row, const void *base, char text[TRIP_OPTION_TEXT_BYTES])
{
    const size_t bytes = TRIP_OPTION_TEXT_BYTES;
    const void *at = const_member(row, base);
    const double *numbers = at;
    char part[3][32];
    text[0] = 0;
    switch (row->type) {
    case TRIP_OPTION_FLAG:
        return;
    case TRIP_OPTION_TEXT:
        snprintf(text, bytes, "%s", *(const char *const *)at);
        return;
    case TRIP_OPTION_AUTO:
    case TRIP_OPTION_INTEGER:
        snprintf(text, bytes, "%d", *(const int *)at);
        if (*(const int *)at < 0 && row->type == TRIP_OPTION_AUTO)
            snprintf(text, bytes, "auto");
        return;
    case TRIP_OPTION_BYTES_64:
        snprintf(text, bytes, "%llu", (unsigned long long)*(const uint64_t *)at);
        return;
    case TRIP_OPTION_BYTES:
        snprintf(text, bytes, "%.0f", numbers[0]);
        return;
    case TRIP_OPTION_CHOICE:
        snprintf(text, bytes, "%s", row->choices[*(const int *)at - row->first]);
        return;
    case TRIP_OPTION_POINT:
        snprintf(text, bytes, "%s,%s,%s", trip_text_from_double(numbers[0], part[0]),
                 trip_text_from_double(numbers[1], part[1]),
                 trip_text_from_double(numbers[2], part[2]));
        return;
    case TRIP_OPTION_RANGE:
        snprintf(text, bytes, "%s:%s", trip_text_from_double(numbers[0], part[0]),
                 trip_text_from_double(numbers[1], part[1]));
        return;
    case TRIP_OPTION_CUSTOM:
        row->print(base, text, bytes);
        return;
    case TRIP_OPTION_AUTO_NUMBER:
        if (numbers[0] == TRIP_OPTION_AUTOMATIC) {
            snprintf(text, bytes, "auto");
            return;
        }
        /* fall through */
    case TRIP_OPTION_BELOW:
    case TRIP_OPTION_PART:
        snprintf(text, bytes, "%s",
                 trip_text_from_double(numbers[0] < 0 ? 0 : numbers[0], part[0]));
        return;
    default:
        snprintf(text, bytes, "%s", trip_text_from_double(numbers[0], part[0]));
    }
}

static int choices_of(const trip_option *row)
{
    int count = 0;
    while (row->choices[count])
        count++;
    return count;
}

static bool is_in_range(const trip_option *row, const void *at)
{
    const double *numbers = at;
    const double number = is_integer(row) ? *(const int *)at : *numbers;
    switch (row->type) {
    case TRIP_OPTION_AUTO:
        return number == -1 || (number >= row->lo && number <= row->hi);
    case TRIP_OPTION_CHOICE:
        return number >= 0 && number < row->first + choices_of(row);
    case TRIP_OPTION_ABOVE:
        return number > row->lo && number <= row->hi;
    case TRIP_OPTION_BELOW:
        return number == TRIP_OPTION_ZERO || (number >= row->lo && number < row->hi);
    case TRIP_OPTION_AUTO_NUMBER:
        if (number == TRIP_OPTION_AUTOMATIC)
            return true;
        /* fall through */
    case TRIP_OPTION_PART:
        return number == TRIP_OPTION_ZERO || (number >= row->lo && number <= row->hi);
    case TRIP_OPTION_RANGE:
        return numbers[0] >= row->lo && numbers[0] < numbers[1] && numbers[1] <= row->hi;
    case TRIP_OPTION_BYTES:
        return number > 0 && number <= 1e18;
    case TRIP_OPTION_NUMBER:
    case TRIP_OPTION_INTEGER:
        return number >= row->lo && number <= row->hi;
    default:
        return true;
    }
}

int trip_option_check(const trip_option *row, const void *base)
{
    char option[64];
    const void *at = const_member(row, base);
    if (!trip_option_is_set(row, base) || is_in_range(row, at))
        return 0;
    find_option(row, option);
    if (row->type == TRIP_OPTION_CHOICE)
        return trip_fail(TRIP_USAGE, "usage", option, "has no value number %d", *(const int *)at);
    if (is_integer(row))
        return trip_fail(TRIP_USAGE, "usage", option, "%d is not between %g and %g",
                         *(const int *)at, row->lo, row->hi);
    return trip_fail(TRIP_USAGE, "usage", option, "%g is not between %g and %g",
                     *(const double *)at, row->lo, row->hi);
}

void trip_option_help(const trip_option *row, char text[TRIP_OPTION_TEXT_BYTES])
{
    const size_t bytes = TRIP_OPTION_TEXT_BYTES;
    /* wider ranges only keep out nonsense */
    const bool ranges = row->lo < row->hi && row->hi <= 1e5 && row->lo >= -1;
    int at = snprintf(text, bytes, "%s", row->help);
    if (ranges && row->type == TRIP_OPTION_ABOVE)
        at += snprintf(text + at, bytes - (size_t)at, ", above %g to %g", row->lo, row->hi);
    else if (ranges && row->type == TRIP_OPTION_BELOW)
        at += snprintf(text + at, bytes - (size_t)at, ", %g to below %g", row->lo, row->hi);
    else if (ranges)
        at += snprintf(text + at, bytes - (size_t)at, ", %.15g to %.15g", row->lo, row->hi);
    if (row->standard)
        at += snprintf(text + at, bytes - (size_t)at, " (default: %s)", row->standard);
    if (row->limits)
        snprintf(text + at, bytes - (size_t)at, "; %s", row->limits);
}
