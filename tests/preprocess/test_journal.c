/* Tests of journals of interrupted runs. Each test kills a run of `brick`, rewrites its journal
 * with valid checksums, and resumes the run. */
#include "brick_files.h"

#include <math.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <xxhash.h>

#include "journal.h"

enum { NX = 128, NY = 96, NZ = 128, N = NX * NY * NZ };
enum { START = 1, CHECKPOINT = 2, OUTPUT = 3, MAX_RECORDS = 16 };

/* A record in the layout of journal.c. */
typedef struct record {
    uint64_t kind, bytes, checksum;
    unsigned char *body;
} record;

static record records[MAX_RECORDS];
static size_t record_count;

static uint8_t values[N];
static char input[128], output[128], journal_path[160];

static void make_volume(void)
{
    uint64_t random = 11;
    for (int i = 0; i < N; i++) {
        double x = i % NX - NX / 2, y = i / NX % NY - NY / 2, z = i / NX / NY - NZ / 2;
        values[i] =
            (uint8_t)(120 + 100 * cos(sqrt(x * x + y * y + z * z) / 4) + test_random(&random) % 20);
    }
    test_write("v.raw", values, sizeof values);
    strcpy(input, test_path("v.raw"));
    strcpy(output, test_path("a.trip"));
    snprintf(journal_path, sizeof journal_path, "%s.spill/journal", output);
}

static trip_brick_params params(void)
{
    return (trip_brick_params){ .input = input,
                                .output = output,
                                .volume = { .raw_dims = { NX, NY, NZ }, .raw_type = "uint8" },
                                .memory_bytes = 28 << 20,
                                .threads = 1,
                                .slices = 2,
                                .normals = TRIP_NORMALS_STORED,
                                .keep_all = true };
}

static void kill_at(void *user, const char *stage, uint64_t done, uint64_t total)
{
    const double *share = user;
    if (strcmp(stage, "read") == 0 && (double)done >= *share * (double)total)
        raise(SIGKILL);
}

/* Runs `brick` in a child and kills it once this share of the volume is read. */
static void leave_killed_at(double share, trip_brick_params p)
{
    pid_t child = fork();
    int how;
    assert_true(child >= 0);
    if (child == 0) {
        trip_brick_summary s;
        p.progress = kill_at;
        p.progress_user = &share;
        trip_brick(&p, &s);
        _exit(0);
    }
    assert_int_equal(waitpid(child, &how, 0), child);
    assert_true(WIFSIGNALED(how));
}

static void leave_killed_run(trip_brick_params p)
{
    leave_killed_at(0.9, p);
}

static void read_journal(void)
{
    FILE *f = fopen(journal_path, "rb");
    assert_non_null(f);
    record_count = 0;
    for (record *r = records; fread(r, 8, 3, f) == 3; r++, record_count++) {
        assert_true(record_count < MAX_RECORDS);
        r->body = malloc(r->bytes);
        if (fread(r->body, 1, r->bytes, f) == r->bytes)
            continue;
        free(r->body); /* the run was killed while it wrote this record */
        break;
    }
    fclose(f);
    assert_true(record_count >= 2);
    assert_int_equal(records[0].kind, START);
    assert_int_equal(records[0].bytes, sizeof(trip_journal_start));
}

static void write_journal(void)
{
    FILE *f = fopen(journal_path, "wb");
    assert_non_null(f);
    for (record *r = records; r < records + record_count; r++) {
        r->checksum = XXH64(r->body, r->bytes, r->kind);
        assert_int_equal(fwrite(r, 8, 3, f), 3);
        assert_int_equal(fwrite(r->body, 1, r->bytes, f), r->bytes);
    }
    assert_int_equal(fclose(f), 0);
}

static long journal_bytes;

/* Returns all bytes of the journal, for restore_journal(). */
static unsigned char *copy_journal(void)
{
    FILE *f = fopen(journal_path, "rb");
    assert_non_null(f);
    fseek(f, 0, SEEK_END);
    journal_bytes = ftell(f);
    rewind(f);
    unsigned char *copy = malloc((size_t)journal_bytes);
    assert_int_equal(fread(copy, 1, (size_t)journal_bytes, f), journal_bytes);
    fclose(f);
    return copy;
}

static void restore_journal(unsigned char *copy)
{
    FILE *f = fopen(journal_path, "wb");
    assert_non_null(f);
    assert_int_equal(fwrite(copy, 1, (size_t)journal_bytes, f), journal_bytes);
    fclose(f);
    free(copy);
}

static void free_records(void)
{
    for (size_t i = 0; i < record_count; i++)
        free(records[i].body);
    record_count = 0;
}

static trip_journal_start *start(void)
{
    return (void *)records[0].body;
}

static trip_checkpoint *checkpoint(void)
{
    return (void *)records[record_count - 1].body;
}

/* Returns the first sequence of the first checkpoint. */
static trip_sequence *sequences(void)
{
    return (void *)(records[1].body + sizeof(trip_checkpoint));
}

static void check_one_line(void)
{
    assert_ptr_equal(strchr(test_report, '\n'), test_report + strlen(test_report) - 1);
}

static void expect_refused(trip_brick_params p, const char *attack, const char *why)
{
    trip_brick_summary s;
    test_report[0] = 0;
    p.resume = true;
    if (trip_brick(&p, &s) >= 0)
        fail_msg("%s: not refused", attack);
    if (!strstr(test_report, why))
        fail_msg("%s: \"%s\" does not say \"%s\"", attack, test_report, why);
    check_one_line();
    assert_false(test_exists("a.trip"));
}

typedef struct attack {
    const char *name;
    void (*change)(void);
} attack;

/* Applies each change to the sound journal and expects a refusal. A refusal leaves the killed run's
 * files, so they serve for all changes. */
static void check_attacks(const attack *attacks, size_t count, const char *why, bool automatic)
{
    trip_brick_params p = params();
    make_volume();
    p.keep_all = !automatic;
    leave_killed_run(p);
    for (size_t i = 0; i < count; i++) {
        read_journal();
        unsigned char *sound = copy_journal();
        attacks[i].change();
        write_journal();
        free_records();
        expect_refused(p, attacks[i].name, why);
        restore_journal(sound);
    }
}

#define CHECK_ATTACKS(attacks, why, automatic)                                                     \
    check_attacks((attacks), sizeof(attacks) / sizeof *(attacks), (why), (automatic))

/* Defines a change of the start record, of the last checkpoint or of the first sequence. */
#define ATTACK(name, change)                                                                       \
    static void name(void)                                                                         \
    {                                                                                              \
        change;                                                                                    \
    }

ATTACK(exponent_far_below, checkpoint()->tally.exponent = -100000)
ATTACK(exponent_far_above, checkpoint()->tally.exponent = 100000)
ATTACK(exponent_wider_than_the_range, checkpoint()->tally.exponent += 1)
ATTACK(exponent_min, checkpoint()->tally.exponent = INT32_MIN)
ATTACK(first_bin_elsewhere, checkpoint()->tally.first += 100)
ATTACK(first_bin_min, checkpoint()->tally.first = INT64_MIN)
ATTACK(bin_behind_the_range, checkpoint()->tally.counts[TRIP_TALLY_BINS - 1] = 1)
ATTACK(bins_overflowing, checkpoint()->tally.counts[0] = UINT64_MAX)
ATTACK(value_not_a_number, checkpoint()->tally.value_min = NAN)
ATTACK(value_beyond_floats, checkpoint()->tally.value_max = 1e300)
ATTACK(value_between_floats, checkpoint()->tally.value_min = 1e-310)
ATTACK(range_upside_down, checkpoint()->tally.value_max = checkpoint()->tally.value_min - 1)
ATTACK(none_finite_but_counted, checkpoint()->tally.finite = 0)
ATTACK(a_voxel_more, checkpoint()->tally.voxels++)
ATTACK(a_voxel_less, checkpoint()->tally.voxels--)
ATTACK(max_voxels, checkpoint()->tally.voxels = UINT64_MAX)
ATTACK(more_finite_than_voxels, checkpoint()->tally.finite++)
ATTACK(scanned_voxel_more, start()->tally.voxels++)
ATTACK(scanned_exponent, start()->tally.exponent = 1 << 20)
ATTACK(not_scanned, start()->scanned = 0)
ATTACK(scanned, start()->scanned = 1)
ATTACK(another_identity, start()->identity++)
ATTACK(done_beyond_the_end, checkpoint()->done = NZ + 1)
ATTACK(max_done, checkpoint()->done = UINT64_MAX)
ATTACK(done_before, checkpoint()->done = 0)
ATTACK(more_kept_than_there_are, checkpoint()->kept = N + 1)
/* One more than the voxels of the slices read so far, but fewer than all voxels. */
ATTACK(more_kept_than_read, checkpoint()->kept = checkpoint()->done * NX * NY + 1)
ATTACK(halo_without_room, checkpoint()->halo = 1)
ATTACK(max_halo, checkpoint()->halo = UINT64_MAX)
ATTACK(more_in_order_than_there_are, checkpoint()->ordered_splats = N + 1)
ATTACK(max_runs, checkpoint()->runs = UINT64_MAX / 16)
ATTACK(max_sequences, checkpoint()->sequences = UINT64_MAX)
ATTACK(sequences_that_wrap, checkpoint()->sequences += UINT64_C(1) << 59)
ATTACK(fewer_sequences, checkpoint()->sequences--)
ATTACK(sequence_of_no_list, sequences()->list = 6)
ATTACK(sequence_elsewhere, sequences()->offset = 4096)
ATTACK(sequence_that_wraps, sequences()->bytes = UINT64_MAX - 4095)
ATTACK(sequence_of_nothing, sequences()->bytes = 0)
ATTACK(sequence_of_odd_length, sequences()->bytes += 1)
ATTACK(sequence_retired, sequences()->retired = 1)
ATTACK(record_of_another_kind, records[record_count - 1].kind = 77)
ATTACK(start_twice, records[record_count - 1].kind = START)
ATTACK(start_cut_short, records[0].bytes -= 8)
ATTACK(checkpoint_cut_short, records[record_count - 1].bytes = 16)
ATTACK(a_kept_voxel_less, checkpoint()->kept--)
ATTACK(a_voxel_less_around, checkpoint()->halo--)

static void invalid_numbers_are_refused(void **state)
{
    (void)state;
    static const attack attacks[] = {
        { "exponent far below", exponent_far_below },
        { "exponent far above", exponent_far_above },
        { "exponent wider than the range", exponent_wider_than_the_range },
        { "exponent least", exponent_min },
        { "first bin elsewhere", first_bin_elsewhere },
        { "first bin least", first_bin_min },
        { "bin behind the range", bin_behind_the_range },
        { "bins overflowing", bins_overflowing },
        { "value not a number", value_not_a_number },
        { "value beyond floats", value_beyond_floats },
        { "value between floats", value_between_floats },
        { "range upside down", range_upside_down },
        { "none finite but counted", none_finite_but_counted },
        { "a voxel more", a_voxel_more },
        { "a voxel less", a_voxel_less },
        { "most voxels", max_voxels },
        { "more finite than voxels", more_finite_than_voxels },
        { "scanned", scanned },
        { "done beyond the end", done_beyond_the_end },
        { "most done", max_done },
        { "done before", done_before },
        { "more kept than there are", more_kept_than_there_are },
        { "halo without room", halo_without_room },
        { "most halo", max_halo },
        { "more in order than there are", more_in_order_than_there_are },
        { "most runs", max_runs },
        { "most sequences", max_sequences },
        { "sequences that wrap", sequences_that_wrap },
        { "fewer sequences", fewer_sequences },
        { "record of another kind", record_of_another_kind },
        { "start twice", start_twice },
        { "start cut short", start_cut_short },
        { "checkpoint cut short", checkpoint_cut_short },
    };
    CHECK_ATTACKS(attacks, "is invalid; run again", false);
}

static void invalid_sequences_are_refused(void **state)
{
    (void)state;
    static const attack attacks[] = {
        { "sequence of no list", sequence_of_no_list },
        { "sequence elsewhere", sequence_elsewhere },
        { "sequence that wraps", sequence_that_wraps },
        { "sequence of nothing", sequence_of_nothing },
        { "sequence of odd length", sequence_of_odd_length },
        { "sequence retired", sequence_retired },
    };
    CHECK_ATTACKS(attacks, "temporary data that no run writes", false);
}

static void a_false_tally_of_all_values_is_refused(void **state)
{
    (void)state;
    static const attack attacks[] = {
        { "scanned voxel more", scanned_voxel_more },
        { "scanned exponent", scanned_exponent },
        { "not scanned", not_scanned },
        { "done beyond the end", done_beyond_the_end },
        { "more kept than was read", more_kept_than_read },
    };
    CHECK_ATTACKS(attacks, "is invalid; run again", true);
}

static void another_identity_is_refused(void **state)
{
    (void)state;
    static const attack attacks[] = {
        { "another identity", another_identity },
    };
    CHECK_ATTACKS(attacks, "another input or other options", false);
}

static void false_lengths_of_ordered_files_are_found_on_reading(void **state)
{
    (void)state;
    trip_brick_params p = params();
    make_volume();
    leave_killed_run(p);
    read_journal();
    /* Changes all checkpoints, because the data of the last may be incomplete. */
    for (size_t i = 1; i < record_count; i++)
        ((trip_checkpoint *)(void *)records[i].body)->ordered_bytes[TRIP_PLANE_VOXELS] -= 8;
    write_journal();
    free_records();
    expect_refused(p, "fewer bytes in order", "the data of the interrupted run are damaged");
}

static void a_false_count_of_kept_voxels_is_found_at_the_end(void **state)
{
    (void)state;
    trip_brick_params p = params();
    make_volume();
    p.slices = 20; /* the Z list is spilled, too, so its length does not reveal the wrong count */
    leave_killed_run(p);
    read_journal();
    a_kept_voxel_less();
    write_journal();
    free_records();
    expect_refused(p, "a kept voxel less", "the data of the interrupted run are damaged");
    assert_false(test_exists("a.trip.partial"));
}

static void a_false_count_of_halo_voxels_is_found_at_the_end(void **state)
{
    (void)state;
    trip_brick_params p = params();
    make_volume();
    p.keep_all = false;
    p.slices = 20;
    leave_killed_run(p);
    read_journal();
    assert_true(checkpoint()->halo > 0);
    a_voxel_less_around();
    write_journal();
    free_records();
    expect_refused(p, "a voxel less around", "halo voxels were counted");
}

/* Overwrites bytes of a file of the killed run. */
static void overwrite(const char *name, long offset, const void *data, size_t bytes)
{
    char path[192];
    snprintf(path, sizeof path, "%s.%s", output, name);
    FILE *f = fopen(path, "r+b");
    assert_non_null(f);
    assert_int_equal(fseek(f, offset, SEEK_SET), 0);
    assert_int_equal(fwrite(data, bytes, 1, f), 1);
    fclose(f);
}

/* All voxels are kept, so the first run is a whole tile. Its block has one word of squares, 64
 * masks, then codes. */
static void false_records_of_the_ordered_list_are_refused(void **state)
{
    (void)state;
    static const struct {
        const char *name, *file;
        long offset;
        size_t bytes;
    } attacks[] = {
        { "no squares", "partial/z0.voxels", 0, 8 },
        { "an empty mask", "partial/z0.voxels", 8, 8 },
        { "other codes", "partial/z0.voxels", 8 * 65, 8 },
        { "other normals", "partial/z0.normals", 0, 4096 },
        { "run of nothing", "spill/runs", offsetof(trip_run_record, splats), 4 },
        { "run with another checksum", "spill/runs", offsetof(trip_run_record, checksum), 4 },
    };
    static const unsigned char zeros[4096];
    make_volume();
    for (size_t i = 0; i < sizeof attacks / sizeof *attacks; i++) {
        trip_brick_params p = params();
        leave_killed_run(p);
        overwrite(attacks[i].file, attacks[i].offset, zeros, attacks[i].bytes);
        expect_refused(p, attacks[i].name, "the data of the interrupted run are damaged");
    }
}

/* With 16-bit codes a form follows the masks. The test sets its width to 65535 bits for each code.
 */
static void a_block_beyond_the_maximum_length_is_refused(void **state)
{
    (void)state;
    static const unsigned char width[2] = { 255, 255 };
    trip_brick_params p = params();
    p.code_bits = TRIP_CODE_BITS_16;
    make_volume();
    leave_killed_run(p);
    overwrite("partial/z0.voxels", 8 * 65 + 2, width, sizeof width);
    expect_refused(p, "a block without end", "the data of the interrupted run are damaged");
}

static void links_and_pipes_are_not_followed(void **state)
{
    (void)state;
    static const char *const names[] = { "journal", "runs", "pieces", "z0.voxels" };
    static const char victim_text[] = "not to be touched";
    make_volume();
    for (size_t i = 0; i < 2 * sizeof names / sizeof *names; i++) {
        char path[192], text[sizeof victim_text] = "";
        trip_brick_params p = params();
        trip_brick_summary s;
        bool fifo = i % 2;
        p.replace = true;
        leave_killed_run(p);
        test_write("victim", victim_text, sizeof victim_text);
        snprintf(path, sizeof path, "%s.partial/z0.voxels", output);
        unlink(path);
        snprintf(path, sizeof path, "%s.spill/%s", output, names[i / 2]);
        unlink(path);
        assert_int_equal(fifo ? mkfifo(path, 0600) : symlink(test_path("victim"), path), 0);
        p.resume = true;
        test_report[0] = 0;
        assert_true(trip_brick(&p, &s) < 0);
        assert_non_null(strstr(test_report, fifo ? "is not a file of this program" : "is a link"));
        check_one_line();
        FILE *f = fopen(test_path("victim"), "rb");
        assert_int_equal(fread(text, 1, sizeof text, f), sizeof text);
        fclose(f);
        assert_string_equal(text, victim_text);
    }
}

static void check_foreign(const char *suffix)
{
    char path[160];
    trip_brick_params p = params();
    trip_brick_summary s;
    snprintf(path, sizeof path, "%s.%s", output, suffix);
    leave_killed_run(p);
    assert_int_equal(chown(path, 12345, 12345), 0);
    for (int resume = 0; resume < 2; resume++) {
        p.resume = resume;
        test_report[0] = 0;
        assert_true(trip_brick(&p, &s) < 0);
        assert_non_null(strstr(test_report, "belongs to another user"));
        check_one_line();
        assert_true(test_exists("a.trip.spill") || strcmp(suffix, "spill") != 0);
    }
    assert_int_equal(chown(path, geteuid(), getegid()), 0);
    p.resume = false;
    assert_int_equal(trip_brick(&p, &s), 0);
}

static void folders_of_another_user_are_refused(void **state)
{
    (void)state;
    if (geteuid() != 0)
        skip(); /* only root can change the owner of a folder */
    make_volume();
    check_foreign("spill");
}

static void partial_folders_of_another_user_are_refused(void **state)
{
    (void)state;
    if (geteuid() != 0)
        skip(); /* only root can change the owner of a folder */
    make_volume();
    check_foreign("partial");
}

/* A power failure may lose data. The run then resumes from an earlier checkpoint with complete
 * data. */
static void lost_data_are_made_again(void **state)
{
    (void)state;
    static const char *const names[] = { "spill/pieces", "spill/runs", "partial/z0.voxels" };
    trip_brick_params p = params();
    trip_brick_summary s;
    make_volume();
    assert_int_equal(trip_brick(&p, &s), 0);
    assert_int_equal(rename(output, test_path("wanted.trip")), 0);
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        char path[192];
        struct stat st;
        leave_killed_run(p);
        snprintf(path, sizeof path, "%s.%s", output, names[i]);
        assert_int_equal(stat(path, &st), 0);
        assert_int_equal(truncate(path, st.st_size / 2), 0);
        p.resume = true;
        assert_int_equal(trip_brick(&p, &s), 0);
        test_same_dataset("a.trip", "wanted.trip");
        assert_int_equal(rename(output, test_path(i ? i > 1 ? "3" : "2" : "1")), 0);
        p.resume = false;
    }
}

static void an_unchanged_journal_is_resumed(void **state)
{
    (void)state;
    trip_brick_params p = params();
    trip_brick_summary s;
    make_volume();
    for (int automatic = 0; automatic < 2; automatic++) {
        p.keep_all = !automatic;
        leave_killed_run(p);
        read_journal();
        write_journal();
        free_records();
        p.resume = true;
        assert_int_equal(trip_brick(&p, &s), 0);
        assert_true(s.resumed);
        assert_int_equal(rename(output, test_path(automatic ? "2" : "1")), 0);
        p.resume = false;
    }
}

/* The checksum of the record is valid. The journal ends before the record, as it does before a
 * truncated record. */
static void a_record_beyond_the_maximum_length_is_ignored(void **state)
{
    (void)state;
    trip_brick_params p = params();
    trip_brick_summary s;
    make_volume();
    leave_killed_run(p);
    read_journal();
    assert_true(record_count < MAX_RECORDS);
    records[record_count++] =
        (record){ .kind = CHECKPOINT, .bytes = (4 << 20) + 8, .body = calloc(1, (4 << 20) + 8) };
    write_journal();
    free_records();
    p.resume = true;
    assert_int_equal(trip_brick(&p, &s), 0);
    assert_true(s.resumed);
}

/* Kills runs until the last checkpoint in the journal belongs to the killed run. Checkpoints lag
 * behind the run. A checkpoint of this run has fewer splats in order than kept voxels. */
static void leave_killed_out_of_order(double share, trip_brick_params p)
{
    bool in_order = true;
    for (int tries = 0; tries < 100 && in_order; tries++) {
        leave_killed_at(share, p);
        read_journal();
        in_order = checkpoint()->ordered_splats == checkpoint()->kept;
        free_records();
    }
    assert_false(in_order);
}

/* With blocks of 2 slices the run writes the Z list directly. With blocks of 16 slices it lacks the
 * memory for this and spills the list. */
static void a_run_resumes_with_less_or_more_memory(void **state)
{
    (void)state;
    trip_brick_params p = params();
    trip_brick_summary s;
    make_volume();
    assert_int_equal(trip_brick(&p, &s), 0);
    assert_int_equal(rename(output, test_path("wanted.trip")), 0);
    p.resume = true;
    leave_killed_at(0.6, p);
    read_journal();
    assert_true(checkpoint()->runs > 0 && checkpoint()->ordered_splats == checkpoint()->kept);
    free_records();
    p.slices = 16;
    leave_killed_out_of_order(0.9, p);
    p.slices = 3;
    p.threads = 2;
    p.memory_bytes = 64 << 20;
    leave_killed_at(0.95, p);
    read_journal();
    assert_true(checkpoint()->runs > 0 && checkpoint()->ordered_splats < checkpoint()->kept);
    free_records();
    p.memory_bytes = 40 << 20;
    assert_int_equal(trip_brick(&p, &s), 0);
    assert_true(s.resumed);
    test_same_dataset("a.trip", "wanted.trip");
    assert_false(test_exists("a.trip.spill"));
}

static void a_refusal_to_resume_keeps_the_interrupted_run(void **state)
{
    (void)state;
    trip_brick_params p = params();
    trip_brick_summary s;
    make_volume();
    leave_killed_run(p);
    p.tile_voxels = 32;
    expect_refused(p, "other options", "another input or other options");
    p.tile_voxels = 0;
    p.memory_bytes = 4 << 20;
    expect_refused(p, "less memory than any run takes", "need --memory ");
    p.memory_bytes = 28 << 20;
    p.resume = true;
    assert_int_equal(trip_brick(&p, &s), 0);
    assert_true(s.resumed);
    assert_false(test_exists("a.trip.spill"));
}

/* Adds the record that a run writes before it renames its complete output. */
static void add_output(uint64_t device, uint64_t inode)
{
    trip_journal_output *noted = malloc(sizeof *noted);
    read_journal();
    assert_true(record_count < MAX_RECORDS);
    *noted = (trip_journal_output){ device, inode };
    records[record_count++] = (record){ OUTPUT, sizeof *noted, 0, (void *)noted };
    write_journal();
    free_records();
}

static void expect_another_output(trip_brick_params p)
{
    trip_brick_summary s;
    test_report[0] = 0;
    assert_int_equal(trip_brick(&p, &s), TRIP_ERROR);
    assert_non_null(strstr(test_report, "exists already"));
    check_one_line();
    assert_true(test_exists("a.trip.spill"));
}

static void only_the_completed_output_of_the_run_counts_as_done(void **state)
{
    (void)state;
    trip_brick_params p = params(), other = p;
    trip_brick_summary s;
    struct stat st;
    make_volume();
    p.resume = p.replace = true;
    other.tile_voxels = 32;
    assert_int_equal(trip_brick(&other, &s), 0);
    assert_int_equal(stat(output, &st), 0);
    leave_killed_run(p);
    p.replace = false;
    expect_another_output(p);
    add_output(st.st_dev, st.st_ino + 1);
    expect_another_output(p);
    add_output(st.st_dev, st.st_ino);
    assert_int_equal(trip_brick(&p, &s), 0);
    assert_true(s.resumed);
    assert_false(test_exists("a.trip.spill"));
}

static void a_replacing_run_resumes_beside_another_output(void **state)
{
    (void)state;
    trip_brick_params p = params(), other = p;
    trip_brick_summary s;
    make_volume();
    assert_int_equal(trip_brick(&p, &s), 0);
    assert_int_equal(rename(output, test_path("wanted.trip")), 0);
    other.tile_voxels = 32;
    assert_int_equal(trip_brick(&other, &s), 0);
    p.resume = p.replace = true;
    leave_killed_run(p);
    assert_int_equal(trip_brick(&p, &s), 0);
    assert_true(s.resumed);
    test_same_dataset("a.trip", "wanted.trip");
}

#define TEST(f) cmocka_unit_test_setup_teardown(f, test_begin, test_end)

int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(an_unchanged_journal_is_resumed),
        TEST(invalid_numbers_are_refused),
        TEST(invalid_sequences_are_refused),
        TEST(a_false_tally_of_all_values_is_refused),
        TEST(another_identity_is_refused),
        TEST(false_lengths_of_ordered_files_are_found_on_reading),
        TEST(a_false_count_of_kept_voxels_is_found_at_the_end),
        TEST(a_false_count_of_halo_voxels_is_found_at_the_end),
        TEST(false_records_of_the_ordered_list_are_refused),
        TEST(a_block_beyond_the_maximum_length_is_refused),
        TEST(a_record_beyond_the_maximum_length_is_ignored),
        TEST(links_and_pipes_are_not_followed),
        TEST(folders_of_another_user_are_refused),
        TEST(partial_folders_of_another_user_are_refused),
        TEST(lost_data_are_made_again),
        TEST(a_run_resumes_with_less_or_more_memory),
        TEST(a_refusal_to_resume_keeps_the_interrupted_run),
        TEST(only_the_completed_output_of_the_run_counts_as_done),
        TEST(a_replacing_run_resumes_beside_another_output),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
