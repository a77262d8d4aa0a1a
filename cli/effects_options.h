/* Options of light and effects, as triptych_settings has them, alike in the commands that draw.
 * Each function reports a bad value, and returns TRIP_USAGE. */
#ifndef TRIP_EFFECTS_OPTIONS_H
#define TRIP_EFFECTS_OPTIONS_H

#include <stdbool.h>

#include "triptych.h"

/* Rows of a command's table; the keys are KEY_EFFECTS, KEY_ANISOTROPY, KEY_CUEING and
 * KEY_LIGHT_CELLS, and KEY_LIGHT where a command has that. */
#define TRIP_OPTION_LIGHT(group)                                                                   \
    {                                                                                              \
        "light", KEY_LIGHT, "X,Y,Z|point:X,Y,Z|head", 0,                                           \
            "Direction to the light, its place, or from the eye (default: head); what is not "     \
            "shaded has it for --effects alone",                                                   \
            group                                                                                  \
    }
#define TRIP_OPTIONS_EFFECTS(group)                                                                \
    { "effects",                                                                                   \
      KEY_EFFECTS,                                                                                 \
      "auto|none|LIST",                                                                            \
      0,                                                                                           \
      "shadows (with scattering in fog, and a --light), occlusion (of light from everywhere), "    \
      "emission (of heat), cueing (of depth), joined by commas; auto: those that the kind of "     \
      "data calls for, which "                                                                     \
      "for measurements are none (default: none)",                                                 \
      group },                                                                                     \
        { "anisotropy",                                                                            \
          KEY_ANISOTROPY,                                                                          \
          "G",                                                                                     \
          0,                                                                                       \
          "How fog scatters light: -0.95 backwards to 0.95 forwards (default: 0, alike)",          \
          group },                                                                                 \
        { "cueing",                                                                                \
          KEY_CUEING,                                                                              \
          "SHARE",                                                                                 \
          0,                                                                                       \
          "Of the background in what is farthest, above 0 to 1 (default: 0.6)",                    \
          group },                                                                                 \
    {                                                                                              \
        "light-cells", KEY_LIGHT_CELLS, "N", 0,                                                    \
            "Cells of the lattice of shadows, occlusion and emission along the longest side, 8 "   \
            "to 1024 (default: 128)",                                                              \
            group                                                                                  \
    }

/* Keys: KEY_EMISSION and KEY_TEMPERATURE. */
#define TRIP_OPTIONS_EMISSION(group)                                                               \
    { "emission",                                                                                  \
      KEY_EMISSION,                                                                                \
      "HEAT.trip",                                                                                 \
      0,                                                                                           \
      "A data set of heat, as brick makes of another grid of the same file, by which what is "     \
      "drawn glows; for --effects emission and auto",                                              \
      group },                                                                                     \
    {                                                                                              \
        "temperature", KEY_TEMPERATURE, "LO:HI", 0,                                                \
            "Kelvin where heat is 0 and where it is greatest (default: 0:2500); --emission only",  \
            group                                                                                  \
    }

int trip_option_light(const char *text, triptych_settings *s);
int trip_option_effects(const char *text, triptych_settings *s);
int trip_option_anisotropy(const char *text, triptych_settings *s);
int trip_option_cueing(const char *text, triptych_settings *s);
int trip_option_light_cells(const char *text, triptych_settings *s);
int trip_option_temperature(const char *text, triptych_settings *s);
/* What does not go together, once all is parsed, with the data set of heat that is given, or NULL.
 */
int trip_option_check_effects(const triptych_settings *s, const char *heat);

#endif
