#include "effects_options.h"

#include <stdio.h>
#include <string.h>

#include "options.h"
#include "report.h"

int trip_option_light(const char *text, triptych_settings *s)
{
    static const char point[] = "point:";
    const size_t length = sizeof point - 1;
    int count;
    s->headlight = !strcmp(text, "head");
    s->point_light = !strncmp(text, point, length);
    if (s->headlight)
        return 0;
    int status = trip_option_numbers("--light", text + (s->point_light ? length : 0), 3, 3,
                                     s->light, &count);
    if (!status && !s->point_light && !(s->light[0] != 0 || s->light[1] != 0 || s->light[2] != 0))
        return trip_option_fail("--light", "the direction is zero");
    return status;
}

int trip_option_effects(const char *text, triptych_settings *s)
{
    static const char *const names[] = { "shadows", "occlusion", "cueing", "emission",
                                         "auto",    "none",      NULL };
    static const int bits[] = { TRIPTYCH_SHADOWS,  TRIPTYCH_OCCLUSION,    TRIPTYCH_CUEING,
                                TRIPTYCH_EMISSION, TRIPTYCH_EFFECTS_AUTO, 0 };
    int effects = 0, count = 0;
    bool none = false;
    for (const char *rest = text; rest; count++) {
        char name[16];
        const char *comma = strchr(rest, ',');
        size_t length = comma ? (size_t)(comma - rest) : strlen(rest);
        int which;
        snprintf(name, sizeof name, "%.*s", (int)(length < sizeof name ? length : sizeof name - 1),
                 rest);
        int status = trip_option_choice("--effects", name, names, &which);
        if (status)
            return status;
        effects |= bits[which];
        none |= bits[which] == 0;
        rest = comma ? comma + 1 : NULL;
    }
    if (none && count > 1)
        return trip_option_fail("--effects", "none cannot be joined with other effects");
    s->effects = effects;
    return 0;
}

int trip_option_anisotropy(const char *text, triptych_settings *s)
{
    return trip_option_number("--anisotropy", text, -0.95, 0.95, &s->anisotropy);
}

int trip_option_cueing(const char *text, triptych_settings *s)
{
    int status = trip_option_number("--cueing", text, 0, 1, &s->cueing);
    if (!status && !(s->cueing > 0))
        return trip_option_fail("--cueing", "takes a share above 0, at most 1");
    return status;
}

int trip_option_light_cells(const char *text, triptych_settings *s)
{
    return trip_option_integer("--light-cells", text, 8, 1024, &s->light_cells);
}

int trip_option_temperature(const char *text, triptych_settings *s)
{
    double *k = s->kelvin;
    int status = trip_option_range("--temperature", text, &k[0], &k[1]);
    if (!status && !(k[0] >= 0 && k[0] < k[1] && k[1] <= 100000))
        return trip_option_fail(
            "--temperature", "takes temperatures from 0 to 100000 K, the smaller first, as LO:HI");
    return status;
}

int trip_option_check_effects(const triptych_settings *s, const char *heat)
{
    const triptych_settings defaults = triptych_default_settings();
    const int some = s->effects | (s->effects & TRIPTYCH_EFFECTS_AUTO ? ~0 : 0);
    if (s->anisotropy != defaults.anisotropy && !(some & TRIPTYCH_SHADOWS))
        return trip_option_fail("--anisotropy", "requires --effects shadows or auto");
    if (s->cueing != defaults.cueing && !(some & TRIPTYCH_CUEING))
        return trip_option_fail("--cueing", "requires --effects cueing or auto");
    if (s->light_cells != defaults.light_cells &&
        !(some & (TRIPTYCH_SHADOWS | TRIPTYCH_OCCLUSION | TRIPTYCH_EMISSION)))
        return trip_option_fail("--light-cells",
                                "requires --effects shadows, occlusion, emission or auto");
    if (s->effects & TRIPTYCH_EMISSION && !heat)
        return trip_option_fail("--effects",
                                "emission requires a data set of heat, --emission HEAT.trip");
    if (heat && !(some & TRIPTYCH_EMISSION))
        return trip_option_fail("--emission", "requires --effects emission or auto");
    if (!heat && (s->kelvin[0] != defaults.kelvin[0] || s->kelvin[1] != defaults.kelvin[1]))
        return trip_option_fail("--temperature", "requires --emission");
    if (s->effects & TRIPTYCH_SHADOWS && s->headlight)
        return trip_option_fail("--effects", "shadows require a light that is not at the eye; give "
                                             "--light X,Y,Z or --light point:X,Y,Z");
    return 0;
}
