/* Sets a locale with decimal commas. Numbers in files must have the same meaning in every locale.
 */
#ifndef COMMA_LOCALE_H
#define COMMA_LOCALE_H

#include <locale.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>

#include "skips.h"

/* Compiles a locale, since few machines have such a locale installed, and sets it.
 * setlocale(LC_ALL, "C") resets it. */
static inline bool set_comma_locale(void)
{
    char made[] = "/tmp/trip-locale-XXXXXX", command[128];
    if (!mkdtemp(made))
        return false;
    snprintf(command, sizeof command, "localedef -i de_DE -f UTF-8 %s/de_DE.UTF-8", made);
    setenv("LOCPATH", made, 1);
    const bool set = system(command) == 0 && setlocale(LC_ALL, "de_DE.UTF-8");
    unsetenv("LOCPATH");
    snprintf(command, sizeof command, "rm -r %s", made);
    return system(command) == 0 && set && localeconv()->decimal_point[0] == ',';
}

/* Skips the test if the locale cannot be compiled. */
static inline void need_comma_locale(void)
{
    if (set_comma_locale())
        return;
    setlocale(LC_ALL, "C");
    print_message("skipped: no locale with decimal commas can be compiled\n");
    skip();
}

#endif
