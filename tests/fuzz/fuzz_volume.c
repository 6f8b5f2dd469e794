/* fuzz_volume.c - files of images: read, or refused in a line. The first byte chooses the extension. */
#define _POSIX_C_SOURCE 200809L
#include "fuzz_file.h"
#include "../../examples/common/imaging/volume.h"

/* teem 1.12 leaks memory of its own on some broken headers of NRRD files. */
const char *__lsan_default_suppressions(void);
const char *__lsan_default_suppressions(void) { return "leak:libteem\n"; }

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static const char *const extensions[] = { ".nii", ".nii.gz", ".nrrd", ".nhdr", ".mha", ".mhd", ".hdr", "" };
    char path[256], error[VOLUME_TEXT] = "";
    struct volume volume;
    size_t i;
    int k;
    if (!size) return 0;
    fuzz_file_write(path, extensions[data[0] % 8], data + 1, size - 1);
    if (volume_read(path, size > 1 ? data[size - 1] % 3 : 0, &volume, error)) {
        for (k = 0; k < 3; k++) FUZZ_CHECK(volume.dims[k] > 0 && volume.spacing[k] > 0.0f);
        for (i = 0; i < volume_voxels(&volume); i++)
            FUZZ_CHECK(volume.data[i] >= volume.minimum && volume.data[i] <= volume.maximum);
    } else {
        fuzz_check_reason(error);
        FUZZ_CHECK(volume.data == NULL);
    }
    volume_free(&volume);
    unlink(path);
    return 0;
}
