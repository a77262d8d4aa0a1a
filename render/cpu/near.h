/* Projection of single splats for the CPU renderer in double precision, and the conversions that
 * the vector kernels share with it. Pure functions. */
#ifndef TRIP_CPU_NEAR_H
#define TRIP_CPU_NEAR_H

#include "cpu/kernels/kernels.h"

/* A splat by trip_splat_project(); colours are left unset. False when nothing of it is drawn; sets
 * `broken` when its numbers are not finite, so that nobody can tell. */
bool trip_cpu_project_near(const trip_cpu_view *view, int u, int v, int sheet, double extinction,
                           trip_cpu_splat *out, bool *broken);

/* l11, l21 and l22 of a projected splat. */
void trip_cpu_set_conic(const trip_splat *s, trip_cpu_splat *out);

/* c[i] of a thin splat whose largest optical depth, edge and all, is A: sqrt(A) times the sum of
 * [i][j] A^j. */
extern const float trip_cpu_thin[TRIP_CPU_TERMS][4];

/* The constants of a list of the frame's plan, which draws it; `shading` is the caller's to set. */
void trip_cpu_view_make(trip_cpu_view *view, const trip_frame *frame, const trip_list *list,
                        bool front_to_back);

/* The constants of the layer of an axis. */
void trip_cpu_layer_view_make(trip_cpu_view *view, const trip_frame *frame, int axis,
                              bool front_to_back);

/* The tiles of a splat whose pixels are set, for an image so many tiles across. */
uint32_t trip_cpu_tiles(const trip_cpu_splat *s, int tiles_across);

#endif
