"""test_image_reports.py - small images after reports of users (SPRINGLS_DATA/reports): segment, register and surfaces say what is right,
which each folder's README has."""
import glob
import itertools
import json
import math
import os
import subprocess
import sys
import tempfile
import unittest

REPORTS = os.path.join(os.environ.get('SPRINGLS_DATA', ''), 'reports')
MIDDLE = (0, 0, 0)  # of the brain in ct-padding, LPS+ mm


def report(program, *arguments):
    """Runs a program, and returns what it has found."""
    done = subprocess.run([f'build/{program}', *arguments, '--quiet', '--json', '-'], capture_output=True, text=True)
    if done.returncode:
        raise AssertionError(f'{program} {arguments}: {done.returncode} {done.stderr}')
    return json.loads(done.stdout)


def volumes(pattern, level):
    files = sorted(glob.glob(f'{REPORTS}/{pattern}'))
    return {os.path.basename(file): report('segment', file, '--level', str(level), '--init', 'threshold')['volume_ml'] for file in files}


@unittest.skipUnless(os.path.isdir(f'{REPORTS}/orientations') and os.path.exists('build/segment'), 'no collection, or no programs')
class Reports(unittest.TestCase):
    def test_orders_and_signs_of_axes_do_not_matter(self):
        found = volumes('orientations/*.nii.gz', 100)
        self.assertGreaterEqual(len(found), 3)
        for name, volume in found.items():
            self.assertAlmostEqual(volume, 2.706, delta=0.01, msg=name)

    def test_a_tilted_gantry_keeps_the_volume(self):
        found = volumes('gantry-tilt/*.nii.gz', -450)
        self.assertEqual(len(found), 2)
        for name, volume in found.items():
            self.assertAlmostEqual(volume, 113.1, delta=0.6, msg=name)

    def test_micrometres_are_known_by_any_name(self):
        found = volumes('nrrd-microns/*.nrrd', 500)
        self.assertEqual(found['ball_microns.nrrd'], found['ball_um.nrrd'])
        self.assertAlmostEqual(found['ball_mm.nrrd'] * 1e-9 / found['ball_um.nrrd'], 1, delta=1e-4)

    def test_another_scale_moves_nothing(self):
        small = f'{REPORTS}/register-scaled/small'
        found = report('register', f'{small}.nii.gz', f'{small}_twice.nii.gz')
        for row, numbers in enumerate(found['affine_mm_ras']):
            for column in range(4):
                self.assertAlmostEqual(numbers[column], row == column, delta=1e-5)
        self.assertLess(max(found['jacobian_max'] - 1, 1 - found['jacobian_min']), 1e-4)

    def test_neither_scale_nor_padding_hides_a_motion(self):
        """Places in the brain, 30 mm around its middle, move by (12, 9, -6) mm along LPS+ axes."""
        folder = f'{REPORTS}/ct-padding'
        with tempfile.TemporaryDirectory() as here:
            points = {}
            for side, shift in (('fixed', (0, 0, 0)), ('moving', (12, 9, -6))):
                points[side] = f'{here}/{side}.txt'
                places = [[m + s + d for m, s, d in zip(MIDDLE, shift, corner)] for corner in itertools.product((-30, 0, 30), repeat=3)]
                with open(points[side], 'w') as file:
                    print('point', len(places), *(' '.join(map(str, place)) for place in places), sep='\n', file=file)
            for name in ('moving', 'moving_plus1024', 'moving_pad2048'):
                with self.subTest(image=name):
                    found = report('register', f'{folder}/fixed.nii.gz', f'{folder}/{name}.nii.gz', '--fixed-points', points['fixed'],
                                   '--moving-points', points['moving'])
                    self.assertLess(found['points_after_mm']['max'], 0.3)
                    self.assertEqual(found['folded_voxels'], 0)

    def test_neighbouring_ids_above_what_a_float_holds_stay_two(self):
        with tempfile.TemporaryDirectory() as folder:
            found = report('surfaces', f'{REPORTS}/allen-ids/small_two_ids.nii.gz', '--out', folder, '--no-pictures')
        labels = [label['label'] for label in found['labels']]
        self.assertEqual(len(set(labels)), 2)
        self.assertGreater(min(labels), 1 << 24)
        self.assertTrue(all(math.isfinite(label['volume_ml']) and label['volume_ml'] > 0 for label in found['labels']))


if __name__ == '__main__':
    result = unittest.main(exit=False, verbosity=0).result
    bad = len(result.failures) + len(result.errors)
    print(f'Pass: {max(0, result.testsRun - bad - len(result.skipped))}, fail: {bad}, skip: {len(result.skipped)}.')
    sys.exit(bad != 0)
