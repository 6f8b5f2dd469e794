/* vtk_to_nifti.c - vtk_to_nifti IN.vtk[.gz] OUT.nii[.gz]: see vtk_image.h. */
#include "vtk_image.h"

#include "../../examples/common/base/cli.h"

int main(int argc, char **argv)
{
    struct volume image;
    char error[VOLUME_TEXT];
    if (argc != 3) {
        return cli_fail("vtk_to_nifti", CLI_EXIT_USAGE, "expected IN.vtk[.gz] OUT.nii[.gz]");
    }
    if (!vtk_image_read(argv[1], &image)) {
        return cli_fail("vtk_to_nifti", CLI_EXIT_FAILURE, "%s: not an image of big-endian floats in legacy VTK", argv[1]);
    }
    const bool written = volume_write(argv[2], &image, VOLUME_FLOAT32, image.data, error);
    volume_free(&image);
    return written ? CLI_EXIT_OK : cli_fail("vtk_to_nifti", CLI_EXIT_FAILURE, "%s", error);
}
