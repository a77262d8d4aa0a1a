/* Fuzzes the ordered list that an interrupted run of `brick` left. Blocks and normals come from the
 * input, and runs that decode get valid checksums. Accepted runs are appended completely, and
 * refused runs do no harm.
 *
 * Input: a byte for the form, 8 bytes for each run up to a run of 0 splats, then the bytes of the
 * planes. */
#include "fuzz.h"

#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "dataset.h"
#include "resume.h"

enum { VOXELS_A_SIDE = 4096, SCANNED = 1 << 24, MAX_RUNS = 64 };

typedef struct given_run {
    uint16_t sheet, u, v, splats;
} given_run;

/* The parsed input. */
typedef struct given {
    trip_block_form form;
    trip_piece_format format;
    given_run runs[MAX_RUNS];
    size_t run_count;
    const uint8_t *planes[TRIP_PLANES_OF_VOXELS];
    size_t bytes[TRIP_PLANES_OF_VOXELS];
} given;

static char folder[64], path[128];

static const char *in_folder(const char *name)
{
    snprintf(path, sizeof path, "%s/%s", folder, name);
    return path;
}

static void make_folder(void)
{
    strcpy(folder, access("/dev/shm", W_OK) == 0 ? "/dev/shm/fuzz-XXXXXX" : "/tmp/fuzz-XXXXXX");
    FUZZ_PROMISE(mkdtemp(folder));
    FUZZ_PROMISE(mkdir(in_folder("a.partial"), 0700) == 0);
}

/* Parses the input. The normals are the last third of the bytes behind the runs. */
static void take_apart(given *g, const uint8_t *data, size_t size)
{
    static const unsigned normal_bytes[] = { 0, 3, 4 };
    g->form = (trip_block_form){ .tile_log2 = 4 + data[0] % 4,
                                 .code_bytes = 1 + data[0] / 4 % 2,
                                 .normal_bytes = normal_bytes[data[0] / 8 % 3] };
    g->format = (trip_piece_format){ .tile_log2 = g->form.tile_log2,
                                     .quantised = true,
                                     .normals = g->form.normal_bytes > 0 };
    data++, size--;
    while (size >= sizeof *g->runs && g->run_count < MAX_RUNS) {
        given_run *run = &g->runs[g->run_count];
        memcpy(run, data, sizeof *run);
        data += sizeof *run;
        size -= sizeof *run;
        if (run->splats == 0)
            break;
        g->run_count++;
    }
    g->bytes[1] = g->format.normals ? size / 3 : 0;
    g->bytes[0] = size - g->bytes[1];
    g->planes[0] = data;
    g->planes[1] = data + g->bytes[0];
}

static void write_plane(const given *g, int plane)
{
    char name[32], full[64];
    trip_plane_file_name(trip_list_axis(TRIP_ORDERED_LIST), 0, TRIP_KIND_VOXELS, plane, name);
    snprintf(full, sizeof full, "a.partial/%s", name);
    FILE *f = fopen(in_folder(full), "wb");
    FUZZ_PROMISE(f && fwrite(g->planes[plane], 1, g->bytes[plane], f) == g->bytes[plane]);
    fclose(f);
}

/* Returns the checksum of the run at `at`, and advances `at`. Returns 0 if the run does not decode.
 */
static uint32_t checksum_of(const given *g, uint32_t splats, size_t at[TRIP_PLANES_OF_VOXELS])
{
    static uint64_t words[TRIP_BLOCK_WORDS_MAX];
    static uint32_t voxels[TRIP_RUN_RECORDS_MAX], normals[TRIP_RUN_RECORDS_MAX];
    const uint8_t edge = (uint8_t)((1u << g->form.tile_log2) - 1);
    const trip_file_brick tile = { .code_max = UINT16_MAX, .u_max = edge, .v_max = edge };
    const uint32_t max = trip_block_max_words(&g->form);
    uint32_t count = 0;
    for (uint32_t end; (end = trip_block_end(&g->form, words, count)) > count; count = end) {
        if (end > max || g->bytes[0] - at[0] < end * sizeof *words)
            return 0;
        memcpy(words, g->planes[0] + at[0], end * sizeof *words);
    }
    size_t normal_bytes = (size_t)splats * g->form.normal_bytes;
    if (!trip_block_words_fit(&g->form, splats, count) || g->bytes[1] - at[1] < normal_bytes)
        return 0;
    const trip_block b =
        trip_block_make(&g->form, splats, count, words,
                        normal_bytes ? g->planes[TRIP_PLANE_NORMALS] + at[1] : NULL);
    if (trip_block_check(&b, &tile))
        return 0;
    trip_block_voxels(&b, 0, splats, voxels);
    if (normal_bytes)
        trip_block_normals(&b, 0, splats, normals);
    at[0] += count * sizeof *words;
    at[1] += normal_bytes;
    return trip_run_checksum(voxels, normal_bytes ? normals : NULL, splats);
}

/* Writes the journal of a run that appended these runs before its interruption. */
static void write_journal(const given *g, trip_budget *budget)
{
    static trip_journal_start start;
    trip_spill *spill;
    trip_journal *j;
    trip_checkpoint *c = calloc(1, sizeof *c);
    size_t at[TRIP_PLANES_OF_VOXELS] = { 0 };
    FUZZ_PROMISE(c && trip_spill_open(&spill, in_folder("spill"), false, budget) == 0);
    FUZZ_PROMISE(trip_journal_open(&j, spill, &(trip_journal_params){ 0 }, budget) == 0);
    start.scanned = 1;
    start.tally = (trip_tally){ .voxels = SCANNED, .finite = SCANNED, .value_max = 1 };
    FUZZ_PROMISE(trip_journal_write_start(j, &start) == 0);
    for (size_t i = 0; i < g->run_count; i++) {
        const given_run *run = &g->runs[i];
        uint64_t key = (uint64_t)run->sheet << TRIP_TILE_MORTON_BITS | trip_morton(run->u, run->v);
        const trip_run_record r = { key, run->splats, checksum_of(g, run->splats, at) };
        FUZZ_PROMISE(trip_journal_add_run(j, &r) == 0);
        c->kept += run->splats;
    }
    c->ordered_bytes[0] = at[0];
    c->ordered_bytes[1] = at[1];
    FUZZ_PROMISE(trip_journal_write_checkpoint(j, c, spill) == 0);
    free(c);
    trip_journal_close(j);
    trip_spill_keep(spill, true);
    trip_spill_close(spill);
}

/* The data set and the lists of the resumed run. */
typedef struct building {
    trip_writer *writer;
    trip_list_builder *builder;
} building;

static building open_building(const given *g, trip_spill *spill, trip_journal *j,
                              trip_budget *budget)
{
    building b;
    const int64_t side = VOXELS_A_SIDE;
    trip_writer_params w = { .code_bytes = g->form.code_bytes,
                             .normal_bytes = g->form.normal_bytes,
                             .tile_voxels = 1u << g->form.tile_log2,
                             .dims = { side, side, side },
                             .index_to_world = trip_affine_identity(),
                             .codes = {
                                 .code_hi = 1, .gradient_step = { 1, 1, 1 }, .gradient_full = 1 } };
    FUZZ_PROMISE(trip_writer_open(&b.writer, in_folder("b"), &w, budget) == 0);
    trip_list_builder_params l = { .format = g->format,
                                   .quantiser = { 0, 1, 1, 1 },
                                   .dims = { side, side, side },
                                   .producers = 1,
                                   .in_order = true,
                                   .memory_bytes = trip_list_builder_min_bytes(&g->format, 1),
                                   .writer = b.writer,
                                   .spill = spill,
                                   .journal = j };
    FUZZ_PROMISE(trip_list_builder_create(&b.builder, &l, budget) == 0);
    return b;
}

static void replay(const given *g, const trip_leftover *l, trip_spill *spill, trip_journal *j,
                   trip_budget *budget)
{
    const trip_checkpoint *c = trip_journal_get_checkpoint(j);
    FUZZ_PROMISE(c && c->runs == g->run_count);
    building b = open_building(g, spill, j, budget);
    if (trip_leftover_replay(l, j, b.builder, &g->form, budget) == 0) {
        FUZZ_PROMISE(trip_writer_records(b.writer, TRIP_ORDERED_LIST) == c->ordered_splats);
        for (int i = 0; i < TRIP_PLANES_OF_VOXELS; i++)
            FUZZ_PROMISE(trip_writer_plane_bytes(b.writer, TRIP_ORDERED_LIST, i) ==
                         c->ordered_bytes[i]);
    }
    trip_list_builder_destroy(b.builder);
    trip_writer_abort(b.writer);
}

static void go_on(const given *g, trip_budget *budget)
{
    trip_spill *spill;
    trip_journal *j = NULL;
    trip_leftover l;
    FUZZ_PROMISE(trip_spill_open(&spill, in_folder("spill"), true, budget) == 0);
    FUZZ_PROMISE(trip_leftover_take(&l, spill, in_folder("a.partial"), &g->format) == 0);
    const trip_journal_params p = { .resume = true,
                                    .scanned = true,
                                    .voxels = SCANNED,
                                    .ordered_bytes = { l.bytes[0], l.bytes[1] } };
    if (trip_journal_open(&j, spill, &p, budget) == 0 && g->run_count > 0)
        replay(g, &l, spill, j, budget);
    trip_journal_close(j);
    trip_leftover_close(&l);
    trip_spill_keep(spill, false);
    trip_spill_close(spill);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    given g = { .run_count = 0 };
    trip_budget *budget;
    if (size < 1)
        return 0;
    take_apart(&g, data, size);
    FUZZ_PROMISE(trip_budget_create(&budget, UINT64_C(1) << 28) == 0);
    make_folder();
    write_plane(&g, 0);
    if (g.format.normals)
        write_plane(&g, 1);
    write_journal(&g, budget);
    go_on(&g, budget);
    rmdir(in_folder("a.partial"));
    rmdir(folder);
    trip_budget_destroy(budget);
    return 0;
}
