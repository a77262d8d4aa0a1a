#include "resume.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

#include "dataset.h"
#include "report.h"

enum { ORDERED_AXIS = 2, RUNS_AT_A_TIME = 256 };

static off_t size_of(const char *path)
{
    struct stat st;
    return stat(path, &st) == 0 && S_ISREG(st.st_mode) ? st.st_size : -1;
}

/* Opens the longer of the two files of a plane, under its name in the spill. Both begin alike. */
static int take_plane(const trip_spill *spill, const char *partial_path, int plane)
{
    char name[32], *from = NULL, *to = NULL;
    int fd = -1;
    trip_dataset_plane_name(ORDERED_AXIS, plane, name);
    if (asprintf(&from, "%s/%s", partial_path, name) < 0)
        from = NULL;
    if (asprintf(&to, "%s/%s", trip_spill_path(spill), name) < 0)
        to = NULL;
    if (from && to) {
        if (size_of(from) > size_of(to))
            rename(from, to);
        fd = open(to, O_RDONLY | O_CLOEXEC);
    }
    free(from);
    free(to);
    return fd;
}

trip_leftover trip_leftover_take(const trip_spill *spill, const char *partial_path, bool normals)
{
    trip_leftover l = { .splats = UINT64_MAX };
    for (int plane = 0; plane < TRIP_PLANES; plane++) {
        struct stat st;
        l.fd[plane] = -1;
        if (plane == TRIP_PLANE_NORMALS && !normals)
            continue;
        l.fd[plane] = take_plane(spill, partial_path, plane);
        uint64_t splats = l.fd[plane] >= 0 && fstat(l.fd[plane], &st) == 0
                              ? (uint64_t)st.st_size / TRIP_RECORD_BYTES
                              : 0;
        l.splats = splats < l.splats ? splats : l.splats;
    }
    return l;
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

/* One run out of the leftover planes; records has room for two. */
static int replay_run(const trip_leftover *l, const trip_run_record *run, uint64_t first,
                      trip_list_output *output, uint32_t *records)
{
    uint32_t *normals = l->fd[TRIP_PLANE_NORMALS] >= 0 ? records + TRIP_TILE_MAX_SPLATS : NULL;
    if (run->splats > TRIP_TILE_MAX_SPLATS)
        return fail_damaged();
    int status = read_records(l->fd[TRIP_PLANE_VOXELS], first, records, run->splats);
    if (status == 0 && normals)
        status = read_records(l->fd[TRIP_PLANE_NORMALS], first, normals, run->splats);
    if (status == 0 && trip_run_checksum(records, normals, run->splats) != run->checksum)
        status = fail_damaged();
    if (status == 0 && trip_interrupted())
        status = trip_fail(TRIP_INTERRUPTED, "brick", "", "interrupted");
    return status == 0 ? trip_list_output_append(output, run->key, records, normals, run->splats)
                       : status;
}

int trip_leftover_replay(const trip_leftover *l, trip_journal *j, trip_list_output *output,
                         trip_budget *budget)
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
            status = replay_run(l, &runs[r], first, output, records);
            first += runs[r].splats;
        }
    }
    trip_budget_release(budget, records, bytes);
    return status;
}
