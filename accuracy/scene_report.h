/* The report of a Gaussian scene: the differences and times of its four orders. There is no truth
 * among them: each order defines a picture. Draws through the library's header alone. One thread.
 */
#ifndef TRIP_ACCURACY_SCENE_REPORT_H
#define TRIP_ACCURACY_SCENE_REPORT_H

#include "accuracy_options.h"

/* Checks that the options apply to a scene. */
int accuracy_scene_check(const accuracy_options *o);
/* Draws the orders, writes accuracy.json, accuracy.csv and index.html into the folder, and prints
 * the tables. */
int accuracy_scene_report(const accuracy_options *o, const char *folder, const char *command);

#endif
