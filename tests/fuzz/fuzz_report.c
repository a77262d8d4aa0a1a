/* Fuzzes accuracy reports. Chosen settings must stay below the error bound. */
#include "fuzz.h"

#include <math.h>
#include <string.h>

#include "fastest.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    char *text = calloc(1, size + 1);
    memcpy(text, data, size);
    for (unsigned renderers = 0; renderers < 8; renderers += 4) {
        const accuracy_wanted wanted = { .error = 1, .renderers = renderers };
        accuracy_found found = { .setting.settings = (draw_settings){ 0 } };
        if (accuracy_fastest_in(text, "fuzz", &wanted, &found) == 0)
            FUZZ_PROMISE(found.error >= 0 && found.error < 1 && found.ms >= 0);
    }
    free(text);
    return 0;
}
