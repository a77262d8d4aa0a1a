/* Times and errors of one object that is sampled more and more finely. Part of `bench levels`. One
 * thread. */
#ifndef TRIP_BENCH_FINER_H
#define TRIP_BENCH_FINER_H

#include "bench_options.h"
#include "bench_report.h"

int bench_finer(const bench_options *o, bench_report *r);

#endif
