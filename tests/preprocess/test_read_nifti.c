#include "volume_files.h"

/* Values of a header. Writing uses the offsets of the standard, not the structures of a library. */
typedef struct nifti {
    int version;
    bool big, pair;
    trip_scalar type;
    int64_t dim[8];
    double pixdim[8];
    double slope, inter;
    int qform, sform;
    double quatern[3], offset[3], srow[3][4];
    int datatype;      /* 0 selects the datatype of `type` */
    double vox_offset; /* 0 selects the end of the header */
} nifti;

static const int codes[TRIP_SCALARS] = { 2, 256, 512, 4, 768, 8, 1280, 1024, 0, 16, 64 };

static nifti sample_header(int version, trip_scalar type, bool big)
{
    return (nifti){ .version = version,
                    .big = big,
                    .type = type,
                    .dim = { 3, NX, NY, NZ, 1, 1, 1, 1 },
                    .pixdim = { 1, 1, 1, 1, 0, 0, 0, 0 } };
}

static void put(bytes *b, size_t at, uint64_t word, unsigned width, bool big)
{
    for (unsigned i = 0; i < width; i++)
        b->data[at + (big ? width - 1 - i : i)] = (unsigned char)(word >> (8 * i));
}

static void put_float(bytes *b, size_t at, double v, bool big)
{
    float f = (float)v;
    uint32_t word;
    memcpy(&word, &f, sizeof word);
    put(b, at, word, 4, big);
}

static void put_double(bytes *b, size_t at, double v, bool big)
{
    uint64_t word;
    memcpy(&word, &v, sizeof word);
    put(b, at, word, 8, big);
}

static void put_version_1(bytes *b, const nifti *n, double vox_offset)
{
    put(b, 0, 348, 4, n->big);
    for (unsigned i = 0; i < 8; i++) {
        put(b, 40 + 2 * i, (uint64_t)n->dim[i], 2, n->big);
        put_float(b, 76 + 4 * i, n->pixdim[i], n->big);
    }
    put(b, 70, (uint64_t)(n->datatype ? n->datatype : codes[n->type]), 2, n->big);
    put(b, 72, 8 * trip_scalar_bytes(n->type), 2, n->big);
    put_float(b, 108, vox_offset, n->big);
    put_float(b, 112, n->slope, n->big);
    put_float(b, 116, n->inter, n->big);
    put(b, 252, (uint64_t)n->qform, 2, n->big);
    put(b, 254, (uint64_t)n->sform, 2, n->big);
    for (unsigned i = 0; i < 3; i++) {
        put_float(b, 256 + 4 * i, n->quatern[i], n->big);
        put_float(b, 268 + 4 * i, n->offset[i], n->big);
        for (unsigned c = 0; c < 4; c++)
            put_float(b, 280 + 16 * i + 4 * c, n->srow[i][c], n->big);
    }
    memcpy(b->data + 344, n->pair ? "ni1" : "n+1", 4);
}

static void put_version_2(bytes *b, const nifti *n, double vox_offset)
{
    put(b, 0, 540, 4, n->big);
    memcpy(b->data + 4, n->pair ? "ni2\0\r\n\032\n" : "n+2\0\r\n\032\n", 8);
    put(b, 12, (uint64_t)(n->datatype ? n->datatype : codes[n->type]), 2, n->big);
    put(b, 14, 8 * trip_scalar_bytes(n->type), 2, n->big);
    for (unsigned i = 0; i < 8; i++) {
        put(b, 16 + 8 * i, (uint64_t)n->dim[i], 8, n->big);
        put_double(b, 104 + 8 * i, n->pixdim[i], n->big);
    }
    put(b, 168, (uint64_t)(int64_t)vox_offset, 8, n->big);
    put_double(b, 176, n->slope, n->big);
    put_double(b, 184, n->inter, n->big);
    put(b, 344, (uint64_t)n->qform, 4, n->big);
    put(b, 348, (uint64_t)n->sform, 4, n->big);
    for (unsigned i = 0; i < 3; i++) {
        put_double(b, 352 + 8 * i, n->quatern[i], n->big);
        put_double(b, 376 + 8 * i, n->offset[i], n->big);
        for (unsigned c = 0; c < 4; c++)
            put_double(b, 400 + 32 * i + 8 * c, n->srow[i][c], n->big);
    }
}

static void append_header(bytes *b, const nifti *n)
{
    size_t length = n->version == 1 ? 348 : 540;
    double vox_offset = n->vox_offset != 0 ? n->vox_offset : n->pair ? 0 : (double)length + 4;
    memset(b->data, 0, length + 4);
    b->count = n->pair ? length : length + 4; /* no extensions follow */
    if (n->version == 1)
        put_version_1(b, n, vox_offset);
    else
        put_version_2(b, n, vox_offset);
}

static bytes nifti_bytes(const nifti *n)
{
    bytes b = { .count = 0 };
    append_header(&b, n);
    append_volume(&b, n->type, n->big);
    return b;
}

static const char *write_nifti(const char *name, const nifti *n)
{
    bytes b = nifti_bytes(n);
    return write_file(name, &b);
}

static trip_volume_info info_of(const nifti *n)
{
    float values[VOXELS];
    trip_volume_info info;
    assert_int_equal(read_volume(write_nifti("info.nii", n), NULL, 3, values, VOXELS, &info), 0);
    return info;
}

static void every_type_is_read_in_both_versions_and_byte_orders(void **state)
{
    (void)state;
    for (int t = 0; t < TRIP_SCALARS; t++)
        for (int form = 0; form < 4 && codes[t]; form++) {
            nifti n = sample_header(1 + form / 2, (trip_scalar)t, form % 2);
            assert_holds_sample(write_nifti("type.nii", &n), NULL, (trip_scalar)t);
        }
}

static void gzipped_files_are_read(void **state)
{
    (void)state;
    for (int version = 1; version <= 2; version++) {
        nifti n = sample_header(version, TRIP_I16, true);
        bytes b = nifti_bytes(&n), gz = { .count = 0 };
        append_gzip(&gz, &b);
        assert_holds_sample(write_file("packed.nii.gz", &gz), NULL, TRIP_I16);
    }
}

static void pairs_are_read_by_either_name(void **state)
{
    (void)state;
    for (int version = 1; version <= 2; version++) {
        nifti n = sample_header(version, TRIP_U16, false);
        n.pair = true;
        bytes head = { .count = 0 }, values = { .count = 0 }, gz = { .count = 0 };
        append_header(&head, &n);
        append_volume(&values, TRIP_U16, false);
        write_file("pair.img", &values);
        assert_holds_sample(write_file("pair.hdr", &head), NULL, TRIP_U16);
        assert_holds_sample(path_of("pair.img"), NULL, TRIP_U16);
        append_gzip(&gz, &values);
        write_file("packed.img.gz", &gz);
        gz.count = 0;
        append_gzip(&gz, &head);
        assert_holds_sample(write_file("packed.hdr.gz", &gz), NULL, TRIP_U16);
    }
    assert_int_equal(remove(path_of("pair.img")), 0);
    assert_refused(path_of("pair.hdr"), "pair.img: cannot open");
}

static void pairs_keep_the_case_of_their_names(void **state)
{
    (void)state;
    static const char *const names[][2] = { { "BRAIN.HDR", "BRAIN.IMG" },
                                            { "Brain.Hdr", "Brain.Img" },
                                            { "MIXED.HDR", "MIXED.img" } };
    nifti n = sample_header(1, TRIP_U16, false);
    n.pair = true;
    bytes head = { .count = 0 }, values = { .count = 0 };
    append_header(&head, &n);
    append_volume(&values, TRIP_U16, false);
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        write_file(names[i][1], &values);
        assert_holds_sample(write_file(names[i][0], &head), NULL, TRIP_U16);
        if (strcmp(names[i][1], "MIXED.img")) /* the reader would look for MIXED.hdr */
            assert_holds_sample(path_of(names[i][1]), NULL, TRIP_U16);
    }
}

static void extensions_before_the_values_are_skipped(void **state)
{
    (void)state;
    nifti n = sample_header(1, TRIP_U8, false);
    n.vox_offset = 352 + 32;
    bytes b = { .count = 0 };
    append_header(&b, &n);
    append(&b, "\x20\0\0\0\x06\0\0\0a comment of 24 bytes...", 32);
    append_volume(&b, TRIP_U8, false);
    assert_holds_sample(write_file("extended.nii", &b), NULL, TRIP_U8);
}

static void slope_and_inter_scale_the_values(void **state)
{
    (void)state;
    for (int version = 1; version <= 2; version++) {
        nifti n = sample_header(version, TRIP_I16, true);
        n.slope = 0.5, n.inter = -7;
        float values[VOXELS];
        assert_int_equal(read_volume(write_nifti("scaled.nii", &n), NULL, 2, values, VOXELS, NULL),
                         0);
        for (int v = 0; v < VOXELS; v++)
            assert_true(values[v] ==
                        0.5f * (float)sample(TRIP_I16, v % NX, v / NX % NY, v / NX / NY) - 7);
    }
}

static void a_slope_of_zero_or_nan_disables_scaling(void **state)
{
    (void)state;
    nifti n = sample_header(1, TRIP_I16, false);
    n.slope = 0, n.inter = 5;
    assert_holds_sample(write_nifti("zero.nii", &n), NULL, TRIP_I16);
    n.slope = NAN;
    assert_holds_sample(write_nifti("nan.nii", &n), NULL, TRIP_I16);
}

static void the_sform_is_preferred(void **state)
{
    (void)state;
    for (int form = 0; form < 4; form++) {
        nifti n = sample_header(1 + form / 2, TRIP_U8, form % 2);
        n.qform = n.sform = 1;
        n.quatern[0] = 1; /* half a turn about x, which the reader must ignore */
        const double rows[3][4] = { { -2, 0.25, 0, 90 },
                                    { 0, 3, 0.5, -126 },
                                    { 0.125, 0, 4, -72 } };
        memcpy(n.srow, rows, sizeof rows);
        trip_volume_info info = info_of(&n);
        assert_map(&info.index_to_world, rows);
        assert_string_equal(info.space, "RAS");
    }
}

/* A quarter turn about z maps i to y and j to -x: (b, c, d) = (0, 0, sin 45 degrees). */
static void the_qform_turns_and_scales(void **state)
{
    (void)state;
    nifti n = sample_header(1, TRIP_U8, false);
    n.qform = 1;
    n.quatern[2] = sqrt(0.5);
    n.pixdim[1] = 2, n.pixdim[2] = 3, n.pixdim[3] = 4;
    n.offset[0] = 5, n.offset[1] = 6, n.offset[2] = 7;
    trip_volume_info info = info_of(&n);
    assert_map(&info.index_to_world,
               (const double[3][4]){ { 0, -3, 0, 5 }, { 2, 0, 0, 6 }, { 0, 0, 4, 7 } });
    assert_string_equal(info.space, "RAS");
    n.pixdim[0] = -1; /* qfac of -1 reverses the third axis */
    info = info_of(&n);
    assert_map(&info.index_to_world,
               (const double[3][4]){ { 0, -3, 0, 5 }, { 2, 0, 0, 6 }, { 0, 0, -4, 7 } });
}

static void voxel_sizes_apply_without_forms(void **state)
{
    (void)state;
    nifti n = sample_header(1, TRIP_U8, false);
    n.pixdim[1] = 0.5, n.pixdim[2] = -3, n.pixdim[3] = 0;
    trip_volume_info info = info_of(&n);
    assert_map(&info.index_to_world,
               (const double[3][4]){ { 0.5, 0, 0, 0 }, { 0, 3, 0, 0 }, { 0, 0, 1, 0 } });
    assert_string_equal(info.space, "");
    assert_false(info.oriented);
}

static void a_singular_sform_is_ignored_with_a_warning(void **state)
{
    (void)state;
    nifti n = sample_header(1, TRIP_U8, false);
    n.sform = 1;
    n.pixdim[1] = 2;
    catch_reports();
    trip_volume_info info = info_of(&n);
    trip_report_redirect(NULL, NULL);
    assert_int_equal(reports, 1);
    assert_map(&info.index_to_world,
               (const double[3][4]){ { 2, 0, 0, 0 }, { 0, 1, 0, 0 }, { 0, 0, 1, 0 } });
    assert_string_equal(info.space, "");
}

/* Writes 3 times of 2 channels. All values of a volume are 10 * channel + time. The volume of time
 * 1 in channel 1 is the sample instead. */
static const char *write_several(bool gzip)
{
    nifti n = sample_header(1, TRIP_I16, true);
    bytes b = { .count = 0 }, gz = { .count = 0 };
    n.dim[0] = 5, n.dim[4] = 3, n.dim[5] = 2;
    append_header(&b, &n);
    for (int volume = 0; volume < 6; volume++)
        for (int v = 0; v < VOXELS; v++)
            append_value(&b, TRIP_I16,
                         volume == 4 ? sample(TRIP_I16, v % NX, v / NX % NY, v / NX / NY)
                                     : volume / 3 * 10 + volume % 3,
                         true);
    append_gzip(&gz, &b);
    return write_file(gzip ? "several.nii.gz" : "several.nii", gzip ? &gz : &b);
}

static void one_of_several_volumes_is_read_with_a_note(void **state)
{
    (void)state;
    for (int gzip = 0; gzip < 2; gzip++) {
        const char *path = write_several(gzip);
        for (int volume = 0; volume < 6; volume++) {
            const trip_volume_params params = { .channel = volume / 3, .time = volume % 3 };
            float values[VOXELS];
            trip_volume_info info;
            char note[64];
            if (volume == 4) {
                assert_holds_sample(path, &params, TRIP_I16);
                continue;
            }
            assert_int_equal(read_volume(path, &params, 2, values, VOXELS, &info), 0);
            assert_true(values[0] == 10 * params.channel + params.time);
            assert_true(values[VOXELS - 1] == values[0]);
            snprintf(note, sizeof note, "time %d of 3", params.time);
            assert_non_null(strstr(info.note, note));
            snprintf(note, sizeof note, "channel %d of 2", params.channel);
            assert_non_null(strstr(info.note, note));
        }
        assert_refused_as(TRIP_USAGE, path, &(trip_volume_params){ .time = 3 },
                          "has 3 times, from 0 to 2");
        assert_refused_as(TRIP_USAGE, path, &(trip_volume_params){ .channel = 2 },
                          "has 2 channels, from 0 to 1");
    }
    nifti one = sample_header(1, TRIP_U8, false);
    assert_refused_as(TRIP_USAGE, write_nifti("one.nii", &one), &(trip_volume_params){ .time = 1 },
                      "has one time");
}

static void colours_become_their_luma(void **state)
{
    (void)state;
    for (int colours = 3; colours <= 4; colours++) {
        nifti n = sample_header(1, TRIP_U8, false);
        bytes b = { .count = 0 };
        float values[VOXELS];
        trip_volume_info info;
        n.datatype = colours == 3 ? 128 : 2304;
        n.slope = 5; /* has no meaning for colours */
        append_header(&b, &n);
        for (int v = 0; v < VOXELS; v++)
            for (int c = 0; c < colours; c++)
                append_value(&b, TRIP_U8, 50 * c + v % 100, false);
        const char *path = write_file("colour.nii", &b);
        assert_int_equal(read_volume(path, NULL, 2, values, VOXELS, &info), 0);
        assert_non_null(strstr(info.note, "luma"));
        for (int v = 0; v < VOXELS; v++) /* 0.7152 * 50 + 0.0722 * 100 */
            assert_true(fabs(values[v] - (v % 100 + 42.98)) < 1e-3);
        b.count--;
        assert_refused(write_file("colour.nii", &b), "is it truncated?");
    }
}

static void one_file_of_a_pair_may_be_compressed(void **state)
{
    (void)state;
    for (int packed = 0; packed < 2; packed++) {
        nifti n = sample_header(2, TRIP_U16, false);
        bytes head = { .count = 0 }, values = { .count = 0 }, gz = { .count = 0 };
        n.pair = true;
        append_header(&head, &n);
        append_volume(&values, TRIP_U16, false);
        append_gzip(&gz, packed ? &values : &head);
        write_file(packed ? "mixed.hdr" : "mixed.hdr.gz", packed ? &head : &gz);
        write_file(packed ? "mixed.img.gz" : "mixed.img", packed ? &gz : &values);
        assert_holds_sample(path_of(packed ? "mixed.hdr" : "mixed.hdr.gz"), NULL, TRIP_U16);
        assert_holds_sample(path_of(packed ? "mixed.img.gz" : "mixed.img"), NULL, TRIP_U16);
        remove(path_of(packed ? "mixed.hdr" : "mixed.hdr.gz"));
        remove(path_of(packed ? "mixed.img.gz" : "mixed.img"));
    }
}

static void axes_of_size_one_are_dropped(void **state)
{
    (void)state;
    nifti n = sample_header(1, TRIP_U8, false);
    n.dim[0] = 7;
    assert_holds_sample(write_nifti("seven.nii", &n), NULL, TRIP_U8);
}

static void non_scalar_types_are_refused(void **state)
{
    (void)state;
    static const int wrong[] = { 1, 32, 1536, 1792, 2048, 0x7fff, 3 };
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
        nifti n = sample_header(1, TRIP_U8, false);
        char text[32];
        n.datatype = wrong[i];
        snprintf(text, sizeof text, "datatype %d (", wrong[i]);
        assert_refused(write_nifti("wrong.nii", &n), text);
    }
}

static void hostile_headers_are_refused(void **state)
{
    (void)state;
    static const int64_t dims[][4] = { { 0, 5, 4, 7 },  { 8, 5, 4, 7 }, { -3, 5, 4, 7 },
                                       { 3, -5, 4, 7 }, { 3, 5, 0, 7 }, { 3, 5, 4, -7 } };
    for (int version = 1; version <= 2; version++) {
        nifti n;
        for (size_t i = 0; i < sizeof dims / sizeof dims[0]; i++) {
            n = sample_header(version, TRIP_U8, false);
            memcpy(n.dim, dims[i], sizeof dims[i]);
            assert_refused(write_nifti("dims.nii", &n),
                           i < 3 ? "axes; NIfTI allows 1 to 7" : "has size");
        }
        static const double offsets[] = { -1, 1, 347, -1e30 };
        for (size_t i = 0; i < sizeof offsets / sizeof offsets[0]; i++) {
            n = sample_header(version, TRIP_U8, false);
            n.vox_offset = offsets[i] < -1e20 && version == 2 ? -1e18 : offsets[i];
            assert_refused(write_nifti("offset.nii", &n), "vox_offset");
        }
        n = sample_header(version, TRIP_U8, false);
        n.vox_offset = version == 1 ? 351 : 543; /* inside the extension flag */
        assert_refused(write_nifti("offset.nii", &n), "vox_offset");
        n = sample_header(version, TRIP_U8, false);
        n.vox_offset = 1e9;
        assert_refused(write_nifti("offset.nii", &n), "beyond its end");
    }
    nifti n = sample_header(1, TRIP_U8, false);
    n.vox_offset = NAN;
    assert_refused(write_nifti("offset.nii", &n), "vox_offset");
    n = sample_header(2, TRIP_U8, false);
    n.dim[1] = n.dim[2] = n.dim[3] = INT64_C(1) << 40;
    assert_refused(write_nifti("huge.nii", &n), "impossible size");
    n.dim[1] = n.dim[2] = INT64_C(1) << 20;
    n.dim[3] = 1;
    assert_refused(write_nifti("huge.nii", &n), "are expected");
    n = sample_header(1, TRIP_U8, false);
    n.slope = 1, n.inter = INFINITY;
    assert_holds_sample(write_nifti("inter.nii", &n), NULL, TRIP_U8);
}

static void invalid_headers_are_refused(void **state)
{
    (void)state;
    nifti n = sample_header(1, TRIP_U8, false);
    bytes b = nifti_bytes(&n);
    put(&b, 0, 349, 4, false);
    assert_refused(write_file("size.nii", &b), "not a NIfTI");
    b = nifti_bytes(&n);
    memset(b.data + 344, 0, 4); /* as in ANALYZE 7.5, which gives no reliable orientation */
    assert_refused(write_file("analyze.nii", &b), "not a NIfTI");
    n = sample_header(2, TRIP_U8, false);
    b = nifti_bytes(&n);
    b.data[8] = '\n';
    assert_refused(write_file("text.nii", &b), "in text mode");
}

static void a_file_truncated_anywhere_is_refused(void **state)
{
    (void)state;
    for (int form = 0; form < 4; form++) {
        nifti n = sample_header(1 + form / 2, TRIP_U8, true);
        bytes b = nifti_bytes(&n), gz = { .count = 0 };
        append_gzip(&gz, &b);
        const bytes *whole = form % 2 ? &gz : &b;
        for (size_t length = 0; length < whole->count; length++)
            assert_true(survives(
                write_bytes(form % 2 ? "cut.nii.gz" : "cut.nii", whole->data, length), NULL));
    }
}

static void a_wrong_byte_of_the_header_does_no_harm(void **state)
{
    (void)state;
    for (int version = 1; version <= 2; version++) {
        nifti n = sample_header(version, TRIP_U8, false);
        n.qform = 1;
        bytes b = nifti_bytes(&n);
        for (size_t at = 0; at < (version == 1 ? 348 : 540); at++)
            for (int bit = 0; bit < 8; bit += 7) {
                bytes changed = b;
                changed.data[at] ^= (unsigned char)(1 << bit);
                survives(write_file("changed.nii", &changed), NULL);
            }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_type_is_read_in_both_versions_and_byte_orders),
        cmocka_unit_test(gzipped_files_are_read),
        cmocka_unit_test(pairs_are_read_by_either_name),
        cmocka_unit_test(pairs_keep_the_case_of_their_names),
        cmocka_unit_test(extensions_before_the_values_are_skipped),
        cmocka_unit_test(slope_and_inter_scale_the_values),
        cmocka_unit_test(a_slope_of_zero_or_nan_disables_scaling),
        cmocka_unit_test(the_sform_is_preferred),
        cmocka_unit_test(the_qform_turns_and_scales),
        cmocka_unit_test(voxel_sizes_apply_without_forms),
        cmocka_unit_test(a_singular_sform_is_ignored_with_a_warning),
        cmocka_unit_test(one_of_several_volumes_is_read_with_a_note),
        cmocka_unit_test(colours_become_their_luma),
        cmocka_unit_test(one_file_of_a_pair_may_be_compressed),
        cmocka_unit_test(axes_of_size_one_are_dropped),
        cmocka_unit_test(non_scalar_types_are_refused),
        cmocka_unit_test(hostile_headers_are_refused),
        cmocka_unit_test(invalid_headers_are_refused),
        cmocka_unit_test(a_file_truncated_anywhere_is_refused),
        cmocka_unit_test(a_wrong_byte_of_the_header_does_no_harm),
    };
    return cmocka_run_group_tests_name("read_nifti", tests, make_folder, remove_folder);
}
