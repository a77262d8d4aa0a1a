/* Projection of single splats for the CPU renderer in double precision, and the conversions that
 * the vector kernels share with it. Pure functions. */
#ifndef TRIP_CPU_SCALAR_H
#define TRIP_CPU_SCALAR_H

#include "cpu/kernels/kernels.h"

/* A splat by trip_splat_project(); colours are left unset. `flat`: u, v and the list's component of
 * trip_flattening.normal, and its share; NULL: round. False when nothing of it is drawn; sets
 * `broken` when its numbers are not finite, so that it is neither drawn nor left out. */
bool trip_cpu_project_scalar(const trip_cpu_view *view, int u, int v, int sheet, double extinction,
                             const float flat[4], trip_cpu_splat *out, bool *broken);

/* l11, l21 and l22 of a projected splat. */
void trip_cpu_set_conic(const trip_splat *s, trip_cpu_splat *out);

/* c[i] of a thin splat whose largest optical depth, edge and all, is A: sqrt(A) times the sum of
 * [i][j] A^j. */
extern const float trip_cpu_thin[TRIP_CPU_TERMS][4];

/* The panes of a splat whose pixels are set, for an image so many panes across. */
uint32_t trip_cpu_panes(const trip_cpu_splat *s, int panes_across);

#endif
