/* Writes functions in the formats of other programs. These formats keep colours and opacities as
 * separate curves. Most formats accept a value only once, so the lower colour of a step is written
 * at the next smaller number. */
#include "tf_internal.h"

#include "report.h"
#include "text.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct writer {
    FILE *f;
    char name[128];        /* printable ASCII */
    trip_tf_point *points; /* ascending values; room for two more */
    size_t count;
    double unit_world;
} writer;

/* Whether point i can be left out. If several points share a value, only the first and the last
 * matter. */
static bool is_idle(const trip_tf *tf, size_t i)
{
    return i > 0 && i + 1 < tf->count && tf->points[i - 1].value == tf->points[i].value &&
           tf->points[i + 1].value == tf->points[i].value;
}

static int take_points(writer *w, const trip_tf *tf)
{
    w->points = calloc(tf->count + 2, sizeof *w->points);
    if (!w->points)
        return trip_fail(TRIP_ERROR, TRIP_TF_STAGE, w->name, "out of memory");
    for (size_t i = 0; i < tf->count; i++) {
        trip_tf_point p = tf->points[i];
        bool step = i + 1 < tf->count && tf->points[i + 1].value == p.value;
        p.value = step ? nextafter(p.value, -INFINITY) : p.value;
        bool room = w->count == 0 || w->points[w->count - 1].value < p.value;
        if (!is_idle(tf, i) && room && (!tf->normalised || p.value >= 0))
            w->points[w->count++] = p;
    }
    w->unit_world = tf->unit_world;
    return TRIP_OK;
}

static void write_number(FILE *f, double number)
{
    char text[32];
    fputs(trip_text_from_double(number, text), f);
}

static void write_numbers(FILE *f, const char *between, const double *numbers, int count)
{
    for (int i = 0; i < count; i++) {
        fputs(i ? between : "", f);
        write_number(f, numbers[i]);
    }
}

static void write_rgb(FILE *f, const char *between, const trip_tf_point *p)
{
    write_numbers(f, between, (const double[]){ p->colour.r, p->colour.g, p->colour.b }, 3);
}

/* ParaView stretches maps that span 0 to 1 or -1 to 1. A further point protects a function in data
 * units from this. */
static void guard_range(writer *w, const trip_tf *tf)
{
    double lo = w->points[0].value;
    trip_tf_point last = w->points[w->count - 1];
    if (tf->normalised || last.value != 1 || (lo != 0 && lo != -1))
        return;
    last.value = nextafter(1, INFINITY);
    w->points[w->count++] = last;
}

/* ParaView's maps span 0 to 1 over the data's range. Beyond its points, a function keeps its end
 * colours. */
static void widen_to_range(writer *w, const trip_tf *tf)
{
    if (!tf->normalised)
        return;
    if (w->points[0].value > 0) {
        memmove(w->points + 1, w->points, w->count++ * sizeof *w->points);
        w->points[0].value = 0;
    }
    if (w->points[w->count - 1].value < 1) {
        w->points[w->count] = w->points[w->count - 1];
        w->points[w->count++].value = 1;
    }
}

static void write_json_name(const writer *w)
{
    fputc('"', w->f);
    for (const char *c = w->name; *c; c++) {
        if (*c == '"' || *c == '\\')
            fputc('\\', w->f);
        fputc(*c, w->f);
    }
    fputc('"', w->f);
}

static void write_paraview(writer *w, const trip_tf *tf)
{
    guard_range(w, tf);
    widen_to_range(w, tf);
    if (w->unit_world > 0)
        trip_warn(w->name,
                  "ParaView's maps have no unit of opacity; set its Scalar Opacity Unit "
                  "Distance to %g",
                  w->unit_world);
    fputs("[ {\n\"ColorSpace\": \"RGB\",\n\"Name\": ", w->f);
    write_json_name(w);
    fputs(",\n\"Points\": [", w->f);
    for (size_t i = 0; i < w->count; i++) {
        const trip_tf_point *p = &w->points[i];
        fputs(i ? ",\n" : "\n", w->f);
        write_numbers(w->f, ", ", (const double[]){ p->value, p->colour.opacity, 0.5, 0 }, 4);
    }
    fputs("\n],\n\"RGBPoints\": [", w->f);
    for (size_t i = 0; i < w->count; i++) {
        fputs(i ? ",\n" : "\n", w->f);
        write_number(w->f, w->points[i].value);
        fputs(", ", w->f);
        write_rgb(w->f, ", ", &w->points[i]);
    }
    fputs("\n]\n} ]\n", w->f);
}

/* Writes "COUNT value opacity ...", where COUNT is the number of numbers. */
static void write_opacity_text(const writer *w)
{
    fprintf(w->f, "%zu", 2 * w->count);
    for (size_t i = 0; i < w->count; i++) {
        fputc(' ', w->f);
        write_numbers(w->f, " ",
                      (const double[]){ w->points[i].value, w->points[i].colour.opacity }, 2);
    }
}

static void write_colour_text(const writer *w)
{
    fprintf(w->f, "%zu", 4 * w->count);
    for (size_t i = 0; i < w->count; i++) {
        fputc(' ', w->f);
        write_number(w->f, w->points[i].value);
        fputc(' ', w->f);
        write_rgb(w->f, " ", &w->points[i]);
    }
}

/* Linear interpolation, shaded, with diffuse 0.9, ambient 0.1 and specular 0.2 of power 10, as in
 * Slicer's presets. Opacity does not depend on the gradient. */
static void write_vp(writer *w)
{
    if (w->unit_world > 0)
        trip_warn(w->name, "a .vp has no unit of opacity; use .vp.json");
    fputs("1\n1\n0.9\n0.1\n0.2\n10\n", w->f);
    write_opacity_text(w);
    fputs("\n4 0 1 255 1\n", w->f);
    write_colour_text(w);
    fputc('\n', w->f);
}

static void write_vp_json(writer *w)
{
    fputs("{\n\"@schema\": \"https://raw.githubusercontent.com/slicer/slicer/main/Modules/Loadable/"
          "VolumeRendering/Resources/Schema/volume-property-schema-v1.0.0.json#\",\n"
          "\"volumeProperties\": [ {\n\"components\": [ {\n\"shade\": true,\n"
          "\"lighting\": { \"diffuse\": 0.9, \"ambient\": 0.1, \"specular\": 0.2, "
          "\"specularPower\": 10 },\n\"rgbTransferFunction\": { "
          "\"type\": \"colorTransferFunction\", \"points\": [",
          w->f);
    for (size_t i = 0; i < w->count; i++) {
        fprintf(w->f, "%s\n{ \"x\": ", i ? "," : "");
        write_number(w->f, w->points[i].value);
        fputs(", \"color\": [", w->f);
        write_rgb(w->f, ", ", &w->points[i]);
        fputs("] }", w->f);
    }
    fputs("\n] },\n", w->f);
    if (w->unit_world > 0) {
        fputs("\"scalarOpacityUnitDistance\": ", w->f);
        write_number(w->f, w->unit_world);
        fputs(",\n", w->f);
    }
    fputs("\"scalarOpacity\": { \"type\": \"piecewiseLinearFunction\", \"points\": [", w->f);
    for (size_t i = 0; i < w->count; i++) {
        fprintf(w->f, "%s\n{ \"x\": ", i ? "," : "");
        write_number(w->f, w->points[i].value);
        fputs(", \"y\": ", w->f);
        write_number(w->f, w->points[i].colour.opacity);
        fputs(" }", w->f);
    }
    fputs("\n] },\n\"gradientOpacity\": { \"type\": \"piecewiseLinearFunction\", \"points\": [\n"
          "{ \"x\": 0, \"y\": 1 },\n{ \"x\": 255, \"y\": 1 }\n] }\n} ]\n} ]\n}\n",
          w->f);
}

static void write_xml_name(const writer *w)
{
    for (const char *c = w->name; *c; c++)
        if (*c == '<' || *c == '&' || *c == '"')
            fprintf(w->f, "&#%d;", *c);
        else
            fputc(*c, w->f);
}

static void write_slicer(writer *w)
{
    fputs("<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<MRML>\n"
          "  <VolumeProperty selected=\"false\" hideFromEditors=\"false\" name=\"",
          w->f);
    write_xml_name(w);
    fputs("\" gradientOpacity=\"4 0 1 255 1\" userTags=\"\" specularPower=\"10\" scalarOpacity=\"",
          w->f);
    write_opacity_text(w);
    if (w->unit_world > 0) {
        fputs("\" scalarOpacityUnitDistance=\"", w->f);
        write_number(w->f, w->unit_world);
    }
    fputs("\" id=\"vtkMRMLVolumePropertyNode1\" specular=\"0.2\" shade=\"1\" ambient=\"0.1\" "
          "colorTransfer=\"",
          w->f);
    write_colour_text(w);
    fputs("\" selectable=\"true\" diffuse=\"0.9\" interpolation=\"1\"/>\n</MRML>\n", w->f);
}

static void write_vtk_point(const writer *w, size_t i, bool colour)
{
    const trip_tf_point *p = &w->points[i];
    fputs("        <Point X=\"", w->f);
    write_number(w->f, p->value);
    fputs("\" Value=\"", w->f);
    if (colour)
        write_rgb(w->f, " ", p);
    else
        write_number(w->f, p->colour.opacity);
    fputs("\" MidPoint=\"0.5\" Sharpness=\"0\"/>\n", w->f);
}

static void write_vtk(writer *w)
{
    fputs("<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<VolumeProperty InterpolationType=\"1\" "
          "IndependentComponents=\"1\" name=\"",
          w->f);
    write_xml_name(w);
    fputs("\">\n  <Component Index=\"0\" Shade=\"1\" Ambient=\"0.1\" Diffuse=\"0.9\" "
          "Specular=\"0.2\" SpecularPower=\"10\" ColorChannels=\"3\" "
          "DisableGradientOpacity=\"1\" ComponentWeight=\"1\"",
          w->f);
    if (w->unit_world > 0) {
        fputs(" ScalarOpacityUnitDistance=\"", w->f);
        write_number(w->f, w->unit_world);
        fputc('"', w->f);
    }
    fprintf(w->f,
            ">\n    <RGBTransferFunction>\n      <ColorTransferFunction Size=\"%zu\" "
            "Clamping=\"1\" ColorSpace=\"0\">\n",
            w->count);
    for (size_t i = 0; i < w->count; i++)
        write_vtk_point(w, i, true);
    fprintf(w->f,
            "      </ColorTransferFunction>\n    </RGBTransferFunction>\n    <ScalarOpacity>\n"
            "      <PiecewiseFunction Size=\"%zu\" Clamping=\"1\">\n",
            w->count);
    for (size_t i = 0; i < w->count; i++)
        write_vtk_point(w, i, false);
    fputs("      </PiecewiseFunction>\n    </ScalarOpacity>\n  </Component>\n</VolumeProperty>\n",
          w->f);
}

static void write_form(writer *w, const trip_tf *tf, trip_tf_format format)
{
    switch (format) {
    case TRIP_TF_PARAVIEW:
        write_paraview(w, tf);
        break;
    case TRIP_TF_VP:
        write_vp(w);
        break;
    case TRIP_TF_VP_JSON:
        write_vp_json(w);
        break;
    case TRIP_TF_SLICER:
        write_slicer(w);
        break;
    default:
        write_vtk(w);
    }
}

static void take_name(writer *w, const char *name)
{
    size_t length = strnlen(name, sizeof w->name - 1);
    for (size_t i = 0; i < length; i++)
        w->name[i] = (char)(name[i] >= ' ' && name[i] <= '~' ? name[i] : '_');
}

int trip_tf_write(const trip_tf *tf, trip_tf_format format, const char *name, char **text)
{
    writer w = { 0 };
    size_t bytes = 0;
    *text = NULL;
    if (format == TRIP_TF_TEXT) {
        *text = trip_tf_to_text(tf);
        return *text ? TRIP_OK : trip_fail(TRIP_ERROR, TRIP_TF_STAGE, name, "out of memory");
    }
    if (tf->normalised && format != TRIP_TF_PARAVIEW)
        return trip_fail(TRIP_USAGE, TRIP_TF_STAGE, name,
                         "the function is relative to the range of the data, which this format "
                         "cannot express; give the range with --range LO:HI");
    take_name(&w, name);
    int status = take_points(&w, tf);
    w.f = status ? NULL : open_memstream(text, &bytes);
    if (w.f)
        write_form(&w, tf, format);
    if (!status && (!w.f || fclose(w.f) != 0))
        status = trip_fail(TRIP_ERROR, TRIP_TF_STAGE, name, "out of memory");
    free(w.points);
    if (status) {
        free(*text);
        *text = NULL;
    }
    return status;
}
