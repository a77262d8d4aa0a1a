#ifndef _GNU_SOURCE
#define _GNU_SOURCE
#endif
#include "command_line.h"

#include <argp.h>
#include <errno.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "draw_settings.h"
#include "report.h"
#include "text.h"

const char *const trip_levels_for_names[] = { "auto", "post", "pre", "both", NULL };

/* getopt prints its own line, "ARGV0: unrecognized option ...". This argv[0] gives the line the
 * project's form, and without err_stream argp adds nothing to it. --help prints the command's own
 * name. */
static char error_prefix[64], help_name[64];

enum { KEY_HELP = 'h', KEY_QUIET = 'q' };

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

#define QUIET_HELP "Prints no progress, notes and summary"

/* The options of every command. */
static const struct argp_option common_options[] = {
    { "quiet", KEY_QUIET, NULL, 0, QUIET_HELP "; warnings and errors still appear", -1 },
    { "help", KEY_HELP, "all", OPTION_ARG_OPTIONAL,
      "Prints the common options, or with =all every option", -1 },
    { 0 },
};

static bool quiet;

bool command_line_quiet(void)
{
    return quiet;
}

bool command_line_is_note(const char *line)
{
    static const char note[] = "triptych: note: ";
    return !strncmp(line, note, strlen(note));
}

static void drop_notes(const char *line, void *user)
{
    (void)user;
    if (!command_line_is_note(line))
        trip_report_line(line);
}

static void be_quiet(void)
{
    quiet = true;
    trip_report_redirect(drop_notes, NULL);
}

static error_t print_for_programs(const char *what, const struct argp_option *options)
{
    if (!strcmp(what, "names")) {
        print_names(options);
        printf("--%s\n", common_options->name);
    } else if (!strcmp(what, "man")) {
        print_man(options);
        printf(".SS Messages\n");
        print_man_option(common_options);
    } else
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
    case KEY_QUIET:
        be_quiet();
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

/* ---- unknown options ---- */

/* The options of a command as getopt finds them, and the program's function for other commands. */
typedef struct known {
    const struct argp_option *tables[2];
    const char *command;
} known;

static const char *(*find_other_command)(const char *option);

void command_line_set_finder(const char *(*find)(const char *option))
{
    find_other_command = find;
}

/* Returns the option with this name, or the last one that starts with it. Sets *matches to their
 * number. An alias stands for the option before it. */
static const struct argp_option *find_long(const known *k, const char *name, size_t length,
                                           int *matches)
{
    const struct argp_option *found = NULL, *real = NULL;
    *matches = 0;
    for (int t = 0; t < 2; t++)
        for (const struct argp_option *o = k->tables[t]; o && !is_end(o); o++) {
            real = o->flags & OPTION_ALIAS ? real : o;
            if (!o->name || strncmp(o->name, name, length) != 0)
                continue;
            if (!o->name[length]) {
                *matches = 1;
                return real;
            }
            *matches += found != real;
            found = real;
        }
    return found;
}

static const struct argp_option *find_short(const known *k, char letter)
{
    for (int t = 0; t < 2; t++)
        for (const struct argp_option *o = k->tables[t]; o && !is_end(o); o++)
            if (o->key == letter)
                return o;
    return NULL;
}

static bool takes_next(const struct argp_option *o)
{
    return o->arg && !(o->flags & OPTION_ARG_OPTIONAL);
}

static const char *nearest_long(const known *k, const char *name)
{
    trip_text_nearest nearest = { .text = name };
    for (int t = 0; t < 2; t++)
        for (const struct argp_option *o = k->tables[t]; o && !is_end(o); o++)
            if (o->name && !(o->flags & OPTION_ALIAS))
                trip_text_nearest_try(&nearest, o->name);
    return nearest.name;
}

/* Reports an option that the command lacks. Names a command that has it, or a similar option. */
static int fail_unknown(const known *k, const char *option, size_t length)
{
    char text[64], name[64];
    snprintf(text, sizeof text, "%.*s", (int)(length < 63 ? length : 63), option);
    snprintf(name, sizeof name, "%s", text + strspn(text, "-"));
    const bool is_word = name[0] && name[1];
    int matches = 0;
    const bool is_own = find_long(k, name, strlen(name), &matches) && matches == 1;
    const char *other = is_word && !is_own && find_other_command ? find_other_command(name) : NULL;
    const char *nearest = is_word && !other ? nearest_long(k, name) : NULL;
    if (other)
        return trip_fail(TRIP_USAGE, "usage", text,
                         "unknown option of %s; `triptych %s` has it; `triptych %s --help` lists "
                         "the options of %s",
                         k->command, other, k->command, k->command);
    return trip_fail(
        TRIP_USAGE, "usage", text, "unknown option;%s%s%s `triptych %s --help` lists the options",
        nearest ? " did you mean --" : "", nearest ? nearest : "", nearest ? "?" : "", k->command);
}

static int fail_ambiguous(const known *k, const char *option, size_t length)
{
    char text[64], list[256] = "";
    snprintf(text, sizeof text, "%.*s", (int)(length < 63 ? length : 63), option);
    for (int t = 0; t < 2; t++)
        for (const struct argp_option *o = k->tables[t]; o && !is_end(o); o++) {
            const size_t used = strlen(list);
            if (o->name && !(o->flags & OPTION_ALIAS) &&
                !strncmp(o->name, text + 2, strlen(text + 2)))
                snprintf(list + used, sizeof list - used, "%s--%s", used ? ", " : "", o->name);
        }
    return trip_fail(TRIP_USAGE, "usage", text, "short for several options: %s", list);
}

/* Checks a group of one-letter options. Returns 1 if the last one takes the next argument. */
static int check_letters(const known *k, const char *letters)
{
    for (const char *p = letters + 1; *p; p++) {
        const struct argp_option *o = find_short(k, *p);
        if (!o)
            return fail_unknown(k, letters, strlen(letters));
        if (o->arg)
            return !p[1] && takes_next(o);
    }
    return 0;
}

/* Checks an argument that starts with a dash. Returns 1 if it takes the next argument. */
static int check_option(const known *k, const char *option)
{
    const size_t length = strcspn(option, "=");
    int matches;
    if (strncmp(option, "--", 2) != 0)
        return check_letters(k, option);
    const struct argp_option *o =
        length > 2 ? find_long(k, option + 2, length - 2, &matches) : NULL;
    if (!o)
        return fail_unknown(k, option, length);
    if (matches > 1)
        return fail_ambiguous(k, option, length);
    return !option[length] && takes_next(o);
}

/* Reports the first unknown or ambiguous option, which getopt would print without a remedy, and
 * with its control characters. */
static int check_names(const known *k, int argc, char **argv)
{
    for (int i = 1; i < argc && strcmp(argv[i], "--") != 0; i++) {
        int status = argv[i][0] == '-' && argv[i][1] ? check_option(k, argv[i]) : 0;
        if (status < 0)
            return status;
        i += status;
    }
    return 0;
}

static int parse_arguments(const struct argp *argp, int argc, char **argv, void *input)
{
    const struct argp_child children[] = { { argp, 0, NULL, 0 }, { 0 } };
    const struct argp outer = { .options = common_options,
                                .parser = parse_key,
                                .children = children };
    const known k = { { argp->options, common_options }, argv[0] };
    if (check_names(&k, argc, argv))
        return TRIP_USAGE;
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
    [DRAW_GROUP_POINTS] = "Cloud of points (not for a data set, which has these fixed):",
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
    printf("\n  %-25s%s\n", "-q, --quiet", QUIET_HELP);
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
        if ((!strcmp(argv[i], "--help") || !strcmp(argv[i], "-h")) && has_short_help(c))
            print_short_help(c, argv[0]);
    p->c = c;
    add_rows(p);
    const struct argp argp = {
        .options = p->options, .parser = parse_row, .args_doc = c->args_doc, .doc = c->doc
    };
    int status = parse_arguments(&argp, argc, argv, p);
    free(p);
    return status;
}
