"""test_judges.py - what others have written beside the library and its programs: scikit-image's marching cubes, and scipy's trees
for the Dice and the distances of segment's report."""
import json
import os
import subprocess
import sys
import tempfile
import unittest

try:
    import nibabel
    import numpy as np
    import springls
    from scipy.spatial import cKDTree
    from skimage.measure import marching_cubes, mesh_surface_area
except ImportError as error:
    if error.name.split('.')[0] not in ('cffi', 'nibabel', 'numpy', 'scipy', 'skimage'):
        raise
    print(f'{error}\nPass: 0, fail: 0, skip: 1.')
    sys.exit()

SEGMENT = os.path.abspath('build/segment')


def volume(points, triangles):
    a, b, c = points[triangles].astype('f8').transpose(1, 0, 2)
    return abs(np.einsum('ij,ij->i', a, np.cross(b, c)).sum()) / 6


def spread(points, triangles, count=40000):
    """Points that are spread evenly over triangles."""
    a, b, c = points[triangles].astype('f8').transpose(1, 0, 2)
    chance = np.random.default_rng(18)
    share = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    i = chance.choice(len(triangles), count, p=share / share.sum())
    u, v = np.sort(chance.random((2, count, 1)), axis=0)
    return u * a[i] + (v - u) * b[i] + (1 - v) * c[i]


def shapes(n):
    c = n / 2 - 0.3
    yield 'ball', lambda p: np.linalg.norm(p - c, axis=1) - 9
    yield 'torus', lambda p: np.hypot(np.linalg.norm(p[:, :2] - c, axis=1) - 8, p[:, 2] - c) - 3.2
    yield 'box', lambda p: np.abs(p - c).max(axis=1) - 7.45
    yield 'two', lambda p: np.minimum(np.linalg.norm(p - c + 5, axis=1) - 4, np.linalg.norm(p - c - 5, axis=1) - 6)


class MarchingCubes(unittest.TestCase):
    """The same vertices, and volumes and areas as close as two tables of triangles are."""

    def compare(self, model):
        mesh, measures = model.extract_mesh(), model.measure()
        points, triangles, _, _ = marching_cubes(model.level_set(), 0.0, method='lorensen')
        self.assertLess(cKDTree(points).query(mesh.positions)[0].max(), 2e-3)
        self.assertLess(cKDTree(mesh.positions).query(points)[0].max(), 2e-3)
        self.assertAlmostEqual(volume(points, triangles) / measures.volume, 1, delta=2e-3)
        self.assertAlmostEqual(mesh_surface_area(points, triangles) / measures.area, 1, delta=2e-3)
        self.assertAlmostEqual(volume(mesh.positions, mesh.triangles) / measures.volume, 1, delta=1e-5)

    def test_shapes(self):
        for name, distance in shapes(32):
            with self.subTest(name):
                model = springls.Model((32, 32, 32))
                model.set_implicit(distance)
                self.compare(model)
                for _ in range(3):
                    model.step(dt=1, velocity=lambda p, t: 0.3 * np.sin(p[:, [1, 2, 0]] / 4))
                self.compare(model)


class Reports(unittest.TestCase):
    """Dice, mean distance and HD95 of build/segment, from its own files."""

    @unittest.skipUnless(os.path.exists(SEGMENT), 'build/segment has not been built')
    def test_segment(self):
        with tempfile.TemporaryDirectory() as folder:
            spacing = np.array([1.5, 1.0, 2.0])
            places = spacing * np.stack(np.meshgrid(*[np.arange(n) for n in (40, 48, 32)], indexing='ij'), axis=-1)
            found = np.linalg.norm((places - [29, 23, 31]) / [17, 14, 16], axis=-1)
            truth = np.linalg.norm((places - [31, 24, 30]) / [15, 15, 18], axis=-1) < 1
            affine = np.diag([*spacing, 1])
            nibabel.save(nibabel.Nifti1Image((200 - 100 * found).astype('f4'), affine), folder + '/in.nii.gz')
            nibabel.save(nibabel.Nifti1Image(truth.astype('u1'), affine), folder + '/truth.nii.gz')
            subprocess.run([SEGMENT, folder + '/in.nii.gz', '--level', '100', '--init', 'threshold', '--reference',
                            folder + '/truth.nii.gz', '--out', folder + '/out'], check=True, stdout=subprocess.DEVNULL)
            with open(folder + '/out/report.json') as file:
                report = json.load(file)
            labels = nibabel.load(folder + '/out/labels.nii.gz').get_fdata() > 0
            self.check_report(report, labels, truth, spacing)

    def check_report(self, report, labels, truth, spacing):
        dice = 2 * (labels & truth).sum() / (labels.sum() + truth.sum())
        numbers = against_reference(report)
        self.assertAlmostEqual(numbers['dice'], dice, delta=1e-6)
        a, b = (spread(*marching_cubes(mask.astype('f4'), 0.5, spacing=spacing)[:2]) for mask in (labels, truth))
        ab, ba = cKDTree(b).query(a)[0], cKDTree(a).query(b)[0]
        # scikit-image's surfaces are those of the label maps; segment's own is that of its level set, a part of a voxel beside.
        for name, own in (('hd95_to_reference_mm', np.percentile(ab, 95)), ('hd95_from_reference_mm', np.percentile(ba, 95))):
            self.assertAlmostEqual(numbers[name], own, delta=0.5 * spacing.max(), msg=name)
        self.assertEqual(numbers['hd95_mm'], max(numbers['hd95_to_reference_mm'], numbers['hd95_from_reference_mm']))


def against_reference(report):
    """The part of a report that compares, however deep it stands."""
    inner = report.values() if isinstance(report, dict) else report
    if isinstance(report, dict) and 'against_reference' in report:
        return report['against_reference']
    return next(filter(None, (against_reference(part) for part in inner if isinstance(part, (dict, list)))), None)


result = unittest.main(exit=False, verbosity=0).result
bad = len(result.failures) + len(result.errors)
print(f'Pass: {max(0, result.testsRun - bad - len(result.skipped))}, fail: {bad}, skip: {len(result.skipped)}.')
sys.exit(bad != 0)
