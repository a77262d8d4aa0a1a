/* triptych-images: answers the requests of image_helper.h on descriptor 3, one after another, until
 * the connection closes. Every exception of the libraries becomes a reply. */
#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <memory>
#include <new>
#include <string>
#include <thread>
#include <vector>

#include <pthread.h>
#include <strings.h>
#include <unistd.h>

#include <OpenImageIO/imageio.h>

#include "connection.h"
#include "picture_file.h"
#include "sandbox.h"
#include "slice_stack.h"

namespace
{

/* Sends a warning to the other end. `line` has the form of common/report, "triptych: warning:
 * WHERE: why". */
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
    trip_connection_reply(TRIP_IMAGE_WARNING, 0, parts ? text.substr(0, colon) : "",
                          parts ? text.substr(colon + 2) : text, 0);
}

void reply_data(uint64_t bytes)
{
    trip_connection_reply(TRIP_IMAGE_DONE, 0, "", "", bytes);
}

/* Owns a descriptor that came with a request. */
class Descriptor
{
  public:
    ~Descriptor()
    {
        if (fd >= 0)
            ::close(fd);
    }
    int fd = -1;
};

class Session
{
  public:
    void answer(const trip_image_request &request, const std::string &path, int fd)
    {
        switch (request.task) {
        case TRIP_IMAGE_WRITE:
            return write_picture(request, path, fd);
        case TRIP_IMAGE_READ:
            return read_picture(request, path);
        case TRIP_IMAGE_OPEN_STACK:
            return open_stack(request, path);
        case TRIP_IMAGE_READ_SLICE:
            return read_slice(request);
        default:
            throw trip_connection_gone();
        }
    }
    ~Session()
    {
        stack_.reset();
        if (budget_)
            trip_budget_destroy(budget_);
    }

  private:
    void write_picture(const trip_image_request &request, const std::string &path, int fd)
    {
        const int64_t *n = request.numbers;
        const bool distances = n[3] == TRIP_IMAGE_FORM_DISTANCES;
        const trip_picture picture = { path,
                                       fd,
                                       (int)n[0],
                                       (int)n[1],
                                       { (trip_image_depth)n[2], n[3] == TRIP_IMAGE_FORM_RGB,
                                         (int)n[4], distances } };
        std::vector<float> row((size_t)n[0] * (distances ? 1 : 4));
        int64_t left = n[1];
        auto next_row = [&](float *pixels) {
            left--;
            trip_connection_receive(pixels, row.size() * sizeof(float));
            return true;
        };
        auto drain = [&] {
            while (left > 0)
                next_row(row.data());
        };
        try {
            trip_picture_write(picture, next_row);
        } catch (const trip_connection_gone &) {
            throw;
        } catch (...) {
            drain();
            throw;
        }
        reply_data(0);
    }

    void read_picture(const trip_image_request &request, const std::string &path)
    {
        trip_sandbox_limit_memory((uint64_t)request.numbers[0]);
        int width, height;
        if (request.numbers[1] == TRIP_IMAGE_FORM_DISTANCES) {
            bool integers;
            const std::vector<float> z = trip_distances_read(path, width, height, integers);
            const trip_image_distances head = { width, height, integers };
            reply_data(sizeof head + z.size() * sizeof(float));
            trip_connection_send(&head, sizeof head);
            return trip_connection_send(z.data(), z.size() * sizeof(float));
        }
        std::vector<float> rgba = trip_picture_read(path, width, height);
        trip_image_size size = { width, height };
        reply_data(sizeof size + rgba.size() * sizeof(float));
        trip_connection_send(&size, sizeof size);
        trip_connection_send(rgba.data(), rgba.size() * sizeof(float));
    }

    void open_stack(const trip_image_request &request, const std::string &path)
    {
        stack_.reset();
        if (!budget_ && trip_budget_create(&budget_, (uint64_t)request.numbers[0]) < 0)
            throw std::bad_alloc();
        trip_sandbox_limit_memory((uint64_t)request.numbers[0]);
        const trip_stack_choice choice = { request.numbers[1] != 0, (int)request.numbers[2],
                                           (int)request.numbers[3], (int)request.numbers[4] };
        trip_slice_files files = trip_slice_find(path, choice.allow_gaps);
        const bool dicom = files.kind == TRIP_IMAGE_DICOM;
        if (!dicom && choice.series)
            throw trip_slice_error(path,
                                   std::string("holds ") + trip_image_kind_name(files.kind) +
                                       "; --series requires DICOM",
                                   TRIP_USAGE);
        if (dicom)
            trip_check_entry(path, "channel", choice.channel, 1);
        stack_ = dicom ? trip_dicom_stack(path, files, budget_, choice)
                       : trip_picture_stack(files, budget_, choice);
        if (choice.allow_gaps && files.names[0] == path && !(dicom && stack_->dims[2] > 1))
            throw trip_slice_error(
                path, "is one file; --allow-gaps requires a stack of several files", TRIP_USAGE);
        trip_image_stack s = {};
        std::memcpy(s.dims, stack_->dims, sizeof s.dims);
        s.type = stack_->type;
        s.slope = stack_->slope;
        s.inter = stack_->inter;
        std::memcpy(s.index_to_world, stack_->index_to_world.m, sizeof s.index_to_world);
        std::memcpy(s.space, stack_->space, sizeof s.space);
        std::memcpy(s.up, stack_->up, sizeof s.up);
        std::memcpy(s.modality, stack_->modality, sizeof s.modality);
        s.oriented = stack_->oriented;
        s.uneven = !stack_->along.empty();
        std::snprintf(s.note, sizeof s.note, "%s", stack_->note.c_str());
        s.parts_bytes = (uint32_t)std::min<size_t>(stack_->parts.size(), TRIP_IMAGE_PARTS_MAX);
        s.helper_bytes = trip_budget_peak_bytes(budget_);
        const size_t along_bytes = stack_->along.size() * sizeof(double);
        reply_data(sizeof s + along_bytes + s.parts_bytes);
        trip_connection_send(&s, sizeof s);
        trip_connection_send(stack_->along.data(), along_bytes);
        trip_connection_send(stack_->parts.data(), s.parts_bytes);
    }

    void read_slice(const trip_image_request &request)
    {
        if (!stack_)
            throw trip_connection_gone();
        size_t bytes =
            (size_t)stack_->dims[0] * (size_t)stack_->dims[1] * trip_scalar_bytes(stack_->type);
        slice_.resize(bytes);
        stack_->read(request.numbers[0], slice_.data());
        reply_data(bytes);
        trip_connection_send(slice_.data(), bytes);
    }

    trip_budget *budget_ = nullptr;
    std::unique_ptr<trip_slice_stack> stack_;
    std::vector<char> slice_;
};

/* Set if an allocation failed. Libraries may report this failure in another way. */
bool memory_refused;

void on_memory_refused()
{
    memory_refused = true;
    throw std::bad_alloc();
}

/* Whether a library's message is about memory. */
bool speaks_of_memory(const std::string &why)
{
    static const char *const words[] = { "bad_alloc", "memory", "allocat" };
    return std::any_of(std::begin(words), std::end(words),
                       [&](const char *word) { return strcasestr(why.c_str(), word) != nullptr; });
}

void reply_failure(const std::string &where, const std::string &why, int status)
{
    bool ours = why.find("--memory") != std::string::npos;
    if (!ours && (memory_refused || speaks_of_memory(why)))
        trip_connection_reply(
            TRIP_IMAGE_FAILED, TRIP_ERROR, where,
            "needs more memory to decode than allowed; raise --memory, unless the file is "
            "corrupt",
            0);
    else
        trip_connection_reply(TRIP_IMAGE_FAILED, status, where, why, 0);
}

void answer_one(Session &session)
{
    std::string path;
    Descriptor file;
    const trip_image_request request = trip_connection_next(path, file.fd);
    memory_refused = false;
    trip_connection_decode(path);
    try {
        session.answer(request, path, file.fd);
    } catch (const trip_slice_error &e) {
        reply_failure(e.where, e.what(), e.status);
    } catch (const std::exception &e) {
        reply_failure(path, e.what(), TRIP_ERROR);
    }
}

/* Limits the threads. They decode one slice at a time, and their stacks count towards the helper's
 * memory. */
void set_up_threads()
{
    const int threads = (int)std::min(8u, std::max(1u, std::thread::hardware_concurrency()));
    pthread_attr_t attributes;
    pthread_attr_init(&attributes);
    pthread_attr_setstacksize(&attributes, (size_t)1 << 20);
    pthread_setattr_default_np(&attributes);
    pthread_attr_destroy(&attributes);
    OIIO::attribute("threads", threads);
    OIIO::attribute("exr_threads", threads);
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
    std::signal(SIGXFSZ, SIG_IGN); /* write() then fails with EFBIG */
    (void)trip_sandbox_enter();    /* continues without a sandbox if the kernel has none */
    set_up_threads();
    trip_connection_catch_abort();
    std::set_new_handler(on_memory_refused);
    trip_report_redirect(pass_warning, nullptr);
    Session session;
    try {
        for (;;)
            answer_one(session);
    } catch (const trip_connection_gone &) {
        return 0;
    }
}
