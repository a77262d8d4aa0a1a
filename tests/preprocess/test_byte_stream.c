#include "volume_files.h"

#include <signal.h>

#include "byte_stream.h"
#include "interrupt.h"

enum { COUNT = 10000 };

static bytes plain(void)
{
    bytes b = { .count = 0 };
    for (unsigned i = 0; i < COUNT; i++)
        append(&b, &(unsigned char){ (unsigned char)(i * i >> 5) }, 1);
    return b;
}

/* Reads the source in pieces of `step` bytes and compares them with the plain bytes from offset
 * `from` on. */
static void assert_delivers(const trip_byte_source *source, size_t from, size_t step)
{
    bytes expected = plain();
    trip_byte_stream *s;
    unsigned char got[COUNT];
    assert_int_equal(trip_byte_stream_open(&s, source), 0);
    for (int round = 0; round < 2; round++) {
        for (size_t done = 0; done < source->size_bytes; done += step) {
            size_t left = (size_t)source->size_bytes - done, n = left < step ? left : step;
            assert_int_equal(trip_byte_stream_read(s, got + done, n), 0);
        }
        assert_memory_equal(got, expected.data + from, (size_t)source->size_bytes);
        assert_int_equal(trip_byte_stream_rewind(s), 0);
    }
    trip_byte_stream_close(s);
}

/* Opens the source and reads it to its end. Expects a failure with one line that contains `text`.
 */
static void assert_fails(const trip_byte_source *source, const char *text)
{
    trip_byte_stream *s = NULL;
    unsigned char got[COUNT + 100];
    catch_reports();
    int status = trip_byte_stream_open(&s, source);
    if (status == 0)
        status = trip_byte_stream_read(s, got, (size_t)source->size_bytes);
    trip_report_redirect(NULL, NULL);
    trip_byte_stream_close(s);
    if (status != TRIP_ERROR || reports != 1 || !strstr(reported, text))
        fail_msg("status %d, %d reports, expected one with \"%s\": %s", status, reports, text,
                 reported);
}

static const char *write_encoded(const char *name, trip_byte_encoding encoding, const bytes *b)
{
    bytes out = { .count = 0 };
    if (encoding == TRIP_BYTES_ZLIB)
        append_gzip(&out, b);
    else if (encoding == TRIP_BYTES_BZIP2)
        append_bzip2(&out, b);
    else
        append(&out, b->data, b->count);
    return write_file(name, &out);
}

static void all_encodings_deliver_the_same_bytes_in_any_pieces(void **state)
{
    (void)state;
    bytes b = plain();
    for (int e = TRIP_BYTES_PLAIN; e <= TRIP_BYTES_BZIP2; e++) {
        const char *path = write_encoded("same", (trip_byte_encoding)e, &b);
        for (size_t step = 1; step <= COUNT; step = step * 7 + 3)
            assert_delivers(&(trip_byte_source){ .path = path,
                                                 .encoding = (trip_byte_encoding)e,
                                                 .size_bytes = COUNT },
                            0, step);
    }
}

static void bytes_can_be_skipped_before_and_after_decompression(void **state)
{
    (void)state;
    bytes b = plain(), out;
    for (int e = TRIP_BYTES_ZLIB; e <= TRIP_BYTES_BZIP2; e++) {
        out.count = 0;
        append_text(&out, "a header");
        if (e == TRIP_BYTES_ZLIB)
            append_zlib(&out, &b);
        else
            append_bzip2(&out, &b);
        const char *path = write_file("skip", &out);
        assert_delivers(&(trip_byte_source){ .path = path,
                                             .encoding = (trip_byte_encoding)e,
                                             .offset_bytes = 8,
                                             .skip_bytes = 5000,
                                             .size_bytes = COUNT - 5000 },
                        5000, 777);
    }
}

static void consecutive_members_form_one_stream(void **state)
{
    (void)state;
    for (int e = TRIP_BYTES_ZLIB; e <= TRIP_BYTES_BZIP2; e++) {
        bytes all = plain(), out = { .count = 0 };
        for (size_t start = 0; start < COUNT; start += COUNT / 4) {
            bytes part = { .count = 0 };
            append(&part, all.data + start, COUNT / 4);
            if (e == TRIP_BYTES_ZLIB)
                append_gzip(&out, &part);
            else
                append_bzip2(&out, &part);
        }
        const char *path = write_file("members", &out);
        assert_delivers(&(trip_byte_source){ .path = path,
                                             .encoding = (trip_byte_encoding)e,
                                             .size_bytes = COUNT },
                        0, 3000);
    }
}

/* Bytes behind a complete stream that do not begin another stream are skipped, as gzip and bzip2
 * do. They are padding, or only the first of the two bytes that begin a stream. */
static void bytes_behind_a_complete_stream_are_skipped(void **state)
{
    (void)state;
    static const unsigned char zeros[600];
    const struct {
        const void *bytes;
        size_t count;
    } tails[] = { { zeros, 1 },
                  { zeros, 2 },
                  { zeros, sizeof zeros },
                  { "\x1f", 1 },
                  { "\x1f ", 2 },
                  { " \x8b", 2 },
                  { "B", 1 },
                  { "B ", 2 },
                  { " Z", 2 },
                  { "what is more", 12 } };
    const bytes all = plain();
    for (int e = TRIP_BYTES_ZLIB; e <= TRIP_BYTES_BZIP2; e++)
        for (size_t i = 0; i < sizeof tails / sizeof *tails; i++) {
            bytes out = { .count = 0 };
            if (e == TRIP_BYTES_ZLIB)
                append_gzip(&out, &all);
            else
                append_bzip2(&out, &all);
            append(&out, tails[i].bytes, tails[i].count);
            catch_reports();
            assert_delivers(&(trip_byte_source){ .path = write_file("tail", &out),
                                                 .encoding = (trip_byte_encoding)e,
                                                 .size_bytes = COUNT },
                            0, 3000);
            trip_report_redirect(NULL, NULL);
            assert_int_equal(reports, 0);
        }
}

/* The reader takes a mebibyte at once. That block holds no byte, one byte or two bytes of the
 * second member. A comment gives the first member the necessary length. */
static void members_may_end_anywhere_in_a_block_read(void **state)
{
    (void)state;
    static unsigned char whole[(1 << 20) + (1 << 16)];
    const bytes all = plain();
    bytes half = { .count = 0 }, first = { .count = 0 }, second = { .count = 0 };
    append(&half, all.data, COUNT / 2);
    append_gzip(&first, &half);
    half.count = 0;
    append(&half, all.data + COUNT / 2, COUNT / 2);
    append_gzip(&second, &half);
    assert_int_equal(first.data[3], 0);
    first.data[3] = 16; /* a comment follows the header's 10 bytes */
    for (size_t left = 0; left < 3; left++) {
        const size_t end = (1 << 20) - left, comment = end - first.count;
        memcpy(whole, first.data, 10);
        memset(whole + 10, 'x', comment - 1);
        whole[10 + comment - 1] = 0;
        memcpy(whole + 10 + comment, first.data + 10, first.count - 10);
        memcpy(whole + end, second.data, second.count);
        const char *path = write_bytes("border", whole, end + second.count);
        assert_delivers(
            &(trip_byte_source){ .path = path, .encoding = TRIP_BYTES_ZLIB, .size_bytes = COUNT },
            0, 3000);
    }
}

/* Cuts off one byte more each time, down to an empty file. A cut in the checksum at the end is an
 * error, too. */
static void a_file_truncated_anywhere_is_refused(void **state)
{
    (void)state;
    bytes small = { .count = 0 };
    append_volume(&small, TRIP_U8, false);
    for (int e = TRIP_BYTES_PLAIN; e <= TRIP_BYTES_BZIP2; e++) {
        bytes out = { .count = 0 };
        if (e == TRIP_BYTES_ZLIB)
            append_gzip(&out, &small);
        else if (e == TRIP_BYTES_BZIP2)
            append_bzip2(&out, &small);
        else
            append(&out, small.data, small.count);
        for (size_t length = 0; length < out.count; length++) {
            const char *path = write_bytes("cut", out.data, length);
            assert_fails(&(trip_byte_source){ .path = path,
                                              .encoding = (trip_byte_encoding)e,
                                              .size_bytes = VOXELS },
                         e == TRIP_BYTES_PLAIN ? "are expected" : "c");
        }
    }
}

static void corrupt_data_is_found_by_the_checksum(void **state)
{
    (void)state;
    bytes b = plain();
    for (int e = TRIP_BYTES_ZLIB; e <= TRIP_BYTES_BZIP2; e++) {
        bytes out = { .count = 0 };
        if (e == TRIP_BYTES_ZLIB)
            append_gzip(&out, &b);
        else
            append_bzip2(&out, &b);
        size_t length = out.count;
        out.data[length - 6] ^= 1; /* within the last checksum */
        const char *path = write_file("corrupt", &out);
        assert_fails(&(trip_byte_source){ .path = path,
                                          .encoding = (trip_byte_encoding)e,
                                          .size_bytes = COUNT },
                     "corrupt near byte");
    }
}

static void unexpected_content_is_refused(void **state)
{
    (void)state;
    bytes b = plain();
    const char *path = write_file("plain", &b);
    assert_fails(&(trip_byte_source){ .path = path,
                                      .encoding = TRIP_BYTES_ZLIB,
                                      .offset_bytes = 0,
                                      .skip_bytes = 0,
                                      .size_bytes = COUNT },
                 "zlib data");
    assert_fails(&(trip_byte_source){ .path = path,
                                      .encoding = TRIP_BYTES_BZIP2,
                                      .offset_bytes = 0,
                                      .skip_bytes = 0,
                                      .size_bytes = COUNT },
                 "bzip2 data");
}

static void texts_deliver_their_values_in_any_pieces(void **state)
{
    (void)state;
    static const char numbers[] = "0,1 , -2\t\n32767\r\n-32768 +7 300,,5 -6";
    static const int16_t values[] = { 0, 1, -2, 32767, -32768, 7, 300, 5, -6 };
    static const char digits[] = "00 01fe\nFf ff7F00 80";
    static const unsigned char decoded[] = { 0, 1, 0xfe, 0xff, 0xff, 0x7f, 0, 0x80 };
    for (int hex = 0; hex < 2; hex++)
        for (int e = TRIP_BYTES_PLAIN; e <= TRIP_BYTES_BZIP2; e++)
            for (size_t step = 1; step < sizeof values + 2; step++) {
                bytes b = { .count = 0 };
                unsigned char got[sizeof values];
                const size_t count = hex ? sizeof decoded : sizeof values;
                trip_byte_stream *s;
                append_text(&b, "3 lines\n");
                append_text(&b, hex ? digits : numbers);
                const trip_byte_source source = { .path = write_encoded("text", e, &b),
                                                  .encoding = (trip_byte_encoding)e,
                                                  .skip_bytes = 8,
                                                  .size_bytes = count,
                                                  .text = hex ? TRIP_TEXT_HEX : TRIP_TEXT_NUMBERS,
                                                  .text_type = TRIP_I16 };
                catch_reports();
                assert_int_equal(trip_byte_stream_open(&s, &source), 0);
                for (int round = 0; round < 2; round++) {
                    for (size_t done = 0, n; done < count; done += n) {
                        n = count - done < step ? count - done : step;
                        assert_int_equal(done == 4 ? trip_byte_stream_skip(s, n)
                                                   : trip_byte_stream_read(s, got + done, n),
                                         0);
                        if (done == 4)
                            memcpy(got + 4, (hex ? decoded : (const unsigned char *)values) + 4, n);
                    }
                    assert_memory_equal(got, hex ? decoded : (const unsigned char *)values, count);
                    assert_int_equal(trip_byte_stream_rewind(s), 0);
                }
                trip_byte_stream_close(s);
                trip_report_redirect(NULL, NULL);
                assert_int_equal(reports, 0);
            }
}

static void texts_that_are_no_values_are_refused(void **state)
{
    (void)state;
    static const struct {
        const char *text;
        trip_scalar type;
        const char *says;
    } wrong[] = {
        { "1 32768 2", TRIP_I16, "\"32768\" is not a value of the type int16" },
        { "1 -32769 2", TRIP_I16, "\"-32769\" is not a value" },
        { "1 -1 2", TRIP_U16, "\"-1\" is not a value of the type uint16" },
        { "1 2.5 2", TRIP_I16, "\"2.5\" is not a value" },
        { "1 2x 2", TRIP_I16, "\"2x\" is not a value" },
        { "1 99999999999999999999 2", TRIP_U16, "is not a value" },
        { "1", TRIP_I16, "too few" },
        { "1                     ", TRIP_I16, "holds 2 bytes of data, but 4 are expected" },
    };
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++)
        assert_fails(
            &(trip_byte_source){ .path = write_bytes("w", wrong[i].text, strlen(wrong[i].text)),
                                 .size_bytes = 4,
                                 .text = TRIP_TEXT_NUMBERS,
                                 .text_type = wrong[i].type },
            wrong[i].says);
    assert_fails(&(trip_byte_source){ .path = write_bytes("w", "00 0g 11", 8),
                                      .size_bytes = 3,
                                      .text = TRIP_TEXT_HEX },
                 "\"g\" is not a value of the type hex");
    char longest[200];
    memset(longest, '1', sizeof longest);
    assert_fails(&(trip_byte_source){ .path = write_bytes("w", longest, sizeof longest),
                                      .size_bytes = 4,
                                      .text = TRIP_TEXT_NUMBERS,
                                      .text_type = TRIP_F32 },
                 "is not a value");
}

static void the_content_tells_the_encoding(void **state)
{
    (void)state;
    bytes b = plain();
    for (int e = TRIP_BYTES_PLAIN; e <= TRIP_BYTES_BZIP2; e++)
        for (int named = 0; named < 3; named++) {
            static const char *const names[] = { "n", "n.gz", "n.bz2" };
            unsigned char head[100];
            size_t got;
            const char *path = write_encoded(names[named], (trip_byte_encoding)e, &b);
            assert_int_equal(trip_byte_encoding_of(path), e);
            assert_int_equal(trip_byte_stream_head(path, head, sizeof head, false, &got), 0);
            assert_int_equal(got, sizeof head);
            assert_memory_equal(head, b.data, sizeof head);
        }
    assert_int_equal(trip_byte_encoding_of(path_of("missing.gz")), TRIP_BYTES_PLAIN);
}

static void leftover_bytes_cause_one_warning(void **state)
{
    (void)state;
    bytes b = plain();
    for (int e = TRIP_BYTES_PLAIN; e <= TRIP_BYTES_BZIP2; e++) {
        const char *path = write_encoded("longer", (trip_byte_encoding)e, &b);
        catch_reports();
        assert_delivers(&(trip_byte_source){ .path = path,
                                             .encoding = (trip_byte_encoding)e,
                                             .size_bytes = COUNT - 3 },
                        0, 5000);
        trip_report_redirect(NULL, NULL);
        assert_int_equal(reports, 1);
        assert_non_null(strstr(reported, "after the expected"));
        if (e == TRIP_BYTES_PLAIN)
            assert_non_null(strstr(reported, "3 bytes are after the expected"));
    }
}

static void impossible_offsets_and_sizes_are_refused(void **state)
{
    (void)state;
    bytes b = plain();
    const char *path = write_file("offsets", &b);
    assert_fails(&(trip_byte_source){ .path = path,
                                      .encoding = TRIP_BYTES_PLAIN,
                                      .offset_bytes = COUNT + 1,
                                      .skip_bytes = 0,
                                      .size_bytes = 1 },
                 "beyond its end");
    assert_fails(&(trip_byte_source){ .path = path,
                                      .encoding = TRIP_BYTES_PLAIN,
                                      .offset_bytes = UINT64_MAX,
                                      .skip_bytes = UINT64_MAX,
                                      .size_bytes = 1 },
                 "beyond its end");
    assert_fails(&(trip_byte_source){ .path = path,
                                      .encoding = TRIP_BYTES_PLAIN,
                                      .offset_bytes = COUNT,
                                      .skip_bytes = 0,
                                      .size_bytes = 1 },
                 "are expected");
    trip_byte_stream *s;
    catch_reports();
    assert_int_equal(trip_byte_stream_open(&s, &(trip_byte_source){ .path = path,
                                                                    .offset_bytes = 5,
                                                                    .size_bytes = UINT64_MAX - 2 }),
                     TRIP_ERROR);
    trip_report_redirect(NULL, NULL);
}

static void folders_and_missing_files_are_refused(void **state)
{
    (void)state;
    assert_fails(&(trip_byte_source){ .path = folder, .size_bytes = 1 }, "not a regular file");
    assert_fails(&(trip_byte_source){ .path = path_of("missing"), .size_bytes = 1 },
                 "No such file");
    assert_fails(&(trip_byte_source){ .path = "/dev/zero", .size_bytes = 1 }, "not a regular file");
}

static void a_signal_ends_reading_and_skipping(void **state)
{
    (void)state;
    bytes b = plain();
    for (int e = TRIP_BYTES_PLAIN; e <= TRIP_BYTES_BZIP2; e++) {
        trip_byte_stream *s;
        unsigned char got[COUNT];
        const char *path = write_encoded("stopped", (trip_byte_encoding)e, &b);
        assert_int_equal(
            trip_byte_stream_open(&s, &(trip_byte_source){ .path = path,
                                                           .encoding = (trip_byte_encoding)e,
                                                           .size_bytes = COUNT }),
            0);
        trip_interrupt_install();
        raise(SIGTERM);
        catch_reports();
        int status = e == TRIP_BYTES_ZLIB ? trip_byte_stream_skip(s, COUNT / 2)
                                          : trip_byte_stream_read(s, got, COUNT / 2);
        trip_report_redirect(NULL, NULL);
        assert_int_equal(status, TRIP_INTERRUPTED);
        assert_int_equal(reports, 1);
        assert_non_null(strstr(reported, "interrupted"));
        trip_byte_stream_close(s);
        trip_interrupt_install(); /* clears the signal */
        signal(SIGINT, SIG_DFL);
        signal(SIGTERM, SIG_DFL);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_signal_ends_reading_and_skipping),
        cmocka_unit_test(all_encodings_deliver_the_same_bytes_in_any_pieces),
        cmocka_unit_test(bytes_can_be_skipped_before_and_after_decompression),
        cmocka_unit_test(consecutive_members_form_one_stream),
        cmocka_unit_test(bytes_behind_a_complete_stream_are_skipped),
        cmocka_unit_test(members_may_end_anywhere_in_a_block_read),
        cmocka_unit_test(a_file_truncated_anywhere_is_refused),
        cmocka_unit_test(corrupt_data_is_found_by_the_checksum),
        cmocka_unit_test(unexpected_content_is_refused),
        cmocka_unit_test(texts_deliver_their_values_in_any_pieces),
        cmocka_unit_test(texts_that_are_no_values_are_refused),
        cmocka_unit_test(the_content_tells_the_encoding),
        cmocka_unit_test(leftover_bytes_cause_one_warning),
        cmocka_unit_test(impossible_offsets_and_sizes_are_refused),
        cmocka_unit_test(folders_and_missing_files_are_refused),
    };
    return cmocka_run_group_tests_name("byte_stream", tests, make_folder, remove_folder);
}
