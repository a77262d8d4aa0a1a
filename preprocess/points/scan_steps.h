/* The angle between neighbouring rays of a scan with a range grid. It is the median over all points
 * of the angle to the point before in the file. One thread adds points; then any thread reads. */
#ifndef TRIP_SCAN_STEPS_H
#define TRIP_SCAN_STEPS_H

#include "budget.h"
#include "point_file.h"

typedef struct trip_scan_steps trip_scan_steps;

/* Returns NULL if the budget is too small. The info must outlive the steps. */
trip_scan_steps *trip_scan_steps_begin(const trip_point_info *info, trip_budget *budget);
void trip_scan_steps_end(trip_scan_steps *s); /* NULL is allowed */

/* Notes the next point of the file. */
void trip_scan_steps_note(trip_scan_steps *s, const trip_point *p);

/* Finds the angles, after the last point. */
void trip_scan_steps_find(trip_scan_steps *s);
/* Returns the tangent of the angle of a scan, within 3 %; 0 for a scan without a grid. */
double trip_scan_steps_of(const trip_scan_steps *s, uint32_t scan);

#endif
