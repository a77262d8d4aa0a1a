/* Fuzzes the journal of an interrupted run of `brick`. The journal comes from the input and gets
 * valid checksums. An accepted journal must have all numbers in bounds, so that the run can resume.
 *
 * Input: a byte for the kind of run that reads the journal, then records in the format of
 * journal_file.h. */
#include "fuzz.h"

#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "journal.h"
#include "journal_file.h"

enum {
    SLICE_VOXELS = 64 * 64,
    SLICES = 64,
    VOXELS = SLICE_VOXELS * SLICES,
    PIECES_BYTES = 1 << 20
};

static char folder[64];

static void make_folder(void)
{
    strcpy(folder, access("/dev/shm", W_OK) == 0 ? "/dev/shm/fuzz-XXXXXX" : "/tmp/fuzz-XXXXXX");
    FUZZ_PROMISE(mkdtemp(folder));
}

static FILE *create(const char *name)
{
    char path[128];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *f = fopen(path, "wb");
    FUZZ_PROMISE(f);
    return f;
}

static void write_files(const uint8_t *data, size_t size)
{
    FILE *journal = create("journal"), *runs = create("runs"), *pieces = create("pieces");
    write_journal(journal, data, size);
    fclose(journal);
    FUZZ_PROMISE(ftruncate(fileno(runs), 1000 * sizeof(trip_run_record)) == 0);
    fclose(runs);
    FUZZ_PROMISE(ftruncate(fileno(pieces), PIECES_BYTES) == 0);
    fclose(pieces);
}

/* Adds an accepted tally to another tally, and makes a histogram of it. */
static void use_tally(const trip_tally *t)
{
    static trip_tally sum;
    static trip_histogram histogram;
    const float values[4] = { -1e30f, 3e-40f, 1, 1e30f };
    trip_tally_histogram(t, &histogram);
    for (size_t count = 0; count <= 4; count++) {
        trip_tally_clear(&sum);
        trip_tally_range(&sum, values, NULL, count);
        trip_tally_count(&sum, values, NULL, count);
        trip_tally_add(&sum, t);
        FUZZ_PROMISE(sum.voxels == t->voxels + count);
        trip_tally_histogram(&sum, &histogram);
    }
}

static void check_sequences(const trip_spill *spill)
{
    uint64_t end = 0;
    for (size_t i = 0; i < trip_spill_count(spill); i++) {
        const trip_sequence *s = trip_spill_sequence(spill, i);
        FUZZ_PROMISE(s->list < TRIP_MAX_LISTS && s->offset >= end && s->bytes <= PIECES_BYTES);
        end = s->offset + s->bytes;
        FUZZ_PROMISE(end <= PIECES_BYTES);
    }
    FUZZ_PROMISE(trip_spill_bytes(spill) <= PIECES_BYTES);
}

static void check_journal(const trip_journal *j, const trip_journal_params *p,
                          const trip_spill *spill)
{
    const trip_journal_start *start = trip_journal_get_start(j);
    const trip_checkpoint *c = trip_journal_get_checkpoint(j);
    check_sequences(spill);
    if (start && p->scanned)
        use_tally(&start->tally);
    if (!c)
        return;
    FUZZ_PROMISE(start && c->kept <= VOXELS && c->halo <= 26 * c->kept);
    FUZZ_PROMISE(c->ordered_splats <= c->kept);
    for (int i = 0; i < TRIP_PLANES_OF_VOXELS; i++)
        FUZZ_PROMISE(c->ordered_bytes[i] <= p->ordered_bytes[i]);
    FUZZ_PROMISE(!p->slice_voxels || c->done <= SLICES);
    FUZZ_PROMISE(c->runs <= 1000 && c->sequences == trip_spill_count(spill));
    if (!p->scanned)
        use_tally(&c->tally);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    trip_budget *budget;
    trip_spill *spill;
    trip_journal *journal = NULL;
    if (size < 1)
        return 0;
    const trip_journal_params p = { .resume = true,
                                    .identity = 0,
                                    .scanned = data[0] & 1,
                                    .voxels = VOXELS,
                                    .slice_voxels = data[0] & 2 ? SLICE_VOXELS : 0,
                                    .halo = data[0] & 4,
                                    .ordered_bytes = { 5000, 4000 } };
    make_folder();
    write_files(data + 1, size - 1);
    FUZZ_PROMISE(trip_budget_create(&budget, 1 << 24) == 0);
    FUZZ_PROMISE(trip_spill_open(&spill, folder, true, budget) == 0);
    if (trip_journal_open(&journal, spill, &p, budget) == 0)
        check_journal(journal, &p, spill);
    trip_journal_close(journal);
    trip_spill_keep(spill, false);
    trip_spill_close(spill);
    trip_budget_destroy(budget);
    return 0;
}
