/* TRIP_ALSO_V3 before a function: it is compiled for any processor and once more, with what it
 * inlines, for those of x86-64-v3 (AVX2, BMI, POPCNT); which of the two runs is decided when the
 * program is loaded. Both compute the same, since no operations are fused anywhere
 * (cmake/warnings.cmake). Not with compilers, loaders and sanitizers that could not cope. */
#ifndef TRIP_CLONES_H
#define TRIP_CLONES_H

#include <features.h>

#if defined(__x86_64__) && defined(__GLIBC__) && __GNUC__ >= 12 && !defined(__clang__) &&          \
    !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define TRIP_ALSO_V3 __attribute__((flatten, target_clones("arch=x86-64-v3", "default")))
#else
#define TRIP_ALSO_V3
#endif

#endif
