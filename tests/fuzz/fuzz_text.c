/* Fuzzes the text that brick stores in a data set. The text must be refused, or give numbers valid
 * for drawing. */
#include "fuzz.h"

#include "framing.h"

#include <math.h>
#include <string.h>

static bool is_axis(trip_vec3 v)
{
    double length = trip_length(v);
    return length == 0 || length == 1;
}

static void use(const trip_dataset_metadata *text, const trip_dataset *d)
{
    double range[2];
    trip_tf *tf = NULL;
    const trip_view_object object = trip_view_object_of(d, text);
    FUZZ_PROMISE(is_axis(object.up) && is_axis(object.front));
    for (int a = 0; a < 3; a++)
        FUZZ_PROMISE(isfinite(object.lo[a]) && object.lo[a] <= object.hi[a]);
    if (trip_dataset_metadata_tf(text, d, &tf) != 0)
        return;
    trip_tf_denormalise(tf, d->header.value_min, d->header.value_max);
    FUZZ_PROMISE(trip_dataset_metadata_culled(text, tf, range) >= 0);
    trip_tf_destroy(tf);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    char path[] = "fuzz";
    trip_dataset d = { .path = path, .index_to_world = trip_affine_identity() };
    trip_dataset_metadata *text;
    for (int a = 0; a < 3; a++)
        d.header.dims[a] = 20;
    d.header.code_hi = d.header.value_max = 100;
    d.text = malloc(size + 1);
    memcpy(d.text, data, size);
    d.text[size] = 0;
    if (trip_dataset_metadata_parse(&text, &d) == 0) {
        use(text, &d);
        trip_dataset_metadata_destroy(text);
    }
    free(d.text);
    return 0;
}
