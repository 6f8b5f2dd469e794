#!/usr/bin/python3
"""smooth_truth.py - how far surfaces of `atlas segment` lie from a smooth truth that is known exactly: made scans of 14 bent
ellipsoids, of which 10 are the atlas. Prints the rows of docs/atlas.md.

    tests/bench/smooth_truth.py [FOLDER]      wants build/atlas and build/surfaces, numpy and nibabel; about a minute of a processor"""
import pathlib
import subprocess
import sys
import tempfile

import nibabel
import numpy

ATLAS, SCANS, SIDE = 10, 4, 40   # subjects, unseen scans, voxels of 1 mm a side
BLUR, NOISE = 0.6, 0.05          # of a scan: width of the change at the surface, mm; deviation, where the object's contrast is 1


class Shape:
    """A ball of 11 mm, stretched and bent: inside where `values` is below zero."""

    def __init__(self, random):
        self.stretch = numpy.array([1.3, 0.9, 0.8]) * numpy.exp(random.normal(0, 0.06, 3))
        self.bends = random.normal(0, 0.08, 5)
        self.middle = random.normal(0, 1, 3)

    def values(self, points):
        x, y, z = numpy.moveaxis((points - self.middle) / self.stretch, -1, 0)
        length = numpy.sqrt(x * x + y * y + z * z) + 1e-9
        x, y, z = x / length, y / length, z / length
        bends = (x * y, y * z, x * z, x * x - y * y, x * x * x)
        return length - 11 * (1 + sum(b * f for b, f in zip(self.bends, bends)))

    def distances(self, points):
        """To the surface, by three steps of Newton's iteration along the gradient; negative inside."""
        at = points.copy()
        for _ in range(3):
            value = self.values(at)
            slope = numpy.stack([(self.values(at + d) - self.values(at - d)) / 2e-3 for d in 1e-3 * numpy.eye(3)], -1)
            at -= (value / (slope ** 2).sum(-1))[..., None] * slope
        return numpy.copysign(numpy.linalg.norm(points - at, axis=-1), self.values(points))


AFFINE = numpy.eye(4)
AFFINE[:3, 3] = -(SIDE - 1) / 2


def places():
    axis = numpy.arange(SIDE) - (SIDE - 1) / 2
    return numpy.stack(numpy.meshgrid(axis, axis, axis, indexing='ij'), -1)


def write(folder, name, shape, random):
    distance = shape.distances(places())
    scan = 1 / (1 + numpy.exp(distance / BLUR)) + random.normal(0, NOISE, distance.shape)
    for kind, data in (('images', scan.astype(numpy.float32)), ('labels', (distance < 0).astype(numpy.uint8))):
        nibabel.Nifti1Image(data, AFFINE).to_filename(folder / kind / f'{name}.nii.gz')


def vertices(path):
    """The places of a PLY file whose vertices begin with x, y, z."""
    data = path.read_bytes()
    head, body = data.split(b'end_header\n', 1)
    vertex = head[head.index(b'element vertex'):].split(b'element')[1]
    count, size = int(vertex.split()[1]), 4 * vertex.count(b'property float') + vertex.count(b'property uchar')
    rows = numpy.frombuffer(body, 'u1', count * size).reshape(count, size)
    return numpy.ascontiguousarray(rows[:, :12]).view('<f4').astype(float)


def faces(path):
    """The middles of the faces between voxels inside and outside."""
    inside = nibabel.load(path).get_fdata() > 0
    found = []
    for axis in range(3):
        low = numpy.argwhere(numpy.diff(inside.astype(int), axis=axis)).astype(float)
        low[:, axis] += 0.5
        found.append(low + AFFINE[:3, 3])
    return numpy.concatenate(found)


def run(*command):
    subprocess.run([str(c) for c in command], check=True, stdout=subprocess.DEVNULL)


def measure(folder):
    random = numpy.random.default_rng(1)
    for kind in ('images', 'labels'):
        (folder / kind).mkdir(parents=True, exist_ok=True)
    shapes = [Shape(random) for _ in range(ATLAS + SCANS)]
    for number, shape in enumerate(shapes):
        write(folder, f's{number:02d}', shape, random)
    subjects = [folder / f'labels/s{number:02d}.nii.gz' for number in range(ATLAS)]
    run('build/atlas', 'build', *subjects, '--images', folder / 'images', '--rounds', 1, '--quiet', '--out', folder / 'atlas')
    rows = {'faces of the voxels found': [], '`surfaces` of the voxels found': [], '`atlas segment`: springls': []}
    for number in range(ATLAS, ATLAS + SCANS):
        out, scan = folder / f'out{number}', folder / f'images/s{number:02d}.nii.gz'
        run('build/atlas', 'segment', scan, '--atlas', folder / 'atlas/atlas.json', '--quiet', '--out', out)
        run('build/surfaces', out / 'labels.nii.gz', '--quiet', '--out', out / 'smooth')
        points = faces(out / 'labels.nii.gz'), vertices(next((out / 'smooth').glob('*.ply'))), vertices(out / 'surface.ply')
        for row, place in zip(rows.values(), points):
            row.append(numpy.abs(shapes[number].distances(place)))
    for name, distances in rows.items():
        all_of_them = numpy.concatenate(distances)
        print(f'| {name} | {all_of_them.mean():.3f} | {numpy.percentile(all_of_them, 95):.3f} | {all_of_them.max():.2f} |')


if __name__ == '__main__':
    if len(sys.argv) > 1:
        measure(pathlib.Path(sys.argv[1]))
    else:
        with tempfile.TemporaryDirectory() as temporary:
            measure(pathlib.Path(temporary))
