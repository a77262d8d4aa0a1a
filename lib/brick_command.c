#include "brick_command.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "file_path.h"
#include "text.h"

static void write_word(FILE *f, const char *word)
{
    fputc(' ', f);
    trip_text_write_word(f, word);
}

static void write_volume(FILE *f, const char *volume)
{
    if (*volume == '-')
        fputs(" --", f);
    write_word(f, volume);
}

/* Returns whether a volume exists. A pattern of slices exists if its folder does. */
static bool exists(const char *volume)
{
    char *folder = strpbrk(volume, "*?[%") ? trip_path_beside(volume, ".") : NULL;
    bool found = access(volume, F_OK) == 0 || (folder && access(folder, F_OK) == 0);
    free(folder);
    return found;
}

/* Writes the path of the source: where it lay when the data set was made, else beside the data set,
 * else in the current folder. */
static void write_source(FILE *f, const char *path, const trip_dataset_metadata *text)
{
    const char *source = trip_dataset_metadata_source(text);
    const char *recorded = trip_dataset_metadata_source_path(text);
    char *there = trip_path_beside(path, recorded ? recorded : source);
    char *beside = trip_path_beside(path, source);
    write_volume(f, there && exists(there) ? there : beside && exists(beside) ? beside : source);
    free(beside);
    free(there);
}

char *brick_command(const trip_dataset_metadata *text, const char *path, const char *volume,
                    const char *tf, const double *range)
{
    char *command = NULL, *option = NULL, lo[32], hi[32];
    size_t bytes;
    const char *source = trip_dataset_metadata_source(text), *how;
    FILE *f = source ? open_memstream(&command, &bytes) : NULL;
    if (!f)
        return NULL;
    fputs("triptych brick", f);
    for (int i = 0; (how = trip_dataset_metadata_source_option(text, i)); i++)
        write_word(f, how);
    write_word(f, "--tf");
    write_word(f, tf ? tf : "auto");
    if (range && asprintf(&option, "--range=%s:%s", trip_text_from_double(range[0], lo),
                          trip_text_from_double(range[1], hi)) >= 0) {
        write_word(f, option);
        free(option);
    }
    if (volume) {
        write_volume(f, volume); /* without -o: the data set is then named after the volume */
    } else {
        fputs(" --force -o", f);
        write_word(f, path);
        write_source(f, path, text);
    }
    if (fclose(f) == 0)
        return command;
    free(command);
    return NULL;
}
