/* TRIP_ALSO_V3 before a function compiles it twice, with everything it inlines: for any processor,
 * and for x86-64-v3 (AVX2, BMI, POPCNT). The loader selects one when the program starts. Both give
 * the same results, since no operations are fused (cmake/warnings.cmake). The macro is empty for
 * compilers, loaders and sanitizers that do not support it. */
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
