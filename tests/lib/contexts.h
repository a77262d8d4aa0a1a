/* Functions with which tests of the library begin. Include this header after <cmocka.h>. */
#ifndef CONTEXTS_H
#define CONTEXTS_H

#include <stdio.h>

#include <triptych_brick.h>

static inline triptych *new_context(void)
{
    triptych *t;
    assert_int_equal(triptych_create(&t), TRIPTYCH_OK);
    assert_string_equal(triptych_error(t), "");
    return t;
}

/* Bricks a volume in the setup of a group. Prints the reason of a failure. */
static inline int brick_volume(const char *volume, const char *data_set,
                               const triptych_brick_options *options)
{
    triptych *t = new_context();
    int status = triptych_brick(t, volume, data_set, options, NULL);
    if (status)
        print_error("%s\n", triptych_error(t));
    triptych_destroy(t);
    return status;
}

#endif
