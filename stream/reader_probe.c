#include "reader.h"

#include <semaphore.h>
#include <unistd.h>

#include "reader_state.h"

static void read_ended(trip_request *q)
{
    sem_post(q->owner);
}

/* Carries out the request with an engine of its own. */
static bool run(trip_engine engine, trip_request *q)
{
    const trip_engine_ops *ops;
    void *state;
    sem_t ended;
    if (trip_reader_start_engine(engine, 1, 1, &ops, &state) < 0)
        return false;
    sem_init(&ended, 0, 0);
    q->owner = &ended;
    q->done = read_ended;
    trip_request_start(q);
    ops->submit(state, q);
    while (sem_wait(&ended) != 0)
        continue;
    ops->destroy(state);
    sem_destroy(&ended);
    return q->fault == TRIP_REQUEST_OK;
}

bool trip_reader_probe(const trip_dataset *d, trip_engine engine, void *memory)
{
    const trip_list *list = &d->lists[0];
    uint64_t bytes = list->plane_bytes[TRIP_PLANE_VOXELS], page = UINT64_C(1)
                                                                  << d->header.page_log2;
    _Atomic bool refused = false;
    int fd = list->plane_fd[TRIP_PLANE_VOXELS];
    trip_source source = { .fd = fd,
                           .direct_fd = trip_reader_open_direct(fd),
                           .direct_refused = &refused,
                           .file_bytes = bytes,
                           .page_log2 = d->header.page_log2,
                           .checksums = list->page_checksums[TRIP_PLANE_VOXELS] };
    trip_request request = { .source = &source,
                             .data = memory,
                             .bytes = (size_t)(bytes < page ? bytes : page) };
    bool lands = bytes > 0 && run(engine, &request);
    if (source.direct_fd >= 0)
        close(source.direct_fd);
    return lands && !refused;
}
