/* The helper's side of the connection described in image_helper.h. One thread uses it. Throws
 * trip_connection_gone when the other end has closed the connection. */
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

/* Waits for the next request. `fd` is the descriptor sent with it, which the caller must close, or
 * -1. */
trip_image_request trip_connection_next(std::string &path, int &fd);

void trip_connection_reply(trip_image_outcome outcome, int status, std::string where,
                           std::string why, uint64_t data_bytes);

/* Names the file that is decoded, for trip_connection_catch_abort(). "" names none. */
void trip_connection_decode(const std::string &path);

/* Libraries abort the process at some damaged files. From now on, the other end then learns the
 * name of the file. */
void trip_connection_catch_abort();

/* Tells the other end that the helper is working, at most once a second. Call it repeatedly during
 * long tasks. */
void trip_connection_working();

#endif
