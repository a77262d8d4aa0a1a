#include "scene.h"

#include <ctype.h>
#include <stdio.h>
#include <string.h>

#include "budget.h"

const trip_scene_choice trip_scene_choices[TRIP_SCENE_CHOICES] = {
    { DRAW_ORDER, "Order", NULL },
    { DRAW_FOOTPRINT, "Footprint", "as trained" },
    { DRAW_HARMONICS, "Harmonics", "all degrees" },
    { DRAW_SIDES, "Sides", NULL },
};

static void add(trip_scene_entry *e, const char *label, const char *value)
{
    snprintf(e->label, sizeof e->label, "%s", label);
    e->label[0] = (char)toupper((unsigned char)e->label[0]);
    e->value = value;
}

static bool has_gaussians(const triptych_scene *scene)
{
    return !scene->volumes || scene->objects > scene->volumes;
}

/* Returns whether the scene has a choice. Degrees above the scene's own add nothing. */
static bool has_choice(int row, int choice, const triptych_scene *scene, const draw_settings *s)
{
    if (row == DRAW_SIDES && !(scene->clouds && draw_settings_applies(s, row, DRAW_KIND_CLOUD)))
        return false;
    if (scene->volumes && !draw_settings_choice_applies(row, choice, DRAW_KIND_OBJECTS))
        return false;
    if (row == DRAW_ORDER && choice == TRIPTYCH_ORDER_SHEETS - 1 && scene->moved)
        return false;
    return has_gaussians(scene) &&
           draw_settings_choice_applies(row, choice,
                                        scene->clouds ? DRAW_KIND_CLOUD : DRAW_KIND_SCENE) &&
           (row != DRAW_HARMONICS || choice < scene->degree);
}

/* Returns the value that a row has if none is chosen. */
static const char *standard_of(const trip_option *row, int number, const triptych_scene *scene)
{
    return number == DRAW_ORDER && scene->clouds ? "deferred" : row->standard;
}

int trip_scene_entries(const trip_scene_choice *choice, const triptych_scene *scene,
                       const draw_settings *s, trip_scene_entry entries[TRIP_SCENE_ENTRIES],
                       int *chosen)
{
    const trip_option *row = &draw_settings_table.rows[choice->row];
    const int value = *(const int *)((const char *)s + row->at) - row->first;
    int count = 0;
    *chosen = 0;
    if (choice->standard)
        add(&entries[count++], choice->standard, "");
    for (int i = 0; row->choices[i] && count < TRIP_SCENE_ENTRIES; i++) {
        if (!has_choice(choice->row, i, scene, s))
            continue;
        if (i == value || (value < 0 && !choice->standard &&
                           !strcmp(row->choices[i], standard_of(row, choice->row, scene))))
            *chosen = count;
        add(&entries[count++], row->choices[i], row->choices[i]);
    }
    return count;
}

void trip_scene_choose(const trip_scene_choice *choice, const trip_scene_entry *entry,
                       draw_settings *s)
{
    const trip_option *row = &draw_settings_table.rows[choice->row];
    int *value = (int *)((char *)s + row->at);
    *value = 0;
    for (int i = 0; row->choices[i] && entry->value[0]; i++)
        if (!strcmp(row->choices[i], entry->value))
            *value = row->first + i;
}

const char *trip_scene_order(const triptych_scene *scene, const draw_settings *s)
{
    return s->scene.order || !scene->clouds ? draw_settings_choice(s, DRAW_ORDER) : "deferred";
}

/* Names the objects, unless one scene lies alone. */
static int say_objects(const triptych_scene *scene, char *text, size_t bytes)
{
    const unsigned volumes = scene->volumes;
    const unsigned scenes = scene->objects > volumes ? scene->objects - volumes : 0;
    const char *more = volumes == 1 ? "" : "s", *many = scenes == 1 ? "" : "s";
    if (volumes && scenes)
        return snprintf(text, bytes, "%u volume%s and %u scene%s, ", volumes, more, scenes, many);
    if (volumes)
        return snprintf(text, bytes, "%u volume%s", volumes, more);
    return scenes > 1 ? snprintf(text, bytes, "%u scenes, ", scenes) : 0;
}

void trip_scene_say(const triptych_scene *scene, const draw_settings *s,
                    const trip_frames_status *status, char *text, size_t bytes)
{
    char peak[32], all[32];
    const char *order = trip_scene_order(scene, s);
    const bool deferred = !strcmp(order, "deferred");
    size_t at = (size_t)say_objects(scene, text, bytes);
    if (has_gaussians(scene) && at < bytes)
        at += (size_t)snprintf(text + at, bytes - at, "%llu %s%s",
                               (unsigned long long)scene->gaussians,
                               deferred ? "surfels, " : "Gaussians by ", order);
    if (!status || !(status->whole_ms > 0) || at >= bytes)
        return;
    trip_format_bytes(status->stats.peak_memory_bytes, peak);
    trip_format_bytes(status->stats.memory_bytes, all);
    snprintf(text + at, bytes - at, ", %.0f ms, %s of %s", status->whole_ms, peak, all);
}

triptych_info trip_scene_bounds(const triptych_scene *scene)
{
    triptych_info info = { 0 };
    for (int a = 0; a < 3; a++) {
        info.index_to_world[a][a] = 1;
        info.lo[a] = info.edges[0][a] = info.grid_edges[0][a] = scene->typical_lo[a];
        info.hi[a] = info.edges[1][a] = info.grid_edges[1][a] = scene->typical_hi[a];
    }
    return info;
}
