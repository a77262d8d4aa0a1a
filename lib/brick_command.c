#include "brick_command.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

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

/* Writes the path of the source: beside the data set, if it is there and not at the recorded path.
 * Otherwise writes the recorded path. */
static void write_source(FILE *f, const char *path, const char *source)
{
    char *beside = NULL;
    size_t length = strlen(path);
    while (length > 1 && path[length - 1] == '/')
        length--;
    while (length > 0 && path[length - 1] != '/')
        length--;
    bool near = access(source, F_OK) != 0 && length > 0 &&
                asprintf(&beside, "%.*s%s", (int)length, path, source) >= 0 &&
                access(beside, F_OK) == 0;
    write_volume(f, near ? beside : source);
    free(beside);
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
        write_source(f, path, source);
    }
    if (fclose(f) == 0)
        return command;
    free(command);
    return NULL;
}
