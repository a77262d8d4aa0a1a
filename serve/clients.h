/* The connections of the server. Each has a deadline, and each group has a number of places. So
 * slow or silent clients cannot keep others out. Any thread may call the functions. */
#ifndef TRIP_SERVE_CLIENTS_H
#define TRIP_SERVE_CLIENTS_H

#include <pthread.h>
#include <stdbool.h>

enum {
    TRIP_CLIENT_STRANGERS = 32, /* connections that have not shown the token */
    TRIP_CLIENT_GUESTS = 24,    /* connections that have */
    /* Dropped connections last until their threads have ended. */
    TRIP_CLIENT_PLACES = 128,
};

typedef struct trip_clients trip_clients;

typedef struct trip_client {
    trip_clients *all;
    int socket;          /* a duplicate; -1 in a free place */
    bool guest, dropped; /* a dropped connection counts in no group */
    double began, until; /* of its step, in seconds of trip_now_seconds() */
} trip_client;

struct trip_clients {
    pthread_mutex_t lock; /* guards the places */
    trip_client places[TRIP_CLIENT_PLACES];
};

void trip_clients_init(trip_clients *all);
/* Requires that all connections have left. */
void trip_clients_release(trip_clients *all);

/* Enters a connection with a few seconds in all to show the token. If the group is full, drops the
 * oldest connection without the token. Returns NULL if there is no place. */
trip_client *trip_clients_enter(trip_clients *all, int socket);
/* The connection showed the token. If the group is full, drops the connection of the group that
 * began its step first. */
void trip_client_welcome(trip_client *client);
/* Begins a step that may take this many seconds. Does nothing for a connection that has not shown
 * the token, so that its first deadline holds. */
void trip_client_step(trip_client *client, double seconds);
/* The server is about to close the connection. */
void trip_client_leave(trip_client *client);

/* Drops each connection beyond its deadline. */
void trip_clients_drop_late(trip_clients *all);

#endif
