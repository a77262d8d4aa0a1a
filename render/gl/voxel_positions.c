#include "gl/voxel_positions.h"

#include "gl/frame_block.h"
#include "report.h"

/* Stores a number as the sum of two floats. */
static void split(double x, float out[2])
{
    out[0] = (float)x;
    out[1] = trip_gl_frame_rest(x);
}

static int fill(trip_gl_voxel_positions *p, const trip_coordinates *c, int64_t rows)
{
    const uint64_t bytes = (uint64_t)rows * 3 * sizeof(trip_gl_float4);
    trip_gl_float4 *positions = trip_budget_take(p->budget, bytes);
    if (!positions || !trip_budget_charge(p->budget, bytes)) {
        trip_budget_release(p->budget, positions, bytes);
        return trip_fail(TRIP_ERROR, "gl", "splats",
                         "the coordinates do not fit the memory given; raise --memory");
    }
    p->bytes = bytes;
    for (int a = 0; a < 3; a++)
        for (int64_t i = 0; i < c->voxels[a]; i++) {
            split(c->along[a][i], positions[3 * i + a].v);
            split(trip_coordinates_width(c, a, i), positions[3 * i + a].v + 2);
        }
    glCreateBuffers(1, &p->buffer);
    glNamedBufferStorage(p->buffer, (GLsizeiptr)bytes, positions, 0);
    trip_budget_release(p->budget, positions, bytes);
    return TRIP_OK;
}

int trip_gl_voxel_positions_set(trip_gl_voxel_positions *p, const trip_coordinates *c)
{
    int64_t rows = 0;
    trip_gl_voxel_positions_release(p);
    for (int a = 0; a < 3; a++)
        rows = c->voxels[a] > rows ? c->voxels[a] : rows;
    return trip_coordinates_uneven(c) ? fill(p, c, rows) : TRIP_OK;
}

void trip_gl_voxel_positions_bind(const trip_gl_voxel_positions *p, bool indexed)
{
    if (p->buffer)
        glBindBufferBase(GL_SHADER_STORAGE_BUFFER,
                         indexed ? TRIP_GL_VOXEL_POSITIONS_INDEXED : TRIP_GL_VOXEL_POSITIONS,
                         p->buffer);
}

void trip_gl_voxel_positions_release(trip_gl_voxel_positions *p)
{
    glDeleteBuffers(1, &p->buffer);
    trip_budget_discharge(p->budget, p->bytes);
    *p = (trip_gl_voxel_positions){ .budget = p->budget };
}
