/* A point of a scanned cloud, with the attributes of common formats. The source of the points tells
 * which attributes they have; the others are 0. */
#ifndef TRIP_POINT_H
#define TRIP_POINT_H

#include <stdint.h>

/* Attributes, as bits. */
enum {
    TRIP_POINT_NORMAL = 1,
    TRIP_POINT_RADIUS = 2,
    TRIP_POINT_COLOUR = 4,
    TRIP_POINT_INTENSITY = 8,
    TRIP_POINT_CLASSIFICATION = 16,
    TRIP_POINT_RETURNS = 32, /* number of the return, and returns of the pulse */
    TRIP_POINT_TIME = 64,
    TRIP_POINT_SCAN = 128, /* several scans, or one with a pose */
    TRIP_POINT_UNCERTAINTY = 256,
};

typedef struct trip_point {
    double position[3];
    double gps_time;
    float normal[3]; /* of length 1, or 0, 0, 0 for a point without a normal */
    float radius;    /* in units of the cloud; 0 if unknown */
    float colour[3]; /* 0 to 1, display colours */
    float intensity; /* as in the file */
    uint32_t scan;   /* index of the scan */
    /* Standard deviation of the distance from the scanner, and half the width of a pixel there. */
    float uncertainty, footprint;
    uint8_t classification, return_number, returns;
} trip_point;

#endif
