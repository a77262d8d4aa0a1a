/* The HTTP server: authenticates and answers requests. */
#include <arpa/inet.h>
#include <microhttpd.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>

#include "page_text.h"
#include "report.h"
#include "serve_session.h"

enum {
    TOKEN_BYTES = 16,
    MAX_BODY = 64 << 10,
    MAX_CONNECTIONS = 32,
    TIMEOUT_SECONDS = 30,
};
#define WAIT_SECONDS 10
#define TICK_SECONDS 0.05

typedef struct server {
    trip_session *session;
    struct MHD_Daemon *daemon;
    int port;
    char token[2 * TOKEN_BYTES + 1];
} server;

/* The body of a request as it arrives. */
typedef struct body {
    char *text;
    size_t bytes;
    bool too_long;
} body;

static void add_header(struct MHD_Response *r, const char *name, const char *value)
{
    MHD_add_response_header(r, name, value);
}

/* Answers with `data`, and frees it after sending. */
static enum MHD_Result answer(struct MHD_Connection *c, unsigned status, const char *type,
                              void *data, size_t bytes, const trip_session_picture *picture)
{
    char number[32];
    struct MHD_Response *r = MHD_create_response_from_buffer(bytes, data, MHD_RESPMEM_MUST_FREE);
    if (!r) {
        free(data);
        return MHD_NO;
    }
    add_header(r, "Content-Type", type);
    add_header(r, "Cache-Control", "no-store");
    add_header(r, "Referrer-Policy", "no-referrer");
    add_header(r, "X-Content-Type-Options", "nosniff");
    add_header(r, "Content-Security-Policy",
               "default-src 'none'; img-src blob:; script-src 'unsafe-inline'; style-src "
               "'unsafe-inline'; connect-src 'self'; frame-ancestors 'none'");
    if (picture) {
        snprintf(number, sizeof number, "%llu", (unsigned long long)picture->number);
        add_header(r, "X-Picture", number);
        add_header(r, "X-Whole", picture->whole ? "1" : "0");
    }
    enum MHD_Result sent = MHD_queue_response(c, status, r);
    MHD_destroy_response(r);
    return sent;
}

static enum MHD_Result answer_text(struct MHD_Connection *c, unsigned status, const char *type,
                                   const char *text)
{
    char *copy = strdup(text);
    return copy ? answer(c, status, type, copy, strlen(copy), NULL) : MHD_NO;
}

static enum MHD_Result refuse(struct MHD_Connection *c, unsigned status, const char *why)
{
    return answer_text(c, status, "text/plain; charset=utf-8", why);
}

/* Compares in constant time, so that timing reveals nothing about the token. */
static bool same_token(const char *a, const char *b)
{
    unsigned differences = 0;
    if (!b || strlen(b) != 2 * TOKEN_BYTES)
        return false;
    for (int i = 0; i < 2 * TOKEN_BYTES; i++)
        differences |= (unsigned)(a[i] ^ b[i]);
    return differences == 0;
}

/* Refuses other hosts: another site's name may resolve to this address (DNS rebinding). */
static bool is_own_host(const server *s, struct MHD_Connection *c)
{
    char own[2][32];
    const char *host = MHD_lookup_connection_value(c, MHD_HEADER_KIND, "Host");
    snprintf(own[0], sizeof own[0], "127.0.0.1:%d", s->port);
    snprintf(own[1], sizeof own[1], "localhost:%d", s->port);
    return host && (!strcmp(host, own[0]) || !strcmp(host, own[1]));
}

static const char *argument(struct MHD_Connection *c, const char *name)
{
    const char *value = MHD_lookup_connection_value(c, MHD_GET_ARGUMENT_KIND, name);
    return value ? value : "";
}

static enum MHD_Result give_picture(server *s, struct MHD_Connection *c)
{
    char *end;
    const char *text = argument(c, "after");
    unsigned long long after = strtoull(text, &end, 10);
    if (!*text || *end || strspn(text, "0123456789") != strlen(text))
        return refuse(c, 400, "after: the number of the last picture");
    trip_session_picture p;
    if (!trip_session_await(s->session, after, WAIT_SECONDS, &p))
        return refuse(c, 204, "");
    return answer(c, 200, p.whole ? "image/png" : "image/jpeg", p.file, p.bytes, &p);
}

static enum MHD_Result give_status(server *s, struct MHD_Connection *c)
{
    char *text = trip_session_status(s->session);
    return text ? answer(c, 200, "application/json", text, strlen(text), NULL) : MHD_NO;
}

static enum MHD_Result give_presets(struct MHD_Connection *c)
{
    char *text = trip_session_presets();
    return text ? answer(c, 200, "application/json", text, strlen(text), NULL) : MHD_NO;
}

static enum MHD_Result get(server *s, struct MHD_Connection *c, const char *path)
{
    if (!strcmp(path, "/"))
        return answer_text(c, 200, "text/html; charset=utf-8",
                           trip_serve_page_shader_texts[0].text);
    if (!strcmp(path, "/picture"))
        return give_picture(s, c);
    if (!strcmp(path, "/status"))
        return give_status(s, c);
    if (!strcmp(path, "/presets"))
        return give_presets(c);
    return refuse(c, 404, "there is no such page");
}

static enum MHD_Result post(server *s, struct MHD_Connection *c, const char *path, const body *b)
{
    if (b->too_long)
        return refuse(c, 413, "too long");
    if (!strcmp(path, "/events"))
        return trip_session_do(s->session, b->text ? b->text : "", b->bytes)
                   ? refuse(c, 204, "")
                   : refuse(c, 400, "these are no events");
    if (!strcmp(path, "/function"))
        return trip_session_set_function(s->session, argument(c, "name"))
                   ? refuse(c, 204, "")
                   : refuse(c, 400, "there is no such function");
    if (!strcmp(path, "/set"))
        return trip_session_set(s->session, argument(c, "name"), argument(c, "value"))
                   ? refuse(c, 204, "")
                   : refuse(c, 400, "there is no such setting");
    return refuse(c, 404, "there is no such page");
}

static void keep(body *b, const char *data, size_t bytes)
{
    char *text = b->bytes + bytes <= MAX_BODY ? realloc(b->text, b->bytes + bytes) : NULL;
    b->too_long |= !text;
    if (!text)
        return;
    memcpy(text + b->bytes, data, bytes);
    b->text = text;
    b->bytes += bytes;
}

static enum MHD_Result handle(void *user, struct MHD_Connection *c, const char *path,
                              const char *method, const char *version, const char *data,
                              size_t *bytes, void **kept)
{
    server *s = user;
    body *b = *kept;
    (void)version;
    if (!b) {
        *kept = calloc(1, sizeof *b);
        return *kept ? MHD_YES : MHD_NO;
    }
    if (*bytes) {
        keep(b, data, *bytes);
        *bytes = 0;
        return MHD_YES;
    }
    if (!is_own_host(s, c))
        return refuse(c, 403,
                      "this is another host or port: ssh -L has to forward a port of the same "
                      "number");
    if (!same_token(s->token, MHD_lookup_connection_value(c, MHD_GET_ARGUMENT_KIND, "token")))
        return refuse(c, 403, "the address is without its token");
    if (!strcmp(method, "GET"))
        return get(s, c, path);
    if (!strcmp(method, "POST"))
        return post(s, c, path, b);
    return refuse(c, 405, "GET or POST");
}

static void forget(void *user, struct MHD_Connection *c, void **kept,
                   enum MHD_RequestTerminationCode code)
{
    body *b = *kept;
    (void)user, (void)c, (void)code;
    if (b)
        free(b->text);
    free(b);
    *kept = NULL;
}

static int make_token(server *s)
{
    unsigned char bytes[TOKEN_BYTES];
    if (getrandom(bytes, sizeof bytes, 0) != sizeof bytes)
        return trip_fail_errno("serve", "token", "cannot read random numbers");
    for (int i = 0; i < TOKEN_BYTES; i++)
        snprintf(s->token + 2 * i, 3, "%02x", bytes[i]);
    return 0;
}

static int listen_here(server *s, int port)
{
    const struct sockaddr_in here = { .sin_family = AF_INET,
                                      .sin_port = htons((uint16_t)port),
                                      .sin_addr = { .s_addr = htonl(INADDR_LOOPBACK) } };
    char text[32];
    s->daemon = MHD_start_daemon(
        MHD_USE_INTERNAL_POLLING_THREAD | MHD_USE_THREAD_PER_CONNECTION | MHD_USE_POLL, 0, NULL,
        NULL, handle, s, MHD_OPTION_SOCK_ADDR, &here, MHD_OPTION_CONNECTION_LIMIT,
        (unsigned)MAX_CONNECTIONS, MHD_OPTION_CONNECTION_TIMEOUT, (unsigned)TIMEOUT_SECONDS,
        MHD_OPTION_NOTIFY_COMPLETED, forget, NULL, MHD_OPTION_END);
    const union MHD_DaemonInfo *info =
        s->daemon ? MHD_get_daemon_info(s->daemon, MHD_DAEMON_INFO_BIND_PORT) : NULL;
    s->port = info ? info->port : 0;
    snprintf(text, sizeof text, "127.0.0.1:%d", port);
    return s->port
               ? 0
               : trip_fail(
                     TRIP_ERROR, "serve", text,
                     "cannot listen on this port; choose another with --port, or 0 for a free one");
}

static void say_address(const server *s, const trip_serve_params *params)
{
    char address[128];
    snprintf(address, sizeof address, "http://127.0.0.1:%d/?token=%s", s->port, s->token);
    params->ready(params->user, address);
}

int trip_serve_run(const trip_serve_params *params)
{
    server s = { .session = trip_session_start(params) };
    char line[600];
    if (!s.session)
        return trip_fail(TRIP_ERROR, "serve", params->input, "out of memory or threads");
    int status = make_token(&s);
    if (!status)
        status = listen_here(&s, params->port);
    if (!status)
        say_address(&s, params);
    while (!status && !trip_interrupted()) {
        trip_session_tick(s.session, TICK_SECONDS);
        if (trip_session_take_failure(s.session, line, sizeof line))
            trip_report_line(line);
    }
    trip_session_end(s.session);
    if (s.daemon)
        MHD_stop_daemon(s.daemon);
    trip_session_stop(s.session);
    return status;
}
