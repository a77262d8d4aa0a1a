#include "journal.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include <xxhash.h>

#include "report.h"

enum { RUN_BUFFER = 4096 };

enum record_kind { RECORD_START = 1, RECORD_CHECKPOINT = 2 };

/* Before every record; the checkpoint's new segments follow it. */
typedef struct record_head {
    uint64_t kind;
    uint64_t bytes;    /* of the record after this */
    uint64_t checksum; /* XXH64 of them, the kind as seed */
} record_head;

struct trip_journal {
    char *path; /* of the journal, for messages */
    int file, runs_file;
    uint64_t offset; /* end of what is valid */
    bool has_start, has_checkpoint;
    trip_journal_start start;
    trip_checkpoint checkpoint;
    trip_segment *segments; /* those of the checkpoint */
    uint64_t noted;         /* segments in the journal so far */
    uint64_t runs, ordered_splats;
    trip_run_record buffer[RUN_BUFFER];
    size_t buffered;
};

static int fail_memory(const trip_journal *j)
{
    return trip_fail(TRIP_ERROR, "brick", j->path, "out of memory");
}

static int write_at(const trip_journal *j, int file, uint64_t offset, const void *data,
                    size_t bytes)
{
    const unsigned char *p = data;
    while (bytes > 0) {
        ssize_t n = pwrite(file, p, bytes, (off_t)offset);
        if (n < 0 && errno == EINTR)
            continue;
        if (n <= 0)
            return trip_fail_errno("brick", j->path, "cannot write");
        p += n;
        offset += (uint64_t)n;
        bytes -= (size_t)n;
    }
    return 0;
}

/* False at the end of the file, too. */
static bool read_at(int file, uint64_t offset, void *data, size_t bytes)
{
    unsigned char *p = data;
    while (bytes > 0) {
        ssize_t n = pread(file, p, bytes, (off_t)offset);
        if (n < 0 && errno == EINTR)
            continue;
        if (n <= 0)
            return false;
        p += n;
        offset += (uint64_t)n;
        bytes -= (size_t)n;
    }
    return true;
}

static int append_record(trip_journal *j, enum record_kind kind, const void *record, size_t bytes)
{
    record_head head = { kind, bytes, XXH64(record, bytes, kind) };
    int status = write_at(j, j->file, j->offset, &head, sizeof head);
    if (status == 0)
        status = write_at(j, j->file, j->offset + sizeof head, record, bytes);
    j->offset += sizeof head + bytes;
    return status;
}

/* The record at `offset`, for free(); NULL where no sound one is. */
static void *read_record(const trip_journal *j, uint64_t offset, record_head *head)
{
    struct stat st;
    if (fstat(j->file, &st) != 0 || !read_at(j->file, offset, head, sizeof *head) ||
        head->bytes > (uint64_t)st.st_size)
        return NULL;
    void *record = malloc(head->bytes + 1);
    if (record && read_at(j->file, offset + sizeof *head, record, head->bytes) &&
        XXH64(record, head->bytes, head->kind) == head->checksum)
        return record;
    free(record);
    return NULL;
}

/* A checkpoint and the segments that are new with it. Returns 1 when it was taken over. */
static int take_checkpoint(trip_journal *j, const void *record, uint64_t bytes,
                           uint64_t ordered_splats)
{
    trip_checkpoint c;
    if (bytes < sizeof c)
        return 0;
    memcpy(&c, record, sizeof c);
    uint64_t fresh = c.segments - j->noted;
    if (c.ordered_splats > ordered_splats || bytes != sizeof c + fresh * sizeof(trip_segment))
        return 0;
    trip_segment *larger = realloc(j->segments, (c.segments + 1) * sizeof *larger);
    if (!larger)
        return fail_memory(j);
    memcpy(larger + j->noted, (const char *)record + sizeof c, fresh * sizeof *larger);
    j->segments = larger;
    j->noted = c.segments;
    j->checkpoint = c;
    j->has_checkpoint = true;
    return 1;
}

/* Reads checkpoints until one is cut off or needs more than there is. */
static int read_checkpoints(trip_journal *j, uint64_t ordered_splats)
{
    for (int taken = 1; taken == 1;) {
        record_head head;
        void *record = read_record(j, j->offset, &head);
        if (!record)
            return 0;
        taken = head.kind == RECORD_CHECKPOINT
                    ? take_checkpoint(j, record, head.bytes, ordered_splats)
                    : 0;
        free(record);
        if (taken < 0)
            return taken;
        if (taken == 1)
            j->offset += sizeof head + head.bytes;
    }
    return 0;
}

static int read_journal(trip_journal *j, uint64_t identity, uint64_t ordered_splats)
{
    record_head head;
    void *record = read_record(j, 0, &head);
    if (!record || head.kind != RECORD_START || head.bytes != sizeof j->start) {
        free(record);
        return 0;
    }
    memcpy(&j->start, record, sizeof j->start);
    free(record);
    if (j->start.identity != identity)
        return trip_fail(TRIP_ERROR, "brick", j->path,
                         "the interrupted run had another input or other options: without --resume "
                         "it starts again");
    j->has_start = true;
    j->offset = sizeof head + head.bytes;
    int status = read_checkpoints(j, ordered_splats);
    j->runs = j->checkpoint.runs;
    j->ordered_splats = j->checkpoint.ordered_splats;
    return status;
}

static int open_files(trip_journal *j, const char *folder, bool resume)
{
    char *runs = NULL;
    int flags = O_RDWR | O_CREAT | O_CLOEXEC | (resume ? 0 : O_TRUNC);
    if (asprintf(&j->path, "%s/journal", folder) < 0) {
        j->path = NULL;
        return trip_fail(TRIP_ERROR, "brick", folder, "out of memory");
    }
    if (asprintf(&runs, "%s/runs", folder) < 0)
        return fail_memory(j);
    j->file = open(j->path, flags, 0666);
    j->runs_file = open(runs, flags, 0666);
    free(runs);
    return j->file < 0 || j->runs_file < 0 ? trip_fail_errno("brick", j->path, "cannot create") : 0;
}

int trip_journal_open(trip_journal **out, const trip_spill *spill, bool resume, uint64_t identity,
                      uint64_t ordered_splats)
{
    trip_journal *j = *out = calloc(1, sizeof *j);
    if (!j)
        return trip_fail(TRIP_ERROR, "brick", trip_spill_path(spill), "out of memory");
    j->file = j->runs_file = -1;
    int status = open_files(j, trip_spill_path(spill), resume);
    if (status == 0 && resume)
        status = read_journal(j, identity, ordered_splats);
    if (status == 0 && ftruncate(j->file, (off_t)j->offset) < 0)
        status = trip_fail_errno("brick", j->path, "cannot shorten");
    return status;
}

void trip_journal_close(trip_journal *j)
{
    if (!j)
        return;
    if (j->file >= 0)
        close(j->file);
    if (j->runs_file >= 0)
        close(j->runs_file);
    free(j->segments);
    free(j->path);
    free(j);
}

const trip_journal_start *trip_journal_get_start(const trip_journal *j)
{
    return j->has_start ? &j->start : NULL;
}

const trip_checkpoint *trip_journal_get_checkpoint(const trip_journal *j)
{
    return j->has_checkpoint ? &j->checkpoint : NULL;
}

const trip_segment *trip_journal_get_segments(const trip_journal *j)
{
    return j->segments;
}

int trip_journal_read_runs(const trip_journal *j, uint64_t index, trip_run_record *runs,
                           size_t count)
{
    if (read_at(j->runs_file, index * sizeof *runs, runs, count * sizeof *runs))
        return 0;
    return trip_fail(TRIP_ERROR, "brick", j->path,
                     "its list of runs is cut off: without --resume it starts again");
}

int trip_journal_write_start(trip_journal *j, const trip_journal_start *start)
{
    j->start = *start;
    j->has_start = true;
    return append_record(j, RECORD_START, start, sizeof *start);
}

static int flush_runs(trip_journal *j)
{
    uint64_t first = j->runs - j->buffered;
    int status = write_at(j, j->runs_file, first * sizeof *j->buffer, j->buffer,
                          j->buffered * sizeof *j->buffer);
    j->buffered = 0;
    return status;
}

uint32_t trip_run_checksum(const uint32_t *voxels, const uint32_t *normals, uint32_t splats)
{
    uint64_t sum = XXH64(voxels, splats * sizeof *voxels, 0);
    return (uint32_t)(normals ? XXH64(normals, splats * sizeof *normals, sum) : sum);
}

int trip_journal_add_run(trip_journal *j, const trip_run_record *run)
{
    j->buffer[j->buffered++] = *run;
    j->runs++;
    j->ordered_splats += run->splats;
    return j->buffered == RUN_BUFFER ? flush_runs(j) : 0;
}

int trip_journal_write_checkpoint(trip_journal *j, trip_checkpoint *c, const trip_spill *spill)
{
    size_t fresh = trip_spill_count(spill) - j->noted;
    size_t bytes = sizeof *c + fresh * sizeof(trip_segment);
    unsigned char *record = malloc(bytes);
    if (!record)
        return fail_memory(j);
    c->segments = trip_spill_count(spill);
    c->runs = j->runs;
    c->ordered_splats = j->ordered_splats;
    memcpy(record, c, sizeof *c);
    if (fresh)
        memcpy(record + sizeof *c, trip_spill_segment(spill, j->noted),
               fresh * sizeof(trip_segment));
    j->noted += fresh;
    int status = flush_runs(j);
    if (status == 0)
        status = append_record(j, RECORD_CHECKPOINT, record, bytes);
    free(record);
    return status;
}
