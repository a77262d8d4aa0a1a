/* Recognises files that are no volumes, from their first bytes and names. Any thread. */
#ifndef TRIP_OTHER_FILE_H
#define TRIP_OTHER_FILE_H

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef enum trip_other_kind {
    TRIP_OTHER_UNKNOWN,
    TRIP_OTHER_FOREIGN, /* other programs read it */
    /* Files of this program, or files that its options read: */
    TRIP_OTHER_FUNCTION, /* a transfer function */
    TRIP_OTHER_PATH,     /* a camera path */
    TRIP_OTHER_VIEW,     /* a stored view */
    TRIP_OTHER_SCRIPT,   /* events for the viewers */
    TRIP_OTHER_REPORT,   /* errors and times that `triptych accuracy` measured */
    TRIP_OTHER_INDEX,    /* the index of a data set */
} trip_other_kind;

/* Bytes of a file that the test needs. Fewer suffice for a shorter file. */
enum { TRIP_OTHER_HEAD_BYTES = 4096, TRIP_OTHER_TEXT_BYTES = 384 };

/* Sets `text` to a sentence without subject: "is a PLY mesh, not a volume; MeshLab opens it".
 * `head` holds the first bytes, decompressed, and is empty for a folder. Returns
 * TRIP_OTHER_UNKNOWN, with an empty text, if nothing is known. */
trip_other_kind trip_other_file_tell(const char *path, const unsigned char *head, size_t bytes,
                                     char text[TRIP_OTHER_TEXT_BYTES]);

#ifdef __cplusplus
}
#endif

#endif
