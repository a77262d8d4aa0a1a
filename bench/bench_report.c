#include "bench_report.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "budget.h"
#include "json.h"
#include "machine.h"
#include "report.h"
#include "text.h"

static int out_of_memory(void)
{
    return trip_fail(TRIP_ERROR, "bench", "report", "out of memory");
}

int bench_report_create(bench_report **out, const char *name, const char *command)
{
    bench_report *r = *out = calloc(1, sizeof *r);
    if (!r)
        return out_of_memory();
    r->root = cJSON_CreateObject();
    cJSON_AddStringToObject(r->root, "bench", name);
    cJSON_AddStringToObject(r->root, "command", command);
    r->settings = cJSON_AddObjectToObject(r->root, "settings");
    r->machine = cJSON_AddObjectToObject(r->root, "machine");
    r->tables = cJSON_AddObjectToObject(r->root, "tables");
    r->limits = cJSON_AddArrayToObject(r->root, "limits");
    if (!r->settings || !r->machine || !r->tables || !r->limits)
        return out_of_memory();
    measure_describe_machine(r->machine);
    return 0;
}

void bench_report_destroy(bench_report *r)
{
    if (!r)
        return;
    cJSON_Delete(r->root);
    free(r);
}

cJSON *bench_report_add_table(bench_report *r, const char *key, const char *title,
                              const measure_column *columns, int count)
{
    cJSON *object = cJSON_AddObjectToObject(r->tables, key);
    cJSON_AddStringToObject(object, "title", title);
    cJSON *rows = cJSON_AddArrayToObject(object, "rows");
    if (r->table_count < BENCH_REPORT_TABLES)
        r->shown[r->table_count++] =
            (measure_table){ .title = title, .rows = rows, .columns = columns, .count = count };
    return rows;
}

void bench_report_add_size(cJSON *to, const int size[2])
{
    char text[32];
    snprintf(text, sizeof text, "%d x %d", size[0], size[1]);
    cJSON_AddStringToObject(to, "size", text);
}

void bench_report_limit(bench_report *r, const char *sentence, ...)
{
    char text[1024];
    va_list arguments;
    va_start(arguments, sentence);
    vsnprintf(text, sizeof text, sentence, arguments);
    va_end(arguments);
    cJSON_AddItemToArray(r->limits, cJSON_CreateString(text));
}

/* Prints a key with spaces between its words. */
static void print_key(const char *key, int length)
{
    fputs("- ", stdout);
    for (int i = 0; i < length; i++)
        putchar(key[i] == '_' ? ' ' : key[i]);
    fputs(": ", stdout);
}

static void print_fact(const char *key, const char *text)
{
    print_key(key, (int)strlen(key));
    trip_text_write(stdout, text);
    putchar('\n');
}

static void print_facts(const char *heading, const cJSON *facts)
{
    const cJSON *item;
    char bytes[32];
    printf("\n%s\n\n", heading);
    cJSON_ArrayForEach(item, facts)
    {
        const char *unit = strstr(item->string, "_bytes");
        if (cJSON_IsString(item)) {
            print_fact(item->string, item->valuestring);
            continue;
        }
        print_key(item->string, unit ? (int)(unit - item->string) : (int)strlen(item->string));
        if (cJSON_IsBool(item))
            puts(cJSON_IsTrue(item) ? "yes" : "no");
        else if (unit)
            puts(trip_format_bytes((uint64_t)item->valuedouble, bytes));
        else
            printf("%.10g\n", item->valuedouble);
    }
}

static int print_json(const bench_report *r)
{
    char *text = trip_json_print(r->root, true);
    if (!text)
        return out_of_memory();
    puts(text);
    free(text);
    return 0;
}

int bench_report_print(bench_report *r, int json)
{
    const cJSON *limit;
    if (json)
        return print_json(r);
    trip_text_write(stdout, cJSON_GetObjectItemCaseSensitive(r->root, "command")->valuestring);
    putchar('\n');
    for (int i = 0; i < r->table_count; i++)
        measure_table_print(stdout, &r->shown[i]);
    printf("\nWhat the figures mean\n\n");
    cJSON_ArrayForEach(limit, r->limits) printf("- %s\n", limit->valuestring);
    print_facts("Settings", r->settings);
    print_facts("Machine", r->machine);
    return 0;
}
