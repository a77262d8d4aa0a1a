/* Shows the progress of a table on one line of a terminal. A thread redraws the line four times a
 * second, so that the time advances also in long steps and timed code does no output. If stderr is
 * not a terminal, there is neither line nor thread, unless lines are requested. */
#ifndef TRIP_MEASURE_PROGRESS_LINE_H
#define TRIP_MEASURE_PROGRESS_LINE_H

typedef struct measure_progress measure_progress;

/* `name` starts the line. Returns NULL if nothing is shown; all functions accept NULL. */
measure_progress *measure_progress_start(const char *name);
/* Like measure_progress_start(), but prints a line every two seconds if stderr is not a terminal.
 */
measure_progress *measure_progress_start_lines(const char *name);
/* Adds to the number of expected steps, or subtracts steps that will not begin. */
void measure_progress_expect(measure_progress *p, int steps);
/* Begins the next step, named for example "frame of cpu". */
void measure_progress_step(measure_progress *p, const char *stage);
/* Renames the current step, for a part of it. */
void measure_progress_part(measure_progress *p, const char *stage);
/* Shows the counter at its end if all steps began. Clears the line and frees *p. */
void measure_progress_end(measure_progress *p);

#endif
