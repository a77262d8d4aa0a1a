/* `triptych accuracy`: what each setting that trades accuracy for time errs and costs, as a report.
 */
#ifndef TRIP_ACCURACY_H
#define TRIP_ACCURACY_H

/* 0 or a negative trip_status, once reported. */
int trip_accuracy(int argc, char **argv);

#endif
