#include "cpu/sheets/codes.h"

#include <math.h>

#include "field.h"
#include "kind.h"

trip_cpu_codes trip_cpu_codes_of(const trip_dataset *data, trip_kernel kernel)
{
    unsigned least = UINT16_MAX, most = 0;
    for (unsigned i = 0; i < data->list_count; i++) {
        const trip_list *list = &data->lists[i];
        if (list->level > 0 || !trip_kind_of(list->kind)->lattice)
            continue;
        for (uint64_t n = 0; n < list->brick_count; n++) {
            least = list->bricks[n].code_min < least ? list->bricks[n].code_min : least;
            most = list->bricks[n].code_max > most ? list->bricks[n].code_max : most;
        }
    }
    trip_cpu_codes c = { .first = 0 };
    if (least > most)
        return c;
    double bounds[2];
    trip_field_code_bounds(kernel, least, most, bounds);
    least = (unsigned)fmax(0, floor(bounds[0]));
    most = (unsigned)fmin(UINT16_MAX, ceil(bounds[1]));
    c.first = (uint16_t)least;
    while ((most - least) << (c.shift + 1) <= UINT16_MAX && c.shift < 15)
        c.shift++;
    if (c.shift == 0)
        c.first = 0;
    return c;
}
