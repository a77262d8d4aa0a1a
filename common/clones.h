/* TRIP_AVX2_TOO before a function: it is compiled for any processor and once more for those with
 * AVX2, with what it inlines, and which of the two runs is decided when the program is loaded. Both
 * compute the same: AVX2 brings no fused operations. Not where the loader or a sanitizer could not
 * cope with that. */
#ifndef TRIP_CLONES_H
#define TRIP_CLONES_H

#include <features.h>

#if defined(__x86_64__) && defined(__GLIBC__) && defined(__GNUC__) && !defined(__clang__) &&       \
    !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define TRIP_AVX2_TOO __attribute__((flatten, target_clones("avx2", "default")))
#else
#define TRIP_AVX2_TOO
#endif

#endif
