/* The value that GDAL declares as absent in the private tag 42113 of a TIFF. */
#ifndef TRIP_ABSENT_VALUE_H
#define TRIP_ABSENT_VALUE_H

#include <string>

/* Returns true and sets `value` if the first page of a TIFF has the tag with a finite number.
 * OpenImageIO reads no private tags, so libtiff reads this one. */
bool trip_absent_value(const std::string &file, double &value);

#endif
