/* Memory limits of control groups, and fields of /proc. The root of the file system is a parameter,
 * so that tests can provide their own. Any thread. */
#ifndef TRIP_MEMORY_LIMITS_H
#define TRIP_MEMORY_LIMITS_H

#include <stdint.h>

/* Returns the smallest memory limit of the process's control group (v1 or v2) and the groups above
 * it. Looks below `root`, which is "" for the machine's own file system. Returns UINT64_MAX if
 * there is no limit. */
uint64_t trip_cgroup_limit_bytes(const char *root);

/* Returns a field such as "NAME:  123 kB" of a file of /proc, in bytes, or 0 if it is missing. */
uint64_t trip_proc_field_bytes(const char *path, const char *name);

#endif
