/* Connections to the two helper programs. triptych-images reads picture files, and writes all of
 * them except PNG. triptych-netcdf reads netCDF-4 files. The helpers are separate programs for
 * three reasons:
 * - OpenImageIO brings some 250 libraries, needs 120 MB of memory and takes a fifth of a second to
 *   start. A helper pays this only when needed, outside the memory limit of the renderer.
 * - A decoder that crashes on a corrupt file ends only the helper.
 * - The output that libraries print is discarded.
 *
 * A hostile file might take over a decoder, so the helper is not trusted. It may only read files,
 * use a limited amount of memory and write to the descriptor it was given (sandbox.h). All its
 * replies are checked. A wait for it ends after two minutes of silence, or by Ctrl-C.
 *
 * A helper is one process with one connection; one thread at a time may use it. The kernel ends it
 * with the thread that started it. */
#ifndef TRIP_IMAGE_HELPER_H
#define TRIP_IMAGE_HELPER_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* The kinds of slice and picture files. */
typedef enum trip_image_kind {
    TRIP_IMAGE_OTHER,
    TRIP_IMAGE_TIFF,
    TRIP_IMAGE_PNG,
    TRIP_IMAGE_EXR,
    TRIP_IMAGE_DICOM,
} trip_image_kind;

/* Detects the kind from the first bytes of a file; 132 bytes suffice. */
trip_image_kind trip_image_kind_of(const unsigned char *head, size_t bytes);
const char *trip_image_kind_name(trip_image_kind kind);

enum trip_image_task {
    /* Writes a picture to the descriptor, which must be open for writing. The path selects the
     * format. numbers: width, height, depth (trip_image_depth), trip_image_form, JPEG quality. Rows
     * of floats follow from the top, RGBA or distances. The reply comes after the rows. */
    TRIP_IMAGE_WRITE = 1,
    /* Reads a picture from a file. numbers: bytes the helper may use; trip_image_form. Reply data
     * of RGBA: trip_image_size, then float RGBA rows. Reply data of DISTANCES:
     * trip_image_distances, then one float a pixel, as stored. NaN stands for integers of 0 and of
     * the greatest number of their type, which mean no distance. */
    TRIP_IMAGE_READ,
    /* Opens a stack of slices. numbers: bytes the helper may use; 1 to accept missing slices; the
     * number of the DICOM series, or 0; the time; the channel. Reply data: trip_image_stack, then
     * the positions and the text that it announces. */
    TRIP_IMAGE_OPEN_STACK,
    /* Reads a slice. numbers: k. Reply data: the stored values in this machine's byte order. */
    TRIP_IMAGE_READ_SLICE,
    /* Opens a variable of a netCDF-4 file, so that slices of it can be read. numbers: bytes the
     * helper may use; length of the variable's name; time; channel. The name follows the request;
     * length 0 lets the helper choose a variable. Reply data: trip_image_netcdf, then the
     * coordinates that it announces. */
    TRIP_IMAGE_OPEN_NETCDF,
};

/* The contents of a picture file. The rows for RGBA and RGB are RGBA, the rows for DISTANCES are
 * distances. */
enum trip_image_form { TRIP_IMAGE_FORM_RGBA, TRIP_IMAGE_FORM_RGB, TRIP_IMAGE_FORM_DISTANCES };

/* A request. One byte of any value comes before it, possibly with a descriptor. The path follows
 * it, without a terminating zero. */
typedef struct trip_image_request {
    uint32_t task;
    uint32_t path_bytes;
    int64_t numbers[5];
} trip_image_request;

enum trip_image_outcome {
    TRIP_IMAGE_DONE = 1,
    TRIP_IMAGE_FAILED,
    TRIP_IMAGE_WARNING,
    TRIP_IMAGE_WORKING, /* the helper is still working; sent at most once a second */
};

/* A reply. Two texts (where and why) and the data follow it. Warnings and WORKING come before the
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

typedef struct trip_image_distances {
    int64_t width, height;
    int64_t integers; /* 1: the file stores integers; 0: floats */
} trip_image_distances;

typedef struct trip_image_stack {
    int64_t dims[3];
    int32_t type;     /* trip_scalar */
    int32_t oriented; /* the file states the directions of the map */
    double slope, inter;
    double index_to_world[3][4];
    char space[4];         /* anatomical, as in anatomy.h; terminated */
    char up[4];            /* "+z": up by the custom of the format, or ""; terminated */
    char modality[24];     /* from DICOM, at most 16 characters; terminated */
    uint64_t helper_bytes; /* part of the allowed memory used until the helper ends */
    int32_t uneven;        /* 1: dims[2] doubles follow, the positions of the slices, ascending */
    uint32_t parts_bytes;  /* of the list of series that follows, one a line */
    char note[512];        /* choices made for the user, or ""; terminated */
} trip_image_stack;

/* Maximum of trip_image_stack.parts_bytes. */
#define TRIP_IMAGE_PARTS_MAX ((uint32_t)1 << 20)

typedef struct trip_image_netcdf {
    int64_t dims[3];
    int32_t type;   /* trip_scalar; float with NaN for missing values if the variable has any */
    int32_t placed; /* bit a: dims[a] doubles with the coordinates along axis a follow, i first */
    double slope, inter;
    char name[64];  /* of the variable; terminated */
    int32_t others; /* 1 if the file holds more volumes */
    int32_t deeper; /* 1 if the variable has more than five dimensions */
    int64_t times,
        channels; /* sizes of the first two dimensions before the last three; at least 1 */
    uint64_t
        helper_bytes; /* part of the allowed memory used until the helper ends, besides a slice */
} trip_image_netcdf;

typedef struct trip_image_helper trip_image_helper;

/* Starts triptych-images. It starts up while the caller continues. Messages about the helper begin
 * with `stage` ("read", "write"), which must outlive it. */
int trip_image_helper_start(trip_image_helper **out, const char *stage);
/* Starts triptych-netcdf. Fails if it was not built. */
int trip_image_helper_start_netcdf(trip_image_helper **out, const char *stage);
/* Ends the helper, even during a request. Does nothing for NULL. */
void trip_image_helper_stop(trip_image_helper *h);

/* The functions below return 0 or a negative code, reported. The helper is ended if it fails to
 * answer, answers with invalid data, or the user interrupts. Every later request then fails. */

/* Sends a request with the descriptor `fd`, or without one for -1. The caller keeps `fd`. */
int trip_image_helper_request(trip_image_helper *h, enum trip_image_task task, const char *path,
                              const int64_t numbers[5], int fd);
int trip_image_helper_send(trip_image_helper *h, const void *data, size_t bytes);
/* Waits for the outcome and prints warnings on the way. Sets the number of data bytes that follow.
 * A failure is reported. */
int trip_image_helper_outcome(trip_image_helper *h, uint64_t *data_bytes_out);
/* Waits for an outcome with exactly `data_bytes` of data. Fails for any other size. */
int trip_image_helper_expect(trip_image_helper *h, uint64_t data_bytes);
int trip_image_helper_receive(trip_image_helper *h, void *data, size_t bytes);
/* Ends the helper because it sent invalid data. Reports `why` and returns TRIP_ERROR. */
int trip_image_helper_distrust(trip_image_helper *h, const char *why);

/* For tests: replaces the helper program from the calling thread's next start on. NULL restores the
 * program. The function gets the helper's end of the connection, which is closed when it returns.
 * It returns 0 or an errno value. */
typedef int (*trip_image_stand_in)(int fd);
void trip_image_helper_replace(trip_image_stand_in peer, int patience_ms);

/* The descriptor of the connection in the helper's process. */
#define TRIP_IMAGE_HELPER_FD 3

#ifdef __cplusplus
}
#endif

#endif
