/* The commands of the program. Each is a short file whose body is the stages in order. argv[0] is
 * the command's name; returned is the exit status: 0 done, 1 failed, 2 wrong usage. */
#ifndef TRIP_COMMANDS_H
#define TRIP_COMMANDS_H

int trip_command_accuracy(int argc, char **argv); /* accuracy.c */
int trip_command_bench(int argc, char **argv);    /* bench.c */
int trip_command_brick(int argc, char **argv);    /* brick.c */
int trip_command_cache(int argc, char **argv);    /* cache.c */
int trip_command_info(int argc, char **argv);     /* info.c */
int trip_command_render(int argc, char **argv);   /* render.c */
int trip_command_serve(int argc, char **argv);    /* serve.c */
int trip_command_tf(int argc, char **argv);       /* tf.c */
int trip_command_view(int argc, char **argv);     /* view.c */

/* Exit status of a trip_status. */
int trip_exit_status(int status);

#endif
