/* Fuzzes scripts of the viewer. The numbers of an accepted script must be within their bounds. */
#include "fuzz.h"

#include <math.h>

#include "script.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    trip_script s;
    if (trip_script_parse(&s, "fuzz", (const char *)data, size) != 0) {
        FUZZ_PROMISE(s.events == NULL && s.count == 0);
        return 0;
    }
    for (size_t i = 0; i < s.count; i++) {
        const trip_event *e = &s.events[i];
        bool named = e->kind == TRIP_EVENT_DROP || e->kind == TRIP_EVENT_SCREENSHOT ||
                     e->kind == TRIP_EVENT_PICTURE || e->kind == TRIP_EVENT_STATUS ||
                     e->kind == TRIP_EVENT_CLICK;
        FUZZ_PROMISE(isfinite(e->x) && isfinite(e->y));
        FUZZ_PROMISE((e->text != NULL) == named);
        FUZZ_PROMISE(e->kind != TRIP_EVENT_CLICK || (e->x >= 0 && e->x <= 1));
        FUZZ_PROMISE(e->kind != TRIP_EVENT_KEY || (e->code > 0 && e->code < TRIP_KEYS));
        FUZZ_PROMISE(e->kind != TRIP_EVENT_BUTTON || (e->code >= 0 && e->code < TRIP_BUTTONS));
    }
    trip_script_free(&s);
    return 0;
}
