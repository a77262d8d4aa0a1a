/* How far a table is, on one line of a terminal, redrawn a few times a second by a thread of its
 * own: whatever takes long, nothing stands still, and what is timed does nothing for it. Where
 * stderr is not a terminal there is neither line nor thread, unless lines are wanted. */
#ifndef TRIP_BENCH_PROGRESS_H
#define TRIP_BENCH_PROGRESS_H

typedef struct bench_progress bench_progress;

/* `name` stands before the line. NULL where nothing is to be shown, which all of these take. */
bench_progress *bench_progress_start(const char *name);
/* The same, and where stderr is no terminal a line every two seconds. */
bench_progress *bench_progress_start_lines(const char *name);
/* There are so many steps more than those said before. */
void bench_progress_expect(bench_progress *p, int steps);
/* The next step begins: "frames of cpu". */
void bench_progress_step(bench_progress *p, const char *stage);
/* Clears the line and frees. */
void bench_progress_end(bench_progress *p);

#endif
