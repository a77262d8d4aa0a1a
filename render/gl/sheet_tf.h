/* The transfer function's integrals over codes in GL memory, for frames that classify after
 * interpolation, and where it shows anything. Owned by one renderer; needs its context current.
 * Their bytes count against the budget. */
#ifndef TRIP_GL_SHEET_TF_H
#define TRIP_GL_SHEET_TF_H

#include <epoxy/gl.h>
#include <stdbool.h>

#include "budget.h"
#include "closed_form.h"
#include "transfer_function.h"

typedef struct trip_gl_sheet_tf {
    trip_budget *budget;
    GLuint sums;   /* 65536 of struct trip_gl_sum */
    double unit;   /* 1 of the sums */
    GLuint closed; /* one struct trip_gl_closed: of functions with a closed form, instead */
    uint32_t *next_visible; /* 65536: the first code from here on with extinction, or 65536 */
} trip_gl_sheet_tf;

/* Of a table of 65536 entries, whose extinction is per world unit, and its closed form; NULL: it
 * has none. Fails without memory. */
int trip_gl_sheet_tf_set(trip_gl_sheet_tf *f, const trip_tf_entry *table,
                         const trip_closed_form *closed, double voxel_world);
void trip_gl_sheet_tf_release(trip_gl_sheet_tf *f);

/* Whether some code of [least, most] has extinction. */
static inline bool trip_gl_sheet_tf_shows(const trip_gl_sheet_tf *f, unsigned min, unsigned max)
{
    return min <= max && f->next_visible[min] <= max;
}

#endif
