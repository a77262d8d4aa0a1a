/* `triptych accuracy`: measures the error and time of every setting that trades accuracy for time,
 * and writes a report. Main thread only. */
#ifndef TRIP_ACCURACY_H
#define TRIP_ACCURACY_H

/* Returns 0 or a reported negative trip_status. */
int trip_accuracy(int argc, char **argv);

#endif
