/* Projects single splats in double precision for the CPU renderer. Also holds conversions that the
 * vector kernels share. Pure functions. */
#ifndef TRIP_CPU_SCALAR_H
#define TRIP_CPU_SCALAR_H

#include "cpu/kernels/kernels.h"

/* Projects a splat with trip_splat_project(); leaves its colours unset. `flat` holds the u, v and
 * sheet components of trip_flattening.normal, and the share; NULL selects a round kernel. Returns
 * false if the splat is not drawn. Sets *broken if the projection is not finite; the frame then
 * fails. */
bool trip_cpu_project_scalar(const trip_cpu_view *view, int u, int v, int sheet, double extinction,
                             const float flat[4], trip_cpu_splat *out, bool *broken);

/* Sets l11, l21 and l22 from a projected splat. */
void trip_cpu_set_conic(const trip_splat *s, trip_cpu_splat *out);

/* Coefficients of c[i] for thin splats: c[i] is sqrt(A) times the sum of [i][j] A^j over j. A is
 * the largest optical depth before the edge is subtracted. */
extern const float trip_cpu_thin[TRIP_CPU_TERMS][4];

/* Returns trip_cpu_splat.panes for a splat with x0, y0, x1 and y1 set. */
uint32_t trip_cpu_panes(const trip_cpu_splat *s, int panes_across);

#endif
