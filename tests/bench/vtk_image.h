/* vtk_image.h - reads what scalismo's tori are kept in: legacy VTK files, STRUCTURED_POINTS of big-endian floats, gzipped
 * or not. VTK has no orientation of a patient: its axes are taken as they are. */
#ifndef TESTS_BENCH_VTK_IMAGE_H
#define TESTS_BENCH_VTK_IMAGE_H

#include "../../examples/common/imaging/volume.h"

#include <zlib.h>

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

/* False, and an empty volume: not such a file. */
static bool vtk_image_read(const char *path, struct volume *image)
{
    char line[256];
    int dims[3] = {0, 0, 0}, lines = 0;
    float spacing[3] = {0}, origin[3] = {0};
    bool binary = false, points = false, floats = false, good = false;
    gzFile file = gzopen(path, "rb");
    memset(image, 0, sizeof *image);
    while (file && !good && lines++ < 32 && gzgets(file, line, sizeof line)) {
        binary = binary || strncmp(line, "BINARY", 6) == 0;
        points = points || strncmp(line, "DATASET STRUCTURED_POINTS", 25) == 0;
        floats = floats || (strncmp(line, "SCALARS", 7) == 0 && strstr(line, " float"));
        sscanf(line, "DIMENSIONS %d %d %d", &dims[0], &dims[1], &dims[2]);
        sscanf(line, "SPACING %f %f %f", &spacing[0], &spacing[1], &spacing[2]);
        sscanf(line, "ORIGIN %f %f %f", &origin[0], &origin[1], &origin[2]);
        good = strncmp(line, "LOOKUP_TABLE", 12) == 0;
    }
    for (int a = 0; a < 3; ++a) {
        good = good && dims[a] > 0 && dims[a] <= 1024 && spacing[a] > 0.0f && isfinite(spacing[a]) && isfinite(origin[a]);
    }
    good = good && binary && points && floats && volume_create(dims, spacing, origin, image);
    const size_t voxels = good ? volume_voxels(image) : 0, bytes = 4 * voxels;
    good = good && gzread(file, image->data, (unsigned)bytes) == (int)bytes;
    for (size_t n = 0; good && n < voxels; ++n) {
        unsigned char b[4];
        memcpy(b, &image->data[n], 4);
        const uint32_t word = (uint32_t)b[0] << 24 | (uint32_t)b[1] << 16 | (uint32_t)b[2] << 8 | (uint32_t)b[3];
        memcpy(&image->data[n], &word, 4);
        image->minimum = n == 0 ? image->data[n] : fminf(image->minimum, image->data[n]);
        image->maximum = n == 0 ? image->data[n] : fmaxf(image->maximum, image->data[n]);
    }
    if (file) {
        gzclose(file);
    }
    if (!good) {
        volume_free(image);
    }
    return good;
}

#endif
