/* The HTTP server: authenticates and answers requests. Host, token, origin, method and length are
 * checked before a body is read. Each step of a request has a deadline (clients.h). */
#include <arpa/inet.h>
#include <microhttpd.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/random.h>

#include "clients.h"
#include "page_text.h"
#include "report.h"
#include "serve_session.h"

enum {
    TOKEN_BYTES = 16,
    MAX_HEADER = 16 << 10, /* the address and all headers of a request */
    MAX_BODY = 64 << 10,
    SLOWEST_REPLY = 64 << 10, /* bytes per second, after REPLY_SECONDS */
};
#define WAIT_SECONDS 10
#define TICK_SECONDS 0.05
/* Times after the client has shown the token. */
#define BODY_SECONDS 10
#define WORK_SECONDS 60  /* beyond WAIT_SECONDS and the encoding of a picture */
#define REPLY_SECONDS 10 /* and the time of its bytes by SLOWEST_REPLY */
#define REST_SECONDS 10  /* from a reply to the end of the next header */

typedef struct server {
    trip_session *session;
    struct MHD_Daemon *daemon;
    trip_clients clients;
    int port;
    char token[2 * TOKEN_BYTES + 1];
} server;

/* The body of a request as it arrives. */
typedef struct body {
    char *text;
    size_t bytes;
} body;

static void add_header(struct MHD_Response *r, const char *name, const char *value)
{
    MHD_add_response_header(r, name, value);
}

static trip_client *client_of(struct MHD_Connection *c)
{
    return MHD_get_connection_info(c, MHD_CONNECTION_INFO_SOCKET_CONTEXT)->socket_context;
}

/* After these replies, the rest of the request is not read. */
static bool closes(unsigned status)
{
    return status == MHD_HTTP_FORBIDDEN || status == MHD_HTTP_METHOD_NOT_ALLOWED ||
           status == MHD_HTTP_CONTENT_TOO_LARGE;
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
    add_header(r, "Cross-Origin-Resource-Policy", "same-origin");
    add_header(r, "Content-Security-Policy",
               "default-src 'none'; img-src blob:; script-src 'unsafe-inline'; style-src "
               "'unsafe-inline'; connect-src 'self'; frame-ancestors 'none'");
    if (picture) {
        snprintf(number, sizeof number, "%llu", (unsigned long long)picture->number);
        add_header(r, "X-Picture", number);
        add_header(r, "X-Whole", picture->whole ? "1" : "0");
    }
    if (status == MHD_HTTP_METHOD_NOT_ALLOWED)
        add_header(r, "Allow", "GET, HEAD, POST");
    if (closes(status))
        add_header(r, "Connection", "close");
    trip_client_step(client_of(c), REPLY_SECONDS + (double)bytes / SLOWEST_REPLY);
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

/* Checks an address of this server after its scheme. Browsers leave out port 80. */
static bool is_own_address(const server *s, const char *address)
{
    static const char *const names[] = { "127.0.0.1", "localhost" };
    char own[32];
    for (int i = 0; i < 2; i++) {
        snprintf(own, sizeof own, "%s:%d", names[i], s->port);
        if (!strcmp(address, own) || (s->port == 80 && !strcmp(address, names[i])))
            return true;
    }
    return false;
}

/* Facts from the headers of a request about its sender and its body. */
typedef struct head {
    const server *server;
    bool own_host, own_origin, too_long, muddled;
    int hosts, lengths;
} head;

static bool too_long(const char *length)
{
    char *end;
    return strtoull(length, &end, 10) > MAX_BODY || *end;
}

static enum MHD_Result note_header(void *user, enum MHD_ValueKind kind, const char *name,
                                   const char *value)
{
    head *h = user;
    (void)kind;
    if (!strcasecmp(name, "Host")) {
        h->own_host = value && ++h->hosts == 1 && is_own_address(h->server, value);
    } else if (!strcasecmp(name, "Origin")) {
        h->own_origin &=
            value && !strncmp(value, "http://", 7) && is_own_address(h->server, value + 7);
    } else if (!strcasecmp(name, "Content-Length")) {
        h->muddled |= ++h->lengths > 1;
        h->too_long |= !value || too_long(value);
    }
    return MHD_YES;
}

/* Another site's name may resolve to this address (DNS rebinding). So other hosts are refused, and
 * requests that a page of another site sends. */
static head read_head(const server *s, struct MHD_Connection *c)
{
    head h = { .server = s, .own_origin = true };
    MHD_get_connection_values(c, MHD_HEADER_KIND, note_header, &h);
    h.muddled |= h.lengths && MHD_lookup_connection_value(c, MHD_HEADER_KIND, "Transfer-Encoding");
    return h;
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
    trip_client_step(client_of(c), WORK_SECONDS);
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

/* Returns false if the body is too long. */
static bool keep(body *b, const char *data, size_t bytes)
{
    char *text = b->bytes + bytes <= MAX_BODY ? realloc(b->text, b->bytes + bytes) : NULL;
    if (!text)
        return false;
    memcpy(text + b->bytes, data, bytes);
    b->text = text;
    b->bytes += bytes;
    return true;
}

static bool reads(const char *method)
{
    return !strcmp(method, "GET") || !strcmp(method, "HEAD");
}

/* Checks a request by its headers, and refuses it or makes `*kept` for its body. */
static enum MHD_Result admit(server *s, struct MHD_Connection *c, const char *method, void **kept)
{
    const head h = read_head(s, c);
    if (!h.own_host)
        return refuse(c, 403,
                      "this is another host or port: ssh -L has to forward a port of the same "
                      "number");
    if (!same_token(s->token, MHD_lookup_connection_value(c, MHD_GET_ARGUMENT_KIND, "token")))
        return refuse(c, 403, "the address is without its token");
    if (!h.own_origin)
        return refuse(c, 403, "a page of another site sends this request");
    trip_client_welcome(client_of(c));
    if (!reads(method) && strcmp(method, "POST"))
        return refuse(c, 405, "GET, HEAD or POST");
    if (h.muddled)
        return refuse(c, 400, "the request has two lengths");
    if (h.too_long)
        return refuse(c, 413, "too long");
    trip_client_step(client_of(c), BODY_SECONDS);
    *kept = calloc(1, sizeof(body));
    return *kept ? MHD_YES : MHD_NO;
}

/* The library calls this with the headers, then with each part of the body, then without data.
 * MHD_NO closes the connection. */
static enum MHD_Result handle(void *user, struct MHD_Connection *c, const char *path,
                              const char *method, const char *version, const char *data,
                              size_t *bytes, void **kept)
{
    server *s = user;
    body *b = *kept;
    (void)version;
    if (!client_of(c))
        return MHD_NO;
    if (!b)
        return admit(s, c, method, kept);
    if (*bytes) {
        bool kept_all = keep(b, data, *bytes);
        *bytes = 0;
        return kept_all ? MHD_YES : MHD_NO;
    }
    return reads(method) ? get(s, c, path) : post(s, c, path, b);
}

static void forget(void *user, struct MHD_Connection *c, void **kept,
                   enum MHD_RequestTerminationCode code)
{
    body *b = *kept;
    (void)user, (void)code;
    if (b)
        free(b->text);
    free(b);
    *kept = NULL;
    if (client_of(c))
        trip_client_step(client_of(c), REST_SECONDS);
}

static void enter_or_leave(void *user, struct MHD_Connection *c, void **client,
                           enum MHD_ConnectionNotificationCode code)
{
    server *s = user;
    if (code == MHD_CONNECTION_NOTIFY_STARTED)
        *client = trip_clients_enter(
            &s->clients, MHD_get_connection_info(c, MHD_CONNECTION_INFO_CONNECTION_FD)->connect_fd);
    else if (*client)
        trip_client_leave(*client);
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
        (unsigned)TRIP_CLIENT_PLACES, MHD_OPTION_CONNECTION_MEMORY_LIMIT, (size_t)MAX_HEADER,
        MHD_OPTION_STRICT_FOR_CLIENT, 1, MHD_OPTION_NOTIFY_CONNECTION, enter_or_leave, s,
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
    trip_clients_init(&s.clients);
    int status = make_token(&s);
    if (!status)
        status = listen_here(&s, params->port);
    if (!status)
        say_address(&s, params);
    while (!status && !trip_interrupted()) {
        trip_session_tick(s.session, TICK_SECONDS);
        trip_clients_drop_late(&s.clients);
        if (trip_session_take_failure(s.session, line, sizeof line))
            trip_report_line(line);
    }
    trip_session_end(s.session);
    if (s.daemon)
        MHD_stop_daemon(s.daemon);
    trip_clients_release(&s.clients);
    trip_session_stop(s.session);
    return status;
}
