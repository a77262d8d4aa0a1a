/* Fuzzes transfer functions in XML and in Slicer's text. An accepted transfer function must be
 * valid. Every format that can write it must also read it back. The first byte decides whether a
 * transfer function is chosen by name. */
#include "fuzz.h"

#include "tf_internal.h"

#include <string.h>

static void check(trip_tf *tf)
{
    for (size_t i = 0; i < tf->count; i++) {
        const trip_tf_point *before = i ? &tf->points[i - 1] : NULL;
        FUZZ_PROMISE(trip_tf_point_fault(&tf->points[i], before, tf->normalised) == NULL);
    }
    for (int format = TRIP_TF_TEXT; format <= TRIP_TF_VTK; format++) {
        char *text;
        trip_tf *again;
        if (trip_tf_write(tf, (trip_tf_format)format, "fuzz", &text) != TRIP_OK)
            continue;
        FUZZ_PROMISE(trip_tf_parse_any(&again, "again", text, strlen(text), NULL) == TRIP_OK);
        trip_tf_destroy(again);
        free(text);
    }
    trip_tf_destroy(tf);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    trip_tf *tf = NULL;
    if (size == 0)
        return 0;
    const char *text = (const char *)data + 1;
    if (trip_tf_parse_xml(&tf, "fuzz", text, size - 1, data[0] & 1 ? "b" : NULL) == TRIP_OK)
        check(tf);
    if (trip_tf_parse_vp(&tf, "fuzz", text, size - 1) == TRIP_OK)
        check(tf);
    return 0;
}
