/* triptych-images: answers the requests of image_helper.h on descriptor 3, one after another, until
 * the connection ends. Every exception of the libraries ends up in a reply. */
#include <csignal>
#include <cstring>
#include <functional>
#include <memory>
#include <new>
#include <string>
#include <vector>

#include <unistd.h>

#include "image_helper.h"
#include "picture_file.h"
#include "slice_stack.h"

namespace
{

constexpr int connection = TRIP_IMAGE_HELPER_FD;

/* Nobody is there any more. */
struct Gone {
};

void send_bytes(const void *data, size_t bytes)
{
    if (!trip_image_send_all(connection, data, bytes))
        throw Gone();
}

void receive_bytes(void *data, size_t bytes)
{
    if (!trip_image_receive_all(connection, data, bytes))
        throw Gone();
}

void reply(uint32_t outcome, int status, std::string where, std::string why, uint64_t data_bytes)
{
    where.resize(std::min<size_t>(where.size(), 4000));
    why.resize(std::min<size_t>(why.size(), 4000));
    trip_image_reply r = { outcome, status, (uint32_t)where.size(), (uint32_t)why.size(),
                           data_bytes };
    send_bytes(&r, sizeof r);
    send_bytes(where.data(), where.size());
    send_bytes(why.data(), why.size());
}

void reply_data(uint64_t bytes)
{
    reply(TRIP_IMAGE_DONE, 0, "", "", bytes);
}

/* A line that common/report would print, "triptych: warning: WHERE: why". */
void pass_warning(const char *line, void *)
{
    std::string text = line;
    const std::string prefix = "triptych: warning: ";
    if (text.compare(0, prefix.size(), prefix) == 0)
        text.erase(0, prefix.size());
    while (!text.empty() && text.back() == '\n')
        text.pop_back();
    size_t colon = text.find(": ");
    bool parts = colon != std::string::npos;
    reply(TRIP_IMAGE_WARNING, 0, parts ? text.substr(0, colon) : "",
          parts ? text.substr(colon + 2) : text, 0);
}

class Session
{
  public:
    void answer(const trip_image_request &request, const std::string &path)
    {
        switch (request.task) {
        case TRIP_IMAGE_WRITE:
            return write_picture(request, path);
        case TRIP_IMAGE_READ:
            return read_picture(path);
        case TRIP_IMAGE_OPEN_STACK:
            return open_stack(request, path);
        case TRIP_IMAGE_READ_SLICE:
            return read_slice(request);
        default:
            throw Gone();
        }
    }
    ~Session()
    {
        stack_.reset();
        if (budget_)
            trip_budget_destroy(budget_);
    }

  private:
    void write_picture(const trip_image_request &request, const std::string &path)
    {
        const int64_t *n = request.numbers;
        const trip_picture picture = {
            path, (int)n[0], (int)n[1], { (trip_image_depth)n[2], n[3] != 0, (int)n[4] }
        };
        std::vector<float> row((size_t)n[0] * 4);
        int64_t left = n[1];
        auto next_row = [&](float *rgba) {
            left--;
            receive_bytes(rgba, row.size() * sizeof(float));
            return true;
        };
        auto drain = [&] {
            while (left > 0)
                next_row(row.data());
        };
        try {
            trip_picture_write(picture, next_row);
        } catch (const Gone &) {
            throw;
        } catch (...) {
            drain();
            throw;
        }
        reply_data(0);
    }

    void read_picture(const std::string &path)
    {
        int width, height;
        std::vector<float> rgba = trip_picture_read(path, width, height);
        trip_image_size size = { width, height };
        reply_data(sizeof size + rgba.size() * sizeof(float));
        send_bytes(&size, sizeof size);
        send_bytes(rgba.data(), rgba.size() * sizeof(float));
    }

    void open_stack(const trip_image_request &request, const std::string &path)
    {
        stack_.reset();
        if (!budget_ && trip_budget_create(&budget_, (uint64_t)request.numbers[0]) < 0)
            throw std::bad_alloc();
        trip_slice_files files = trip_slice_find(path);
        stack_ = files.kind == TRIP_IMAGE_DICOM ? trip_dicom_stack(files, budget_)
                                                : trip_picture_stack(files, budget_);
        trip_image_stack s = {};
        std::memcpy(s.dims, stack_->dims, sizeof s.dims);
        s.type = stack_->type;
        s.slope = stack_->slope;
        s.inter = stack_->inter;
        std::memcpy(s.index_to_world, stack_->index_to_world.m, sizeof s.index_to_world);
        s.helper_bytes = trip_budget_peak_bytes(budget_);
        reply_data(sizeof s);
        send_bytes(&s, sizeof s);
    }

    void read_slice(const trip_image_request &request)
    {
        if (!stack_)
            throw Gone();
        size_t bytes =
            (size_t)stack_->dims[0] * (size_t)stack_->dims[1] * trip_scalar_bytes(stack_->type);
        slice_.resize(bytes);
        stack_->read(request.numbers[0], slice_.data());
        reply_data(bytes);
        send_bytes(slice_.data(), bytes);
    }

    trip_budget *budget_ = nullptr;
    std::unique_ptr<trip_slice_stack> stack_;
    std::vector<char> slice_;
};

void answer_one(Session &session)
{
    trip_image_request request;
    receive_bytes(&request, sizeof request);
    std::string path(request.path_bytes, 0);
    receive_bytes(&path[0], path.size());
    try {
        session.answer(request, path);
    } catch (const trip_slice_error &e) {
        reply(TRIP_IMAGE_FAILED, e.status, e.where, e.what(), 0);
    } catch (const std::bad_alloc &) {
        reply(TRIP_IMAGE_FAILED, TRIP_ERROR, path, "no memory for it", 0);
    } catch (const std::exception &e) {
        reply(TRIP_IMAGE_FAILED, TRIP_ERROR, path, e.what(), 0);
    }
}

} // namespace

int main()
{
    /* Ctrl-C goes to the whole group; who asked decides what becomes of the request. */
    std::signal(SIGINT, SIG_IGN);
    std::signal(SIGTERM, SIG_IGN);
    std::signal(SIGXFSZ, SIG_IGN); /* a write that fails says so itself */
    trip_report_redirect(pass_warning, nullptr);
    Session session;
    try {
        for (;;)
            answer_one(session);
    } catch (const Gone &) {
        return 0;
    }
}
