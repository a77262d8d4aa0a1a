#include "quality_choice.h"

#include <fcntl.h>
#include <inttypes.h>
#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "new_file.h"
#include "report.h"
#include "settings.h"
#include "text.h"

static const char first_line[] = "triptych-quality 1";
/* The longest file of TRIP_CHOICES_MAX lines has less. */
enum { FILE_BYTES_MAX = 32768, RAYS_MAX = 64, LOOK_DIGITS = 16 };
#define LOD_MAX 1000.0

int trip_choice_step(double voxel_px)
{
    const double step = floor(2 * log2(voxel_px));
    return step >= TRIP_CHOICE_STEP_MAX   ? TRIP_CHOICE_STEP_MAX
           : step >= TRIP_CHOICE_STEP_MIN ? (int)step
                                          : TRIP_CHOICE_STEP_MIN;
}

double trip_choice_step_px(int step)
{
    return exp2(0.5 * step);
}

static bool is_key(trip_choice_key a, trip_choice_key b)
{
    return a.data == b.data && a.look == b.look;
}

bool trip_choices_find(const trip_choices *all, trip_choice_key key, trip_choice *out)
{
    for (unsigned i = all->count; i-- > 0;)
        if (is_key(all->key[i], key)) {
            *out = all->choice[i];
            return true;
        }
    return false;
}

void trip_choices_add(trip_choices *all, trip_choice_key key, const trip_choice *choice)
{
    if (all->count == TRIP_CHOICES_MAX) {
        all->count--;
        memmove(all->key, all->key + 1, all->count * sizeof *all->key);
        memmove(all->choice, all->choice + 1, all->count * sizeof *all->choice);
    }
    all->key[all->count] = key;
    all->choice[all->count++] = *choice;
}

/* ---- the file ---- */

static bool make_path(const char *folder, uint64_t data, char path[PATH_MAX])
{
    return snprintf(path, PATH_MAX, "%s/%016" PRIx64 "%016" PRIx64 ".quality", folder, data, data) <
           PATH_MAX;
}

/* Returns the file's text for free(), or NULL if there is no such file. */
static char *read_text(const char *path)
{
    struct stat st;
    char *text = NULL;
    const int fd = open(path, O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
    const bool is_small =
        fd >= 0 && fstat(fd, &st) == 0 && S_ISREG(st.st_mode) && st.st_size < FILE_BYTES_MAX;
    if (is_small)
        text = malloc(FILE_BYTES_MAX);
    const ssize_t bytes = text ? read(fd, text, FILE_BYTES_MAX - 1) : -1;
    if (fd >= 0)
        close(fd);
    if (bytes < 0) {
        free(text);
        return NULL;
    }
    text[bytes] = 0;
    return text;
}

static bool parse_look(const char *word, uint64_t *look)
{
    if (strlen(word) != LOOK_DIGITS || strspn(word, "0123456789abcdef") != LOOK_DIGITS)
        return false;
    *look = strtoull(word, NULL, 16);
    return true;
}

static bool parse_integer(const char *word, int lo, int hi, int *out)
{
    double number;
    if (!trip_text_to_double(word, &number) || !(number >= lo && number <= hi) ||
        number != floor(number))
        return false;
    *out = (int)number;
    return true;
}

static bool parse_number(const char *word, double lo, double hi, double *out)
{
    return trip_text_to_double(word, out) && *out >= lo && *out <= hi;
}

static bool parse_line(char *line, trip_choice_key *key, trip_choice *choice)
{
    char *words[5], *rest = line;
    int count = 0;
    for (char *word; (word = strtok_r(rest, " ", &rest)); count++) {
        if (count == 5)
            return false;
        words[count] = word;
    }
    return count == 5 && parse_look(words[0], &key->look) &&
           parse_integer(words[1], 0, TRIP_SHEET_SAMPLES_MAX, &choice->samples_per_sheet) &&
           parse_integer(words[2], 1, RAYS_MAX, &choice->rays) &&
           parse_number(words[3], 0, LOD_MAX, &choice->lod_px) &&
           parse_number(words[4], 0, 255, &choice->error);
}

/* Returns false if the text has a fault. */
static bool parse_text(char *text, uint64_t data, trip_choices *out)
{
    char *rest = text, *line = strsep(&rest, "\n");
    if (!line || strcmp(line, first_line) != 0)
        return false;
    while ((line = strsep(&rest, "\n")) && (*line || rest)) {
        trip_choice_key key = { .data = data };
        trip_choice choice;
        if (!rest || out->count == TRIP_CHOICES_MAX || !parse_line(line, &key, &choice))
            return false;
        trip_choices_add(out, key, &choice);
    }
    return true;
}

/* Returns the file's choices for free(), or NULL. */
static trip_choices *read_file(const char *folder, uint64_t data)
{
    char path[PATH_MAX];
    char *text = make_path(folder, data, path) ? read_text(path) : NULL;
    trip_choices *all = text ? calloc(1, sizeof *all) : NULL;
    if (all && !parse_text(text, data, all)) {
        free(all);
        all = NULL;
    }
    free(text);
    return all;
}

void trip_choices_read(trip_choices *all, const char *folder, uint64_t data)
{
    trip_choices *stored = read_file(folder, data);
    trip_choice known;
    for (unsigned i = 0; stored && i < stored->count; i++)
        if (!trip_choices_find(all, stored->key[i], &known))
            trip_choices_add(all, stored->key[i], &stored->choice[i]);
    free(stored);
}

static char *text_of(const trip_choices *all)
{
    char *text = NULL, lod[32], error[32];
    size_t bytes;
    FILE *f = open_memstream(&text, &bytes);
    if (!f)
        return NULL;
    fprintf(f, "%s\n", first_line);
    for (unsigned i = 0; i < all->count; i++) {
        const trip_choice *c = &all->choice[i];
        fprintf(f, "%016" PRIx64 " %d %d %s %s\n", all->key[i].look, c->samples_per_sheet, c->rays,
                trip_text_from_double(c->lod_px, lod), trip_text_from_double(c->error, error));
    }
    if (fclose(f) == 0)
        return text;
    free(text);
    return NULL;
}

void trip_choices_write(const char *folder, trip_choice_key key, const trip_choice *choice)
{
    char path[PATH_MAX];
    trip_held_report held;
    trip_choices *all = read_file(folder, key.data);
    if (!all)
        all = calloc(1, sizeof *all);
    if (all)
        trip_choices_add(all, key, choice);
    char *text = all && make_path(folder, key.data, path) ? text_of(all) : NULL;
    trip_report_hold(&held); /* a folder that cannot be written keeps nothing */
    if (text)
        trip_new_file_of_text("quality", path, text);
    trip_report_release(&held);
    free(text);
    free(all);
}
