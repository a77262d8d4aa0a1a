#include "absent_value.h"

#include <cstdint>
#include <memory>

#include <tiffio.h>

#include "text.h"

bool trip_absent_value(const std::string &file, double &value)
{
    constexpr uint32_t tag = 42113;
    const std::unique_ptr<TIFF, void (*)(TIFF *)> tiff(TIFFOpen(file.c_str(), "r"), TIFFClose);
    uint32_t count = 0;
    const char *text = nullptr;
    if (!tiff)
        return false;
    const TIFFField *field = TIFFFindField(tiff.get(), tag, TIFF_ASCII);
    if (!field || !TIFFFieldPassCount(field) || !TIFFGetField(tiff.get(), tag, &count, &text) ||
        !text || count > 100)
        return false;
    std::string number(text, count);
    number.erase(number.find_last_not_of(std::string(" \t\r\n\0", 5)) + 1);
    number.erase(0, number.find_first_not_of(" \t"));
    return trip_text_to_double(number.c_str(), &value);
}
