#include "histograms.h"

static trip_tf_kind recognise(bool sparse, bool integers, bool patient)
{
    return trip_tf_recognise(
        &(trip_tf_origin){ .sparse = sparse, .integers = integers, .patient = patient }, &h);
}

static void names_of_kinds_can_be_read_back(void **state)
{
    (void)state;
    for (int i = 0; i < TRIP_TF_KINDS; i++)
        assert_int_equal(trip_tf_kind_from_name(trip_tf_kind_name((trip_tf_kind)i)), i);
    assert_int_equal(trip_tf_kind_from_name("nothing"), TRIP_TF_AUTOMATIC);
    assert_int_equal(trip_tf_kind_from_name(NULL), TRIP_TF_AUTOMATIC);
}

static void tomograms_are_recognised_by_air_and_tissue(void **state)
{
    (void)state;
    const double lowest[] = { -1024, -2048, -3024 };
    for (int i = 0; i < 3; i++) {
        put_chest(lowest[i], 3071);
        put(lowest[i], i ? 5e5 : 0); /* outside the scanner's circle */
        assert_int_equal(recognise(false, true, true), TRIP_TF_CT);
        assert_int_equal(recognise(false, true, false), TRIP_TF_CT);
        assert_int_equal(recognise(false, false, false), TRIP_TF_CT);
    }
}

static void a_tomogram_moved_to_zero_is_not_in_hounsfield_units(void **state)
{
    (void)state;
    put_chest(-1024, 3071);
    h.value_min += 1024;
    h.value_max += 1024;
    assert_int_equal(recognise(false, true, false), TRIP_TF_SIMULATION);
}

static void values_symmetric_about_zero_are_a_simulation(void **state)
{
    (void)state;
    start(-1000, 1000);
    for (double v = -1000; v < 1000; v += 0.5)
        put(v, 1000);
    assert_int_equal(recognise(false, false, false), TRIP_TF_SIMULATION);
    start(-1000, 1000);
    put_peak(-1000, 1000, 0, 200, 1e6);
    assert_int_equal(recognise(false, false, true), TRIP_TF_SIMULATION);
}

static void magnetic_resonance_requires_a_patient_and_broad_peaks(void **state)
{
    (void)state;
    put_head();
    assert_int_equal(recognise(false, true, true), TRIP_TF_MR);
    assert_int_equal(recognise(false, true, false), TRIP_TF_SIMULATION);
    start(0, 255); /* decreases everywhere, as in a jet or haze */
    for (int v = 0; v < 256; v++)
        put(v, 1e6 * exp(-v / 10.0) + 50);
    assert_int_equal(recognise(false, true, true), TRIP_TF_SIMULATION);
}

static void sparse_densities_are_fog(void **state)
{
    (void)state;
    start(0, 3);
    for (double v = 0; v < 3; v += 0.01)
        put(v, 1000);
    assert_int_equal(recognise(true, false, false), TRIP_TF_FOG);
    start(2, 2);
    h.counts[0] = h.total = 1000;
    assert_int_equal(recognise(true, false, false), TRIP_TF_FOG);
    h.value_min = -3;
    assert_int_equal(recognise(true, false, false), TRIP_TF_SIMULATION);
}

static void labels_are_few_or_have_irregular_counts(void **state)
{
    (void)state;
    start(0, 7);
    for (int v = 0; v <= 7; v++)
        put(v, 1000 * (v + 1));
    assert_int_equal(recognise(false, true, true), TRIP_TF_LABELS);
    assert_int_equal(recognise(false, false, false), TRIP_TF_SIMULATION); /* not integers */
    start(0, 2035); /* like regions in an atlas */
    put(0, 1e7);
    for (int v = 1; v < 200; v++)
        put(v < 100 ? v : v < 150 ? 900 + v : 1885 + v, 100 * pow(1000, test_random()));
    assert_int_equal(recognise(false, true, true), TRIP_TF_LABELS);
}

static void an_image_of_few_grey_levels_is_not_labels(void **state)
{
    (void)state;
    start(0, 252);
    for (int v = 0; v < 64; v++) /* only every fourth level occurs */
        put(4 * v, 1e6 * exp(-v / 12.0) + 2000);
    assert_int_equal(recognise(false, true, false), TRIP_TF_SIMULATION);
}

static void a_binary_solid_is_a_label(void **state)
{
    (void)state;
    start(0, 128);
    put(0, 1e6);
    put(128, 1e4);
    assert_int_equal(recognise(false, true, false), TRIP_TF_LABELS);
}

static void the_dicom_modality_selects_the_kind(void **state)
{
    (void)state;
    put_head();
    trip_tf_origin mr = { .integers = true, .modality = "MR" };
    assert_int_equal(trip_tf_recognise(&mr, &h), TRIP_TF_MR);
    trip_tf_origin other = { .integers = true, .patient = true, .modality = "PT" };
    assert_int_equal(trip_tf_recognise(&other, &h), TRIP_TF_SIMULATION);
}

/* These histograms match several kinds. */
static void the_dicom_modality_confirms_hounsfield_units(void **state)
{
    (void)state;
    trip_tf_origin origin = { .integers = true, .patient = true };
    start(-1000, 1000);
    for (int v = -1000; v < 1000; v += 10)
        put(v, 1000);
    assert_int_equal(trip_tf_recognise(&origin, &h), TRIP_TF_SIMULATION);
    origin.modality = "CT";
    assert_int_equal(trip_tf_recognise(&origin, &h), TRIP_TF_CT);
    start(0, 2000); /* no Hounsfield units */
    for (int v = 0; v < 2000; v += 10)
        put(v, 1000);
    assert_int_equal(trip_tf_recognise(&origin, &h), TRIP_TF_SIMULATION);
}

static void negative_magnetic_resonance_is_no_tomogram(void **state)
{
    (void)state;
    put_chest(-1024, 3071);
    trip_tf_origin origin = { .patient = true };
    assert_int_equal(trip_tf_recognise(&origin, &h), TRIP_TF_CT);
    origin.modality = "MR";
    assert_int_equal(trip_tf_recognise(&origin, &h), TRIP_TF_SIMULATION);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(names_of_kinds_can_be_read_back),
        cmocka_unit_test(tomograms_are_recognised_by_air_and_tissue),
        cmocka_unit_test(a_tomogram_moved_to_zero_is_not_in_hounsfield_units),
        cmocka_unit_test(values_symmetric_about_zero_are_a_simulation),
        cmocka_unit_test(magnetic_resonance_requires_a_patient_and_broad_peaks),
        cmocka_unit_test(sparse_densities_are_fog),
        cmocka_unit_test(labels_are_few_or_have_irregular_counts),
        cmocka_unit_test(an_image_of_few_grey_levels_is_not_labels),
        cmocka_unit_test(a_binary_solid_is_a_label),
        cmocka_unit_test(the_dicom_modality_selects_the_kind),
        cmocka_unit_test(the_dicom_modality_confirms_hounsfield_units),
        cmocka_unit_test(negative_magnetic_resonance_is_no_tomogram),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
