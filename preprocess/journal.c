#include "journal.h"

#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include <xxhash.h>

#include "flusher.h"
#include "folder.h"
#include "read_at.h"
#include "report.h"

/* Maximum length of a record; no checkpoint adds that many sequences. */
enum { RUN_BUFFER = 4096, RECORD_MAX_BYTES = 4 << 20 };

enum record_kind { RECORD_START = 1, RECORD_CHECKPOINT = 2, RECORD_OUTPUT = 3 };

/* Header of a record. The record of a checkpoint ends with its new sequences. */
typedef struct record_head {
    uint64_t kind;
    uint64_t bytes;    /* bytes of the record after the header */
    uint64_t checksum; /* XXH64 of the record after the header, with the kind as seed */
} record_head;

struct trip_journal {
    trip_journal_params params;
    char *path; /* path of the journal, for messages */
    trip_budget *budget;
    int file, runs_file;
    uint64_t offset; /* end of the valid records */
    bool has_start, has_checkpoint, has_output;
    trip_journal_start start;
    trip_checkpoint checkpoint;
    trip_journal_output output;
    uint64_t recorded; /* sequences in the journal so far */
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
    errno = trip_flusher_write(file, data, bytes, offset);
    return errno ? trip_fail_errno("brick", j->path, "cannot write") : 0;
}

/* Reads bytes. Returns false also at the end of the file. */
static bool read_at(int file, uint64_t offset, void *data, size_t bytes)
{
    return trip_read_at(file, data, bytes, bytes, offset) == (ssize_t)bytes;
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

/* Allocates room for the longest record from the budget. The caller releases it. */
static void *take_room(const trip_journal *j)
{
    void *room = trip_budget_take(j->budget, RECORD_MAX_BYTES);
    if (!room)
        trip_fail(TRIP_ERROR, "brick", j->path, "needs more memory than allowed; raise --memory");
    return room;
}

/* Reads the record at `offset`. Returns false if there is no valid one. */
static bool read_record(const trip_journal *j, uint64_t offset, record_head *head, void *record)
{
    return read_at(j->file, offset, head, sizeof *head) && head->bytes <= RECORD_MAX_BYTES &&
           read_at(j->file, offset + sizeof *head, record, head->bytes) &&
           XXH64(record, head->bytes, head->kind) == head->checksum;
}

/* Refuses a record with a valid checksum that no run writes. It may be forged. */
static int fail_false(const trip_journal *j, const char *stage)
{
    return trip_fail(TRIP_ERROR, "brick", j->path, "%s is invalid; run again without --resume",
                     stage);
}

static int check_start(const trip_journal *j, const trip_journal_start *s)
{
    const trip_journal_params *p = &j->params;
    if (s->identity != p->identity)
        return trip_fail(
            TRIP_ERROR, "brick", j->path,
            "the interrupted run had another input or other options; run again without "
            "--resume");
    if (s->scanned != p->scanned)
        return fail_false(j, "its kind");
    bool sound = s->fills.count <= TRIP_FILLS_MAX && s->finite_before <= p->voxels;
    for (uint64_t i = 0; i < s->fills.count && sound; i++)
        sound = isfinite(s->fills.values[i]);
    if (!sound)
        return fail_false(j, "its list of fill values");
    if (s->ids > 1)
        return fail_false(j, "its kind");
    if (!s->scanned || s->ids) /* a resumed run scans ids again */
        return 0;
    if (!trip_tally_check(&s->tally) || s->tally.finite == 0 || s->tally.voxels > p->voxels ||
        (p->slice_voxels && s->tally.voxels != p->voxels))
        return fail_false(j, "its count of values");
    return 0;
}

/* Returns whether no count is below the same count of the previous checkpoint. Before the first
 * checkpoint, all counts are zero. The record itself determines the count of sequences. */
static bool is_later(const trip_checkpoint *before, const trip_checkpoint *c)
{
    bool fits = c->done >= before->done && c->kept >= before->kept && c->halo >= before->halo &&
                c->runs >= before->runs && c->ordered_splats >= before->ordered_splats;
    for (int i = 0; i < TRIP_PLANES_OF_VOXELS; i++)
        fits = fits && c->ordered_bytes[i] >= before->ordered_bytes[i];
    return fits;
}

/* Sets *voxels to the number of voxels in the finished part, or an upper bound for sparse volumes.
 */
static bool done_voxels(const trip_journal_params *p, uint64_t done, uint64_t *voxels)
{
    *voxels = p->voxels;
    if (p->slice_voxels && __builtin_mul_overflow(done, p->slice_voxels, voxels))
        return false;
    return *voxels <= p->voxels;
}

/* Returns whether the halo's size is possible. Each kept voxel has 26 neighbours, and in dense
 * volumes the halo lies among the other voxels. */
static bool can_have_halo(const trip_journal_params *p, const trip_checkpoint *c, uint64_t voxels)
{
    uint64_t each = c->kept ? c->halo / c->kept : c->halo;
    bool few = c->kept ? each < 26 || c->halo == 26 * c->kept : each == 0;
    return few && (p->halo || c->halo == 0) && (!p->slice_voxels || c->halo <= voxels - c->kept);
}

static int check_checkpoint(const trip_journal *j, const trip_checkpoint *c)
{
    const trip_journal_params *p = &j->params;
    const trip_tally *t = p->scanned ? &j->start.tally : &c->tally;
    uint64_t voxels;
    if (!is_later(&j->checkpoint, c))
        return fail_false(j, "the order of its checkpoints");
    if (!done_voxels(p, c->done, &voxels))
        return fail_false(j, "its progress");
    if (!p->scanned &&
        (!trip_tally_check(t) || t->voxels > voxels || (p->slice_voxels && t->voxels != voxels)))
        return fail_false(j, "its count of values");
    if (c->kept > t->finite || c->kept > voxels)
        return fail_false(j, "its count of kept voxels");
    if (!can_have_halo(p, c, voxels))
        return fail_false(j, "its count of halo voxels");
    if (c->ordered_splats > c->kept || c->runs > c->ordered_splats)
        return fail_false(j, "its count of runs");
    return 0;
}

static bool has_ordered(const trip_journal *j, const trip_checkpoint *c)
{
    bool has = true;
    for (int i = 0; i < TRIP_PLANES_OF_VOXELS; i++)
        has = has && c->ordered_bytes[i] <= j->params.ordered_bytes[i];
    return has;
}

static bool has_runs(const trip_journal *j, uint64_t runs)
{
    struct stat st;
    return fstat(j->runs_file, &st) == 0 && runs <= (uint64_t)st.st_size / sizeof(trip_run_record);
}

/* Reads a checkpoint and its new sequences. Returns 1 if it is accepted, 0 if data that it needs
 * are missing. */
static int take_checkpoint(trip_journal *j, trip_spill *spill, const void *record, uint64_t bytes)
{
    trip_checkpoint *c = malloc(sizeof *c);
    if (!c)
        return fail_memory(j);
    const trip_sequence *sequences = (const void *)((const char *)record + sizeof *c);
    uint64_t fresh = bytes < sizeof *c ? 0 : (bytes - sizeof *c) / sizeof *sequences;
    if (bytes >= sizeof *c)
        memcpy(c, record, sizeof *c);
    int taken = 0;
    if (bytes != sizeof *c + fresh * sizeof *sequences || c->sequences != j->recorded + fresh)
        taken = fail_false(j, "a record");
    else
        taken = check_checkpoint(j, c);
    if (taken == 0 && has_ordered(j, c) && has_runs(j, c->runs))
        taken = trip_spill_restore(spill, sequences, fresh);
    if (taken == 1) {
        j->checkpoint = *c;
        j->has_checkpoint = true;
        j->recorded = c->sequences;
    }
    free(c);
    return taken;
}

/* Reads the output record, which is the last one. Returns 0, so that the journal is truncated
 * before it: a resumed run has another output. */
static int take_output(trip_journal *j, const void *record, uint64_t bytes)
{
    if (bytes != sizeof j->output)
        return fail_false(j, "a record");
    memcpy(&j->output, record, sizeof j->output);
    j->has_output = true;
    return 0;
}

static int take_record(trip_journal *j, trip_spill *spill, const record_head *head,
                       const void *record)
{
    if (head->kind == RECORD_CHECKPOINT)
        return take_checkpoint(j, spill, record, head->bytes);
    return head->kind == RECORD_OUTPUT ? take_output(j, record, head->bytes)
                                       : fail_false(j, "a record");
}

/* Reads checkpoints until one is truncated or needs missing data. */
static int read_checkpoints(trip_journal *j, trip_spill *spill, void *record)
{
    record_head head;
    int taken = 1;
    while (taken == 1 && read_record(j, j->offset, &head, record)) {
        taken = take_record(j, spill, &head, record);
        if (taken == 1)
            j->offset += sizeof head + head.bytes;
    }
    j->runs = j->checkpoint.runs;
    j->ordered_splats = j->checkpoint.ordered_splats;
    return taken < 0 ? taken : 0;
}

static int read_records(trip_journal *j, trip_spill *spill, void *record)
{
    record_head head;
    if (!read_record(j, 0, &head, record))
        return 0;
    if (head.kind != RECORD_START || head.bytes != sizeof j->start)
        return fail_false(j, "its first record");
    memcpy(&j->start, record, sizeof j->start);
    int status = check_start(j, &j->start);
    if (status < 0)
        return status;
    j->has_start = true;
    j->offset = sizeof head + head.bytes;
    return read_checkpoints(j, spill, record);
}

static int read_journal(trip_journal *j, trip_spill *spill)
{
    void *record = take_room(j);
    int status = record ? read_records(j, spill, record) : TRIP_ERROR;
    if (record)
        trip_budget_release(j->budget, record, RECORD_MAX_BYTES);
    return status;
}

static int open_file(const trip_journal *j, const trip_spill *spill, const char *name, int *fd)
{
    int status = trip_folder_open_file(fd, trip_spill_folder(spill), trip_spill_path(spill), name,
                                       O_RDWR | O_CREAT, "brick");
    if (status == 0 && !j->params.resume && ftruncate(*fd, 0) < 0)
        status = trip_fail_errno("brick", j->path, "cannot truncate");
    return status;
}

static int open_files(trip_journal *j, const trip_spill *spill)
{
    if (asprintf(&j->path, "%s/journal", trip_spill_path(spill)) < 0) {
        j->path = NULL;
        return trip_fail(TRIP_ERROR, "brick", trip_spill_path(spill), "out of memory");
    }
    int status = open_file(j, spill, "journal", &j->file);
    return status == 0 ? open_file(j, spill, "runs", &j->runs_file) : status;
}

int trip_journal_open(trip_journal **out, trip_spill *spill, const trip_journal_params *params,
                      trip_budget *budget)
{
    trip_journal *j = *out = calloc(1, sizeof *j);
    if (!j)
        return trip_fail(TRIP_ERROR, "brick", trip_spill_path(spill), "out of memory");
    j->params = *params;
    j->budget = budget;
    j->file = j->runs_file = -1;
    int status = open_files(j, spill);
    if (status == 0 && params->resume)
        status = read_journal(j, spill);
    if (status == 0 && ftruncate(j->file, (off_t)j->offset) < 0)
        status = trip_fail_errno("brick", j->path, "cannot truncate");
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

const trip_journal_output *trip_journal_get_output(const trip_journal *j)
{
    return j->has_output ? &j->output : NULL;
}

int trip_journal_read_runs(const trip_journal *j, uint64_t index, trip_run_record *runs,
                           size_t count)
{
    if (read_at(j->runs_file, index * sizeof *runs, runs, count * sizeof *runs))
        return 0;
    return trip_fail(TRIP_ERROR, "brick", j->path,
                     "its list of runs is truncated; run again without --resume");
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
    size_t fresh = trip_spill_count(spill) - j->recorded;
    size_t bytes = sizeof *c + fresh * sizeof(trip_sequence);
    unsigned char *record = malloc(bytes);
    if (!record)
        return fail_memory(j);
    c->sequences = trip_spill_count(spill);
    c->runs = j->runs;
    c->ordered_splats = j->ordered_splats;
    memcpy(record, c, sizeof *c);
    if (fresh)
        memcpy(record + sizeof *c, trip_spill_sequence(spill, j->recorded),
               fresh * sizeof(trip_sequence));
    j->recorded += fresh;
    int status = flush_runs(j);
    if (status == 0)
        status = append_record(j, RECORD_CHECKPOINT, record, bytes);
    free(record);
    return status;
}

int trip_journal_write_output(trip_journal *j, const trip_journal_output *output)
{
    return append_record(j, RECORD_OUTPUT, output, sizeof *output);
}
