#include "identity.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <xxhash.h>

#include "format.h"
#include "levels.h"
#include "report.h"

/* To be raised with every change after which the same input and parameters give other bytes,
 * whether in a reader, in triptych-images or in the bricker. */
enum { BRICKER_VERSION = 16 };

/* A file is identified by its name, length and time of change, a pattern by its text. */
static void write_input(FILE *f, const trip_brick_params *p)
{
    struct stat st = { 0 };
    if (stat(p->input, &st) != 0)
        st.st_size = 0;
    fprintf(f, "%s %jd %jd %ld\n", p->input, (intmax_t)st.st_size, (intmax_t)st.st_mtim.tv_sec,
            st.st_mtim.tv_nsec);
}

static void write_volume_params(FILE *f, const trip_volume_params *v)
{
    fprintf(f, "%s %d %s %d %" PRIu64 " %d\n", v->grid ? v->grid : "", (int)v->level_set,
            v->raw_type ? v->raw_type : "", v->raw_endian, v->raw_offset_bytes, v->allow_gaps);
    if (v->axes)
        fprintf(f, "axes %s\n", v->axes);
    if (v->most_voxels)
        fprintf(f, "at most %" PRIu64 "\n", v->most_voxels);
    if (v->coordinates)
        fprintf(f, "%s\n", v->coordinates);
    for (int a = 0; a < 3; a++)
        fprintf(f, "%" PRId64 " %a\n", v->raw_dims[a], v->spacing[a]);
}

static void write_params(FILE *f, const trip_brick_params *p, trip_tf *const *functions)
{
    const trip_level_kinds kinds = trip_levels_kinds(p->levels_for, !p->no_halo);
    fprintf(f, "%d %d %d %d %d %d %d %u %u %d %d %d\n", BRICKER_VERSION, TRIP_FORMAT_VERSION,
            p->keep_all, p->automatic, (int)p->code_bits, (int)p->normals, p->no_halo,
            p->tile_voxels, p->slab_sheets, p->levels, kinds.means, kinds.values);
    for (int a = 0; a < 3 && !trip_region_is_whole(&p->region); a++)
        fprintf(f, "%" PRId64 ":%" PRId64 "\n", p->region.first[a], p->region.past[a]);
    for (size_t i = 0; i < p->range_count; i++)
        fprintf(f, "%a %a\n", p->ranges[i].lo, p->ranges[i].hi);
    for (size_t i = 0; i < p->function_count; i++) {
        char *text = trip_tf_to_text(functions[i]);
        fprintf(f, "%s\n", text ? text : "");
        free(text);
    }
}

int trip_brick_identity(const trip_brick_params *p, trip_tf *const *functions, uint64_t *out)
{
    char *text = NULL;
    size_t bytes = 0;
    FILE *f = open_memstream(&text, &bytes);
    if (f) {
        write_input(f, p);
        write_volume_params(f, &p->volume);
        write_params(f, p, functions);
    }
    if (!f || fclose(f) != 0) {
        free(text);
        return trip_fail(TRIP_ERROR, "brick", p->input, "out of memory");
    }
    *out = XXH64(text, bytes, 0);
    free(text);
    return 0;
}

static int load_functions(const trip_brick_params *p, trip_tf **functions)
{
    int status = 0;
    for (size_t i = 0; i < p->function_count && status == 0; i++)
        status = trip_tf_load(&functions[i], p->functions[i]);
    return status;
}

static int fail_memory(const trip_brick_params *p)
{
    return trip_fail(TRIP_ERROR, "brick", p->input, "out of memory");
}

int trip_brick_options_text(const trip_brick_params *p, char **out)
{
    size_t bytes;
    trip_tf **functions = calloc(p->function_count + 1, sizeof *functions);
    int status = functions ? load_functions(p, functions) : fail_memory(p);
    FILE *f = status == 0 ? open_memstream(out, &bytes) : NULL;
    if (f) {
        write_volume_params(f, &p->volume);
        write_params(f, p, functions);
    }
    if (status == 0 && (!f || fclose(f) != 0))
        status = fail_memory(p);
    for (size_t i = 0; functions && i < p->function_count; i++)
        trip_tf_destroy(functions[i]);
    free(functions);
    return status;
}
