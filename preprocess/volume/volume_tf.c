#include "volume_tf.h"

#include "brick_input.h"
#include "brick_memory.h"
#include "brick_metadata.h"

static int scan(trip_brick_input *in)
{
    trip_piece_format format = trip_brick_format(in->params);
    trip_memory_plan plan;
    format.quantised = true;
    int status = trip_memory_plan_make(&plan, in->params->input, in->info, &format,
                                       trip_workers_count(in->workers), in->memory_bytes,
                                       in->params->slices);
    if (status)
        return status;
    return trip_brick_input_scan(
        in, (trip_scan_params){ .slices = plan.slices, .read_ahead = plan.read_ahead });
}

int trip_volume_tf(const trip_brick_params *params, trip_tf **out)
{
    trip_brick_input in = { 0 };
    trip_brick_params alone = *params; /* without normals, which may need a scan */
    alone.normals = TRIP_NORMALS_NONE;
    *out = NULL;
    int status = trip_brick_input_open(&in, &alone);
    if (!status && trip_brick_input_needs_scan(&in))
        status = scan(&in);
    if (!status && params->function_count) {
        *out = in.functions[0];
        in.functions[0] = NULL;
    } else if (!status) {
        status =
            trip_tf_make_automatic(out, trip_brick_kind(in.info, &in.histogram), &in.histogram);
    }
    trip_brick_input_close(&in);
    return status;
}
