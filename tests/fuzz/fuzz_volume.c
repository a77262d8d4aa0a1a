/* Fuzzes complete volume files of every format. Memory must stay within the budget, and portions
 * inside the volume. The first byte chooses the file extension. */
#include "volume_file.h"

static const char *const extensions[] = { "nii", "vol", "vdb", "nrrd", "nii.gz", "nc" };

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (size >= 1)
        fuzz_volume_file(data + 1, size - 1,
                         extensions[data[0] % (sizeof extensions / sizeof *extensions)]);
    return 0;
}
