/* triptych bench: measures drawing and reading a data set, and prints tables with their limits.
 * Main thread only. */
#ifndef TRIP_BENCH_H
#define TRIP_BENCH_H

/* argv[0] is "bench". Returns 0 or a reported failure. */
int trip_bench(int argc, char **argv);

#endif
