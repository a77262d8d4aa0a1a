/* Fuzzes values that are text, decoded in pieces. The first bytes choose form, type and pieces. */
#include "fuzz.h"

#include "text_values.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    char out[64];
    size_t at = 3, all = 0;
    if (size < at)
        return 0;
    trip_text_decoder d = { .form = data[0] & 1 ? TRIP_TEXT_HEX : TRIP_TEXT_NUMBERS,
                            .type = (trip_scalar)(data[0] / 2 % TRIP_SCALARS) };
    const size_t step = 1 + data[1] % 32, room = 1 + data[2] % sizeof out;
    for (bool good = true; good && at < size;) {
        size_t used, made, count = size - at < step ? size - at : step;
        good = trip_text_decode(&d, (const char *)data + at, count, &used, out, room, &made);
        FUZZ_PROMISE(used <= count && made <= room);
        FUZZ_PROMISE(!good || used == count || made == room);
        at += used;
        all += made;
    }
    FUZZ_PROMISE(trip_text_min_bytes(&d, all) <= size);
    return 0;
}
