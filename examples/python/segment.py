"""segment.py - segments a NIfTI image: a smooth surface where the image crosses a value.

    python3 build/python/segment.py IMAGE.nii.gz LOW OUT.nii.gz

The surface begins at the threshold LOW. It moves outward where the image is above LOW and inward where it is below, and curvature
makes it smooth: specks and holes of noise vanish. Every second voxel is read; OUT has 1 where those are inside.
"""
import sys

import nibabel
import numpy as np
import springls

image_file, low, out_file = sys.argv[1], float(sys.argv[2]), sys.argv[3]
image = nibabel.load(image_file).slicer[::2, ::2, ::2]
intensity = image.get_fdata(dtype=np.float32)
model = springls.Model(intensity.shape, affine=image.affine)
model.set_threshold(intensity, low)
model.remesh()
outward = np.clip((intensity - low) / intensity.std(), -1, 1)
for step in range(4):
    model.run(5, dt=0.5, pressure_field=outward, curvature=0.5, voxel_units=True)
    print(f'{model.count} springls, volume {model.measure().volume:.0f}, {model.measure().components} components')
nibabel.save(nibabel.Nifti1Image((model.level_set() < 0).astype(np.uint8), image.affine), out_file)
