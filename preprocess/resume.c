#include "resume.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <sys/stat.h>
#include <unistd.h>

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
    trip_dataset_plane_name(ORDERED_AXIS, plane, name);
    if (size_in(partial, name) > size_in(folder, name))
        renameat(partial, name, folder, name);
    return trip_folder_open_file(fd, folder, trip_spill_path(spill), name, O_RDONLY, "brick");
}

int trip_leftover_take(trip_leftover *out, const trip_spill *spill, const char *partial_path,
                       bool normals)
{
    trip_leftover *l = out;
    int partial = open(partial_path, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC), status = 0;
    *l = (trip_leftover){ .fd = { -1, -1 }, .splats = UINT64_MAX };
    for (int plane = 0; plane < TRIP_PLANES && status == 0; plane++) {
        struct stat st;
        if (plane == TRIP_PLANE_NORMALS && !normals)
            continue;
        status = take_plane(spill, partial, plane, &l->fd[plane]);
        uint64_t splats = l->fd[plane] >= 0 && fstat(l->fd[plane], &st) == 0
                              ? (uint64_t)st.st_size / TRIP_RECORD_BYTES
                              : 0;
        l->splats = splats < l->splats ? splats : l->splats;
    }
    if (partial >= 0)
        close(partial);
    return status;
}

void trip_leftover_close(trip_leftover *l)
{
    for (int plane = 0; plane < TRIP_PLANES; plane++)
        if (l->fd[plane] >= 0)
            close(l->fd[plane]);
}

static int fail_damaged(void)
{
    return trip_fail(TRIP_ERROR, "brick", "--resume",
                     "what the interrupted run left is damaged: without --resume it starts again");
}

static int read_records(int fd, uint64_t first, uint32_t *records, uint32_t count)
{
    char *to = (char *)records;
    uint64_t offset = first * TRIP_RECORD_BYTES;
    for (size_t left = (size_t)count * TRIP_RECORD_BYTES; left > 0;) {
        ssize_t n = pread(fd, to, left, (off_t)offset);
        if (n < 0 && errno == EINTR)
            continue;
        if (n <= 0)
            return fail_damaged();
        to += n;
        offset += (uint64_t)n;
        left -= (size_t)n;
    }
    return 0;
}

/* Inside the tile and in its order: nothing later looks at each record. */
static bool are_sound(const uint32_t *voxels, uint32_t count, unsigned tile_log2)
{
    uint64_t next = 0;
    for (uint32_t i = 0; i < count; i++) {
        unsigned u = trip_voxel_u(voxels[i]), v = trip_voxel_v(voxels[i]);
        uint64_t place = trip_morton(u, v);
        if (u >> tile_log2 || v >> tile_log2 || place < next)
            return false;
        next = place + 1;
    }
    return true;
}

/* One run out of the leftover planes; records has room for two. */
static int replay_run(const trip_leftover *l, const trip_run_record *run, uint64_t first,
                      trip_list_output *output, unsigned tile_log2, uint32_t *records)
{
    uint32_t *normals = l->fd[TRIP_PLANE_NORMALS] >= 0 ? records + TRIP_TILE_MAX_SPLATS : NULL;
    if (run->splats == 0 || run->splats > 1u << 2 * tile_log2)
        return fail_damaged();
    int status = read_records(l->fd[TRIP_PLANE_VOXELS], first, records, run->splats);
    if (status == 0 && normals)
        status = read_records(l->fd[TRIP_PLANE_NORMALS], first, normals, run->splats);
    if (status == 0 && (trip_run_checksum(records, normals, run->splats) != run->checksum ||
                        !are_sound(records, run->splats, tile_log2)))
        status = fail_damaged();
    if (status == 0 && trip_interrupted())
        status = trip_fail(TRIP_INTERRUPTED, "brick", "", "interrupted");
    return status == 0 ? trip_list_output_append(output, run->key, records, normals, run->splats)
                       : status;
}

int trip_leftover_replay(const trip_leftover *l, trip_journal *j, trip_list_output *output,
                         unsigned tile_log2, trip_budget *budget)
{
    const size_t bytes = 2 * TRIP_TILE_MAX_SPLATS * sizeof(uint32_t);
    const trip_checkpoint *c = trip_journal_get_checkpoint(j);
    trip_run_record runs[RUNS_AT_A_TIME];
    uint32_t *records = trip_budget_take(budget, bytes);
    uint64_t first = 0;
    if (!records)
        return trip_fail(TRIP_ERROR, "brick", "--resume", "needs more --memory");
    int status = 0;
    for (uint64_t i = 0; i < c->runs && status == 0; i += RUNS_AT_A_TIME) {
        size_t n = c->runs - i < RUNS_AT_A_TIME ? (size_t)(c->runs - i) : RUNS_AT_A_TIME;
        status = trip_journal_read_runs(j, i, runs, n);
        for (size_t r = 0; r < n && status == 0; r++) {
            status = replay_run(l, &runs[r], first, output, tile_log2, records);
            first += runs[r].splats;
        }
    }
    trip_budget_release(budget, records, bytes);
    return status == 0 && first != c->ordered_splats ? fail_damaged() : status;
}
