#include "progress.h"

#include <stdio.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "clock.h"
#include "command_line.h"

static const double interval_seconds = 0.25;
static const double steady_seconds = 1; /* a rate over a shorter time is too uncertain */

trip_progress trip_progress_start(void)
{
    return (trip_progress){ .shown = !command_line_quiet() && isatty(STDERR_FILENO) == 1 };
}

/* Formats a duration, for example "0:42", "12:05" or "3:02:10". */
static const char *format_time(double seconds, char *text, size_t bytes)
{
    unsigned s = seconds < 359999 ? (unsigned)(seconds + 0.5) : 359999;
    if (s >= 3600)
        snprintf(text, bytes, "%u:%02u:%02u", s / 3600, s / 60 % 60, s % 60);
    else
        snprintf(text, bytes, "%u:%02u", s / 60, s % 60);
    return text;
}

/* Starts the line with the finished pictures, for example "17 of 60, 0:12 left". */
static void print_pictures(const trip_progress *p)
{
    char time_text[16];
    const double spent = trip_now_seconds() - p->begin;
    fprintf(stderr, "\r\033[K");
    if (!p->pictures)
        return;
    fprintf(stderr, "%d of %d", p->done, p->pictures);
    if (p->done > 0 && p->done < p->pictures)
        fprintf(
            stderr, ", %s left",
            format_time(spent / p->done * (p->pictures - p->done), time_text, sizeof time_text));
}

void trip_progress_pictures(trip_progress *p, int done, int pictures)
{
    const double now = trip_now_seconds();
    if (done == 0)
        p->begin = now;
    p->done = done;
    p->pictures = pictures;
    p->stage[0] = 0;
    if (!p->shown || now - p->last_shown < interval_seconds)
        return;
    print_pictures(p);
    fputc('\r', stderr);
    fflush(stderr);
    p->last_shown = now;
    p->line = true;
}

static void print_line(const trip_progress *p, double share, double rate, double left,
                       const char *things)
{
    char time_text[16];
    print_pictures(p);
    fprintf(stderr, "%s%-6s %3.0f %%", p->pictures ? "  " : "", p->stage, 100 * share);
    if (rate > 0)
        fprintf(stderr, "  %.*f million %s/s  %s left", rate < 1e7, rate / 1e6, things,
                format_time(left, time_text, sizeof time_text));
    fputc('\r', stderr); /* the next output overwrites the line */
    fflush(stderr);
}

void trip_progress_show(trip_progress *p, const char *stage, uint64_t done, uint64_t total,
                        const char *things)
{
    double now = trip_now_seconds();
    if (!p->shown)
        return;
    if (strcmp(p->stage, stage) != 0) {
        snprintf(p->stage, sizeof p->stage, "%s", stage);
        p->stage_begin = now;
        p->last_shown = p->pictures ? p->last_shown : 0;
    }
    if (now - p->last_shown < interval_seconds)
        return;
    double spent = now - p->stage_begin, share = total ? (double)done / (double)total : 0;
    double rate = spent > steady_seconds ? (double)done / spent : 0;
    print_line(p, share, rate, rate > 0 ? (double)(total - done) / rate : 0, things);
    p->last_shown = now;
    p->line = true;
}

void trip_progress_end(trip_progress *p)
{
    if (p->line)
        fputs("\r\033[K", stderr);
    p->line = false;
    p->stage[0] = 0;
}
