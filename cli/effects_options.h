/* Options for light and effects, as in triptych_settings, shared by the commands that draw. Each
 * function reports a bad value, naming the option, and returns TRIP_USAGE. Main thread only. */
#ifndef TRIP_EFFECTS_OPTIONS_H
#define TRIP_EFFECTS_OPTIONS_H

#include <stdbool.h>

#include "triptych.h"

/* Rows of a command's option table. They require the keys KEY_LIGHT, KEY_EFFECTS, KEY_ANISOTROPY,
 * KEY_CUEING and KEY_LIGHT_CELLS. */
#define TRIP_OPTION_LIGHT(group)                                                                   \
    {                                                                                              \
        "light", KEY_LIGHT, "X,Y,Z|point:X,Y,Z|head", 0,                                           \
            "Sets the direction to the light, the position of the light, or a light at the eye "   \
            "(default: head)",                                                                     \
            group                                                                                  \
    }
#define TRIP_OPTIONS_EFFECTS(group)                                                                \
    { "effects",                                                                                   \
      KEY_EFFECTS,                                                                                 \
      "auto|none|LIST",                                                                            \
      0,                                                                                           \
      "Switches effects on: shadows (require a --light other than head), occlusion, emission "     \
      "(requires --emission) and cueing, joined by commas; auto chooses by the kind of data "      \
      "(default: none)",                                                                           \
      group },                                                                                     \
        { "anisotropy",                                                                            \
          KEY_ANISOTROPY,                                                                          \
          "G",                                                                                     \
          0,                                                                                       \
          "Sets how fog scatters light: -0.95 (backwards) to 0.95 (forwards) (default: 0, "        \
          "equally); requires --effects shadows or auto",                                          \
          group },                                                                                 \
        { "cueing",                                                                                \
          KEY_CUEING,                                                                              \
          "SHARE",                                                                                 \
          0,                                                                                       \
          "Sets the share of the background in the colour of the farthest parts, above 0 to 1 "    \
          "(default: 0.6); requires --effects cueing or auto",                                     \
          group },                                                                                 \
    {                                                                                              \
        "light-cells", KEY_LIGHT_CELLS, "N", 0,                                                    \
            "Sets the number of lattice cells for shadows, occlusion and emission along the "      \
            "longest side, 8 to 1024 (default: 128)",                                              \
            group                                                                                  \
    }

/* Requires the keys KEY_EMISSION and KEY_TEMPERATURE. */
#define TRIP_OPTIONS_EMISSION(group)                                                               \
    { "emission",                                                                                  \
      KEY_EMISSION,                                                                                \
      "HEAT.trip",                                                                                 \
      0,                                                                                           \
      "Reads heat from a second data set, for --effects emission or auto: hot matter glows",       \
      group },                                                                                     \
    {                                                                                              \
        "temperature", KEY_TEMPERATURE, "LO:HI", 0,                                                \
            "Sets the temperatures in kelvin of heat 0 and of the greatest heat, 0 to 100000 "     \
            "(default: 0:2500); requires --emission",                                              \
            group                                                                                  \
    }

int trip_option_light(const char *text, triptych_settings *s);
int trip_option_effects(const char *text, triptych_settings *s);
int trip_option_anisotropy(const char *text, triptych_settings *s);
int trip_option_cueing(const char *text, triptych_settings *s);
int trip_option_light_cells(const char *text, triptych_settings *s);
int trip_option_temperature(const char *text, triptych_settings *s);
/* Checks combinations after all options are parsed. `heat` is the data set of heat, or NULL. */
int trip_option_check_effects(const triptych_settings *s, const char *heat);

#endif
