/* The helper's side of the connection of image_helper.h. Throws trip_connection_gone when there is
 * nobody at its other end any more. */
#ifndef TRIP_CONNECTION_H
#define TRIP_CONNECTION_H

#include <cstddef>
#include <cstdint>
#include <string>

#include "image_helper.h"

struct trip_connection_gone {
};

void trip_connection_receive(void *data, size_t bytes);
void trip_connection_send(const void *data, size_t bytes);

/* Waits for the next request. `fd` is the descriptor that came with it, the caller's to close, or
 * -1. */
trip_image_request trip_connection_next(std::string &path, int &fd);

void trip_connection_reply(trip_image_outcome outcome, int status, std::string where,
                           std::string why, uint64_t data_bytes);

/* To be called now and then in what may take long; sends a sign of life once a second. */
void trip_connection_working();

#endif
