/* Fuzzes the state that the viewer keeps for a data set. An accepted state must give a valid view,
 * and stay the same when it is written and read again. */
#include "fuzz.h"

#include <math.h>
#include <string.h>

#include "state_file.h"

static trip_view_state defaults(void)
{
    return (trip_view_state){ .opacity_scale = 1, .settings = (draw_settings){ 0 } };
}

static void check_again(const trip_view_state *s)
{
    trip_view_state again = defaults();
    char *text = trip_view_state_print(s, "/d");
    FUZZ_PROMISE(text && trip_view_state_parse(&again, "/d", text, "again") == 1);
    FUZZ_PROMISE(memcmp(&again.navigation, &s->navigation, sizeof s->navigation) == 0);
    FUZZ_PROMISE(draw_settings_same(&again.settings, &s->settings));
    FUZZ_PROMISE(again.opacity_scale == s->opacity_scale && again.panel == s->panel);
    trip_view_state_release(&again);
    free(text);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    trip_view_state s = defaults();
    char *text = calloc(1, size + 1);
    memcpy(text, data, size);
    if (trip_view_state_parse(&s, "/d", text, "fuzz") == 1) {
        FUZZ_PROMISE(!s.has_navigation || trip_navigation_distance(&s.navigation) > 0);
        FUZZ_PROMISE(draw_settings_check_ranges(&s.settings) == 0);
        check_again(&s);
    } else {
        FUZZ_PROMISE(s.text == NULL && s.function == NULL);
    }
    trip_view_state_release(&s);
    free(text);
    return 0;
}
