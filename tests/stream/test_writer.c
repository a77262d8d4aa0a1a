#include "fixture.h"

#include <signal.h>
#include <stdio.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

/* Decodes a whole list with the iterator and direct reads of the plane files. */
static void read_list(const trip_dataset *d, int axis, bool descending, fixture_voxel *out,
                      size_t room)
{
    trip_selection s;
    trip_run run;
    size_t n = 0;
    uint32_t voxels[128 * 128], normals[128 * 128];
    const trip_list *l = &d->lists[axis];
    assert_int_equal(
        trip_selection_create(&s, d, &d->lists[axis], descending, 0, INT32_MAX, d->budget),
        TRIP_OK);
    for (uint64_t b = 0; b < l->brick_count; b++)
        trip_selection_add(&s, b);
    for (trip_run_iterator it = trip_run_begin(&s); trip_run_next(&it, &run);) {
        fixture_read_run(d, l, &run, voxels, normals);
        for (uint32_t i = 0; i < run.count; i++) {
            uint32_t at = descending ? run.count - 1 - i : i;
            assert_true(n < room);
            fixture_voxel *x = &out[n++];
            x->p[axis] = (uint32_t)run.sheet;
            x->p[(axis + 1) % 3] = (uint32_t)run.u + trip_voxel_u(voxels[at]);
            x->p[(axis + 2) % 3] = (uint32_t)run.v + trip_voxel_v(voxels[at]);
            x->code = trip_voxel_code(voxels[at]);
            x->normal = normals[at];
        }
    }
    assert_int_equal(n, room);
    trip_selection_destroy(&s, d->budget);
}

static void check_round_trip(const fixture_params *params)
{
    fixture f;
    trip_dataset *d;
    fixture_params p = *params;
    p.in_memory = true;
    fixture_make(&f, &p);
    assert_int_equal(trip_dataset_open(&d, f.path, f.budget), TRIP_OK);
    assert_int_equal(d->header.kept, f.count);
    fixture_voxel *out = calloc(f.count + 1, sizeof *out);
    for (int axis = 0; axis < 3; axis++) {
        for (size_t i = 0; i < f.count && !params->normals; i++)
            f.lists[axis][i].normal = 0;
        read_list(d, axis, false, out, f.count);
        assert_memory_equal(out, f.lists[axis], f.count * sizeof *out);
        read_list(d, axis, true, out, f.count);
        for (size_t i = 0; i < f.count; i++)
            assert_memory_equal(&out[i], &f.lists[axis][f.count - 1 - i], sizeof *out);
    }
    free(out);
    trip_dataset_close(d);
    fixture_free(&f);
}

static void written_lists_are_read_in_both_directions(void **state)
{
    (void)state;
    check_round_trip(&(fixture_params){ .normals = true });
}

static void the_voxels_of_a_list_do_not_depend_on_tiles_slabs_or_pages(void **state)
{
    (void)state;
    unsigned slabs[] = { 1, 3, 8, 64 };
    for (unsigned tile = 16; tile <= 128; tile *= 2)
        for (int s = 0; s < 4; s++)
            check_round_trip(&(fixture_params){ .dims = { 70, 33, 135 },
                                                .density = 0.05,
                                                .tile_voxels = tile,
                                                .slab_sheets = slabs[s],
                                                .page_bytes = 4096u << s });
}

/* A sheet has 24 x 24 tiles, each with one brick. */
static void a_slab_has_as_many_bricks_as_there_are_tiles(void **state)
{
    (void)state;
    check_round_trip(&(fixture_params){
        .dims = { 384, 384, 2 }, .density = 0.02, .tile_voxels = 16, .slab_sheets = 2 });
}

static void empty_and_full_volumes_are_written(void **state)
{
    (void)state;
    check_round_trip(&(fixture_params){ .empty = true });
    check_round_trip(&(fixture_params){ .density = 1.1, .dims = { 1, 64, 200 }, .normals = true });
    check_round_trip(&(fixture_params){ .density = 1.1, .dims = { 1, 1, 1 } });
}

/* Makes a small fixture in memory. */
static void make_small(fixture *f)
{
    fixture_make(f, &(fixture_params){ .dims = { 20, 20, 20 }, .in_memory = true });
}

static void expect_refused(fixture *f, const char *path, const char *why)
{
    fixture_catch_reports();
    int status = fixture_write(f, path);
    const char *reports = fixture_reports();
    if (status != TRIP_ERROR || !strstr(reports, why) || strchr(reports, '\n')[1])
        fail_msg("wanted \"%s\": status %d, \"%s\"", why, status, reports);
}

static void expect_sound(const fixture *f, const char *path)
{
    trip_dataset *d;
    assert_int_equal(trip_dataset_open(&d, path, f->budget), TRIP_OK);
    assert_int_equal(d->header.kept, f->count);
    assert_int_equal(trip_dataset_verify(d, f->budget), TRIP_OK);
    trip_dataset_close(d);
}

static bool is_there(const char *path)
{
    struct stat st;
    return lstat(path, &st) == 0;
}

static void an_existing_data_set_is_kept_without_replace(void **state)
{
    fixture f;
    char partial[128];
    (void)state;
    make_small(&f);
    snprintf(partial, sizeof partial, "%s.partial", f.path);
    expect_refused(&f, f.path, "exists already");
    f.params.replace = true;
    f.count = 1;
    for (int a = 0; a < 3; a++)
        f.lists[a][0] = (fixture_voxel){ .p = { 3, 4, 5 }, .code = 9 };
    assert_int_equal(fixture_write(&f, f.path), TRIP_OK);
    expect_sound(&f, f.path);
    assert_false(is_there(partial));
    fixture_free(&f);
}

static void only_a_data_set_is_replaced(void **state)
{
    fixture f;
    char path[128];
    (void)state;
    make_small(&f);
    f.params.replace = true;
    snprintf(path, sizeof path, "%s/letters", f.folder);
    fixture_run_command("mkdir %s && touch %s/mine", path, path);
    expect_refused(&f, path, "not a data set");
    fixture_run_command("test -f %s/mine", path);
    expect_refused(&f, "/", "not a valid name");
    expect_refused(&f, "", "not a valid name");
    expect_refused(&f, "/nowhere/a.trip", "No such file");
    fixture_free(&f);
}

static void leftovers_of_an_interrupted_run_are_removed(void **state)
{
    fixture f;
    char path[128];
    (void)state;
    make_small(&f);
    snprintf(path, sizeof path, "%s/b.trip", f.folder);
    fixture_run_command("cp -r %s %s.partial && truncate -s 9 %s.partial/index.trip", f.path, path,
                        path);
    assert_int_equal(fixture_write(&f, path), TRIP_OK);
    expect_sound(&f, path);
    fixture_run_command("test ! -e %s.partial", path);
    fixture_run_command("rm -r %s; mkdir %s.partial && touch %s.partial/mine", path, path, path);
    expect_refused(&f, path, "contains files that do not belong");
    fixture_run_command("test -f %s.partial/mine", path);
    fixture_free(&f);
}

static void a_replacement_killed_between_its_renames_is_undone(void **state)
{
    fixture f;
    (void)state;
    make_small(&f);
    fixture_run_command("mv %s %s.replaced && mkdir %s.partial", f.path, f.path, f.path);
    expect_refused(&f, f.path, "exists already");
    expect_sound(&f, f.path);
    fixture_free(&f);
}

/* File systems that cannot exchange two folders in one step leave this state. */
static void leftovers_of_a_replacement_killed_later_do_no_harm(void **state)
{
    fixture f;
    (void)state;
    make_small(&f);
    fixture_run_command("cp -r %s %s.replaced", f.path, f.path);
    expect_refused(&f, f.path, "exists already");
    fixture_run_command("test -d %s.replaced", f.path);
    f.params.replace = true;
    assert_int_equal(fixture_write(&f, f.path), TRIP_OK);
    expect_sound(&f, f.path);
    fixture_run_command("test ! -e %s.replaced && test ! -e %s.partial", f.path, f.path);
    fixture_free(&f);
}

static void a_data_set_behind_a_link_is_replaced_and_the_link_stays(void **state)
{
    fixture f;
    char path[128];
    (void)state;
    make_small(&f);
    snprintf(path, sizeof path, "%s/link", f.folder);
    assert_int_equal(symlink("a.trip", path), 0);
    f.params.replace = true;
    assert_int_equal(fixture_write(&f, path), TRIP_OK);
    fixture_run_command("test -L %s && test $(ls %s | wc -l) = 2", path, f.folder);
    expect_sound(&f, path);
    fixture_free(&f);
}

static void codes_and_normals_of_every_length_are_read_as_written(void **state)
{
    (void)state;
    for (unsigned tile = 16; tile <= 128; tile *= 2)
        for (unsigned i = 0; i < 4; i++)
            check_round_trip(&(fixture_params){ .tile_voxels = tile,
                                                .code_bytes = 1 + i % 2,
                                                .normal_bytes = 3 + i / 2,
                                                .normals = true });
}

/* The lists are X, Y and Z of level 0, its halo along Z, and X and Y of level 1. */
enum { MANY = 6 };

static const trip_writer_list *many_lists(void)
{
    static trip_writer_list lists[MANY];
    for (int i = 0; i < MANY; i++) {
        bool coarse = i > 3;
        lists[i] = (trip_writer_list){ .axis = i < 3    ? i
                                               : i == 3 ? 2
                                                        : i - 4,
                                       .level = coarse,
                                       .kind = i == 3 ? TRIP_KIND_HALO : TRIP_KIND_VOXELS,
                                       .index_to_world = trip_affine_identity(),
                                       .sheet_first = coarse ? 0.5 : 0,
                                       .sheet_step = coarse ? 2 : 1 };
        for (int a = 0; a < 3; a++) {
            lists[i].dims[a] = coarse ? 20 : 40;
            lists[i].index_to_world.m[a][a] = coarse ? 2 : 1;
            lists[i].index_to_world.m[a][3] = coarse ? 0.5 : 0;
        }
    }
    return lists;
}

/* Writes one voxel to each list: (1, 2, 3) at level 0, `halo` as its halo, (7, 8, `k`) at level 1.
 */
static void write_many(const char *path, const uint32_t halo[3], uint32_t k, trip_budget *budget)
{
    trip_writer *w;
    const trip_writer_params params = { .dims = { 40, 40, 40 },
                                        .tile_voxels = 16,
                                        .replace = true,
                                        .index_to_world = trip_affine_identity(),
                                        .lists = many_lists(),
                                        .list_count = MANY };
    assert_int_equal(trip_writer_open(&w, path, &params, budget), TRIP_OK);
    for (unsigned i = 0; i < MANY; i++) {
        const uint32_t fine[3] = { 1, 2, 3 }, coarse[3] = { 7, 8, i == 5 ? k : 9 };
        const uint32_t *p = i < 3 ? fine : i == 3 ? halo : coarse;
        int axis = many_lists()[i].axis;
        uint32_t u = p[(axis + 1) % 3], v = p[(axis + 2) % 3];
        const uint32_t voxel = trip_voxel_pack(u % 16, v % 16, 100 + i / 4);
        assert_int_equal(trip_writer_append(w, i, p[axis], u / 16, v / 16, &voxel, NULL, 1),
                         TRIP_OK);
    }
    const trip_writer_summary summary = { .voxels = 64000 };
    assert_int_equal(trip_writer_finish(w, &summary), TRIP_OK);
}

static void check_many(const trip_dataset *d)
{
    assert_int_equal(d->list_count, MANY);
    assert_int_equal(d->header.kept, 1);
    assert_int_equal(d->header.halo, 1);
    for (unsigned i = 0; i < MANY; i++) {
        const trip_writer_list *wanted = &many_lists()[i];
        const trip_list *l = trip_dataset_find(d, wanted->axis, wanted->level, wanted->kind);
        assert_ptr_equal(l, &d->lists[i]);
        assert_int_equal(l->index, i);
        assert_int_equal(l->records, 1);
        assert_memory_equal(l->dims, wanted->dims, sizeof l->dims);
        assert_memory_equal(&l->index_to_world, &wanted->index_to_world, sizeof l->index_to_world);
        assert_true(trip_list_sheet_coordinate(l, 3) == (wanted->level ? 6.5 : 3));
    }
    assert_null(trip_dataset_find(d, 2, 1, TRIP_KIND_VOXELS));
    assert_null(trip_dataset_find(d, 0, 0, TRIP_KIND_HALO));
}

static void expect_verified(const char *path, trip_budget *budget, const char *fault)
{
    trip_dataset *d;
    assert_int_equal(trip_dataset_open(&d, path, budget), TRIP_OK);
    fixture_catch_reports();
    assert_int_equal(trip_dataset_verify(d, budget), fault ? TRIP_ERROR : TRIP_OK);
    if (fault)
        assert_non_null(strstr(fixture_reports(), fault));
    else
        assert_string_equal(fixture_reports(), "");
    trip_dataset_close(d);
}

static void lists_of_other_levels_and_kinds_are_kept_and_verified(void **state)
{
    const uint32_t around[3] = { 2, 2, 3 }, within[3] = { 1, 2, 3 };
    fixture f;
    trip_dataset *d;
    char path[128];
    (void)state;
    make_small(&f);
    snprintf(path, sizeof path, "%s/b.trip", f.folder);
    write_many(path, around, 9, f.budget);
    assert_int_equal(trip_dataset_open(&d, path, f.budget), TRIP_OK);
    check_many(d);
    trip_dataset_close(d);
    fixture_run_command("test -e %s/z0.halo && test -e %s/y1.voxels", path, path);
    expect_verified(path, f.budget, NULL);
    write_many(path, within, 9, f.budget);
    expect_verified(path, f.budget, "a voxel is also in a list of another kind");
    write_many(path, around, 10, f.budget);
    expect_verified(path, f.budget, "the lists of voxels along x and y at level 1");
    fixture_free(&f);
}

/* One voxel has a different value or normal in the Y list. */
static void lists_with_equal_positions_and_other_voxels_are_found(void **state)
{
    fixture f;
    (void)state;
    fixture_make(&f,
                 &(fixture_params){
                     .dims = { 20, 20, 20 }, .normals = true, .replace = true, .in_memory = true });
    expect_verified(f.path, f.budget, NULL);
    f.lists[1][3].code ^= 1;
    assert_int_equal(fixture_write(&f, f.path), TRIP_OK);
    expect_verified(f.path, f.budget, "the lists of voxels along x and y at level 0");
    f.lists[1][3].code ^= 1;
    f.lists[1][3].normal ^= 1;
    assert_int_equal(fixture_write(&f, f.path), TRIP_OK);
    expect_verified(f.path, f.budget, "the lists of voxels along x and y at level 0");
    fixture_free(&f);
}

/* Appends four points of one tile to a list. */
static void append_points(trip_writer *w, unsigned list, const uint32_t points[4][3])
{
    const int axis = (int)list % 3, u = (axis + 1) % 3, v = (axis + 2) % 3;
    for (uint32_t sheet = 0; sheet < 16; sheet++) {
        uint32_t voxels[4], count = 0;
        for (uint64_t n = 0; n < 256; n++)
            for (int i = 0; i < 4; i++)
                if (points[i][axis] == sheet && trip_morton(points[i][u], points[i][v]) == n)
                    voxels[count++] = trip_voxel_pack(points[i][u], points[i][v], 1);
        assert_int_equal(trip_writer_append(w, list, sheet, 0, 0, voxels, NULL, count), TRIP_OK);
    }
}

/* Both kinds share the fourth point. Along every axis, one of the first three points is in an
 * earlier square than the fourth. */
static void a_voxel_in_two_kinds_is_found_in_any_square(void **state)
{
    const uint32_t kept[4][3] = { { 10, 1, 1 }, { 1, 10, 1 }, { 1, 1, 10 }, { 10, 10, 10 } };
    const uint32_t shared[4][3] = { { 10, 0, 0 }, { 0, 10, 0 }, { 0, 0, 10 }, { 10, 10, 10 } };
    const uint32_t apart[4][3] = { { 10, 0, 0 }, { 0, 10, 0 }, { 0, 0, 10 }, { 9, 9, 9 } };
    const trip_writer_params params = { .dims = { 16, 16, 16 },
                                        .tile_voxels = 16,
                                        .replace = true,
                                        .halo = true,
                                        .index_to_world = trip_affine_identity() };
    fixture f;
    char path[128];
    (void)state;
    make_small(&f);
    snprintf(path, sizeof path, "%s/b.trip", f.folder);
    for (int i = 0; i < 2; i++) {
        trip_writer *w;
        assert_int_equal(trip_writer_open(&w, path, &params, f.budget), TRIP_OK);
        for (unsigned list = 0; list < 6; list++)
            append_points(w, list, list < 3 ? kept : i ? apart : shared);
        assert_int_equal(trip_writer_finish(w, &(trip_writer_summary){ .voxels = 4096 }), TRIP_OK);
        expect_verified(path, f.budget, i ? NULL : "a voxel is also in a list of another kind");
    }
    fixture_free(&f);
}

/* FORMAT.md allows no coarse levels of uneven grids, so readers need not handle them. */
static void coarse_levels_of_uneven_grids_are_refused(void **state)
{
    fixture f;
    double table[40];
    trip_writer *w;
    trip_dataset *d;
    char path[128];
    (void)state;
    make_small(&f);
    snprintf(path, sizeof path, "%s/b.trip", f.folder);
    for (int i = 0; i < 40; i++)
        table[i] = i * i / 39.0;
    const trip_coordinates coordinates = trip_coordinates_make(
        (const double *const[3]){ table, table, table }, (const int64_t[3]){ 40, 40, 40 });
    const trip_writer_params params = { .dims = { 40, 40, 40 },
                                        .index_to_world = trip_affine_identity(),
                                        .coordinates = &coordinates,
                                        .lists = many_lists(),
                                        .list_count = MANY };
    assert_int_equal(trip_writer_open(&w, path, &params, f.budget), TRIP_OK);
    assert_int_equal(trip_writer_finish(w, &(trip_writer_summary){ .voxels = 64000 }), TRIP_OK);
    fixture_catch_reports();
    assert_int_equal(trip_dataset_open(&d, path, f.budget), TRIP_ERROR);
    assert_non_null(strstr(fixture_reports(), "a coarse level of a grid with uneven spacing"));
    fixture_free(&f);
}

static void invalid_lists_are_refused(void **state)
{
    trip_budget *budget;
    trip_writer *w;
    trip_writer_list lists[MANY];
    (void)state;
    assert_int_equal(trip_budget_create(&budget, 1 << 24), TRIP_OK);
    fixture_catch_reports();
    for (int i = 0; i < 9; i++) {
        trip_writer_params params = { .dims = { 40, 40, 40 },
                                      .index_to_world = trip_affine_identity(),
                                      .lists = lists,
                                      .list_count = MANY };
        memcpy(lists, many_lists(), sizeof lists);
        lists[3].kind = i == 0 ? TRIP_KINDS : TRIP_KIND_HALO;
        lists[4].axis = i == 1 ? 1 : i == 2 ? 3 : 0;
        lists[4].dims[1] = i == 3 ? 21 : 20;
        lists[4].sheet_step = i == 4 ? 0 : i == 5 ? INFINITY : 2;
        lists[2].dims[0] = i == 6 ? 39 : 40;
        lists[1].level = i == 7 ? 2 : 0;
        params.list_count = i == 8 ? 2 : MANY;
        assert_int_equal(trip_writer_open(&w, "/tmp/trip-never.trip", &params, budget), TRIP_ERROR);
    }
    fixture_reports();
    assert_false(is_there("/tmp/trip-never.trip.partial"));
    trip_budget_destroy(budget);
}

static trip_writer *open_writer(const char *path, trip_budget *budget)
{
    trip_writer *w;
    int status = trip_writer_open(&w, path,
                                  &(trip_writer_params){
                                      .dims = { 40, 40, 40 },
                                      .tile_voxels = 16,
                                      .index_to_world = trip_affine_identity(),
                                  },
                                  budget);
    return status == TRIP_OK ? w : NULL;
}

static void two_writers_of_one_name_do_not_mix(void **state)
{
    fixture f;
    char path[128];
    (void)state;
    make_small(&f);
    snprintf(path, sizeof path, "%s/b.trip", f.folder);
    trip_writer *w = open_writer(path, f.budget);
    assert_non_null(w);
    expect_refused(&f, path, "another process is writing it");
    trip_writer_abort(w);
    assert_int_equal(fixture_write(&f, path), TRIP_OK);
    fixture_free(&f);
}

static void runs_out_of_order_or_position_are_refused(void **state)
{
    fixture f;
    char path[128];
    uint32_t voxel = trip_voxel_pack(0, 0, 1);
    (void)state;
    make_small(&f);
    snprintf(path, sizeof path, "%s/b.trip", f.folder);
    trip_writer *w = open_writer(path, f.budget);
    assert_non_null(w);
    fixture_catch_reports();
    assert_int_equal(trip_writer_append(w, 0, 40, 0, 0, &voxel, NULL, 1), TRIP_ERROR);
    assert_int_equal(trip_writer_append(w, 0, 0, 3, 0, &voxel, NULL, 1), TRIP_ERROR);
    assert_int_equal(trip_writer_append(w, 0, 5, 1, 1, &voxel, NULL, 1), TRIP_OK);
    assert_int_equal(trip_writer_append(w, 0, 5, 0, 1, &voxel, NULL, 1), TRIP_ERROR);
    assert_int_equal(trip_writer_append(w, 0, 5, 1, 1, &voxel, NULL, 1), TRIP_ERROR);
    assert_int_equal(trip_writer_append(w, 0, 4, 1, 1, &voxel, NULL, 1), TRIP_ERROR);
    assert_int_equal(trip_writer_append(w, 0, 6, 0, 0, &voxel, NULL, 1), TRIP_OK);
    const uint32_t beyond_u = trip_voxel_pack(8, 0, 1), beyond_v = trip_voxel_pack(0, 8, 1);
    assert_int_equal(trip_writer_append(w, 0, 7, 2, 0, &beyond_u, NULL, 1), TRIP_ERROR);
    assert_int_equal(trip_writer_append(w, 0, 7, 0, 2, &beyond_v, NULL, 1), TRIP_ERROR);
    trip_writer_summary summary = { .voxels = 64000 };
    assert_int_equal(trip_writer_finish(w, &summary), TRIP_ERROR);
    trip_writer_abort(w);
    assert_non_null(strstr(fixture_reports(), "lists of the same voxels have"));
    assert_false(is_there(path));
    fixture_run_command("test ! -e %s.partial", path);
    fixture_free(&f);
}

/* The grid has one voxel. The lists hold it as kept, and in one case also as its own halo, which is
 * impossible. */
static void impossible_numbers_of_voxels_are_refused(void **state)
{
    fixture f;
    char path[128];
    const uint32_t voxel = trip_voxel_pack(0, 0, 1);
    (void)state;
    make_small(&f);
    snprintf(path, sizeof path, "%s/b.trip", f.folder);
    for (int i = 0; i < 4; i++) {
        const unsigned lists = i == 3 ? 6 : 3;
        const trip_writer_summary summary = { .voxels = i == 1 ? 0 : i == 2 ? 2 : 1 };
        const trip_writer_params params = { .dims = { 1, 1, 1 },
                                            .index_to_world = trip_affine_identity(),
                                            .halo = lists == 6 };
        trip_writer *w;
        fixture_catch_reports();
        assert_int_equal(trip_writer_open(&w, path, &params, f.budget), TRIP_OK);
        for (unsigned list = 0; list < lists; list++)
            assert_int_equal(trip_writer_append(w, list, 0, 0, 0, &voxel, NULL, 1), TRIP_OK);
        assert_int_equal(trip_writer_finish(w, &summary), i == 0 ? TRIP_OK : TRIP_ERROR);
        if (i > 0)
            trip_writer_abort(w);
        assert_int_equal(i > 0, strstr(fixture_reports(), "kept voxels and") != NULL);
        fixture_run_command("rm -rf %s", path);
    }
    fixture_free(&f);
}

static void parameters_out_of_range_are_refused(void **state)
{
    trip_budget *budget;
    trip_writer *w;
    const trip_writer_params good = { .dims = { 4, 4, 4 },
                                      .index_to_world = trip_affine_identity() };
    trip_writer_params bad[10];
    (void)state;
    assert_int_equal(trip_budget_create(&budget, 1 << 24), TRIP_OK);
    for (int i = 0; i < 10; i++)
        bad[i] = good;
    bad[0].dims[1] = 0;
    bad[1].dims[2] = INT64_C(1) << 31;
    bad[2].tile_voxels = 48;
    bad[3].tile_voxels = 256;
    bad[4].slab_sheets = 65;
    bad[5].page_bytes = 5000;
    bad[6].index_to_world.m[0][0] = 0;
    bad[7].codes.code_lo = 1;
    bad[8].codes.gradient_full = NAN;
    bad[9].page_bytes = 1 << 24; /* six buffers of 16 MiB do not fit 16 MiB */
    fixture_catch_reports();
    for (int i = 0; i < 10; i++)
        assert_true(trip_writer_open(&w, "/tmp/trip-never.trip", &bad[i], budget) < 0);
    fixture_reports();
    assert_false(is_there("/tmp/trip-never.trip.partial"));
    trip_budget_destroy(budget);
}

/* Kills writers in child processes at random moments. The name must always refer to a complete data
 * set, and the next writer must succeed. */
static void a_writer_killed_anytime_leaves_the_old_or_new_data_set(void **state)
{
    fixture f;
    uint64_t random = 11;
    (void)state;
    make_small(&f);
    f.params.replace = true;
    for (int i = 0; i < 40; i++) {
        int status;
        pid_t child = fork();
        if (child == 0) {
            while (fixture_write(&f, f.path) == TRIP_OK)
                ;
            _exit(1);
        }
        usleep((unsigned)(fixture_random(&random) % 20000));
        kill(child, SIGKILL);
        waitpid(child, &status, 0);
        assert_true(WIFSIGNALED(status));
        expect_sound(&f, f.path);
    }
    assert_int_equal(fixture_write(&f, f.path), TRIP_OK);
    expect_sound(&f, f.path);
    fixture_run_command("test $(ls %s | wc -l) = 1", f.folder);
    fixture_free(&f);
}

/* Mounts a file system of 1 MiB, which needs permission to mount. */
static void a_full_disk_reports_one_line_and_leaves_no_files(void **state)
{
    fixture f;
    char path[128];
    (void)state;
    fixture_make(&f, &(fixture_params){ .dims = { 90, 90, 90 }, .normals = true });
    snprintf(path, sizeof path, "%s/disk/b.trip", f.folder);
    char command[256];
    snprintf(command, sizeof command,
             "mkdir %s/disk && mount -t tmpfs -o size=1m tmpfs %s/disk 2>/dev/null", f.folder,
             f.folder);
    if (system(command) != 0) {
        fixture_free(&f);
        print_message("skipped: mounting a small disk is not allowed here\n");
        skip();
    }
    expect_refused(&f, path, "no space left on the disk");
    snprintf(command, sizeof command, "test -z \"$(ls -A %s/disk)\"", f.folder);
    int left = system(command);
    fixture_run_command("umount %s/disk", f.folder);
    assert_int_equal(left, 0);
    fixture_free(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(written_lists_are_read_in_both_directions),
        cmocka_unit_test(the_voxels_of_a_list_do_not_depend_on_tiles_slabs_or_pages),
        cmocka_unit_test(a_slab_has_as_many_bricks_as_there_are_tiles),
        cmocka_unit_test(empty_and_full_volumes_are_written),
        cmocka_unit_test(an_existing_data_set_is_kept_without_replace),
        cmocka_unit_test(only_a_data_set_is_replaced),
        cmocka_unit_test(leftovers_of_an_interrupted_run_are_removed),
        cmocka_unit_test(a_replacement_killed_between_its_renames_is_undone),
        cmocka_unit_test(leftovers_of_a_replacement_killed_later_do_no_harm),
        cmocka_unit_test(a_data_set_behind_a_link_is_replaced_and_the_link_stays),
        cmocka_unit_test(two_writers_of_one_name_do_not_mix),
        cmocka_unit_test(runs_out_of_order_or_position_are_refused),
        cmocka_unit_test(codes_and_normals_of_every_length_are_read_as_written),
        cmocka_unit_test(lists_of_other_levels_and_kinds_are_kept_and_verified),
        cmocka_unit_test(lists_with_equal_positions_and_other_voxels_are_found),
        cmocka_unit_test(a_voxel_in_two_kinds_is_found_in_any_square),
        cmocka_unit_test(coarse_levels_of_uneven_grids_are_refused),
        cmocka_unit_test(invalid_lists_are_refused),
        cmocka_unit_test(impossible_numbers_of_voxels_are_refused),
        cmocka_unit_test(parameters_out_of_range_are_refused),
        cmocka_unit_test(a_writer_killed_anytime_leaves_the_old_or_new_data_set),
        cmocka_unit_test(a_full_disk_reports_one_line_and_leaves_no_files),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
