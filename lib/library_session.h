/* What frames of a data set have in common: the budget, an opened data set, its transfer function
 * as a table, and readers whose rings fit the memory given. One thread. */
#ifndef TRIP_SESSION_H
#define TRIP_SESSION_H

#include "dataset_level.h"
#include "dataset_metadata.h"
#include "plan.h"
#include "reader.h"
#include "renderer.h"
#include "transfer_function.h"

typedef struct session {
    const char *input; /* the first data set, for messages */
    trip_budget *budget;
    trip_dataset **parts; /* the data sets that were opened, in this order */
    unsigned part_count;
    trip_dataset *joined;            /* all of them as one; NULL where there is one */
    trip_dataset *data;              /* that is drawn: that, or the one there is */
    trip_dataset_metadata **texts;   /* by part; NULL until they are wanted */
    trip_dataset_metadata *text;     /* the first of these */
    trip_tf_entry *table;            /* 65536 entries; the same */
    trip_classification *classified; /* of frames before, by level */
    trip_mean_tables mean_tables;    /* of coarse levels: they may be kept for the next frame */
} session;

/* The transfer function; zero means the one kept in the data set, as it is. */
typedef struct session_look {
    const char *tf;       /* file or preset */
    const char *tf_text;  /* in its place a `.tf` text */
    double opacity_scale; /* of extinction; 0: 1 */
    double window, level; /* what the function's domain spans; window 0: not moved */
    bool *missing;        /* set, in the place of a warning, where values that show were left out */
} session_look;

/* The data set alone. */
int session_open_data(session *s, const char *input, uint64_t memory_bytes);
/* Another data set to be drawn with it, and to be closed with it: its function is then to be used
 * anew. After a failure all is as it was. */
int session_add_data(session *s, const char *input);
/* What `brick` wrote about it, where that is not read yet. */
int session_read_text(session *s);
/* Its function, from now on: reads the text and takes the table where they are not there yet. */
int session_use_function(session *s, const session_look *look);
/* Between frames: keeps the tables of coarse levels where they are a small part of the memory that
 * is left. */
void session_keep_tables(session *s);
/* What is known of frames that are drawn from a level of its data with its function, and is added
 * to by each. */
trip_classification *session_classified(const session *s, unsigned level);
/* Both. Warns when the function shows values that were left out when the data set was made, with
 * the command that makes it anew. Close it also after a failure. */
int session_open(session *s, const char *input, const session_look *look, uint64_t memory_bytes);
void session_close(session *s);

/* What a reader is for; zero means the default. */
typedef struct session_reader {
    trip_engine engine;
    unsigned planes; /* bit per trip_plane */
    int threads;
    bool cache; /* keep pages for the frames to come */
    /* On whose threads blocks are checked, and in whose memory the ring lies where it has such. */
    trip_renderer *renderer;
    bool (*skip)(void *user, const trip_selection *selection, const trip_run *run);
    void *skip_user;
} session_reader;

/* Its ring takes at most a quarter of the memory that is left, its cache half. The renderer must
 * outlive it. */
int session_make_reader(const session *s, trip_reader **out, const session_reader *wanted);

/* width * height * 4 floats; release with session_release_image(). */
int session_take_image(const session *s, int width, int height, float **rgba);
void session_release_image(const session *s, int width, int height, float *rgba);

#endif
