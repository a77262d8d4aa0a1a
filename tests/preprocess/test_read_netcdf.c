/* Tests with hand-made files of netCDF's classic forms. */
#include "netcdf_files.h"

static void put(bytes *b, uint64_t x, unsigned width)
{
    append_word(b, x, width, true);
}

typedef struct file {
    bytes b;
    int form;        /* 1, 2 or 5 */
    size_t begin[4]; /* offset of the header field with the start of each variable's values */
} file;

static void put_count(file *f, uint64_t x)
{
    put(&f->b, x, f->form == 5 ? 8 : 4);
}

static void put_text(file *f, const char *text)
{
    put_count(f, strlen(text));
    append(&f->b, text, strlen(text));
    append(&f->b, "\0\0\0", (4 - strlen(text) % 4) % 4);
}

static void put_list(file *f, unsigned tag, uint64_t count)
{
    put(&f->b, count ? tag : 0, 4);
    put_count(f, count);
}

static void put_float_attribute(file *f, const char *name, int value)
{
    put_text(f, name);
    put(&f->b, 5, 4);
    put_count(f, 1);
    append_value(&f->b, TRIP_F32, value, true);
}

static void put_unsigned_attribute(file *f)
{
    put_text(f, "_Unsigned");
    put(&f->b, 2, 4);
    put_text(f, "true");
}

/* Contents of a file in addition to the sample volume t (netcdf_files.h). */
typedef struct contents {
    int form;
    bool records;     /* z is the record dimension */
    bool coordinates; /* x and z have coordinates */
    bool scaled;      /* t has scale 2 and offset 3 */
    bool lost;        /* the scale is 0 instead of 2 */
    const char *minc; /* an attribute of "image", which then is the name of t, or a variable */
    bool missing;     /* 5 means a missing value, -7 if unsigned */
    bool is_unsigned; /* t is unsigned, and so is x, which then has one byte */
    int type;         /* type of t: 1 int8, 3 int16, 5 float */
} contents;

static trip_scalar scalar_of(const contents *c)
{
    return c->type == 5 ? TRIP_F32 : c->type == 1 ? TRIP_I8 : TRIP_I16;
}

static void put_variable(file *f, const char *name, const int *dims, unsigned count)
{
    put_text(f, name);
    put_count(f, count);
    for (unsigned i = 0; i < count; i++)
        put_count(f, (uint64_t)dims[i]);
}

static void end_variable(file *f, int number, int type, uint64_t vsize)
{
    put(&f->b, (uint64_t)type, 4);
    put_count(f, vsize);
    f->begin[number] = f->b.count;
    put(&f->b, 0, f->form == 1 ? 4 : 8);
}

/* Notes in the header that the values of a variable begin here. */
static void begin_values(file *f, int number)
{
    bytes position = { .count = 0 };
    append_word(&position, f->b.count, f->form == 1 ? 4 : 8, true);
    memcpy(f->b.data + f->begin[number], position.data, position.count);
}

static void pad(file *f)
{
    append(&f->b, "\0\0\0", (4 - f->b.count % 4) % 4);
}

static void put_header(file *f, const contents *c)
{
    const int volume[3] = { 0, 1, 2 }, x = 2, z = 0;
    const unsigned each = trip_scalar_bytes(scalar_of(c));
    f->form = c->form;
    append(&f->b, "CDF", 3);
    put(&f->b, (uint64_t)c->form, 1);
    put_count(f, c->records ? NZ : 0);
    put_list(f, 10, 3);
    put_text(f, "z");
    put_count(f, c->records ? 0 : NZ);
    put_text(f, "lat");
    put_count(f, NY);
    put_text(f, "x");
    put_count(f, NX);
    put_list(f, 12, 1);
    put_text(f, "title");
    put(&f->b, 2, 4);
    put_text(f, "a test");
    const bool minc_variable = c->minc && !strncmp(c->minc, "image-", 6);
    put_list(f, 11, 1 + (c->coordinates ? 2 : 0) + (minc_variable ? 1 : 0));
    if (minc_variable) {
        put_variable(f, c->minc, &z, 1);
        put_list(f, 12, 0);
        end_variable(f, 3, 6, NZ * 8);
    }
    put_variable(f, c->minc ? "image" : "t", volume, 3);
    put_list(f, 12,
             (c->scaled ? 2 : 0) + (c->missing ? 1 : 0) + (c->is_unsigned ? 1 : 0) +
                 (c->minc && !minc_variable ? 1 : 0));
    if (c->minc && !minc_variable) {
        put_text(f, c->minc);
        put(&f->b, 2, 4);
        put_text(f, "signed__");
    }
    if (c->scaled) {
        put_float_attribute(f, "scale_factor", c->lost ? 0 : 2);
        put_float_attribute(f, "add_offset", 3);
    }
    if (c->missing)
        put_float_attribute(f, "missing_value", c->is_unsigned ? -7 : 5);
    if (c->is_unsigned)
        put_unsigned_attribute(f);
    end_variable(f, 0, c->type, VOXELS * each);
    if (!c->coordinates)
        return;
    put_variable(f, "x", &x, 1);
    put_list(f, 12, c->is_unsigned ? 1 : 0);
    if (c->is_unsigned)
        put_unsigned_attribute(f);
    end_variable(f, 1, c->is_unsigned ? 1 : 6, c->is_unsigned ? 8 : NX * 8);
    put_variable(f, "z", &z, 1);
    put_list(f, 12, 0);
    end_variable(f, 2, 4, NZ * 4);
}

static void put_slices(file *f, const contents *c, int first, int count)
{
    append_slices(&f->b, scalar_of(c), true, first, count);
    if (c->coordinates || !c->records)
        pad(f);
}

static const char *write_contents(const char *name, const contents *c)
{
    static file f;
    f = (file){ .form = c->form };
    put_header(&f, c);
    if (c->coordinates) {
        begin_values(&f, 1);
        for (int i = 0; i < NX; i++)
            if (c->is_unsigned)
                append_value(&f.b, TRIP_U8, unsigned_x_position(i), true);
            else
                append_value(&f.b, TRIP_F64, x_position(i), true);
        pad(&f);
    }
    begin_values(&f, 0);
    if (!c->records) {
        put_slices(&f, c, 0, NZ);
        if (c->coordinates)
            begin_values(&f, 2);
        for (int k = 0; k < NZ && c->coordinates; k++)
            append_value(&f.b, TRIP_I32, z_position(k), true);
        return write_file(name, &f.b);
    }
    for (int k = 0; k < NZ; k++) {
        put_slices(&f, c, k, 1);
        if (k == 0 && c->coordinates)
            begin_values(&f, 2);
        if (c->coordinates)
            append_value(&f.b, TRIP_I32, z_position(k), true);
    }
    return write_file(name, &f.b);
}

static void every_form_holds_the_sample(void **state)
{
    (void)state;
    static const int forms[] = { 1, 2, 5 };
    for (int n = 0; n < 24; n++) {
        const contents c = { .form = forms[n % 3],
                             .records = n / 3 % 2,
                             .coordinates = n / 6 % 2,
                             .type = n / 12 ? 5 : 3 };
        assert_holds_sample(write_contents("a.nc", &c), NULL, scalar_of(&c));
    }
}

static void coordinates_become_positions(void **state)
{
    (void)state;
    for (int records = 0; records < 2; records++) {
        const contents c = { .form = 2, .records = records, .coordinates = true, .type = 5 };
        assert_placed(write_contents("b.nc", &c), "t");
    }
}

/* Writes one row of bytes as a hole in the file, with the coordinates 0, 1, 4, 9, ... */
static const char *write_row(uint32_t voxels, uint32_t squares)
{
    static const char *const names[] = { "z", "y", "x" };
    static file f;
    bytes square = { .count = 0 };
    f = (file){ .form = 1 };
    append(&f.b, "CDF\1\0\0\0", 8);
    put_list(&f, 10, 3);
    for (int i = 0; i < 3; i++) {
        put_text(&f, names[i]);
        put_count(&f, i < 2 ? 1 : voxels);
    }
    put_list(&f, 12, 0);
    put_list(&f, 11, 2);
    put_variable(&f, "x", (const int[]){ 2 }, 1);
    put_list(&f, 12, 0);
    end_variable(&f, 0, 4, 4 * (uint64_t)voxels);
    put_variable(&f, "t", (const int[]){ 0, 1, 2 }, 3);
    put_list(&f, 12, 0);
    end_variable(&f, 1, 1, voxels);
    begin_values(&f, 0);
    const char *path = write_file("row.nc", &f.b);
    FILE *row = fopen(path, "r+b");
    append_word(&square, f.b.count + 4 * (uint64_t)voxels, 4, true);
    fseek(row, (long)f.begin[1], SEEK_SET);
    fwrite(square.data, 1, 4, row);
    fseek(row, 0, SEEK_END);
    for (uint32_t i = 0; i < squares; i++) {
        square.count = 0;
        append_value(&square, TRIP_I32, (int)(i * i), true);
        fwrite(square.data, 1, 4, row);
    }
    assert_int_equal(fclose(row), 0);
    assert_int_equal(truncate(path, (off_t)(f.b.count + 5 * (uint64_t)voxels)), 0);
    return path;
}

/* The reader does not read so many coordinates at once. */
static void many_coordinates_become_positions(void **state)
{
    (void)state;
    enum { MANY = 40000 };
    trip_budget *budget;
    trip_volume *v;
    assert_int_equal(trip_budget_create(&budget, 64 << 20), 0);
    assert_int_equal(trip_volume_open(&v, write_row(MANY, MANY), NULL, budget), 0);
    const double *x = trip_volume_get_info(v)->coordinates[0];
    for (int i = 0; i < MANY; i++)
        assert_true(fabs(x[i] - (double)i * i / (MANY - 1)) < 1e-9);
    trip_volume_close(v);
    trip_budget_destroy(budget);
}

static void too_many_coordinates_are_not_read(void **state)
{
    (void)state;
    assert_refused(write_row((1 << 24) + 1, 0), "more than 16777216 voxels along an axis");
}

static void an_interruption_ends_the_reading_of_coordinates(void **state)
{
    (void)state;
    const char *path = write_row(100, 100);
    trip_scope_cancel(trip_scope_current());
    assert_refused_as(TRIP_INTERRUPTED, path, NULL, "interrupted");
    trip_scope_renew(trip_scope_current());
}

static void numbers_are_scaled_and_missing_ones_have_no_value(void **state)
{
    (void)state;
    for (int n = 0; n < 4; n++) {
        const contents c = {
            .form = 1, .records = n % 2, .scaled = true, .missing = true, .type = n / 2 ? 5 : 3
        };
        assert_scaled(write_contents("c.nc", &c), scalar_of(&c));
    }
}

static void a_scale_that_loses_the_values_is_refused(void **state)
{
    (void)state;
    const contents c = { .form = 1, .scaled = true, .lost = true, .type = 3 };
    assert_refused(write_contents("c.nc", &c), "cannot scale its values by");
}

/* Writes four records of 3 x 3 bytes, with or without a byte of a second variable. With two
 * variables, each part is padded to 4 bytes. */
static void records_of_several_variables_are_padded(void **state)
{
    (void)state;
    enum { RECORDS = 4, EACH = 9 };
    static const char *const names[] = { "z", "y", "x" };
    for (unsigned variables = 1; variables <= 2; variables++) {
        static file f;
        float values[RECORDS * EACH];
        trip_volume_info info;
        f = (file){ .form = 1 };
        append(&f.b, "CDF\1\0\0\0\4", 8);
        put_list(&f, 10, 3);
        for (int i = 0; i < 3; i++) {
            put_text(&f, names[i]);
            put_count(&f, i > 0 ? 3 : 0);
        }
        put_list(&f, 12, 0);
        put_list(&f, 11, variables);
        put_variable(&f, "t", (const int[]){ 0, 1, 2 }, 3);
        put_list(&f, 12, 0);
        end_variable(&f, 0, 1, 12);
        if (variables == 2) {
            put_variable(&f, "u", (const int[]){ 0 }, 1);
            put_list(&f, 12, 0);
            end_variable(&f, 1, 1, 4);
        }
        begin_values(&f, 0);
        for (int k = 0; k < RECORDS; k++) {
            for (int i = 0; i < EACH; i++)
                put(&f.b, (uint64_t)(EACH * k + i), 1);
            if (variables == 1)
                continue;
            pad(&f);
            if (k == 0)
                begin_values(&f, 1);
            put(&f.b, 99, 1);
            pad(&f);
        }
        const char *path = write_file("padded.nc", &f.b);
        assert_int_equal(read_volume(path, NULL, 2, values, RECORDS * EACH, &info), 0);
        for (int i = 0; i < RECORDS * EACH; i++)
            assert_true(values[i] == (float)i);
    }
}

/* The record dimension is time. Each of two records has a volume and one number. */
static void one_of_several_times_is_read(void **state)
{
    (void)state;
    static const char *const names[] = { "time", "z", "lat", "x" };
    static file f;
    f = (file){ .form = 2 };
    append(&f.b, "CDF\2\0\0\0\2", 8);
    put_list(&f, 10, 4);
    for (int i = 0; i < 4; i++) {
        put_text(&f, names[i]);
        put_count(&f, (const uint64_t[]){ 0, NZ, NY, NX }[i]);
    }
    put_list(&f, 12, 0);
    put_list(&f, 11, 2);
    put_variable(&f, "t", (const int[]){ 0, 1, 2, 3 }, 4);
    put_list(&f, 12, 0);
    end_variable(&f, 0, 3, VOXELS * 2);
    put_variable(&f, "n", (const int[]){ 0 }, 1);
    put_list(&f, 12, 0);
    end_variable(&f, 1, 4, 4);
    for (int time = 0; time < 2; time++) {
        if (time == 0)
            begin_values(&f, 0);
        if (time == 0)
            append_volume(&f.b, TRIP_I16, true);
        for (int i = 0; i < VOXELS && time > 0; i++)
            put(&f.b, 7, 2);
        if (time == 0)
            begin_values(&f, 1);
        put(&f.b, 1, 4);
    }
    const char *path = write_file("times.nc", &f.b);
    float values[VOXELS];
    trip_volume_info info;
    assert_holds_sample(path, NULL, TRIP_I16);
    assert_int_equal(
        read_volume(path, &(trip_volume_params){ .time = 1 }, 2, values, VOXELS, &info), 0);
    assert_non_null(strstr(info.note, "time 1 of 2"));
    for (int v = 0; v < VOXELS; v++)
        assert_true(values[v] == 7);
    assert_refused_as(TRIP_USAGE, path, &(trip_volume_params){ .time = 2 }, "has 2 times");
    assert_refused_as(TRIP_USAGE, path, &(trip_volume_params){ .channel = 1 }, "has one channel");
}

/* netCDF's default fill value, 0x7cf00000 as a float. */
static void floats_never_written_have_no_value(void **state)
{
    (void)state;
    static const char *const names[] = { "z", "y", "x" };
    static file f;
    float values[2];
    trip_volume_info info;
    f = (file){ .form = 1 };
    append(&f.b, "CDF\1\0\0\0\0", 8);
    put_list(&f, 10, 3);
    for (int i = 0; i < 3; i++) {
        put_text(&f, names[i]);
        put_count(&f, i < 2 ? 1 : 2);
    }
    put_list(&f, 12, 0);
    put_list(&f, 11, 1);
    put_variable(&f, "t", (const int[]){ 0, 1, 2 }, 3);
    put_list(&f, 12, 0);
    end_variable(&f, 0, 5, 8);
    begin_values(&f, 0);
    append_value(&f.b, TRIP_F32, 7, true);
    put(&f.b, 0x7cf00000, 4);
    assert_int_equal(read_volume(write_file("unwritten.nc", &f.b), NULL, 1, values, 2, &info), 0);
    assert_true(values[0] == 7 && isnan(values[1]));
}

/* Tries a name without padding to 4 bytes, and more dimensions than the reader can hold. */
static void errors_give_the_byte_where_the_header_is_invalid(void **state)
{
    (void)state;
    file f = { .form = 1 };
    append(&f.b, "CDF\1\0\0\0\0", 8);
    put_list(&f, 10, 1);
    put_count(&f, 5);
    append(&f.b, "lat_1", 5);
    assert_refused(write_file("short.nc", &f.b), "byte 24: the header is invalid");
    f = (file){ .form = 5 };
    append(&f.b, "CDF\5", 4);
    put_count(&f, 0);
    put_list(&f, 10, UINT64_C(1) << 60);
    assert_refused(write_file("many.nc", &f.b), "byte 24: the header is invalid");
}

static void the_unsigned_attribute_applies(void **state)
{
    (void)state;
    for (int n = 0; n < 8; n++) {
        const contents c = { .form = 1,
                             .records = n & 1,
                             .coordinates = true,
                             .missing = n & 2,
                             .is_unsigned = true,
                             .type = n & 4 ? 3 : 1 };
        assert_unsigned(write_contents("e.nc", &c), scalar_of(&c), c.missing);
    }
}

static void a_variable_is_chosen_by_name(void **state)
{
    (void)state;
    const contents c = { .form = 1, .coordinates = true, .type = 3 };
    const char *path = write_contents("d.nc", &c);
    assert_holds_sample(path, &(trip_volume_params){ .grid = "t" }, TRIP_I16);
    assert_refused_as(TRIP_ERROR, path, &(trip_volume_params){ .grid = "u" }, "no variable \"u\"");
    assert_refused_as(TRIP_ERROR, path, &(trip_volume_params){ .grid = "x" },
                      "is not numeric or has fewer than three dimensions");
}

/* Each slice of a MINC file has a scale of its own. An "image" without the marks is read. */
static void minc_is_refused(void **state)
{
    (void)state;
    static const char *const marks[] = { "signtype", "vartype", "image-min", "image-max" };
    for (int i = 0; i < 4; i++) {
        const contents c = { .form = 1, .type = 3, .minc = marks[i] };
        assert_refused(write_contents("m.mnc", &c), "is a MINC file");
        assert_refused(write_contents("m.mnc", &c), "convert it to NIfTI with `mnc2nii`");
    }
    const contents other = { .form = 1, .type = 3, .minc = "units" };
    assert_holds_sample(write_contents("image.nc", &other), NULL, TRIP_I16);
}

/* Writes 60,000 variables of one number each. */
static void a_header_takes_little_memory(void **state)
{
    (void)state;
    enum { START = 32, EACH = 28, COUNT = 60000 };
    static unsigned char whole[START + EACH * COUNT];
    memcpy(whole, "CDF\1", 4);
    whole[27] = 11; /* tag of a list of variables */
    whole[30] = COUNT >> 8;
    whole[31] = COUNT & 255;
    for (int i = 0; i < COUNT; i++) {
        unsigned char *type = whole + START + EACH * i + 16;
        type[3] = type[7] = 4;
        type[11] = 100;
    }
    assert_refused(write_bytes("h.nc", whole, START + EACH * 100), "the header is invalid");
    assert_refused(write_bytes("h.nc", whole, sizeof whole), "longer than 1 MiB");
    whole[30] = 0;
    whole[31] = 100;
    assert_refused(write_bytes("h.nc", whole, sizeof whole), "three dimensions");
}

static void damaged_files_are_read_or_refused(void **state)
{
    (void)state;
    const contents c = { .form = 5, .records = true, .coordinates = true, .type = 3 };
    static unsigned char whole[1 << 16], damaged[1 << 16];
    FILE *f = fopen(write_contents("f.nc", &c), "rb");
    size_t count = fread(whole, 1, sizeof whole, f);
    int refused = 0;
    fclose(f);
    for (size_t length = 0; length < count; length += length < 700 ? 7 : 31)
        refused += survives(write_bytes("g.nc", whole, length), NULL);
    assert_true(refused > 80); /* only a cut within the padding at the end is no error */
    for (size_t at = 4; at < 600; at++)
        for (int n = 0; n < 2; n++) {
            memcpy(damaged, whole, count);
            damaged[at] = n ? 255 : (unsigned char)(damaged[at] + 1);
            survives(write_bytes("g.nc", damaged, count), NULL);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_form_holds_the_sample),
        cmocka_unit_test(coordinates_become_positions),
        cmocka_unit_test(many_coordinates_become_positions),
        cmocka_unit_test(too_many_coordinates_are_not_read),
        cmocka_unit_test(an_interruption_ends_the_reading_of_coordinates),
        cmocka_unit_test(numbers_are_scaled_and_missing_ones_have_no_value),
        cmocka_unit_test(a_scale_that_loses_the_values_is_refused),
        cmocka_unit_test(records_of_several_variables_are_padded),
        cmocka_unit_test(one_of_several_times_is_read),
        cmocka_unit_test(floats_never_written_have_no_value),
        cmocka_unit_test(errors_give_the_byte_where_the_header_is_invalid),
        cmocka_unit_test(the_unsigned_attribute_applies),
        cmocka_unit_test(a_variable_is_chosen_by_name),
        cmocka_unit_test(minc_is_refused),
        cmocka_unit_test(a_header_takes_little_memory),
        cmocka_unit_test(damaged_files_are_read_or_refused),
    };
    return cmocka_run_group_tests_name("netcdf", tests, make_folder, remove_folder);
}
