#include "resume.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "block.h"
#include "dataset.h"
#include "folder.h"
#include "report.h"

enum { ORDERED_AXIS = 2, RUNS_AT_A_TIME = 256 };

static off_t size_in(int folder, const char *name)
{
    struct stat st;
    bool found = folder >= 0 && fstatat(folder, name, &st, AT_SYMLINK_NOFOLLOW) == 0 &&
                 S_ISREG(st.st_mode) && st.st_uid == geteuid();
    return found ? st.st_size : -1;
}

/* Opens the longer of the two files of a plane, under its name in the spill. Both begin alike. */
static int take_plane(const trip_spill *spill, int partial, int plane, int *fd)
{
    char name[32];
    int folder = trip_spill_folder(spill);
    trip_plane_file_name(ORDERED_AXIS, 0, TRIP_KIND_VOXELS, plane, name);
    if (size_in(partial, name) > size_in(folder, name))
        renameat(partial, name, folder, name);
    return trip_folder_open_file(fd, folder, trip_spill_path(spill), name, O_RDONLY, "brick");
}

/* Reads on in a plane; false where it ends before. */
static bool read_plane(const trip_leftover *l, int plane, void *to, size_t bytes)
{
    return fread(to, 1, bytes, l->files[plane]) == bytes;
}

/* The next block and how many records it holds; false where there is no whole one. */
static bool read_block(const trip_leftover *l, uint64_t *block, trip_block *out)
{
    uint32_t present = trip_block_present_words(l->form.tile_log2), squares = 0, records = 0;
    if (!read_plane(l, TRIP_PLANE_VOXELS, block, present * sizeof *block))
        return false;
    for (uint32_t i = 0; i < present; i++)
        squares += (uint32_t)__builtin_popcountll(block[i]);
    uint64_t *masks = block + present;
    if (!read_plane(l, TRIP_PLANE_VOXELS, masks, squares * sizeof *block))
        return false;
    for (uint32_t i = 0; i < squares; i++)
        records += (uint32_t)__builtin_popcountll(masks[i]);
    uint32_t codes = trip_block_code_words(records, l->form.code_bytes);
    uint32_t words = present + squares + codes;
    if (!trip_block_words_fit(&l->form, records, words) ||
        !read_plane(l, TRIP_PLANE_VOXELS, masks + squares, codes * sizeof *block))
        return false;
    *out = trip_block_make(&l->form, records, words, block, NULL);
    return true;
}

static void rewind_planes(const trip_leftover *l)
{
    for (int plane = 0; plane < TRIP_PLANES; plane++)
        if (l->files[plane])
            rewind(l->files[plane]);
}

int trip_leftover_take(trip_leftover *out, const trip_spill *spill, const char *partial_path,
                       const trip_block_form *form)
{
    int partial = open(partial_path, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC), status = 0;
    *out = (trip_leftover){ .form = *form };
    for (int plane = 0; plane < TRIP_PLANES && status == 0; plane++) {
        int fd = -1;
        if (plane == TRIP_PLANE_NORMALS && !form->normal_bytes)
            continue;
        status = take_plane(spill, partial, plane, &fd);
        if (fd >= 0 && !(out->files[plane] = fdopen(fd, "rb"))) {
            close(fd);
            status = trip_fail(TRIP_ERROR, "brick", "--resume", "out of memory");
        }
    }
    if (partial >= 0)
        close(partial);
    return status;
}

void trip_leftover_count(trip_leftover *l)
{
    uint64_t block[TRIP_BLOCK_WORDS_MAX], normals = UINT64_MAX;
    struct stat st;
    trip_block b;
    l->splats = 0;
    if (!l->files[TRIP_PLANE_VOXELS])
        return;
    while (read_block(l, block, &b) && !trip_interrupted())
        l->splats += b.count;
    if (l->form.normal_bytes)
        normals =
            l->files[TRIP_PLANE_NORMALS] && fstat(fileno(l->files[TRIP_PLANE_NORMALS]), &st) == 0
                ? (uint64_t)st.st_size / l->form.normal_bytes
                : 0;
    l->splats = normals < l->splats ? normals : l->splats;
}

void trip_leftover_close(trip_leftover *l)
{
    for (int plane = 0; plane < TRIP_PLANES; plane++)
        if (l->files[plane])
            fclose(l->files[plane]);
    *l = (trip_leftover){ 0 };
}

static int fail_damaged(void)
{
    return trip_fail(TRIP_ERROR, "brick", "--resume",
                     "what the interrupted run left is damaged: without --resume it starts again");
}

/* What a run is read to. */
typedef struct replay {
    uint64_t block[TRIP_BLOCK_WORDS_MAX];
    uint32_t voxels[TRIP_RUN_RECORDS_MAX], normals[TRIP_RUN_RECORDS_MAX];
    unsigned char packed[sizeof(uint32_t) * TRIP_RUN_RECORDS_MAX];
} replay;

/* The next run of the leftover planes; false when it is not the one that the journal has. */
static bool read_run(const trip_leftover *l, const trip_run_record *run, replay *to)
{
    trip_block block;
    bool normals = l->form.normal_bytes;
    const uint8_t edge = (uint8_t)((1u << l->form.tile_log2) - 1);
    const trip_file_brick tile = { .code_max = UINT16_MAX, .u_max = edge, .v_max = edge };
    if (!read_block(l, to->block, &block) || block.count != run->splats ||
        trip_block_check(&block, &tile))
        return false;
    trip_block_voxels(&block, 0, block.count, to->voxels);
    if (normals) {
        block.normals = to->packed;
        if (!read_plane(l, TRIP_PLANE_NORMALS, to->packed,
                        (size_t)block.count * l->form.normal_bytes))
            return false;
        trip_block_normals(&block, 0, block.count, to->normals);
    }
    return trip_run_checksum(to->voxels, normals ? to->normals : NULL, run->splats) ==
           run->checksum;
}

static int replay_run(const trip_leftover *l, const trip_run_record *run, trip_list_output *output,
                      replay *to)
{
    if (!read_run(l, run, to))
        return fail_damaged();
    if (trip_interrupted())
        return trip_fail(TRIP_INTERRUPTED, "brick", "", "interrupted");
    return trip_list_output_append(output, run->key, to->voxels,
                                   l->form.normal_bytes ? to->normals : NULL, run->splats);
}

int trip_leftover_replay(const trip_leftover *l, trip_journal *j, trip_list_output *output,
                         trip_budget *budget)
{
    const trip_checkpoint *c = trip_journal_get_checkpoint(j);
    trip_run_record runs[RUNS_AT_A_TIME];
    replay *to = trip_budget_take(budget, sizeof *to);
    uint64_t splats = 0;
    if (!to)
        return trip_fail(TRIP_ERROR, "brick", "--resume", "needs more --memory");
    int status = c->runs > 0 && !l->files[TRIP_PLANE_VOXELS] ? fail_damaged() : 0;
    rewind_planes(l);
    for (uint64_t i = 0; i < c->runs && status == 0; i += RUNS_AT_A_TIME) {
        size_t n = c->runs - i < RUNS_AT_A_TIME ? (size_t)(c->runs - i) : RUNS_AT_A_TIME;
        status = trip_journal_read_runs(j, i, runs, n);
        for (size_t r = 0; r < n && status == 0; r++) {
            status = replay_run(l, &runs[r], output, to);
            splats += runs[r].splats;
        }
    }
    trip_budget_release(budget, to, sizeof *to);
    return status == 0 && splats != c->ordered_splats ? fail_damaged() : status;
}
