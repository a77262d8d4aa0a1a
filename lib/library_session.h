/* A session has the parts that the frames of a data set share: the budget, the opened data sets and
 * the tables of the transfer function. It also makes readers with rings that fit the memory limit.
 * One thread. */
#ifndef TRIP_SESSION_H
#define TRIP_SESSION_H

#include "dataset_level.h"
#include "dataset_metadata.h"
#include "plan.h"
#include "reader.h"
#include "renderer.h"
#include "transfer_function.h"

typedef struct session {
    const char *input; /* the first data set, in messages */
    trip_budget *budget;
    trip_dataset **parts; /* opened data sets, in the order of opening */
    unsigned part_count;
    trip_dataset *joined;          /* all parts as one data set; NULL if there is one part */
    trip_dataset *with_normals;    /* the same with computed normals; NULL if they are stored */
    trip_dataset *data;            /* the data set that is drawn */
    trip_dataset_metadata **texts; /* one per part; NULL until read */
    trip_dataset_metadata *text;   /* texts[0] */
    /* The tables of the transfer function, 65536 entries each; NULL until one is used. The second
     * is NULL as long as draw codes are stored codes. */
    trip_tf_entry *table, *draw_table;
    uint16_t *draw_map;              /* of `draw`; NULL if draw codes are stored codes */
    trip_draw_codes draw;            /* the codes of frames that interpolate */
    double shading_range;            /* of the transfer function, as in trip_settings */
    trip_classification *classified; /* results of earlier frames, one per level */
    trip_mean_tables mean_tables;    /* of coarse levels; may be kept for the next frame */
} session;

/* A choice of transfer function. Zero selects the function stored in the data set. */
typedef struct session_look {
    const char *tf;       /* file or preset */
    const char *tf_text;  /* text of a `.tf` file, instead of tf */
    double opacity_scale; /* factor on extinction; 0 means 1 */
    double window,
        level; /* range that the function's domain is stretched over; window 0 leaves it */
    /* If not NULL, set to true if visible values were dropped, instead of a warning. */
    bool *missing;
} session_look;

/* Opens a data set. `input` must outlive the session. Close the session also after a failure. */
int session_open_data(session *s, const char *input, uint64_t memory_bytes);
/* Opens another data set to draw together with the first; session_close() closes both. The transfer
 * function must then be set again. A failure leaves the session unchanged. */
int session_add_data(session *s, const char *input);
/* Reads the text that `brick` wrote for each part, unless it has been read. */
int session_read_text(session *s);
/* Loads a transfer function in data units and applies the window. The texts must have been read. */
int session_load_function(const session *s, const session_look *look, trip_tf **tf);
/* Sets the transfer function for later frames. Reads the texts and allocates the table if needed.
 * Warns about visible values that bricking dropped, with the command that bricks again. */
int session_use_function(session *s, const session_look *look);
/* Lets a session use the transfer function of another session of the same data, which must outlive
 * the use. */
void session_lend_function(session *to, const session *from);
/* Ends the use, before the session is closed. */
void session_return_function(session *s);
/* Returns the table of frames that interpolate values, or of frames that draw stored voxels. */
const trip_tf_entry *session_table(const session *s, bool interpolates);
/* Called between frames. Keeps the tables of coarse levels only if they are a small part of the
 * memory left. */
void session_keep_tables(session *s);
/* Returns the results of earlier frames at a level with the current function. Each frame adds to
 * them. */
trip_classification *session_classified(const session *s, unsigned level);
/* Returns why the data set can only be drawn as splats, or NULL if post can draw it. */
const char *session_needs_splats(const session *s);
/* Calls session_open_data() and session_use_function(). Close the session also after a failure. */
int session_open(session *s, const char *input, const session_look *look, uint64_t memory_bytes);
void session_close(session *s);

/* Parameters of a reader. Zero selects the default. */
typedef struct session_reader {
    trip_engine engine;
    unsigned planes; /* one bit per trip_plane */
    int threads;
    bool cache; /* keeps pages for later frames */
    /* Its threads check blocks. The ring lies in its memory if it offers memory for it. */
    trip_renderer *renderer;
    bool (*skip)(void *user, const trip_selection *selection, const trip_run *run);
    void *skip_user;
} session_reader;

/* Makes a reader. Its ring takes at most a quarter of the memory left, its cache half. The renderer
 * must outlive the reader. */
int session_make_reader(const session *s, trip_reader **out, const session_reader *wanted);

/* Allocates width * height * 4 floats. Release them with session_release_image(). */
int session_take_image(const session *s, int width, int height, float **rgba);
void session_release_image(const session *s, int width, int height, float *rgba);

#endif
