/* Fuzzes ParaView colour maps. An accepted map must give a valid transfer function. */
#include "fuzz.h"

#include "tf_internal.h"

static void check(trip_tf *tf)
{
    for (size_t i = 0; i < tf->count; i++) {
        const trip_tf_point *before = i ? &tf->points[i - 1] : NULL;
        FUZZ_PROMISE(trip_tf_point_fault(&tf->points[i], before, tf->normalised) == NULL);
    }
    trip_tf_destroy(tf);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    trip_tf *tf = NULL;
    if (trip_tf_parse_colormap(&tf, "fuzz", (const char *)data, size, NULL) == TRIP_OK)
        check(tf);
    if (trip_tf_parse_colormap(&tf, "fuzz", (const char *)data, size, "b") == TRIP_OK)
        check(tf);
    return 0;
}
