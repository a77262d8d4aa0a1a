#include "cpu/kernels/isa.h"

#include <stdio.h>
#include <string.h>

#include "report.h"

/* find_runnable() fills the list once, before main() starts any thread. */
static const trip_cpu_kernels *runnable[5];

__attribute__((constructor)) static void find_runnable(void)
{
    int n = 0;
#if defined(__x86_64__)
    __builtin_cpu_init();
    struct {
        bool avx2, avx512, vbmi2;
    } has;
    has.avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&
               __builtin_cpu_supports("bmi") && __builtin_cpu_supports("popcnt");
#if defined(TRIP_CPU_EMULATED_AVX512)
    has.avx512 = has.avx2, has.vbmi2 = true;
#else
    has.avx512 = has.avx2 && __builtin_cpu_supports("avx512f") &&
                 __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512bw") &&
                 __builtin_cpu_supports("avx512vl");
    has.vbmi2 = __builtin_cpu_supports("avx512vbmi2");
#endif
#if !defined(TRIP_CPU_WITHOUT_AVX512_VBMI2)
    if (has.avx512 && has.vbmi2)
        runnable[n++] = &trip_cpu_avx512_vbmi2;
#endif
#if !defined(TRIP_CPU_WITHOUT_AVX512)
    if (has.avx512)
        runnable[n++] = &trip_cpu_avx512;
#endif
#if !defined(TRIP_CPU_WITHOUT_AVX2)
    if (has.avx2)
        runnable[n++] = &trip_cpu_avx2;
#endif
#elif defined(__aarch64__)
    runnable[n++] = &trip_cpu_neon;
#endif
    runnable[n] = &trip_cpu_plain;
}

const trip_cpu_kernels *const *trip_cpu_isas(void)
{
    return runnable;
}

const trip_cpu_kernels *trip_cpu_isa_choose(const char *name)
{
    if (!name || !*name)
        return runnable[0];
    char names[64] = "";
    for (int i = 0; runnable[i]; i++) {
        if (strcmp(runnable[i]->isa, name) == 0)
            return runnable[i];
        size_t used = strlen(names);
        snprintf(names + used, sizeof names - used, "%s%s", used ? ", " : "", runnable[i]->isa);
    }
    trip_fail(TRIP_USAGE, "render", "TRIPTYCH_ISA", "'%s' does not run here; choose one of %s",
              name, names);
    return NULL;
}
