/* Which squares of sheets rays of open pixels may take voxels of: the others are neither decoded
 * nor prepared, which changes no picture. Of the renderer's thread alone. */
#ifndef TRIP_CPU_SHEETS_OPEN_SQUARES_H
#define TRIP_CPU_SHEETS_OPEN_SQUARES_H

#include "cpu/sheets/cpu_sheets_state.h"

/* Sets the store's open squares for a sheet whose first run is at hand. They are found for some
 * sheets at once, and again once pixels were drawn. */
void trip_cpu_open_squares_of_sheet(trip_cpu_sheets *s, int64_t number);

/* Whether some of the tile of a run of that sheet is open. */
bool trip_cpu_open_squares_some_of_run(const trip_cpu_sheets *s, const trip_run *run);

/* Pixels were drawn, or the sheets that come are of another row or pass. */
void trip_cpu_open_squares_forget(trip_cpu_sheets *s);

#endif
