/* triptych bench: bench/ implements it. */
#include "bench.h"

#include "commands.h"

int trip_command_bench(int argc, char **argv)
{
    return trip_exit_status(trip_bench(argc, argv));
}
