/* Finds the squares of sheets from which rays of open pixels may read voxels. Other squares are
 * neither decoded nor prepared, which changes no picture. Called by the renderer's thread. */
#ifndef TRIP_CPU_SHEETS_OPEN_SQUARES_H
#define TRIP_CPU_SHEETS_OPEN_SQUARES_H

#include "cpu/sheets/cpu_sheets_state.h"

/* Sets the store's open squares for a sheet, before its first run. The squares are found for
 * several sheets at once, and again after pixels were drawn. */
void trip_cpu_open_squares_of_sheet(trip_cpu_sheets *s, int64_t number);

/* Returns whether a square in the tile of a run of the sheet is open. */
bool trip_cpu_open_squares_some_of_run(const trip_cpu_sheets *s, const trip_run *run);

/* Forgets the open squares. Call it after pixels were drawn, and before sheets of another row or
 * pass. */
void trip_cpu_open_squares_forget(trip_cpu_sheets *s);

#endif
