/* Picture files are read by a second program, triptych-images, and written by it but for PNG, which
 * needs none of its libraries; files of netCDF-4 are read by another, triptych-netcdf. This is how
 * the others talk to them. OpenImageIO brings some 250 libraries, 120 MB of resident memory and a
 * fifth of a second to start; here they count only where they are needed, and not towards the
 * memory that the renderer promises. A decoder that a broken file brings down takes nobody with it,
 * and what the libraries print goes nowhere.
 *
 * Nor is a decoder that a hostile file has taken over trusted: the helper may read files, use the
 * memory it is given and write to the descriptor it is given, and no more (sandbox.h); whatever it
 * answers is checked; and every wait for it ends when it is silent for two minutes, or by Ctrl-C.
 *
 * A helper is one process and one connection; it is used by one thread at a time. The kernel ends
 * it with the thread that started it. */
#ifndef TRIP_IMAGE_HELPER_H
#define TRIP_IMAGE_HELPER_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* What slices and pictures may be. */
typedef enum trip_image_kind {
    TRIP_IMAGE_OTHER,
    TRIP_IMAGE_TIFF,
    TRIP_IMAGE_PNG,
    TRIP_IMAGE_EXR,
    TRIP_IMAGE_DICOM,
} trip_image_kind;

/* By content; 132 bytes are enough. */
trip_image_kind trip_image_kind_of(const unsigned char *head, size_t bytes);
const char *trip_image_kind_name(trip_image_kind kind);

enum trip_image_task {
    /* A picture to the descriptor, which is open for writing; the path says its format. numbers:
     * width, height, depth (trip_image_depth), trip_image_form, JPEG quality. Then rows of floats
     * from the top, RGBA or distances; then the reply. */
    TRIP_IMAGE_WRITE = 1,
    /* A picture from a file. numbers: bytes the helper may use. The reply's data: trip_image_size,
     * then float RGBA rows. */
    TRIP_IMAGE_READ,
    /* Opens a stack of slices. numbers: bytes the helper may use, 1 to go on where slices are
     * missing. Data: trip_image_stack. */
    TRIP_IMAGE_OPEN_STACK,
    /* numbers: k. Data: the slice's values as stored, in this machine's byte order. */
    TRIP_IMAGE_READ_SLICE,
    /* Opens a variable of a file of netCDF-4, whose slices are then read. numbers: bytes the helper
     * may use, bytes of the variable's name, which follow; 0: of its own choice. Data:
     * trip_image_netcdf, and the coordinates that it announces. */
    TRIP_IMAGE_OPEN_NETCDF,
};

/* What a picture's file holds, of rows of RGBA the first two, of rows of distances the last. */
enum trip_image_form { TRIP_IMAGE_FORM_RGBA, TRIP_IMAGE_FORM_RGB, TRIP_IMAGE_FORM_DISTANCES };

/* After one byte of any value, with which a descriptor may come; before the path, without a zero at
 * its end. */
typedef struct trip_image_request {
    uint32_t task;
    uint32_t path_bytes;
    int64_t numbers[5];
} trip_image_request;

enum trip_image_outcome {
    TRIP_IMAGE_DONE = 1,
    TRIP_IMAGE_FAILED,
    TRIP_IMAGE_WARNING,
    TRIP_IMAGE_WORKING, /* a sign of life in a long task, at most one a second */
};

/* Followed by where and why, for people, and by data. Warnings and signs of life come before the
 * outcome. */
typedef struct trip_image_reply {
    uint32_t outcome;
    int32_t status; /* of a failure */
    uint32_t where_bytes, why_bytes;
    uint64_t data_bytes;
} trip_image_reply;

typedef struct trip_image_size {
    int64_t width, height;
} trip_image_size;

typedef struct trip_image_stack {
    int64_t dims[3];
    int32_t type;     /* trip_scalar */
    int32_t oriented; /* the map's directions are the file's */
    double slope, inter;
    double index_to_world[3][4];
    char space[8];         /* anatomical, as in anatomy.h; terminated */
    char modality[24];     /* of DICOM, at most 16 characters; terminated */
    uint64_t helper_bytes; /* of the allowed memory that it uses until it ends */
} trip_image_stack;

typedef struct trip_image_netcdf {
    int64_t dims[3];
    int32_t type;   /* trip_scalar; floats, not a number where nothing is, where some are missing */
    int32_t placed; /* bit a: coordinates along axis a follow, dims[a] doubles, those of i first */
    double slope, inter;
    char name[64];         /* of the variable; terminated */
    int32_t others;        /* 1: there are more volumes in the file */
    int32_t deeper;        /* 1: it has more dimensions */
    uint64_t helper_bytes; /* of the allowed memory that it uses until it ends, beside a slice */
} trip_image_netcdf;

typedef struct trip_image_helper trip_image_helper;

/* Starts the program; it gets ready while the caller goes on. `what` ("read", "write") begins the
 * lines about it and must outlive it. */
int trip_image_helper_start(trip_image_helper **out, const char *stage);
/* The same of triptych-netcdf; fails where that was not built. */
int trip_image_helper_start_netcdf(trip_image_helper **out, const char *stage);
/* Ends it, also in the middle of something. NULL is fine. */
void trip_image_helper_stop(trip_image_helper *h);

/* The functions below return 0 or a reported failure. After one that is not an answer of the helper
 * itself (it is lost, silent or sends what cannot be, or the work was interrupted), the helper is
 * gone, and every further request fails. */

/* `fd` goes along with the request unless it is -1, and stays the caller's. */
int trip_image_helper_request(trip_image_helper *h, enum trip_image_task task, const char *path,
                              const int64_t numbers[5], int fd);
int trip_image_helper_send(trip_image_helper *h, const void *data, size_t bytes);
/* Passes warnings on and waits for the outcome: 0 and how many bytes of data follow, or a failure,
 * which is reported. */
int trip_image_helper_outcome(trip_image_helper *h, uint64_t *data_bytes_out);
/* The same where exactly `data_bytes` must follow. */
int trip_image_helper_expect(trip_image_helper *h, uint64_t data_bytes);
int trip_image_helper_receive(trip_image_helper *h, void *data, size_t bytes);
/* What it sent cannot be, and `why` says what: ends the helper, reports, returns TRIP_ERROR. */
int trip_image_helper_distrust(trip_image_helper *h, const char *why);

/* For tests: what takes the program's place from the calling thread's next start on, NULL for the
 * program again. It gets the helper's end of the connection, which is closed when it returns; 0, or
 * an errno. */
typedef int (*trip_image_stand_in)(int fd);
void trip_image_helper_replace(trip_image_stand_in peer, int patience_ms);

/* The helper's connection in its own process. */
#define TRIP_IMAGE_HELPER_FD 3

#ifdef __cplusplus
}
#endif

#endif
