#include "fixture.h"

#include <stdio.h>
#include <unistd.h>

uint64_t fixture_random(uint64_t *state)
{
    uint64_t z = *state += UINT64_C(0x9e3779b97f4a7c15);
    z = (z ^ z >> 30) * UINT64_C(0xbf58476d1ce4e5b9);
    z = (z ^ z >> 27) * UINT64_C(0x94d049bb133111eb);
    return z ^ z >> 31;
}

/* Interleaves bit by bit, independently of the code under test. */
static uint64_t plain_morton(uint32_t u, uint32_t v)
{
    uint64_t m = 0;
    for (int b = 0; b < 32; b++)
        m |= (uint64_t)(u >> b & 1) << 2 * b | (uint64_t)(v >> b & 1) << (2 * b + 1);
    return m;
}

/* A voxel with its rank in a list, which is ordered by sheet and then by Morton code. */
typedef struct ranked {
    uint64_t rank;
    fixture_voxel voxel;
} ranked;

static int by_rank(const void *a, const void *b)
{
    const ranked *x = a, *y = b;
    return (x->rank > y->rank) - (x->rank < y->rank);
}

static void sort_list(fixture_voxel *list, size_t count, int axis)
{
    ranked *all = calloc(count + 1, sizeof *all);
    for (size_t i = 0; i < count; i++) {
        const uint32_t *p = list[i].p, u = p[(axis + 1) % 3], v = p[(axis + 2) % 3];
        assert_true(p[axis] < 1 << 20 && u < 1 << 22 && v < 1 << 22);
        all[i] = (ranked){ (uint64_t)p[axis] << 44 | plain_morton(u, v), list[i] };
    }
    qsort(all, count, sizeof *all, by_rank);
    for (size_t i = 0; i < count; i++)
        list[i] = all[i].voxel;
    free(all);
}

static void make_voxels(fixture *f)
{
    const int64_t *dims = f->params.dims;
    uint64_t state = f->params.seed;
    double density = f->params.density > 0 ? f->params.density : 0.2;
    size_t room = (size_t)(dims[0] * dims[1] * dims[2]);
    fixture_voxel *list = calloc(room, sizeof *list);
    for (size_t i = 0; i < room && !f->params.empty; i++) {
        uint64_t r = fixture_random(&state);
        if ((double)(r >> 40) >= density * (1 << 24))
            continue;
        list[f->count++] =
            (fixture_voxel){ .p = { (uint32_t)(i % (size_t)dims[0]),
                                    (uint32_t)(i / (size_t)dims[0] % (size_t)dims[1]),
                                    (uint32_t)(i / (size_t)(dims[0] * dims[1])) },
                             .code = f->params.code_bytes == 1 ? ((r & 255) + 258) * 85 : r & 65535,
                             .normal = (uint32_t)(r * 2654435761u >> 3) &
                                       (f->params.normal_bytes == 3 ? 0xffffff : UINT32_MAX) };
    }
    f->lists[0] = list;
    for (int a = 1; a < 3; a++) {
        f->lists[a] = calloc(room, sizeof *list);
        memcpy(f->lists[a], list, f->count * sizeof *list);
    }
    for (int a = 0; a < 3; a++)
        sort_list(f->lists[a], f->count, a);
}

static int write_list(fixture *f, trip_writer *w, int axis)
{
    static uint32_t voxels[128 * 128], normals[128 * 128];
    uint32_t tile = f->params.tile_voxels ? f->params.tile_voxels : 64;
    int u = (axis + 1) % 3, v = (axis + 2) % 3;
    for (size_t i = 0, end; i < f->count; i = end) {
        const fixture_voxel *first = &f->lists[axis][i];
        uint32_t n = 0;
        for (end = i; end < f->count; end++, n++) {
            const fixture_voxel *x = &f->lists[axis][end];
            if (x->p[axis] != first->p[axis] || x->p[u] / tile != first->p[u] / tile ||
                x->p[v] / tile != first->p[v] / tile)
                break;
            voxels[n] = trip_voxel_pack(x->p[u] % tile, x->p[v] % tile, x->code);
            normals[n] = x->normal;
        }
        int status =
            trip_writer_append(w, (unsigned)axis, first->p[axis], first->p[u] / tile,
                               first->p[v] / tile, voxels, f->params.normals ? normals : NULL, n);
        if (status < 0)
            return status;
    }
    return TRIP_OK;
}

int fixture_write(fixture *f, const char *path)
{
    trip_writer *w;
    const fixture_params *p = &f->params;
    trip_writer_params params = { .replace = p->replace,
                                  .code_bytes = p->code_bytes,
                                  .normal_bytes = !p->normals       ? 0
                                                  : p->normal_bytes ? p->normal_bytes
                                                                    : 4,
                                  .tile_voxels = p->tile_voxels,
                                  .slab_sheets = p->slab_sheets,
                                  .page_bytes = p->page_bytes,
                                  .dims = { p->dims[0], p->dims[1], p->dims[2] },
                                  .index_to_world = trip_affine_identity(),
                                  .coordinates = p->coordinates,
                                  .codes = { .code_lo = -1,
                                             .code_hi = 2,
                                             .gradient_step = { 0.5, 0.25, 1 },
                                             .gradient_full = 3 } };
    int status = trip_writer_open(&w, path, &params, f->budget);
    if (status < 0)
        return status;
    for (int axis = 0; axis < 3 && status == TRIP_OK; axis++)
        status = write_list(f, w, axis);
    trip_writer_summary summary = { .value_min = -1,
                                    .value_max = 2,
                                    .voxels = (uint64_t)(p->dims[0] * p->dims[1] * p->dims[2]),
                                    .text = "{\"source\":\"test\"}" };
    if (status == TRIP_OK)
        status = trip_writer_finish(w, &summary);
    if (status < 0)
        trip_writer_abort(w);
    return status;
}

void fixture_read_run(const trip_dataset *d, const trip_list *list, const trip_run *run,
                      uint32_t *voxels, uint32_t *normals)
{
    static uint64_t block[TRIP_BLOCK_WORDS_MAX];
    static unsigned char packed[4 * TRIP_RUN_RECORDS_MAX];
    const trip_block_form form = trip_block_form_of(&d->header, list->kind);
    size_t bytes = 8 * (size_t)run->words, normal_bytes = run->count * form.normal_bytes;
    bool has_normals = list->planes >> TRIP_PLANE_NORMALS & 1;
    assert_int_equal(
        pread(list->plane_fd[TRIP_PLANE_VOXELS], block, bytes, (off_t)run->at[TRIP_PLANE_VOXELS]),
        bytes);
    if (has_normals)
        assert_int_equal(pread(list->plane_fd[TRIP_PLANE_NORMALS], packed, normal_bytes,
                               (off_t)run->at[TRIP_PLANE_NORMALS]),
                         normal_bytes);
    const trip_block b =
        trip_block_make(&form, run->count, run->words, block, has_normals ? packed : NULL);
    trip_block_voxels(&b, 0, run->count, voxels);
    memset(normals, 0, run->count * sizeof *normals);
    if (has_normals)
        trip_block_normals(&b, 0, run->count, normals);
}

void fixture_decode_run(const trip_batch *batch, const trip_run *run, uint32_t *voxels,
                        uint32_t *normals)
{
    const trip_block b = trip_block_of(batch, run);
    trip_block_voxels(&b, 0, run->count, voxels);
    memset(normals, 0, run->count * sizeof *normals);
    if (b.normals)
        trip_block_normals(&b, 0, run->count, normals);
}

void fixture_make(fixture *f, const fixture_params *params)
{
    *f = (fixture){ .params = *params };
    for (int a = 0; a < 3; a++)
        f->params.dims[a] = params->dims[a] ? params->dims[a] : 40;
    bool shm = params->in_memory && access("/dev/shm", W_OK) == 0;
    snprintf(f->folder, sizeof f->folder, "%s/trip-test-XXXXXX", shm ? "/dev/shm" : "/tmp");
    assert_non_null(mkdtemp(f->folder));
    snprintf(f->path, sizeof f->path, "%s/a.trip", f->folder);
    assert_int_equal(trip_budget_create(&f->budget, UINT64_C(1) << 30), TRIP_OK);
    make_voxels(f);
    assert_int_equal(fixture_write(f, f->path), TRIP_OK);
}

void fixture_free(fixture *f)
{
    fixture_run_command("rm -rf %s", f->folder);
    for (int a = 0; a < 3; a++)
        free(f->lists[a]);
    trip_budget_destroy(f->budget);
}

void fixture_run_command(const char *format, ...)
{
    char command[512];
    va_list args;
    va_start(args, format);
    vsnprintf(command, sizeof command, format, args);
    va_end(args);
    assert_int_equal(system(command), 0);
}

static char reports[8192];

static void add_report(const char *line, void *user)
{
    (void)user;
    size_t length = strlen(reports);
    snprintf(reports + length, sizeof reports - length, "%s\n", line);
}

void fixture_catch_reports(void)
{
    reports[0] = 0;
    trip_report_redirect(add_report, NULL);
}

const char *fixture_reports(void)
{
    trip_report_redirect(NULL, NULL);
    return reports;
}
