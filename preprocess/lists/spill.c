#include "spill.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include <xxhash.h>

#include "flusher.h"
#include "folder.h"
#include "read_at.h"
#include "remove_files.h"
#include "report.h"

enum { ALIGNMENT_BYTES = 4096, BUFFER_BYTES = 1 << 20 };

#define DATA_NAME "pieces"

struct trip_spill {
    char *path;
    trip_budget *budget;
    int folder; /* holds the lock */
    int file;
    bool keep;
    bool cut; /* the file was cut at `offset`, after the data of an interrupted run */
    unsigned char *buffer;
    size_t used;
    _Atomic uint64_t offset; /* in the file, of the buffer; any thread may read it */
    trip_sequence *sequences;
    size_t count, room;
    XXH64_state_t *hash; /* of the sequence being written */
};

static int fail_memory(const trip_spill *s)
{
    return trip_fail(TRIP_ERROR, "brick", s->path,
                     "needs more memory than --memory allows: raise --memory");
}

/* Returns whether this program makes such a file in the folder, including the files of journal.c
 * and resume.c. */
static bool is_own_file(const char *name)
{
    static const char *const names[] = { DATA_NAME, "journal", "runs", "z0.voxels", "z0.normals" };
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        if (!strcmp(name, names[i]))
            return true;
    return false;
}

static int open_folder(trip_spill *s, bool resume)
{
    int status = trip_folder_open_own(&s->folder, s->path, 0700, "brick",
                                      "another process is at work there");
    if (status == 0 && !resume)
        trip_remove_files(s->folder, is_own_file);
    s->keep = status == 0 && resume && faccessat(s->folder, "journal", F_OK, 0) == 0;
    return status;
}

int trip_spill_open(trip_spill **out, const char *path, bool resume, trip_budget *budget)
{
    trip_spill *s = *out = calloc(1, sizeof *s);
    if (!s || !(s->path = strdup(path))) {
        free(s);
        *out = NULL;
        return trip_fail(TRIP_ERROR, "brick", path, "out of memory");
    }
    s->folder = s->file = -1;
    s->budget = budget;
    s->buffer = trip_budget_take(budget, BUFFER_BYTES);
    s->hash = XXH64_createState();
    int status = s->buffer && s->hash ? open_folder(s, resume) : fail_memory(s);
    if (status < 0) {
        trip_spill_close(s);
        *out = NULL;
    }
    return status;
}

void trip_spill_keep(trip_spill *s, bool keep)
{
    s->keep = keep;
}

void trip_spill_close(trip_spill *s)
{
    if (!s)
        return;
    if (s->file >= 0)
        close(s->file);
    if (s->folder >= 0 && !s->keep) {
        trip_remove_files(s->folder, is_own_file);
        rmdir(s->path);
    }
    if (s->folder >= 0)
        close(s->folder);
    trip_budget_release(s->budget, s->buffer, BUFFER_BYTES);
    XXH64_freeState(s->hash);
    free(s->sequences);
    free(s->path);
    free(s);
}

const char *trip_spill_path(const trip_spill *s)
{
    return s->path;
}

int trip_spill_folder(const trip_spill *s)
{
    return s->folder;
}

static int open_file(trip_spill *s)
{
    int status =
        trip_folder_open_file(&s->file, s->folder, s->path, DATA_NAME, O_RDWR | O_CREAT, "brick");
    if (status == 0)
        fcntl(s->file, F_SETFL, O_DIRECT); /* if refused, I/O uses the page cache */
    return status;
}

static int make_room(trip_spill *s, size_t count)
{
    if (count <= s->room)
        return 0;
    trip_sequence *larger = realloc(s->sequences, 2 * count * sizeof *larger);
    if (!larger)
        return fail_memory(s);
    s->sequences = larger;
    s->room = 2 * count;
    return 0;
}

/* Returns the aligned end of a sequence, or 0 if it is invalid or does not begin at `offset`. */
static uint64_t end_of_sequence(const trip_sequence *t, uint64_t offset)
{
    uint64_t end;
    bool sound = t->offset == offset && t->list < TRIP_MAX_LISTS && t->retired == 0 &&
                 t->bytes >= sizeof(trip_piece) && t->bytes % 8 == 0 &&
                 !__builtin_add_overflow(t->offset, t->bytes, &end) &&
                 !__builtin_add_overflow(end, ALIGNMENT_BYTES - 1, &end) && end <= INT64_MAX;
    return sound ? end & ~((uint64_t)ALIGNMENT_BYTES - 1) : 0;
}

int trip_spill_restore(trip_spill *s, const trip_sequence *sequences, size_t count)
{
    struct stat st;
    uint64_t offset = s->offset;
    int status = s->file < 0 && count ? open_file(s) : 0;
    for (size_t i = 0; i < count && status == 0; i++) {
        offset = end_of_sequence(&sequences[i], offset);
        if (offset == 0)
            status = trip_fail(TRIP_ERROR, "brick", s->path,
                               "the journal describes temporary data that no run writes: run again "
                               "without --resume");
    }
    if (status == 0 && count && fstat(s->file, &st) < 0)
        status = trip_fail_errno("brick", s->path, "cannot examine " DATA_NAME);
    if (status == 0 && count && offset > (uint64_t)st.st_size)
        return 0;
    if (status == 0 && count > trip_budget_left_bytes(s->budget) / (4 * sizeof *sequences))
        status = fail_memory(s); /* a damaged journal may give any number */
    if (status == 0)
        status = make_room(s, s->count + count);
    if (status < 0)
        return status;
    if (count)
        memcpy(s->sequences + s->count, sequences, count * sizeof *sequences);
    s->count += count;
    s->offset = offset;
    return 1;
}

static int write_buffer(trip_spill *s, size_t bytes)
{
    int error = trip_flusher_write(s->file, s->buffer, bytes, s->offset);
    if (error == ENOSPC || error == EDQUOT)
        return trip_fail(TRIP_ERROR, "brick", s->path,
                         "no space left on the disk after %llu bytes of temporary data: free "
                         "some space, write elsewhere, or raise --memory",
                         (unsigned long long)s->offset);
    errno = error;
    if (error)
        return trip_fail_errno("brick", s->path, "cannot write");
    s->offset += bytes;
    s->used = 0;
    return 0;
}

int trip_spill_begin(trip_spill *s, unsigned list)
{
    if (s->file < 0 && open_file(s) < 0)
        return TRIP_ERROR;
    if (!s->cut && ftruncate(s->file, (off_t)s->offset) < 0)
        return trip_fail_errno("brick", s->path, "cannot truncate " DATA_NAME);
    s->cut = true;
    if (make_room(s, s->count + 1) < 0)
        return TRIP_ERROR;
    s->sequences[s->count] = (trip_sequence){ .offset = s->offset, .list = list };
    XXH64_reset(s->hash, 0);
    return 0;
}

int trip_spill_append(trip_spill *s, const void *piece, size_t bytes)
{
    const unsigned char *p = piece;
    XXH64_update(s->hash, piece, bytes);
    s->sequences[s->count].bytes += bytes;
    while (bytes > 0) {
        size_t room = BUFFER_BYTES - s->used, n = bytes < room ? bytes : room;
        memcpy(s->buffer + s->used, p, n);
        s->used += n;
        p += n;
        bytes -= n;
        int status = s->used == BUFFER_BYTES ? write_buffer(s, BUFFER_BYTES) : 0;
        if (status < 0)
            return status;
    }
    return 0;
}

int trip_spill_end(trip_spill *s)
{
    size_t whole = (s->used + ALIGNMENT_BYTES - 1) & ~((size_t)ALIGNMENT_BYTES - 1);
    memset(s->buffer + s->used, 0, whole - s->used);
    int status = write_buffer(s, whole);
    s->sequences[s->count].checksum = XXH64_digest(s->hash);
    if (status == 0)
        s->count++;
    return status;
}

size_t trip_spill_count(const trip_spill *s)
{
    return s->count;
}

const trip_sequence *trip_spill_sequence(const trip_spill *s, size_t index)
{
    return &s->sequences[index];
}

void trip_spill_retire(trip_spill *s, size_t index)
{
    s->sequences[index].retired = 1;
}

uint64_t trip_spill_bytes(const trip_spill *s)
{
    return s->offset;
}

static int fail_damaged(const trip_sequence_reader *r)
{
    return trip_fail(TRIP_ERROR, "brick", r->spill->path,
                     "temporary data at byte %llu have changed since writing: the disk or another "
                     "program changed them",
                     (unsigned long long)r->sequence.offset);
}

/* Moves the unused bytes to the end of the head and reads after them, so that reads are aligned. */
static int refill(trip_sequence_reader *r)
{
    size_t left = r->end - r->begin;
    uint64_t unread = r->sequence.bytes - r->next;
    size_t want = r->buffer_bytes - r->head_bytes;
    if (unread < want)
        want = (size_t)unread;
    if (left > r->head_bytes)
        return fail_damaged(r);
    memmove(r->buffer + r->head_bytes - left, r->buffer + r->begin, left);
    r->begin = r->head_bytes - left;
    r->end = r->head_bytes;
    size_t whole = (want + ALIGNMENT_BYTES - 1) & ~((size_t)ALIGNMENT_BYTES - 1);
    ssize_t n = trip_read_at(r->spill->file, r->buffer + r->head_bytes, whole, want,
                             r->sequence.offset + r->next);
    if (n < 0)
        return trip_fail_errno("brick", r->spill->path, "cannot read");
    if ((size_t)n < want)
        return fail_damaged(r);
    XXH64_update(r->hash, r->buffer + r->head_bytes, want);
    r->next += want;
    r->end += want;
    return 0;
}

static bool has_piece(const trip_sequence_reader *r)
{
    const trip_piece *p = (const void *)(r->buffer + r->begin);
    size_t left = r->end - r->begin;
    return left >= sizeof *p && trip_piece_check(p, r->format, left);
}

static int set_piece(trip_sequence_reader *r)
{
    int status = 0;
    if (!has_piece(r) && r->next < r->sequence.bytes)
        status = refill(r);
    if (status < 0)
        return status;
    r->source.piece = NULL;
    if (has_piece(r))
        r->source.piece = (const void *)(r->buffer + r->begin);
    else if (r->begin < r->end || XXH64_digest(r->hash) != r->sequence.checksum)
        status = fail_damaged(r);
    return status;
}

static int advance_sequence(trip_piece_source *source)
{
    trip_sequence_reader *r = (trip_sequence_reader *)source;
    uint64_t key = source->piece->key;
    r->begin += trip_piece_get_parts(r->format, source->piece).bytes;
    int status = set_piece(r);
    if (status == 0 && source->piece && source->piece->key < key)
        status = fail_damaged(r);
    return status;
}

static size_t head_bytes(const trip_piece_format *f)
{
    return (trip_piece_max_bytes(f) + ALIGNMENT_BYTES - 1) & ~((size_t)ALIGNMENT_BYTES - 1);
}

size_t trip_sequence_buffer_bytes(const trip_piece_format *f)
{
    return 2 * head_bytes(f);
}

int trip_sequence_reader_open(trip_sequence_reader *r, const trip_spill *s, size_t index,
                              const trip_piece_format *format, void *buffer, size_t buffer_bytes)
{
    size_t head = head_bytes(format);
    *r = (trip_sequence_reader){ .source = { .advance = advance_sequence },
                                 .spill = s,
                                 .sequence = s->sequences[index],
                                 .format = format,
                                 .buffer = buffer,
                                 .buffer_bytes = buffer_bytes,
                                 .head_bytes = head,
                                 .begin = head,
                                 .end = head,
                                 .hash = XXH64_createState() };
    if (!r->hash)
        return fail_memory(s);
    XXH64_reset(r->hash, 0);
    return set_piece(r);
}

void trip_sequence_reader_close(trip_sequence_reader *r)
{
    XXH64_freeState(r->hash);
    r->hash = NULL;
}
