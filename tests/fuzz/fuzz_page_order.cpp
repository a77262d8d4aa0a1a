/* Fuzzes the descriptions of pages that ImageJ and OME write. Chosen pages must exist. The first
 * bytes choose the number of pages and the wanted channel and time. */
#include "page_order.h"

#include <cmath>

#include "report.h"
#include "slice_stack.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

namespace
{

void promise(bool kept)
{
    if (!kept)
        __builtin_trap();
}

void check(const trip_page_source &source, const trip_page_order &order)
{
    promise(order.pages.empty() || (int64_t)order.pages.size() <= source.pages);
    for (int64_t page : order.pages)
        promise(page >= 0 && page < source.pages);
    promise(order.sample >= 0 && order.sample < source.samples);
    for (double step : order.spacing)
        promise(step > 0 && std::isfinite(step));
    promise(std::isfinite(order.slope) && order.slope != 0 && std::isfinite(order.inter));
}

} // namespace

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    constexpr size_t head = 4;
    if (size < head)
        return 0;
    trip_report_redirect([](const char *, void *) {}, nullptr);
    const std::string text((const char *)data + head, size - head);
    const trip_page_source source = { "a/b.tif",           text,       1 + data[0],
                                      (data[1] & 16) != 0, { 2, 0.5 }, data[1] & 32 ? "in" : "none",
                                      1 + data[1] % 5,     data[2],    data[3] };
    try {
        check(source, trip_page_order_of(source));
    } catch (const trip_slice_error &) {
    }
    return 0;
}
