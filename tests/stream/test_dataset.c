/* Tests of data sets that are damaged, truncated, mixed up or missing. Reading returns the same
 * voxels or fails with an error that names the file. */
#include "fixture.h"

#include <fcntl.h>
#include <pthread.h>
#include <stdio.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>
#include <xxhash.h>

static const char *const file_names[] = { "index.trip", "x0.voxels",  "y0.voxels", "z0.voxels",
                                          "x0.normals", "y0.normals", "z0.normals" };
enum { FILES = 7 };

static fixture shared;

static int setup(void **state)
{
    (void)state;
    fixture_make(&shared, &(fixture_params){ .dims = { 34, 20, 18 },
                                             .normals = true,
                                             .tile_voxels = 16,
                                             .page_bytes = 4096,
                                             .in_memory = true });
    return 0;
}

static int teardown(void **state)
{
    (void)state;
    fixture_free(&shared);
    return 0;
}

static char *file_path(int file)
{
    static char path[128];
    snprintf(path, sizeof path, "%s/%s", shared.path, file_names[file]);
    return path;
}

/* Sums all records of a list, so that any change of the picture shows. */
static int sum_list(const trip_dataset *d, trip_reader *r, int axis, uint64_t *sum)
{
    static uint32_t voxels[TRIP_RUN_RECORDS_MAX], normals[TRIP_RUN_RECORDS_MAX];
    trip_selection s;
    trip_batch b;
    assert_int_equal(
        trip_selection_create(&s, d, &d->lists[axis], false, 0, INT32_MAX, shared.budget), 0);
    for (uint64_t i = 0; i < d->lists[axis].brick_count; i++)
        trip_selection_add(&s, i);
    int status = trip_reader_begin(r, &(trip_pass){ &s, 1, false, NULL });
    while (status == 0 && (status = trip_reader_next(r, &b)) == 1) {
        for (size_t i = 0; i < b.run_count; i++) {
            fixture_decode_run(&b, &b.runs[i], voxels, normals);
            for (uint32_t k = 0; k < b.runs[i].count; k++)
                *sum = *sum * 31 + voxels[k] + ((uint64_t)normals[k] << 32) +
                       (uint64_t)b.runs[i].u + (uint64_t)b.runs[i].sheet * 77;
        }
        trip_reader_release(r, &b);
        status = 0;
    }
    trip_selection_destroy(&s, shared.budget);
    return status;
}

/* Sums the records of all lists. Returns 0 or the status of the first failure. */
static int read_everything(const char *path, uint64_t *sum)
{
    trip_dataset *d;
    trip_reader *r;
    *sum = 0;
    int status = trip_dataset_open(&d, path, shared.budget);
    if (status < 0)
        return status;
    assert_int_equal(trip_reader_create(&r, d,
                                        &(trip_reader_params){ .engine = TRIP_ENGINE_PREAD,
                                                               .planes = 3,
                                                               .slots = 2,
                                                               .slot_bytes = 65536,
                                                               .threads = 1 },
                                        shared.budget),
                     TRIP_OK);
    for (int axis = 0; axis < 3 && status == 0; axis++)
        status = sum_list(d, r, axis, sum);
    trip_reader_destroy(r);
    trip_dataset_close(d);
    return status;
}

/* Checks that reading fails with one line that names the file. */
static void expect_error_in(const char *name)
{
    uint64_t sum;
    fixture_catch_reports();
    int status = read_everything(shared.path, &sum);
    const char *reports = fixture_reports();
    if (status != TRIP_ERROR || !strstr(reports, name) || strchr(reports, '\n')[1])
        fail_msg("%s: status %d, \"%s\"", name, status, reports);
}

static void flip(int file, off_t at, unsigned char bits)
{
    unsigned char byte;
    int fd = open(file_path(file), O_RDWR);
    assert_int_equal(pread(fd, &byte, 1, at), 1);
    byte ^= bits;
    assert_int_equal(pwrite(fd, &byte, 1, at), 1);
    close(fd);
}

static off_t file_bytes(int file)
{
    struct stat st;
    assert_int_equal(stat(file_path(file), &st), 0);
    return st.st_size;
}

static void a_flipped_byte_anywhere_is_an_error_that_names_the_file(void **state)
{
    uint64_t random = 7;
    (void)state;
    for (int i = 0; i < 3000; i++) {
        uint64_t r = fixture_random(&random);
        int file = i % 3 ? (int)(r % FILES) : 0;
        off_t at = (off_t)((r >> 8) % (uint64_t)file_bytes(file));
        unsigned char bits = (unsigned char)(r >> 56 | 1);
        flip(file, at, bits);
        expect_error_in(file_names[file]);
        flip(file, at, bits);
    }
    uint64_t sum;
    assert_int_equal(read_everything(shared.path, &sum), TRIP_OK);
}

static void a_file_of_any_other_length_is_an_error(void **state)
{
    (void)state;
    for (int file = 0; file < FILES; file++) {
        off_t whole = file_bytes(file);
        for (int i = 0; i < 16; i++) {
            off_t length = i == 15 ? whole + 1 : i == 14 ? whole - 1 : whole * i / 14;
            fixture_run_command("cp %s %s/kept && truncate -s %lld %s", file_path(file),
                                shared.folder, (long long)length, file_path(file));
            expect_error_in(file_names[file]);
            fixture_run_command("mv %s/kept %s", shared.folder, file_path(file));
        }
    }
}

static void a_missing_file_or_folder_is_an_error(void **state)
{
    uint64_t sum;
    (void)state;
    for (int file = 0; file < FILES; file++) {
        fixture_run_command("mv %s %s/kept", file_path(file), shared.folder);
        expect_error_in(file_names[file]);
        fixture_run_command("mkfifo %s", file_path(file));
        expect_error_in(file_names[file]);
        fixture_run_command("rm %s && mkdir %s", file_path(file), file_path(file));
        expect_error_in(file_names[file]);
        fixture_run_command("rmdir %s && mv %s/kept %s", file_path(file), shared.folder,
                            file_path(file));
    }
    fixture_catch_reports();
    assert_int_equal(read_everything("/tmp/no-such.trip", &sum), TRIP_ERROR);
    assert_int_equal(read_everything("/dev/null", &sum), TRIP_ERROR);
    assert_int_equal(read_everything("", &sum), TRIP_ERROR);
    assert_non_null(strstr(fixture_reports(), "no-such.trip"));
}

/* Other values at the same positions leave all sizes equal. Only the checksums differ. */
static void files_of_another_data_set_are_detected(void **state)
{
    char other[128];
    (void)state;
    for (size_t i = 0; i < shared.count; i++)
        for (int a = 0; a < 3; a++)
            shared.lists[a][i].code ^= 1;
    snprintf(other, sizeof other, "%s/other.trip", shared.folder);
    assert_int_equal(fixture_write(&shared, other), TRIP_OK);
    for (int file = 1; file < 4; file++) {
        fixture_run_command("cp %s %s/kept && cp %s/%s %s", file_path(file), shared.folder, other,
                            file_names[file], file_path(file));
        expect_error_in(file_names[file]);
        fixture_run_command("mv %s/kept %s", shared.folder, file_path(file));
    }
    for (int list = 1; list < 3; list++) {
        fixture_run_command("cp %s %s/kept && cp %s/%s %s", file_path(list), shared.folder,
                            shared.path, file_names[list + 1], file_path(list));
        expect_error_in(file_names[list]);
        fixture_run_command("mv %s/kept %s", shared.folder, file_path(list));
    }
}

/* A child process without root privileges opens a file without read permission. */
static void a_file_without_permission_is_an_error(void **state)
{
    (void)state;
    fixture_run_command("chmod 755 %s && chmod 0 %s", shared.folder, file_path(3));
    pid_t child = fork();
    if (child == 0) {
        uint64_t sum;
        if (geteuid() == 0 && setuid(65534) < 0)
            _exit(9);
        fixture_catch_reports();
        int status = read_everything(shared.path, &sum);
        const char *reports = fixture_reports();
        _exit(status == TRIP_ERROR && strstr(reports, "z0.voxels") &&
                      strstr(reports, "Permission denied")
                  ? 0
                  : 1);
    }
    int status;
    waitpid(child, &status, 0);
    fixture_run_command("chmod 644 %s", file_path(3));
    assert_int_equal(WEXITSTATUS(status), 0);
}

/* An index with arbitrary bytes and valid checksums. */
typedef struct crafted {
    unsigned char bytes[65536];
    size_t count;
    trip_file_header *header;
    trip_file_list *lists;
} crafted;

static void craft(crafted *c)
{
    FILE *f = fopen(file_path(0), "rb");
    assert_non_null(f);
    c->count = fread(c->bytes, 1, sizeof c->bytes, f);
    fclose(f);
    c->header = (void *)c->bytes;
    c->lists = (void *)(c->bytes + c->header->lists_offset);
}

static void seal(crafted *c)
{
    trip_file_header *h = c->header;
    size_t page = (size_t)1 << h->page_log2, table = h->checksums_offset;
    for (size_t at = TRIP_HEADER_BYTES, i = table; at < table && table < c->count && i < c->count;
         at += page, i += 8) {
        uint64_t sum = XXH64(c->bytes + at, table - at < page ? table - at : page, 0);
        memcpy(c->bytes + i, &sum, sizeof sum);
    }
    if (table < c->count)
        h->checksums_checksum = XXH64(c->bytes + table, c->count - table, 0);
    h->header_checksum = 0;
    h->header_checksum = XXH64(h, sizeof *h, 0);
}

static void expect_refused(crafted *c, const char *why)
{
    seal(c);
    fixture_run_command("cp %s %s/kept", file_path(0), shared.folder);
    FILE *f = fopen(file_path(0), "wb");
    assert_int_equal(fwrite(c->bytes, 1, c->count, f), c->count);
    fclose(f);
    uint64_t sum;
    fixture_catch_reports();
    int status = read_everything(shared.path, &sum);
    const char *reports = fixture_reports();
    if (status != TRIP_ERROR || !strstr(reports, why) || !strstr(reports, "index.trip: byte "))
        fail_msg("wanted \"%s\": status %d, \"%s\"", why, status, reports);
    fixture_run_command("mv %s/kept %s", shared.folder, file_path(0));
}

#define REFUSE(change, why)                                                                        \
    do {                                                                                           \
        craft(&c);                                                                                 \
        change;                                                                                    \
        expect_refused(&c, why);                                                                   \
    } while (0)

static void an_invalid_header_with_valid_checksum_is_refused(void **state)
{
    static crafted c;
    (void)state;
    REFUSE(c.header->magic[0] = 'X', "not the index of a data set");
    REFUSE(c.header->version = 1, "format version 1 is no longer supported");
    REFUSE(c.header->version = 2, "format version 2 is no longer supported");
    REFUSE(c.header->version = 3, "format version 3 is no longer supported");
    REFUSE(c.header->version = 4, "format version 4 is no longer supported");
    REFUSE(c.header->version = 5, "format version 5 is no longer supported");
    REFUSE(c.header->version = 8, "format version 8");
    REFUSE(c.header->header_bytes = 512, "header size");
    REFUSE(c.header->reserved[660] = 1, "reserved");
    REFUSE(c.header->reserved0 = 1, "reserved");
    REFUSE(c.header->reserved1 = 1, "reserved");
    REFUSE(c.header->coordinates_offset = 3, "the coordinates lie outside");
    REFUSE(c.header->coordinates_offset = UINT64_MAX - 7, "the coordinates lie outside");
    REFUSE(c.header->coordinates_offset = c.header->checksums_offset,
           "the coordinates lie outside");
    REFUSE(c.header->dims[1] = 0, "grid size");
    REFUSE(c.header->dims[2] = UINT64_C(1) << 31, "grid size");
    REFUSE(c.header->dims[2] = UINT64_C(1) << 32, "grid size");
    REFUSE(c.header->index_to_world[0] = NAN, "index-to-world");
    REFUSE(c.header->index_to_world[5] = 0, "index-to-world");
    REFUSE(c.header->code_lo = INFINITY, "range of codes");
    REFUSE(c.header->code_hi = -2, "range of codes");
    REFUSE(c.header->value_max = NAN, "range of values");
    REFUSE(c.header->value_min = c.header->value_max + 1, "range of values");
    REFUSE(c.header->voxels = UINT64_MAX, "more voxels");
    REFUSE(c.header->voxels = 1, "more kept voxels");
    REFUSE(c.header->halo = UINT64_MAX, "more kept voxels");
    REFUSE(c.header->halo = 34 * 20 * 18 - c.header->kept + 1, "than the grid has");
    REFUSE(c.header->halo = 1, "no list of it");
    REFUSE(c.header->gradient_step[1] = NAN, "gradient step");
    REFUSE(c.header->gradient_full = -1, "length of gradients");
    REFUSE(c.header->tile_log2 = 3, "tile size");
    REFUSE(c.header->tile_log2 = 8, "tile size");
    REFUSE(c.header->slab_sheets = 0, "sheets per slab");
    REFUSE(c.header->slab_sheets = 65, "sheets per slab");
    REFUSE(c.header->page_log2 = 11, "page size");
    REFUSE(c.header->page_log2 = 25, "page size");
    REFUSE(c.header->page_log2 = 40, "page size");
    REFUSE(c.header->planes = 15, "planes");
    REFUSE(c.header->version = 6; c.header->planes = 7, "planes");
    REFUSE(c.header->planes = 2, "planes");
    REFUSE(c.header->list_count = 2, "number of lists");
    REFUSE(c.header->list_count = 4097, "number of lists");
    REFUSE(c.header->list_count = 4096, "lists lie outside");
    REFUSE(c.header->code_bytes = 0, "1 or 2 bytes");
    REFUSE(c.header->code_bytes = 3, "1 or 2 bytes");
    REFUSE(c.header->normal_bytes = 2, "3 or 4 bytes");
    REFUSE(c.header->normal_bytes = 3, "do not match its records");
    REFUSE(c.header->planes = 1, "3 or 4 bytes");
    REFUSE(c.header->checksums_offset = UINT64_MAX - 7, "checksums are at the wrong offset");
    REFUSE(c.header->checksums_offset -= 8, "checksums are at the wrong offset");
    REFUSE(c.header->text_bytes = TRIP_TEXT_BYTES_MAX + 1, "text is too long");
    REFUSE(c.header->text_bytes = UINT64_MAX, "text is too long");
    REFUSE(c.header->text_offset = UINT64_MAX - 4, "text lies outside");
    REFUSE(c.header->lists_offset = UINT64_MAX - 7, "lists lie outside");
    REFUSE(c.header->lists_offset += 4, "lists lie outside");
}

static void invalid_tables_with_valid_checksums_are_refused(void **state)
{
    static crafted c;
    (void)state;
#define SLAB ((trip_file_slab *)(void *)(c.bytes + c.lists[1].slabs_offset))
#define BRICK ((trip_file_brick *)(void *)(c.bytes + c.lists[1].bricks_offset))
#define RUN ((trip_file_run *)(void *)(c.bytes + c.lists[1].runs_offset))
    REFUSE(c.lists[1].axis = 0, "same axis, level and kind");
    REFUSE(c.lists[1].axis = 3, "unknown axis or kind");
    REFUSE(c.lists[1].kind = 4, "unknown axis or kind");
    REFUSE(c.lists[1].kind = 1, "not have the planes of its kind");
    REFUSE(c.lists[1].planes = 1, "not have the planes of its kind");
    REFUSE(c.lists[0].level = 1, "list of voxels of level 0 is missing");
    REFUSE(c.lists[1].kind = TRIP_KIND_MEANS, "has a kind of coarse levels");
    REFUSE((c.lists[1].level = 1, c.lists[1].records = 34 * 20 * 18 + 1,
            c.lists[1].plane_bytes[1] = 4 * c.lists[1].records),
           "more records than its grid has voxels");
    REFUSE((c.lists[1].level = c.lists[2].level = 1, c.lists[2].records--,
            c.lists[2].plane_bytes[1] -= 4),
           "have different numbers");
    REFUSE((c.lists[1].level = c.lists[2].level = 1, c.lists[2].axis = 1,
            c.lists[2].kind = TRIP_KIND_MEANS, c.lists[2].sheet_first = 2),
           "lists of a level have different grids");
    REFUSE(c.lists[2].records++, "is not the number of kept voxels");
    REFUSE(c.lists[2].dims[0]--, "a different grid than the header");
    REFUSE(c.lists[2].dims[1] = 0, "grid size");
    REFUSE(c.lists[2].index_to_world[3] = 7, "a different grid than the header");
    REFUSE(c.lists[2].index_to_world[0] = NAN, "singular or not finite");
    REFUSE(c.lists[2].sheet_first = 1, "a different grid than the header");
    REFUSE(c.lists[2].sheet_step = 0, "do not ascend");
    REFUSE(c.lists[2].sheet_step = NAN, "do not ascend");
    REFUSE(c.lists[2].sheet_step = 1e308, "do not ascend");
    REFUSE(c.lists[2].sheet_first = INFINITY, "do not ascend");
    REFUSE(c.lists[2].plane_bytes[0] += 4, "do not match its records");
    REFUSE(c.lists[2].plane_bytes[0] += 8, "do not add up");
    REFUSE(c.lists[2].plane_bytes[1]++, "do not match its records");
    REFUSE(c.lists[2].plane_bytes[3] = 4, "do not match its records");
    REFUSE(c.lists[2].reserved[4] = 1, "reserved");
    REFUSE(c.lists[1].brick_count = UINT64_MAX, "more bricks");
    REFUSE(c.lists[1].slab_count = UINT64_MAX / 8, "outside the file");
    REFUSE(c.lists[1].bricks_offset = 0, "outside the file");
    REFUSE(c.lists[1].runs_offset += 1, "outside the file");
    REFUSE(c.lists[1].page_checksums_offset[1] = 0, "outside the file");
    REFUSE(c.lists[1].page_checksums_offset[3] = 2048, "outside the file");
    REFUSE(c.lists[1].slabs_offset = c.lists[1].bricks_offset, "overlap");
    REFUSE(memset(c.bytes + c.header->text_offset, 0, 1), "zero byte");
    REFUSE(SLAB[1].slab = 0, "not ascending");
    REFUSE(SLAB[1].first_brick++, "bricks do not follow");
    REFUSE(SLAB[0].brick_count = 0, "bricks do not follow");
    REFUSE(SLAB[0].brick_count = UINT32_MAX, "bricks do not follow");
    REFUSE(SLAB[1].first_record++, "records do not follow");
    REFUSE(c.lists[1].slab_count--, "do not add up");
    REFUSE(SLAB[0].slab = 1000000, "not inside the grid");
    REFUSE(BRICK[0].reserved = 1, "reserved");
    REFUSE(BRICK[0].tile_u = UINT32_MAX, "not inside the grid");
    REFUSE(BRICK[0].u_max = 16, "not inside the grid");
    REFUSE(BRICK[0].u_min = 16, "not inside the grid");
    REFUSE(BRICK[1].u_max = 2, "bounds are not inside the grid"); /* z = 16 + 2 of 18 */
    REFUSE(BRICK[4].v_max = 2, "bounds are not inside the grid"); /* x = 32 + 2 of 34 */
    REFUSE(BRICK[0].u_min = 15, "runs do not agree"); /* a column holds at most 16 records */
    REFUSE(BRICK[0].v_min = 15, "runs do not agree");
    REFUSE(BRICK[0].sheet_max = 8, "sheets are not inside");
    REFUSE(BRICK[SLAB[2].first_brick].sheet_max = 4,
           "sheets are not inside"); /* y = 16 + 4 of 20 */
    REFUSE(BRICK[0].sheet_max--, "runs do not agree");
    REFUSE(BRICK[0].sheet_min++, "runs do not agree");
    REFUSE((BRICK[0].records -= RUN[0].records, RUN[0] = (trip_file_run){ 0 }),
           "runs do not agree");
    REFUSE((BRICK[0].records -= RUN[7].records, RUN[7] = (trip_file_run){ 0 }),
           "runs do not agree");
    REFUSE(BRICK[0].code_min = 65535, "value range");
    REFUSE(SLAB[1].first_block += 8, "records do not follow");
    REFUSE(BRICK[0].records++, "runs do not agree");
    REFUSE(RUN[0].records = 65535, "runs do not agree");
    REFUSE((RUN[0].records++, RUN[1].records--, BRICK[0].sheet_min = 1), "runs do not agree");
    REFUSE(RUN[0].words = 0, "runs do not agree");
    REFUSE(RUN[0].words = 65535, "runs do not agree");
    REFUSE((BRICK[1].tile_u = BRICK[0].tile_u, BRICK[1].tile_v = BRICK[0].tile_v), "Morton");
}

static void verify_finds_records_that_contradict_the_index(void **state)
{
    trip_dataset *d;
    (void)state;
    assert_int_equal(trip_dataset_open(&d, shared.path, shared.budget), TRIP_OK);
    assert_int_equal(trip_dataset_verify(d, shared.budget), TRIP_OK);
    /* Changes the index in memory instead of the file. This has the same effect and needs no new
     * checksums. */
    trip_file_brick *b = (trip_file_brick *)(uintptr_t)&d->lists[1].bricks[0];
    uint16_t code_max = b->code_max;
    b->code_max = (uint16_t)(code_max - 1);
    fixture_catch_reports();
    assert_int_equal(trip_dataset_verify(d, shared.budget), TRIP_ERROR);
    assert_non_null(strstr(fixture_reports(), "y0.voxels: byte "));
    b->code_max = code_max;
    b->u_min++;
    fixture_catch_reports();
    assert_int_equal(trip_dataset_verify(d, shared.budget), TRIP_ERROR);
    assert_non_null(strstr(fixture_reports(), "outside its brick"));
    b->u_min--;
    trip_dataset_close(d);
}

/* Returns the file offset of the last byte of the list's first block with padding. */
static off_t find_padding(const trip_dataset *d, trip_list *list)
{
    static uint64_t block[TRIP_BLOCK_WORDS_MAX];
    const trip_block_form form = trip_block_form_of(&d->header, list->kind);
    trip_selection s;
    trip_run run;
    off_t at = -1;
    assert_int_equal(trip_selection_create_whole(&s, d, list, false, shared.budget), TRIP_OK);
    for (trip_run_iterator it = trip_run_begin(&s); at < 0 && trip_run_next(&it, &run);) {
        const size_t bytes = 8 * (size_t)run.words;
        assert_int_equal(pread(list->plane_fd[0], block, bytes, (off_t)run.at[0]), bytes);
        ((unsigned char *)block)[bytes - 1] ^= 0x80;
        const trip_block b = trip_block_make(&form, run.count, run.words, block, NULL);
        if (!trip_block_check(&b, &list->bricks[run.brick]) && !trip_block_is_padded(&b))
            at = (off_t)(run.at[0] + bytes - 1);
    }
    trip_selection_destroy(&s, shared.budget);
    assert_true(at >= 0);
    return at;
}

/* The index in memory gets the valid checksum of the changed page. */
static void verify_finds_nonzero_padding(void **state)
{
    static unsigned char page[4096];
    trip_dataset *d;
    (void)state;
    assert_int_equal(trip_dataset_open(&d, shared.path, shared.budget), TRIP_OK);
    trip_list *list = &d->lists[0];
    const off_t at = find_padding(d, list), first = at / 4096 * 4096;
    uint64_t *sum = (uint64_t *)(uintptr_t)&list->page_checksums[0][at / 4096];
    flip(1, at, 0x80);
    *sum = XXH64(page, (size_t)pread(list->plane_fd[0], page, sizeof page, first), 0);
    fixture_catch_reports();
    assert_int_equal(trip_dataset_verify(d, shared.budget), TRIP_ERROR);
    assert_non_null(strstr(fixture_reports(), "the padding is not zero"));
    flip(1, at, 0x80);
    trip_dataset_close(d);
}

static void *replace_often(void *stop)
{
    while (!*(_Atomic bool *)stop)
        assert_int_equal(fixture_write(&shared, shared.path), TRIP_OK);
    return NULL;
}

/* An earlier test changed the values, so the test writes the data set first. */
static void a_data_set_opens_at_any_moment_of_its_replacement(void **state)
{
    pthread_t thread;
    _Atomic bool stop = false;
    uint64_t sum, first;
    (void)state;
    shared.params.replace = true;
    assert_int_equal(fixture_write(&shared, shared.path), TRIP_OK);
    assert_int_equal(read_everything(shared.path, &first), TRIP_OK);
    pthread_create(&thread, NULL, replace_often, &stop);
    for (int i = 0; i < 40; i++) {
        assert_int_equal(read_everything(shared.path, &sum), TRIP_OK);
        assert_int_equal(sum, first);
    }
    stop = true;
    pthread_join(thread, NULL);
    shared.params.replace = false;
}

/* The data set has tables of coordinates. Reading checks every number. */
static void coordinates_are_read_as_written_or_refused(void **state)
{
    (void)state;
    static double tables[34 + 20 + 18];
    const double *along[3] = { tables, tables + 34, tables + 54 };
    const int64_t dims[3] = { 34, 20, 18 };
    const fixture defaults = shared;
    trip_dataset *d;
    static crafted c;
    for (int a = 0, n = 0; a < 3; a++)
        for (int i = 0; i < dims[a]; i++, n++)
            tables[n] = (double)i * i / (double)(dims[a] - 1);
    const trip_coordinates coordinates = trip_coordinates_make(along, dims);
    fixture_make(&shared, &(fixture_params){ .dims = { 34, 20, 18 },
                                             .normals = true,
                                             .tile_voxels = 16,
                                             .page_bytes = 4096,
                                             .coordinates = &coordinates,
                                             .in_memory = true });
    assert_int_equal(trip_dataset_open(&d, shared.path, shared.budget), TRIP_OK);
    for (int a = 0; a < 3; a++)
        assert_memory_equal(d->coordinates.along[a], along[a], (size_t)dims[a] * sizeof(double));
    assert_true(d->coordinates.widest == coordinates.widest);
    trip_dataset_close(d);
#define PLACES ((double *)(void *)(c.bytes + c.header->coordinates_offset))
    REFUSE(PLACES[7] = NAN, "not finite");
    REFUSE(PLACES[7] = PLACES[6], "must ascend");
    REFUSE(PLACES[40] = -1, "must ascend");
    REFUSE(PLACES[0] = -1, "must run from 0");
    REFUSE(PLACES[33] = 34, "must run from 0");
    REFUSE(PLACES[71] = 17.5, "must run from 0");
    REFUSE(c.header->coordinates_offset = c.header->lists_offset, "");
    fixture_free(&shared);
    shared = defaults;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_flipped_byte_anywhere_is_an_error_that_names_the_file),
        cmocka_unit_test(a_file_of_any_other_length_is_an_error),
        cmocka_unit_test(a_missing_file_or_folder_is_an_error),
        cmocka_unit_test(a_file_without_permission_is_an_error),
        cmocka_unit_test(an_invalid_header_with_valid_checksum_is_refused),
        cmocka_unit_test(coordinates_are_read_as_written_or_refused),
        cmocka_unit_test(invalid_tables_with_valid_checksums_are_refused),
        cmocka_unit_test(verify_finds_records_that_contradict_the_index),
        cmocka_unit_test(verify_finds_nonzero_padding),
        cmocka_unit_test(files_of_another_data_set_are_detected),
        cmocka_unit_test(a_data_set_opens_at_any_moment_of_its_replacement),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}
