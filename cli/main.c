/* triptych COMMAND ...: selects the command and runs it. */
#include "commands.h"
#include "interrupt.h"

#include <fcntl.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "command_line.h"
#include "report.h"
#include "text.h"

static const struct command {
    const char *name, *summary;
    int (*run)(int argc, char **argv);
    bool prints; /* the results are on standard output */
} commands[] = {
    { "brick", "converts a volume into a data set that is drawn from disk", trip_command_brick,
      false },
    { "info", "prints the contents of a data set, and checks it", trip_command_info, true },
    { "render", "draws a volume or data set into image files", trip_command_render, false },
    { "view", "shows volumes and Gaussian scenes in a window", trip_command_view, false },
    { "serve", "shows a volume or Gaussian scene in a browser", trip_command_serve, false },
    { "cache", "lists or clears the data sets that render, view and serve made of volumes",
      trip_command_cache, true },
    { "bench", "measures speed, as tables", trip_command_bench, true },
    { "accuracy", "measures the error and time of each setting, as a report", trip_command_accuracy,
      false },
    { "tf", "lists, prints and converts transfer functions", trip_command_tf, true },
};
enum { COMMANDS = sizeof commands / sizeof commands[0] };

int trip_exit_status(int status)
{
    return status >= 0 ? 0 : status == TRIP_USAGE ? 2 : 1;
}

/* Prints the options of a command, then ends the process. */
_Noreturn static void print_options(const struct command *c, int to)
{
    char name[16], help[] = "--help=names";
    char *argv[] = { name, help, NULL };
    snprintf(name, sizeof name, "%s", c->name);
    if (dup2(to, STDOUT_FILENO) >= 0)
        c->run(2, argv);
    exit(EXIT_FAILURE);
}

/* Returns whether the option list of a command has the option. A process of its own prints the
 * list, because each command knows only its own options. */
static bool has_option(const struct command *c, const char *option)
{
    int ends[2];
    char *line = NULL;
    size_t room = 0;
    bool found = false;
    if (pipe(ends) != 0)
        return false;
    const pid_t child = fork();
    if (child == 0)
        print_options(c, ends[1]);
    close(ends[1]);
    FILE *list = fdopen(ends[0], "r");
    while (list && getline(&line, &room, list) > 0)
        found |= strcspn(line + 2, " \n") == strlen(option) &&
                 !strncmp(line + 2, option, strlen(option));
    free(line);
    if (list)
        fclose(list);
    else
        close(ends[0]);
    if (child > 0)
        waitpid(child, NULL, 0);
    return found;
}

/* Returns the first command that has the option, or NULL. */
static const char *find_command(const char *option)
{
    for (int i = 0; i < COMMANDS; i++)
        if (has_option(&commands[i], option))
            return commands[i].name;
    return NULL;
}

static void print_help(void)
{
    printf("Usage: triptych COMMAND [OPTION...]\n"
           "Draws volumes too large for memory.\n\n");
    for (int i = 0; i < COMMANDS; i++)
        printf("  %-8s %s\n", commands[i].name, commands[i].summary);
    printf("\n`triptych COMMAND --help` lists the options of a command. The man page\n"
           "triptych-COMMAND(1) explains them. `triptych --version` prints the version.\n");
}

/* Opens closed standard streams. Otherwise a data file could get the number of a standard stream,
 * and messages would overwrite its data. The streams are read-only, so that writing still fails. */
static void hold_standard_streams(void)
{
    for (int fd = 0; fd <= 2; fd++)
        if (fcntl(fd, F_GETFD) < 0)
            (void)!open("/dev/null", O_RDONLY);
}

/* Flushes stdout, so that a full disk behind it is reported as a failure. If nobody reads stdout
 * any more, a command that prints its results ends as other programs do. The results of other
 * commands are complete. */
static int finish(int exit_status, bool prints)
{
    if (fflush(stdout) == 0 && !ferror(stdout))
        return exit_status;
    if (!trip_interrupt_is_unread(STDOUT_FILENO))
        return trip_exit_status(trip_fail_errno("write", "standard output", NULL));
    if (prints)
        trip_interrupt_die_of_pipe();
    return exit_status;
}

/* Drops the line about the interruption once nobody reads stdout. */
static void pass_line(const char *line, void *user)
{
    (void)user;
    if (!trip_interrupt_is_unread(STDOUT_FILENO))
        trip_report_line(line);
}

static int run(const struct command *c, int argc, char **argv)
{
    trip_interrupt_install();
    if (c->prints) {
        trip_interrupt_at_end_of_output();
        trip_report_redirect(pass_line, NULL);
    }
    return finish(c->run(argc, argv), c->prints);
}

/* Raises the limit on open files: every drawn data set has one open file for each list. */
static void allow_open_files(void)
{
    struct rlimit limit;
    if (getrlimit(RLIMIT_NOFILE, &limit) == 0) {
        limit.rlim_cur = limit.rlim_max;
        setrlimit(RLIMIT_NOFILE, &limit);
    }
}

/* Names the commands for a file that was given in place of a command. */
static int fail_file(const char *name)
{
    char *word = trip_text_word(name);
    int status = trip_fail(TRIP_USAGE, "usage", name,
                           "is no command; `triptych render %s -o PICTURE.png` draws it, "
                           "`triptych view %s` shows it",
                           word ? word : "VOLUME", word ? word : "VOLUME");
    free(word);
    return status;
}

int main(int argc, char **argv)
{
    hold_standard_streams();
    allow_open_files();
    if (argc < 2)
        return trip_exit_status(
            trip_fail(TRIP_USAGE, "usage", "command",
                      "no command given; `triptych --help` lists the commands"));
    const char *name = argv[1];
    char help[] = "--help";
    if (!strcmp(name, "help") && argc > 2) { /* is COMMAND --help */
        argv[1] = argv[2];
        argv[2] = help;
        argc = 3;
        name = argv[1];
    }
    if (!strcmp(name, "--help") || !strcmp(name, "help") || !strcmp(name, "-h")) {
        print_help();
        return finish(0, true);
    }
    if (!strcmp(name, "--version")) {
        printf("triptych %s\n", TRIP_VERSION);
        return finish(0, true);
    }
    command_line_set_finder(find_command);
    for (int i = 0; i < COMMANDS; i++)
        if (!strcmp(name, commands[i].name))
            return run(&commands[i], argc - 1, argv + 1);
    if (access(name, F_OK) == 0)
        return trip_exit_status(fail_file(name));
    trip_text_nearest nearest = { .text = name };
    for (int i = 0; i < COMMANDS; i++)
        trip_text_nearest_try(&nearest, commands[i].name);
    trip_text_nearest_try(&nearest, "--help");
    trip_text_nearest_try(&nearest, "--version");
    return trip_exit_status(trip_fail(TRIP_USAGE, "usage", name,
                                      "unknown command;%s%s%s `triptych --help` lists the commands",
                                      nearest.name ? " did you mean " : "",
                                      nearest.name ? nearest.name : "", nearest.name ? "?" : ""));
}
