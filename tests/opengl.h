/* Asks EGL itself whether gl can draw on this machine. If it can, a failure of gl is a failure of
 * the test. tests/quick has it as a program for the scripts. */
#ifndef TEST_OPENGL_H
#define TEST_OPENGL_H

/* Returns the name of a driver that offers OpenGL 4.5 core without a window, or NULL. Returns NULL
 * if gl is switched off. Leaves no context current. */
const char *test_opengl(void);

#endif
