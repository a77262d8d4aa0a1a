/* The memory limits of control groups, and fields of /proc. The root of the file system is a
 * parameter, so that tests can provide their own. Any thread. */
#ifndef TRIP_MEMORY_LIMITS_H
#define TRIP_MEMORY_LIMITS_H

#include <stdint.h>

/* The smallest memory limit of the process's control group (v1 or v2) and of those above it, as
 * seen below `root` ("" for the machine's own): UINT64_MAX where there is none. */
uint64_t trip_cgroup_limit_bytes(const char *root);

/* A "NAME:  123 kB" field of a file of /proc in bytes; 0 when it is not there. */
uint64_t trip_proc_field_bytes(const char *path, const char *name);

#endif
