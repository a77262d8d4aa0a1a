/* Paths of files that belong together, such as a data set and its volume. Any thread. */
#ifndef TRIP_FILE_PATH_H
#define TRIP_FILE_PATH_H

#ifdef __cplusplus
extern "C" {
#endif

/* Returns the path of `to` relative to the folder that contains `from`, for free(). The folders
 * must exist; the files need not. Returns NULL if the folders cannot be resolved. */
char *trip_path_relative(const char *from, const char *to);

/* Returns the path of `name`, which is relative to the folder that contains `from`, for free().
 * Leaves out "X/.." if the path still names the same file. Returns NULL without memory. */
char *trip_path_beside(const char *from, const char *name);

#ifdef __cplusplus
}
#endif

#endif
