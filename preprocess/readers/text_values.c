#include "text_values.h"

#include <ctype.h>
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "text.h"

static bool is_separator(char c)
{
    return isspace((unsigned char)c) || c == ',';
}

static bool parse_signed(const char *word, int bits, int64_t *out)
{
    char *end;
    errno = 0;
    *out = strtoll(word, &end, 10);
    const int64_t most = INT64_MAX >> (64 - bits);
    return end != word && !*end && !errno && *out <= most && *out >= -most - 1;
}

static bool parse_unsigned(const char *word, int bits, uint64_t *out)
{
    char *end;
    errno = 0;
    *out = strtoull(word, &end, 10);
    return word[0] != '-' && end != word && !*end && !errno && *out <= UINT64_MAX >> (64 - bits);
}

static bool parse_float(const char *word, double *out)
{
    const bool minus = word[0] == '-';
    const char *name = word + (minus || word[0] == '+');
    if (strcasecmp(name, "nan") == 0)
        *out = NAN;
    else if (strcasecmp(name, "inf") == 0 || strcasecmp(name, "infinity") == 0)
        *out = minus ? -INFINITY : INFINITY;
    else
        return trip_text_to_double(word, out);
    return true;
}

/* Converts the word to the bytes of a value. */
static bool convert_number(trip_text_decoder *d)
{
    const unsigned bytes = trip_scalar_bytes(d->type);
    const int bits = 8 * (int)bytes;
    int64_t whole = 0;
    double real = 0;
    bool good;
    switch (d->type) {
    case TRIP_F32:
    case TRIP_F64: {
        good = parse_float(d->word, &real);
        const float single = (float)real;
        memcpy(d->value, d->type == TRIP_F32 ? (const void *)&single : (const void *)&real, bytes);
        break;
    }
    case TRIP_I8:
    case TRIP_I16:
    case TRIP_I32:
    case TRIP_I64:
        good = parse_signed(d->word, bits, &whole);
        break;
    case TRIP_U8:
    case TRIP_U16:
    case TRIP_U32:
    case TRIP_U64:
        good = parse_unsigned(d->word, bits, (uint64_t *)&whole);
        break;
    default:
        good = false;
    }
    const int8_t one = (int8_t)whole;
    const int16_t two = (int16_t)whole;
    const int32_t four = (int32_t)whole;
    if (d->type < TRIP_F16)
        memcpy(d->value,
               bytes == 1   ? (const void *)&one
               : bytes == 2 ? (const void *)&two
               : bytes == 4 ? (const void *)&four
                            : (const void *)&whole,
               bytes);
    d->value_bytes = bytes;
    return good;
}

static bool convert_hex(trip_text_decoder *d)
{
    d->value[0] = (unsigned char)strtoul(d->word, NULL, 16);
    d->value_bytes = 1;
    return true;
}

/* Ends the word, which then becomes a value. */
static bool end_word(trip_text_decoder *d)
{
    d->word[d->length] = '\0';
    d->given = d->length = 0;
    return d->form == TRIP_TEXT_HEX ? convert_hex(d) : convert_number(d);
}

/* Takes one character of the text. Returns false at text that is no value. */
static bool take(trip_text_decoder *d, char c)
{
    const bool separator = is_separator(c), hex = d->form == TRIP_TEXT_HEX;
    if (separator)
        return hex || d->length == 0 || end_word(d);
    if (d->length + 1 >= sizeof d->word || (hex && !isxdigit((unsigned char)c))) {
        d->word[0] = c;
        d->word[1] = '\0';
        return false;
    }
    d->word[d->length++] = c;
    return !hex || d->length < 2 || end_word(d);
}

bool trip_text_decode(trip_text_decoder *d, const char *from, size_t count, size_t *used, char *to,
                      size_t bytes, size_t *made)
{
    *used = *made = 0;
    for (;;) {
        const size_t left = d->value_bytes - d->given;
        const size_t n = left < bytes - *made ? left : bytes - *made;
        memcpy(to + *made, d->value + d->given, n);
        d->given += n;
        *made += n;
        if (*made == bytes || *used == count)
            return true;
        if (!take(d, from[(*used)++]))
            return false;
    }
}

uint64_t trip_text_min_bytes(const trip_text_decoder *d, uint64_t bytes)
{
    if (d->form == TRIP_TEXT_HEX)
        return bytes > UINT64_MAX / 2 ? UINT64_MAX : 2 * bytes;
    const uint64_t values = bytes / trip_scalar_bytes(d->type);
    return values ? 2 * values - 1 : 0;
}
