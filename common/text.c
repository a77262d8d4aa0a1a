#include "text.h"

#include <math.h>
#include <pthread.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static pthread_once_t c_locale_once = PTHREAD_ONCE_INIT;
static locale_t c_locale; /* written once, never freed, since it is needed until the process ends */

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

locale_t trip_text_use_points(void)
{
    pthread_once(&c_locale_once, make_c_locale);
    return uselocale(c_locale);
}

const char *trip_text_from_double(double value, char *text)
{
    char *end = NULL;
    locale_t before = trip_text_use_points();
    for (int digits = 15; digits <= 17; digits++) {
        snprintf(text, 32, "%.*g", digits, value);
        if (to_double(text, &end) == value)
            break;
    }
    uselocale(before);
    return text;
}

/* Decodes the code point of `count` bytes from *p; `bits` are the bits of the first byte. Returns 0
 * unless all following bytes belong to it. */
static uint32_t decode(const unsigned char *p, uint32_t bits, unsigned count)
{
    for (unsigned i = 1; i < count; i++) {
        if ((p[i] & 0xc0) != 0x80) /* also stops at the final zero */
            return 0;
        bits = bits << 6 | (p[i] & 0x3f);
    }
    return bits;
}

static bool is_acted_on(uint32_t code)
{
    return code < 0x20 || (code >= 0x7f && code < 0xa0) || code == 0x61c ||
           (code >= 0x200e && code <= 0x200f) || (code >= 0x2028 && code <= 0x202e) ||
           (code >= 0x2066 && code <= 0x2069) || code == 0xfeff;
}

trip_text_character trip_text_next(const char *text)
{
    const unsigned char *p = (const unsigned char *)text;
    static const uint32_t min[5] = { 0, 0, 0x80, 0x800, 0x10000 };
    unsigned count = *p < 0x80             ? 1
                     : (*p & 0xe0) == 0xc0 ? 2
                     : (*p & 0xf0) == 0xe0 ? 3
                     : (*p & 0xf8) == 0xf0 ? 4
                                           : 0;
    uint32_t code = count == 1 ? *p : count > 0 ? decode(p, *p & (0x7fu >> count), count) : 0;
    bool surrogate = code >= 0xd800 && code < 0xe000;
    if (count == 0 || code < min[count] || surrogate || code > 0x10ffff)
        return (trip_text_character){ 0xfffd, 1, false };
    return (trip_text_character){ code, (uint8_t)count, !is_acted_on(code) };
}

unsigned trip_text_show(const char *text, trip_text_character c, char *shown)
{
    unsigned length = c.bytes;
    if (c.printable)
        memcpy(shown, text, length);
    else if (*text == '\n' || *text == '\t')
        length = (unsigned)sprintf(shown, "%s", *text == '\n' ? "\\n" : "\\t");
    else
        for (unsigned i = length = 0; i < c.bytes; i++)
            length += (unsigned)sprintf(shown + length, "\\x%02x", (unsigned char)text[i]);
    shown[length] = 0;
    return length;
}

void trip_text_write(FILE *f, const char *text)
{
    char shown[TRIP_TEXT_SHOWN_BYTES];
    while (*text) {
        trip_text_character c = trip_text_next(text);
        fwrite(shown, 1, trip_text_show(text, c, shown), f);
        text += c.bytes;
    }
}

static bool is_shown_unchanged(const char *text)
{
    for (trip_text_character c; *text; text += c.bytes)
        if (c = trip_text_next(text), !c.printable)
            return false;
    return true;
}

/* Writes a word in the form $'...' of bash, with escapes. */
static void write_escaped_word(FILE *f, const char *word)
{
    fputs("$'", f);
    for (trip_text_character c; *word; word += c.bytes) {
        char shown[TRIP_TEXT_SHOWN_BYTES];
        c = trip_text_next(word);
        if (*word == '\'' || *word == '\\')
            fputc('\\', f);
        fwrite(shown, 1, trip_text_show(word, c, shown), f);
    }
    fputc('\'', f);
}

void trip_text_write_word(FILE *f, const char *word)
{
    static const char plain[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789"
                                "_-+=.,/:@%";
    if (*word && strspn(word, plain) == strlen(word)) {
        fputs(word, f);
        return;
    }
    if (!is_shown_unchanged(word)) {
        write_escaped_word(f, word);
        return;
    }
    fputc('\'', f);
    for (; *word; word++)
        if (*word == '\'')
            fputs("'\\''", f);
        else
            fputc(*word, f);
    fputc('\'', f);
}

char *trip_text_word(const char *word)
{
    char *text = NULL;
    size_t bytes;
    FILE *f = open_memstream(&text, &bytes);
    if (!f)
        return NULL;
    trip_text_write_word(f, word);
    if (fclose(f) == 0)
        return text;
    free(text);
    return NULL;
}

/* Returns the small letter of an ASCII capital. Independent of the locale. */
static char small(char c)
{
    return c >= 'A' && c <= 'Z' ? (char)(c - 'A' + 'a') : c;
}

size_t trip_text_distance(const char *a, const char *b)
{
    enum { MAX = 64 };
    size_t row[MAX], m = strlen(a), n = strlen(b);
    if (m >= MAX || n >= MAX)
        return SIZE_MAX;
    for (size_t j = 0; j <= n; j++)
        row[j] = j;
    for (size_t i = 1; i <= m; i++) {
        size_t diagonal = row[0]; /* entry above and to the left */
        row[0] = i;
        for (size_t j = 1; j <= n; j++) {
            size_t above = row[j], changed = diagonal + (small(a[i - 1]) != small(b[j - 1]));
            size_t other = 1 + (above < row[j - 1] ? above : row[j - 1]);
            row[j] = changed < other ? changed : other;
            diagonal = above;
        }
    }
    return row[n];
}

void trip_text_nearest_try(trip_text_nearest *n, const char *name)
{
    const size_t length = strlen(n->text), limit = length < 4 ? 1 : length < 9 ? 2 : 3;
    const size_t distance = trip_text_distance(n->text, name);
    if (distance > limit || distance >= length || (n->name && distance >= n->distance))
        return;
    n->name = name;
    n->distance = distance;
}
