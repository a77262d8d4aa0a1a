#include "table.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

enum { CELL_BYTES = 96 };

/* ---- rows ---- */

cJSON *measure_new_row(cJSON *rows)
{
    cJSON *row = cJSON_CreateObject();
    cJSON_AddItemToArray(rows, row);
    return row;
}

void measure_add_figures(cJSON *row, const measure_figure *figures, int count)
{
    for (int i = 0; i < count; i++)
        if (isfinite(figures[i].value))
            cJSON_AddNumberToObject(row, figures[i].key, figures[i].value);
        else
            cJSON_AddNullToObject(row, figures[i].key);
}

static const cJSON *find(const cJSON *row, const char *key)
{
    char part[64];
    for (size_t n; *key; key += n + (key[n] == '.')) {
        n = strcspn(key, ".");
        snprintf(part, sizeof part, "%.*s", (int)n, key);
        row = cJSON_GetObjectItemCaseSensitive(row, part);
    }
    return row;
}

double measure_number(const cJSON *row, const char *key)
{
    const cJSON *value = find(row, key);
    return cJSON_IsNumber(value) ? value->valuedouble : NAN;
}

static const char *cell(const cJSON *row, const measure_column *c, char text[CELL_BYTES])
{
    const cJSON *value = find(row, c->key);
    if (cJSON_IsObject(value))
        snprintf(text, CELL_BYTES, "%.*f / %.*f", c->decimals, measure_number(value, "mean"),
                 c->decimals, measure_number(value, "percentile_99"));
    else if (cJSON_IsNumber(value))
        snprintf(text, CELL_BYTES, "%.*f", c->decimals,
                 value->valuedouble / (c->unit > 0 ? c->unit : 1));
    else
        snprintf(text, CELL_BYTES, "%s", cJSON_IsString(value) ? value->valuestring : "-");
    return text;
}

static bool is_marked(const measure_table *t, const cJSON *row)
{
    return t->mark && cJSON_IsTrue(find(row, t->mark));
}

/* ---- Markdown ---- */

/* Columns of words are aligned to the left. The width is then negative, as printf() needs it. */
static int column_width(const measure_table *t, int column)
{
    int width = (int)strlen(t->columns[column].heading);
    bool words = true;
    const cJSON *row;
    cJSON_ArrayForEach(row, t->rows)
    {
        char text[CELL_BYTES];
        int length = (int)strlen(cell(row, &t->columns[column], text));
        length += column == 0 && is_marked(t, row) ? 2 : 0;
        width = length > width ? length : width;
        words &= !cJSON_IsNumber(find(row, t->columns[column].key));
    }
    return words ? -width : width;
}

void measure_table_print(FILE *f, const measure_table *t)
{
    const cJSON *row;
    if (t->title)
        fprintf(f, "\n%s\n\n", t->title);
    fputc('|', f);
    for (int i = 0; i < t->count; i++)
        fprintf(f, " %*s |", column_width(t, i), t->columns[i].heading);
    fputs("\n|", f);
    for (int i = 0; i < t->count; i++) {
        const int width = column_width(t, i);
        for (int k = width < 0 ? 2 - width : width + 1; k > 0; k--)
            fputc('-', f);
        fputs(width < 0 ? "|" : ":|", f);
    }
    fputc('\n', f);
    cJSON_ArrayForEach(row, t->rows)
    {
        fputc('|', f);
        for (int i = 0; i < t->count; i++) {
            char text[CELL_BYTES + 2];
            cell(row, &t->columns[i], text);
            fprintf(f, " %*s |", column_width(t, i),
                    i == 0 && is_marked(t, row) ? strcat(text, " *") : text);
        }
        fputc('\n', f);
    }
}

/* ---- HTML ---- */

void measure_write_escaped(FILE *f, const char *text)
{
    for (; *text; text++) {
        const char *entity = *text == '<'   ? "&lt;"
                             : *text == '>' ? "&gt;"
                             : *text == '&' ? "&amp;"
                             : *text == '"' ? "&quot;"
                                            : NULL;
        if (entity)
            fputs(entity, f);
        else if ((unsigned char)*text >= ' ' || *text == '\n')
            fputc(*text, f);
    }
}

/* Writes a text, or an object of texts as command-line options. */
static void write_text(FILE *f, const cJSON *value, void (*write)(FILE *f, const char *text))
{
    const cJSON *one;
    if (cJSON_IsString(value))
        write(f, value->valuestring);
    else
        cJSON_ArrayForEach(one, value)
        {
            fputs(one == value->child ? "--" : " --", f);
            write(f, one->string);
            fputc(' ', f);
            write(f, one->valuestring);
        }
}

static const cJSON *find_tip(const measure_table *t, const cJSON *row)
{
    const cJSON *tip = t->tips[0] ? find(row, t->tips[0]) : NULL;
    return tip || !t->tips[1] ? tip : find(row, t->tips[1]);
}

void measure_table_html(FILE *f, const measure_table *t)
{
    const cJSON *row;
    fputs("<div class=wide><table><tr>", f);
    for (int i = 0; i < t->count; i++) {
        fputs("<th>", f);
        measure_write_escaped(f, t->columns[i].heading);
    }
    fputc('\n', f);
    cJSON_ArrayForEach(row, t->rows)
    {
        fputs(is_marked(t, row) ? "<tr class=front>" : "<tr>", f);
        for (int i = 0; i < t->count; i++) {
            char text[CELL_BYTES];
            const cJSON *tip = i ? NULL : find_tip(t, row);
            fputs(tip ? "<td title=\"" : "<td>", f);
            write_text(f, tip, measure_write_escaped);
            fputs(tip ? "\">" : "", f);
            measure_write_escaped(f, cell(row, &t->columns[i], text));
        }
        fputc('\n', f);
    }
    fputs("</table></div>\n", f);
}

/* ---- CSV ---- */

static void write_quoted(FILE *f, const char *text)
{
    for (; *text; text++)
        fputs(*text == '"' ? "\"\"" : (const char[2]){ *text, 0 }, f);
}

static void write_field(FILE *f, const cJSON *value)
{
    if (cJSON_IsNumber(value))
        fprintf(f, "%.9g", value->valuedouble);
    else if (cJSON_IsBool(value))
        fputc(cJSON_IsTrue(value) ? '1' : '0', f);
    else if (cJSON_IsString(value) || cJSON_IsObject(value)) {
        fputc('"', f);
        write_text(f, value, write_quoted);
        fputc('"', f);
    }
}

void measure_table_csv(FILE *f, const cJSON *rows, const char *const *keys, int count)
{
    const cJSON *row;
    for (int i = 0; i < count; i++) {
        fputs(i ? "," : "", f);
        for (const char *c = keys[i]; *c; c++)
            fputc(*c == '.' ? '_' : *c, f);
    }
    fputs("\r\n", f);
    cJSON_ArrayForEach(row, rows)
    {
        for (int i = 0; i < count; i++) {
            fputs(i ? "," : "", f);
            write_field(f, find(row, keys[i]));
        }
        fputs("\r\n", f);
    }
}
