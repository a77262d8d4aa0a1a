#include "brick_temporary.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "identity.h"
#include "report.h"

/* Returns the output's name with a suffix, for free(), or NULL after a reported failure. */
static char *name_beside(const char *output, const char *suffix)
{
    char *path;
    size_t length = strlen(output);
    while (length > 1 && output[length - 1] == '/')
        length--;
    if (asprintf(&path, "%.*s%s", (int)length, output, suffix) >= 0)
        return path;
    trip_fail(TRIP_ERROR, "brick", output, "out of memory");
    return NULL;
}

static int open_spill(trip_brick_temporary *t, const trip_brick_input *in)
{
    const char *output = in->params->output;
    char *path = name_beside(output, ".spill");
    t->partial_path = name_beside(output, ".partial");
    int status = path && t->partial_path
                     ? trip_spill_open(&t->spill, path, in->params->resume, in->budget)
                     : TRIP_ERROR;
    free(path);
    return status;
}

static int open_journal(trip_brick_temporary *t, const trip_brick_input *in,
                        const trip_piece_format *format)
{
    const int64_t *dims = in->info->dims;
    const trip_journal_params params = {
        .resume = in->params->resume,
        .identity = t->identity,
        .scanned = trip_brick_input_needs_scan(in),
        .voxels = in->grid_voxels,
        .slice_voxels = in->info->sparse ? 0 : (uint64_t)(dims[0] * dims[1]),
        .halo = format->halo,
        .ordered_bytes = { t->leftover.bytes[0], t->leftover.bytes[1] }
    };
    return trip_journal_open(&t->journal, t->spill, &params, in->budget);
}

int trip_brick_temporary_open(trip_brick_temporary *t, const trip_brick_input *in,
                              const trip_piece_format *format)
{
    int status = open_spill(t, in);
    if (status == 0)
        status = trip_brick_identity(in->params, in->functions, &t->identity);
    if (status == 0 && in->params->resume)
        status = trip_leftover_take(&t->leftover, t->spill, t->partial_path, format);
    return status == 0 ? open_journal(t, in, format) : status;
}

bool trip_brick_temporary_has_ordered(const trip_brick_temporary *t)
{
    for (size_t i = 0; i < trip_spill_count(t->spill); i++)
        if (trip_spill_sequence(t->spill, i)->list == TRIP_ORDERED_LIST)
            return true;
    return false;
}

bool trip_brick_temporary_is_done(const trip_brick_temporary *t, const trip_brick_params *params)
{
    const trip_journal_output *output = trip_journal_get_output(t->journal);
    struct stat st;
    return output && !params->replace && stat(params->output, &st) == 0 &&
           st.st_dev == output->device && st.st_ino == output->inode;
}

int trip_brick_temporary_note_output(trip_brick_temporary *t, const trip_brick_input *in,
                                     int folder)
{
    struct stat st;
    if (fstat(folder, &st) < 0)
        return trip_fail_errno("brick", in->params->output, "cannot examine its folder");
    return trip_journal_write_output(t->journal, &(trip_journal_output){ st.st_dev, st.st_ino });
}

int trip_brick_temporary_begin(trip_brick_temporary *t, const trip_brick_input *in)
{
    if (trip_journal_get_start(t->journal))
        return 0;
    trip_journal_start *start = calloc(1, sizeof *start);
    if (!start)
        return trip_fail(TRIP_ERROR, "brick", in->params->output, "out of memory");
    start->identity = t->identity;
    start->scanned = in->scanned;
    start->tally = *in->tally;
    start->fills = in->fills;
    start->finite_before = in->finite_before;
    start->ids = in->ids.count > 0;
    int status = trip_journal_write_start(t->journal, start);
    free(start);
    return status;
}

void trip_brick_temporary_end(trip_brick_temporary *t, const trip_piece_format *format, bool resume,
                              int status)
{
    trip_leftover now = trip_leftover_none();
    bool keep = resume && status == TRIP_INTERRUPTED;
    if (t->spill && (t->begun || status == 0))
        trip_spill_keep(t->spill, keep);
    if (t->spill && t->begun && keep)
        trip_leftover_take(&now, t->spill, t->partial_path, format);
    trip_leftover_close(&now);
}

void trip_brick_temporary_close(trip_brick_temporary *t)
{
    trip_journal_close(t->journal);
    trip_leftover_close(&t->leftover);
    trip_spill_close(t->spill);
    free(t->partial_path);
}
