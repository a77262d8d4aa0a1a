// Draws segments between sheets into a band of a layer, front to back, with one invocation for each
// pixel (render/sheet.h).
// In: codes and gradients of the sheets, with BLURRED their deviations, segment ends in draw order.
// In and out: the layer, and with DEPTH its depths (render/layer.h).
// Mirrors render/reference/reference_sheets.c.
#include "segments.glsl"
#include "blurred.glsl"
#include "effects.glsl"
#include "shade.glsl"
#include "opacity.glsl"
#include "weight.glsl"
#include "no_code.glsl"

layout(local_size_x = TRIP_GL_SQUARE_GROUP, local_size_y = TRIP_GL_SQUARE_GROUP) in;

struct trip_gl_sheet_end {
    TRIP_GL_SHEET_END_FIELDS(int, float)
};
layout(std140, binding = TRIP_GL_SHEET_PASS) uniform trip_gl_sheet_pass
{
    TRIP_GL_SHEET_PASS_FIELDS(vec4, ivec4)
};
layout(std140, binding = TRIP_GL_SHEET_ENDS) uniform trip_gl_sheet_ends
{
    trip_gl_sheet_end ends[TRIP_GL_ENDS_MAX];
};
layout(binding = TRIP_GL_SHEET_CODES) uniform sampler2DArray codes;
layout(rgba32f, binding = TRIP_GL_IMAGE) uniform image2D layer;
#ifdef DEPTH
layout(rgba32f, binding = TRIP_GL_IMAGE_DEPTH) uniform image2D layer_depths;
#endif
#ifdef SHADED
layout(binding = TRIP_GL_SHEET_GRADIENTS) uniform sampler2DArray gradients;
#endif
#ifdef BLURRED
layout(binding = TRIP_GL_SHEET_DEVIATIONS) uniform sampler2DArray deviations;
#endif
#ifdef UNEVEN
// The positions of voxels along u, then along v: whole part and rest.
layout(std430, binding = TRIP_GL_POSITIONS) readonly buffer trip_gl_positions
{
    vec2 positions[];
};
#endif
// x: row of the image at row 0 of the band. y, z: first row and end row of the band. w: number of
// ends.
layout(location = TRIP_GL_ROW) uniform ivec4 rows;

struct ray {
    vec2 shift;    // movement along u and v relative to the ends' reference ray
    float along;   // movement along the list for each unit of depth
    float start;   // parallel views: start along the list
    float world;   // voxel lengths for each unit along the list
#if defined(SHADED) || defined(SHADOWS)
    vec3 eye;        // direction to the eye
    vec3 first, way; // relative to the eye, list axes: point at depth 0, step for each unit of depth
#endif
    float from, to; // depths between which the clipping keeps the ray
};

// Where a ray crosses the plane of an end.
struct position {
    ivec2 cell;
    vec2 part; // fraction within the cell
    bool there; // all voxels of the cell are present
    float code;
#ifdef BLURRED
    float deviation; // divided by 255
#endif
#ifdef NEAREST
    // Where the ray crosses the plane: whole part and rest. nearest_between() sets the voxel.
    ivec2 base;
    vec2 rest;
    ivec3 voxel;
#endif
    vec2 lo, hi; // distances from the grid's sides, negative beyond them
};

ray ray_of(vec2 p)
{
    vec3 q = vec3(1.0, p);
    ray r;
    r.along = dot(along.xyz, q);
    r.shift = vec2(dot(across_u.xyz, q), dot(across_v.xyz, q));
    r.start = 0.0;
    vec4 terms = vec4(1.0, p, p.x * p.x);
    r.world = sqrt(dot(world2_a, terms) + dot(world2_b.xy, p.y * p)) / abs(r.along);
#ifdef PARALLEL
    r.start = dot(start.xyz, q);
#else
    r.shift /= r.along;
#endif
    r.from = -1e30;
    r.to = 1e30;
    for (int i = 0; i < clips.x; i++) {
        float start = dot(clip_start[i].xyz, q), by = dot(clip_along[i].xyz, q);
        if (by > 0.0)
            r.from = max(r.from, -start / by);
        else if (by < 0.0)
            r.to = min(r.to, -start / by);
        else if (start < 0.0)
            r.to = -1e30;
    }
#if defined(SHADED) || defined(SHADOWS)
#ifdef PARALLEL
    vec2 corner = p + screen.xy;
    r.first = (ray_x.xyz * corner.x + ray_y.xyz * corner.y) * ray_x.w;
    r.way = ray_0.xyz;
#else
    r.first = vec3(0.0);
    r.way = ray_0.xyz + (ray_x.xyz * p.x + ray_y.xyz * p.y) * ray_x.w;
#endif
    r.eye = towards_eye(r.way);
#endif
    return r;
}

// Whether the list may have weight at a pixel position (from the image's corner). The merge
// computes the exact weight.
bool may_weigh(vec2 pixel)
{
#if METHOD == 2
    return true;
#else
    vec3 r = camera_r0.xyz + (camera_rx.xyz * pixel.x + camera_ry.xyz * pixel.y);
    return abs(r[int(weight.z)]) >= largest_of(r) * (weight.x - 1e-5);
#endif
}

// Returns the corners of a cell at a sheet, in the order of textureGather().
vec4 corners_at(ivec2 cell, int sheet)
{
    vec2 middle = vec2(cell + 1) / vec2(textureSize(codes, 0).xy);
    return textureGather(codes, vec3(middle, sheet));
}

vec4 corner_weights(vec2 part)
{
    vec2 rest = 1.0 - part;
    return vec4(rest.x * part.y, part.x * part.y, part.x * rest.y, rest.x * rest.y);
}

#ifdef WIDE
// Mirrors render/kernel.c.
vec4 kernel_weights(float x)
{
    if (clips.w == CUBIC)
        return 0.5 * vec4(x * (x * (2.0 - x) - 1.0), x * x * (3.0 * x - 5.0) + 2.0,
                          x * (x * (4.0 - 3.0 * x) + 1.0), x * x * (x - 1.0));
    vec4 d = (x + vec4(1.0, 0.0, -1.0, -2.0)) * (0.5 * CUTOFF);
    vec4 w = max(exp(-0.5 * d * d) - exp(-0.5 * CUTOFF * CUTOFF), 0.0);
    return w / dot(w, vec4(1.0));
}

// One of the 4 x 4 x 4 voxels around a cell: its texel and layer, and its weight.
struct tap {
    ivec3 at;
    float weight;
};

// Returns voxel number n around a position. Beyond the grid its edge repeats. Any other missing
// voxel is replaced by the nearest corner of the cell.
tap tap_of(position at, trip_gl_sheet_end end, vec4 weights[3], int n)
{
    ivec3 i = ivec3(n & 3, n >> 2 & 3, n >> 4);
    int layer = i.z == 0 ? end.outer_before : i.z == 1 ? end.before : i.z == 2 ? end.behind : end.outer_behind;
    ivec2 voxel = clamp(at.cell + i.xy - 1, clips.yz, extent.zw);
    tap t;
    t.at = ivec3(voxel, layer);
    t.weight = weights[0][i.x] * weights[1][i.y] * weights[2][i.z];
    bool there = layer >= 0 && all(greaterThanEqual(voxel, ivec2(0))) && all(lessThan(voxel, extent.xy));
    if (!there || texelFetch(codes, t.at, 0).r < NO_CODE)
        t.at = ivec3(at.cell + ivec2(greaterThan(i.xy, ivec2(1))), i.z > 1 ? end.behind : end.before);
    return t;
}

// Sums differences from a corner. If all voxels have one value, the result is that value exactly,
// whatever the weights round to.
float wide_code(position at, trip_gl_sheet_end end, float corner)
{
    vec4 weights[3] = vec4[3](kernel_weights(at.part.x), kernel_weights(at.part.y), kernel_weights(end.part));
    float sum = 0.0;
    for (int n = 0; n < 64; n++) {
        tap t = tap_of(at, end, weights, n);
        sum += t.weight * (texelFetch(codes, t.at, 0).r - corner);
    }
    return corner + sum;
}

#ifdef BLURRED
float wide_deviation(position at, trip_gl_sheet_end end)
{
    vec4 weights[3] = vec4[3](kernel_weights(at.part.x), kernel_weights(at.part.y), kernel_weights(end.part));
    float sum = 0.0;
    for (int n = 0; n < 64; n++) {
        tap t = tap_of(at, end, weights, n);
        sum += t.weight * texelFetch(deviations, t.at, 0).r;
    }
    return clamp(sum, 0.0, 1.0);
}
#endif
#endif

#ifdef BLURRED
float sheet_deviation(position at, int sheet)
{
    vec2 middle = vec2(at.cell + 1) / vec2(textureSize(deviations, 0).xy);
    return dot(corner_weights(at.part), textureGather(deviations, vec3(middle, sheet)));
}

// Interpolates the deviation of a sample. All corners of its cell are present.
float deviation_of(position at, trip_gl_sheet_end end)
{
#ifdef WIDE
    return wide_deviation(at, end);
#else
    float before = sheet_deviation(at, end.part < 1.0 ? end.before : end.behind);
    if (end.part > 0.0 && end.part < 1.0)
        return mix(before, sheet_deviation(at, end.behind), end.part);
    return before;
#endif
}
#endif

#ifdef UNEVEN
// Returns the distance of a position beyond the position of a voxel.
float beyond(int voxel, int base, float rest)
{
    return (float(base) - positions[voxel].x) + (rest - positions[voxel].y);
}

// Returns the cell of a position among `count` entries of positions[] starting at `first`. Beyond
// them it returns the nearest cell. Sets `rest` to the fraction within the cell.
int find_cell(int first, int count, int base, inout float rest)
{
    int lo = 0, hi = count - 1;
    if (hi < 1)
        return -1;
    while (hi - lo > 1) {
        int middle = (lo + hi) / 2;
        if (beyond(first + middle, base, rest) >= 0.0)
            lo = middle;
        else
            hi = middle;
    }
    float before = beyond(first + lo, base, rest), behind = beyond(first + hi, base, rest);
    rest = clamp(before / (before - behind), 0.0, 1.0);
    return lo;
}
#endif

// Finds the cell of a position, given as whole part and rest, and the fraction within the cell.
void place(ivec2 base, vec2 p, inout position at)
{
#ifdef UNEVEN
    at.lo = vec2(beyond(0, base.x, p.x), beyond(extent.x, base.y, p.y));
    at.hi = -vec2(beyond(extent.x - 1, base.x, p.x), beyond(extent.x + extent.y - 1, base.y, p.y));
    at.cell = ivec2(find_cell(0, extent.x, base.x, p.x), find_cell(extent.x, extent.y, base.y, p.y));
    at.part = p;
#else
    vec2 whole = floor(p);
    at.cell = base + ivec2(whole);
    at.part = p - whole;
    at.lo = vec2(base - clips.yz) + p;
    at.hi = vec2(extent.zw - base) - p;
    // Beyond a side of the grid, the nearest position in the grid counts. The last voxels of the
    // grid belong to the last cell.
    for (int i = 0; i < 2; i++)
        if (at.cell[i] >= extent[2 + i]) {
            at.cell[i] = extent[2 + i] - 1;
            at.part[i] = 1.0;
        } else if (at.cell[i] < clips[1 + i]) {
            at.cell[i] = clips[1 + i];
            at.part[i] = 0.0;
        }
#endif
    at.there = false;
    at.code = 0.0;
#ifdef BLURRED
    at.deviation = 0.0;
#endif
}

bool is_within(ivec2 cell)
{
    return all(greaterThanEqual(cell, ivec2(0))) && all(lessThan(cell + 1, extent.xy));
}

position position_at(ray r, trip_gl_sheet_end end)
{
    position at;
#ifdef PARALLEL
    vec2 p = vec2(end.first_u, end.first_v) + r.shift;
#else
    vec2 p = vec2(end.first_u, end.first_v) + end.along * r.shift;
#endif
    p = clamp(p, -268435456.0, 268435456.0);
    place(ivec2(end.base_u, end.base_v), p, at);
#ifdef NEAREST
    at.base = ivec2(end.base_u, end.base_v);
    at.rest = p;
    return at;
#endif
#ifdef UNEVEN
    // Voxels that were not read are missing, although the grid goes on.
    for (int i = 0; i < 2; i++)
        if ((at.lo[i] < 0.0 && clips[1 + i] != 0) || (at.hi[i] < 0.0 && extent[2 + i] != extent[i] - 1))
            return at;
#endif
    if (!is_within(at.cell))
        return at;
#ifdef WIDE
    vec4 before = corners_at(at.cell, end.before), behind = corners_at(at.cell, end.behind);
    at.there = all(greaterThanEqual(min(before, behind), vec4(NO_CODE)));
    if (at.there)
        at.code = wide_code(at, end, before.x);
#else
    // At a sheet both sets of corners are that sheet's. As in wide_code(), the sum uses differences
    // from a corner.
    vec4 before = corners_at(at.cell, end.part < 1.0 ? end.before : end.behind), behind = before;
    if (end.part > 0.0 && end.part < 1.0)
        behind = corners_at(at.cell, end.behind);
    at.there = all(greaterThanEqual(min(before, behind), vec4(NO_CODE)));
    vec4 weights = corner_weights(at.part);
    at.code = before.x + mix(dot(weights, before - before.x), dot(weights, behind - before.x), end.part);
#endif
#ifdef BLURRED
    if (at.there)
        at.deviation = deviation_of(at, end);
#endif
    return at;
}

#ifdef NEAREST
// Finds the sample at a fraction of the way between two planes: the nearest corner of its cell, if
// all corners are present. The plane half-way between two sheets ends segments, so one sheet is
// nearest throughout.
position nearest_between(position a, position b, float share, trip_gl_sheet_end from, trip_gl_sheet_end to)
{
    position at = a;
    place(a.base, mix(a.rest, b.rest + vec2(b.base - a.base), share), at);
    if (!is_within(at.cell))
        return at;
    vec4 corners = min(corners_at(at.cell, to.before), corners_at(at.cell, to.behind));
    at.voxel = ivec3(at.cell + ivec2(greaterThanEqual(at.part, vec2(0.5))),
                     from.part + to.part < 1.0 ? to.before : to.behind);
    at.there = all(greaterThanEqual(corners, vec4(0.0)));
    at.code = texelFetch(codes, at.voxel, 0).r;
    return at;
}

// Returns the position of the face between a voxel and the next, along u (axis 0) or v, relative to
// a whole position.
float face_behind(int voxel, int axis, int base)
{
#ifdef UNEVEN
    int first = axis * extent.x, last = extent[axis] - 1;
    return -0.5 * (beyond(first + clamp(voxel, 0, last), base, 0.0) +
                   beyond(first + clamp(voxel + 1, 0, last), base, 0.0));
#else
    return float(voxel - base) + 0.5;
#endif
}

// Returns the voxel nearest to a position along u (axis 0) or v.
int voxel_near(int base, float rest, int axis)
{
#ifdef UNEVEN
    int first = axis * extent.x, cell = find_cell(first, extent[axis], base, rest);
    if (cell < 0)
        return beyond(first, base, rest) < 0.0 ? 0 : extent[axis] - 1;
    return cell + (rest >= 0.5 ? 1 : 0);
#else
    return base + int(floor(rest + 0.5));
#endif
}

// Cuts the fractions `part` of a segment at the sides of the grid.
void cut_at_sides(position a, position b, inout vec2 part)
{
    for (int i = 0; i < 2; i++) {
        float from = a.rest[i], way = b.rest[i] + float(b.base[i] - a.base[i]) - from;
#ifdef UNEVEN
        float lo = -beyond(i * extent.x, a.base[i], 0.0), hi = -beyond(i * extent.x + extent[i] - 1, a.base[i], 0.0);
#else
        float lo = float(clips[1 + i] - a.base[i]), hi = float(extent[2 + i] - a.base[i]);
#endif
        float x = ((way > 0.0 ? lo : hi) - from) / way, y = ((way > 0.0 ? hi : lo) - from) / way;
        if (way != 0.0)
            part = vec2(max(part.x, x), min(part.y, y));
        else if (from < lo || from > hi)
            part.y = -1.0;
    }
}
#endif

#ifdef SHADED
#ifdef NEAREST
vec3 gradient_at(position at, trip_gl_sheet_end end)
{
    return texelFetch(gradients, at.voxel, 0).xyz;
}
#elif defined(WIDE)
vec3 gradient_at(position at, trip_gl_sheet_end end)
{
    vec4 weights[3] = vec4[3](kernel_weights(at.part.x), kernel_weights(at.part.y), kernel_weights(end.part));
    vec3 g = vec3(0.0);
    for (int n = 0; n < 64; n++) {
        tap t = tap_of(at, end, weights, n);
        g += t.weight * texelFetch(gradients, t.at, 0).xyz;
    }
    return g;
}
#else
vec3 sheet_gradient(position at, int sheet)
{
    vec4 w = corner_weights(at.part);
    return w.x * texelFetch(gradients, ivec3(at.cell + ivec2(0, 1), sheet), 0).xyz +
           w.y * texelFetch(gradients, ivec3(at.cell + ivec2(1, 1), sheet), 0).xyz +
           w.z * texelFetch(gradients, ivec3(at.cell + ivec2(1, 0), sheet), 0).xyz +
           w.w * texelFetch(gradients, ivec3(at.cell, sheet), 0).xyz;
}

vec3 gradient_at(position at, trip_gl_sheet_end end)
{
    vec3 g = vec3(0.0);
    if (end.part < 1.0)
        g += (1.0 - end.part) * sheet_gradient(at, end.before);
    if (end.part > 0.0)
        g += end.part * sheet_gradient(at, end.behind);
    return g;
}
#endif

// Returns the mean of the gradients at the two ends of a segment, in the form of unpack_normal().
vec4 gradient_between(position a, position b, trip_gl_sheet_end from, trip_gl_sheet_end to)
{
    vec3 sum = gradient_at(a, from) + gradient_at(b, to);
    vec3 g = 0.5 * (gradient_0.xyz * sum.x + gradient_1.xyz * sum.y + gradient_2.xyz * sum.z);
    float strength = length(g);
    return vec4(g / max(strength, 1e-15), strength);
}
#endif

#ifdef PLACED
#ifdef UNEVEN
// Returns the position at a fraction of the distance from a voxel to the next.
float place_between(int voxel, float part)
{
    vec2 from = positions[voxel], to = positions[voxel + 1];
    return from.x + (from.y + part * ((to.x - from.x) + (to.y - from.y)));
}
#endif

// Returns the position in the grid or beyond its sides, list axes.
vec3 voxel_of(position at, trip_gl_sheet_end end)
{
#if defined(NEAREST) && defined(UNEVEN)
    return vec3(end.sheet, vec2(at.base) + at.rest);
#elif defined(NEAREST)
    return vec3(end.sheet, vec2(at.base - clips.yz) + at.rest);
#else
    if (any(lessThan(at.lo, vec2(0.0))) || any(lessThan(at.hi, vec2(0.0))))
#ifdef UNEVEN
        return vec3(end.sheet, place_between(0, 0.0) + at.lo.x, place_between(extent.x, 0.0) + at.lo.y);
#else
        return vec3(end.sheet, at.lo);
#endif
#ifdef UNEVEN
    return vec3(end.sheet, place_between(at.cell.x, at.part.x), place_between(extent.x + at.cell.y, at.part.y));
#else
    return vec3(end.sheet, vec2(at.cell - clips.yz) + at.part);
#endif
#endif
}
#endif

// Cuts the fractions of a segment at a side of the grid. `a` and `b` are the distances of both ends
// from it.
void cut_at_side(float a, float b, inout float first, inout float last)
{
    if (a < 0.0 && b < 0.0)
        last = -1.0;
    else if (a < 0.0)
        first = max(first, a / (a - b));
    else if (b < 0.0)
        last = min(last, a / (a - b));
}

// Composites the part of a segment from fraction `first` to `last` behind the pixel's colour,
// opacity and depth.
void add_part(ray r, trip_gl_sheet_end from, trip_gl_sheet_end to, position a, position b, float first, float last,
              inout vec4 pixel, inout float pixel_depth)
{
    // start and end are depths.
    float start = (to.along - to.step - r.start) / r.along, end = (to.along - r.start) / r.along;
    if (!(first < last))
        return;
#ifdef NEAREST
    position middle_at = nearest_between(a, b, mix(first, last, BOX_POINT), from, to);
    if (!middle_at.there)
        return;
    a.code = b.code = middle_at.code;
    a.voxel = b.voxel = middle_at.voxel;
#endif
    float code_a = first > 0.0 ? mix(a.code, b.code, first) : a.code;
    float code_b = last < 1.0 ? mix(a.code, b.code, last) : b.code;
#ifdef BLURRED
    vec4 medium = blurred_between(code_a, code_b, 0.5 * (a.deviation + b.deviation), across_u.w);
#else
    vec4 medium = segment_between(code_a, code_b, across_u.w);
#endif
    if (!(medium.a > 0.0))
        return;
    vec3 colour = debug_colour.w > 0.0 ? vec3(debug_colour.xyz) : medium.rgb;
    float middle = mix(start, end, 0.5 * (first + last));
#if defined(SHADED)
    vec4 gradient = gradient_between(a, b, from, to);
#elif defined(LIT)
    vec4 gradient = vec4(0.0);
#endif
#if defined(SHADED) || defined(SHADOWS)
    vec3 eye = r.eye, from_eye = r.first + r.way * middle;
#elif defined(LIT)
    vec3 eye = vec3(0.0), from_eye = eye;
#endif
#ifdef PLACED
    vec3 middle_position = position_of(mix(voxel_of(a, from), voxel_of(b, to), 0.5 * (first + last)));
#endif
#ifdef LIT
    colour = lit_here(colour, gradient, eye, from_eye, middle_position);
#elif defined(SHADED)
    colour = lit(colour, gradient, eye, from_eye);
#endif
#ifdef EMISSION
    colour += emission_at(middle_position);
#endif
#ifdef CUED
    colour = cued(colour, middle_position);
#endif
    float through = 1.0 - pixel.a, add = opacity(medium.a * (last - first) * abs(to.step) * r.world) * through;
    pixel += vec4(colour * add, add);
    pixel_depth += middle * add;
    if (1.0 - pixel.a < across_v.w) {
        pixel_depth /= pixel.a;
        pixel = vec4(pixel.rgb / pixel.a, 1.0);
    }
}

#ifdef NEAREST
// Adds the parts of a segment between fractions, box by box.
void add_boxes(ray r, trip_gl_sheet_end from, trip_gl_sheet_end to, position a, position b, vec2 part,
               inout vec4 pixel, inout float pixel_depth)
{
    vec2 way = b.rest + vec2(b.base - a.base) - a.rest;
    cut_at_sides(a, b, part);
    ivec2 voxel = ivec2(0), step = ivec2(sign(way));
    for (int i = 0; i < 2; i++)
        voxel[i] = voxel_near(a.base[i], a.rest[i] + part.x * way[i], i);
    for (float x = part.x; x < part.y && pixel.a < 1.0;) {
        vec2 face = vec2(2.0);
        for (int i = 0; i < 2; i++)
            if (step[i] != 0)
                face[i] = (face_behind(voxel[i] - (step[i] < 0 ? 1 : 0), i, a.base[i]) - a.rest[i]) / way[i];
        float next = max(x, min(part.y, min(face.x, face.y)));
        add_part(r, from, to, a, b, x, next, pixel, pixel_depth);
        x = next;
        int leaving = face.x <= face.y ? 0 : 1;
        voxel[leaving] += step[leaving];
        if (face[leaving] > part.y)
            break;
    }
}
#endif

// Composites the segment between two ends, where the clipping keeps it.
void add_segment(ray r, trip_gl_sheet_end from, trip_gl_sheet_end to, position a, position b, inout vec4 pixel,
                 inout float pixel_depth)
{
    vec2 part = vec2(0.0, 1.0);
    if (clips.x > 0) {
        float start = (to.along - to.step - r.start) / r.along, end = (to.along - r.start) / r.along;
        part = clamp((vec2(r.from, r.to) - start) / (end - start), 0.0, 1.0);
    }
#ifdef NEAREST
    add_boxes(r, from, to, a, b, part, pixel, pixel_depth);
#else
    for (int i = 0; i < 2; i++) {
        cut_at_side(a.lo[i], b.lo[i], part.x, part.y);
        cut_at_side(a.hi[i], b.hi[i], part.x, part.y);
    }
    add_part(r, from, to, a, b, part.x, part.y, pixel, pixel_depth);
#endif
}

void main()
{
    ivec2 at = ivec2(gl_GlobalInvocationID.xy) + ivec2(0, rows.y);
    if (at.y >= rows.z || at.x >= int(screen.z))
        return;
    vec2 pixel_at = vec2(at) + 0.5 + vec2(0.0, rows.x);
    vec4 pixel = imageLoad(layer, at);
    ray r = ray_of(pixel_at - screen.xy);
    if (pixel.a >= 1.0 || !(r.along * along.w > 0.0) || !may_weigh(pixel_at))
        return;
    float pixel_depth = 0.0;
#ifdef DEPTH
    pixel_depth = imageLoad(layer_depths, at).r;
#endif
    bool drawn = false;
    position last;
    last.there = false;
    for (int i = 0; i < rows.w && pixel.a < 1.0; i++) {
        position next = position_at(r, ends[i]);
#ifdef NEAREST
        bool visible = ends[i].step != 0.0;
#else
        bool visible = ends[i].step != 0.0 && next.there && last.there;
#endif
#ifdef PARALLEL
        // Segments that start behind the eye's plane are omitted.
        visible = visible && (ends[i].along - ends[i].step - r.start) * along.w >= 0.0;
#endif
        if (visible)
            add_segment(r, ends[i - 1], ends[i], last, next, pixel, pixel_depth);
        drawn = drawn || visible;
        last = next;
    }
    if (!drawn)
        return;
    imageStore(layer, at, pixel);
#ifdef DEPTH
    imageStore(layer_depths, at, vec4(pixel_depth, 0.0, 0.0, pixel.a));
#endif
}
