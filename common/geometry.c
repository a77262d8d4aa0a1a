#include "geometry.h"

trip_affine trip_affine_identity(void)
{
    return (trip_affine){ { { 1, 0, 0, 0 }, { 0, 1, 0, 0 }, { 0, 0, 1, 0 } } };
}

trip_vec3 trip_affine_vector(const trip_affine *a, trip_vec3 v)
{
    return trip_v3(a->m[0][0] * v.x + a->m[0][1] * v.y + a->m[0][2] * v.z,
                   a->m[1][0] * v.x + a->m[1][1] * v.y + a->m[1][2] * v.z,
                   a->m[2][0] * v.x + a->m[2][1] * v.y + a->m[2][2] * v.z);
}

trip_vec3 trip_affine_point(const trip_affine *a, trip_vec3 p)
{
    trip_vec3 translation = { a->m[0][3], a->m[1][3], a->m[2][3] };
    return trip_add(trip_affine_vector(a, p), translation);
}

trip_vec3 trip_affine_transpose_vector(const trip_affine *a, trip_vec3 n)
{
    return trip_v3(a->m[0][0] * n.x + a->m[1][0] * n.y + a->m[2][0] * n.z,
                   a->m[0][1] * n.x + a->m[1][1] * n.y + a->m[2][1] * n.z,
                   a->m[0][2] * n.x + a->m[1][2] * n.y + a->m[2][2] * n.z);
}

trip_affine trip_affine_multiply(const trip_affine *a, const trip_affine *b)
{
    trip_affine r;
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 4; j++) {
            r.m[i][j] = j == 3 ? a->m[i][3] : 0;
            for (int k = 0; k < 3; k++)
                r.m[i][j] += a->m[i][k] * b->m[k][j];
        }
    }
    return r;
}

double trip_affine_determinant(const trip_affine *a)
{
    const double(*m)[4] = a->m;
    return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) -
           m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
           m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
}

bool trip_affine_is_similarity(const trip_affine *a)
{
    const double size = cbrt(fabs(trip_affine_determinant(a))), unit = size * size;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j <= i; j++) {
            double dot = 0;
            for (int k = 0; k < 3; k++)
                dot += a->m[k][i] * a->m[k][j];
            if (fabs(dot - (i == j ? unit : 0)) > 1e-9 * unit)
                return false;
        }
    return true;
}

bool trip_affine_invert(const trip_affine *a, trip_affine *out)
{
    const double(*m)[4] = a->m;
    double det = trip_affine_determinant(a);
    if (!isfinite(det) || det == 0)
        return false;
    for (int i = 0; i < 3; i++) {
        int i1 = (i + 1) % 3, i2 = (i + 2) % 3;
        for (int j = 0; j < 3; j++) {
            int j1 = (j + 1) % 3, j2 = (j + 2) % 3;
            out->m[i][j] = (m[j1][i1] * m[j2][i2] - m[j1][i2] * m[j2][i1]) / det;
        }
    }
    trip_vec3 t = trip_affine_vector(out, trip_v3(m[0][3], m[1][3], m[2][3]));
    out->m[0][3] = -t.x;
    out->m[1][3] = -t.y;
    out->m[2][3] = -t.z;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 4; j++)
            if (!isfinite(out->m[i][j]))
                return false;
    return true;
}

double trip_affine_farthest_voxels(const trip_affine *a, const double dims[3])
{
    double shortest = INFINITY, farthest = 0;
    for (int k = 0; k < 3; k++)
        shortest = fmin(shortest, trip_length(trip_v3(a->m[0][k], a->m[1][k], a->m[2][k])));
    for (int corner = 0; corner < 8; corner++) {
        const trip_vec3 p =
            trip_affine_point(a, trip_v3(corner & 1 ? dims[0] - 1 : 0, corner & 2 ? dims[1] - 1 : 0,
                                         corner & 4 ? dims[2] - 1 : 0));
        farthest = fmax(farthest, fmax(fabs(p.x), fmax(fabs(p.y), fabs(p.z))));
        if (!isfinite(p.x + p.y + p.z))
            return INFINITY;
    }
    return shortest > 0 ? farthest / shortest : INFINITY;
}
