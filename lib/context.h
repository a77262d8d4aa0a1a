/* What is behind a triptych handle. The program's own commands look into it for their statistics;
 * nothing else includes this. */
#ifndef TRIP_CONTEXT_H
#define TRIP_CONTEXT_H

#include <pthread.h>

#include "frame.h"
#include "image_file.h"
#include "renderer_choice.h"
#include "session.h"
#include "triptych.h"

struct triptych {
    trip_scope scope;
    pthread_mutex_t lock;
    char error[4096]; /* under lock */
    void (*take)(void *user, const char *line);
    void *take_user;

    triptych_resources resources;
    char *name;
    session session;
    bool open, has_function;
    trip_renderer *renderer; /* NULL until a frame is begun */
    trip_reader *reader;     /* the same; of these planes: */
    unsigned planes;
    trip_settings settings;

    bool has_view;
    trip_camera_params view, turned;
    trip_vec3 axis;      /* that a turn goes about */
    uint64_t fit_splats; /* looked at to fit the view */

    bool counting; /* frames count exactly, and draw what is hidden too */
    void (*progress)(void *user, uint64_t splats, uint64_t total);
    void *progress_user;
    bool begun, drawn; /* the camera and the plan are there; the drawing, too */
    trip_camera camera;
    trip_plan plan;
    trip_frame frame;
    trip_drawing drawing;

    trip_image_files pictures;
};

/* The first part of triptych_begin(), which goes on from there: the renderer, the camera, the plan.
 */
int trip_context_prepare(triptych *t);
/* Frames count from the next one on. */
void trip_context_count(triptych *t);

#endif
