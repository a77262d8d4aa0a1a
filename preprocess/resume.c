#include "resume.h"

#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "dataset.h"
#include "folder.h"
#include "read_at.h"
#include "report.h"

enum { RUNS_AT_A_TIME = 256 };

static off_t size_in(int folder, const char *name)
{
    struct stat st;
    bool found = folder >= 0 && fstatat(folder, name, &st, AT_SYMLINK_NOFOLLOW) == 0 &&
                 S_ISREG(st.st_mode) && st.st_uid == geteuid();
    return found ? st.st_size : -1;
}

/* Opens the longer of the two files of a plane, under its name in the spill. Both files begin with
 * the same bytes. */
static int take_plane(const trip_spill *spill, int partial, int plane, int *fd)
{
    char name[32];
    int folder = trip_spill_folder(spill);
    trip_plane_file_name(trip_list_axis(TRIP_ORDERED_LIST), 0, TRIP_KIND_VOXELS, plane, name);
    if (size_in(partial, name) > size_in(folder, name))
        renameat(partial, name, folder, name);
    return trip_folder_open_file(fd, folder, trip_spill_path(spill), name, O_RDONLY, "brick");
}

int trip_leftover_take(trip_leftover *out, const trip_spill *spill, const char *partial_path,
                       const trip_piece_format *format)
{
    int partial = open(partial_path, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC), status = 0;
    *out = trip_leftover_none();
    for (int i = 0; i < TRIP_PLANES_OF_VOXELS && status == 0; i++) {
        struct stat st;
        out->bytes[i] = UINT64_MAX;
        if (i == TRIP_PLANE_NORMALS && !format->normals)
            continue;
        status = take_plane(spill, partial, i, &out->fd[i]);
        bool known = out->fd[i] >= 0 && fstat(out->fd[i], &st) == 0;
        out->bytes[i] = known ? (uint64_t)st.st_size : 0;
    }
    if (partial >= 0)
        close(partial);
    return status;
}

void trip_leftover_close(trip_leftover *l)
{
    for (int i = 0; i < TRIP_PLANES_OF_VOXELS; i++)
        if (l->fd[i] >= 0)
            close(l->fd[i]);
}

static int fail_damaged(void)
{
    return trip_fail(TRIP_ERROR, "brick", "--resume",
                     "the data of the interrupted run are damaged: run again without --resume");
}

/* The state while runs are appended again. */
typedef struct replay {
    const trip_leftover *leftover;
    const trip_block_form *form;
    trip_list_output *output;
    uint64_t at[TRIP_PLANES_OF_VOXELS]; /* bytes read of each plane */
    uint64_t splats;
    uint64_t block[TRIP_BLOCK_WORDS_MAX];
    unsigned char packed[TRIP_RUN_RECORDS_MAX * sizeof(uint32_t)];
    uint32_t voxels[TRIP_RUN_RECORDS_MAX], normals[TRIP_RUN_RECORDS_MAX];
} replay;

/* Reads the next bytes of a plane. */
static int read_next(replay *r, int plane, void *data, size_t bytes)
{
    if (trip_read_at(r->leftover->fd[plane], data, bytes, bytes, r->at[plane]) != (ssize_t)bytes)
        return fail_damaged();
    r->at[plane] += bytes;
    return 0;
}

/* Reads the next block in parts. Each part determines the length of the next. */
static int read_block(replay *r, uint32_t *words)
{
    uint32_t end;
    int status = 0;
    for (*words = 0; status == 0 && (end = trip_block_end(r->form, r->block, *words)) > *words;
         *words = end)
        status = end <= trip_block_max_words(r->form)
                     ? read_next(r, TRIP_PLANE_VOXELS, r->block + *words,
                                 (end - *words) * sizeof *r->block)
                     : fail_damaged();
    return status;
}

static int read_normals(replay *r, uint32_t splats)
{
    return r->form->normal_bytes
               ? read_next(r, TRIP_PLANE_NORMALS, r->packed, splats * r->form->normal_bytes)
               : 0;
}

/* Returns brick bounds that admit every record inside the tile. */
static trip_file_brick whole_tile(const trip_block_form *f)
{
    const uint8_t last = (uint8_t)((1u << f->tile_log2) - 1);
    return (trip_file_brick){ .code_max = UINT16_MAX, .u_max = last, .v_max = last };
}

static int read_run(replay *r, const trip_run_record *run)
{
    const trip_file_brick tile = whole_tile(r->form);
    uint32_t words;
    int status = read_block(r, &words);
    if (status == 0 && !trip_block_words_fit(r->form, run->splats, words))
        status = fail_damaged();
    if (status == 0)
        status = read_normals(r, run->splats);
    if (status < 0)
        return status;
    trip_block block = trip_block_make(r->form, run->splats, words, r->block,
                                       r->form->normal_bytes ? r->packed : NULL);
    if (trip_block_check(&block, &tile))
        return fail_damaged();
    trip_block_voxels(&block, 0, run->splats, r->voxels);
    if (r->form->normal_bytes)
        trip_block_normals(&block, 0, run->splats, r->normals);
    return 0;
}

static int replay_run(replay *r, const trip_run_record *run)
{
    const uint32_t *normals = r->form->normal_bytes ? r->normals : NULL;
    int status = read_run(r, run);
    if (status == 0 && trip_run_checksum(r->voxels, normals, run->splats) != run->checksum)
        status = fail_damaged();
    if (status == 0 && trip_interrupted())
        status = trip_fail(TRIP_INTERRUPTED, "brick", "", "interrupted");
    r->splats += run->splats;
    return status == 0
               ? trip_list_output_append(r->output, run->key, r->voxels, normals, run->splats)
               : status;
}

/* Returns whether all runs were read and as many bytes were written. If a block was packed less
 * tightly than the writer packs it, this writer did not write the file. */
static bool is_all(const replay *r, const trip_checkpoint *c)
{
    const trip_list_output *o = r->output;
    bool is_same = r->splats == c->ordered_splats;
    for (int i = 0; i < TRIP_PLANES_OF_VOXELS; i++)
        is_same = is_same && r->at[i] == c->ordered_bytes[i] &&
                  trip_writer_plane_bytes(o->writer, o->list, i) == c->ordered_bytes[i];
    return is_same;
}

static int replay_runs(replay *r, trip_journal *j)
{
    const trip_checkpoint *c = trip_journal_get_checkpoint(j);
    trip_run_record runs[RUNS_AT_A_TIME];
    int status = 0;
    for (uint64_t i = 0; i < c->runs && status == 0; i += RUNS_AT_A_TIME) {
        size_t n = c->runs - i < RUNS_AT_A_TIME ? (size_t)(c->runs - i) : RUNS_AT_A_TIME;
        status = trip_journal_read_runs(j, i, runs, n);
        for (size_t k = 0; k < n && status == 0; k++)
            status = replay_run(r, &runs[k]);
    }
    return status == 0 && !is_all(r, c) ? fail_damaged() : status;
}

int trip_leftover_replay(const trip_leftover *l, trip_journal *j, trip_list_builder *builder,
                         const trip_block_form *form, trip_budget *budget)
{
    replay *r = trip_budget_take(budget, sizeof *r);
    if (!r)
        return trip_fail(TRIP_ERROR, "brick", "--resume", "not enough memory: raise --memory");
    r->leftover = l;
    r->form = form;
    r->output = trip_list_builder_ordered(builder);
    int status = replay_runs(r, j);
    trip_budget_release(budget, r, sizeof *r);
    return status;
}
