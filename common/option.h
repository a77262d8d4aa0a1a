/* Options as data. A row describes one member of a struct: its name, type, range, default and help.
 * Command lines, help texts, saved states and range checks of the library all read the same rows.
 *
 * A member that is all zero bytes is not set. TRIP_OPTION_ZERO stands for the number 0 in members
 * where 0 selects another default.
 *
 * Functions that return int return 0, or TRIP_USAGE after reporting a bad value, naming the
 * option. Any thread. */
#ifndef TRIP_OPTION_H
#define TRIP_OPTION_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define TRIP_OPTION_ZERO (-1.0)
#define TRIP_OPTION_AUTOMATIC (-2.0)

typedef enum trip_option_type {
    TRIP_OPTION_FLAG,    /* int; without an argument; 1 if given */
    TRIP_OPTION_TEXT,    /* const char *; the argument itself */
    TRIP_OPTION_NUMBER,  /* double, lo to hi */
    TRIP_OPTION_ABOVE,   /* double, above lo up to hi */
    TRIP_OPTION_BELOW,   /* double, lo to below hi; 0 is stored as TRIP_OPTION_ZERO */
    TRIP_OPTION_PART,    /* double, lo to hi; 0 is stored as TRIP_OPTION_ZERO */
    TRIP_OPTION_INTEGER, /* int, lo to hi */
    TRIP_OPTION_AUTO,    /* int, lo to hi, or "auto", stored as -1 */
    /* double, lo to hi; 0 is stored as TRIP_OPTION_ZERO, "auto" as TRIP_OPTION_AUTOMATIC */
    TRIP_OPTION_AUTO_NUMBER,
    TRIP_OPTION_BYTES,    /* double; a size such as 256M */
    TRIP_OPTION_BYTES_64, /* uint64_t; a size such as 256M */
    TRIP_OPTION_CHOICE,   /* int; choices[i] is stored as first + i */
    TRIP_OPTION_POINT,    /* double[3]; three numbers */
    TRIP_OPTION_RANGE,    /* double[2]; LO:HI, both lo to hi */
    TRIP_OPTION_CUSTOM,   /* int that is not 0 if set; `read`, `print` and `same` know the rest */
} trip_option_type;

typedef struct trip_option trip_option;
struct trip_option {
    const char *name;     /* without "--" */
    const char *arg;      /* name of the argument in the help, or NULL */
    const char *help;     /* a sentence without its full stop */
    const char *standard; /* the default, in words, or NULL */
    const char *limits;   /* the end of the help, such as "requires --level", or NULL */
    const char *alias;    /* an older name, which the help does not show, or NULL */
    const char *brief;    /* for the short help of a command with many options, or NULL */
    char short_name;      /* a letter, or 0 */
    int group;            /* heading in the help */
    bool measured;        /* `triptych accuracy` measures it, and --error selects it */
    trip_option_type type;
    size_t at; /* offset of the member */
    double lo, hi;
    const char *const *choices; /* terminated by NULL */
    int first;
    int (*read)(const trip_option *row, const char *text, void *base);
    void (*print)(const void *base, char *text, size_t bytes);
    bool (*same)(const void *a, const void *b);
};

/* A table and the struct that it describes. */
typedef struct trip_option_table {
    const trip_option *rows;
    size_t count; /* at most 64 */
} trip_option_table;

enum { TRIP_OPTION_TEXT_BYTES = 1024 };

/* Reads a value into the struct at `base`. Sets *row to the row that took it, if `row` is not NULL.
 * Several rows may have the same name. Then the row with this choice takes the value. Values
 * joined by commas may belong to different rows. Returns 1 if no row has the name. */
int trip_option_read(const trip_option_table *table, const char *name, const char *text, void *base,
                     uint64_t *given);
bool trip_option_is_set(const trip_option *row, const void *base);
bool trip_option_same(const trip_option *row, const void *a, const void *b);
void trip_option_copy(const trip_option *row, void *to, const void *from);
/* Writes the value as trip_option_read() takes it, exact to the last bit; "" for a flag. */
void trip_option_print(const trip_option *row, const void *base, char text[TRIP_OPTION_TEXT_BYTES]);
/* Checks a value that a program set. Unset values are right. */
int trip_option_check(const trip_option *row, const void *base);
/* Writes the help: sentence, range, default, limits. */
void trip_option_help(const trip_option *row, char text[TRIP_OPTION_TEXT_BYTES]);

/* ---- kinds of values ---- */

/* Reports "OPTION: WHY" and returns TRIP_USAGE. */
int trip_option_fail(const char *option, const char *why);
int trip_option_number(const char *option, const char *text, double lo, double hi, double *out);
int trip_option_integer(const char *option, const char *text, int lo, int hi, int *out);
/* Parses `min` to `max` numbers joined by commas, and sets *count to their number. */
int trip_option_numbers(const char *option, const char *text, int min, int max, double *out,
                        int *count);
/* Parses "LO:HI"; LO must be less than HI. */
int trip_option_range(const char *option, const char *text, double *lo, double *hi);
/* Parses a size with a binary suffix, for example "256M". */
int trip_option_bytes(const char *option, const char *text, uint64_t *out);
/* Parses a picture size, 1 to 65536 pixels a side, for example "1024x768", or "512" for a square.
 */
int trip_option_size(const char *option, const char *text, int *width, int *height);
/* Finds the index of `text` in a NULL-terminated list of names. */
int trip_option_choice(const char *option, const char *text, const char *const *names, int *out);

#ifdef __cplusplus
}
#endif

#endif
