/* Everything that touches picture files is done by a second program, triptych-images, and this is
 * how the others talk to it. OpenImageIO brings some 250 libraries, 120 MB of resident memory and a
 * fifth of a second to start; here they count only where pictures are read or written, and not
 * towards the memory that the renderer promises. A decoder that a broken file brings down takes
 * nobody with it, and what the libraries print goes nowhere.
 *
 * A helper is one process and one connection; it is used by one thread at a time. */
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
    /* A picture to a file. numbers: width, height, depth (trip_image_depth), 1 to drop alpha, JPEG
     * quality. Then float RGBA rows from the top; then the reply. */
    TRIP_IMAGE_WRITE = 1,
    /* A picture from a file. The reply's data: trip_image_size, then float RGBA rows. */
    TRIP_IMAGE_READ,
    /* Opens a stack of slices. numbers: bytes the helper may use. Data: trip_image_stack. */
    TRIP_IMAGE_OPEN_STACK,
    /* numbers: k. Data: the slice's values as stored, in this machine's byte order. */
    TRIP_IMAGE_READ_SLICE,
};

/* Followed by the path, without a zero at its end. */
typedef struct trip_image_request {
    uint32_t task;
    uint32_t path_bytes;
    int64_t numbers[5];
} trip_image_request;

enum trip_image_outcome { TRIP_IMAGE_DONE = 1, TRIP_IMAGE_FAILED, TRIP_IMAGE_WARNING };

/* Followed by where and why, for people, and by data. Warnings come before the outcome. */
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
    int32_t type; /* trip_scalar */
    int32_t reserved;
    double slope, inter;
    double index_to_world[3][4];
    uint64_t helper_bytes; /* of the allowed memory that it uses until it ends */
} trip_image_stack;

typedef struct trip_image_helper trip_image_helper;

/* Starts the program; it gets ready while the caller goes on. `what` ("read", "write") begins the
 * lines about it and must outlive it. */
int trip_image_helper_start(trip_image_helper **out, const char *what);
/* Ends it, also in the middle of something. NULL is fine. */
void trip_image_helper_stop(trip_image_helper *h);

int trip_image_helper_request(trip_image_helper *h, enum trip_image_task task, const char *path,
                              const int64_t numbers[5]);
int trip_image_helper_send(trip_image_helper *h, const void *data, size_t bytes);
/* Passes warnings on and waits for the outcome: 0 and how many bytes of data follow, or a failure,
 * which is reported. */
int trip_image_helper_outcome(trip_image_helper *h, uint64_t *data_bytes_out);
int trip_image_helper_receive(trip_image_helper *h, void *data, size_t bytes);

/* All of `bytes` bytes over the connection; false when it ended before. errno is 0 at its end. For
 * both sides. */
int trip_image_send_all(int fd, const void *data, size_t bytes);
int trip_image_receive_all(int fd, void *data, size_t bytes);

/* The helper's connection in its own process. */
#define TRIP_IMAGE_HELPER_FD 3

#ifdef __cplusplus
}
#endif

#endif
