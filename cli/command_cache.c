/* triptych cache: lists or removes the data sets in the cache. */
#include "commands.h"

#include <cjson/cJSON.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "cache_folder.h"
#include "budget.h"
#include "library.h"
#include "json.h"
#include "command_line.h"
#include "report.h"
#include "text.h"

typedef struct options {
    bool list, clear;
    int json;
} options;

static const trip_option rows[] = {
    { "json", NULL, "Prints the list as JSON; list only", .type = TRIP_OPTION_FLAG,
      .at = offsetof(options, json) },
};

static const trip_option_table cache_table = { rows, sizeof rows / sizeof *rows };

static int check_options(void *user)
{
    const options *o = user;
    if (!o->list && !o->clear)
        return trip_option_fail(
            "ACTION", "no action given; use `triptych cache list` or `triptych cache clear`");
    if (o->clear && o->json)
        return trip_option_fail("--json", "applies to list only");
    return 0;
}

static int add_action(void *user, char *argument)
{
    static const char *const actions[] = { "list", "clear", NULL };
    options *o = user;
    int which = 0;
    if (o->list || o->clear)
        return trip_option_fail(argument, "only one action is possible at a time");
    int status = trip_option_choice("ACTION", argument, actions, &which);
    o->list = !status && which == 0;
    o->clear = !status && which == 1;
    return status;
}

/* Returns the volume's name from the notes of its data set; the caller frees it. Returns NULL
 * without a message if the data set cannot be opened, because its next use makes it again. */
static char *source_name(const char *path)
{
    triptych *t = NULL;
    char *name = NULL;
    int status = library_create(&t, NULL);
    if (status == 0) {
        triptych_set_messages(t, NULL, NULL);
        status = triptych_open(t, path, NULL);
    }
    if (status == 0) {
        name = library_note(t, "source");
        name = name ? name : strdup("");
    }
    triptych_destroy(t);
    return name;
}

static const char *format_time(int64_t ns, bool for_people, char text[32])
{
    time_t seconds = (time_t)(ns / 1000000000);
    struct tm t = { 0 };
    if (for_people)
        localtime_r(&seconds, &t);
    else
        gmtime_r(&seconds, &t);
    strftime(text, 32, for_people ? "%Y-%m-%d %H:%M" : "%Y-%m-%dT%H:%M:%SZ", &t);
    return text;
}

/* The files with choices of quality. */
typedef struct kept_choices {
    size_t count;
    uint64_t bytes;
} kept_choices;

static void print_text(const cache_folder *c, const cache_entry *entries, size_t count,
                       const kept_choices *choices)
{
    char bytes[32], limit[32], used[32];
    uint64_t total = 0;
    for (size_t i = 0; i < count; i++)
        total += entries[i].bytes;
    printf("%-9s ", "folder");
    trip_text_write(stdout, c->path);
    putchar('\n');
    printf("%-9s %zu data set%s, %s", "holds", count, count == 1 ? "" : "s",
           trip_format_bytes(total, bytes));
    if (c->fd >= 0)
        printf(" of at most %s (TRIPTYCH_CACHE_SIZE)", trip_format_bytes(c->limit_bytes, limit));
    putchar('\n');
    if (choices->count)
        printf("%-9s choices of quality for %zu data set%s, %s\n", "and", choices->count,
               choices->count == 1 ? "" : "s", trip_format_bytes(choices->bytes, bytes));
    for (size_t i = count; i-- > 0;) {
        char *path = cache_folder_path(c, &entries[i].key), *name = path ? source_name(path) : NULL;
        printf("%9s  %s  ", trip_format_bytes(entries[i].bytes, bytes),
               format_time(entries[i].used_ns, true, used));
        trip_text_write(stdout, name ? name : "(damaged, or of another version)");
        fputs("  ", stdout);
        trip_text_write(stdout, path ? path : "");
        putchar('\n');
        free(name);
        free(path);
    }
}

static cJSON *entry_to_json(const cache_folder *c, const cache_entry *e)
{
    char used[32], *path = cache_folder_path(c, &e->key), *name = path ? source_name(path) : NULL;
    cJSON *object = cJSON_CreateObject();
    cJSON_AddItemToObject(object, "source", name ? cJSON_CreateString(name) : cJSON_CreateNull());
    cJSON_AddStringToObject(object, "path", path ? path : "");
    cJSON_AddNumberToObject(object, "bytes", (double)e->bytes);
    cJSON_AddStringToObject(object, "used", format_time(e->used_ns, false, used));
    free(name);
    free(path);
    return object;
}

static int print_json(const cache_folder *c, const cache_entry *entries, size_t count,
                      const kept_choices *choices)
{
    cJSON *root = cJSON_CreateObject();
    cJSON_AddStringToObject(root, "folder", c->path);
    if (c->fd >= 0)
        cJSON_AddNumberToObject(root, "limit_bytes", (double)c->limit_bytes);
    cJSON_AddNumberToObject(root, "choices_bytes", (double)choices->bytes);
    cJSON *list = cJSON_AddArrayToObject(root, "data_sets");
    for (size_t i = count; i-- > 0;)
        cJSON_AddItemToArray(list, entry_to_json(c, &entries[i]));
    char *text = trip_json_print(root, true);
    cJSON_Delete(root);
    if (!text)
        return trip_fail(TRIP_ERROR, "cache", c->path, "out of memory");
    puts(text);
    free(text);
    return 0;
}

static int list(const cache_folder *c, const options *o)
{
    cache_entry *entries = NULL;
    size_t count = 0;
    kept_choices choices = { 0 };
    int status = c->fd < 0 ? 0 : cache_folder_list(c, &entries, &count);
    if (status == 0 && c->fd >= 0)
        status = cache_folder_count_choices(c, &choices.count, &choices.bytes);
    if (status == 0 && o->json)
        status = print_json(c, entries, count, &choices);
    else if (status == 0)
        print_text(c, entries, count, &choices);
    free(entries);
    return status;
}

static uint64_t bytes_of(const cache_entry *entries, size_t count)
{
    uint64_t bytes = 0;
    for (size_t i = 0; i < count; i++)
        bytes += entries[i].bytes;
    return bytes;
}

/* Names the data sets that remain, in one line. */
static int fail_if_left(const cache_folder *c, const cache_left *left)
{
    const struct {
        size_t count;
        const char *why;
    } kinds[] = { { left->used, "in use" },
                  { left->making, "being made" },
                  { left->stuck, "that cannot be removed" } };
    size_t count = left->used + left->making + left->stuck;
    char text[200] = "", *end = text;
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++)
        if (kinds[i].count)
            end += sprintf(end, "%s%zu %s", *text ? ", " : "", kinds[i].count, kinds[i].why);
    return count ? trip_fail(TRIP_ERROR, "cache", c->path, "%zu data set%s: %s", count,
                             count == 1 ? " remains" : "s remain", text)
                 : 0;
}

static int clear(const cache_folder *c)
{
    cache_entry *before = NULL, *after = NULL;
    size_t had = 0, has = 0;
    cache_left left = { 0 };
    char text[32];
    int status = c->fd < 0 ? 0 : cache_folder_list(c, &before, &had);
    if (status == 0 && c->fd >= 0)
        status = cache_folder_shrink(c, 0, &left);
    if (status == 0 && c->fd >= 0)
        status = cache_folder_list(c, &after, &has);
    has = has < had ? has : had; /* another process may have added data sets */
    const uint64_t had_bytes = bytes_of(before, had), has_bytes = bytes_of(after, has);
    if (status == 0 && !command_line_quiet())
        printf("removed %zu data set%s, %s\n", had - has, had - has == 1 ? "" : "s",
               trip_format_bytes(had_bytes > has_bytes ? had_bytes - has_bytes : 0, text));
    if (status == 0)
        status = fail_if_left(c, &left);
    free(before);
    free(after);
    return status;
}

int trip_command_cache(int argc, char **argv)
{
    options o = { 0 };
    option_set sets[] = { { .table = &cache_table, .base = &o } };
    const command_line line = {
        .args_doc = "list|clear",
        .doc = "Lists or removes the data sets that render, view and serve made of volumes.",
        .sets = sets,
        .set_count = 1,
        .argument = add_action,
        .end = check_options,
        .user = &o,
    };
    cache_folder c = { .fd = -1 };
    int status = command_line_parse(&line, argc, argv);
    if (status == 0)
        status = cache_folder_open(&c, false);
    if (status == 0)
        status = o.clear ? clear(&c) : list(&c, &o);
    cache_folder_close(&c);
    return trip_exit_status(status);
}
