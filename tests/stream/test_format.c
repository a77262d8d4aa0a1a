/* Checks that the writer writes the example of stream/FORMAT.md. */
#include "fixture.h"

#include <stdio.h>
#include <unistd.h>

#include "normal.h"
/* The four voxels of the example, and their order in each list. Tiles have 16 x 16 voxels. */
typedef struct example_voxel {
    uint32_t p[3];
    uint32_t code;
    double gradient[3];
} example_voxel;

static const example_voxel example[] = {
    { { 1, 0, 0 }, 100, { 1, 0, 0 } },
    { { 2, 1, 0 }, 110, { 0, 4, 0 } },
    { { 17, 1, 0 }, 65535, { 0, 0, -1 } },
    { { 3, 2, 1 }, 5, { 0, 0, 0 } },
};

/* A transparent neighbour. The halo has only the Z list. */
static const uint32_t halo_voxel[3] = { 18, 1, 0 };
enum { HALO_CODE = 33000, HALO_LIST = 3 };

static const int example_order[3][4] = { { 0, 1, 3, 2 }, { 0, 1, 2, 3 }, { 0, 1, 2, 3 } };

static void append_example(trip_writer *w, int axis)
{
    for (int n = 0; n < 4; n++) {
        const example_voxel *x = &example[example_order[axis][n]];
        uint32_t u = x->p[(axis + 1) % 3], v = x->p[(axis + 2) % 3];
        uint32_t voxels[2] = { trip_voxel_pack(u % 16, v % 16, x->code) };
        uint32_t normals[2] = { trip_normal_pack(x->gradient, 2) };
        uint32_t count = 1;
        /* The first two voxels share a tile and a sheet of the Z list. No two voxels do in the X
         * list. */
        if (axis == 2 && n == 0) {
            x = &example[example_order[axis][++n]];
            voxels[1] = trip_voxel_pack(x->p[0], x->p[1], x->code);
            normals[1] = trip_normal_pack(x->gradient, 2);
            count = 2;
        }
        assert_int_equal(trip_writer_append(w, (unsigned)axis, x->p[axis], u / 16, v / 16, voxels,
                                            normals, count),
                         TRIP_OK);
    }
}

static void append_halo(trip_writer *w)
{
    const uint32_t *p = halo_voxel, voxel = trip_voxel_pack(p[0] % 16, p[1] % 16, HALO_CODE);
    assert_int_equal(trip_writer_append(w, HALO_LIST, p[2], p[0] / 16, p[1] / 16, &voxel, NULL, 1),
                     TRIP_OK);
}

static void write_example(const char *path, trip_budget *budget)
{
    trip_writer *w;
    const trip_affine map = { .m = { { 0.5, 0, 0, 1 }, { 0, 0.5, 0, 2 }, { 0, 0, 2, 3 } } };
    trip_writer_list lists[4];
    for (int i = 0; i < 4; i++)
        lists[i] = (trip_writer_list){ .axis = i < 3 ? i : 2,
                                       .kind = i < 3 ? TRIP_KIND_VOXELS : TRIP_KIND_HALO,
                                       .dims = { 20, 3, 2 },
                                       .index_to_world = map,
                                       .sheet_step = 1 };
    trip_writer_params params = { .lists = lists,
                                  .list_count = 4,
                                  .normal_bytes = 4,
                                  .tile_voxels = 16,
                                  .slab_sheets = 4,
                                  .page_bytes = 4096,
                                  .dims = { 20, 3, 2 },
                                  .index_to_world = map,
                                  .codes = { .code_lo = -10, .code_hi = 10, .gradient_full = 2 } };
    assert_int_equal(trip_writer_open(&w, path, &params, budget), TRIP_OK);
    for (int axis = 0; axis < 3; axis++)
        append_example(w, axis);
    append_halo(w);
    assert_int_equal(trip_writer_finish(w, &(trip_writer_summary){ .value_min = -10,
                                                                   .value_max = 10,
                                                                   .voxels = 120,
                                                                   .text = "{}" }),
                     TRIP_OK);
}

typedef struct page_file {
    char name[32];
    size_t bytes;
    unsigned char content[8192];
} page_file;

/* Parses a line "00000010  54 52 49 ...  words" of the page. */
static void take_hex_line(page_file *f, const char *line)
{
    unsigned offset, byte;
    int used;
    assert_int_equal(sscanf(line, "%8x%n", &offset, &used), 1);
    line += used + 2;
    for (; sscanf(line, "%2x%n", &byte, &used) == 1 && used == 2; line += used + 1) {
        assert_true(offset < f->bytes);
        f->content[offset++] = (unsigned char)byte;
        if (line[used] != ' ' || line[used + 1] == ' ')
            break;
    }
}

/* Parses the files of the example. Each starts with "#### `NAME`, N bytes". Bytes that the page
 * omits are zero. */
static int parse_page(page_file *files, int room)
{
    char line[512];
    int count = 0;
    FILE *page = fopen(TRIP_SOURCE_DIR "/stream/FORMAT.md", "r");
    assert_non_null(page);
    while (fgets(line, sizeof line, page)) {
        page_file next = { .bytes = 0 };
        if (sscanf(line, "#### `%31[^`]`, %zu bytes", next.name, &next.bytes) == 2) {
            assert_true(count < room && next.bytes <= sizeof next.content);
            files[count++] = next;
        } else if (count > 0 && strspn(line, "0123456789abcdef") == 8) {
            take_hex_line(&files[count - 1], line);
        }
    }
    fclose(page);
    return count;
}

static void check_file(const char *path, const page_file *f)
{
    char name[256];
    unsigned char content[sizeof f->content + 1];
    snprintf(name, sizeof name, "%s/%s", path, f->name);
    FILE *file = fopen(name, "rb");
    assert_non_null(file);
    size_t n = fread(content, 1, sizeof content, file);
    fclose(file);
    for (size_t i = 0; i < n && i < f->bytes; i++)
        if (content[i] != f->content[i])
            fail_msg("%s: byte %zu (0x%zx) is %02x, FORMAT.md says %02x", f->name, i, i, content[i],
                     f->content[i]);
    assert_int_equal(n, f->bytes);
}

static void the_writer_writes_the_example_of_the_page(void **state)
{
    static page_file files[9];
    char path[] = "/tmp/trip-format-XXXXXX", name[64];
    trip_budget *budget;
    (void)state;
    assert_non_null(mkdtemp(path));
    snprintf(name, sizeof name, "%s/tiny.trip", path);
    assert_int_equal(trip_budget_create(&budget, 1 << 28), TRIP_OK);
    write_example(name, budget);
    if (getenv("TRIP_KEEP_EXAMPLE"))
        fixture_run_command("cp -r %s %s", name, getenv("TRIP_KEEP_EXAMPLE"));
    int count = parse_page(files, 9);
    assert_int_equal(count, 8);
    for (int i = 0; i < count; i++)
        check_file(name, &files[i]);
    trip_budget_destroy(budget);
    fixture_run_command("rm -rf %s", path);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_writer_writes_the_example_of_the_page),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
