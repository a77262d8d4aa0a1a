/* Prints the grid of a volume, and the series of a DICOM folder, as text or JSON. */
#ifndef VOLUME_INFO_PRINT_H
#define VOLUME_INFO_PRINT_H

#include <stdbool.h>

#include "triptych_brick.h"

/* Prints the source of an orientation in words. Prints nothing for NULL. */
void print_orientation(const char *from);

/* Returns a negative status after a reported failure. */
int volume_info_print(triptych *t, const char *path, const triptych_brick_options *options,
                      bool json);

#endif
