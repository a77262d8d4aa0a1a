#include "bench_report.h"

#include <math.h>
#include <sched.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/utsname.h>

#include "budget.h"
#include "json.h"
#include "report.h"
#include "text.h"

enum { MAX_TABLES = 8, CELL_BYTES = 96 };

typedef struct table {
    cJSON *object; /* the table in the root */
    const bench_column *columns;
    int column_count;
} table;

struct bench_report {
    cJSON *root, *settings, *machine, *tables, *limits;
    table shown[MAX_TABLES];
    int table_count;
};

static int out_of_memory(void)
{
    return trip_fail(TRIP_ERROR, "bench", "report", "out of memory");
}

static void cpu_model(char *text, size_t bytes, const struct utsname *system)
{
    char line[512];
    FILE *f = fopen("/proc/cpuinfo", "r");
    snprintf(text, bytes, "%s", system->machine);
    while (f && fgets(line, sizeof line, f)) {
        char *colon = strchr(line, ':');
        if (strncmp(line, "model name", 10) || !colon || strlen(colon) < 3)
            continue;
        line[strcspn(line, "\n")] = 0;
        snprintf(text, bytes, "%s", colon + 2);
        break;
    }
    if (f)
        fclose(f);
}

/* Returns the number of processors that this process may use. */
static int cores(void)
{
    cpu_set_t set;
    return sched_getaffinity(0, sizeof set, &set) == 0 ? CPU_COUNT(&set) : 1;
}

void bench_describe_machine(cJSON *machine)
{
    struct utsname system = { 0 };
    char model[256], kernel[256];
    uname(&system);
    cpu_model(model, sizeof model, &system);
    snprintf(kernel, sizeof kernel, "%.64s %.128s", system.sysname, system.release);
    cJSON_AddStringToObject(machine, "cpu", model);
    cJSON_AddNumberToObject(machine, "cores", cores());
    cJSON_AddNumberToObject(machine, "memory_bytes", (double)trip_memory_available_bytes());
    cJSON_AddStringToObject(machine, "system", kernel);
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
    bench_describe_machine(r->machine);
    return 0;
}

void bench_report_destroy(bench_report *r)
{
    if (!r)
        return;
    cJSON_Delete(r->root);
    free(r);
}

cJSON *bench_report_settings(bench_report *r)
{
    return r->settings;
}

cJSON *bench_report_machine(bench_report *r)
{
    return r->machine;
}

cJSON *bench_report_table(bench_report *r, const char *key, const char *title,
                          const bench_column *columns, int column_count)
{
    cJSON *object = cJSON_AddObjectToObject(r->tables, key);
    cJSON_AddStringToObject(object, "title", title);
    if (r->table_count < MAX_TABLES)
        r->shown[r->table_count++] = (table){ object, columns, column_count };
    return cJSON_AddArrayToObject(object, "rows");
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

static void cell(const cJSON *row, const bench_column *c, char text[CELL_BYTES])
{
    const cJSON *value = cJSON_GetObjectItemCaseSensitive(row, c->key);
    if (cJSON_IsNumber(value) && isfinite(value->valuedouble))
        snprintf(text, CELL_BYTES, "%.*f", c->decimals,
                 value->valuedouble / (c->unit ? c->unit : 1));
    else
        snprintf(text, CELL_BYTES, "%s", cJSON_IsString(value) ? value->valuestring : "-");
}

static int column_width(const cJSON *rows, const bench_column *c)
{
    int width = (int)strlen(c->heading);
    const cJSON *row;
    cJSON_ArrayForEach(row, rows)
    {
        char text[CELL_BYTES];
        cell(row, c, text);
        width = (int)strlen(text) > width ? (int)strlen(text) : width;
    }
    return width;
}

/* Columns of numbers are aligned to the right, words to the left. */
static int is_number(const cJSON *rows, const bench_column *c)
{
    const cJSON *row;
    cJSON_ArrayForEach(row, rows)
    {
        if (cJSON_IsNumber(cJSON_GetObjectItemCaseSensitive(row, c->key)))
            return 1;
    }
    return 0;
}

static void print_rule(int width, int number)
{
    for (int i = 0; i < width + 2 - number; i++)
        putchar('-');
    printf(number ? ":|" : "|");
}

static void print_table(const table *t)
{
    const cJSON *rows = cJSON_GetObjectItemCaseSensitive(t->object, "rows"), *row;
    printf("\n%s\n\n|", cJSON_GetObjectItemCaseSensitive(t->object, "title")->valuestring);
    for (int i = 0; i < t->column_count; i++) {
        int width = column_width(rows, &t->columns[i]);
        printf(" %*s |", is_number(rows, &t->columns[i]) ? width : -width, t->columns[i].heading);
    }
    printf("\n|");
    for (int i = 0; i < t->column_count; i++)
        print_rule(column_width(rows, &t->columns[i]), is_number(rows, &t->columns[i]));
    printf("\n");
    cJSON_ArrayForEach(row, rows)
    {
        printf("|");
        for (int i = 0; i < t->column_count; i++) {
            char text[CELL_BYTES];
            int width = column_width(rows, &t->columns[i]);
            cell(row, &t->columns[i], text);
            printf(" %*s |", is_number(rows, &t->columns[i]) ? width : -width, text);
        }
        printf("\n");
    }
}

static void print_fact(const char *key, const char *text)
{
    printf("- %s: ", key);
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
        if (cJSON_IsString(item))
            print_fact(item->string, item->valuestring);
        else if (cJSON_IsBool(item))
            printf("- %s: %s\n", item->string, cJSON_IsTrue(item) ? "yes" : "no");
        else if (strstr(item->string, "_bytes"))
            printf("- %.*s: %s\n", (int)(strstr(item->string, "_bytes") - item->string),
                   item->string, trip_format_bytes((uint64_t)item->valuedouble, bytes));
        else
            printf("- %s: %.10g\n", item->string, item->valuedouble);
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
        print_table(&r->shown[i]);
    printf("\nLimits of these figures\n\n");
    cJSON_ArrayForEach(limit, r->limits) printf("- %s\n", limit->valuestring);
    print_facts("Settings", r->settings);
    print_facts("Machine", r->machine);
    return 0;
}
