/* Chooses the instruction set of the CPU renderer. The default is the widest set that both this
 * build and the processor support. TRIPTYCH_ISA selects another one: plain, avx2, avx512,
 * avx512-vbmi2 or neon. Any thread may call these functions. */
#ifndef TRIP_CPU_ISA_H
#define TRIP_CPU_ISA_H

#include "cpu/kernels/kernels.h"

extern const trip_cpu_kernels trip_cpu_plain;
#if defined(__x86_64__)
extern const trip_cpu_kernels trip_cpu_avx2, trip_cpu_avx512, trip_cpu_avx512_vbmi2;
#elif defined(__aarch64__)
extern const trip_cpu_kernels trip_cpu_neon;
#endif

/* Returns the kernel tables that run on this processor, widest first, NULL-terminated. */
const trip_cpu_kernels *const *trip_cpu_isas(void);

/* Returns the table with this name. NULL or "" selects the widest. Reports TRIP_USAGE and returns
 * NULL if the set cannot run here. */
const trip_cpu_kernels *trip_cpu_isa_choose(const char *name);

#endif
