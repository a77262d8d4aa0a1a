/* Compares the data set with the output of plain_reader.py, a second reader written from FORMAT.md
 * alone. */
#include "fixture.h"

#include <stdio.h>
#include <sys/wait.h>
#include <math.h>

#include "normal.h"
static FILE *start_reader(const char *path)
{
    char command[512];
    snprintf(command, sizeof command, "%s %s/tests/stream/plain_reader.py %s", TRIP_PYTHON,
             TRIP_SOURCE_DIR, path);
    FILE *pipe = popen(command, "r");
    assert_non_null(pipe);
    return pipe;
}

static void check_line(const char *line, int axis, const fixture_voxel *x,
                       const fixture_params *params)
{
    char list;
    unsigned p[3], code, normal = 0;
    double g[3] = { 0 }, wanted[3];
    int n = sscanf(line, "%c %u %u %u %u %x %lf %lf %lf", &list, &p[0], &p[1], &p[2], &code,
                   &normal, &g[0], &g[1], &g[2]);
    assert_int_equal(n, params->normals ? 9 : 5);
    assert_int_equal(list, 'x' + axis);
    assert_memory_equal(p, x->p, sizeof p);
    assert_int_equal(code, x->code);
    if (!params->normals)
        return;
    assert_int_equal(normal, x->normal);
    if (params->normal_bytes == 3) {
        const trip_affine map = trip_affine_identity();
        const trip_compact_normals c =
            trip_compact_normals_make(&map, 3, (const double[3]){ 0.5, 0.25, 1 });
        trip_compact_normal_unpack(&c, normal, wanted);
    } else {
        trip_normal_unpack(normal, 3, wanted);
    }
    for (int i = 0; i < 3; i++)
        assert_true(fabs(g[i] - wanted[i]) < 1e-7);
}

/* Returns false if Python modules of the reader are missing. */
static bool check_output(const fixture *f)
{
    char line[256];
    size_t lines = 0;
    FILE *pipe = start_reader(f->path);
    for (; fgets(line, sizeof line, pipe); lines++) {
        assert_true(lines < 3 * f->count);
        int axis = (int)(lines / f->count);
        check_line(line, axis, &f->lists[axis][lines % f->count], &f->params);
    }
    int status = pclose(pipe);
    if (WIFEXITED(status) && WEXITSTATUS(status) == 77)
        return false;
    assert_int_equal(status, 0);
    assert_int_equal(lines, 3 * f->count);
    return true;
}

static void the_plain_reader_reads_the_written_data(void **state)
{
    const double x[3] = { 0, 0.5, 2 }, y[2] = { 0, 1 }, z[9] = { 0, 1.5, 2, 2.25, 3, 4, 5, 6, 8 };
    const trip_coordinates uneven =
        trip_coordinates_make((const double *const[3]){ x, y, z }, (const int64_t[3]){ 3, 2, 9 });
    fixture_params params[] = {
        { .dims = { 40, 37, 30 }, .normals = true, .tile_voxels = 16, .page_bytes = 4096 },
        { .dims = { 70, 130, 5 }, .slab_sheets = 3, .density = 0.1 },
        { .dims = { 9, 9, 9 }, .empty = true, .normals = true },
        { .dims = { 40, 37, 30 }, .normals = true, .normal_bytes = 3, .code_bytes = 1 },
        { .dims = { 140, 9, 150 }, .tile_voxels = 128, .code_bytes = 1 },
        { .dims = { 3, 2, 9 }, .coordinates = &uneven },
    };
    bool ran = true;
    (void)state;
    for (int i = 0; i < 6 && ran; i++) {
        fixture f;
        fixture_make(&f, &params[i]);
        ran = check_output(&f);
        fixture_free(&f);
    }
    if (!ran)
        skip();
}

static void the_plain_reader_detects_a_changed_byte(void **state)
{
    static const char *const files[] = { "index.trip", "y0.voxels", "z0.normals" };
    fixture f;
    char line[256];
    (void)state;
    fixture_make(&f, &(fixture_params){ .dims = { 20, 20, 20 }, .normals = true });
    bool ran = check_output(&f);
    for (int i = 0; i < 3 && ran; i++) {
        fixture_run_command("rm -rf %s/b.trip && cp -r %s %s/b.trip", f.folder, f.path, f.folder);
        fixture_run_command("printf '\\377\\001' | dd of=%s/b.trip/%s bs=1 seek=1201 conv=notrunc"
                            " status=none",
                            f.folder, files[i]);
        char path[128];
        snprintf(path, sizeof path, "%s/b.trip 2>/dev/null", f.folder);
        FILE *pipe = start_reader(path);
        while (fgets(line, sizeof line, pipe))
            ;
        assert_int_equal(WEXITSTATUS(pclose(pipe)), 1);
    }
    fixture_free(&f);
    if (!ran)
        skip();
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_plain_reader_reads_the_written_data),
        cmocka_unit_test(the_plain_reader_detects_a_changed_byte),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
