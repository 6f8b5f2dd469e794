"""test_python.py - the module springls of Python: its doctests, what it refuses, and the two examples."""
import contextlib
import doctest
import io
import os
import re
import runpy
import sys
import tempfile
import unittest

try:
    import nibabel
    import numpy as np
    import springls
except ImportError as error:
    if error.name.split('.')[0] not in ('cffi', 'nibabel', 'numpy'):
        raise
    print(f'{error}\nPass: 0, fail: 0, skip: 1.')
    sys.exit()

HERE = os.path.dirname(os.path.abspath(__file__))


def ball(n=24, radius=7, **members):
    model = springls.Model((n, n, n), **members)
    model.set_implicit(lambda points: np.linalg.norm(points - n / 2, axis=1) - radius)
    return model


class Refused(unittest.TestCase):
    def assertFails(self, status, call, *args, **names):
        with self.assertRaises(springls.Error) as caught:
            call(*args, **names)
        self.assertEqual(caught.exception.status, 'SPRINGLS_' + status)
        self.assertTrue(str(caught.exception))

    def test_failures_have_status_and_sentence(self):
        self.assertFails('INVALID_ARGUMENT', springls.Model, (3, 24, 24))
        self.assertFails('EMPTY_MODEL', springls.Model((8, 8, 8)).set_level_set, np.ones((8, 8, 8)))
        self.assertFails('NON_FINITE', springls.Model((8, 8, 8)).set_level_set, np.full((8, 8, 8), np.nan))
        self.assertFails('BAD_MESH', springls.Model((8, 8, 8)).set_mesh, np.zeros((3, 3)), [(0, 1, 7)])
        self.assertFails('BAD_SNAPSHOT', ball().restore, b'not a snapshot')

    def test_shapes_are_checked(self):
        model = ball()
        for call in (lambda: model.set_level_set(np.ones((8, 8, 8))), lambda: model.set_mesh(np.zeros((4, 2)), [(0, 1, 2)]),
                     lambda: model.distance([1, 2, 3]), lambda: model.step(velocity_field=np.zeros((24, 24, 24, 2))),
                     lambda: model.raycast(np.zeros((2, 3)), np.zeros((1, 3))), lambda: model.combine('sum', ball()),
                     lambda: model.add_attribute('short', np.zeros(model.count - 1))):
            self.assertRaises(ValueError, call)
        self.assertRaises(TypeError, springls.Model, (24, 24, 24), no_such_member=1)
        self.assertRaises(KeyError, model.attribute, 'none')
        self.assertRaises(ValueError, model.set_mesh, np.zeros((4, 3)), [(0, 1.5, 2)])
        self.assertRaises(ValueError, model.set_labels, np.full(model.size, 2 ** 40))
        self.assertRaises(TypeError, springls.Model, (24.5, 24, 24))
        self.assertRaisesRegex(TypeError, 'contact', springls.params, contact='separate')
        self.assertFalse(model.particles(copy=False).flags.writeable)

    def test_exceptions_of_functions_are_raised_again(self):
        model, calls = ball(), []

        def fail(points, time):
            calls.append(len(points))
            raise ZeroDivisionError('mine')
        before = model.state_hash
        self.assertRaisesRegex(ZeroDivisionError, 'mine', model.step, dt=1, velocity=fail)
        self.assertEqual(model.state_hash, before)
        self.assertRaises(ValueError, model.step, dt=1, velocity=lambda points, time: points[1:])
        self.assertRaises(ValueError, model.step, dt=1, velocity=lambda points, time: points.T)
        self.assertRaises(RuntimeError, model.step, dt=1, velocity=lambda points, time: model.step(dt=1))
        model.step(dt=1, velocity=lambda points, time: 0 * points + 1)
        np.testing.assert_allclose(model.particles().mean(axis=0), 13, atol=0.05)


class Right(unittest.TestCase):
    def test_fields_move_as_functions_do(self):
        by_field, by_function = ball(), ball()
        x = np.arange(24, dtype='f4')
        field = np.stack(np.broadcast_arrays(x[:, None, None] / 24, x[None, :, None] / 48, x[None, None, :] * 0), axis=-1)
        by_field.step(dt=1, velocity_field=field)
        by_function.step(dt=1, velocity=lambda points, time: points * np.array([1 / 24, 1 / 48, 0], 'f4'))
        np.testing.assert_allclose(by_field.particles(), by_function.particles(), atol=1e-4)
        outward = ball()
        outward.step(dt=1, pressure_field=np.ones((24, 24, 24), order='C'))
        self.assertAlmostEqual(np.cbrt(outward.measure().volume / ball().measure().volume), 8 / 7, delta=0.01)

    def test_affine_maps(self):
        model = ball()
        shift = np.hstack([np.zeros((3, 3)), [[1], [0], [0]]])
        model.step(dt=2, mode='elastic', affine=lambda points, origins, time: np.broadcast_to(shift, (len(points), 3, 4)))
        np.testing.assert_allclose(model.particles().mean(axis=0), [14, 12, 12], atol=0.1)

    def test_volumes_are_not_copied(self):
        phi = ball().level_set()
        self.assertTrue(phi.flags.f_contiguous)
        for order in 'FC':
            model = springls.Model(phi.shape)
            model.set_level_set(np.array(phi, order=order))
            self.assertAlmostEqual(model.measure().volume, ball().measure().volume, delta=1)

    def test_nifti_places(self):
        affine = np.array([[0, -2, 0, 50], [2, 0, 0, -20], [0, 0, 3, 5], [0, 0, 0, 1.0]])
        model = springls.Model((24, 24, 24), affine=affine)
        model.set_labels(np.pad(np.ones((8, 8, 8), 'i4'), 8))
        np.testing.assert_allclose(model.extract_mesh().positions.mean(axis=0), affine[:3, :3] @ np.full(3, 11.5) + affine[:3, 3], atol=0.2)

    def test_views_and_rays(self):
        model = ball()
        np.testing.assert_array_equal(model.vertices(copy=False), model.vertices())
        hit = model.raycast([(12, 12, 0), (0, 0, 0)], [(0, 0, 1), (0, 0, -1)])
        self.assertAlmostEqual(hit.distance[0], 5, delta=0.02)
        self.assertEqual(hit.springl[1], -1)
        self.assertEqual(model.closest(np.zeros((0, 3))).point.shape, (0, 3))
        self.assertEqual(len(set(model.ids())), model.count)

    def test_paint_and_policies(self):
        model = ball()
        model.add_attribute('label', np.arange(model.count), policy=('copy', 'copy', 'share'))
        model.set_attribute('label', np.ones(model.count))
        self.assertEqual(model.attributes(), ['label'])
        self.assertEqual(model.attribute('label').min(), 1)
        model.remove_attribute('label')
        self.assertEqual(model.attributes(), [])
        self.assertRaises(ValueError, model.add_attribute, 'x', np.zeros(model.count), policy=('copy', 'mix', 'share'))

    def test_places_and_materials(self):
        model = ball()
        self.assertEqual(model.materials()['triangle'].min() >= 0, True)
        self.assertLess(model.errors()['place'].max(), 0.1)
        self.assertEqual(len(model.mesh_errors()), len(model.extract_mesh().positions))
        self.assertEqual(len(model.mesh_materials()), len(model.extract_mesh().positions))
        self.assertTrue(np.allclose(model.to_world(model.to_voxel([(1, 2, 3)])), [(1, 2, 3)]))
        self.assertEqual(set(model.provenance()['kind']), {0})
        self.assertEqual(model.surfels().shape, (model.count, 7))
        self.assertTrue(np.allclose(model.gradient([(20, 12, 12)]), [(1, 0, 0)], atol=0.02))
        heights = springls.interpolate_material(model.materials(), model.vertices().reshape(-1, 3))
        self.assertLess(abs(heights - model.particles()).max(), 0.01)

    def test_components_and_events(self):
        model = ball(components=1)
        model.combine_implicit('difference', lambda points: abs(points[:, 0] - 12) - 2)
        self.assertEqual(len(model.components()), 2)
        self.assertEqual([event.kind for event in model.events()], ['split'])
        self.assertLessEqual({body.id for body in model.components()}, set(model.component_ids()))
        self.assertNotEqual(*model.component_of([(7, 12, 12), (17, 12, 12)]))

    def test_world_units_and_progress(self):
        fractions = []
        model = springls.Model((24, 24, 24), spacing=0.5, progress=fractions.append)
        model.set_implicit(lambda points: np.linalg.norm(points - 6, axis=1) - 3)
        model.step(dt=1, velocity=lambda points, time: np.full_like(points, (0.5, 0, 0)))
        self.assertLess(abs(model.extract_mesh().positions.mean(axis=0) - (6.5, 6, 6)).max(), 0.02)
        model.step(dt=1, voxel_units=True, velocity=lambda points, time: np.full_like(points, (-1, 0, 0)))
        self.assertLess(abs(model.extract_mesh().positions.mean(axis=0) - (6, 6, 6)).max(), 0.02)
        self.assertEqual(fractions[-1], 1)
        stopped = springls.Model((24, 24, 24), progress=lambda fraction: True)
        with self.assertRaises(springls.Error) as caught:
            stopped.set_implicit(lambda points: np.linalg.norm(points - 12, axis=1) - 7)
        self.assertEqual(caught.exception.status, 'SPRINGLS_CANCELLED')

    def test_functions_may_convert_places(self):
        model = springls.Model((24, 24, 24), spacing=0.5, origin=3)
        model.set_implicit(lambda points: np.linalg.norm(model.to_voxel(points) - 12, axis=1) / 2 - 3)
        model.step(dt=1, velocity=lambda points, time: np.where(model.to_voxel(points) > 0, (0.25, 0, 0), np.nan))
        self.assertLess(abs(model.extract_mesh().positions.mean(axis=0) - (9.25, 9, 9)).max(), 0.02)

    def test_progress_cannot_use_the_model_and_raises(self):
        model = springls.Model((24, 24, 24), progress=lambda fraction: model.count)
        with self.assertRaisesRegex(RuntimeError, 'cannot use the model'):
            model.set_implicit(lambda points: np.linalg.norm(points - 12, axis=1) - 7)
        self.assertEqual(model.count, 0)

    def test_what_progress_raises_ends_with_its_call(self):
        fractions, failed = [], []

        def progress(fraction):
            fractions.append(fraction)
            if failed:
                raise KeyError('progress')
        model = springls.Model((24, 24, 24), progress=progress)

        def distance(points):
            failed.extend(fractions)
            if failed:
                raise ValueError('distance')
            return np.linalg.norm(points - 12, axis=1) - 7
        with self.assertRaisesRegex(ValueError, 'distance'):
            model.set_implicit(distance)
        self.assertEqual(len(fractions), 2)   # both have failed, the distance first
        failed.clear()
        model.set_implicit(lambda points: np.linalg.norm(points - 12, axis=1) - 7)

    def test_combinations_in_pieces(self):
        whole, pieces, other = ball(), ball(), ball(radius=4)
        other.write(0, other.vertices() + (6, 0, 0), other.particles() + (6, 0, 0))
        whole.combine('difference', other)
        pieces.combine_begin('difference', other)
        del other
        while not pieces.combine_continue(1e-4):
            pass
        self.assertEqual(pieces.state_hash, whole.state_hash)
        for combine in whole.combine_implicit, pieces.combine_implicit_begin:
            combine('union', lambda points: abs(points - 12).max(axis=1) - 6)
        self.assertFalse(pieces.combine_continue(0))
        self.assertTrue(pieces.combine_in_progress)
        self.assertTrue(pieces.combine_continue(1e9))
        self.assertFalse(pieces.combine_in_progress)
        self.assertEqual(pieces.state_hash, whole.state_hash)

    def test_all_of_the_interface_is_there(self):
        """What the module leaves out has its reason: a call of the header that is new is wrapped or named here."""
        left_out = {
            'for programs that draw frames': 'chunk_attribute chunks_begin chunks_continue chunks_create chunks_destroy chunks_lod '
                                             'chunks_update step_begin step_continue step_in_progress',
            'Python has functions of its own': 'implicit_box implicit_metasphere implicit_notched_sphere implicit_sphere implicit_torus',
            'the module does it': 'default_desc default_forces default_step_desc create_error threads_count threads_destroy version '
                                  'attribute_count',
            'of the C program': 'kernel_source fp_contract_detected pack_matrix stage_name',
            'inside step': 'advect max_speed',
            'read by other calls': 'generations material_triangle_count corner_materials find_seams',
        }
        with open(os.path.join(HERE, 'springls.h'), encoding='utf-8') as file:
            header = file.read().split('#endif /* SPRINGLS_H */')[0]
        calls = set(re.findall(r'^SPRINGLS_API [^;]*?\bspringls_(\w+)\(', header, re.M))
        with open(springls.__file__, encoding='utf-8') as file:
            used = set(re.findall(r'_lib\.springls_(\w+)', file.read())) | {'default_params', 'paper_params'}
        named = set(' '.join(left_out.values()).split())
        self.assertGreater(len(calls), 100)
        self.assertEqual(calls - used - named, set())
        self.assertEqual(named - calls, set())

    def test_bodies_of_a_tiling(self):
        def half(side):
            return lambda x: np.maximum(np.linalg.norm(x - 12, axis=1) - 7, side * (x[:, 0] - 12.3))
        tiling = springls.Tiling((24, 24, 24))
        tiling.add_implicit(4, half(1))
        cube = [(x, y, z) for z in (13.5, 20) for y in (2.5, 4.6) for x in (2.5, 9)]
        tiling.add_implicit(9, half(-1))
        quads = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
        self.assertTrue(tiling.add_mesh(12, cube, [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]).closed)
        self.assertEqual(tiling.labels, [4, 9, 12])
        body = tiling.body(4)
        body.add_attribute('warmth', np.arange(body.count), policy='copy')
        self.assertEqual(body.attribute('warmth').shape[0], body.count)
        saved, before, asked = tiling.snapshot(), tiling.state_hash, set()

        def flow(points, time, label, facing):
            asked.add((label, facing.shape == (len(points),)))
            return np.full_like(points, (0.25, 0, 0))
        report = tiling.step(dt=1, velocity=flow, wall_period=1)
        self.assertEqual(asked, {(0, True), (4, True), (9, True), (12, True)})
        self.assertGreater(report.faced, 50)
        self.assertTrue(np.isin(tiling.facing(4), (0, 9)).all())
        hit = tiling.closest_wall([(12, 12, 12)])
        self.assertEqual(hit.labels.tolist(), [[4, 9]])
        self.assertAlmostEqual(hit.distance[0], 0.55, delta=0.03)
        self.assertEqual(tiling.measure()['label'].tolist(), [4, 9, 12])
        tiling.restore(saved)
        self.assertEqual(tiling.state_hash, before)
        asked.clear()

        def flow_in_region(points, time, label, facing):
            asked.add((label, bool((points[:, 0] <= 9.5).all())))
            return np.full_like(points, (0.25, 0, 0))
        region = {'region_lower': (1, 1, 1), 'region_upper': (9.5, 5.5, 22)}   # the body 12, and some of 9
        tiling.step(dt=1, velocity=flow_in_region, integrator='euler', **region)
        self.assertIn((12, True), asked)
        self.assertEqual({inside for label, inside in asked}, {True})
        for wrong in ({'region_lower': (1, 1)[0]}, {'region_upper': (9, 5, 22, 1)}):
            with self.assertRaises((TypeError, IndexError)):
                tiling.step(dt=1, velocity=flow, **wrong)
        with self.assertRaises(springls.Error):
            tiling.step(dt=1, tension=1, **region)
        tiling.restore(saved)
        with self.assertRaises(ZeroDivisionError):
            tiling.step(dt=1, tension=1, tension_of=lambda low, high: 1 / 0)
        for film in (lambda low, high: 1 / 0, lambda low, high: ('melt', 0.5), lambda low, high: 'join', lambda low, high: ('join', None)):
            with self.assertRaises((ZeroDivisionError, ValueError, TypeError)):
                tiling.step(film=film, wall_period=1)
            self.assertEqual(tiling.state_hash, before)
        with self.assertRaises(springls.Error) as caught:
            tiling.join(4, 12)
        self.assertEqual(caught.exception.status, 'SPRINGLS_INVALID_ARGUMENT')
        tiling.join(4, 9)
        self.assertEqual(tiling.labels, [4, 12])
        self.assertEqual(body.count, tiling.body(4).count)
        with self.assertRaises(KeyError):
            tiling.body(9)
        self.assertGreater(tiling.memory_used, 1000)

    def test_a_body_at_work_keeps_its_tiling(self):
        def half(side):
            return lambda x: np.maximum(np.linalg.norm(x - 12, axis=1) - 7, side * (x[:, 0] - 12.3))
        tiling = springls.Tiling((24, 24, 24))
        tiling.add_implicit(4, half(1))
        tiling.add_implicit(9, half(-1))
        body, other, before = tiling.body(4), tiling.body(9), tiling.state_hash
        uses = [lambda: tiling.join(4, 9), lambda: tiling.body(9), lambda: other.count, lambda: body.count,
                lambda: other.step(dt=1, velocity=lambda points, time: points), lambda: tiling.restore(b'')]
        for use in uses:
            def flow(points, *rest):
                use()
                return np.zeros_like(points)
            for mover in (body, tiling):
                with self.assertRaisesRegex(RuntimeError, 'cannot use'):
                    mover.step(dt=1, velocity=flow)
        self.assertEqual(tiling.state_hash, before)
        self.assertEqual([body.count > 0, other.count > 0, tiling.labels], [True, True, [4, 9]])

    def test_tools(self):
        model = ball()
        model.combine('difference', ball(radius=4))
        self.assertEqual(model.measure().components, 2)
        model.restore(ball().snapshot())
        model.offset(1)
        self.assertAlmostEqual(np.cbrt(model.measure().volume / ball().measure().volume), 8 / 7, delta=0.01)


class Examples(unittest.TestCase):
    def run_example(self, name, *arguments):
        printed = io.StringIO()
        before, sys.argv = sys.argv, [name, *arguments]
        try:
            with contextlib.redirect_stdout(printed):
                return runpy.run_path(os.path.join(HERE, name)), printed.getvalue()
        finally:
            sys.argv = before

    def test_segment(self):
        with tempfile.TemporaryDirectory() as folder:
            places = np.stack(np.meshgrid(*[np.arange(64)] * 3, indexing='ij'), axis=-1)
            image = 100.0 * (np.linalg.norm((places - 31) / [20, 16, 12], axis=-1) < 1)
            nibabel.save(nibabel.Nifti1Image(image.astype('f4'), np.diag([1, 1, 2, 1])), folder + '/in.nii.gz')
            self.run_example('segment.py', folder + '/in.nii.gz', '50', folder + '/out.nii.gz')
            inside = nibabel.load(folder + '/out.nii.gz').get_fdata() > 0
            coarse = image[::2, ::2, ::2] > 0
            self.assertGreater(2 * (inside & coarse).sum() / (inside.sum() + coarse.sum()), 0.95)

    def test_track(self):
        names, printed = self.run_example('track.py')
        self.assertLess(names['way'].mean(), 0.01)
        self.assertIn('points came back', printed)


def load_tests(loader, tests, pattern):
    tests.addTests(doctest.DocTestSuite(springls))
    return tests


result = unittest.main(exit=False, verbosity=0).result
bad = len(result.failures) + len(result.errors)
print(f'Pass: {result.testsRun - bad}, fail: {bad}, skip: {len(result.skipped)}.')
sys.exit(bad != 0)
