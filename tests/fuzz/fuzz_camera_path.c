/* Fuzzes camera paths. An accepted path must have a valid view at all times, and stay the same when
 * it is written and read again. */
#include "fuzz.h"

#include <math.h>
#include <string.h>

#include "camera_path.h"

static void check_view(const trip_camera_path *p, double seconds)
{
    trip_navigation n = trip_camera_path_view(p, seconds);
    trip_path_mix mix = trip_camera_path_mix(p, seconds);
    FUZZ_PROMISE(mix.t >= 0 && mix.t < 1 && mix.from >= -1 && mix.to < (int)p->count);
    FUZZ_PROMISE((n.ortho_height > 0) == (p->keys[0].camera.ortho_height > 0));
}

static void check_again(const trip_camera_path *p)
{
    trip_camera_path again = { 0 };
    char *text = trip_camera_path_print(p);
    FUZZ_PROMISE(text && trip_camera_path_parse(&again, "again", text) == 0);
    FUZZ_PROMISE(again.count == p->count);
    for (size_t i = 0; i < p->count; i++)
        FUZZ_PROMISE(memcmp(&again.keys[i].camera, &p->keys[i].camera, sizeof(trip_navigation)) ==
                     0);
    trip_camera_path_release(&again);
    free(text);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    trip_camera_path p = { 0 };
    char *text = calloc(1, size + 1);
    memcpy(text, data, size);
    if (trip_camera_path_parse(&p, "fuzz", text) == 0) {
        int frames = trip_camera_path_frames(&p);
        FUZZ_PROMISE(p.count > 0 && frames > 0 && frames < TRIP_CAMERA_PATH_FRAMES);
        for (int i = 0; i < 8; i++)
            check_view(&p, trip_camera_path_seconds(&p, (int)((long)frames * i / 8)));
        check_again(&p);
    } else {
        FUZZ_PROMISE(p.keys == NULL && p.count == 0);
    }
    trip_camera_path_release(&p);
    free(text);
    return 0;
}
