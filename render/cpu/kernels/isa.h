/* Which instruction set the CPU renderer runs on: the widest that both this build and the processor
 * have, or the one named by TRIPTYCH_ISA (plain, avx2, avx512,
 * avx512-vbmi2, neon). */
#ifndef TRIP_CPU_ISA_H
#define TRIP_CPU_ISA_H

#include "cpu/kernels/kernels.h"

extern const trip_cpu_kernels trip_cpu_plain;
#if defined(__x86_64__)
extern const trip_cpu_kernels trip_cpu_avx2, trip_cpu_avx512, trip_cpu_avx512_vbmi2;
#elif defined(__aarch64__)
extern const trip_cpu_kernels trip_cpu_neon;
#endif

/* Those that run here, widest first, NULL-terminated. */
const trip_cpu_kernels *const *trip_cpu_isas(void);

/* The set named, or the widest for NULL or "". Reports and returns NULL when it cannot run here. */
const trip_cpu_kernels *trip_cpu_isa_choose(const char *name);

#endif
