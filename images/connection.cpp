#include "connection.h"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>

#include <sys/socket.h>
#include <unistd.h>

#include "report.h"

namespace
{

constexpr int connection = TRIP_IMAGE_HELPER_FD;

std::chrono::steady_clock::time_point last_sign;

int take_descriptor()
{
    union {
        cmsghdr header;
        char bytes[CMSG_SPACE(sizeof(int))];
    } control;
    char byte;
    iovec one = { &byte, 1 };
    msghdr message = {};
    message.msg_iov = &one;
    message.msg_iovlen = 1;
    message.msg_control = &control;
    message.msg_controllen = sizeof control;
    ssize_t n;
    while ((n = recvmsg(connection, &message, MSG_CMSG_CLOEXEC)) < 0 && errno == EINTR)
        ;
    if (n != 1)
        throw trip_connection_gone();
    int fd = -1;
    cmsghdr *c = CMSG_FIRSTHDR(&message);
    if (c && c->cmsg_level == SOL_SOCKET && c->cmsg_type == SCM_RIGHTS)
        std::memcpy(&fd, CMSG_DATA(c), sizeof fd);
    return fd;
}

/* The file that is decoded. on_abort() reads it. */
char decoded[4000];
volatile std::sig_atomic_t decoded_bytes;

/* Calls only functions that are safe in a signal handler. */
void on_abort(int)
{
    static const char why[] = "is damaged, or of a kind that is not supported: its decoder gave up";
    const trip_image_reply r = { TRIP_IMAGE_FAILED, TRIP_ERROR, (uint32_t)decoded_bytes,
                                 sizeof why - 1, 0 };
    if (decoded_bytes > 0 && send(connection, &r, sizeof r, MSG_NOSIGNAL) == sizeof r &&
        send(connection, decoded, (size_t)decoded_bytes, MSG_NOSIGNAL) > 0)
        (void)send(connection, why, sizeof why - 1, MSG_NOSIGNAL);
    _exit(1);
}

} // namespace

void trip_connection_decode(const std::string &path)
{
    decoded_bytes = 0;
    const size_t bytes = std::min(path.size(), sizeof decoded);
    std::memcpy(decoded, path.data(), bytes);
    decoded_bytes = (std::sig_atomic_t)bytes;
}

void trip_connection_catch_abort()
{
    std::signal(SIGABRT, on_abort);
}

void trip_connection_receive(void *data, size_t bytes)
{
    for (size_t done = 0; done < bytes;) {
        ssize_t n = recv(connection, (char *)data + done, bytes - done, 0);
        if (n == 0 || (n < 0 && errno != EINTR))
            throw trip_connection_gone();
        done += n > 0 ? (size_t)n : 0;
    }
}

void trip_connection_send(const void *data, size_t bytes)
{
    for (size_t done = 0; done < bytes;) {
        ssize_t n = send(connection, (const char *)data + done, bytes - done, MSG_NOSIGNAL);
        if (n < 0 && errno != EINTR)
            throw trip_connection_gone();
        done += n > 0 ? (size_t)n : 0;
    }
}

trip_image_request trip_connection_next(std::string &path, int &fd)
{
    trip_image_request request;
    fd = take_descriptor();
    trip_connection_receive(&request, sizeof request);
    path.assign(request.path_bytes, 0);
    trip_connection_receive(&path[0], path.size());
    last_sign = std::chrono::steady_clock::now();
    return request;
}

void trip_connection_reply(trip_image_outcome outcome, int status, std::string where,
                           std::string why, uint64_t data_bytes)
{
    where.resize(std::min<size_t>(where.size(), 4000));
    why.resize(std::min<size_t>(why.size(), 4000));
    trip_image_reply r = { (uint32_t)outcome, status, (uint32_t)where.size(), (uint32_t)why.size(),
                           data_bytes };
    trip_connection_send(&r, sizeof r);
    trip_connection_send(where.data(), where.size());
    trip_connection_send(why.data(), why.size());
}

void trip_connection_working()
{
    auto now = std::chrono::steady_clock::now();
    if (now - last_sign < std::chrono::seconds(1))
        return;
    last_sign = now;
    trip_connection_reply(TRIP_IMAGE_WORKING, 0, "", "", 0);
}
