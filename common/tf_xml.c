/* Reads transfer functions in XML:
 * - presets of 3D Slicer (MRML): a VolumeProperty with curves in attributes
 * - volume properties of VTK (vtkXMLVolumePropertyWriter): curves in elements
 * - colour maps of older versions of ParaView
 * expat reads the text in one pass. Documents with a type declaration are refused, so no entity is
 * ever expanded. */
#include "tf_curves.h"

#include "report.h"
#include "text.h"

#include <expat.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct xml_reader {
    XML_Parser parser;
    const char *name, *wanted;
    char where[512];
    bool found;            /* the wanted element was found */
    bool inside;           /* inside the wanted element */
    bool vtk, map;         /* the element is from VTK; from ParaView */
    bool component;        /* inside the first component (VTK) */
    bool grey;             /* colours are brightness */
    trip_tf_nodes *points; /* destination of points, or NULL */
    trip_tf_nodes gradient;
    trip_tf_curves curves;
    int status;
} xml_reader;

/* Stops the parser at the first failure. */
static void stop(xml_reader *r, int status)
{
    if (!status)
        return;
    r->status = status;
    XML_StopParser(r->parser, XML_FALSE);
}

static const char *attribute(const char **attributes, const char *name)
{
    for (; *attributes; attributes += 2)
        if (!strcmp(attributes[0], name))
            return attributes[1];
    return NULL;
}

static double number_at(const char **attributes, const char *name, double missing)
{
    const char *text = attribute(attributes, name);
    double number;
    if (!text)
        return missing;
    return trip_text_to_double(text, &number) ? number : NAN;
}

static bool is_wanted(xml_reader *r, const char **attributes)
{
    const char *name = attribute(attributes, "name");
    if (r->found || (r->wanted && (!name || strcmp(name, r->wanted) != 0)))
        return false;
    r->found = true;
    snprintf(r->where, sizeof r->where, "%.300s%s%.100s", r->name, name && *name ? ": " : "",
             name ? name : "");
    return true;
}

static int read_unit(xml_reader *r, const char **attributes, const char *key)
{
    double unit = number_at(attributes, key, 0);
    if (attribute(attributes, key) && !(unit > 0))
        return trip_fail(TRIP_ERROR, TRIP_TF_STAGE, r->where, "%s is not a positive length", key);
    r->curves.unit_world = unit;
    return TRIP_OK;
}

static int read_slicer(xml_reader *r, const char **attributes)
{
    const char *opacity = attribute(attributes, "scalarOpacity");
    const char *gradient = attribute(attributes, "gradientOpacity");
    const char *colour = attribute(attributes, "colorTransfer");
    if (!opacity || !colour)
        return trip_fail(TRIP_ERROR, TRIP_TF_STAGE, r->where, "no %s",
                         opacity ? "colorTransfer" : "scalarOpacity");
    int status = read_unit(r, attributes, "scalarOpacityUnitDistance");
    if (!status)
        status =
            trip_tf_nodes_add_text(&r->curves.opacities, opacity, 2, r->where, "scalarOpacity");
    if (!status)
        status = trip_tf_nodes_add_text(&r->curves.colours, colour, 4, r->where, "colorTransfer");
    if (!status && gradient)
        status = trip_tf_nodes_add_text(&r->gradient, gradient, 2, r->where, "gradientOpacity");
    return status;
}

static void begin_property(xml_reader *r, const char **attributes)
{
    if (!is_wanted(r, attributes))
        return;
    r->inside = true;
    if (attribute(attributes, "scalarOpacity") || attribute(attributes, "colorTransfer"))
        stop(r, read_slicer(r, attributes));
    else
        r->vtk = true;
}

static trip_colour_space space_of(const char **attributes)
{
    static const trip_colour_space vtk_spaces[] = { TRIP_COLOUR_RGB, TRIP_COLOUR_HSV,
                                                    TRIP_COLOUR_LAB, TRIP_COLOUR_DIVERGING,
                                                    TRIP_COLOUR_LAB, TRIP_COLOUR_STEP };
    double number = number_at(attributes, "ColorSpace", 0);
    return number >= 0 && number <= 5 ? vtk_spaces[(int)number] : TRIP_COLOUR_RGB;
}

/* Handles elements inside the component of a VTK property. */
static void begin_in_component(xml_reader *r, const char *element, const char **attributes)
{
    if (!strcmp(element, "RGBTransferFunction") || !strcmp(element, "GrayTransferFunction")) {
        r->points = &r->curves.colours;
        r->grey = element[0] == 'G';
    } else if (!strcmp(element, "ScalarOpacity")) {
        r->points = &r->curves.opacities;
    } else if (!strcmp(element, "GradientOpacity")) {
        r->points = &r->gradient;
    } else if (!strcmp(element, "ColorTransferFunction") && r->points == &r->curves.colours) {
        r->curves.space = space_of(attributes);
    }
}

/* Reads <Point X="" Value="" MidPoint="" Sharpness=""/>. A colour's Value has three numbers. */
static int read_point(xml_reader *r, const char **attributes)
{
    trip_tf_node node = { number_at(attributes, "X", NAN), { NAN, 0.5, 0 } };
    const char *value = attribute(attributes, "Value");
    if (r->points == &r->curves.colours && !r->grey) {
        char text[256];
        trip_tf_nodes one = { 0 };
        snprintf(text, sizeof text, "4 0 %.200s", value ? value : "");
        int status = trip_tf_nodes_add_text(&one, text, 4, r->where, "colour of a Point");
        if (!status)
            memcpy(node.part, one.data[0].part, sizeof node.part);
        free(one.data);
        return status ? status : trip_tf_nodes_add(r->points, node, r->where, "Point");
    }
    node.part[0] = number_at(attributes, "Value", NAN);
    if (r->points == &r->curves.colours) {
        node.part[1] = node.part[2] = node.part[0];
    } else {
        node.part[1] = number_at(attributes, "MidPoint", 0.5);
        node.part[2] = number_at(attributes, "Sharpness", 0);
    }
    return trip_tf_nodes_add(r->points, node, r->where, "Point");
}

static void begin_map(xml_reader *r, const char **attributes)
{
    const char *space = attribute(attributes, "space");
    if (!is_wanted(r, attributes))
        return;
    r->inside = r->map = true;
    r->curves.space = !space || !strcmp(space, "RGB")   ? TRIP_COLOUR_RGB
                      : !strcmp(space, "HSV")           ? TRIP_COLOUR_HSV
                      : !strcmp(space, "Wrapped")       ? TRIP_COLOUR_HSV_WRAP
                      : !strncmp(space, "Diverging", 9) ? TRIP_COLOUR_DIVERGING
                      : !strncmp(space, "Step", 4)      ? TRIP_COLOUR_STEP
                                                        : TRIP_COLOUR_LAB;
}

/* Reads <Point x="" o="" r="" g="" b=""/>. */
static int read_map_point(xml_reader *r, const char **a)
{
    const trip_tf_node colour = { number_at(a, "x", NAN),
                                  { number_at(a, "r", NAN), number_at(a, "g", NAN),
                                    number_at(a, "b", NAN) } };
    const trip_tf_node opacity = { colour.value, { number_at(a, "o", 1), 0.5, 0 } };
    int status = trip_tf_nodes_add(&r->curves.colours, colour, r->where, "Point");
    return status ? status : trip_tf_nodes_add(&r->curves.opacities, opacity, r->where, "Point");
}

static void XMLCALL on_begin(void *user, const char *element, const char **attributes)
{
    xml_reader *r = user;
    if (r->status)
        return;
    if (!strcmp(element, "VolumeProperty"))
        begin_property(r, attributes);
    else if (!strcmp(element, "ColorMap"))
        begin_map(r, attributes);
    else if (!r->inside)
        return;
    else if (r->map && !strcmp(element, "Point"))
        stop(r, read_map_point(r, attributes));
    else if (r->vtk && !strcmp(element, "Component")) {
        r->component = number_at(attributes, "Index", 0) == 0 && r->curves.colours.count == 0;
        if (r->component)
            stop(r, read_unit(r, attributes, "ScalarOpacityUnitDistance"));
    } else if (r->component && r->points && !strcmp(element, "Point"))
        stop(r, read_point(r, attributes));
    else if (r->component)
        begin_in_component(r, element, attributes);
}

static void XMLCALL on_end(void *user, const char *element)
{
    xml_reader *r = user;
    size_t length = strlen(element);
    if (!strcmp(element, "VolumeProperty") || !strcmp(element, "ColorMap"))
        r->inside = false;
    else if (!strcmp(element, "Component"))
        r->component = false;
    else if (!strcmp(element, "ScalarOpacity") || !strcmp(element, "GradientOpacity") ||
             (length > 16 && !strcmp(element + length - 16, "TransferFunction") &&
              strcmp(element, "ColorTransferFunction") != 0))
        r->points = NULL;
}

static void XMLCALL on_type_declaration(void *user, const char *name, const char *system,
                                        const char *public, int internal)
{
    xml_reader *r = user;
    (void)name, (void)system, (void)public, (void)internal;
    stop(r, trip_fail(TRIP_ERROR, TRIP_TF_STAGE, r->name,
                      "has a document type declaration; remove it"));
}

static int parse(xml_reader *r, const char *text, size_t bytes)
{
    if (XML_Parse(r->parser, text, (int)bytes, 1) == XML_STATUS_OK || r->status)
        return r->status;
    char where[512];
    snprintf(where, sizeof where, "%.400s: line %lu", r->name,
             (unsigned long)XML_GetCurrentLineNumber(r->parser));
    return trip_fail(TRIP_ERROR, TRIP_TF_STAGE, where, "not XML from here on: %s",
                     XML_ErrorString(XML_GetErrorCode(r->parser)));
}

static int check(xml_reader *r)
{
    if (!r->found && r->wanted)
        return trip_fail(TRIP_ERROR, TRIP_TF_STAGE, r->name, "holds no function named `%s`",
                         r->wanted);
    if (!r->found)
        return trip_fail(TRIP_ERROR, TRIP_TF_STAGE, r->name,
                         "holds no volume property and no colour map");
    if (r->map) {
        trip_tf_curves_drop_opaque(&r->curves);
        trip_tf_curves_stretch(&r->curves);
    }
    trip_tf_warn_of_gradient(&r->gradient, r->where);
    return TRIP_OK;
}

int trip_tf_parse_xml(trip_tf **out, const char *name, const char *text, size_t bytes,
                      const char *preset)
{
    xml_reader r = { .name = name, .wanted = preset };
    *out = NULL;
    r.parser = bytes <= TRIP_TF_MAX_FILE_BYTES ? XML_ParserCreate(NULL) : NULL;
    if (!r.parser)
        return trip_fail(TRIP_ERROR, TRIP_TF_STAGE, name, "out of memory");
    XML_SetUserData(r.parser, &r);
    XML_SetElementHandler(r.parser, on_begin, on_end);
    XML_SetStartDoctypeDeclHandler(r.parser, on_type_declaration);
    int status = parse(&r, text, bytes);
    if (!status)
        status = check(&r);
    if (!status)
        status = trip_tf_curves_build(out, &r.curves, r.where);
    XML_ParserFree(r.parser);
    trip_tf_curves_free(&r.curves);
    free(r.gradient.data);
    return status;
}
