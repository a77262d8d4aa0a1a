#include "renderer_choice.h"

int trip_renderer_create(trip_renderer **out, trip_renderer_kind kind, unsigned threads,
                         trip_budget *budget)
{
    (void)kind;
    (void)threads;
    return trip_reference_create(out, budget);
}
