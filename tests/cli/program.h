/* Runs the program as a user does, and keeps its exit status and output. */
#ifndef PROGRAM_H
#define PROGRAM_H

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>

#include <cmocka.h>

typedef struct program_run {
    int exit_status; /* -1 if a signal ended it */
    char out[65536], err[65536];
} program_run;

static inline void program_read(const char *path, char *text, size_t bytes)
{
    FILE *f = fopen(path, "r");
    assert_non_null(f);
    text[fread(text, 1, bytes - 1, f)] = 0;
    fclose(f);
}

/* Runs `triptych ARGS` in a shell, in the current folder. */
__attribute__((format(printf, 2, 3))) static inline void program_call(program_run *r,
                                                                      const char *args, ...)
{
    char command[4096], formatted[3072];
    va_list list;
    va_start(list, args);
    vsnprintf(formatted, sizeof formatted, args, list);
    va_end(list);
    snprintf(command, sizeof command, "%s %s >out.txt 2>err.txt </dev/null", TRIP_PROGRAM,
             formatted);
    int status = system(command);
    r->exit_status = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    program_read("out.txt", r->out, sizeof r->out);
    program_read("err.txt", r->err, sizeof r->err);
}

/* Checks the exit status, and that stderr has one line in the project's form. */
static inline void assert_fails(const program_run *r, int exit_status)
{
    const char *end = strchr(r->err, '\n');
    if (r->exit_status != exit_status || strncmp(r->err, "triptych: ", 10) || !end || end[1])
        print_error("exit status %d, stderr: %s\n", r->exit_status, r->err);
    assert_int_equal(r->exit_status, exit_status);
    assert_int_equal(strncmp(r->err, "triptych: ", 10), 0);
    assert_true(end && !end[1]);
}

static inline void assert_works(const program_run *r)
{
    if (r->exit_status != 0)
        print_error("exit status %d, stderr: %s\n", r->exit_status, r->err);
    assert_int_equal(r->exit_status, 0);
}

/* Makes a new folder the current one, until program_leave_folder(). */
static inline int program_enter_folder(void **state)
{
    static char folder[64];
    snprintf(folder, sizeof folder, "/tmp/trip-cli-XXXXXX");
    *state = folder;
    return mkdtemp(folder) && chdir(folder) == 0 ? 0 : -1;
}

static inline int program_leave_folder(void **state)
{
    char command[128];
    snprintf(command, sizeof command, "rm -rf '%s'", (const char *)*state);
    return chdir("/") == 0 ? system(command) : -1;
}

#endif
