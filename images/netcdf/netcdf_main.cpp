/* triptych-netcdf: answers the requests of image_helper.h about netCDF-4 files on descriptor 3, one
 * after another, until the connection closes. */
#include <csignal>
#include <memory>
#include <new>
#include <string>
#include <vector>

#include <unistd.h>

#include "connection.h"
#include "netcdf_file.h"
#include "report.h"
#include "sandbox.h"

namespace
{

class Session
{
  public:
    void answer(const trip_image_request &request, const std::string &path)
    {
        switch (request.task) {
        case TRIP_IMAGE_OPEN_NETCDF:
            return open(request, path);
        case TRIP_IMAGE_READ_SLICE:
            return read(request);
        default:
            throw trip_connection_gone();
        }
    }

  private:
    void open(const trip_image_request &request, const std::string &path)
    {
        std::string name((size_t)request.numbers[1], 0);
        trip_connection_receive(&name[0], name.size());
        trip_sandbox_limit_memory((uint64_t)request.numbers[0]);
        file_.reset();
        file_ = std::make_unique<trip_netcdf_file>(
            path, name, trip_netcdf_entry{ request.numbers[2], request.numbers[3] },
            (uint64_t)request.numbers[0]);
        const size_t placed = file_->coordinates.size() * sizeof(double);
        slice_.resize(file_->slice_bytes());
        trip_connection_reply(TRIP_IMAGE_DONE, 0, "", "", sizeof file_->about + placed);
        trip_connection_send(&file_->about, sizeof file_->about);
        trip_connection_send(file_->coordinates.data(), placed);
    }

    void read(const trip_image_request &request)
    {
        if (!file_)
            throw trip_connection_gone();
        file_->read(request.numbers[0], slice_.data());
        trip_connection_reply(TRIP_IMAGE_DONE, 0, "", "", slice_.size());
        trip_connection_send(slice_.data(), slice_.size());
    }

    std::unique_ptr<trip_netcdf_file> file_;
    std::vector<char> slice_;
};

void answer_one(Session &session)
{
    std::string path;
    int fd = -1;
    const trip_image_request request = trip_connection_next(path, fd);
    if (fd >= 0)
        ::close(fd);
    try {
        session.answer(request, path);
    } catch (const std::bad_alloc &) {
        trip_connection_reply(
            TRIP_IMAGE_FAILED, TRIP_ERROR, path,
            "needs more memory to decode than allowed; raise --memory, unless the file is "
            "corrupt",
            0);
    } catch (const std::exception &e) {
        trip_connection_reply(TRIP_IMAGE_FAILED, TRIP_ERROR, path, e.what(), 0);
    }
}

} // namespace

int main()
{
    /* Ctrl-C and the end of a terminal signal the whole process group. The other end decides
     * whether to end a request. */
    std::signal(SIGINT, SIG_IGN);
    std::signal(SIGHUP, SIG_IGN);
    std::signal(SIGQUIT, SIG_IGN);
    std::signal(SIGTERM, SIG_IGN);
    (void)trip_sandbox_enter(); /* continues without a sandbox if the kernel has none */
    Session session;
    try {
        for (;;)
            answer_one(session);
    } catch (const trip_connection_gone &) {
        return 0;
    }
}
