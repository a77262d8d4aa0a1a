/* The tables of `triptych bench`. bench_NAME.c measures the table NAME and adds it to the report.
 * Main thread only. */
#ifndef TRIP_BENCH_TABLES_H
#define TRIP_BENCH_TABLES_H

#include "bench_frame.h"

int bench_orders(bench_scene *scene, const bench_options *o, bench_report *r);
int bench_submit(bench_scene *scene, const bench_options *o, bench_report *r);
int bench_stream(bench_scene *scene, const bench_options *o, bench_report *r);
int bench_popping(bench_scene *scene, const bench_options *o, bench_report *r);
/* Measures the orders of a Gaussian scene. */
int bench_gaussians(const bench_options *o, bench_report *r);
/* With s NULL, measures volumes that it makes. */
int bench_levels(const session *s, const bench_options *o, bench_report *r);
int bench_finer(const bench_options *o, bench_report *r);
/* Ignores s, and opens the data set as the viewer does. */
int bench_flight(const session *s, const bench_options *o, bench_report *r);
/* Ignores s, and opens the data set. */
int bench_surfels(const session *s, const bench_options *o, bench_report *r);
int bench_ewa(const session *s, const bench_options *o, bench_report *r);
int bench_variants(bench_scene *scene, const bench_options *o, bench_report *r);
/* Adds the row of the default of `render` to the table renderers. */
int bench_default(const bench_options *o, bench_report *r, cJSON *rows);
int bench_renderers(const session *s, const bench_options *o, bench_report *r);

#endif
