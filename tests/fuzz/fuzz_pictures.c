/* Pictures and DICOM slices, read by the helper program in its own process: whatever they hold, the
 * helper's end included, this side reports it and goes on. A start of the helper each makes it
 * slow, one or two files a second. In this process it would be faster and no better: the libraries
 * are Debian's, not instrumented, so that nothing they do guides the fuzzer, and where they end the
 * process or keep memory they would end the fuzzer. */
#include "volume_file.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    fuzz_volume_file(data, size, "picture");
    return 0;
}
