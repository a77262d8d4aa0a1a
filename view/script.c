#include "script.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "draw_settings.h"
#include "input_file.h"
#include "report.h"
#include "text.h"

enum {
    LINE_BYTES = 4096,
    MAX_BYTES = 8 << 20,
    MAX_EVENTS = 1 << 20,
    MAX_STEPS = 10000,
    MAX_WORDS = 10,
};

typedef struct parser {
    const char *name;
    long line;
    trip_script *script;
    size_t room;
    char *words[MAX_WORDS]; /* of the line; the first is the command */
    int count;
    unsigned modifiers; /* from the line's last words */
} parser;

#define fail_at(p, ...) trip_fail_line("script", (p)->name, (p)->line, __VA_ARGS__)

static int add(parser *p, trip_event event)
{
    trip_script *s = p->script;
    event.modifiers = p->modifiers;
    if (s->count == MAX_EVENTS) {
        free(event.text);
        return fail_at(p, "more than %d events", MAX_EVENTS);
    }
    if (s->count == p->room) {
        size_t room = p->room ? 2 * p->room : 64;
        trip_event *events = realloc(s->events, room * sizeof *events);
        if (!events) {
            free(event.text);
            return fail_at(p, "out of memory");
        }
        s->events = events;
        p->room = room;
    }
    s->events[s->count++] = event;
    return 0;
}

/* Values of words */

/* Limit of positions, sizes and times. */
#define MAX_NUMBER 1e6

static int number(const parser *p, int word, double *out)
{
    if (trip_text_to_double(p->words[word], out) && fabs(*out) <= MAX_NUMBER)
        return 0;
    return fail_at(p, "`%.40s` is not a number up to %g", p->words[word], MAX_NUMBER);
}

static int whole(const parser *p, int word, double lo, double hi, double *out)
{
    if (trip_text_to_double(p->words[word], out) && *out == floor(*out) && *out >= lo && *out <= hi)
        return 0;
    return fail_at(p, "`%.40s` is not a whole number from %.0f to %.0f", p->words[word], lo, hi);
}

static int find(const char *word, const char *const *names)
{
    for (int i = 0; names[i]; i++)
        if (!strcmp(word, names[i]))
            return i;
    return -1;
}

static int button(const parser *p, int *code)
{
    static const char *const names[] = { "left", "right", "middle", NULL };
    *code = find(p->words[1], names);
    return *code >= 0 ? 0
                      : fail_at(p, "`%.40s` is not a button: left, right or middle", p->words[1]);
}

/* Names of the keys from TRIP_KEY_ESCAPE on. */
static const char *const key_names[] = { "escape", "enter",   "tab",       "backspace", "delete",
                                         "left",   "right",   "up",        "down",      "home",
                                         "end",    "page-up", "page-down", "f1",        NULL };

static int key(const parser *p, int *code)
{
    const char *word = p->words[1];
    int named = find(word, key_names);
    trip_text_character c = trip_text_next(word);
    *code = named >= 0 ? TRIP_KEY_ESCAPE + named : !strcmp(word, "space") ? ' ' : (int)c.code;
    bool single = c.printable && c.bytes == 1 && !word[1] && !(*word >= 'A' && *word <= 'Z');
    return named >= 0 || single || *code == ' '
               ? 0
               : fail_at(p, "`%.40s` is not a key: a character as it is without shift, or a name",
                         word);
}

/* Commands */

static int parse_move(parser *p)
{
    trip_event e = { .kind = TRIP_EVENT_MOVE };
    int status = number(p, 1, &e.x);
    if (!status)
        status = number(p, 2, &e.y);
    return status ? status : add(p, e);
}

static int parse_button(parser *p)
{
    trip_event e = { .kind = TRIP_EVENT_BUTTON, .down = !strcmp(p->words[0], "press") };
    int status = button(p, &e.code);
    return status ? status : add(p, e);
}

static int add_drag(parser *p, int code, const double at[4], int steps)
{
    int status = add(p, (trip_event){ .kind = TRIP_EVENT_MOVE, .x = at[0], .y = at[1] });
    if (!status)
        status = add(p, (trip_event){ .kind = TRIP_EVENT_BUTTON, .code = code, .down = true });
    for (int i = 1; i <= steps && !status; i++)
        status = add(p, (trip_event){ .kind = TRIP_EVENT_MOVE,
                                      .x = at[0] + (at[2] - at[0]) * i / steps,
                                      .y = at[1] + (at[3] - at[1]) * i / steps });
    return status ? status : add(p, (trip_event){ .kind = TRIP_EVENT_BUTTON, .code = code });
}

static int parse_drag(parser *p)
{
    double at[4], steps = 0;
    int code, status = button(p, &code);
    for (int i = 0; i < 4 && !status; i++)
        status = number(p, 2 + i, &at[i]);
    if (!status)
        status = whole(p, 6, 1, MAX_STEPS, &steps);
    return status ? status : add_drag(p, code, at, (int)steps);
}

static int parse_wheel(parser *p)
{
    trip_event e = { .kind = TRIP_EVENT_WHEEL };
    int status = number(p, 1, &e.y);
    return status ? status : add(p, e);
}

static int parse_key(parser *p)
{
    trip_event e = { .kind = TRIP_EVENT_KEY, .down = p->words[0][0] != 'l' };
    int status = key(p, &e.code);
    if (!status)
        status = add(p, e);
    e.down = false;
    return status || p->words[0][0] != 'k' ? status : add(p, e);
}

static int parse_resize(parser *p)
{
    enum { MAX_SIZE = 16384 };
    trip_event e = { .kind = TRIP_EVENT_RESIZE };
    int status = whole(p, 1, 1, MAX_SIZE, &e.x);
    if (!status)
        status = whole(p, 2, 1, MAX_SIZE, &e.y);
    return status ? status : add(p, e);
}

static int parse_plain(parser *p)
{
    static const char *const names[] = { "minimise", "restore", "close", "wait", NULL };
    static const trip_event_kind kinds[] = { TRIP_EVENT_ICONIFY, TRIP_EVENT_ICONIFY,
                                             TRIP_EVENT_CLOSE, TRIP_EVENT_WAIT };
    int which = find(p->words[0], names);
    return add(p, (trip_event){ .kind = kinds[which], .down = which == 0 });
}

static int parse_sleep(parser *p)
{
    trip_event e = { .kind = TRIP_EVENT_SLEEP };
    int status = whole(p, 1, 0, MAX_NUMBER, &e.x);
    return status ? status : add(p, e);
}

static int parse_random(parser *p)
{
    double count = 0, seed = 0;
    int status = whole(p, 1, 0, MAX_NUMBER, &count);
    if (!status)
        status = whole(p, 2, 0, 0x1p53, &seed);
    return status ? status
                  : add(p, (trip_event){ .kind = TRIP_EVENT_RANDOM,
                                         .count = (uint64_t)count,
                                         .seed = (uint64_t)seed });
}

static int parse_type(parser *p)
{
    for (const char *text = p->words[1]; *text;) {
        trip_text_character c = trip_text_next(text);
        if (!c.printable)
            return fail_at(p, "a character that cannot be typed");
        int status = add(p, (trip_event){ .kind = TRIP_EVENT_TEXT, .code = (int)c.code });
        if (status)
            return status;
        text += c.bytes;
    }
    return 0;
}

static int parse_file(parser *p)
{
    static const char *const names[] = { "drop", "screenshot", "picture", "status", NULL };
    static const trip_event_kind kinds[] = { TRIP_EVENT_DROP, TRIP_EVENT_SCREENSHOT,
                                             TRIP_EVENT_PICTURE, TRIP_EVENT_STATUS };
    char *text = strdup(p->words[1]);
    if (!text)
        return fail_at(p, "out of memory");
    return add(p, (trip_event){ .kind = kinds[find(p->words[0], names)], .text = text });
}

static int parse_set(parser *p)
{
    draw_settings scratch = { .has_background = 0 };
    trip_scope quiet = { .sink = trip_report_discard }, *before = trip_scope_enter(&quiet);
    const int status = draw_settings_read_text(&scratch, p->words[1]);
    trip_scope_enter(before);
    char *text = status ? NULL : strdup(p->words[1]);
    if (!text)
        return status ? fail_at(p, "`%.40s` does not set settings", p->words[1])
                      : fail_at(p, "out of memory");
    return add(p, (trip_event){ .kind = TRIP_EVENT_SET, .text = text });
}

static int parse_click(parser *p)
{
    char *label = NULL;
    const char *part = strtok_r(p->words[1], " \t", &label);
    trip_event e = { .kind = TRIP_EVENT_CLICK };
    if (!trip_text_to_double(part, &e.x) || !(e.x >= 0 && e.x <= 1))
        return fail_at(p, "`%.40s` is not how far along a control, 0 to 1", part);
    label += strspn(label, " \t");
    if (!*label)
        return fail_at(p, "a control's label is missing after how far along it");
    e.text = strdup(label);
    return e.text ? add(p, e) : fail_at(p, "out of memory");
}

enum { REST = -1 }; /* the argument is the rest of the line */

static const struct command {
    const char *name;
    int words; /* arguments without modifiers */
    bool modifiers;
    int (*parse)(parser *p);
} commands[] = {
    { "move", 2, false, parse_move },
    { "press", 1, true, parse_button },
    { "release", 1, true, parse_button },
    { "drag", 6, true, parse_drag },
    { "wheel", 1, true, parse_wheel },
    { "key", 1, true, parse_key },
    { "hold", 1, true, parse_key },
    { "let", 1, true, parse_key },
    { "type", REST, false, parse_type },
    { "resize", 2, false, parse_resize },
    { "drop", REST, false, parse_file },
    { "minimise", 0, false, parse_plain },
    { "restore", 0, false, parse_plain },
    { "close", 0, false, parse_plain },
    { "wait", 0, false, parse_plain },
    { "sleep", 1, false, parse_sleep },
    { "screenshot", REST, false, parse_file },
    { "picture", REST, false, parse_file },
    { "random", 2, false, parse_random },
    { "status", REST, false, parse_file },
    { "set", REST, false, parse_set },
    { "click", REST, false, parse_click },
};
enum { COMMANDS = sizeof commands / sizeof commands[0] };

static const struct command *find_command(const char *name)
{
    for (int i = 0; i < COMMANDS; i++)
        if (!strcmp(commands[i].name, name))
            return &commands[i];
    return NULL;
}

/* Removes modifiers such as "+shift" from the end of the words. */
static int take_modifiers(parser *p)
{
    static const char *const names[] = { "+shift", "+control", "+alt", NULL };
    p->modifiers = 0;
    while (p->count > 2 && p->words[p->count - 1][0] == '+' && p->words[p->count - 1][1]) {
        int which = find(p->words[--p->count], names);
        if (which < 0)
            return fail_at(p, "`%.40s` is not held with anything: +shift, +control or +alt",
                           p->words[p->count]);
        p->modifiers |= 1u << which;
    }
    return 0;
}

static int cut_words(parser *p, char *rest)
{
    char *next = NULL;
    for (char *w = strtok_r(rest, " \t", &next); w; w = strtok_r(NULL, " \t", &next)) {
        if (p->count == MAX_WORDS)
            return fail_at(p, "more than %d words", MAX_WORDS);
        p->words[p->count++] = w;
    }
    return 0;
}

/* Parses a line without its newline; cuts it into words in place. */
static int parse_line(parser *p, char *line)
{
    line += strspn(line, " \t");
    if (*line == 0 || *line == '#')
        return 0;
    size_t length = strcspn(line, " \t");
    char *rest = line + length + strspn(line + length, " \t");
    for (size_t end = strlen(rest); end > 0 && strchr(" \t", rest[end - 1]); end--)
        rest[end - 1] = 0;
    line[length] = 0;
    const struct command *c = find_command(line);
    p->words[0] = line;
    p->count = 1;
    p->modifiers = 0;
    if (!c)
        return fail_at(p, "`%.40s` is not an event; triptych-view(1) lists them", line);
    int status = 0;
    if (c->words != REST)
        status = cut_words(p, rest);
    else if (*rest)
        p->words[p->count++] = rest;
    if (!status && c->modifiers)
        status = take_modifiers(p);
    int wanted = c->words == REST ? 1 : c->words;
    if (!status && p->count - 1 != wanted)
        return fail_at(p, "`%s` takes %d words after it, not %d", line, wanted, p->count - 1);
    return status ? status : c->parse(p);
}

static int parse_lines(parser *p, const char *text, size_t bytes)
{
    char line[LINE_BYTES];
    const char *end = text + bytes;
    int status = 0;
    while (text < end && !status) {
        const char *stop = memchr(text, '\n', (size_t)(end - text));
        size_t length = (size_t)((stop ? stop : end) - text);
        p->line++;
        if (length >= sizeof line)
            return fail_at(p, "longer than %d characters", LINE_BYTES - 1);
        if (memchr(text, 0, length))
            return fail_at(p, "a zero byte; this is not a text file");
        memcpy(line, text, length);
        line[length] = 0;
        line[strcspn(line, "\r")] = 0;
        status = parse_line(p, line);
        text += length + (stop != NULL);
    }
    return status;
}

int trip_script_parse(trip_script *out, const char *name, const char *text, size_t bytes)
{
    parser p = { .name = name, .script = out };
    *out = (trip_script){ 0 };
    int status = parse_lines(&p, text, bytes);
    if (status)
        trip_script_free(out);
    return status;
}

static int read_file(const char *path, char **text, ssize_t *bytes)
{
    int fd = trip_input_open(path);
    *text = fd < 0 ? NULL : malloc(MAX_BYTES + 1);
    *bytes = *text ? trip_input_read(fd, *text, MAX_BYTES + 1) : -1;
    int status = *bytes < 0 ? trip_fail_errno("script", path, "cannot read") : 0;
    if (*bytes > MAX_BYTES)
        status = trip_fail(TRIP_ERROR, "script", path, "is longer than %d MiB", MAX_BYTES >> 20);
    if (fd >= 0)
        close(fd);
    return status;
}

int trip_script_load(trip_script *out, const char *path)
{
    char *text = NULL;
    ssize_t bytes;
    *out = (trip_script){ 0 };
    int status = read_file(path, &text, &bytes);
    if (!status)
        status = trip_script_parse(out, path, text, (size_t)bytes);
    free(text);
    return status;
}

void trip_script_free(trip_script *s)
{
    for (size_t i = 0; i < s->count; i++)
        free(s->events[i].text);
    free(s->events);
    *s = (trip_script){ 0 };
}
