/* Command lines by argp, and the kinds of values that options take. Errors have one line and exit
 * status 2. Each trip_option_* function reports a bad value, naming the option, and returns
 * TRIP_USAGE, which an argp parser forwards. Main thread only. */
#ifndef TRIP_OPTIONS_H
#define TRIP_OPTIONS_H

#include <argp.h>
#include <stdint.h>

/* Parses argv, which starts with the name of the command, and passes `input` to the parser. --help
 * prints the help and exits. Returns 0, or TRIP_USAGE after reporting an error. */
int trip_options_parse(const struct argp *argp, int argc, char **argv, void *input);

int trip_option_number(const char *option, const char *text, double lo, double hi, double *out);
int trip_option_integer(const char *option, const char *text, int lo, int hi, int *out);
/* Parses `min` to `max` numbers joined by commas, and sets *count to their number. */
int trip_option_numbers(const char *option, const char *text, int min, int max, double *out,
                        int *count);
/* Parses "LO:HI"; LO must be less than HI. */
int trip_option_range(const char *option, const char *text, double *lo, double *hi);
/* Parses a size with a binary suffix, for example "256M". */
int trip_option_bytes(const char *option, const char *text, uint64_t *out);
/* Parses a picture size, 1 to 65536 pixels a side, for example "1024x768". */
int trip_option_size(const char *option, const char *text, int *width, int *height);
/* Names of triptych_levels_for, terminated by NULL. */
extern const char *const trip_levels_for_names[];
/* Finds the index of `text` in a NULL-terminated list of names. */
int trip_option_choice(const char *option, const char *text, const char *const *names, int *out);

/* Options that several commands share, with the rows for their tables. The names are in the order
 * of the library's values. `names` is the number of names that the command accepts. */
#define TRIP_OPTION_MEMORY(key, group)                                                             \
    {                                                                                              \
        "memory", key, "SIZE", 0,                                                                  \
            "Limits the memory for data, for example 256M (MiB) or 2G (GiB) (default: a quarter "  \
            "of the "                                                                              \
            "memory that the process may use)",                                                    \
            group                                                                                  \
    }
#define TRIP_OPTION_ENGINE(key, group)                                                             \
    {                                                                                              \
        "engine", key, "NAME", 0,                                                                  \
            "Selects how files are read: io_uring, pread, null (from memory) or auto (default: "   \
            "auto)",                                                                               \
            group                                                                                  \
    }
#define TRIP_OPTION_THREADS(key, group)                                                            \
    {                                                                                              \
        "threads", key, "N", 0,                                                                    \
            "Sets the number of threads that draw and read, 1 to 256 (default: one per "           \
            "processor)",                                                                          \
            group                                                                                  \
    }
/* Rows for `bench` and `accuracy`. */
#define TRIP_OPTION_TF(key, group)                                                                 \
    {                                                                                              \
        "tf", key, "NAME|FILE", 0,                                                                 \
            "Selects the transfer function, a preset or a file (default: the one in the data "     \
            "set)",                                                                                \
            group                                                                                  \
    }
#define TRIP_OPTION_NO_SHADING(key, group)                                                         \
    {                                                                                              \
        "no-shading", key, NULL, 0,                                                                \
            "Draws the plain colours of the transfer function, and reads no normals", group        \
    }
/* Rows for commands that read a volume. They require the keys KEY_GRID, KEY_LEVEL_SET, KEY_SPACING,
 * KEY_COORDINATES, KEY_AXES and KEY_ALLOW_GAPS. */
#define TRIP_OPTIONS_VOLUME(group)                                                                 \
    { "grid",                                                                                      \
      KEY_GRID,                                                                                    \
      "NAME",                                                                                      \
      0,                                                                                           \
      "Selects a grid of an OpenVDB file or a variable of a netCDF file (default: density, else "  \
      "the first fog volume or grid of scalars; the netCDF variable with the most numbers)",       \
      group },                                                                                     \
        { "level-set",                                                                             \
          KEY_LEVEL_SET,                                                                           \
          "HOW",                                                                                   \
          0,                                                                                       \
          "Selects how an OpenVDB level set becomes a density: filled or band (default: filled)",  \
          group },                                                                                 \
        { "spacing",                                                                               \
          KEY_SPACING,                                                                             \
          "X,Y,Z",                                                                                 \
          0,                                                                                       \
          "Sets the distance of neighbouring voxels along each axis (default: the distance in "    \
          "the file, else 1)",                                                                     \
          group },                                                                                 \
        { "coordinates",                                                                           \
          KEY_COORDINATES,                                                                         \
          "X.txt,Y.txt,Z.txt",                                                                     \
          0,                                                                                       \
          "Reads the position of each voxel along each axis from files of numbers; an axis "       \
          "without a file is even",                                                                \
          group },                                                                                 \
        { "axes",                                                                                  \
          KEY_AXES,                                                                                \
          "PIR",                                                                                   \
          0,                                                                                       \
          "Gives the orientation of a patient if the file does not: where x, y and z point to, "   \
          "here posterior, inferior and right",                                                    \
          group },                                                                                 \
    {                                                                                              \
        "allow-gaps", KEY_ALLOW_GAPS, NULL, 0,                                                     \
            "Accepts a stack with missing slices, as if the neighbours of a gap touched", group    \
    }
int trip_option_memory(const char *text, uint64_t *out);
int trip_option_threads(const char *text, int *out);
int trip_option_repeat(const char *text, int *out); /* timed runs, 1 to 1000 */
int trip_option_views(const char *text, int *out);  /* views around the object, 1 to 1000 */
int trip_option_engine(const char *text, int names, int *out);   /* auto, io_uring, pread, null */
int trip_option_renderer(const char *text, int names, int *out); /* auto, gl, cpu, reference, ... */
int trip_option_classify(const char *text, int names, int *out); /* pre, post, auto */

/* Reports "OPTION: WHY" and returns TRIP_USAGE. */
int trip_option_fail(const char *option, const char *why);
/* Message for a second volume, mostly caused by a shell that expanded a pattern of slices. */
#define TRIP_ONE_VOLUME                                                                            \
    "only one volume is possible at a time; give slices by their folder, or by a pattern in "      \
    "quotes, like \"*.tif\""

#endif
