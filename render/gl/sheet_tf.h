/* The transfer function for `post` frames. GL memory holds its integrals over codes or its closed
 * form. The CPU keeps the ranges of visible codes. Owned by one renderer; the context must be
 * current. Its bytes count against the budget. */
#ifndef TRIP_GL_SHEET_TF_H
#define TRIP_GL_SHEET_TF_H

#include <epoxy/gl.h>
#include <stdbool.h>

#include "budget.h"
#include "closed_form.h"
#include "draw_codes.h"
#include "transfer_function.h"

typedef struct trip_gl_sheet_tf {
    trip_budget *budget;
    GLuint sums;   /* 65536 of struct trip_gl_sum */
    double unit;   /* value of 1 in the sums */
    GLuint closed; /* one struct trip_gl_closed; replaces the sums if there is a closed form */
    GLuint
        draw_codes; /* draw code of each stored code, two in a word; unused if the two are equal */
    uint32_t *next_visible; /* for each of 65536 codes: the first code from there on with
                               extinction, or 65536 */
} trip_gl_sheet_tf;

/* Sets the transfer function from a table of 65536 entries with extinction per world unit, one for
 * each draw code. `closed` is its closed form, or NULL if it has none. Fails if the memory does not
 * suffice. */
int trip_gl_sheet_tf_set(trip_gl_sheet_tf *f, const trip_tf_entry *table,
                         const trip_closed_form *closed, const trip_draw_codes *draw,
                         double voxel_world);
void trip_gl_sheet_tf_release(trip_gl_sheet_tf *f);

/* Whether any code in [min, max] has extinction. */
static inline bool trip_gl_sheet_tf_shows(const trip_gl_sheet_tf *f, unsigned min, unsigned max)
{
    return min <= max && f->next_visible[min] <= max;
}

#endif
