/* Prints the driver with OpenGL 4.5 on this machine. Fails if there is none. */
#include "opengl.h"

#include <stdio.h>
#include <unistd.h>

/* AddressSanitizer must not take memory that the driver keeps for a failure. */
int main(void)
{
    const char *name = test_opengl();
    puts(name ? name : "no driver offers OpenGL 4.5 by EGL");
    fflush(stdout);
    _exit(!name);
}
