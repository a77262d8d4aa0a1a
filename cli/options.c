#include "options.h"

#include <errno.h>
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "budget.h"
#include "report.h"
#include "text.h"

/* getopt prints its own line, "ARGV0: unrecognized option ...". This argv[0] gives the line the
 * project's form, and without err_stream argp adds nothing to it. --help prints the command's own
 * name. */
static char error_prefix[64], help_name[64];

enum { KEY_HELP = 1000 };

static const struct argp_option common_options[] = {
    { "help", KEY_HELP, NULL, 0, "Prints this help", -1 },
    { 0 },
};

static error_t parse_key(int key, char *arg, struct argp_state *state)
{
    (void)arg;
    switch (key) {
    case ARGP_KEY_INIT:
        state->err_stream = NULL;
        state->child_inputs[0] = state->input;
        return 0;
    case KEY_HELP:
        state->name = help_name;
        argp_state_help(state, stdout, ARGP_HELP_STD_HELP);
        return 0;
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

/* Returns the first argument that starts like an option but contains bytes other than visible
 * ASCII, or NULL. getopt would send these bytes to the terminal unchanged. */
static const char *find_hidden_name(int argc, char **argv)
{
    for (int i = 1; i < argc && strcmp(argv[i], "--") != 0; i++) {
        const char *p = argv[i];
        bool is_long = strncmp(p, "--", 2) == 0;
        if (*p++ != '-' || !*p)
            continue;
        do
            if (*p <= ' ' || *p > '~')
                return argv[i];
        while (is_long && *++p && *p != '=');
    }
    return NULL;
}

int trip_options_parse(const struct argp *argp, int argc, char **argv, void *input)
{
    const struct argp_child children[] = { { argp, 0, NULL, 0 }, { 0 } };
    const struct argp outer = { .options = common_options,
                                .parser = parse_key,
                                .children = children };
    const char *hidden = find_hidden_name(argc, argv);
    if (hidden)
        return trip_option_fail(hidden, "unknown option");
    snprintf(help_name, sizeof help_name, "triptych %s", argv[0]);
    snprintf(error_prefix, sizeof error_prefix, "triptych: usage: %s", argv[0]);
    argv[0] = error_prefix;
    error_t status = argp_parse(&outer, argc, argv, ARGP_NO_HELP, NULL, input);
    if (status == ENOMEM)
        return trip_fail(TRIP_ERROR, "usage", help_name, "out of memory");
    return status ? TRIP_USAGE : 0;
}

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

int trip_option_size(const char *option, const char *text, int *width, int *height)
{
    int used = 0;
    if (sscanf(text, "%5dx%5d%n", width, height, &used) == 2 && !text[used] && *width > 0 &&
        *height > 0 && *width <= 65536 && *height <= 65536 &&
        strspn(text, "0123456789x") == strlen(text))
        return 0;
    return trip_fail(TRIP_USAGE, "usage", option,
                     "\"%s\" is not a size like 1024x768, with 1 to 65536 pixels a side", text);
}

const char *const trip_levels_for_names[] = { "auto", "post", "pre", "both", NULL };

int trip_option_choice(const char *option, const char *text, const char *const *names, int *out)
{
    char list[256] = "";
    for (int i = 0; names[i]; i++) {
        if (!strcmp(text, names[i])) {
            *out = i;
            return 0;
        }
        size_t used = strlen(list);
        snprintf(list + used, sizeof list - used, "%s%s", i ? ", " : "", names[i]);
    }
    return trip_fail(TRIP_USAGE, "usage", option, "invalid value \"%s\"; use one of %s", text,
                     list);
}

/* Like trip_option_choice(), with only the first `count` names. */
static int choose_of_first(const char *option, const char *text, const char *const *names,
                           int count, int *out)
{
    const char *taken[8] = { NULL };
    for (int i = 0; i < count; i++)
        taken[i] = names[i];
    return trip_option_choice(option, text, taken, out);
}

int trip_option_memory(const char *text, uint64_t *out)
{
    return trip_option_bytes("--memory", text, out);
}

int trip_option_threads(const char *text, int *out)
{
    return trip_option_integer("--threads", text, 1, 256, out);
}

int trip_option_repeat(const char *text, int *out)
{
    return trip_option_integer("--repeat", text, 1, 1000, out);
}

int trip_option_views(const char *text, int *out)
{
    return trip_option_integer("--views", text, 1, 1000, out);
}

int trip_option_engine(const char *text, int names, int *out)
{
    static const char *const all[] = { "auto", "io_uring", "pread", "null" };
    return choose_of_first("--engine", text, all, names, out);
}

int trip_option_renderer(const char *text, int names, int *out)
{
    static const char *const all[] = { "auto", "gl", "cpu", "reference", "integral" };
    return choose_of_first("--renderer", text, all, names, out);
}

int trip_option_classify(const char *text, int names, int *out)
{
    static const char *const all[] = { "pre", "post", "auto" };
    return choose_of_first("--classify", text, all, names, out);
}
