#include "text.h"

#include <locale.h>
#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static pthread_once_t c_locale_once = PTHREAD_ONCE_INIT;
static locale_t c_locale; /* written once, never freed: needed until the process ends */

static void make_c_locale(void)
{
    c_locale = newlocale(LC_ALL_MASK, "C", (locale_t)0);
}

static double to_double(const char *text, char **end)
{
    pthread_once(&c_locale_once, make_c_locale);
    return c_locale ? strtod_l(text, end, c_locale) : strtod(text, end);
}

bool trip_text_to_double(const char *text, double *out)
{
    size_t length = strlen(text);
    if (length == 0 || strspn(text, "0123456789+-.eE") != length)
        return false;
    char *end = NULL;
    double value = to_double(text, &end);
    if (end != text + length || !isfinite(value))
        return false;
    *out = value;
    return true;
}

const char *trip_text_from_double(double value, char *text)
{
    char *end = NULL;
    pthread_once(&c_locale_once, make_c_locale);
    locale_t before = uselocale(c_locale);
    for (int digits = 15; digits <= 17; digits++) {
        snprintf(text, 32, "%.*g", digits, value);
        if (to_double(text, &end) == value)
            break;
    }
    uselocale(before);
    return text;
}
