#ifndef _GNU_SOURCE
#define _GNU_SOURCE
#endif
#include "command_line.h"

#include <errno.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "draw_settings.h"
#include "report.h"

const char *const trip_levels_for_names[] = { "auto", "post", "pre", "both", NULL };

/* getopt prints its own line, "ARGV0: unrecognized option ...". This argv[0] gives the line the
 * project's form, and without err_stream argp adds nothing to it. --help prints the command's own
 * name. */
static char error_prefix[64], help_name[64];

enum { KEY_HELP = 1000 };

static bool is_end(const struct argp_option *o)
{
    return !o->name && !o->key && !o->doc && !o->group;
}

/* Prints a line for each option: its name, and its argument if it takes one. */
static void print_names(const struct argp_option *options)
{
    for (const struct argp_option *o = options; o && !is_end(o); o++)
        if (o->name && !(o->flags & OPTION_ALIAS))
            printf("--%s%s%s\n", o->name, o->arg ? " " : "", o->arg ? o->arg : "");
}

/* Prints a text for a man page, where a backslash and a dash have other meanings. */
static void print_roff(const char *text)
{
    for (; *text; text++)
        printf(strchr("\\-", *text) ? "\\%c" : "%c", *text);
}

static void print_man_option(const struct argp_option *o)
{
    printf(".TP\n.B ");
    if (o->key < 256)
        printf("\\-%c, ", o->key);
    printf("\\-\\-");
    print_roff(o->name);
    printf(o->arg ? " \\fI" : "");
    print_roff(o->arg ? o->arg : "");
    printf(o->arg ? "\\fR\n" : "\n");
    print_roff(o->doc);
    printf(".\n");
}

/* Prints the options for a man page, group by group. */
static void print_man(const struct argp_option *options)
{
    for (const struct argp_option *heading = options; !is_end(heading); heading++) {
        if (heading->name || !heading->doc)
            continue;
        printf(".SS %.*s\n", (int)strlen(heading->doc) - 1, heading->doc);
        for (const struct argp_option *o = options; !is_end(o); o++)
            if (o->name && o->group == heading->group && !(o->flags & OPTION_ALIAS))
                print_man_option(o);
    }
}

static const struct argp_option common_options[] = {
    { "help", KEY_HELP, "all", OPTION_ARG_OPTIONAL,
      "Prints the common options, or with =all every option", -1 },
    { 0 },
};

static error_t print_for_programs(const char *what, const struct argp_option *options)
{
    if (!strcmp(what, "names"))
        print_names(options);
    else if (!strcmp(what, "man"))
        print_man(options);
    else
        return trip_option_fail("--help", "takes nothing or all, --help=all");
    exit(EXIT_SUCCESS);
}

static error_t parse_key(int key, char *arg, struct argp_state *state)
{
    switch (key) {
    case ARGP_KEY_INIT:
        state->err_stream = NULL;
        state->child_inputs[0] = state->input;
        return 0;
    case KEY_HELP:
        if (arg && strcmp(arg, "all"))
            return print_for_programs(arg, state->root_argp->children[0].argp->options);
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

/* ---- tables ---- */

static const char *const headings[] = {
    [DRAW_GROUP_PICTURE] = "Picture:",
    [DRAW_GROUP_WINDOW] = "Window:",
    [DRAW_GROUP_SERVER] = "Server:",
    [DRAW_GROUP_VIEW] = "View:",
    [DRAW_GROUP_PATHS] = "Turntables and camera paths:",
    [DRAW_GROUP_LOOK] = "Look:",
    [DRAW_GROUP_LIGHT] = "Light and effects:",
    [DRAW_GROUP_CLIP] = "Clipping:",
    [DRAW_GROUP_ACCURACY] = "Accuracy and speed:",
    [DRAW_GROUP_MEASUREMENT] = "Measurement:",
    [DRAW_GROUP_RENDERER] = "Renderer and resources:",
    [DRAW_GROUP_RESULTS] = "Results and diagnostics:",
    [DRAW_GROUP_VOLUME] = "Volume (not for a data set, which has these fixed):",
    [DRAW_GROUP_RAW] = "Raw data:",
    [DRAW_GROUP_KEPT] = "Kept voxels (default: those that an automatic transfer function shows):",
    [DRAW_GROUP_OUTPUT] = "Output:",
    [DRAW_GROUP_STORED] = "Stored form:",
    [DRAW_GROUP_INTEGRAL] = "Integral (--renderer integral):",
    [DRAW_GROUP_TABLES] = "Options of some tables:",
    [DRAW_GROUP_LEVELS] = "levels without a data set:",
    [DRAW_GROUP_FLIGHT] = "flight:",
    [DRAW_GROUP_PAPERS] = "Variants of the papers:",
};
enum { GROUPS = sizeof headings / sizeof *headings, KEY_FIRST = 2000, ROWS_MAX = 64 };

/* The state of parsing. */
typedef struct parse {
    const command_line *c;
    struct argp_option options[OPTION_SETS_MAX * ROWS_MAX + GROUPS];
    char help[OPTION_SETS_MAX * ROWS_MAX][TRIP_OPTION_TEXT_BYTES];
    int count;
} parse;

static bool is_repeated(const trip_option_table *t, size_t row)
{
    for (size_t i = 0; i < row; i++)
        if (!strcmp(t->rows[i].name, t->rows[row].name))
            return true;
    return false;
}

static int key_of(int set, size_t row, const trip_option *r)
{
    return r->short_name ? r->short_name : KEY_FIRST + set * ROWS_MAX + (int)row;
}

static void add_row(parse *p, int set, size_t row)
{
    const trip_option *r = &p->c->sets[set].table->rows[row];
    trip_option_help(r, p->help[p->count]);
    p->options[p->count] = (struct argp_option){
        .name = r->name,
        .key = key_of(set, row, r),
        .arg = r->arg,
        .doc = p->help[p->count],
        .group = r->group,
    };
    p->count++;
    if (r->alias)
        p->options[p->count++] = (struct argp_option){ .name = r->alias,
                                                       .flags = OPTION_ALIAS | OPTION_HIDDEN,
                                                       .group = r->group };
}

static bool has_group(const parse *p, int group)
{
    for (int i = 0; i < p->count; i++)
        if (p->options[i].group == group && p->options[i].name)
            return true;
    return false;
}

static void add_rows(parse *p)
{
    const command_line *c = p->c;
    for (int set = 0; set < c->set_count; set++)
        for (size_t row = 0; row < c->sets[set].table->count; row++)
            if (!(c->sets[set].without >> row & 1) && !is_repeated(c->sets[set].table, row))
                add_row(p, set, row);
    for (int group = 1; group < GROUPS; group++)
        if (has_group(p, group))
            p->options[p->count++] = (struct argp_option){ .doc = headings[group], .group = group };
}

/* ---- the short help ---- */

/* Prints the options of a group that have a brief help. Returns their number. */
static int print_group(const command_line *c, int group, bool print)
{
    int count = 0;
    for (int set = 0; set < c->set_count; set++)
        for (size_t row = 0; row < c->sets[set].table->count; row++) {
            const trip_option *r = &c->sets[set].table->rows[row];
            char option[64];
            if (c->sets[set].without >> row & 1 || r->group != group || !r->brief)
                continue;
            if (print && !count)
                printf("\n%s\n", headings[group]);
            const char shortly[] = { '-', r->short_name, ',', ' ', 0 };
            snprintf(option, sizeof option, "%s--%s%s%s", r->short_name ? shortly : "", r->name,
                     r->arg ? " " : "", r->arg ? r->arg : "");
            if (print)
                printf(strlen(option) < 25 ? "  %-25s%s\n"
                                           : "  %s\n                           %s\n",
                       option, r->brief);
            count++;
        }
    return count;
}

static bool has_short_help(const command_line *c)
{
    int count = 0;
    for (int group = 1; group < GROUPS; group++)
        count += print_group(c, group, false);
    return count > 0;
}

/* Prints the first sentence of a text, in lines of at most 79 characters. */
static void print_sentence(const char *text)
{
    enum { WIDTH = 79 };
    const char *end = strstr(text, ". ");
    size_t left = end ? (size_t)(end + 1 - text) : strlen(text);
    while (left > WIDTH) {
        size_t cut = WIDTH;
        while (text[cut] != ' ')
            cut--;
        printf("%.*s\n", (int)cut, text);
        text += cut + 1;
        left -= cut + 1;
    }
    printf("%.*s\n", (int)left, text);
}

static void print_short_help(const command_line *c, const char *name)
{
    printf("Usage: triptych %s [OPTION...] %s\n", name, c->args_doc);
    print_sentence(c->doc);
    for (int group = 1; group < GROUPS; group++)
        print_group(c, group, true);
    printf("\n--help=all lists every option, and triptych-%s(1) explains them.\n", name);
    exit(EXIT_SUCCESS);
}

static int take(option_set *s, size_t row, const char *text)
{
    return trip_option_read(s->table, s->table->rows[row].name, text, s->base, &s->given);
}

static error_t parse_row(int key, char *arg, struct argp_state *state)
{
    const parse *p = state->input;
    const command_line *c = p->c;
    if (key == ARGP_KEY_ARG)
        return c->argument ? c->argument(c->user, arg)
                           : trip_option_fail(arg, "unexpected argument");
    if (key == ARGP_KEY_END)
        return c->end ? c->end(c->user) : 0;
    for (int set = 0; set < c->set_count; set++)
        for (size_t row = 0; row < c->sets[set].table->count; row++)
            if (key == key_of(set, row, &c->sets[set].table->rows[row]))
                return take(&c->sets[set], row, arg ? arg : "");
    return ARGP_ERR_UNKNOWN;
}

int command_line_parse(const command_line *c, int argc, char **argv)
{
    parse *p = calloc(1, sizeof *p);
    if (!p)
        return trip_fail(TRIP_ERROR, "usage", argv[0], "out of memory");
    for (int i = 1; i < argc && strcmp(argv[i], "--"); i++)
        if (!strcmp(argv[i], "--help") && has_short_help(c))
            print_short_help(c, argv[0]);
    p->c = c;
    add_rows(p);
    const struct argp argp = {
        .options = p->options, .parser = parse_row, .args_doc = c->args_doc, .doc = c->doc
    };
    int status = trip_options_parse(&argp, argc, argv, p);
    free(p);
    return status;
}
