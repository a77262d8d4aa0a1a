#include "volume_files.h"

#include "comma_locale.h"

static const char *const nrrd_types[] = { "uint8",  "signed char", "unsigned short", "short",
                                          "uint32", "int",         "uint64",         "longlong",
                                          NULL,     "float",       "double" };

/* Appends a header with the lines `more`, which may include the blank line at its end. */
static void append_header(bytes *b, trip_scalar type, bool big, const char *encoding,
                          const char *more)
{
    char text[1024];
    snprintf(text, sizeof text,
             "NRRD0004\n# a comment\ntype: %s\ndimension: 3\nsizes: %d %d %d\nendian: %s\n"
             "encoding: %s\n%s",
             nrrd_types[type], NX, NY, NZ, big ? "big" : "little", encoding, more);
    append_text(b, text);
}

/* Writes the given header and the sample as plain uint16 values behind it. */
static const char *write_with_header(const char *name, const char *header)
{
    bytes b = { .count = 0 };
    append_text(&b, header);
    append_volume(&b, TRIP_U16, false);
    return write_file(name, &b);
}

static const char *write_with_lines(const char *name, const char *more)
{
    bytes b = { .count = 0 };
    append_header(&b, TRIP_U16, false, "raw", more);
    append_text(&b, "\n");
    append_volume(&b, TRIP_U16, false);
    return write_file(name, &b);
}

static trip_volume_info info_of(const char *path)
{
    float values[VOXELS];
    trip_volume_info info;
    assert_int_equal(read_volume(path, NULL, 3, values, VOXELS, &info), 0);
    return info;
}

static trip_affine map_of(const char *path)
{
    return info_of(path).index_to_world;
}

static void every_type_is_read_in_both_byte_orders(void **state)
{
    (void)state;
    for (int t = 0; t < TRIP_SCALARS; t++)
        for (int big = 0; big < 2 && nrrd_types[t]; big++) {
            bytes b = { .count = 0 };
            append_header(&b, (trip_scalar)t, big, "raw", "\n");
            append_volume(&b, (trip_scalar)t, big);
            assert_holds_sample(write_file("type.nrrd", &b), NULL, (trip_scalar)t);
        }
}

static void compressed_values_are_read(void **state)
{
    (void)state;
    static const char *const names[] = { "gzip", "gz", "bzip2", "bz2" };
    for (int n = 0; n < 4; n++) {
        bytes values = { .count = 0 }, b = { .count = 0 };
        append_volume(&values, TRIP_I32, true);
        append_header(&b, TRIP_I32, true, names[n], "\n");
        if (n < 2)
            append_gzip(&b, &values);
        else
            append_bzip2(&b, &values);
        assert_holds_sample(write_file("compressed.nrrd", &b), NULL, TRIP_I32);
    }
}

static void lines_may_end_in_carriage_returns(void **state)
{
    (void)state;
    assert_holds_sample(
        write_with_header("crlf.nrrd", "NRRD0001\r\ntype: ushort\r\ndimension: 3\r\n"
                                       "sizes: 5 4 7\r\nendian: little\r\nencoding: raw\r\n\r\n"),
        NULL, TRIP_U16);
}

static void fields_may_have_any_order_and_keys_are_skipped(void **state)
{
    (void)state;
    assert_holds_sample(
        write_with_header("order.nrrd",
                          "NRRD0005\nencoding: raw\nendian: little\nmy key:=sizes: 1\n"
                          "content: a: b: c\nsizes: 5 4 7\ncenterings: cell cell cell\n"
                          "units: \"mm\" \"mm\" \"mm\"\ntype: uint16\ndimension: 3\n\n"),
        NULL, TRIP_U16);
}

static void a_detached_header_finds_data_in_its_folder(void **state)
{
    (void)state;
    static const char *const names[] = { "data file: detached.raw", "datafile: ./detached.raw" };
    bytes values = { .count = 0 };
    append_volume(&values, TRIP_I16, true);
    write_file("detached.raw", &values);
    for (int n = 0; n < 2; n++) {
        bytes b = { .count = 0 };
        append_header(&b, TRIP_I16, true, "raw", names[n]); /* the end of the file ends the line */
        assert_holds_sample(write_file("detached.nhdr", &b), NULL, TRIP_I16);
    }
}

static void detached_data_may_be_compressed(void **state)
{
    (void)state;
    bytes values = { .count = 0 }, gz = { .count = 0 }, b = { .count = 0 };
    append_volume(&values, TRIP_F32, false);
    append_gzip(&gz, &values);
    write_file("detached.raw.gz", &gz);
    append_header(&b, TRIP_F32, false, "gzip", "data file: detached.raw.gz\n");
    assert_holds_sample(write_file("gz.nhdr", &b), NULL, TRIP_F32);
}

/* Writes the sample as `count` files of equal length. */
static void write_parts(const char *stem, int width, int first, int step, int count, bool gzip)
{
    bytes all = { .count = 0 };
    append_volume(&all, TRIP_U16, false);
    for (int n = 0; n < count; n++) {
        bytes part = { .count = 0 }, gz = { .count = 0 };
        char name[64];
        append(&part, all.data + (size_t)n * all.count / (size_t)count, all.count / (size_t)count);
        append_gzip(&gz, &part);
        snprintf(name, sizeof name, "%s%0*d", stem, width, first + n * step);
        write_file(name, gzip ? &gz : &part);
    }
}

static void many_data_files_are_concatenated(void **state)
{
    (void)state;
    bytes b = { .count = 0 };
    write_parts("list", 1, 0, 1, NZ, false);
    append_header(&b, TRIP_U16, false, "raw",
                  "data file: LIST\nlist0\nlist1\nlist2\nlist3\nlist4\n"
                  "list5\nlist6\n");
    assert_holds_sample(write_file("list.nhdr", &b), NULL, TRIP_U16);

    b.count = 0;
    write_parts("two", 1, 0, 1, 2, false);
    append_header(&b, TRIP_U16, false, "raw", "data file: LIST 3\ntwo0\ntwo1");
    assert_holds_sample(write_file("two.nhdr", &b), NULL, TRIP_U16);
}

static void many_data_files_must_exist_and_can_be_read_again(void **state)
{
    (void)state;
    bytes b = { .count = 0 };
    trip_budget *budget;
    trip_volume *v;
    write_parts("again", 1, 0, 1, NZ, false);
    append_header(&b, TRIP_U16, false, "raw", "data file: again%d 0 6 1\n");
    const char *path = write_file("again.nhdr", &b);
    assert_int_equal(trip_budget_create(&budget, 1 << 20), 0);
    assert_int_equal(trip_volume_open(&v, path, NULL, budget), 0);
    for (int round = 0; round < 2; round++) {
        float values[VOXELS];
        trip_volume_portion portion;
        assert_int_equal(trip_volume_next(v, NZ, &portion), 1);
        assert_int_equal(
            trip_portion_decode(v, &portion, portion.origin, portion.size, values, NULL), 0);
        for (int i = 0; i < VOXELS; i++)
            assert_true(values[i] == (float)sample(TRIP_U16, i % NX, i / NX % NY, i / NX / NY));
        trip_portion_release(v, &portion);
        assert_int_equal(trip_volume_rewind(v), 0);
    }
    trip_volume_close(v);
    assert_int_equal(remove(path_of("again4")), 0);
    catch_reports();
    assert_int_equal(trip_volume_open(&v, path, NULL, budget), TRIP_ERROR);
    trip_report_redirect(NULL, NULL);
    assert_non_null(strstr(reported, "again4: cannot open"));
    trip_budget_destroy(budget);
}

static void a_pattern_numbers_its_files(void **state)
{
    (void)state;
    bytes b = { .count = 0 };
    write_parts("up", 3, 2, 3, NZ, false);
    append_header(&b, TRIP_U16, false, "raw", "data file: up%03d 2 20 3\n");
    assert_holds_sample(write_file("up.nhdr", &b), NULL, TRIP_U16);

    b.count = 0;
    write_parts("down", 1, 6, -1, NZ, true);
    append_header(&b, TRIP_U16, false, "gzip", "data file: down%d 6 0 -1 2\n");
    assert_holds_sample(write_file("down.nhdr", &b), NULL, TRIP_U16);
}

static void lines_and_bytes_are_skipped(void **state)
{
    (void)state;
    bytes data = { .count = 0 }, values = { .count = 0 }, gz = { .count = 0 }, b = { .count = 0 };
    append_text(&data, "one line\nanother\n12345");
    append_volume(&data, TRIP_U16, false);
    write_file("skip.raw", &data);
    append_header(&b, TRIP_U16, false, "raw", "line skip: 2\nbyte skip: 5\ndata file: skip.raw\n");
    assert_holds_sample(write_file("skip.nhdr", &b), NULL, TRIP_U16);

    append_text(&values, "54321");
    append_volume(&values, TRIP_U16, false);
    append_text(&gz, "a line before gzip begins\n");
    append_gzip(&gz, &values);
    write_file("skip.gz", &gz);
    b.count = 0;
    append_header(&b, TRIP_U16, false, "gzip", "lineskip: 1\nbyteskip: 5\ndata file: skip.gz\n");
    assert_holds_sample(write_file("skipgz.nhdr", &b), NULL, TRIP_U16);
}

/* Tries files without an end, pipes without a writer, and long files without lines. */
static void the_search_for_lines_ends(void **state)
{
    (void)state;
    bytes b = { .count = 0 };
    append_header(&b, TRIP_U16, false, "raw", "line skip: 1\ndata file: /dev/zero\n");
    assert_refused(write_file("endless.nhdr", &b), "not a regular file");
    b.count = 0;
    append_header(&b, TRIP_U16, false, "raw", "line skip: 1\ndata file: lines.fifo\n");
    assert_int_equal(mkfifo(path_of("lines.fifo"), 0666), 0);
    assert_refused(write_file("pipe.nhdr", &b), "not a regular file");
    b.count = 0;
    append_header(&b, TRIP_U16, false, "raw", "line skip: 1\ndata file: lines.raw\n");
    write_bytes("lines.raw", "no line", 7);
    assert_refused(write_file("lines.nhdr", &b), "lines to skip");
    assert_interrupted(path_of("lines.nhdr"), NULL);
}

static void a_byte_skip_of_minus_one_reads_the_end_of_the_file(void **state)
{
    (void)state;
    bytes data = { .count = 0 }, b = { .count = 0 };
    append_text(&data, "a header of unknown length");
    append_volume(&data, TRIP_U16, false);
    write_file("tail.raw", &data);
    append_header(&b, TRIP_U16, false, "raw", "byte skip: -1\ndata file: tail.raw\n");
    assert_holds_sample(write_file("tail.nhdr", &b), NULL, TRIP_U16);
}

/* The error line suggests --spacing only if --spacing supplies the missing lengths. */
static void invalid_lengths_can_be_replaced_by_spacing(void **state)
{
    (void)state;
    static const struct {
        const char *line;
        double x;
    } none[] = { { "spacings: 0 0 0\n", 2 },
                 { "spacings: inf 1 nan\n", 2 },
                 { "space directions: (0,0,0) (0,5,0) (0,0,nan)\n", 2 },
                 { "space: LAS\nspace directions: (inf,0,0) (0,5,0) (0,0,1)\n", -2 } };
    const trip_volume_params p = { .spacing = { 2, 3, 4 } };
    for (size_t i = 0; i < sizeof none / sizeof none[0]; i++) {
        float values[VOXELS];
        trip_volume_info info = { .type = TRIP_U8 };
        const char *path = write_with_lines("none.nrrd", none[i].line);
        assert_refused(path, ": set other lengths with --spacing X,Y,Z");
        assert_int_equal(read_volume(path, &p, 3, values, VOXELS, &info), 0);
        assert_map(&info.index_to_world,
                   (const double[3][4]){ { none[i].x, 0, 0, 0 }, { 0, 3, 0, 0 }, { 0, 0, 4, 0 } });
    }
    static const char *const others[] = { "space directions: (0,0,0) (0,0,5) (0,5,0)\n",
                                          "space directions: (1,0,0) (2,0,0) (0,0,1)\n",
                                          "space origin: (nan,0,0)\n" };
    for (size_t i = 0; i < sizeof others / sizeof others[0]; i++) {
        const char *path = write_with_lines("other.nrrd", others[i]);
        assert_refused(path, "not finite\n");
        assert_refused_as(TRIP_ERROR, path, &p, "not finite\n");
    }
}

/* If the file is cut off, neither the header nor lines to skip are read as values. */
static void a_byte_skip_of_minus_one_never_reads_the_header(void **state)
{
    (void)state;
    bytes b = { .count = 0 };
    append_header(&b, TRIP_U16, false, "raw", "byte skip: -1\n\n");
    const size_t header = b.count;
    append_volume(&b, TRIP_U16, false);
    assert_holds_sample(write_file("whole.nrrd", &b), NULL, TRIP_U16);
    assert_refused(write_bytes("cut.nrrd", b.data, b.count - 1), "are expected");
    assert_refused(write_bytes("cut.nrrd", b.data, header), "are expected");
    b.count = 0;
    append_text(&b, "a line\n");
    append_volume(&b, TRIP_U16, false);
    write_bytes("lines.raw", b.data, b.count - 1);
    b.count = 0;
    append_header(&b, TRIP_U16, false, "raw",
                  "line skip: 1\nbyte skip: -1\ndata file: lines.raw\n");
    assert_refused(write_file("lines.nhdr", &b), "are expected");
}

static void spacings_and_directions_become_the_map(void **state)
{
    (void)state;
    trip_affine a = map_of(write_with_lines("spacings.nrrd", "spacings: 0.5 nan 3e0\n"));
    assert_map(&a, (const double[3][4]){ { 0.5, 0, 0, 0 }, { 0, 1, 0, 0 }, { 0, 0, 3, 0 } });
    a = map_of(write_with_lines("directions.nrrd",
                                "space: left-posterior-superior\n"
                                "space directions: (1,0.25,0) ( 0 , 2 , 0.5 )  (-0.5,0,3)\n"
                                "space origin: (-10, 20, 1e1)\n"));
    assert_map(&a, (const double[3][4]){ /* in RAS, x and y are negated */
                                         { -1, 0, 0.5, 10 },
                                         { -0.25, -2, 0, -20 },
                                         { 0, 0.5, 3, 10 } });
    a = map_of(write_with_lines("extent.nrrd", "axis mins: 1 -3 nan\naxis maxs: 11 3 nan\n"
                                               "centers: cell node cell\n"));
    assert_map(&a, (const double[3][4]){ { 2, 0, 0, 2 }, { 0, 2, 0, -3 }, { 0, 0, 1, 0 } });
    a = map_of(write_with_lines("neither.nrrd", ""));
    assert_map(&a, (const double[3][4]){ { 1, 0, 0, 0 }, { 0, 1, 0, 0 }, { 0, 0, 1, 0 } });
}

static void axes_of_size_one_are_dropped(void **state)
{
    (void)state;
    const char *path = write_with_header(
        "leading.nrrd", "NRRD0004\ntype: uint16\ndimension: 4\nsizes: 1 5 4 7\nendian: little\n"
                        "encoding: raw\nkinds: vector domain domain domain\nspace dimension: 3\n"
                        "space directions: none (1,0,0) (0,2,0) (0,0,3)\n\n");
    assert_holds_sample(path, NULL, TRIP_U16);
    trip_affine a = map_of(path);
    assert_map(&a, (const double[3][4]){ { 1, 0, 0, 0 }, { 0, 2, 0, 0 }, { 0, 0, 3, 0 } });
    path = write_with_header("trailing.nrrd",
                             "NRRD0004\ntype: uint16\ndimension: 5\nsizes: 5 4 7 1 1\n"
                             "endian: little\nencoding: raw\nspacings: 4 5 6 nan nan\n\n");
    assert_holds_sample(path, NULL, TRIP_U16);
    a = map_of(path);
    assert_map(&a, (const double[3][4]){ { 4, 0, 0, 0 }, { 0, 5, 0, 0 }, { 0, 0, 6, 0 } });
}

static void data_without_three_axes_in_space_are_refused(void **state)
{
    (void)state;
    assert_refused(write_with_lines("vector.nrrd", "kinds: 3-vector domain domain\n"),
                   "axis 0 is of kind \"3-vector\"");
    assert_refused(write_with_lines("none.nrrd", "space directions: none (1,0,0) (0,1,0)\n"),
                   "axis 0 has no direction");
    assert_refused(write_with_header("flat.nrrd", "NRRD0004\ntype: uint8\ndimension: 2\n"
                                                  "sizes: 5 4\nencoding: raw\n\n"),
                   "a volume has three");
    assert_refused(write_with_header("block.nrrd", "NRRD0004\ntype: block\nblock size: 3\n"
                                                   "dimension: 3\nsizes: 5 4 7\nencoding: raw\n\n"),
                   "line 2: type \"block\"");
    assert_refused(write_with_header("six.nrrd", "NRRD0004\ntype: uint16\ndimension: 6\n"
                                                 "sizes: 2 2 2 5 4 7\nendian: little\n"
                                                 "encoding: raw\nkinds: vector list time domain "
                                                 "domain domain\n\n"),
                   "axes 0 and 1 both have several entries");
}

static void values_may_be_text(void **state)
{
    (void)state;
    static const char *const names[] = { "ascii", "text", "txt", "hex" };
    for (int t = 0; t < TRIP_SCALARS; t++)
        for (int n = 0; n < 8 && nrrd_types[t]; n++) {
            const bool detached = n % 2, hex = n >= 6, big = n == 7;
            char number[32];
            bytes b = { .count = 0 }, values = { .count = 0 }, text = { .count = 0 };
            append_header(&b, (trip_scalar)t, big, names[n / 2],
                          detached ? "data file: values.txt\n" : "\n");
            append_volume(&values, (trip_scalar)t, big);
            for (size_t i = 0; i < (hex ? values.count : VOXELS); i++) {
                const int v =
                    sample((trip_scalar)t, (int)i % NX, (int)i / NX % NY, (int)i / NX / NY);
                snprintf(number, sizeof number, hex ? "%02x%s" : "%d%s", hex ? values.data[i] : v,
                         i % 7 == 6 ? "\n"
                         : hex      ? ""
                                    : " ");
                append_text(&text, number);
            }
            if (detached)
                write_file("values.txt", &text);
            else
                append(&b, text.data, text.count);
            assert_holds_sample(write_file(detached ? "text.nhdr" : "text.nrrd", &b), NULL,
                                (trip_scalar)t);
        }
}

static void endian_is_not_needed_for_numbers_in_a_text(void **state)
{
    (void)state;
    float values[8];
    static const char text[] = "NRRD0004\ntype: float\ndimension: 3\nsizes: 2 2 2\n"
                               "encoding: ascii\n\n1 2.5 -3e2 nan inf -inf .5 1e-3\n";
    assert_int_equal(
        read_volume(write_bytes("float.nrrd", text, sizeof text - 1), NULL, 1, values, 8, NULL), 0);
    assert_true(values[0] == 1 && values[1] == 2.5 && values[2] == -300 && isnan(values[3]));
    assert_true(isinf(values[4]) && isinf(values[5]) && values[5] < 0);
    assert_true(values[6] == 0.5F && values[7] == 1e-3F);
}

/* Axes beside the three axes of the volume. */
typedef struct more_axes {
    const char *sizes, *kinds;
    int place[2]; /* of the channel and the time: the number of axes of the volume before them; -1
                   */
} more_axes;

/* Appends every voxel of every channel and time. The sample is in channel 1 of 3 and time 2 of 4.
 * All other values are 99. */
static void append_entries(bytes *b, const more_axes *m)
{
    enum { C = 3, T = 4 };
    const int dims[3] = { NX, NY, NZ };
    int size[5], role[5], axes = 0; /* role: axis of the volume, 3 for channels, 4 for times */
    for (int before = 0; before <= 3; before++) {
        for (int r = 0; r < 2; r++)
            if (m->place[r] == before) {
                role[axes] = 3 + r;
                size[axes++] = r ? T : C;
            }
        if (before < 3) {
            role[axes] = before;
            size[axes++] = dims[before];
        }
    }
    int at[5] = { 0 }, total = 1;
    for (int a = 0; a < axes; a++)
        total *= size[a];
    for (int n = 0; n < total; n++) {
        int of_role[5] = { 0, 0, 0, 1, 2 };
        for (int a = 0, rest = n; a < axes; rest /= size[a++])
            of_role[role[a]] = at[a] = rest % size[a];
        const bool wanted = of_role[3] == 1 && of_role[4] == 2;
        append_value(b, TRIP_I16,
                     wanted ? sample(TRIP_I16, of_role[0], of_role[1], of_role[2]) : 99, false);
    }
}

static void an_entry_of_further_axes_is_read(void **state)
{
    (void)state;
    static const more_axes some[] = {
        { "3 5 4 7", "vector domain domain domain", { 0, -1 } },
        { "5 3 4 7", "domain covariant-vector domain domain", { 1, -1 } },
        { "5 4 3 7", "space space list space", { 2, -1 } },
        { "5 4 7 3", "domain domain domain list", { 3, -1 } },
        { "5 4 7 4", "domain domain domain time", { -1, 3 } },
        { "4 5 4 7", "time domain domain domain", { -1, 0 } },
        { "3 5 4 7 4", "3-vector domain domain domain time", { 0, 3 } },
        { "3 4 5 4 7", "list time domain domain domain", { 0, 0 } },
        { "5 3 4 4 7", "domain list domain time domain", { 1, 2 } },
        { "5 4 7 3 4", "domain domain domain RGB-color time", { 3, 3 } },
        { "5 4 7 3", NULL, { 3, -1 } },
        { "1 5 4 7 3", "vector domain domain domain list", { 3, -1 } },
    };
    for (size_t n = 0; n < sizeof some / sizeof *some; n++) {
        const more_axes *m = &some[n];
        const bool channels = m->place[0] >= 0, times = m->place[1] >= 0;
        const trip_volume_params params = { .channel = channels, .time = times ? 2 : 0 };
        char header[512], note[128];
        bytes b = { .count = 0 };
        snprintf(header, sizeof header,
                 "NRRD0004\ntype: int16\ndimension: %d\nsizes: %s\nendian: little\n"
                 "encoding: raw\n%s%s\n\n",
                 (int)(strlen(m->sizes) + 1) / 2, m->sizes, m->kinds ? "kinds: " : "# no kinds",
                 m->kinds ? m->kinds : "");
        append_text(&b, header);
        append_entries(&b, m);
        const char *path = write_file("more.nrrd", &b);
        float values[VOXELS];
        trip_volume_info info;
        assert_holds_sample(path, &params, TRIP_I16);
        assert_int_equal(read_volume(path, &params, 3, values, VOXELS, &info), 0);
        if (channels)
            assert_non_null(strstr(info.note, "channel 1 of 3 (axis"));
        if (times)
            assert_non_null(strstr(info.note, "time 2 of 4 (axis"));
        assert_int_equal(read_volume(path, NULL, 3, values, VOXELS, &info), 0);
        assert_true(values[0] == 99 && values[VOXELS - 1] == 99);
        snprintf(note, sizeof note, "has %s", channels ? "3 channels, from 0 to 2" : "one channel");
        assert_refused_as(TRIP_USAGE, path, &(trip_volume_params){ .channel = 3 }, note);
        snprintf(note, sizeof note, "has %s", times ? "4 times, from 0 to 3" : "one time");
        assert_refused_as(TRIP_USAGE, path, &(trip_volume_params){ .time = 4 }, note);
        b.count--;
        assert_refused(write_file("more.nrrd", &b), "is it truncated?");
    }
}

static void an_entry_may_lie_in_another_data_file(void **state)
{
    (void)state;
    bytes b = { .count = 0 };
    append_header(&b, TRIP_U16, false, "raw",
                  "data file: entry-%d.raw 0 2 1\nkinds: domain domain domain list\n");
    memcpy(strstr((char *)b.data, "dimension: 3"), "dimension: 4", 12);
    char *sizes = strstr((char *)b.data, "5 4 7\n");
    memmove(sizes + 7, sizes + 5, b.count - (size_t)(sizes + 5 - (char *)b.data));
    memcpy(sizes, "5 4 7 3", 7);
    b.count += 2;
    const char *path = write_file("entries.nhdr", &b);
    for (int n = 0; n < 3; n++) {
        char name[32];
        bytes values = { .count = 0 };
        for (int v = 0; v < VOXELS && n != 1; v++)
            append_value(&values, TRIP_U16, n, false);
        if (n == 1)
            append_volume(&values, TRIP_U16, false);
        snprintf(name, sizeof name, "entry-%d.raw", n);
        write_file(name, &values);
    }
    assert_holds_sample(path, &(trip_volume_params){ .channel = 1 }, TRIP_U16);
}

static void colours_become_their_luma(void **state)
{
    (void)state;
    for (int colours = 3; colours <= 4; colours++) {
        char header[256];
        bytes b = { .count = 0 };
        float values[VOXELS];
        trip_volume_info info;
        snprintf(header, sizeof header,
                 "NRRD0004\ntype: uint16\ndimension: 4\nsizes: %d 5 4 7\nendian: big\n"
                 "encoding: raw\nkinds: %s domain domain domain\n\n",
                 colours, colours == 3 ? "RGB-color" : "RGBA-color");
        append_text(&b, header);
        for (int v = 0; v < VOXELS; v++)
            for (int c = 0; c < colours; c++)
                append_value(&b, TRIP_U16, 300 * c + v, true);
        const char *path = write_file("colour.nrrd", &b);
        assert_int_equal(read_volume(path, NULL, 2, values, VOXELS, &info), 0);
        assert_int_equal(info.type, TRIP_F32);
        assert_non_null(strstr(info.note, "luma"));
        for (int v = 0; v < VOXELS; v++) /* 0.7152 * 300 + 0.0722 * 600 */
            assert_true(fabs(values[v] - (v + 257.88)) < 1e-3);
        assert_refused_as(TRIP_USAGE, path, &(trip_volume_params){ .channel = 1 }, "one channel");
    }
}

static void a_locale_with_decimal_commas_changes_nothing(void **state)
{
    (void)state;
    const char *spacings = write_with_lines("commas.nrrd", "spacings: 0.5 NaN 3e0\n");
    const char *directions =
        write_with_lines("vectors.nrrd", "space: RAS\n"
                                         "space directions: (0.5,0,0) ( 0 , 2.25, 0) (0,0,-1.5)\n"
                                         "space origin: (-0.75,0,0)\n");
    const char *uneven = write_with_lines("places.nrrd", "coordinates 0:=0.5 2.5 4.5 6.5 8.5\n");
    need_comma_locale();
    const trip_affine a = map_of(spacings), b = map_of(directions), c = map_of(uneven);
    setlocale(LC_ALL, "C");
    assert_map(&a, (const double[3][4]){ { 0.5, 0, 0, 0 }, { 0, 1, 0, 0 }, { 0, 0, 3, 0 } });
    assert_map(&b,
               (const double[3][4]){ { 0.5, 0, 0, -0.75 }, { 0, 2.25, 0, 0 }, { 0, 0, -1.5, 0 } });
    assert_map(&c, (const double[3][4]){ { 2, 0, 0, 0.5 }, { 0, 1, 0, 0 }, { 0, 0, 1, 0 } });
}

static void wrong_fields_are_refused_with_line_number(void **state)
{
    (void)state;
    static const struct {
        const char *line, *report;
    } wrong[] = {
        { "spacings: 1 2\n", "line 8: \"spacings\" must be 3" },
        { "spacings: 1 2 x\n", "line 8: \"spacings\" must be 3" },
        { "spacings: 0x1 1 1\n", "line 8: \"spacings\" must be 3" },
        { "spacings: 1,5 1 1\n", "line 8: \"spacings\" must be 3" },
        { "spacings: 0 1 1\n", "singular" },
        { "spacings: inf 1 1\n", "singular or not finite" },
        { "axis mins: 1 2\n", "line 8: \"axis mins\" must be 3" },
        { "axis mins: 1 1 1\naxis maxs: 1 2 2\n", "singular" },
        { "space directions: (1,0,0) (0,1,0)\n", "line 8: \"space directions\"" },
        { "space directions: (1,0) (0,1,0) (0,0,1)\n", "line 8: \"space directions\"" },
        { "space directions: (1,0,0 (0,1,0) (0,0,1)\n", "line 8: \"space directions\"" },
        { "space directions: (1,0,0, (0,1,0) (0,0,1)\n", "line 8: \"space directions\"" },
        { "space directions: (1,0,0) (0,1,0) (0,0,1\n", "line 8: \"space directions\"" },
        { "space directions: (1,0,0) (2,0,0) (0,0,1)\n", "singular" },
        { "space directions: (nan,0,0) (0,1,0) (0,0,1)\n", "singular or not finite" },
        { "space origin: (1,2)\n", "line 8: \"space origin\"" },
        { "space origin: (1,2,3\n", "line 8: \"space origin\"" },
        { "space origin: (1,2,3) 4\n", "line 8: \"space origin\"" },
        { "sizes: 5 4 7\n", "line 8: \"sizes\" is given twice" },
        { "line skip: -1\n", "line 8: \"line skip\"" },
        { "line skip: 1000\n", "lines to skip" },
        { "byte skip: -2\n", "line 8: \"byte skip\"" },
        { "byte skip: 1\n", "are expected" },
        { "byte skip: 9223372036854775807\n", "beyond its end" },
        { "no colon\n", "line 8: \"no colon\" is neither" },
        { "data file:\n", "line 8: \"data file\" is empty" },
        { "data file: nowhere.raw\n", "nowhere.raw: cannot open: No such file" },
        { "data file: %n%n 1 7 1\n", "line 8: \"data file\" with a %" },
        { "data file: %d%s 1 7 1\n", "line 8: \"data file\" with a %" },
        { "data file: %99d 1 7 1\n", "line 8: \"data file\" with a %" },
        { "data file: a%d 1 7 0\n", "line 8: \"data file\" with a %" },
        { "data file: a%d 1 7\n", "line 8: \"data file\" with a %" },
        { "data file: a%d -9223372036854775808 1 1\n", "line 8: \"data file\" with a %" },
        { "data file: a%d 7 1 1\n", "names no file: check first, last and step" },
        { "data file: a%d 1 9 1\n", "cannot be divided equally among 9" },
        { "data file: a%d 1 2000000000 1\n", "more than 65536 data files" },
        { "data file: LIST\n", "line 8: the list of data files is empty" },
    };
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
        bytes b = { .count = 0 };
        append_header(&b, TRIP_U16, false, "raw", wrong[i].line);
        if (!strstr(wrong[i].line, "LIST")) {
            append_text(&b, "\n");
            append_volume(&b, TRIP_U16, false);
        }
        assert_refused(write_file("wrong.nrrd", &b), wrong[i].report);
    }
}

static void wrong_headers_are_refused(void **state)
{
    (void)state;
    static const struct {
        const char *header, *report;
    } wrong[] = {
        { "NRRD0009\n\n", "version 1 to 5" },
        { "NRRD00041\n\n", "version 1 to 5" },
        { "NRRD0004\n\n", "no \"dimension\"" },
        { "NRRD0004\ndimension: 3\n\n", "no \"sizes\"" },
        { "NRRD0004\ndimension: 99\nsizes: 1\n\n", "line 2: \"dimension\"" },
        { "NRRD0004\ndimension: 3\nsizes: 5 4\n\n", "line 3: \"sizes\"" },
        { "NRRD0004\ndimension: 3\nsizes: 5 4 7 2\n\n", "line 3: \"sizes\" has more" },
        { "NRRD0004\ndimension: 3\nsizes: 5 -4 7\n\n", "line 3: \"sizes\"" },
        { "NRRD0004\ndimension: 3\nsizes: 5 4 0\n\n", "line 3: \"sizes\"" },
        { "NRRD0004\ndimension: 3\nsizes: 5 4 7\n\n", "no \"type\"" },
        { "NRRD0004\ndimension: 3\nsizes: 5 4 7\ntype: string\n\n", "line 4: type \"string\"" },
        { "NRRD0004\ndimension: 3\nsizes: 5 4 7\ntype: short\nencoding: raw\n\n", "no \"endian\"" },
        { "NRRD0004\ndimension: 3\nsizes: 5 4 7\ntype: short\nendian: middle\nencoding: raw\n\n",
          "line 5" },
        { "NRRD0004\ndimension: 3\nsizes: 5 4 7\ntype: uchar\n\n", "no \"encoding\"" },
        { "NRRD0004\ndimension: 3\nsizes: 5 4 7\ntype: uchar\nencoding: base64\n\n",
          "line 5: encoding \"base64\" is unknown" },
        { "NRRD0004\ndimension: 3\nsizes: 5 4 7\ntype: uchar\nencoding: gzip\nbyte skip: -1\n\n",
          "cannot be used with compressed data" },
        { "NRRD0004\ndimension: 3\nsizes: 9999999999 9999999999 9999999999\ntype: uchar\n"
          "encoding: raw\n\n",
          "impossibly large" },
        { "NRRD0004\ndimension: 3\nsizes: 99999999999999999999 1 1\ntype: uchar\nencoding: raw\n\n",
          "are expected" },
        { "NRRD0004\ndimension: 3\nsizes: 4000000000 1000000000 1\ntype: double\nendian: big\n"
          "encoding: raw\n\n",
          "impossible size" },
    };
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++)
        assert_refused(write_with_header("wrong.nrrd", wrong[i].header), wrong[i].report);
}

static void an_unknown_field_causes_a_warning(void **state)
{
    (void)state;
    float values[VOXELS];
    const char *path = write_with_lines("unknown.nrrd", "spacing: 1 1 2\n");
    catch_reports();
    assert_int_equal(read_volume(path, NULL, 2, values, VOXELS, NULL), 0);
    trip_report_redirect(NULL, NULL);
    assert_int_equal(reports, 1);
    assert_non_null(strstr(reported, "line 8: unknown field \"spacing\""));
}

/* Expects the sum and the single values that NumPy reads. */
static void the_included_tooth_has_the_values_of_numpy(void **state)
{
    (void)state;
    const size_t count = 103 * 94 * 161;
    float *values = malloc(count * sizeof *values);
    trip_volume_info info;
    double sum = 0;
    assert_non_null(values);
    assert_int_equal(
        read_volume(TRIP_SOURCE_DIR "/datasets/tooth.nhdr", NULL, 10, values, count, &info), 0);
    assert_int_equal(info.type, TRIP_U16);
    for (size_t i = 0; i < count; i++)
        sum += (double)values[i];
    assert_true(sum == 821287590);
    assert_true(values[(80 * 94 + 40) * 103 + 50] == 832);
    assert_true(values[(100 * 94 + 50) * 103 + 30] == 706);
    assert_true(values[1] == 389);
    assert_true(values[count - 1] == 379);
    free(values);
}

static void a_header_without_end_is_refused(void **state)
{
    (void)state;
    size_t count = 2 << 20;
    char *text = malloc(count);
    assert_non_null(text);
    memset(text, '#', count);
    memcpy(text, "NRRD0004\n", 9);
    assert_refused(write_bytes("endless.nrrd", text, count), "does not end within");
    free(text);
}

static void a_file_truncated_anywhere_is_refused(void **state)
{
    (void)state;
    for (int compressed = 0; compressed < 2; compressed++) {
        bytes values = { .count = 0 }, b = { .count = 0 };
        append_volume(&values, TRIP_U16, false);
        append_header(&b, TRIP_U16, false, compressed ? "gzip" : "raw", "spacings: 1 2 3\n\n");
        if (compressed)
            append_gzip(&b, &values);
        else
            append(&b, values.data, values.count);
        for (size_t length = 0; length < b.count; length++)
            assert_true(survives(write_bytes("cut.nrrd", b.data, length), NULL));
    }
}

static void a_wrong_byte_of_the_header_does_no_harm(void **state)
{
    (void)state;
    bytes b = { .count = 0 };
    append_header(&b, TRIP_U16, false, "raw", "space directions: (1,0,0) (0,1,0) (0,0,1)\n");
    append_text(&b, "data file: x%d 1 7 1\n");
    static const unsigned char other[] = { 0, '\n', ':', '9', '%', '(', 0xff };
    for (size_t at = 0; at < b.count; at++)
        for (size_t o = 0; o < sizeof other; o++) {
            bytes changed = b;
            changed.data[at] = other[o];
            survives(write_file("changed.nrrd", &changed), NULL);
        }
}

/* Tries all spellings that the format lists. */
static void the_space_gives_the_orientation(void **state)
{
    (void)state;
    static const char *const lines[][5] = {
        { "RAS", "space: right-anterior-superior\n", "space: RAS\n",
          "space: rightanteriorsuperior\n", "space: Right Anterior Superior\n" },
        { "RAS", "space: left-posterior-superior\n", "space: lps\n",
          "space: left posterior superior\n", "space: LEFTPOSTERIORSUPERIOR\n" },
        { "", "space: scanner-xyz\n", "space: 3D-right-handed\n", "space: 3d right handed\n",
          "space: 3Drighthanded\n" },
        { "", "", "spacings: 1 1 5\n", "space dimension: 3\n", "axis mins: 1 2 3\n" },
    };
    for (int row = 0; row < 4; row++)
        for (int i = 1; i < 5; i++) {
            catch_reports();
            trip_volume_info info = info_of(write_with_lines("space.nrrd", lines[row][i]));
            trip_report_redirect(NULL, NULL);
            assert_int_equal(reports, 0);
            assert_string_equal(info.space, lines[row][0]);
            assert_int_equal(info.oriented, row < 3);
        }
    trip_volume_info info =
        info_of(write_with_lines("axes.nrrd", "space directions: (1,0,0) (0,1,0) (0,0,5)\n"));
    assert_string_equal(info.space, "");
    assert_true(info.oriented);
}

static void an_unknown_space_causes_a_warning(void **state)
{
    (void)state;
    static const char *const names[] = { "left-of-here",
                                         "RASX",
                                         "",
                                         "ra",
                                         "times",
                                         "right-anterior-superior-right-anterior-superior-right-"
                                         "anterior-superior" };
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        char line[200];
        snprintf(line, sizeof line, "space: %s\n", names[i]);
        catch_reports();
        trip_volume_info info = info_of(write_with_lines("space.nrrd", line));
        trip_report_redirect(NULL, NULL);
        assert_int_equal(reports, 1);
        assert_non_null(strstr(reported, "space.nrrd: line 8: unknown space"));
        assert_string_equal(info.space, "");
        assert_false(info.oriented);
    }
}

static void left_handed_spaces_are_turned_right_handed(void **state)
{
    (void)state;
    static const char *const names[] = { "left-anterior-superior", "LAS", "3D-left-handed" };
    for (int i = 0; i < 3; i++) {
        char lines[200];
        snprintf(lines, sizeof lines,
                 "space: %s\nspace directions: (1,2,3) (-4,1,0) (0,0.5,2)\n"
                 "space origin: (10,20,30)\n",
                 names[i]);
        trip_volume_info info = info_of(write_with_lines("left.nrrd", lines));
        assert_string_equal(info.space, i < 2 ? "RAS" : "");
        assert_map(&info.index_to_world,
                   (const double[3][4]){ { -1, 4, 0, -10 }, { 2, 1, 0.5, 20 }, { 3, 0, 2, 30 } });
    }
    const trip_affine map = map_of(write_with_lines(
        "left.nrrd", "space: LAS\ncoordinates 0:=1 2 3 4 9\ncoordinates 1:=1 2 3 5\n"));
    assert_map(&map,
               (const double[3][4]){ { -2, 0, 0, -1 }, { 0, 4 / 3.0, 0, 1 }, { 0, 0, 1, 0 } });
}

static void vectors_with_time_give_their_spatial_part(void **state)
{
    (void)state;
    static const char *const names[] = { "right-anterior-superior-time", "RAST",
                                         "left-posterior-superior-time", "lpst" };
    for (int i = 0; i < 4; i++) {
        char text[400];
        snprintf(text, sizeof text,
                 "NRRD0004\ntype: uint16\ndimension: 4\nsizes: 5 4 7 1\nendian: little\n"
                 "encoding: raw\nspace: %s\n"
                 "space directions: (1,0,0,0) (0,2,0,0) (0,0,3,0) (0,0,0,1)\n"
                 "space origin: (10,20,30,40)\n\n",
                 names[i]);
        trip_volume_info info = info_of(write_with_header("time.nrrd", text));
        const double sign = i < 2 ? 1 : -1; /* LPS has x and y negated */
        assert_string_equal(info.space, "RAS");
        assert_map(&info.index_to_world, (const double[3][4]){ { sign * 1, 0, 0, sign * 10 },
                                                               { 0, sign * 2, 0, sign * 20 },
                                                               { 0, 0, 3, 30 } });
    }
    assert_refused(write_with_lines("time.nrrd",
                                    "space: RAST\n"
                                    "space directions: (1,0,0,0) (0,1,0,0) (0,0,1,1)\n"),
                   "line 9: axis 2 runs through time");
    assert_refused(
        write_with_lines("time.nrrd", "space: RAST\nspace directions: (1,0,0) (0,1,0) (0,0,1)\n"),
        "line 9: \"space directions\" must be \"(x,y,z,t)\"");
    assert_refused(write_with_lines("time.nrrd", "space: RAS\nspace origin: (1,0,0,0)\n"),
                   "line 9: \"space origin\" must be \"(x,y,z)\"");
}

static void axis_coordinates_are_a_key_and_value(void **state)
{
    (void)state;
    trip_budget *budget;
    trip_volume *v;
    const char *path = write_with_lines("uneven.nrrd", "coordinates 0:=1 2 3 4 9\n"
                                                       "coordinates 2:= 6 5 4 3 2 1 0 \n"
                                                       "other key:=1 2\n");
    const double x[NX] = { 0, 0.5, 1, 1.5, 4 };
    assert_int_equal(trip_budget_create(&budget, 1 << 20), 0);
    assert_int_equal(trip_volume_open(&v, path, NULL, budget), 0);
    const trip_volume_info *info = trip_volume_get_info(v);
    assert_map(&info->index_to_world,
               (const double[3][4]){ { 2, 0, 0, 1 }, { 0, 1, 0, 0 }, { 0, 0, -1, 6 } });
    for (int i = 0; i < NX; i++)
        assert_true(fabs(info->coordinates[0][i] - x[i]) < 1e-12);
    trip_volume_close(v);
    trip_budget_destroy(budget);
    assert_refused(write_with_lines("bad.nrrd", "coordinates 0:=1 2 3 4\n"), "must be 5 numbers");
    assert_refused(write_with_lines("bad.nrrd", "coordinates 0:=1 2 3 4 5 6\n"),
                   "must be 5 numbers");
    assert_refused(write_with_lines("bad.nrrd", "coordinates 0:=1 2 3 x 5\n"), "must be 5 numbers");
    assert_refused(write_with_lines("bad.nrrd", "coordinates 0:=1 2 3 4 2\n"),
                   "they must ascend or descend throughout");
    assert_refused(write_with_lines("bad.nrrd", "coordinates z:=1\n"), "names no axis");
    static const char *const of_tilted[] = { "coordinates 0:=1 2 3 4 9\n",
                                             "coordinates 1:=1 2 3 9\n" };
    for (int i = 0; i < 2; i++) {
        char lines[200];
        snprintf(lines, sizeof lines, "space: RAS\nspace directions: (1,1,0) (0,1,0) (0,0,1)\n%s",
                 of_tilted[i]);
        assert_refused(write_with_lines("bad.nrrd", lines),
                       "is not parallel to the axis of world space");
    }
}

static void the_measurement_frame_changes_nothing(void **state)
{
    (void)state;
    trip_volume_info info = info_of(
        write_with_lines("frame.nrrd", "space: RAS\nspace directions: (1,0,0) (0,2,0) (0,0,3)\n"
                                       "measurement frame: (0,1,0) (1,0,0) (0,0,-1)\n"));
    assert_string_equal(info.space, "RAS");
    assert_map(&info.index_to_world,
               (const double[3][4]){ { 1, 0, 0, 0 }, { 0, 2, 0, 0 }, { 0, 0, 3, 0 } });
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_type_is_read_in_both_byte_orders),
        cmocka_unit_test(compressed_values_are_read),
        cmocka_unit_test(lines_may_end_in_carriage_returns),
        cmocka_unit_test(fields_may_have_any_order_and_keys_are_skipped),
        cmocka_unit_test(a_detached_header_finds_data_in_its_folder),
        cmocka_unit_test(detached_data_may_be_compressed),
        cmocka_unit_test(many_data_files_are_concatenated),
        cmocka_unit_test(many_data_files_must_exist_and_can_be_read_again),
        cmocka_unit_test(a_pattern_numbers_its_files),
        cmocka_unit_test(lines_and_bytes_are_skipped),
        cmocka_unit_test(the_search_for_lines_ends),
        cmocka_unit_test(a_byte_skip_of_minus_one_reads_the_end_of_the_file),
        cmocka_unit_test(invalid_lengths_can_be_replaced_by_spacing),
        cmocka_unit_test(a_byte_skip_of_minus_one_never_reads_the_header),
        cmocka_unit_test(spacings_and_directions_become_the_map),
        cmocka_unit_test(the_space_gives_the_orientation),
        cmocka_unit_test(an_unknown_space_causes_a_warning),
        cmocka_unit_test(left_handed_spaces_are_turned_right_handed),
        cmocka_unit_test(vectors_with_time_give_their_spatial_part),
        cmocka_unit_test(axis_coordinates_are_a_key_and_value),
        cmocka_unit_test(the_measurement_frame_changes_nothing),
        cmocka_unit_test(axes_of_size_one_are_dropped),
        cmocka_unit_test(data_without_three_axes_in_space_are_refused),
        cmocka_unit_test(values_may_be_text),
        cmocka_unit_test(endian_is_not_needed_for_numbers_in_a_text),
        cmocka_unit_test(an_entry_of_further_axes_is_read),
        cmocka_unit_test(an_entry_may_lie_in_another_data_file),
        cmocka_unit_test(colours_become_their_luma),
        cmocka_unit_test(a_locale_with_decimal_commas_changes_nothing),
        cmocka_unit_test(wrong_fields_are_refused_with_line_number),
        cmocka_unit_test(wrong_headers_are_refused),
        cmocka_unit_test(an_unknown_field_causes_a_warning),
        cmocka_unit_test(the_included_tooth_has_the_values_of_numpy),
        cmocka_unit_test(a_header_without_end_is_refused),
        cmocka_unit_test(a_file_truncated_anywhere_is_refused),
        cmocka_unit_test(a_wrong_byte_of_the_header_does_no_harm),
    };
    return cmocka_run_group_tests_name("read_nrrd", tests, make_folder, remove_folder);
}
