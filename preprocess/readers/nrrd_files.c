#include <ctype.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "nrrd_header.h"
#include "report.h"

#define FILES_MAX 65536

bool trip_nrrd_is_list(const char *data_file)
{
    return data_file && strncmp(data_file, "LIST", 4) == 0 &&
           (!data_file[4] || isspace((unsigned char)data_file[4]));
}

static int add_file(const trip_nrrd_parser *p, trip_nrrd_header *h, const char *name)
{
    if (h->file_count == FILES_MAX)
        return trip_nrrd_fail(p, p->lines[TRIP_NRRD_DATA_FILE], "more than %d data files",
                              FILES_MAX);
    if ((h->file_count & (h->file_count - 1)) == 0) { /* the array is full at each power of two */
        size_t room = h->file_count ? 2 * h->file_count : 1;
        char **files = realloc(h->files, room * sizeof *files);
        if (!files)
            return trip_nrrd_fail(p, 0, "no memory for the names of its data files");
        h->files = files;
    }
    if (!(h->files[h->file_count] = strdup(name)))
        return trip_nrrd_fail(p, 0, "no memory for the names of its data files");
    h->file_count++;
    return 0;
}

static int parse_list(trip_nrrd_parser *p, trip_nrrd_header *h, bool ends)
{
    char *line;
    int status = 0;
    while (status == 0 && (line = trip_nrrd_next_line(p)))
        if (*(line = trip_nrrd_trim(line)))
            status = add_file(p, h, line);
    if (status == 0 && !ends)
        return trip_nrrd_fail(p, p->line, "the list of data files does not end within %zu bytes",
                              TRIP_NRRD_HEADER_BYTES_MAX);
    if (status == 0 && h->file_count == 0)
        return trip_nrrd_fail(p, p->lines[TRIP_NRRD_DATA_FILE], "the list of data files is empty");
    return status;
}

/* Splits "abc%03d.raw" into "abc", width 3 padded with '0', and ".raw". Accepts only a single %d,
 * because the pattern comes from an untrusted file. */
static bool split_pattern(char *pattern, int *width, bool *zeros, char **tail)
{
    char *at = strchr(pattern, '%');
    if (!at)
        return false;
    *at++ = '\0';
    *zeros = *at == '0';
    int64_t w = 0;
    while (isdigit((unsigned char)*at) && w < 100)
        w = 10 * w + (*at++ - '0');
    if (*at != 'd' || w > 20 || strchr(at, '%'))
        return false;
    *width = (int)w;
    *tail = at + 1;
    return true;
}

static bool has_32_bits(int64_t n)
{
    return n >= -INT32_MAX && n <= INT32_MAX;
}

/* Parses "PATTERN first last step [axes in each file]". */
static int parse_pattern(const trip_nrrd_parser *p, trip_nrrd_header *h)
{
    char *text = p->values[TRIP_NRRD_DATA_FILE], *pattern = trip_nrrd_next_word(&text), *tail,
         name[4096];
    int64_t from, to, step, each = p->axes - 1;
    int width, status = 0;
    bool zeros;
    if (!split_pattern(pattern, &width, &zeros, &tail) || !trip_nrrd_parse_integer(&text, &from) ||
        !trip_nrrd_parse_integer(&text, &to) || !trip_nrrd_parse_integer(&text, &step) ||
        step == 0 || !has_32_bits(from) || !has_32_bits(to) || !has_32_bits(step) ||
        (*trip_nrrd_trim(text) && !trip_nrrd_parse_integer(&text, &each)) || *text)
        return trip_nrrd_fail(p, p->lines[TRIP_NRRD_DATA_FILE],
                              "\"data file\" with a %% must be \"name%%03d.raw first last step\"");
    for (int64_t i = from; status == 0 && (step > 0 ? i <= to : i >= to); i += step) {
        int n = zeros ? snprintf(name, sizeof name, "%s%0*" PRId64 "%s", pattern, width, i, tail)
                      : snprintf(name, sizeof name, "%s%*" PRId64 "%s", pattern, width, i, tail);
        if (n >= (int)sizeof name)
            return trip_nrrd_fail(p, p->lines[TRIP_NRRD_DATA_FILE],
                                  "a name of a data file is longer than 4095 bytes");
        status = add_file(p, h, name);
    }
    if (status == 0 && h->file_count == 0)
        return trip_nrrd_fail(p, p->lines[TRIP_NRRD_DATA_FILE],
                              "\"data file\" names no file: check first, last and step");
    return status;
}

static int parse_data_file(trip_nrrd_parser *p, trip_nrrd_header *h, bool ends)
{
    char *text = p->values[TRIP_NRRD_DATA_FILE];
    if (!text)
        return 0;
    if (!*text)
        return trip_nrrd_fail(p, p->lines[TRIP_NRRD_DATA_FILE], "\"data file\" is empty");
    if (trip_nrrd_is_list(text))
        return parse_list(p, h, ends);
    return strchr(text, '%') ? parse_pattern(p, h) : add_file(p, h, text);
}

/* Checks that all files can hold equally many values. */
static int check_sizes(const trip_nrrd_parser *p, const trip_nrrd_header *h)
{
    int64_t values = 1;
    for (int axis = 0; axis < h->axes; axis++)
        values *= h->sizes[axis];
    if (h->file_count > 1 && values % (int64_t)h->file_count != 0)
        return trip_nrrd_fail(p, p->lines[TRIP_NRRD_DATA_FILE],
                              "%" PRId64 " values cannot be divided equally among %zu data files",
                              values, h->file_count);
    return 0;
}

int trip_nrrd_parse_files(trip_nrrd_parser *p, trip_nrrd_header *h, bool ends)
{
    int status = parse_data_file(p, h, ends);
    return status < 0 ? status : check_sizes(p, h);
}
