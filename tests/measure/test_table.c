/* Tests that tables have the same figures as Markdown, HTML and CSV. */
#include <math.h>
#include <stdlib.h>

#include "table.h"
#include "test.h"

static const measure_column columns[] = { { "name", "settings", 0, 0 },
                                          { "total.mean", "mean", 2, 0 },
                                          { "bytes", "kB", 1, 1e3 },
                                          { "total", "mean / 99 %", 1, 0 } };

/* Makes two rows: one with all values, the other with a name alone. */
static cJSON *make_rows(void)
{
    cJSON *rows = cJSON_CreateArray(), *row = measure_new_row(rows);
    cJSON_AddStringToObject(row, "name", "a \"b\" <c>");
    cJSON *options = cJSON_AddObjectToObject(row, "options");
    cJSON_AddStringToObject(options, "h", "0.5");
    cJSON_AddStringToObject(options, "method", "merge");
    measure_add(cJSON_AddObjectToObject(row, "total"), { "mean", 1.25 }, { "percentile_99", 2.5 },
                { "psnr", INFINITY });
    cJSON_AddNumberToObject(row, "bytes", 2500);
    cJSON_AddTrueToObject(row, "front");
    cJSON_AddStringToObject(measure_new_row(rows), "name", "plain");
    return rows;
}

/* Returns the output of one writer, for free(). */
static char *written(void (*write)(FILE *f, const measure_table *t), const cJSON *rows)
{
    char *text = NULL;
    size_t bytes;
    FILE *f = open_memstream(&text, &bytes);
    write(f, &(measure_table){ .title = "Figures",
                               .rows = rows,
                               .columns = columns,
                               .count = 4,
                               .mark = "front",
                               .tips = { "version", "options" } });
    assert_int_equal(fclose(f), 0);
    return text;
}

static void markdown_is_aligned(void **state)
{
    (void)state;
    cJSON *rows = make_rows();
    char *text = written(measure_table_print, rows);
    assert_string_equal(text, "\nFigures\n\n"
                              "| settings    | mean |  kB | mean / 99 % |\n"
                              "|-------------|-----:|----:|-------------|\n"
                              "| a \"b\" <c> * | 1.25 | 2.5 | 1.2 / 2.5   |\n"
                              "| plain       |    - |   - | -           |\n");
    free(text);
    cJSON_Delete(rows);
}

static void html_is_escaped(void **state)
{
    (void)state;
    cJSON *rows = make_rows();
    char *text = written(measure_table_html, rows);
    assert_non_null(strstr(text, "<tr class=front><td title=\"--h 0.5 --method merge\">a "
                                 "&quot;b&quot; &lt;c&gt;<td>1.25<td>2.5<td>1.2 / 2.5\n"));
    assert_non_null(strstr(text, "<tr><td>plain<td>-<td>-<td>-\n"));
    free(text);
    cJSON_Delete(rows);
}

static void csv_quotes_texts_and_leaves_missing_fields_empty(void **state)
{
    static const char *const keys[] = { "name", "options", "total.mean", "total.psnr", "front" };
    char *text = NULL;
    size_t bytes;
    (void)state;
    cJSON *rows = make_rows();
    FILE *f = open_memstream(&text, &bytes);
    measure_table_csv(f, rows, keys, 5);
    assert_int_equal(fclose(f), 0);
    assert_string_equal(text, "name,options,total_mean,total_psnr,front\r\n"
                              "\"a \"\"b\"\" <c>\",\"--h 0.5 --method merge\",1.25,,1\r\n"
                              "\"plain\",,,,\r\n");
    free(text);
    cJSON_Delete(rows);
}

static void numbers_that_are_not_finite_become_null(void **state)
{
    (void)state;
    cJSON *rows = make_rows();
    const cJSON *total = cJSON_GetObjectItem(rows->child, "total");
    assert_true(cJSON_IsNull(cJSON_GetObjectItem(total, "psnr")));
    assert_true(measure_number(rows->child, "total.mean") == 1.25);
    assert_true(isnan(measure_number(rows->child, "total.psnr")));
    assert_true(isnan(measure_number(rows->child, "none.mean")));
    cJSON_Delete(rows);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(markdown_is_aligned),
        cmocka_unit_test(html_is_escaped),
        cmocka_unit_test(csv_quotes_texts_and_leaves_missing_fields_empty),
        cmocka_unit_test(numbers_that_are_not_finite_become_null),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
