/* Checks a whole data set. The reader checks every page and every block. This file checks padding,
 * and the lists against each other. */
#include "dataset.h"

#include "reader.h"
#include "report.h"

#include <stdio.h>

/* Sums over a list's voxels that do not depend on their order. Equal lists have equal sums.
 * Different lists have different sums, except by chance. */
typedef struct voxel_sums {
    uint64_t sum, twist;
} voxel_sums;

typedef struct list_verifier {
    const trip_dataset *data;
    const trip_list *list;
    uint32_t voxels[TRIP_RUN_RECORDS_MAX]; /* of one run */
    /* Normals or deviations of the run, or zeros. */
    uint32_t beside[TRIP_RUN_RECORDS_MAX];
    voxel_sums sums;
} list_verifier;

/* Reads the runs of a list one by one. */
typedef struct run_stream {
    trip_reader *reader;
    trip_selection all;
    trip_pass pass;
    trip_batch batch;
    size_t next; /* in the batch */
    trip_run run;
    trip_block block;
} run_stream;

static uint64_t mix(uint64_t x)
{
    x = (x ^ x >> 30) * UINT64_C(0xbf58476d1ce4e5b9);
    x = (x ^ x >> 27) * UINT64_C(0x94d049bb133111eb);
    return x ^ x >> 31;
}

/* `beside` is the normal or the deviation of the voxel, or 0. */
static void add_voxel(voxel_sums *s, const uint64_t p[3], uint32_t code, uint32_t beside)
{
    uint64_t position = mix(p[0] | p[1] << 32) + mix(p[2] | (uint64_t)code << 32);
    uint64_t voxel = mix(position + mix(beside + UINT64_C(0x9e3779b97f4a7c15)));
    s->sum += voxel;
    s->twist += mix(voxel ^ UINT64_C(0xd1b54a32d192ed03));
}

static int fail_run(const trip_dataset *d, const trip_list *list, const trip_run *run,
                    const char *why)
{
    char name[32], where[4096];
    snprintf(where, sizeof where, "%s/%s", d->path,
             trip_list_plane_name(list, TRIP_PLANE_VOXELS, name));
    return trip_fail(TRIP_ERROR, "verify", where, "sheet %d, u %d, v %d: %s", (int)run->sheet,
                     (int)run->u, (int)run->v, why);
}

/* ---- streams of runs ---- */

/* Returns a slot size that holds all of a small list, since clearing default slots would waste
 * time. */
static size_t slot_bytes_for(const trip_list *list)
{
    const uint64_t small = 1 << 19;
    uint64_t bytes = 1;
    for (int plane = 0; plane < TRIP_PLANES && bytes < small; plane++)
        bytes += list->plane_bytes[plane];
    return bytes < small ? (size_t)bytes : 0;
}

static int open_stream(run_stream *s, const trip_dataset *d, const trip_list *list,
                       trip_budget *budget)
{
    const trip_reader_params params = { .planes = list->planes,
                                        .slot_bytes = slot_bytes_for(list) };
    *s = (run_stream){ 0 };
    int status = trip_reader_create(&s->reader, d, &params, budget);
    if (status == TRIP_OK)
        status = trip_selection_create_whole(&s->all, d, list, false, budget);
    s->pass = trip_pass_of(&s->all);
    return status == TRIP_OK ? trip_reader_begin(s->reader, &s->pass) : status;
}

static void close_stream(run_stream *s, trip_budget *budget)
{
    trip_reader_destroy(s->reader);
    trip_selection_destroy(&s->all, budget);
}

/* Returns 1 with the next run, 0 at the end of the list, or a negative status. */
static int next_run(run_stream *s)
{
    while (s->next == s->batch.run_count) {
        if (s->batch.slot)
            trip_reader_release(s->reader, &s->batch);
        s->batch.run_count = s->next = 0;
        if (trip_interrupted())
            return trip_fail(TRIP_INTERRUPTED, "verify", s->all.data->path, "interrupted");
        int status = trip_reader_next(s->reader, &s->batch);
        if (status <= 0)
            return status;
    }
    s->run = s->batch.runs[s->next++];
    s->block = trip_block_of(&s->batch, &s->run);
    return 1;
}

/* ---- a list ---- */

static int check_run(list_verifier *v, const run_stream *s)
{
    uint64_t p[3] = { 0 };
    int axis = v->list->axis;
    const trip_run *run = &s->run;
    const trip_kind_info *kind = trip_kind_of(v->list->kind);
    const unsigned own = kind->axis_bits;
    if (!kind->is_padded(&s->block))
        return fail_run(v->data, v->list, run, "the padding is not zero");
    kind->unpack(&s->block, 0, run->count, v->voxels);
    for (uint32_t i = 0; i < run->count; i++) {
        v->beside[i] = s->block.deviations ? s->block.deviations[i] : 0;
        if (v->beside[i] > v->list->bricks[run->brick].deviation_max)
            return fail_run(v->data, v->list, run,
                            "a deviation is larger than the maximum of its brick");
    }
    if (s->block.normals)
        trip_block_normals(&s->block, 0, run->count, v->beside);
    p[axis] = (uint64_t)run->sheet;
    for (uint32_t i = 0; i < run->count; i++) {
        p[(axis + 1) % 3] = (uint64_t)run->u + trip_voxel_u(v->voxels[i]);
        p[(axis + 2) % 3] = (uint64_t)run->v + trip_voxel_v(v->voxels[i]);
        add_voxel(&v->sums, p, trip_voxel_code(v->voxels[i]) >> own, v->beside[i]);
    }
    return TRIP_OK;
}

static int check_list(list_verifier *v, trip_budget *budget)
{
    run_stream s;
    int status = open_stream(&s, v->data, v->list, budget);
    while (status == TRIP_OK && (status = next_run(&s)) == 1)
        status = check_run(v, &s);
    close_stream(&s, budget);
    return status;
}

/* ---- lists against one another ---- */

/* Compares the positions of two runs in lists of the same grid and axis. */
static int compare_positions(const trip_run *a, const trip_run *b)
{
    uint64_t m = trip_morton((uint32_t)a->u, (uint32_t)a->v);
    uint64_t n = trip_morton((uint32_t)b->u, (uint32_t)b->v);
    if (a->sheet != b->sheet)
        return a->sheet < b->sheet ? -1 : 1;
    return (m > n) - (m < n);
}

/* Whether two blocks of the same tile share a voxel. */
static bool share_voxels(const trip_block *a, const trip_block *b)
{
    const uint64_t *mask_a = a->masks, *mask_b = b->masks;
    uint64_t shared = 0;
    for (unsigned w = 0; w < a->present_words; w++) {
        for (uint64_t bits = a->present[w] | b->present[w]; bits; bits &= bits - 1) {
            uint64_t bit = bits & -bits, in_a = 0, in_b = 0;
            if (a->present[w] & bit)
                in_a = *mask_a++;
            if (b->present[w] & bit)
                in_b = *mask_b++;
            shared |= in_a & in_b;
        }
    }
    return shared != 0;
}

/* Advances the stream that is behind. */
static int compare_streams(run_stream *a, run_stream *b)
{
    int status_a = next_run(a), status_b = next_run(b);
    while (status_a == 1 && status_b == 1) {
        int order = compare_positions(&a->run, &b->run);
        if (order == 0 && share_voxels(&a->block, &b->block))
            return fail_run(a->all.data, b->all.list, &b->run,
                            "a voxel is also in a list of another kind");
        if (order <= 0)
            status_a = next_run(a);
        if (order >= 0)
            status_b = next_run(b);
    }
    return status_a < 0 ? status_a : status_b < 0 ? status_b : TRIP_OK;
}

static int check_apart(const trip_dataset *d, const trip_list *a, const trip_list *b,
                       trip_budget *budget)
{
    run_stream s = { 0 }, t = { 0 };
    int status = open_stream(&s, d, a, budget);
    if (status == TRIP_OK)
        status = open_stream(&t, d, b, budget);
    if (status == TRIP_OK)
        status = compare_streams(&s, &t);
    close_stream(&t, budget);
    close_stream(&s, budget);
    return status;
}

/* Compares a list with the lists before it. */
static int compare_lists(const trip_dataset *d, unsigned i, const voxel_sums *sums,
                         trip_budget *budget)
{
    const trip_list *l = &d->lists[i];
    int status = TRIP_OK;
    for (unsigned j = 0; j < i && status == TRIP_OK; j++) {
        const trip_list *m = &d->lists[j];
        if (l->level != m->level)
            continue;
        if (l->kind == m->kind && (sums[i].sum != sums[j].sum || sums[i].twist != sums[j].twist))
            status =
                trip_fail(TRIP_ERROR, "verify", d->path,
                          "the lists of %s along %c and %c at level %u differ in their records",
                          trip_kind_of(l->kind)->name, 'x' + m->axis, 'x' + l->axis, l->level);
        else if (l->kind != m->kind && l->axis == m->axis && trip_kind_of(l->kind)->lattice &&
                 trip_kind_of(m->kind)->lattice)
            status = check_apart(d, m, l, budget);
    }
    return status;
}

static int check_lists(const trip_dataset *d, list_verifier *v, voxel_sums *sums,
                       trip_budget *budget)
{
    int status = TRIP_OK;
    for (unsigned i = 0; i < d->list_count && status == TRIP_OK; i++) {
        v->list = &d->lists[i];
        v->sums = (voxel_sums){ 0 };
        status = check_list(v, budget);
        sums[i] = v->sums;
        if (status == TRIP_OK)
            status = compare_lists(d, i, sums, budget);
    }
    return status;
}

int trip_dataset_verify(const trip_dataset *d, trip_budget *budget)
{
    list_verifier *v = trip_budget_take(budget, sizeof *v);
    voxel_sums *sums = trip_budget_take(budget, d->list_count * sizeof *sums);
    int status = TRIP_OK;
    if (v && sums) {
        v->data = d;
        status = check_lists(d, v, sums, budget);
    } else {
        status =
            trip_fail(TRIP_ERROR, "verify", d->path, "no memory to decode runs; raise --memory");
    }
    trip_budget_release(budget, sums, d->list_count * sizeof *sums);
    trip_budget_release(budget, v, sizeof *v);
    return status;
}
