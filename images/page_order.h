/* Parses the descriptions of ImageJ and OME in a TIFF: order, channels, times, distances and units
 * of its pages. Works on memory only, so that it can be fuzzed. Throws trip_slice_error with
 * the path of the file. Warns of descriptions that it cannot use. */
#ifndef TRIP_PAGE_ORDER_H
#define TRIP_PAGE_ORDER_H

#include <cstdint>
#include <string>
#include <vector>

/* The tags of the first page, and the wanted part. */
struct trip_page_source {
    std::string file;        /* for messages, and to find the file's own pages in OME */
    std::string description; /* ImageDescription */
    int64_t pages;           /* in the file; 1 for one of several files */
    bool several_files;      /* the slices are files, and only distances count */
    double per_unit[2];      /* XResolution, YResolution; 0 if absent */
    std::string unit;        /* ResolutionUnit: "none", "in" or "cm" */
    int64_t samples;         /* values of a pixel that count as channels */
    int64_t time, channel;
};

struct trip_page_order {
    /* The page of each slice of the chosen time and channel, from 0. Empty if the description does
     * not tell; all pages are then slices. */
    std::vector<int64_t> pages;
    int64_t sample = 0;              /* the value of each pixel that is the channel */
    double spacing[3] = { 1, 1, 1 }; /* in `unit` */
    bool measured = false;           /* the description gives distances: microscopy */
    double slope = 1, inter = 0;     /* ImageJ's calibration of values */
    std::string note;                /* choices made for the user */
};

trip_page_order trip_page_order_of(const trip_page_source &source);

#endif
