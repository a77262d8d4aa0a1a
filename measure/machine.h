/* The command and the machine by which figures were measured. Any thread. */
#ifndef TRIP_MEASURE_MACHINE_H
#define TRIP_MEASURE_MACHINE_H

#include <cjson/cJSON.h>

/* Joins "triptych" and the arguments as shell words, for free(). Returns NULL if memory is
 * exhausted. */
char *measure_command_line(int argc, char **argv);

/* Adds the processor, the number of cores that this process may use, free memory and kernel. */
void measure_describe_machine(cJSON *machine);
/* Adds the renderer, its device and the engine of the reader. */
void measure_describe_renderer(cJSON *machine, const char *renderer, const char *device,
                               const char *engine);

#endif
