/* Shows the progress of a table on one line of a terminal. A thread redraws the line four times a
 * second, so that the time advances also in long steps and timed code does no output. If stderr is
 * not a terminal, there is neither line nor thread, unless lines are requested. */
#ifndef TRIP_MEASURE_PROGRESS_LINE_H
#define TRIP_MEASURE_PROGRESS_LINE_H

typedef struct bench_progress bench_progress;

/* `name` starts the line. Returns NULL if nothing is shown; all functions accept NULL. */
bench_progress *bench_progress_start(const char *name);
/* Like bench_progress_start(), but prints a line every two seconds if stderr is not a terminal. */
bench_progress *bench_progress_start_lines(const char *name);
/* Adds to the number of expected steps. */
void bench_progress_expect(bench_progress *p, int steps);
/* Begins the next step, named for example "frame of cpu". */
void bench_progress_step(bench_progress *p, const char *stage);
/* Clears the line and frees *p. */
void bench_progress_end(bench_progress *p);

#endif
