/* The commands of the program. argv[0] is the name of the command. Each function returns the exit
 * status: 0 done, 1 failed, 2 wrong usage. command_NAME.c implements the command NAME as a sequence
 * of stages. */
#ifndef TRIP_COMMANDS_H
#define TRIP_COMMANDS_H

int trip_command_accuracy(int argc, char **argv);
int trip_command_bench(int argc, char **argv);
int trip_command_brick(int argc, char **argv);
int trip_command_cache(int argc, char **argv);
int trip_command_info(int argc, char **argv);
int trip_command_render(int argc, char **argv);
int trip_command_serve(int argc, char **argv);
int trip_command_tf(int argc, char **argv);
int trip_command_view(int argc, char **argv);

/* Converts a trip_status to an exit status. */
int trip_exit_status(int status);

#endif
