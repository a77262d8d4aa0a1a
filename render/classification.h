/* What frames that interpolate values (post) take of a data set, a transfer function and a kernel,
 * whatever the view: between which codes all of it lies, and whether segments between them have a
 * closed form. It is the caller's, who keeps it from frame to frame: what is known of the function
 * is to be forgotten where the table has changed, all of it where the data set is another. Plain
 * values. */
#ifndef TRIP_CLASSIFICATION_H
#define TRIP_CLASSIFICATION_H

#include "closed_form.h"
#include "dataset.h"
#include "settings.h"

/* Zeroed: nothing is known. */
typedef struct trip_classification {
    /* Of the kernel that was asked for last. It does not go by the bricks of a frame: a picture
     * does not depend on how these were cut. */
    unsigned code_least, code_most; /* least > most: there are none */
    trip_closed_form_fault not_closed;
    trip_closed_form closed; /* where not_closed is TRIP_CLOSED_FORM_FOUND */
    /* What of this is known. */
    bool has_codes, has_form;
    unsigned held_least, held_most; /* codes that the data set holds */
    trip_kernel kernel;
} trip_classification;

/* Works out which codes there are, where that is not known. */
void trip_classification_codes(trip_classification *c, const trip_dataset *data,
                               trip_kernel kernel);
/* The same, and whether `table` has a closed form for them. */
void trip_classification_form(trip_classification *c, const trip_dataset *data, trip_kernel kernel,
                              const trip_tf_entry *table);
/* The table has changed. */
void trip_classification_forget_form(trip_classification *c);

#endif
