/* What frames take of a data set, a transfer function and a kernel, whatever the view: which codes
 * the function shows and, for those that interpolate values (post), between which codes all of it
 * lies, and whether segments between them have a closed form. It is the caller's, who keeps it from
 * frame to frame: what is known of the function is to be forgotten where the table has changed, all
 * of it where the data set is another. Plain values. */
#ifndef TRIP_CLASSIFICATION_H
#define TRIP_CLASSIFICATION_H

#include "closed_form.h"
#include "code_set.h"
#include "dataset.h"
#include "settings.h"

/* Zeroed: nothing is known. */
typedef struct trip_classification {
    /* Of the kernel that was asked for last. It does not go by the bricks of a frame: a picture
     * does not depend on how these were cut. */
    unsigned code_min, code_max; /* least > most: there are none */
    trip_closed_form_fault not_closed;
    trip_closed_form closed; /* where not_closed is TRIP_CLOSED_FORM_FOUND */
    trip_code_set shown;     /* codes with extinction */
    /* What of this is known. */
    bool has_codes, has_form, has_shown;
    unsigned held_min, held_max; /* codes that the data set holds */
    trip_kernel kernel;
} trip_classification;

/* Works out which codes there are, where that is not known. */
void trip_classification_codes(trip_classification *c, const trip_dataset *data,
                               trip_kernel kernel);
/* The same, and whether `table` has a closed form for them. */
void trip_classification_form(trip_classification *c, const trip_dataset *data, trip_kernel kernel,
                              const trip_tf_entry *table);
/* The codes that `table` shows, worked out where they are not known. */
const trip_code_set *trip_classification_shown(trip_classification *c, const trip_tf_entry *table);
/* The table has changed. */
void trip_classification_forget_table(trip_classification *c);

#endif
