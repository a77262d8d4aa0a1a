/* Checks a whole data set: every page by its checksum and every record against its brick, through
 * the reader, the order of records, and the three lists against one another. */
#include "dataset.h"

#include "reader.h"
#include "report.h"

#include <stdio.h>

/* Sums over a list's voxels that do not depend on their order: equal lists have equal sums, and
 * different ones have not, but for chance. */
typedef struct voxel_sums {
    uint64_t sum, twist;
} voxel_sums;

typedef struct list_verifier {
    const trip_dataset *data;
    const trip_list *list;
    uint64_t splat;                   /* list position of the next record */
    int64_t sheet, brick, last_order; /* of the run being checked: it may go on in the next batch */
    voxel_sums sums;
} list_verifier;

static uint64_t mix(uint64_t x)
{
    x = (x ^ x >> 30) * UINT64_C(0xbf58476d1ce4e5b9);
    x = (x ^ x >> 27) * UINT64_C(0x94d049bb133111eb);
    return x ^ x >> 31;
}

static void add_voxel(voxel_sums *s, const uint64_t p[3], uint32_t code, uint32_t normal)
{
    uint64_t place = mix(p[0] | p[1] << 32) + mix(p[2] | (uint64_t)code << 32);
    uint64_t voxel = mix(place + mix(normal + UINT64_C(0x9e3779b97f4a7c15)));
    s->sum += voxel;
    s->twist += mix(voxel ^ UINT64_C(0xd1b54a32d192ed03));
}

static int fail_record(const list_verifier *v, const char *why)
{
    char name[32], where[4096];
    trip_list_plane_name(v->list, TRIP_PLANE_VOXELS, name);
    snprintf(where, sizeof where, "%s/%s", v->data->path, name);
    return trip_fail(TRIP_ERROR, "verify", where, "byte %llu: %s",
                     (unsigned long long)v->splat * TRIP_RECORD_BYTES, why);
}

static int check_record(list_verifier *v, uint32_t voxel)
{
    int64_t order = (int64_t)trip_morton(trip_voxel_u(voxel), trip_voxel_v(voxel));
    if (order <= v->last_order)
        return fail_record(v, "the splats of the run are not in Morton order");
    v->last_order = order;
    return TRIP_OK;
}

static int check_run(list_verifier *v, const trip_batch *batch, const trip_run *run)
{
    const uint32_t *voxels = batch->voxels + run->first;
    const uint32_t *normals = batch->normals ? batch->normals + run->first : NULL;
    uint64_t p[3] = { 0 };
    int axis = v->list->axis;
    if (run->sheet != v->sheet || run->brick != v->brick)
        v->last_order = -1;
    v->sheet = run->sheet;
    v->brick = run->brick;
    p[axis] = (uint64_t)run->sheet;
    for (uint32_t i = 0; i < run->count; i++) {
        int status = check_record(v, voxels[i]);
        if (status < 0)
            return status;
        p[(axis + 1) % 3] = (uint64_t)run->u + trip_voxel_u(voxels[i]);
        p[(axis + 2) % 3] = (uint64_t)run->v + trip_voxel_v(voxels[i]);
        add_voxel(&v->sums, p, trip_voxel_code(voxels[i]), normals ? normals[i] : 0);
        v->splat++;
    }
    return TRIP_OK;
}

static int check_batch(list_verifier *v, const trip_batch *batch)
{
    int status = TRIP_OK;
    for (size_t i = 0; i < batch->run_count && status == TRIP_OK; i++)
        status = check_run(v, batch, &batch->runs[i]);
    return status;
}

static int check_pass(list_verifier *v, trip_reader *r, const trip_selection *s)
{
    trip_batch batch;
    trip_pass pass = trip_pass_of(s);
    int status = trip_reader_begin(r, &pass), more = 0;
    while (status == TRIP_OK && (more = trip_reader_next(r, &batch)) > 0) {
        status = check_batch(v, &batch);
        trip_reader_release(r, &batch);
        if (status == TRIP_OK && trip_interrupted())
            status = trip_fail(TRIP_INTERRUPTED, "verify", v->data->path, "interrupted");
    }
    return status < 0 ? status : more;
}

static int check_list(const trip_dataset *d, trip_reader *r, const trip_list *list,
                      trip_budget *budget, voxel_sums *sums)
{
    trip_selection s;
    list_verifier v = { .data = d, .list = list, .sheet = -1, .brick = -1 };
    int status = trip_selection_create_whole(&s, d, list, false, budget);
    if (status < 0)
        return status;
    status = check_pass(&v, r, &s);
    trip_selection_destroy(&s, budget);
    *sums = v.sums;
    return status;
}

int trip_dataset_verify(const trip_dataset *d, trip_budget *budget)
{
    trip_reader *r;
    voxel_sums sums[3];
    int status =
        trip_reader_create(&r, d, &(trip_reader_params){ .planes = d->header.planes }, budget);
    for (int axis = 0; axis < 3 && status == TRIP_OK; axis++) {
        status = check_list(d, r, &d->lists[axis], budget, &sums[axis]);
        if (status == TRIP_OK &&
            (sums[axis].sum != sums[0].sum || sums[axis].twist != sums[0].twist))
            status = trip_fail(TRIP_ERROR, "verify", d->path,
                               "the lists along x and %c do not hold the same voxels", 'x' + axis);
    }
    trip_reader_destroy(r);
    return status;
}
