/* triptych tf: lists the built-in transfer functions, prints a transfer function as `.tf` text, and
 * converts between the formats of other programs. */
#include "commands.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>

#include "library.h"
#include "new_file.h"
#include "command_line.h"
#include "read_data.h"
#include "report.h"
#include "text.h"

typedef enum action { LIST, SHOW, CONVERT } action;

typedef struct options {
    const char *words[3]; /* the action, IN and OUT */
    int count;
    action action;
    const char *tf;
    double range[2];
    int force;
    int format; /* 1 + index into formats[]; 0 selects by the name of OUT */
} options;

static const char *const formats[] = { "tf", "paraview", "vp", "vp.json", "slicer", "vtk", NULL };

static int read_range(const trip_option *row, const char *text, void *base)
{
    double *range = ((options *)base)->range;
    (void)row;
    return trip_option_range("--range", text, &range[0], &range[1]);
}

#define AT(member) .at = offsetof(options, member)

static const trip_option rows[] = {
    { "force", NULL, "Replaces OUT", .type = TRIP_OPTION_FLAG, AT(force) },
    { "format", "NAME",
      "Selects the format of OUT: tf, paraview, vp or vp.json (3D Slicer), slicer (presets in XML) "
      "or vtk (XML)",
      "by the name of OUT: .tf, .json, .vp, .vp.json, .xml for slicer", .type = TRIP_OPTION_CHOICE,
      AT(format), .choices = formats, .first = 1 },
    { "range", "LO:HI",
      "Sets the range of the data, for a transfer function that runs over this range",
      .type = TRIP_OPTION_CUSTOM, AT(range), .read = read_range },
    { "tf", "NAME|FILE", "Selects the transfer function to adapt to the data set or volume IN",
      "the one in the data set, the automatic one of the volume", .type = TRIP_OPTION_TEXT,
      AT(tf) },
};
#undef AT

static const trip_option_table tf_table = { rows, sizeof rows / sizeof *rows };

static int check(void *user)
{
    options *o = user;
    static const char *const actions[] = { "list", "show", "convert", NULL };
    static const int words[] = { 1, 2, 3 };
    int which = 0;
    if (o->count == 0)
        return trip_option_fail("tf", "no action given; use list, show or convert");
    int status = trip_option_choice("tf", o->words[0], actions, &which);
    o->action = (action)which;
    if (status)
        return status;
    if (o->count < words[which])
        return trip_option_fail(
            o->words[0], which == CONVERT ? "takes two arguments, IN and OUT"
                                          : "takes a transfer function, a data set or a volume");
    if (o->count > words[which])
        return trip_option_fail(o->words[words[which]],
                                "unexpected argument; see `triptych tf --help`");
    if (o->action == LIST && (o->tf || o->range[0] < o->range[1] || o->format || o->force))
        return trip_option_fail("list", "takes no options");
    if (o->action == SHOW && (o->format > 1 || o->force))
        return trip_option_fail(
            "show", "prints `.tf` text only; use `triptych tf convert` for --format and --force");
    return 0;
}

static int add_word(void *user, char *word)
{
    options *o = user;
    if (o->count == 3)
        return trip_option_fail(word, "unexpected argument; see `triptych tf --help`");
    o->words[o->count++] = word;
    return 0;
}

static void list(void)
{
    triptych_preset p;
    printf("%-11s %-13s %s\n", "name", "values", "for");
    for (unsigned i = 0; triptych_get_preset(i, &p); i++)
        printf("%-11s %-13s %s\n", p.name, p.values, p.summary);
}

static bool ends_with(const char *name, const char *end)
{
    size_t length = strlen(name), other = strlen(end);
    return length > other && !strcasecmp(name + length - other, end);
}

static bool is_dataset(const char *path)
{
    char index[4096];
    struct stat st;
    int length = snprintf(index, sizeof index, "%s/index.trip", path);
    return length < (int)sizeof index && stat(index, &st) == 0;
}

static bool is_preset(const char *name)
{
    triptych_preset p;
    for (unsigned i = 0; triptych_get_preset(i, &p); i++)
        if (!strcmp(p.name, name))
            return true;
    return false;
}

/* Returns whether a name means a transfer function. No volume and no pattern of slices has such a
 * name. */
static bool is_function(const char *name)
{
    static const char *const ends[] = { ".tf", ".json", ".vp", ".xml" };
    for (size_t i = 0; i < sizeof ends / sizeof *ends; i++)
        if (ends_with(name, ends[i]))
            return true;
    struct stat st;
    return is_preset(name) || strncmp(name, "preset:", 7) == 0 || strchr(name, '#') ||
           (stat(name, &st) != 0 && !strpbrk(name, "%*?["));
}

/* Converts IN, which is a preset, a file with a transfer function, a data set or a volume. */
static int convert_in(triptych *t, const options *o, triptych_form form, char **text)
{
    const char *in = o->words[1];
    triptych_conversion c = { .function = o->tf, .form = form, .name = in };
    int status = 0;
    if (is_dataset(in)) {
        status = triptych_open(t, in, NULL);
    } else if (!is_function(in)) {
        c.volume = in;
    } else if (o->tf) {
        return trip_option_fail("--tf", "applies to a data set or a volume only");
    } else {
        c.function = in;
        c.lo = o->range[0];
        c.hi = o->range[1];
    }
    return status ? status : triptych_convert(t, &c, text);
}

/* Refuses to overwrite files of a data set or a volume. OUT may lie beside the slices of a volume.
 * A transfer function's file may be its own OUT. */
static int check_replaced(triptych *t, const char *in, const char *out)
{
    read_files r = { 0 };
    int status = is_function(in) ? 0 : read_files_add_data(&r, t, in, NULL);
    if (!status)
        status = is_dataset(in) ? read_files_check(&r, out) : read_files_check_replaced(&r, out);
    read_files_release(&r);
    return status;
}

static int make_text(const options *o, triptych_form form, char **text)
{
    triptych *t = NULL;
    trip_progress progress = trip_progress_start();
    int status = library_create(&t, &progress);
    if (!status && o->action == CONVERT && strcmp(o->words[2], "-"))
        status = check_replaced(t, o->words[1], o->words[2]);
    if (!status)
        status = convert_in(t, o, form, text);
    trip_progress_end(&progress);
    triptych_destroy(t);
    return status;
}

static int choose_form(const options *o, triptych_form *form)
{
    static const struct {
        const char *end;
        triptych_form form;
    } ends[] = { { ".tf", TRIPTYCH_FORM_TF },
                 { ".vp.json", TRIPTYCH_FORM_VP_JSON },
                 { ".json", TRIPTYCH_FORM_PARAVIEW },
                 { ".vp", TRIPTYCH_FORM_VP },
                 { ".xml", TRIPTYCH_FORM_SLICER } };
    if (o->format) {
        *form = (triptych_form)(o->format - 1);
        return 0;
    }
    for (size_t i = 0; i < sizeof ends / sizeof *ends; i++)
        if (ends_with(o->words[2], ends[i].end)) {
            *form = ends[i].form;
            return 0;
        }
    return trip_option_fail(
        o->words[2],
        "unknown ending; use .tf, .json, .vp.json, .vp or .xml, or select the format by --format");
}

static int write_file(const options *o, const char *text)
{
    const char *path = o->words[2];
    struct stat st;
    if (lstat(path, &st) == 0 && !o->force)
        return trip_fail(TRIP_ERROR, "tf", path, "exists already; --force replaces it");
    return trip_new_file_of_text("write", path, text);
}

static int convert(const options *o)
{
    triptych_form form = TRIPTYCH_FORM_TF;
    const char *out = o->action == SHOW ? "-" : o->words[2];
    char *text = NULL;
    int status = o->action == SHOW || (!strcmp(out, "-") && !o->format) ? 0 : choose_form(o, &form);
    if (!status)
        status = make_text(o, form, &text);
    if (!status && !strcmp(out, "-"))
        fputs(text, stdout);
    else if (!status)
        status = write_file(o, text);
    free(text);
    return status;
}

int trip_command_tf(int argc, char **argv)
{
    options o = { 0 };
    option_set sets[] = { { .table = &tf_table, .base = &o } };
    const command_line line = {
        .args_doc = "list\nshow NAME|FILE|DATA.trip|VOLUME\nconvert IN OUT",
        .doc = "Lists the built-in transfer functions; prints a transfer function, or the one of a "
               "data set or volume, as `.tf` text; converts between the formats of other programs. "
               "IN is anything that show takes. OUT is a file, or - for standard output.",
        .sets = sets,
        .set_count = 1,
        .argument = add_word,
        .end = check,
        .user = &o,
    };
    int status = command_line_parse(&line, argc, argv);
    if (!status && o.action == LIST)
        list();
    else if (!status)
        status = convert(&o);
    return trip_exit_status(status);
}
