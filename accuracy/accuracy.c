/* Stages: options -> folder -> pictures of all settings -> errors and times -> report. */
#include "accuracy.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "accuracy_options.h"
#include "command_line.h"
#include "fastest.h"
#include "measure.h"
#include "report.h"
#include "triptych_brick.h"
#include "accuracy_report.h"
#include "machine.h"
#include "scene_report.h"

static int print_settings(void)
{
    accuracy_setting all[ACCURACY_SETTINGS_MAX];
    const draw_settings defaults = { 0 };
    int count = accuracy_settings(all, &defaults);
    for (int i = 0; i < count; i++) {
        printf("%-20s ", all[i].name);
        accuracy_write_options(stdout, &all[i]);
        printf("\n");
    }
    printf("%-20s the ray caster of VTK, if it is installed; requires --source\n", "vtk");
    for (int i = 0; i < ACCURACY_POPPINGS; i++)
        printf("%-20s --classify %s, popping of each method and h in a turning view\n",
               accuracy_poppings[i].name,
               accuracy_poppings[i].classify == TRIPTYCH_CLASSIFY_POST ? "post" : "pre");
    return 0;
}

static int measure(const accuracy_options *o, accuracy_folder *folder, const char *command)
{
    accuracy_measured m;
    accuracy_report r = { 0 };
    if (getloadavg(&r.load_before, 1) != 1)
        r.load_before = NAN;
    int status = accuracy_measure(&m, o, folder->temporary);
    if (!status)
        status = accuracy_report_make(&r, &m, command);
    if (!status)
        status = accuracy_report_write(&r, folder->temporary);
    if (!status)
        status = accuracy_folder_finish(folder);
    if (!status) {
        if (!command_line_quiet())
            printf("%s: %d settings in %d views took %.0f s\n", o->output,
                   cJSON_GetArraySize(r.shown), m.view_count, m.seconds);
        accuracy_report_print(stdout, &r);
    }
    accuracy_report_free(&r);
    for (int i = 0; i < m.popping_count; i++)
        cJSON_Delete(m.popping[i].rows);
    accuracy_measured_free(&m);
    return status;
}

static int report_scene(const accuracy_options *o, accuracy_folder *folder, const char *command)
{
    int status = accuracy_scene_report(o, folder->temporary, command);
    return status ? status : accuracy_folder_finish(folder);
}

/* Checks the data. Sets *scene to whether it is the data set of a Gaussian scene. */
static int check_data(const accuracy_options *o, bool *scene)
{
    triptych *t = NULL;
    int status =
        triptych_create(&t) ? trip_fail(TRIP_ERROR, "accuracy", "library", "out of memory") : 0;
    for (int i = 0; i < o->data_count && !status; i++) {
        const int kind = triptych_is_gaussians(t, o->data[i]);
        *scene |= kind == 2;
        if (kind == 1)
            status = trip_fail(TRIP_USAGE, "usage", o->data[i],
                               "is a Gaussian scene; `triptych brick` makes a data set of it");
    }
    triptych_destroy(t);
    return status || !*scene ? status : accuracy_scene_check(o);
}

int trip_accuracy(int argc, char **argv)
{
    accuracy_options o;
    accuracy_folder folder = { 0 };
    char *command = measure_command_line(argc, argv), *output = NULL;
    bool scene = false;
    int status = accuracy_options_parse(&o, argc, argv);
    if (!status && o.list) {
        free(command);
        return print_settings();
    }
    if (!status)
        status = check_data(&o, &scene);
    if (!status && !o.output)
        o.output = output = accuracy_report_path(o.data[0]);
    if (!status && (!command || !o.output))
        status = trip_fail(TRIP_ERROR, "accuracy", "report", "out of memory");
    if (!status)
        status = accuracy_folder_begin(&folder, o.output, o.force);
    if (!status)
        status = scene ? report_scene(&o, &folder, command) : measure(&o, &folder, command);
    accuracy_folder_abandon(&folder);
    free(output);
    free(command);
    return status;
}
