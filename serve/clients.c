#include "clients.h"

#include <sys/socket.h>
#include <unistd.h>

#include "clock.h"

static const double stranger_seconds = 5;

void trip_clients_init(trip_clients *all)
{
    *all = (trip_clients){ .lock = PTHREAD_MUTEX_INITIALIZER };
    for (int i = 0; i < TRIP_CLIENT_PLACES; i++)
        all->places[i] = (trip_client){ .all = all, .socket = -1 };
}

void trip_clients_release(trip_clients *all)
{
    pthread_mutex_destroy(&all->lock);
}

/* Ends the connection at once. The system discards the bytes that the client has not read. The
 * thread of the connection wakes, and closes its socket. */
static void drop(trip_client *client)
{
    const struct linger none = { .l_onoff = 1, .l_linger = 0 };
    client->dropped = true;
    setsockopt(client->socket, SOL_SOCKET, SO_LINGER, &none, sizeof none);
    shutdown(client->socket, SHUT_RDWR);
}

/* Drops the connection that began its step first, if the group has more than `max` connections. */
static void make_room(trip_clients *all, bool guests, int max)
{
    trip_client *first = NULL;
    int count = 0;
    for (int i = 0; i < TRIP_CLIENT_PLACES; i++) {
        trip_client *client = &all->places[i];
        if (client->socket < 0 || client->dropped || client->guest != guests)
            continue;
        count++;
        if (!first || client->began < first->began)
            first = client;
    }
    if (count > max)
        drop(first);
}

static void begin_step(trip_client *client, double seconds)
{
    client->began = trip_now_seconds();
    client->until = client->began + seconds;
}

/* The duplicate of the socket stays valid until the connection leaves, whoever closes it first. */
static trip_client *take_place(trip_clients *all, int socket)
{
    int own = dup(socket);
    for (int i = 0; i < TRIP_CLIENT_PLACES && own >= 0; i++)
        if (all->places[i].socket < 0) {
            all->places[i] = (trip_client){ .all = all, .socket = own };
            return &all->places[i];
        }
    if (own >= 0)
        close(own);
    return NULL;
}

trip_client *trip_clients_enter(trip_clients *all, int socket)
{
    pthread_mutex_lock(&all->lock);
    trip_client *client = take_place(all, socket);
    if (client) {
        begin_step(client, stranger_seconds);
        make_room(all, false, TRIP_CLIENT_STRANGERS);
    }
    pthread_mutex_unlock(&all->lock);
    return client;
}

void trip_client_welcome(trip_client *client)
{
    pthread_mutex_lock(&client->all->lock);
    if (!client->guest && !client->dropped) {
        client->guest = true;
        begin_step(client, stranger_seconds);
        make_room(client->all, true, TRIP_CLIENT_GUESTS);
    }
    pthread_mutex_unlock(&client->all->lock);
}

void trip_client_step(trip_client *client, double seconds)
{
    pthread_mutex_lock(&client->all->lock);
    if (client->guest)
        begin_step(client, seconds);
    pthread_mutex_unlock(&client->all->lock);
}

void trip_client_leave(trip_client *client)
{
    pthread_mutex_lock(&client->all->lock);
    close(client->socket);
    client->socket = -1;
    pthread_mutex_unlock(&client->all->lock);
}

void trip_clients_drop_late(trip_clients *all)
{
    const double now = trip_now_seconds();
    pthread_mutex_lock(&all->lock);
    for (int i = 0; i < TRIP_CLIENT_PLACES; i++) {
        trip_client *client = &all->places[i];
        if (client->socket >= 0 && !client->dropped && now > client->until)
            drop(client);
    }
    pthread_mutex_unlock(&all->lock);
}
