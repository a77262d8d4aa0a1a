// The codes of missing voxels in a sheet. Codes lie above NO_CODE, and TRIP_GL_MISSING lies below it.
// With EXACT, draw codes may be negative.
#ifdef EXACT
#define TRIP_GL_MISSING TRIP_GL_MISSING_EXACT
#define NO_CODE -1e30
#else
#define TRIP_GL_MISSING TRIP_GL_MISSING_WHOLE
#define NO_CODE 0.0
#endif
