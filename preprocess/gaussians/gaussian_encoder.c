#include "gaussian_encoder.h"

#include "gaussian_sort.h"
#include "report.h"

enum { SLOTS_OF_WORKER = 4, MEMORY_PART = 8 };

/* A piece and its brick. */
typedef struct slot {
    trip_gaussian_piece piece;
    bool divided; /* by a gap: the owner encodes it */
    trip_file_gaussian_brick brick;
    unsigned char *spilled, *codes;
    const unsigned char **splats; /* addresses in `spilled` */
    trip_piece_room room;
} slot;

struct trip_gaussian_encoder {
    trip_gaussian_writer *writer;
    trip_workers *workers;
    trip_budget *budget;
    size_t stride, bytes; /* of a spilled splat; of all memory */
    unsigned half;        /* slots that a loop encodes at most */
    bool overlaps;        /* a loop runs while the other half is filled */
    unsigned filling;     /* first slot of the half that is filled */
    unsigned filled;      /* slots of it */
    slot *encoding;       /* first slot of the loop */
    unsigned running;     /* slots of the loop; 0: no loop runs */
    slot slots[];
};

static size_t slot_bytes(size_t stride, size_t codes)
{
    const size_t each = stride + 2 * sizeof(unsigned char *) + 2 * sizeof(trip_key);
    return TRIP_GAUSSIAN_BRICK_RECORDS_MAX * each + codes;
}

/* Divides one block of memory into the tables of a slot. */
static void set_slot(slot *s, unsigned char *room, size_t stride)
{
    const size_t count = TRIP_GAUSSIAN_BRICK_RECORDS_MAX;
    s->spilled = room;
    s->room.keys = (void *)(room + count * stride);
    s->room.scratch = s->room.keys + count;
    s->splats = (void *)(s->room.scratch + count);
    s->room.others = s->splats + count;
    s->codes = (void *)(s->room.others + count);
}

bool trip_gaussian_encoder_create(trip_gaussian_encoder **out, trip_gaussian_writer *writer,
                                  trip_workers *workers, int degree, trip_budget *budget)
{
    const size_t stride = trip_spilled_bytes(degree);
    const size_t own =
        (slot_bytes(stride, trip_gaussian_writer_codes_bytes(writer)) + 7) & ~(size_t)7;
    const size_t each = own + sizeof(slot);
    uint64_t slots = trip_budget_left_bytes(budget) / MEMORY_PART / each;
    const uint64_t most = (uint64_t)SLOTS_OF_WORKER * trip_workers_count(workers);
    slots = slots > most ? most : slots < 1 ? 1 : slots;
    const bool overlaps = slots > 1;
    const unsigned half = overlaps ? (unsigned)(slots / 2) : 1, all = overlaps ? 2 * half : 1;
    const size_t bytes = sizeof(trip_gaussian_encoder) + all * each;
    trip_gaussian_encoder *e = *out = trip_budget_take(budget, bytes);
    if (!e)
        return false;
    e->writer = writer;
    e->workers = workers;
    e->budget = budget;
    e->stride = stride;
    e->bytes = bytes;
    e->half = half;
    e->overlaps = overlaps;
    for (unsigned i = 0; i < all; i++)
        set_slot(&e->slots[i], (unsigned char *)(e->slots + all) + i * own, stride);
    return true;
}

unsigned char *trip_gaussian_encoder_room(const trip_gaussian_encoder *e)
{
    return e->slots[e->filling + e->filled].spilled;
}

/* ---- loops ---- */

static int encode_slot(void *user, unsigned thread, uint64_t item)
{
    const trip_gaussian_encoder *e = user;
    slot *s = &e->encoding[item];
    const unsigned count = s->piece.count;
    (void)thread;
    for (unsigned i = 0; i < count; i++)
        s->splats[i] = s->spilled + i * e->stride + sizeof(trip_spilled);
    s->divided = trip_piece_has_gap(&s->piece, s->splats, &s->room);
    if (!s->divided)
        trip_gaussian_writer_encode(e->writer, s->piece.size_class, s->splats, count, &s->brick,
                                    s->codes);
    return TRIP_OK;
}

/* Waits for the loop and writes its bricks. */
static int end_loop(trip_gaussian_encoder *e)
{
    const unsigned count = e->running;
    int status = TRIP_OK;
    if (!count)
        return TRIP_OK;
    e->running = 0;
    trip_workers_wait(e->workers, 0, &status);
    for (unsigned i = 0; i < count && status == TRIP_OK; i++) {
        slot *s = &e->encoding[i];
        status = s->divided
                     ? trip_piece_write_divided(e->writer, &s->piece, s->splats, &s->room, s->codes)
                     : trip_gaussian_writer_append(e->writer, s->piece.axis, s->piece.node,
                                                   &s->brick, s->codes);
    }
    return status;
}

/* Starts a loop with the filled slots after the end of the loop before it. */
static int start_loop(trip_gaussian_encoder *e)
{
    int status = end_loop(e);
    if (status < 0 || !e->filled)
        return status;
    e->encoding = &e->slots[e->filling];
    e->running = e->filled;
    trip_workers_start(e->workers, encode_slot, e, e->running);
    e->filled = 0;
    if (e->overlaps)
        e->filling = e->filling ? 0 : e->half;
    return e->overlaps ? TRIP_OK : end_loop(e);
}

int trip_gaussian_encoder_send(trip_gaussian_encoder *e, const trip_gaussian_piece *piece)
{
    e->slots[e->filling + e->filled++].piece = *piece;
    return e->filled == e->half ? start_loop(e) : TRIP_OK;
}

int trip_gaussian_encoder_finish(trip_gaussian_encoder *e)
{
    const int status = start_loop(e);
    return status == TRIP_OK ? end_loop(e) : status;
}

void trip_gaussian_encoder_free(trip_gaussian_encoder *e)
{
    int status;
    if (!e)
        return;
    if (e->running)
        trip_workers_wait(e->workers, 0, &status);
    trip_budget_release(e->budget, e, e->bytes);
}
