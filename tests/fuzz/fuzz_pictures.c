/* Fuzzes pictures and DICOM slices, which the helper program reads in a separate process. If the
 * helper fails or ends, this side must report the failure and continue.
 *
 * Each input starts a helper, so the fuzzer runs only one or two files a second. Reading in this
 * process would be faster but of no use. The libraries are not instrumented, so their code cannot
 * guide the fuzzer. A library that ends the process or leaks memory would also end the fuzzer. */
#include "volume_file.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    fuzz_volume_file(data, size, "picture");
    return 0;
}
