#include "volume_options.h"

#include "anatomy.h"
#include "cached_volume.h"
#include "options.h"

int trip_option_grid(const char *name, const char **grid)
{
    if (*grid)
        return trip_option_fail("--grid", "given twice; only one grid is possible");
    *grid = name;
    return 0;
}

int trip_option_level_set(const char *text, triptych_level_set *mode)
{
    static const char *const names[] = { "filled", "band", NULL };
    int choice = 0;
    int status = trip_option_choice("--level-set", text, names, &choice);
    *mode = choice ? TRIPTYCH_LEVEL_SET_BAND : TRIPTYCH_LEVEL_SET_FILLED;
    return status;
}

int trip_option_spacing(const char *text, double spacing[3])
{
    int count;
    int status = trip_option_numbers("--spacing", text, 3, 3, spacing, &count);
    for (int a = 0; a < 3 && status == 0; a++)
        if (!(spacing[a] > 0))
            return trip_option_fail("--spacing", "takes three positive lengths");
    return status;
}

int trip_option_axes(const char *text, const char **axes)
{
    *axes = text;
    return trip_anatomy_axes_valid(text) ? 0
                                         : trip_option_fail("--axes", "takes " TRIP_ANATOMY_AXES);
}

int trip_option_check_volume(const triptych_brick_options *v, const char *input)
{
    const bool given =
        v->grid || v->level_set || v->spacing[0] > 0 || v->coordinates || v->axes || v->allow_gaps;
    return given && !cached_volume_wanted(input)
               ? trip_option_fail(input,
                                  "is a data set; --grid, --level-set, --spacing, --coordinates, "
                                  "--axes and --allow-gaps apply to volumes only")
               : 0;
}
