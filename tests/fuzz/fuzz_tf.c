/* Fuzzes `.tf` text. An accepted transfer function must stay the same when it is written and read
 * again. */
#include "fuzz.h"

#include "transfer_function.h"

#include <string.h>

static void check_same(const trip_tf *a, const trip_tf *b, double value)
{
    trip_rgba p = trip_tf_evaluate(a, value), q = trip_tf_evaluate(b, value);
    FUZZ_PROMISE(memcmp(&p, &q, sizeof p) == 0);
    FUZZ_PROMISE(p.opacity >= 0 && p.opacity <= 1);
    FUZZ_PROMISE(trip_tf_visible_in(a, value, value) == (p.opacity > 0));
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    trip_tf *tf = NULL, *again = NULL;
    if (trip_tf_parse(&tf, "fuzz", (const char *)data, size) != TRIP_OK) {
        FUZZ_PROMISE(tf == NULL);
        return 0;
    }
    char *text = trip_tf_to_text(tf);
    FUZZ_PROMISE(text && trip_tf_parse(&again, "again", text, strlen(text)) == TRIP_OK);
    trip_tf_denormalise(tf, -3.5, 1e9);
    trip_tf_denormalise(again, -3.5, 1e9);
    static const double values[] = { -1e308, -3.5, -1, 0, 0.25, 1, 77, 1e9, 1e308 };
    for (size_t i = 0; i < sizeof values / sizeof *values; i++)
        check_same(tf, again, values[i]);
    trip_tf_destroy(tf);
    trip_tf_destroy(again);
    free(text);
    return 0;
}
