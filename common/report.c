#include "report.h"

#include <errno.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "text.h"

enum { LINE_BYTES = 4096, WHERE_BYTES = 2560 };

/* A line under construction. Text that does not fit is cut, with a mark. */
typedef struct line {
    char text[LINE_BYTES];
    size_t length;
    bool cut;
} line;

void trip_report_redirect(void (*sink)(const char *line, void *user), void *user)
{
    trip_scope *s = trip_scope_current();
    s->sink = sink;
    s->user = user;
}

static void put(line *l, const char *bytes, size_t count)
{
    l->cut = l->cut || count > LINE_BYTES - 8 - l->length;
    if (l->cut)
        return;
    memcpy(l->text + l->length, bytes, count);
    l->length += count;
}

static void put_visible(line *l, const char *text)
{
    char shown[TRIP_TEXT_SHOWN_BYTES];
    while (*text) {
        trip_text_character c = trip_text_next(text);
        put(l, shown, trip_text_show(text, c, shown));
        text += c.bytes;
    }
}

/* Writes only the end of a long position, which leaves room for the reason. */
static void put_where(line *l, const char *where)
{
    size_t length = strlen(where);
    if (length > WHERE_BYTES) {
        put(l, "...", 3);
        where += length - WHERE_BYTES;
        while ((*where & 0xc0) == 0x80) /* not from the middle of a character */
            where++;
    }
    put_visible(l, where);
    put(l, ": ", 2);
}

/* On a terminal the line can replace a longer progress line. So the rest of the terminal's line is
 * cleared.
 */
static void end_line(line *l, bool terminal)
{
    static const char clear[] = { 27, '[', 'K' };
    if (terminal) {
        memcpy(l->text + l->length, clear, sizeof clear);
        l->length += sizeof clear;
    }
    l->text[l->length++] = '\n';
}

static _Thread_local trip_held_report *held;

/* Uses one write(2) per line, so that lines of several threads do not mix. */
static void print(const char *text)
{
    line l = { .length = strlen(text) };
    memcpy(l.text, text, l.length);
    end_line(&l, isatty(STDERR_FILENO) == 1);
    for (size_t done = 0; done < l.length;) {
        ssize_t n = write(STDERR_FILENO, l.text + done, l.length - done);
        if (n < 0 && errno == EINTR)
            continue;
        if (n <= 0)
            break;
        done += (size_t)n;
    }
}

/* The scope around the outermost scope. Its reports go to stderr. */
static _Thread_local trip_scope outside;

/* Passes a line to the innermost scope that accepts it. */
static void emit(int status, const char *text)
{
    const trip_scope *s = trip_scope_current();
    while (s && !s->sink && !(s->failed && status != TRIP_OK))
        s = s->around;
    if (!s) {
        print(text);
        return;
    }
    trip_scope *here = trip_scope_enter(
        s->around ? s->around : &outside); /* the functions report to the enclosing scope */
    if (s->failed && status != TRIP_OK)
        s->failed(s->user, status, text);
    else
        s->sink(text, s->user);
    trip_scope_enter(here);
}

void trip_report_discard(const char *text, void *user)
{
    (void)text, (void)user;
}

void trip_report_line(const char *text)
{
    emit(TRIP_OK, text);
}

static void keep(int status, const char *text)
{
    if (*held->line)
        return;
    memcpy(held->line, text, strlen(text) + 1);
    held->status = status;
}

/* Reports an interruption only once, since it ends the work of all threads. */
static void deliver(int status, const char *text)
{
    if (status != TRIP_OK && held)
        keep(status, text);
    else if (status != TRIP_INTERRUPTED || trip_scope_report_once())
        emit(status, text);
}

static void finish_line(line *l)
{
    if (l->cut) {
        memcpy(l->text + l->length, "...", 3);
        l->length += 3;
    }
    l->text[l->length] = 0;
}

__attribute__((format(printf, 4, 0))) static void
report(int status, const char *stage, const char *where, const char *why, va_list args)
{
    int saved_errno = errno;
    char text[LINE_BYTES];
    line l = { .length = 0 };
    vsnprintf(text, sizeof text, why, args);
    put_visible(&l, "triptych: ");
    put_visible(&l, stage);
    put_visible(&l, ": ");
    if (where && *where)
        put_where(&l, where);
    put_visible(&l, text);
    finish_line(&l);
    deliver(status, l.text);
    errno = saved_errno;
}

#undef trip_fail
#undef trip_fail_errno

int trip_fail(int status, const char *stage, const char *where, const char *why, ...)
{
    va_list args;
    va_start(args, why);
    report(status, stage, where, why, args);
    va_end(args);
    return status;
}

int trip_fail_errno(const char *stage, const char *where, const char *action)
{
    char buffer[256];
    const char *reason = trip_errno_text(errno, buffer, sizeof buffer);
    if (action && *action)
        return trip_fail(TRIP_ERROR, stage, where, "%s: %s", action, reason);
    return trip_fail(TRIP_ERROR, stage, where, "%s", reason);
}

void trip_warn(const char *where, const char *why, ...)
{
    va_list args;
    va_start(args, why);
    report(TRIP_OK, "warning", where, why, args);
    va_end(args);
}

void trip_note(const char *where, const char *stage, ...)
{
    va_list args;
    va_start(args, stage);
    report(TRIP_OK, "note", where, stage, args);
    va_end(args);
}

void trip_report_hold(trip_held_report *h)
{
    *h->line = 0;
    h->before = held;
    held = h;
}

void trip_report_release(trip_held_report *h)
{
    held = h->before;
}

void trip_report_print(const trip_held_report *h)
{
    if (*h->line)
        deliver(h->status, h->line);
}

int trip_fail_line(const char *stage, const char *name, long number, const char *why, ...)
{
    char where[512], text[512];
    va_list args;
    va_start(args, why);
    vsnprintf(text, sizeof text, why, args);
    va_end(args);
    snprintf(where, sizeof where, "%.400s: line %ld", name, number);
    return trip_fail(TRIP_ERROR, stage, where, "%s", text);
}

const char *trip_errno_text(int error, char *room, size_t bytes)
{
    if (error == EFBIG)
        return "the file would be larger than the limit on file sizes (ulimit -f) or the file "
               "system allows";
    if (error == EMFILE)
        return "too many open files; raise the limit (ulimit -n)";
    return strerror_r(error, room, bytes);
}
