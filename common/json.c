#include "json.h"

#include <cjson/cJSON.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "report.h"
#include "text.h"

enum {
    MAX_DEPTH = 64,
    /* The node, and the allocator's overhead for it and its two texts, besides their bytes. */
    NODE_BYTES = sizeof(cJSON) + 16 + 2 * 32,
};

/* Size of the JSON tree that a parser would build up to the first error. The text may be invalid.
 */
typedef struct outline {
    uint64_t nodes, bytes;
    int depth; /* maximum */
} outline;

static outline outline_of(const char *text)
{
    outline o = { .nodes = 1 };
    int depth = 0;
    bool inside = false;
    const char *p = text;
    for (; *p; p++) {
        if (*p == '"')
            inside = !inside;
        else if (inside && *p == '\\' && p[1])
            p++;
        else if (!inside && (*p == '[' || *p == '{')) {
            o.nodes++;
            o.depth = ++depth > o.depth ? depth : o.depth;
        } else if (!inside && (*p == ']' || *p == '}'))
            depth--;
        else if (!inside && *p == ',')
            o.nodes++;
    }
    o.bytes = (uint64_t)(p - text);
    return o;
}

int trip_json_parse(trip_json *out, const char *text, const char *path, trip_budget *budget)
{
    outline o = outline_of(text);
    *out = (trip_json){ .budget = budget };
    if (o.depth > MAX_DEPTH)
        return trip_fail(TRIP_ERROR, "read", path, "its text is nested more than %d deep",
                         MAX_DEPTH);
    uint64_t bytes =
        o.bytes +
        o.nodes * NODE_BYTES; /* cannot overflow, since a node has at least one byte of text */
    if (budget && !trip_budget_charge(budget, bytes))
        return trip_fail(TRIP_ERROR, "read", path,
                         "its text takes %llu MiB of memory; raise --memory",
                         (unsigned long long)(bytes >> 20) + 1);
    out->bytes = budget ? bytes : 0;
    out->root = cJSON_ParseWithOpts(text, &out->end, false);
    return TRIP_OK;
}

void trip_json_free(trip_json *j)
{
    cJSON_Delete(j->root);
    if (j->budget)
        trip_budget_discharge(j->budget, j->bytes);
    *j = (trip_json){ 0 };
}

/* Escapes characters. Outside strings, JSON text has only printable characters and the white space
 * of its layout. */
static void write_escaped(FILE *f, const char *text)
{
    while (*text) {
        trip_text_character c = trip_text_next(text);
        if (c.printable || *text == '\n' || *text == '\t')
            fwrite(text, 1, c.bytes, f);
        else
            fprintf(f, "\\u%04x", (unsigned)c.code); /* no such code exceeds 16 bits */
        text += c.bytes;
    }
}

char *trip_json_print(const struct cJSON *root, bool formatted)
{
    char *raw = formatted ? cJSON_Print(root) : cJSON_PrintUnformatted(root), *text = NULL;
    size_t bytes = 0;
    FILE *f = raw ? open_memstream(&text, &bytes) : NULL;
    if (f)
        write_escaped(f, raw);
    bool good = f && fclose(f) == 0;
    free(raw);
    if (good)
        return text;
    free(text);
    return NULL;
}

int trip_json_put(cJSON *root, const char *stage, const char *where)
{
    char *text = trip_json_print(root, true);
    cJSON_Delete(root);
    if (!text)
        return trip_fail(TRIP_ERROR, stage, where, "out of memory");
    puts(text);
    free(text);
    return 0;
}
