#include "gl/sheet_positions.h"

#include <math.h>

#include "report.h"

static void fill(float (*positions)[2], const double *from, int64_t count)
{
    for (int64_t i = 0; i < count; i++) {
        const double whole = floor(from[i]);
        positions[i][0] = (float)whole;
        positions[i][1] = (float)(from[i] - whole);
    }
}

int trip_gl_sheet_positions_set(trip_gl_sheet_positions *p, const trip_coordinates *c, int axis,
                                const int64_t first[2], const int64_t size[2])
{
    trip_gl_sheet_positions_release(p);
    const uint64_t bytes = (uint64_t)(size[0] + size[1]) * 2 * sizeof(float);
    float(*positions)[2] = trip_budget_take(p->budget, bytes);
    if (!positions || !trip_budget_charge(p->budget, bytes)) {
        trip_budget_release(p->budget, positions, bytes);
        return trip_fail(TRIP_ERROR, "gl", "sheets",
                         "the coordinates do not fit the memory given; raise --memory");
    }
    p->bytes = bytes;
    fill(positions, c->along[(axis + 1) % 3] + first[0], size[0]);
    fill(positions + size[0], c->along[(axis + 2) % 3] + first[1], size[1]);
    glCreateBuffers(1, &p->buffer);
    glNamedBufferStorage(p->buffer, (GLsizeiptr)bytes, positions, 0);
    trip_budget_release(p->budget, positions, bytes);
    return TRIP_OK;
}

void trip_gl_sheet_positions_release(trip_gl_sheet_positions *p)
{
    glDeleteBuffers(1, &p->buffer);
    trip_budget_discharge(p->budget, p->bytes);
    *p = (trip_gl_sheet_positions){ .budget = p->budget };
}
