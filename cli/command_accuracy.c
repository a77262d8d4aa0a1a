/* triptych accuracy: accuracy/ implements it. */
#include "accuracy.h"

#include "commands.h"

int trip_command_accuracy(int argc, char **argv)
{
    return trip_exit_status(trip_accuracy(argc, argv));
}
