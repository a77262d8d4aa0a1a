/* Common parts of all fuzzers: libFuzzer's entry points, FUZZ_PROMISE for conditions that must
 * hold, and a start that silences error lines. No input may cause a crash, a hang or a leak. */
#ifndef TRIP_FUZZ_H
#define TRIP_FUZZ_H

#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include "report.h"

int LLVMFuzzerInitialize(int *argc, char ***argv);
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

#define FUZZ_PROMISE(condition)                                                                    \
    do {                                                                                           \
        if (!(condition))                                                                          \
            abort();                                                                               \
    } while (0)

static void fuzz_swallow(const char *line, void *user)
{
    (void)line;
    (void)user;
}

int LLVMFuzzerInitialize(int *argc, char ***argv)
{
    (void)argc;
    (void)argv;
    trip_report_redirect(fuzz_swallow, NULL);
    return 0;
}

#endif
