/* The panel by Dear ImGui. The functions follow the order of the controls on the screen. */
#include "panel.h"

#include <backends/imgui_impl_opengl3.h>
#include <imgui.h>

#include <cfloat>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <new>
#include <string>
#include <unistd.h>

#include "annotation.h"
#include "clipping.h"
#include "light.h"
#include "report.h"
#include "scene.h"

namespace
{

struct Box {
    ImVec2 lo, hi;
    bool seen;
};

const int TIMES = 120;

} // namespace

struct trip_panel {
    ImGuiContext *context;
    double scale;
    std::map<std::string, Box> boxes; /* boxes of the last frame's controls, by label */
    std::string sought;               /* label of a control to scroll into view */
    int point;                        /* selected point of the transfer function, or -1 */
    bool dragging;
    char path[512]; /* of a transfer function */
};

namespace
{

// ---- helpers ----

// Records the box of the last control under its label.
bool mark(trip_panel *p, const char *label, bool result)
{
    const ImVec2 lo = ImGui::GetItemRectMin(), hi = ImGui::GetItemRectMax();
    const float top = ImGui::GetWindowPos().y, bottom = top + ImGui::GetWindowHeight();
    p->boxes[label] = Box{ lo, hi, lo.y >= top && hi.y <= bottom };
    if (p->sought == label)
        ImGui::SetScrollHereY();
    return result;
}

// Records a control with its label beside it.
bool mark_beside(trip_panel *p, const char *label, bool result)
{
    mark(p, label, result);
    Box &box = p->boxes[label];
    box.hi.x = box.lo.x + ImGui::CalcItemWidth();
    return result;
}

bool check(trip_panel *p, const char *label, int *value)
{
    bool on = *value != 0;
    const bool changed = mark(p, label, ImGui::Checkbox(label, &on));
    *value = on;
    return changed;
}

bool check(trip_panel *p, const char *label, bool *value)
{
    return mark(p, label, ImGui::Checkbox(label, value));
}

bool button(trip_panel *p, const char *label)
{
    return mark(p, label, ImGui::Button(label));
}

bool slide(trip_panel *p, const char *label, double *value, double lo, double hi,
           const char *format, ImGuiSliderFlags flags = 0)
{
    const ImGuiSliderFlags all = flags | ImGuiSliderFlags_AlwaysClamp;
    return mark_beside(
        p, label, ImGui::SliderScalar(label, ImGuiDataType_Double, value, &lo, &hi, format, all));
}

// A choice from a few names.
template <typename Choice>
bool choose(trip_panel *p, const char *label, Choice *value, const char *const *names, int count)
{
    bool changed = false;
    const bool open = ImGui::BeginCombo(label, names[static_cast<int>(*value)]);
    mark_beside(p, label, open);
    for (int i = 0; open && i < count; i++)
        if (mark(p, names[i], ImGui::Selectable(names[i], i == static_cast<int>(*value)))) {
            *value = static_cast<Choice>(i);
            changed = true;
        }
    if (open)
        ImGui::EndCombo();
    return changed;
}

// A choice of a setting: 0 selects the default, and `names` start at 1.
template <typename Choice>
bool choose_setting(trip_panel *p, const char *label, Choice *value, const char *const *names,
                    int count, int standard)
{
    int chosen = (*value ? static_cast<int>(*value) : standard) - 1;
    const bool changed = choose(p, label, &chosen, names, count);
    if (changed)
        *value = static_cast<Choice>(chosen + 1);
    return changed;
}

std::string bytes_text(double bytes)
{
    char text[32];
    const char *units[] = { "B", "kB", "MB", "GB", "TB" };
    int unit = 0;
    for (; bytes >= 1000 && unit < 4; unit++)
        bytes /= 1000;
    std::snprintf(text, sizeof text, bytes < 10 && unit ? "%.1f %s" : "%.0f %s", bytes,
                  units[unit]);
    return text;
}

bool section(trip_panel *p, const char *name, bool open = true)
{
    const bool shown = ImGui::CollapsingHeader(name, open ? ImGuiTreeNodeFlags_DefaultOpen : 0);
    return mark(p, name, shown);
}

// ---- data sets and views ----

void draw_documents(trip_panel *p, trip_viewer *v)
{
    for (int i = 0; i < v->count; i++) {
        const char *name = v->documents[i]->input;
        const char *slash = std::strrchr(name, '/');
        ImGui::PushID(i);
        const char *label = slash && slash[1] ? slash + 1 : name;
        if (mark(p, label, ImGui::Selectable(label, i == v->shown)))
            trip_viewer_show(v, i);
        if (ImGui::IsItemHovered())
            ImGui::SetTooltip("%s", name);
        ImGui::PopID();
    }
    if (v->count == 0)
        ImGui::TextWrapped("Drop a data set or a volume here.");
    else if (button(p, "Close"))
        trip_viewer_close(v);
}

void draw_sides(trip_panel *p, trip_viewer *v)
{
    const char *names[] = { "Front", "Back", "Left", "Right", "Top", "Bottom" };
    for (int i = 0; i < 6; i++) {
        if (i % 3)
            ImGui::SameLine();
        if (mark(p, names[i],
                 ImGui::Button(names[i], ImVec2(76 * static_cast<float>(p->scale), 0))))
            trip_viewer_see_side(v, static_cast<triptych_side>(TRIPTYCH_SIDE_FRONT + i));
    }
}

void draw_view(trip_panel *p, trip_viewer *v, trip_document *d)
{
    trip_navigation *n = &d->navigation;
    draw_sides(p, v);
    if (button(p, "Fit"))
        trip_viewer_fit(v);
    if (!d->has_navigation)
        return;
    bool parallel = n->ortho_height > 0;
    ImGui::SameLine();
    if (check(p, "Parallel", &parallel)) {
        trip_navigation_set_parallel(n, parallel);
        v->changed = true;
    }
    double fov = n->fov_degrees;
    if (!parallel && slide(p, "Field of view", &fov, 1, 150, "%.1f°")) {
        trip_navigation_set_fov(n, fov);
        v->changed = true;
    }
}

// ---- controls of volumes and scenes ----

bool draw_background(trip_panel *p, draw_settings *s)
{
    float rgb[3];
    for (int i = 0; i < 3; i++)
        rgb[i] = static_cast<float>(draw_settings_background(s)[i]);
    if (!mark_beside(p, "Background", ImGui::ColorEdit3("Background", rgb)))
        return false;
    s->background[3] = draw_settings_background(s)[3];
    for (int i = 0; i < 3; i++)
        s->background[i] = static_cast<double>(rgb[i]);
    s->has_background = 1;
    return true;
}

bool draw_opacity(trip_panel *p, trip_document *d)
{
    return slide(p, "Opacity", &d->opacity_scale, 0.01, 100, "x %.3g",
                 ImGuiSliderFlags_Logarithmic);
}

// ---- the transfer function ----

// The opacity axis is a cube root, because opacities of fog are small.
double height_of(double opacity)
{
    return std::cbrt(opacity);
}

struct Canvas {
    ImVec2 lo, hi;
    double value_lo, value_hi;

    float x(double value) const
    {
        return lo.x +
               static_cast<float>((value - value_lo) / (value_hi - value_lo)) * (hi.x - lo.x);
    }
    float y(double opacity) const
    {
        return hi.y - static_cast<float>(height_of(opacity)) * (hi.y - lo.y);
    }
    double value(float at) const
    {
        return value_lo + static_cast<double>((at - lo.x) / (hi.x - lo.x)) * (value_hi - value_lo);
    }
    double opacity(float at) const
    {
        const double h = static_cast<double>((hi.y - at) / (hi.y - lo.y));
        return h > 0 ? h < 1 ? h * h * h : 1 : 0;
    }
};

ImU32 colour_of(const trip_rgba &c, double alpha)
{
    return ImGui::ColorConvertFloat4ToU32(ImVec4(static_cast<float>(c.r), static_cast<float>(c.g),
                                                 static_cast<float>(c.b),
                                                 static_cast<float>(alpha)));
}

void draw_histogram(ImDrawList *list, const Canvas &c, const triptych_histogram &h)
{
    uint64_t max = 0;
    for (uint64_t count : h.counts)
        max = count > max ? count : max;
    if (!h.total || !(h.lo < h.hi))
        return;
    for (float x = c.lo.x; x < c.hi.x; x++) {
        const double position =
            (c.value(x + 0.5f) - h.lo) / (h.hi - h.lo) * TRIPTYCH_HISTOGRAM_BINS;
        if (!(position >= 0 && position < TRIPTYCH_HISTOGRAM_BINS))
            continue;
        const double part = std::log1p(static_cast<double>(h.counts[static_cast<int>(position)])) /
                            std::log1p(static_cast<double>(max));
        const float top = c.hi.y - static_cast<float>(part) * (c.hi.y - c.lo.y);
        list->AddLine(ImVec2(x, c.hi.y), ImVec2(x, top), IM_COL32(90, 96, 110, 255));
    }
}

void draw_curve(ImDrawList *list, const Canvas &c, const trip_tf_editor *e)
{
    for (float x = c.lo.x; x < c.hi.x; x++) {
        const trip_rgba from = trip_tf_editor_evaluate(e, c.value(x));
        const trip_rgba to = trip_tf_editor_evaluate(e, c.value(x + 1));
        list->AddLine(ImVec2(x, c.hi.y), ImVec2(x, c.y(from.opacity)), colour_of(from, 0.45));
        list->AddLine(ImVec2(x, c.y(from.opacity)), ImVec2(x + 1, c.y(to.opacity)),
                      colour_of(from, 1), 1.5f);
    }
}

void draw_points(ImDrawList *list, const Canvas &c, const trip_panel *p, const trip_tf_editor *e)
{
    size_t count;
    const trip_tf_point *points = trip_tf_editor_points(e, &count);
    const float r = 4 * static_cast<float>(p->scale);
    for (size_t i = 0; i < count; i++) {
        const ImVec2 at(c.x(points[i].value), c.y(points[i].colour.opacity));
        if (at.x < c.lo.x - 1 || at.x > c.hi.x + 1)
            continue;
        list->AddCircleFilled(at, r, colour_of(points[i].colour, 1));
        list->AddCircle(
            at, r, static_cast<int>(i) == p->point ? IM_COL32_WHITE : IM_COL32(200, 200, 200, 160));
    }
}

void edit_points(trip_panel *p, const Canvas &c, trip_document *d)
{
    trip_tf_editor *e = d->editor;
    const ImVec2 at = ImGui::GetIO().MousePos;
    const double reach = 8 * p->scale, width = static_cast<double>(c.hi.x - c.lo.x);
    const double value = c.value(at.x), opacity = c.opacity(at.y);
    auto nearest = [&] {
        size_t count;
        int found = -1;
        double best = reach * reach;
        const trip_tf_point *points = trip_tf_editor_points(e, &count);
        for (size_t i = 0; i < count; i++) {
            const double dx = static_cast<double>(c.x(points[i].value) - at.x);
            const double dy = static_cast<double>(c.y(points[i].colour.opacity) - at.y);
            if (dx * dx + dy * dy <= best) {
                best = dx * dx + dy * dy;
                found = static_cast<int>(i);
            }
        }
        return found;
    };
    (void)width;
    if (ImGui::IsItemHovered() && ImGui::IsMouseClicked(0)) {
        trip_tf_editor_begin(e);
        p->dragging = true;
        p->point = nearest();
        if (p->point < 0) {
            p->point = trip_tf_editor_add(e, value, opacity);
            d->edited = true;
        }
    }
    if (p->dragging && ImGui::IsMouseDragging(0, 1)) {
        trip_tf_editor_move(e, p->point, value, opacity);
        d->edited = true;
    }
    if (p->dragging && !ImGui::IsMouseDown(0)) {
        trip_tf_editor_end(e);
        p->dragging = false;
    }
    if (ImGui::IsItemHovered() && ImGui::IsMouseClicked(1) && !p->dragging) {
        const int found = nearest();
        if (found >= 0) {
            trip_tf_editor_remove(e, found);
            d->edited = true;
            p->point = -1;
        }
    }
}

void draw_editor(trip_panel *p, trip_document *d)
{
    const float height = 120 * static_cast<float>(p->scale);
    Canvas c;
    c.lo = ImGui::GetCursorScreenPos();
    c.hi = ImVec2(c.lo.x + ImGui::GetContentRegionAvail().x, c.lo.y + height);
    c.value_lo = d->info.typical_min;
    c.value_hi = d->info.typical_max > c.value_lo ? d->info.typical_max : c.value_lo + 1;
    ImGui::InvisibleButton("Function editor", ImVec2(c.hi.x - c.lo.x, height),
                           ImGuiButtonFlags_MouseButtonLeft | ImGuiButtonFlags_MouseButtonRight);
    mark(p, "Function editor", false);
    ImDrawList *list = ImGui::GetWindowDrawList();
    list->AddRectFilled(c.lo, c.hi, IM_COL32(24, 25, 29, 255));
    list->PushClipRect(c.lo, c.hi, true);
    draw_histogram(list, c, d->histogram);
    draw_curve(list, c, d->editor);
    draw_points(list, c, p, d->editor);
    list->PopClipRect();
    edit_points(p, c, d);
    if (ImGui::IsItemHovered())
        ImGui::SetTooltip("%.6g, opacity %.3g\ndrag points; click adds one; right click removes",
                          c.value(ImGui::GetIO().MousePos.x), c.opacity(ImGui::GetIO().MousePos.y));
    ImGui::Text("%.6g", c.value_lo);
    char text[32];
    std::snprintf(text, sizeof text, "%.6g", c.value_hi);
    ImGui::SameLine(ImGui::GetContentRegionAvail().x - ImGui::CalcTextSize(text).x);
    ImGui::TextUnformatted(text);
}

void draw_point(trip_panel *p, trip_document *d)
{
    size_t count;
    const trip_tf_point *points = trip_tf_editor_points(d->editor, &count);
    if (p->point < 0 || static_cast<size_t>(p->point) >= count)
        return;
    const trip_rgba c = points[p->point].colour;
    float rgb[3] = { static_cast<float>(c.r), static_cast<float>(c.g), static_cast<float>(c.b) };
    const bool changed = ImGui::ColorEdit3("Colour", rgb);
    if (ImGui::IsItemActivated())
        trip_tf_editor_begin(d->editor);
    mark_beside(p, "Colour", changed);
    if (changed) {
        trip_tf_editor_set_colour(d->editor, p->point, static_cast<double>(rgb[0]),
                                  static_cast<double>(rgb[1]), static_cast<double>(rgb[2]));
        d->edited = true;
    }
    if (ImGui::IsItemDeactivated())
        trip_tf_editor_end(d->editor);
}

void draw_presets(trip_panel *p, trip_viewer *v, trip_document *d)
{
    const char *now = d->edited ? "edited" : d->function ? d->function : "Default of the data set";
    const bool open = ImGui::BeginCombo("Preset", now);
    mark_beside(p, "Preset", open);
    if (!open)
        return;
    if (mark(p, "Default of the data set", ImGui::Selectable("Default of the data set")))
        trip_viewer_set_function(v, nullptr);
    triptych_preset preset;
    for (unsigned i = 0; triptych_get_preset(i, &preset); i++) {
        if (mark(p, preset.name, ImGui::Selectable(preset.name)))
            trip_viewer_set_function(v, preset.name);
        if (ImGui::IsItemHovered())
            ImGui::SetTooltip("%s", preset.summary);
    }
    ImGui::EndCombo();
}

void draw_function_file(trip_panel *p, trip_viewer *v, trip_document *d)
{
    char line[600];
    ImGui::InputText("File", p->path, sizeof p->path);
    mark_beside(p, "File", false);
    if (button(p, "Load") && p->path[0])
        trip_viewer_set_function(v, p->path);
    ImGui::SameLine();
    if (button(p, "Save") && p->path[0]) {
        const bool wrote = trip_tf_editor_save(d->editor, p->path) == 0;
        std::snprintf(line, sizeof line, wrote ? "wrote %s" : "cannot write %s", p->path);
        trip_viewer_say(v, line);
    }
}

// Offers to brick again if the transfer function reveals dropped voxels.
void draw_left_out(trip_panel *p, trip_viewer *v, trip_document *d)
{
    if (!v->maker)
        return;
    const trip_maker_status s = trip_maker_get_status(v->maker);
    if (d->small)
        return;
    if (s.busy && s.document == d->number) {
        char text[64];
        std::snprintf(text, sizeof text, "bricking: %s %.0f %%", s.stage, 100 * s.done);
        ImGui::ProgressBar(static_cast<float>(s.done), ImVec2(-1, 0), text);
    } else if (v->status.left_out && v->status.document == d->number) {
        ImGui::TextWrapped("The transfer function reveals voxels that bricking dropped.");
        if (button(p, "Brick again with all voxels"))
            trip_viewer_brick_again(v);
    }
}

void draw_function(trip_panel *p, trip_viewer *v, trip_document *d)
{
    draw_presets(p, v, d);
    draw_left_out(p, v, d);
    draw_editor(p, d);
    draw_point(p, d);
    if (button(p, "Undo") && trip_tf_editor_can_undo(d->editor)) {
        trip_tf_editor_undo(d->editor);
        d->edited = true;
    }
    ImGui::SameLine();
    if (button(p, "Redo") && trip_tf_editor_can_redo(d->editor)) {
        trip_tf_editor_redo(d->editor);
        d->edited = true;
    }
    v->changed |= draw_opacity(p, d);
    draw_function_file(p, v, d);
}

// ---- scenes ----

bool choose_of_scene(trip_panel *p, trip_document *d, const trip_scene_choice &choice)
{
    trip_scene_entry entries[TRIP_SCENE_ENTRIES];
    const char *names[TRIP_SCENE_ENTRIES];
    int chosen;
    const int count = trip_scene_entries(&choice, &d->scene, &d->settings, entries, &chosen);
    for (int i = 0; i < count; i++)
        names[i] = entries[i].label;
    if (count < 2 || !choose(p, choice.label, &chosen, names, count))
        return false;
    trip_scene_choose(&choice, &entries[chosen], &d->settings);
    return true;
}

bool draw_scene(trip_panel *p, trip_document *d)
{
    bool changed = false;
    for (const trip_scene_choice &choice : trip_scene_choices)
        changed |= choose_of_scene(p, d, choice);
    changed |= draw_opacity(p, d);
    changed |= draw_background(p, &d->settings);
    return changed;
}

// ---- light, quality ----

bool draw_light_position(trip_panel *p, trip_document *d)
{
    bool turns = trip_light_control_of(&d->settings, &d->info).turns;
    const bool switched = check(p, "Light turns with the view", &turns);
    if (switched)
        trip_light_set_turns(&d->settings, &d->info, &d->navigation, turns);
    trip_light_control c = trip_light_control_of(&d->settings, &d->info);
    const bool far = c.distance >= TRIP_LIGHT_FARTHEST;
    bool changed = slide(p, "Light azimuth", &c.round, -180, 180, "%.0f°");
    changed |= slide(p, "Light elevation", &c.up, -89, 89, "%.0f°");
    if (!turns)
        changed |= slide(p, "Light distance", &c.distance, TRIP_LIGHT_NEAREST, TRIP_LIGHT_FARTHEST,
                         far ? "far away" : "%.2f", ImGuiSliderFlags_Logarithmic);
    if (changed)
        trip_light_control_set(&d->settings, &d->info, &c);
    return changed || switched;
}

bool draw_effect_numbers(trip_panel *p, draw_settings *s, const trip_effect_switch &below)
{
    bool changed = false;
    for (const trip_effect_number &n : trip_effect_numbers) {
        double value = trip_effect_number_get(&n, s);
        const char *format = !std::strcmp(n.unit, "K") ? "%.0f K"
                             : n.unit[0]               ? "%.1f px"
                             : n.whole                 ? "%.0f"
                                                       : "%.2f";
        if (trip_effect_number_is_below(&n, &below, s) &&
            slide(p, n.label, &value, n.lo, n.hi, format))
            changed |= trip_effect_number_set(&n, n.whole ? std::round(value) : value, s);
    }
    return changed;
}

bool draw_effects(trip_panel *p, trip_document *d)
{
    draw_settings *s = &d->settings;
    const char *heat = trip_viewer_heat(d);
    const draw_settings shown = trip_viewer_settings(d);
    char text[256];
    bool changed = false;
    for (const trip_effect_switch &e : trip_effect_switches) {
        if (!trip_effect_applies(&e, d->kind))
            continue;
        const char *lacks = trip_effect_lacks(&e, s, heat);
        bool on = (s->effects.which & e.bit) != 0;
        if (lacks) {
            ImGui::TextDisabled("%s: %s.", e.label, lacks);
            continue;
        }
        if (check(p, e.label, &on))
            changed |= trip_effect_turn(&e, on, s, heat);
        if (on)
            changed |= draw_effect_numbers(p, s, e);
    }
    trip_effects_say(&shown, heat, text, sizeof text);
    if (text[0])
        ImGui::TextWrapped("Active: %s", text);
    return changed;
}

bool draw_light(trip_panel *p, trip_document *d)
{
    draw_settings *s = &d->settings;
    const bool lit = d->kind == DRAW_KIND_VOLUME || d->scene.lit;
    bool changed = false, shading = trip_light_shades(s, lit), head = trip_light_is_head(s);
    if (check(p, "Shading", &shading)) {
        trip_light_set_shading(s, lit, shading);
        changed = true;
    }
    if (check(p, "Light from the eye", &head)) { // also lights effects
        trip_light_set_head(s, head);
        changed = true;
    }
    if (!head)
        changed |= draw_light_position(p, d);
    return changed;
}

// Settings of interpolation and of the choice by error.
bool draw_quality_of_volume(trip_panel *p, draw_settings *s)
{
    static const char *const qualities[] = { "Draft", "Normal", "High", "Exact" };
    static const char *const classes[] = { "Automatic", "Pre (splats)", "Post (interpolation)" };
    static const int normal = TRIPTYCH_QUALITY_NORMAL;
    bool changed = choose_setting(p, "Quality preset", &s->all.quality, qualities, 4, normal);
    changed |= choose(p, "Classification", &s->all.classify, classes, 3);
    if (draw_settings_may_use_sheets(s)) {
        static const char *const values[] = { "Automatic", "Linear", "Cubic", "Gaussian",
                                              "Nearest (labels)" };
        changed |= choose(p, "Interpolation", &s->all.interpolation, values, 5);
        int samples = s->sheet.samples > 0 ? s->sheet.samples : 0;
        changed |= mark_beside(
            p, "Samples per sheet",
            ImGui::SliderInt("Samples per sheet", &samples, 0, 16, samples ? "%d" : "automatic"));
        s->sheet.samples = samples;
    }
    return changed;
}

bool draw_level(trip_panel *p, draw_settings *s)
{
    // The leftmost position is automatic. 0 px stands for the finest level.
    double lod = s->lod.voxel_px == TRIPTYCH_ZERO ? 0
                 : s->lod.voxel_px > 0            ? s->lod.voxel_px
                                                  : -0.1;
    const bool changed =
        slide(p, "Level of detail", &lod, -0.1, 8, lod < 0 ? "automatic" : "%.1f px");
    if (changed)
        s->lod.voxel_px = lod < -0.05 ? 0 : lod < 0.05 ? TRIPTYCH_ZERO : lod;
    return changed;
}

bool draw_quality(trip_panel *p, trip_document *d)
{
    draw_settings *s = &d->settings;
    bool changed = d->kind == DRAW_KIND_VOLUME && draw_quality_of_volume(p, s);
    if (d->kind != DRAW_KIND_OBJECTS && draw_settings_applies(s, DRAW_LOD, d->kind))
        changed |= draw_level(p, s);
    int rays = s->all.samples > 0 ? s->all.samples : 0;
    changed |=
        mark_beside(p, "Antialiasing",
                    ImGui::SliderInt("Antialiasing", &rays, 0, 4, rays ? "%d" : "automatic"));
    s->all.samples = rays;
    return changed;
}

// Draws a slider with the default at its leftmost position.
bool slide_or_default(trip_panel *p, const char *label, double *value, double step, double hi,
                      const char *format)
{
    double shown = *value == 0 ? -step : *value == TRIPTYCH_ZERO ? 0 : *value;
    const bool changed = slide(p, label, &shown, -step, hi, shown < 0 ? "automatic" : format);
    if (changed)
        *value = shown < 0 ? 0 : shown > 0 ? shown : TRIPTYCH_ZERO;
    return changed;
}

// Settings by which the papers' methods differ.
bool draw_papers(trip_panel *p, trip_document *d)
{
    draw_settings *s = &d->settings;
    static const char *const methods[] = { "Merge", "Clip", "Axis" };
    static const char *const sums[] = { "Per splat", "Per sheet" };
    static const int merge = TRIPTYCH_METHOD_MERGE, by_splat = TRIPTYCH_COMPOSITING_SPLAT;
    bool changed = false;
    if (draw_settings_applies(s, DRAW_METHOD, d->kind))
        changed |= choose_setting(p, "Method", &s->all.method, methods, 3, merge);
    if (s->all.method <= TRIPTYCH_METHOD_MERGE && draw_settings_applies(s, DRAW_H, d->kind))
        changed |= slide_or_default(p, "Blend start (h)", &s->all.h, 0.01, 0.99, "%.2f");
    changed |=
        slide_or_default(p, "Early termination", &s->all.early_termination, 0.001, 0.1, "%.3f");
    if (d->kind == DRAW_KIND_VOLUME && draw_settings_classify(s) != TRIPTYCH_CLASSIFY_POST) {
        double radius = s->splat.kernel_radius > 0 ? s->splat.kernel_radius : 2;
        changed |= choose_setting(p, "Compositing", &s->splat.compositing, sums, 2, by_splat);
        if (slide(p, "Kernel radius", &radius, 1.5, 6, "%.2f voxels")) {
            s->splat.kernel_radius = radius;
            changed = true;
        }
    }
    return changed;
}

// The debug views of the papers.
bool draw_shown(trip_panel *p, trip_document *d)
{
    static const char *const shown[] = { "Off", "Lists", "Merge weights", "Levels of detail" };
    static const char *const legends[] = { "", "list: X red, Y green, Z blue",
                                           "weight: X red, Y green, Z blue",
                                           "finest white, then blue, green, yellow, ..." };
    static const int off = TRIPTYCH_SHOW_PICTURE;
    draw_settings *s = &d->settings;
    const bool changed = choose_setting(p, "Debug view", &s->all.show, shown, 4, off);
    if (s->all.show > TRIPTYCH_SHOW_PICTURE)
        ImGui::TextDisabled("%s", legends[s->all.show - TRIPTYCH_SHOW_PICTURE]);
    return changed;
}

// A box of voxels has a slider for each face. So has the box of a scene, in world units.
bool draw_clip_box(trip_panel *p, trip_document *d)
{
    static const char *const labels[2][3][2] = {
        { { "i min", "i max" }, { "j min", "j max" }, { "k min", "k max" } },
        { { "x min", "x max" }, { "y min", "y max" }, { "z min", "z max" } },
    };
    const bool is_scene = d->kind != DRAW_KIND_VOLUME;
    triptych_clip *c = &d->settings.clip;
    triptych_clip all = {};
    bool changed = check(p, "Clip box", &c->box);
    trip_clipping_box_of_all(&all, &d->info, is_scene);
    if (changed && c->box && !(c->box_lo[0] < c->box_hi[0]))
        trip_clipping_box_of_all(c, &d->info, is_scene);
    for (int i = 0; i < 6 && c->box && (c->box_of_voxels || is_scene); i++) {
        const int axis = i / 2, face = i % 2;
        double position = face ? c->box_hi[axis] : c->box_lo[axis];
        if (slide(p, labels[is_scene ? 1 : 0][axis][face], &position, all.box_lo[axis],
                  all.box_hi[axis], is_scene ? "%.4g" : "%.1f")) {
            trip_clipping_set_face(c, axis, face, position,
                                   is_scene ? (all.box_hi[axis] - all.box_lo[axis]) / 1e4 : 0.01);
            changed = true;
        }
    }
    return changed;
}

bool draw_clip_plane(trip_panel *p, trip_document *d, int plane)
{
    triptych_clip *c = &d->settings.clip;
    char label[32];
    double depth = trip_clipping_depth(c, plane, &d->info);
    std::snprintf(label, sizeof label, "Plane %d", plane + 1);
    bool changed = slide(p, label, &depth, -1, 1, "%.3f");
    if (changed)
        trip_clipping_set_depth(c, plane, &d->info, depth);
    std::snprintf(label, sizeof label, "Flip %d", plane + 1);
    if (button(p, label)) {
        trip_clipping_flip_plane(c, plane);
        changed = true;
    }
    ImGui::SameLine();
    std::snprintf(label, sizeof label, "Remove %d", plane + 1);
    if (button(p, label)) {
        trip_clipping_remove_plane(c, plane);
        changed = true;
    }
    return changed;
}

bool draw_clipping(trip_panel *p, trip_document *d)
{
    triptych_clip *c = &d->settings.clip;
    bool changed = check(p, "Clip the data", &d->clips);
    if (!d->clips)
        return changed;
    changed |= draw_clip_box(p, d);
    for (int i = 0; i < c->planes; i++)
        changed |= draw_clip_plane(p, d, i);
    if (c->planes < TRIP_CLIPPING_PLANES && d->has_navigation && button(p, "Add plane"))
        changed |= trip_clipping_add_plane(c, &d->navigation);
    return changed;
}

void draw_marks(trip_panel *p, trip_viewer *v, bool is_scene)
{
    check(p, "Box", &v->box);
    ImGui::SameLine();
    check(p, "Axes", &v->axes);
    ImGui::SameLine();
    check(p, "Scale bar", &v->scale_bar);
    if (!is_scene)
        check(p, "Probe", &v->probe);
}

// ---- statistics ----

void draw_memory(trip_panel *p, const triptych_frame_stats &f)
{
    char text[96];
    const double part = f.memory_bytes ? static_cast<double>(f.peak_memory_bytes) /
                                             static_cast<double>(f.memory_bytes)
                                       : 0;
    std::snprintf(text, sizeof text, "peak %s of %s",
                  bytes_text(static_cast<double>(f.peak_memory_bytes)).c_str(),
                  bytes_text(static_cast<double>(f.memory_bytes)).c_str());
    ImGui::ProgressBar(static_cast<float>(part), ImVec2(-70 * static_cast<float>(p->scale), 0),
                       text);
    ImGui::SameLine();
    ImGui::TextUnformatted("Memory");
}

void draw_cached(trip_panel *p, const triptych_frame_stats &f)
{
    char text[96];
    const double all = static_cast<double>(f.bytes_read + f.bytes_cached);
    std::snprintf(text, sizeof text, "%s of %s",
                  bytes_text(static_cast<double>(f.bytes_cached)).c_str(), bytes_text(all).c_str());
    ImGui::ProgressBar(all > 0 ? static_cast<float>(static_cast<double>(f.bytes_cached) / all) : 0,
                       ImVec2(-70 * static_cast<float>(p->scale), 0), text);
    ImGui::SameLine();
    ImGui::TextUnformatted("Cached");
}

void draw_gauges(trip_panel *p, trip_viewer *v, const trip_document *d)
{
    const trip_frames_status &s = v->status;
    const triptych_frame_stats &f = s.stats;
    const draw_settings shown = trip_viewer_settings(d);
    char text[160], level[64] = "";
    float times[TIMES];
    const int count = trip_frames_get_times(v->frames, TIMES, times);
    if (d->kind != DRAW_KIND_VOLUME) {
        trip_scene_say(&d->scene, &shown, nullptr, text, sizeof text);
        ImGui::TextWrapped("%s", text);
    }
    if (!f.memory_bytes) { // no full picture yet
        ImGui::TextDisabled("No picture is complete yet.");
        return;
    }
    draw_memory(p, f);
    if (d->kind == DRAW_KIND_VOLUME) // the system caches the files of a scene
        draw_cached(p, f);
    ImGui::Text(
        "%s read, %s/s; %.3g million %s", bytes_text(static_cast<double>(f.bytes_read)).c_str(),
        bytes_text(f.ms > 0 ? static_cast<double>(f.bytes_read) / f.ms * 1e3 : 0).c_str(),
        static_cast<double>(f.splats) * 1e-6, d->kind != DRAW_KIND_VOLUME ? "drawn" : "splats");
    if (d->kind != DRAW_KIND_OBJECTS && draw_settings_applies(&shown, DRAW_LOD, d->kind))
        std::snprintf(level, sizeof level, ", level of detail %.1f px", s.lod_px);
    ImGui::TextWrapped("moving: %.0f ms, resolution 1/%.1f%s; full: %.0f ms", s.moving_ms,
                       s.scale > 0 ? 1 / s.scale : 1.0, level, s.whole_ms);
    ImGui::PlotLines("##times", times, count, 0, "ms", 0, FLT_MAX,
                     ImVec2(ImGui::GetContentRegionAvail().x, 40 * static_cast<float>(p->scale)));
    ImGui::TextWrapped("%s, %s; %s", s.renderer, s.device, s.engine);
}

void draw_plan(trip_panel *, trip_viewer *v)
{
    char *plan = trip_frames_explain(v->frames);
    ImGui::PushTextWrapPos(0);
    ImGui::TextUnformatted(plan ? plan : "");
    ImGui::PopTextWrapPos();
    std::free(plan);
}

// ---- overlays of the picture ----

ImVec2 at(const double pixel[2])
{
    return ImVec2(static_cast<float>(pixel[0]), static_cast<float>(pixel[1]));
}

void draw_box(ImDrawList *list, trip_viewer *v, const trip_document *d)
{
    trip_annotation_edge edges[TRIP_ANNOTATION_EDGES];
    const trip_annotation_box box = trip_annotation_box_of(&d->info);
    trip_annotation_edges(&box, &d->navigation, v->picture_width, v->height, edges);
    for (const trip_annotation_edge &e : edges)
        if (e.drawn)
            list->AddLine(at(e.from), at(e.to), IM_COL32(255, 255, 255, e.hidden ? 60 : 150));
}

void put_text(ImDrawList *list, const double middle[2], const char *text)
{
    const ImVec2 size = ImGui::CalcTextSize(text);
    const ImVec2 corner(static_cast<float>(middle[0]) - size.x / 2,
                        static_cast<float>(middle[1]) - size.y / 2);
    list->AddText(ImVec2(corner.x + 1, corner.y + 1), IM_COL32(0, 0, 0, 200), text);
    list->AddText(corner, IM_COL32(235, 235, 235, 255), text);
}

void draw_axes(ImDrawList *list, trip_viewer *v, const trip_document *d)
{
    trip_annotation_axis axes[3];
    const trip_annotation_box box = trip_annotation_box_of(&d->info);
    trip_annotation_axes(&box, &d->navigation, v->picture_width, v->height, nullptr, axes);
    for (const trip_annotation_axis &a : axes) {
        for (int i = 0; i < a.count; i++) {
            list->AddLine(at(a.ticks[i].from), at(a.ticks[i].to), IM_COL32(235, 235, 235, 200));
            put_text(list, a.ticks[i].label, a.ticks[i].text);
        }
        if (a.count)
            put_text(list, a.title, a.name);
    }
}

void draw_scale_bar(ImDrawList *list, trip_viewer *v, const trip_document *d, double scale)
{
    const trip_annotation_bar bar = trip_annotation_scale_bar(
        &d->navigation, v->height, trip_navigation_distance(&d->navigation), v->picture_width / 4.0,
        nullptr);
    const float x = 20 * static_cast<float>(scale);
    const float y = static_cast<float>(v->height) - 24 * static_cast<float>(scale);
    const float end = x + static_cast<float>(bar.px), tick = 4 * static_cast<float>(scale);
    const ImU32 white = IM_COL32(235, 235, 235, 255);
    list->AddLine(ImVec2(x, y), ImVec2(end, y), white, 2);
    list->AddLine(ImVec2(x, y - tick), ImVec2(x, y + tick), white, 2);
    list->AddLine(ImVec2(end, y - tick), ImVec2(end, y + tick), white, 2);
    const double middle[2] = { static_cast<double>(x + end) / 2,
                               static_cast<double>(y) - 10 * scale };
    put_text(list, middle, bar.text);
}

void draw_probe(ImDrawList *list, trip_viewer *v, const trip_document *d)
{
    const trip_probed probed = trip_frames_get_probed(v->frames);
    if (!probed.valid || std::memcmp(&probed.navigation, &d->navigation, sizeof d->navigation))
        return;
    const triptych_hit &h = probed.hit;
    const ImVec2 position(static_cast<float>(probed.x), static_cast<float>(probed.y));
    list->AddCircle(position, 5, IM_COL32_WHITE);
    if (ImGui::GetIO().WantCaptureMouse) // the pointer is over the panel or a combo box
        return;
    if (!(h.opacity > 0)) {
        ImGui::SetTooltip("nothing is visible here");
        return;
    }
    ImGui::SetTooltip(
        "value %.6g\nposition %.6g, %.6g, %.6g\nvoxel %.1f, %.1f, %.1f\ndistance from "
        "the eye %.6g, of the first visible point %.6g\nopacity along the ray %.3g",
        h.value, h.position[0], h.position[1], h.position[2], h.index[0], h.index[1], h.index[2],
        h.depth, h.depth_first, h.opacity);
}

// Progress, along the lower edge of the picture.
void draw_progress(ImDrawList *list, trip_viewer *v, double scale)
{
    const trip_frames_status &s = v->status;
    const float y = static_cast<float>(v->height), width = static_cast<float>(v->picture_width);
    if (!s.stage[0] || s.exact)
        return;
    const float thick = 3 * static_cast<float>(scale);
    list->AddRectFilled(ImVec2(0, y - thick), ImVec2(width * static_cast<float>(s.done), y),
                        IM_COL32(80, 160, 255, 220));
    if (!s.open) {
        char text[64];
        std::snprintf(text, sizeof text, "%s: %.0f %%", s.stage, 100 * s.done);
        const double middle[2] = { static_cast<double>(width) / 2, v->height / 2.0 };
        put_text(list, middle, text);
    }
}

// A note while a preview from samples is shown.
void draw_making(ImDrawList *list, trip_viewer *v, const trip_document *d, double scale)
{
    char text[160];
    const trip_maker_status s = trip_maker_get_status(v->maker);
    std::snprintf(text, sizeof text,
                  "preview with %lld x %lld x %lld voxels; bricking the full volume: %s %.0f %%",
                  static_cast<long long>(d->info.dims[0]), static_cast<long long>(d->info.dims[1]),
                  static_cast<long long>(d->info.dims[2]), s.stage, 100 * s.done);
    const double middle[2] = { v->picture_width / 2.0, v->height - 24 * scale };
    put_text(list, middle, text);
}

void draw_message(ImDrawList *list, trip_viewer *v, double scale)
{
    if (!v->message[0])
        return;
    const float wrap = static_cast<float>(v->picture_width) - 40 * static_cast<float>(scale);
    const ImVec2 size = ImGui::CalcTextSize(v->message, nullptr, false, wrap);
    const float pad = 8 * static_cast<float>(scale);
    const ImVec2 corner(20 * static_cast<float>(scale), 16 * static_cast<float>(scale));
    const ImU32 ground = v->status.failed ? IM_COL32(120, 24, 24, 235) : IM_COL32(30, 32, 38, 225);
    list->AddRectFilled(ImVec2(corner.x - pad, corner.y - pad),
                        ImVec2(corner.x + size.x + pad, corner.y + size.y + pad), ground, 4);
    list->AddText(ImGui::GetFont(), ImGui::GetFontSize(), corner, IM_COL32_WHITE, v->message,
                  nullptr, wrap);
}

void draw_keys(trip_viewer *v)
{
    static const char *const keys[][2] = {
        { "left drag", "orbit" },
        { "shift left drag, middle drag", "pan" },
        { "control left drag", "roll" },
        { "wheel", "move closer or farther" },
        { "right drag", "look around" },
        { "w a s d, arrows, page up and down", "fly; with shift, faster" },
        { "f", "fit the visible data into the picture" },
        { "x y z", "look along an axis; with shift, from the other end" },
        { "1 2 3 4 5 6", "front, back, left, right, top, bottom" },
        { "0, home", "the default view" },
        { "o", "switch between perspective and parallel view" },
        { "[ ]", "narrow or widen the field of view" },
        { "b", "show or hide the box" },
        { "p", "write the picture" },
        { "c", "copy the view and the settings as options" },
        { "m", "add the view to the path as a key frame" },
        { "t", "show or hide the panel" },
        { "tab", "next data set" },
        { "F1, ?", "show these keys" },
        { "q", "quit" },
        { "escape", "close this list, or quit" },
    };
    ImGui::SetNextWindowPos(
        ImVec2(static_cast<float>(v->width) / 2, static_cast<float>(v->height) / 2), 0,
        ImVec2(0.5f, 0.5f));
    ImGui::Begin("Keys", nullptr,
                 ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_AlwaysAutoResize |
                     ImGuiWindowFlags_NoCollapse | ImGuiWindowFlags_NoMove);
    if (ImGui::BeginTable("keys", 2)) {
        for (const auto &line : keys) {
            ImGui::TableNextRow();
            ImGui::TableNextColumn();
            ImGui::TextUnformatted(line[0]);
            ImGui::TableNextColumn();
            ImGui::TextUnformatted(line[1]);
        }
        ImGui::EndTable();
    }
    ImGui::End();
}

void draw_over(trip_panel *p, trip_viewer *v)
{
    const trip_document *d = trip_viewer_document(v);
    ImDrawList *list = ImGui::GetBackgroundDrawList();
    list->PushClipRect(ImVec2(0, 0),
                       ImVec2(static_cast<float>(v->picture_width), static_cast<float>(v->height)));
    if (d && d->opened && d->has_navigation) {
        if (v->box)
            draw_box(list, v, d);
        if (v->axes)
            draw_axes(list, v, d);
        if (v->scale_bar)
            draw_scale_bar(list, v, d, p->scale);
        if (v->probe && d->kind == DRAW_KIND_VOLUME)
            draw_probe(list, v, d);
    }
    draw_progress(list, v, p->scale);
    if (d && d->opened && d->small && v->maker)
        draw_making(list, v, d, p->scale);
    list->PopClipRect();
    draw_message(ImGui::GetForegroundDrawList(), v, p->scale);
    if (v->keys)
        draw_keys(v);
}

// ---- the whole panel ----

void draw_document(trip_panel *p, trip_viewer *v, trip_document *d)
{
    if (section(p, "View"))
        draw_view(p, v, d);
    if (!d->opened)
        return;
    if (d->kind != DRAW_KIND_VOLUME && section(p, "Scene"))
        v->changed |= draw_scene(p, d);
    if (d->kind == DRAW_KIND_VOLUME && section(p, "Transfer function"))
        draw_function(p, v, d);
    if ((d->kind == DRAW_KIND_VOLUME || d->kind == DRAW_KIND_CLOUD) && section(p, "Light")) {
        v->changed |= draw_light(p, d);
        v->changed |= d->kind == DRAW_KIND_VOLUME && draw_background(p, &d->settings);
    }
    if (d->kind != DRAW_KIND_OBJECTS && section(p, "Effects", d->settings.effects.which != 0))
        v->changed |= draw_effects(p, d);
    if (section(p, "Quality"))
        v->changed |= draw_quality(p, d);
    if (section(p, "Variants of the papers", false))
        v->changed |= draw_papers(p, d);
    if (section(p, "Clipping", false))
        v->changed |= draw_clipping(p, d);
    if (section(p, "Show")) {
        v->changed |= d->kind == DRAW_KIND_VOLUME && draw_shown(p, d);
        draw_marks(p, v, d->kind != DRAW_KIND_VOLUME);
    }
    if (section(p, "Statistics"))
        draw_gauges(p, v, d);
    if (section(p, "Plan", false))
        draw_plan(p, v);
}

void draw_panel(trip_panel *p, trip_viewer *v)
{
    const float left = static_cast<float>(v->picture_width < v->width ? v->picture_width
                                                                      : v->width - 330 * p->scale);
    ImGui::SetNextWindowPos(ImVec2(left, 0));
    ImGui::SetNextWindowSize(
        ImVec2(static_cast<float>(v->width) - left, static_cast<float>(v->height)));
    ImGui::Begin("Panel", nullptr,
                 ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoMove |
                     ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoCollapse |
                     ImGuiWindowFlags_NoTitleBar);
    ImGui::PushItemWidth(170 * static_cast<float>(p->scale));
    if (section(p, "Data"))
        draw_documents(p, v);
    trip_document *d = trip_viewer_document(v);
    if (d)
        draw_document(p, v, d);
    ImGui::Separator();
    if (button(p, "Write picture"))
        trip_viewer_take_picture(v);
    ImGui::SameLine();
    if (button(p, "Copy options"))
        trip_viewer_copy_options(v);
    ImGui::SameLine();
    if (button(p, "Keys"))
        v->keys = !v->keys;
    ImGui::PopItemWidth();
    ImGui::End();
}

void style(double scale)
{
    ImGuiIO &io = ImGui::GetIO();
    static const char font[] = "/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf";
    ImGui::StyleColorsDark();
    ImGui::GetStyle().WindowRounding = 0;
    ImGui::GetStyle().FrameRounding = 3;
    ImGui::GetStyle().ScaleAllSizes(static_cast<float>(scale));
    ImFontConfig config;
    config.SizePixels = std::floor(13 * static_cast<float>(scale));
    if (access(font, R_OK) == 0)
        io.Fonts->AddFontFromFileTTF(font, config.SizePixels);
    else
        io.Fonts->AddFontDefault(&config);
}

void map_keys(ImGuiIO &io)
{
    io.KeyMap[ImGuiKey_Tab] = TRIP_KEY_TAB;
    io.KeyMap[ImGuiKey_LeftArrow] = TRIP_KEY_LEFT;
    io.KeyMap[ImGuiKey_RightArrow] = TRIP_KEY_RIGHT;
    io.KeyMap[ImGuiKey_UpArrow] = TRIP_KEY_UP;
    io.KeyMap[ImGuiKey_DownArrow] = TRIP_KEY_DOWN;
    io.KeyMap[ImGuiKey_Home] = TRIP_KEY_HOME;
    io.KeyMap[ImGuiKey_End] = TRIP_KEY_END;
    io.KeyMap[ImGuiKey_Delete] = TRIP_KEY_DELETE;
    io.KeyMap[ImGuiKey_Backspace] = TRIP_KEY_BACKSPACE;
    io.KeyMap[ImGuiKey_Enter] = TRIP_KEY_ENTER;
    io.KeyMap[ImGuiKey_Escape] = TRIP_KEY_ESCAPE;
    io.KeyMap[ImGuiKey_A] = 'a';
    io.KeyMap[ImGuiKey_C] = 'c';
    io.KeyMap[ImGuiKey_V] = 'v';
    io.KeyMap[ImGuiKey_X] = 'x';
    io.KeyMap[ImGuiKey_Y] = 'y';
    io.KeyMap[ImGuiKey_Z] = 'z';
}

} // namespace

int trip_panel_create(trip_panel **out, double scale)
{
    trip_panel *p = *out = new (std::nothrow) trip_panel();
    if (!p)
        return trip_fail(TRIP_ERROR, "view", "panel", "out of memory");
    p->scale = scale;
    p->point = -1;
    p->context = ImGui::CreateContext();
    ImGui::GetIO().IniFilename = nullptr;
    map_keys(ImGui::GetIO());
    style(scale);
    if (ImGui_ImplOpenGL3_Init("#version 150"))
        return 0;
    ImGui::DestroyContext(p->context);
    delete p;
    *out = nullptr;
    return trip_fail(TRIP_ERROR, "view", "panel", "Dear ImGui cannot use this OpenGL context");
}

void trip_panel_destroy(trip_panel *p)
{
    if (!p)
        return;
    ImGui_ImplOpenGL3_Shutdown();
    ImGui::DestroyContext(p->context);
    delete p;
}

void trip_panel_event(trip_panel *, const trip_event *e)
{
    ImGuiIO &io = ImGui::GetIO();
    switch (e->kind) {
    case TRIP_EVENT_MOVE:
        io.MousePos = ImVec2(static_cast<float>(e->x), static_cast<float>(e->y));
        break;
    case TRIP_EVENT_BUTTON:
        if (e->code >= 0 && e->code < TRIP_BUTTONS)
            io.MouseDown[e->code] = e->down;
        break;
    case TRIP_EVENT_WHEEL:
        io.MouseWheel += static_cast<float>(e->y);
        break;
    case TRIP_EVENT_KEY:
        if (e->code >= 0 && e->code < TRIP_KEYS)
            io.KeysDown[e->code] = e->down;
        break;
    case TRIP_EVENT_TEXT:
        io.AddInputCharacter(static_cast<unsigned>(e->code));
        break;
    default:
        break;
    }
    io.KeyShift = e->modifiers & TRIP_SHIFT;
    io.KeyCtrl = e->modifiers & TRIP_CONTROL;
    io.KeyAlt = e->modifiers & TRIP_ALT;
}

bool trip_panel_has_pointer(const trip_panel *)
{
    return ImGui::GetIO().WantCaptureMouse;
}

bool trip_panel_has_keys(const trip_panel *)
{
    return ImGui::GetIO().WantTextInput;
}

void trip_panel_draw(trip_panel *p, trip_viewer *v, double seconds)
{
    ImGuiIO &io = ImGui::GetIO();
    io.DisplaySize = ImVec2(static_cast<float>(v->width), static_cast<float>(v->height));
    io.DeltaTime = seconds > 1e-4 ? static_cast<float>(seconds) : 1e-4f;
    p->boxes.clear();
    ImGui_ImplOpenGL3_NewFrame();
    ImGui::NewFrame();
    draw_over(p, v);
    if (v->panel)
        draw_panel(p, v);
    ImGui::Render();
    ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
}

bool trip_panel_find(trip_panel *p, const char *label, double box[4])
{
    const auto found = p->boxes.find(label);
    if (found == p->boxes.end())
        return false;
    const Box &b = found->second;
    p->sought = b.seen ? "" : label;
    box[0] = static_cast<double>(b.lo.x);
    box[1] = static_cast<double>(b.lo.y);
    box[2] = static_cast<double>(b.hi.x);
    box[3] = static_cast<double>(b.hi.y);
    return b.seen;
}

int trip_panel_labels(const trip_panel *p, const char *labels[TRIP_PANEL_LABELS])
{
    int count = 0;
    for (const auto &box : p->boxes)
        if (count < TRIP_PANEL_LABELS)
            labels[count++] = box.first.c_str();
    return count;
}
