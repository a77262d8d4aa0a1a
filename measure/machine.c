#include "machine.h"

#include <sched.h>
#include <stdio.h>
#include <string.h>
#include <sys/utsname.h>

#include "budget.h"
#include "text.h"

static void cpu_model(char *text, size_t bytes, const struct utsname *system)
{
    char line[512];
    FILE *f = fopen("/proc/cpuinfo", "r");
    snprintf(text, bytes, "%s", system->machine);
    while (f && fgets(line, sizeof line, f)) {
        char *colon = strchr(line, ':');
        if (strncmp(line, "model name", 10) || !colon || strlen(colon) < 3)
            continue;
        line[strcspn(line, "\n")] = 0;
        snprintf(text, bytes, "%s", colon + 2);
        break;
    }
    if (f)
        fclose(f);
}

char *measure_command_line(int argc, char **argv)
{
    char *text = NULL;
    size_t bytes;
    FILE *f = open_memstream(&text, &bytes);
    if (!f)
        return NULL;
    fputs("triptych", f);
    for (int i = 0; i < argc; i++) {
        fputc(' ', f);
        trip_text_write_word(f, argv[i]);
    }
    fclose(f);
    return text;
}

void measure_describe_machine(cJSON *machine)
{
    struct utsname system = { 0 };
    char model[256], kernel[256];
    cpu_set_t set;
    uname(&system);
    cpu_model(model, sizeof model, &system);
    snprintf(kernel, sizeof kernel, "%.64s %.128s", system.sysname, system.release);
    cJSON_AddStringToObject(machine, "cpu", model);
    cJSON_AddNumberToObject(machine, "cores",
                            sched_getaffinity(0, sizeof set, &set) == 0 ? CPU_COUNT(&set) : 1);
    cJSON_AddNumberToObject(machine, "memory_bytes", (double)trip_memory_available_bytes());
    cJSON_AddStringToObject(machine, "system", kernel);
}

void measure_describe_renderer(cJSON *machine, const char *renderer, const char *device,
                               const char *engine)
{
    cJSON_AddStringToObject(machine, "renderer", renderer);
    cJSON_AddStringToObject(machine, "device", device);
    cJSON_AddStringToObject(machine, "engine",
                            strcmp(engine, "null") ? engine : "none: the data are in memory");
}
