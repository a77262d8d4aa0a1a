#include "volume_info.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

#include "report.h"
#include "text.h"

static const struct {
    unsigned bytes;
    const char *name;
} scalars[TRIP_SCALARS] = {
    [TRIP_U8] = { 1, "uint8" },   [TRIP_I8] = { 1, "int8" },    [TRIP_U16] = { 2, "uint16" },
    [TRIP_I16] = { 2, "int16" },  [TRIP_U32] = { 4, "uint32" }, [TRIP_I32] = { 4, "int32" },
    [TRIP_U64] = { 8, "uint64" }, [TRIP_I64] = { 8, "int64" },  [TRIP_F16] = { 2, "half" },
    [TRIP_F32] = { 4, "float" },  [TRIP_F64] = { 8, "double" },
};

/* Type names of NRRD, of the Open SciVis file names, and of NumPy. */
static const struct {
    const char *name;
    trip_scalar type;
} aliases[] = {
    { "unsigned char", TRIP_U8 },
    { "uchar", TRIP_U8 },
    { "uint8_t", TRIP_U8 },
    { "byte", TRIP_U8 },
    { "u8", TRIP_U8 },
    { "signed char", TRIP_I8 },
    { "int8_t", TRIP_I8 },
    { "i8", TRIP_I8 },
    { "unsigned short", TRIP_U16 },
    { "unsigned short int", TRIP_U16 },
    { "ushort", TRIP_U16 },
    { "uint16_t", TRIP_U16 },
    { "u16", TRIP_U16 },
    { "short", TRIP_I16 },
    { "short int", TRIP_I16 },
    { "signed short", TRIP_I16 },
    { "signed short int", TRIP_I16 },
    { "int16_t", TRIP_I16 },
    { "i16", TRIP_I16 },
    { "unsigned int", TRIP_U32 },
    { "uint", TRIP_U32 },
    { "uint32_t", TRIP_U32 },
    { "u32", TRIP_U32 },
    { "int", TRIP_I32 },
    { "signed int", TRIP_I32 },
    { "int32_t", TRIP_I32 },
    { "i32", TRIP_I32 },
    { "unsigned long long", TRIP_U64 },
    { "unsigned long long int", TRIP_U64 },
    { "ulonglong", TRIP_U64 },
    { "uint64_t", TRIP_U64 },
    { "u64", TRIP_U64 },
    { "long long", TRIP_I64 },
    { "long long int", TRIP_I64 },
    { "signed long long", TRIP_I64 },
    { "signed long long int", TRIP_I64 },
    { "longlong", TRIP_I64 },
    { "int64_t", TRIP_I64 },
    { "i64", TRIP_I64 },
    { "float16", TRIP_F16 },
    { "f16", TRIP_F16 },
    { "float32", TRIP_F32 },
    { "f32", TRIP_F32 },
    { "float64", TRIP_F64 },
    { "f64", TRIP_F64 },
};

unsigned trip_scalar_bytes(trip_scalar type)
{
    return scalars[type].bytes;
}

trip_scalar trip_scalar_unsigned(trip_scalar type)
{
    switch (type) {
    case TRIP_I8:
        return TRIP_U8;
    case TRIP_I16:
        return TRIP_U16;
    case TRIP_I32:
        return TRIP_U32;
    case TRIP_I64:
        return TRIP_U64;
    default:
        return type;
    }
}

double trip_scalar_without_sign(trip_scalar type, double value)
{
    return value < 0 ? value + ldexp(1, 8 * (int)trip_scalar_bytes(type)) : value;
}

const char *trip_scalar_name(trip_scalar type)
{
    return scalars[type].name;
}

int trip_scalar_from_name(const char *name)
{
    for (int i = 0; i < TRIP_SCALARS; i++)
        if (strcasecmp(name, scalars[i].name) == 0)
            return i;
    for (size_t i = 0; i < sizeof aliases / sizeof aliases[0]; i++)
        if (strcasecmp(name, aliases[i].name) == 0)
            return (int)aliases[i].type;
    return -1;
}

static inline uint8_t swap_8(uint8_t v)
{
    return v;
}

static inline uint16_t swap_16(uint16_t v)
{
    return __builtin_bswap16(v);
}

static inline uint32_t swap_32(uint32_t v)
{
    return __builtin_bswap32(v);
}

static inline uint64_t swap_64(uint64_t v)
{
    return __builtin_bswap64(v);
}

/* Converts an IEEE half to a single, exactly. A multiplication rebiases the exponent, which also
 * normalises subnormals. */
static inline float half_to_float(uint16_t half)
{
    uint32_t magnitude = half & 0x7fffu, bits = magnitude << 13;
    float value;
    memcpy(&value, &bits, sizeof value);
    value *= 0x1p112f;
    memcpy(&bits, &value, sizeof bits);
    if (magnitude >= 0x7c00u) /* infinity or NaN */
        bits = magnitude << 13 | 0x7f800000u;
    bits |= (uint32_t)(half & 0x8000u) << 16;
    memcpy(&value, &bits, sizeof value);
    return value;
}

/* Decodes one row of values of one type. The branches are outside the loops, so that each loop
 * vectorises. memcpy() is needed because rows of a file may be unaligned. */
#define DEFINE_DECODE(NAME, TYPE, BITS, VALUE)                                                     \
    static inline TYPE load_##NAME(const unsigned char *from, bool swap)                           \
    {                                                                                              \
        uint##BITS##_t word;                                                                       \
        memcpy(&word, from, sizeof word);                                                          \
        if (swap)                                                                                  \
            word = swap_##BITS(word);                                                              \
        TYPE v;                                                                                    \
        memcpy(&v, &word, sizeof v);                                                               \
        return v;                                                                                  \
    }                                                                                              \
    static inline void row_##NAME(const unsigned char *from, size_t count, bool swap, bool scaled, \
                                  double slope, double inter, float *to)                           \
    {                                                                                              \
        if (scaled)                                                                                \
            for (size_t i = 0; i < count; i++)                                                     \
                to[i] = (float)(slope * (double)VALUE(load_##NAME(from + i * (BITS / 8), swap)) +  \
                                inter);                                                            \
        else                                                                                       \
            for (size_t i = 0; i < count; i++)                                                     \
                to[i] = (float)VALUE(load_##NAME(from + i * (BITS / 8), swap));                    \
    }                                                                                              \
    static void decode_##NAME(const unsigned char *from, size_t count, bool swap, double slope,    \
                              double inter, float *to)                                             \
    {                                                                                              \
        bool scaled = slope != 1 || inter != 0;                                                    \
        if (swap && scaled)                                                                        \
            row_##NAME(from, count, true, true, slope, inter, to);                                 \
        else if (swap)                                                                             \
            row_##NAME(from, count, true, false, slope, inter, to);                                \
        else if (scaled)                                                                           \
            row_##NAME(from, count, false, true, slope, inter, to);                                \
        else                                                                                       \
            row_##NAME(from, count, false, false, slope, inter, to);                               \
    }

DEFINE_DECODE(u8, uint8_t, 8, )
DEFINE_DECODE(i8, int8_t, 8, )
DEFINE_DECODE(u16, uint16_t, 16, )
DEFINE_DECODE(i16, int16_t, 16, )
DEFINE_DECODE(u32, uint32_t, 32, )
DEFINE_DECODE(i32, int32_t, 32, )
DEFINE_DECODE(u64, uint64_t, 64, )
DEFINE_DECODE(i64, int64_t, 64, )
DEFINE_DECODE(f16, uint16_t, 16, half_to_float)
DEFINE_DECODE(f32, float, 32, )
DEFINE_DECODE(f64, double, 64, )

void trip_scalar_decode(trip_scalar type, bool swap, double slope, double inter, const void *stored,
                        size_t count, float *values)
{
    static void (*const decoders[TRIP_SCALARS])(const unsigned char *, size_t, bool, double, double,
                                                float *) = {
        [TRIP_U8] = decode_u8,   [TRIP_I8] = decode_i8,   [TRIP_U16] = decode_u16,
        [TRIP_I16] = decode_i16, [TRIP_U32] = decode_u32, [TRIP_I32] = decode_i32,
        [TRIP_U64] = decode_u64, [TRIP_I64] = decode_i64, [TRIP_F16] = decode_f16,
        [TRIP_F32] = decode_f32, [TRIP_F64] = decode_f64,
    };
    decoders[type](stored, count, swap, slope, inter, values);
}

float trip_scalar_luma(trip_scalar type, bool swap, const void *stored)
{
    float c[3];
    trip_scalar_decode(type, swap, 1, 0, stored, 3, c);
    return (float)(0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2]);
}

int trip_volume_check_dims(const char *path, const trip_volume_info *info)
{
    int64_t bytes = trip_scalar_bytes(info->type);
    bool possible = true;
    for (int a = 0; a < 3; a++)
        possible =
            possible && info->dims[a] >= 1 && !__builtin_mul_overflow(bytes, info->dims[a], &bytes);
    if (possible)
        return 0;
    return trip_fail(TRIP_ERROR, "read", path,
                     "has an impossible size, %" PRId64 " x %" PRId64 " x %" PRId64, info->dims[0],
                     info->dims[1], info->dims[2]);
}

int trip_volume_check_axes(const char *path, const trip_volume_info *info)
{
    for (int a = 0; a < 3; a++)
        if (info->dims[a] > TRIP_VOLUME_AXIS_MAX)
            return trip_fail(TRIP_ERROR, "read", path,
                             "has more than %" PRId64 " voxels along an axis",
                             TRIP_VOLUME_AXIS_MAX);
    return 0;
}

bool trip_entry_exists(char why[TRIP_ENTRY_WHY_BYTES], const char *what, int64_t index,
                       int64_t count)
{
    if (index >= 0 && index < count)
        return true;
    if (count == 1)
        snprintf(why, TRIP_ENTRY_WHY_BYTES, "has one %s; --%s %" PRId64 " does not exist", what,
                 what, index);
    else
        snprintf(why, TRIP_ENTRY_WHY_BYTES,
                 "has %" PRId64 " %ss, from 0 to %" PRId64 "; --%s %" PRId64 " does not exist",
                 count, what, count - 1, what, index);
    return false;
}

int trip_volume_check_entry(const char *path, const char *what, int index, int64_t count)
{
    char why[TRIP_ENTRY_WHY_BYTES];
    return trip_entry_exists(why, what, index, count)
               ? 0
               : trip_fail(TRIP_USAGE, "read", path, "%s", why);
}

void trip_append_note(char *note, size_t room, const char *text)
{
    const size_t used = strlen(note);
    if (*text)
        snprintf(note + used, room - used, "%s%s", used ? "; " : "", text);
}

void trip_entry_note(char *note, size_t room, const char *what, int64_t index, int64_t count,
                     const char *detail)
{
    char text[256] = "";
    if (count > 1)
        snprintf(text, sizeof text,
                 "%s %" PRId64 " of %" PRId64 "%s is read (--%s N reads another, from 0)", what,
                 index, count, detail, what);
    trip_append_note(note, room, text);
}

bool trip_fills_parse(const char *text, trip_fills *fills)
{
    *fills = (trip_fills){ 0 };
    if (!strcmp(text, "none"))
        return true;
    fills->count = 1;
    return trip_text_to_double(text, &fills->values[0]) && isfinite(fills->values[0]);
}
