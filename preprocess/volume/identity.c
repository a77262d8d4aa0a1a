#include "identity.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <xxhash.h>

#include "format.h"
#include "levels.h"
#include "report.h"
#include "source.h"
#include "text.h"

/* Raise this with every change that makes the same input and parameters give other bytes: in a
 * reader, in triptych-images or in the bricker. */
enum { BRICKER_VERSION = 27 };

static void write_volume_params(FILE *f, const trip_volume_params *v)
{
    fprintf(f, "%s %d %s %d %" PRIu64 " %d\n", v->grid ? v->grid : "", (int)v->level_set,
            v->raw_type ? v->raw_type : "", v->raw_endian, v->raw_offset_bytes, v->allow_gaps);
    if (v->series || v->channel || v->time)
        fprintf(f, "series %d channel %d time %d\n", v->series, v->channel, v->time);
    if (v->axes)
        fprintf(f, "axes %s\n", v->axes);
    if (v->max_voxels)
        fprintf(f, "at most %" PRIu64 "\n", v->max_voxels);
    if (v->fill)
        fprintf(f, "fill %s\n", v->fill);
    if (v->coordinates)
        fprintf(f, "%s\n", v->coordinates);
    for (int a = 0; a < 3; a++)
        fprintf(f, "%" PRId64 " %a\n", v->raw_dims[a], v->spacing[a]);
}

/* Writes the parameters of the stored form. */
static void write_form(FILE *f, const trip_brick_params *p)
{
    const trip_level_kinds kinds = trip_levels_kinds(p->levels_for, !p->no_halo);
    fprintf(f, "%d %d %d %d %d %u %u %d %d %d\n", BRICKER_VERSION, TRIP_FORMAT_VERSION,
            (int)p->code_bits, (int)p->normals, p->no_halo, p->tile_voxels, p->slab_sheets,
            p->levels, kinds.means, kinds.values);
    for (int a = 0; a < 3 && !trip_region_is_whole(&p->region); a++)
        fprintf(f, "%" PRId64 ":%" PRId64 "\n", p->region.first[a], p->region.past[a]);
}

/* Writes the parameters of the opacity envelope. */
static void write_kept(FILE *f, const trip_brick_params *p, trip_tf *const *functions)
{
    fprintf(f, "%d %d\n", p->keep_all, p->automatic);
    for (size_t i = 0; i < p->range_count; i++)
        fprintf(f, "%a %a\n", p->ranges[i].lo, p->ranges[i].hi);
    for (size_t i = 0; i < p->function_count; i++) {
        char *text = trip_tf_to_text(functions[i]);
        fprintf(f, "%s\n", text ? text : "");
        free(text);
    }
}

static int fail_memory(const trip_brick_params *p)
{
    return trip_fail(TRIP_ERROR, "brick", p->input, "out of memory");
}

enum { FORM = 1, KEPT = 2 };

/* Returns the parameters that `parts` names, for free(). `input` is their first line. */
static int make_text(const trip_brick_params *p, const char *input, trip_tf *const *functions,
                     int parts, char **out)
{
    size_t bytes;
    FILE *f = open_memstream(out, &bytes);
    if (!f)
        return fail_memory(p);
    fputs(input, f);
    locale_t before = trip_text_use_points();
    if (parts & FORM) {
        if (p->input && trip_volume_is_named_labels(p->input)) /* chooses the kind of the volume */
            fputs("labels\n", f);
        write_volume_params(f, &p->volume);
        write_form(f, p);
    }
    if (parts & KEPT)
        write_kept(f, p, functions);
    uselocale(before);
    return fclose(f) == 0 ? 0 : fail_memory(p);
}

int trip_brick_identity(const trip_brick_params *p, trip_tf *const *functions, uint64_t *out)
{
    trip_source source = { 0 };
    trip_digest state;
    char *text = NULL;
    int status = make_text(p, p->input, functions, FORM | KEPT, &text);
    if (status == 0)
        status = trip_source_find(&source, p->input, &p->volume);
    if (status == 0)
        status = trip_source_digest_state(&source, text, &state);
    if (status == 0)
        *out = XXH64(state.text, sizeof state.text, 0);
    trip_source_free(&source);
    free(text);
    return status;
}

static int load_functions(const trip_brick_params *p, trip_tf **functions)
{
    int status = 0;
    for (size_t i = 0; i < p->function_count && status == 0; i++)
        status = trip_tf_load(&functions[i], p->functions[i]);
    return status;
}

int trip_brick_form_text(const trip_brick_params *p, char **out)
{
    return make_text(p, "", NULL, FORM, out);
}

int trip_brick_kept_text(const trip_brick_params *p, char **out)
{
    trip_tf **functions = calloc(p->function_count + 1, sizeof *functions);
    int status = functions ? load_functions(p, functions) : fail_memory(p);
    if (status == 0)
        status = make_text(p, "", functions, KEPT, out);
    for (size_t i = 0; functions && i < p->function_count; i++)
        trip_tf_destroy(functions[i]);
    free(functions);
    return status;
}
