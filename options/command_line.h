/* Command lines from tables of options (common/option.h), by argp. Errors have one line and exit
 * status 2. --help and -h print the common options, and --help=all every option. For other
 * programs,
 * --help=names prints names and arguments (completion.bash), and --help=man a man page's list. Main
 * thread only. */
#ifndef TRIP_COMMAND_LINE_H
#define TRIP_COMMAND_LINE_H

#include "option.h"

/* A table, and the struct that a command line fills. */
typedef struct option_set {
    const trip_option_table *table;
    void *base;
    uint64_t without; /* bits of rows that the command does not have */
    uint64_t given;   /* bits of rows that were given */
} option_set;

enum { OPTION_SETS_MAX = 10 };

typedef struct command_line {
    const char *args_doc, *doc;
    option_set *sets;
    int set_count;
    int (*argument)(void *user, char *argument); /* NULL if the command takes only options */
    int (*end)(void *user);                      /* checks combinations; may be NULL */
    void *user;
} command_line;

/* Parses argv, which starts with the name of the command. --help prints the help and exits. Returns
 * 0, or TRIP_USAGE after reporting an error. */
int command_line_parse(const command_line *c, int argc, char **argv);

/* Returns whether --quiet was given. Every command has it. Notes that the main thread makes are
 * then discarded; other threads and the sinks of libraries check command_line_is_note(). */
bool command_line_quiet(void);
/* Returns whether a line of a report is a note, not a warning or a failure. */
bool command_line_is_note(const char *line);

/* Sets the function that names a command with an option, or returns NULL. The message about an
 * unknown option uses it. */
void command_line_set_finder(const char *(*find)(const char *option));

/* Names of triptych_levels_for, terminated by NULL. */
extern const char *const trip_levels_for_names[];

/* Message for a second volume, mostly caused by a shell that expanded a pattern of slices. */
#define TRIP_ONE_VOLUME                                                                            \
    "only one volume is possible at a time; give slices by their folder, or by a pattern in "      \
    "quotes, like \"*.tif\""
/* Message of `render` for a second volume, such as a CT and its segmentation. */
#define TRIP_ONE_VOLUME_A_PICTURE                                                                  \
    TRIP_ONE_VOLUME "; draw other volumes in pictures of their own, with the same --eye, --look "  \
                    "and --up, or show them one after the other with triptych view; several "      \
                    "regions of one volume can be drawn together (triptych brick --region)"

#endif
