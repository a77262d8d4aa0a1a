#include "gl/sheet_places.h"

#include <math.h>

#include "report.h"

static void fill(float (*places)[2], const double *from, int64_t count)
{
    for (int64_t i = 0; i < count; i++) {
        const double whole = floor(from[i]);
        places[i][0] = (float)whole;
        places[i][1] = (float)(from[i] - whole);
    }
}

int trip_gl_sheet_places_set(trip_gl_sheet_places *p, const trip_coordinates *c, int axis,
                             const int64_t first[2], const int64_t size[2])
{
    trip_gl_sheet_places_release(p);
    const uint64_t bytes = (uint64_t)(size[0] + size[1]) * 2 * sizeof(float);
    float(*places)[2] = trip_budget_take(p->budget, bytes);
    if (!places || !trip_budget_charge(p->budget, bytes)) {
        trip_budget_release(p->budget, places, bytes);
        return trip_fail(TRIP_ERROR, "gl", "sheets",
                         "the coordinates do not fit the memory given; raise --memory");
    }
    p->bytes = bytes;
    fill(places, c->along[(axis + 1) % 3] + first[0], size[0]);
    fill(places + size[0], c->along[(axis + 2) % 3] + first[1], size[1]);
    glCreateBuffers(1, &p->buffer);
    glNamedBufferStorage(p->buffer, (GLsizeiptr)bytes, places, 0);
    trip_budget_release(p->budget, places, bytes);
    return TRIP_OK;
}

void trip_gl_sheet_places_release(trip_gl_sheet_places *p)
{
    glDeleteBuffers(1, &p->buffer);
    trip_budget_discharge(p->budget, p->bytes);
    *p = (trip_gl_sheet_places){ .budget = p->budget };
}
