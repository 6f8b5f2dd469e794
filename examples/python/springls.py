"""springls - Spring Level Sets for Python: deformable surfaces that are mesh, tracked points and level set at once.

A module of one file on cffi and numpy. `make python` puts it into build/python beside libspringls.so and springls.h, whose
declarations it reads: what a function does is described there. A Model holds a surface, a Tiling many that touch:

>>> import numpy as np, springls
>>> model = springls.Model((32, 32, 32))
>>> model.set_implicit(lambda points: np.linalg.norm(points - 16, axis=1) - 8)
>>> model.step(dt=4, velocity=lambda points, time: np.full_like(points, 0.5))
>>> model.extract_mesh().positions.mean(axis=0).round(1).tolist()
[18.0, 18.0, 18.0]

Volumes have shape (nx, ny, nz), as nibabel gives them, and are not copied when they are float32 with x fastest (order 'F').
Meshes, shapes, queries and forces are in world units (forces in voxels with voxel_units), springls in voxels. Points are arrays of
shape (n, 3).
Failures raise springls.Error. A model belongs to one thread at a time.
"""
import operator
import os
import re
import weakref
from types import SimpleNamespace

import cffi
import numpy as np

__all__ = ['Model', 'Tiling', 'Error', 'interpolate_material', 'params', 'version']

_HERE = os.path.dirname(os.path.abspath(__file__))
_ffi = cffi.FFI()


def _declarations():
    """Returns the declarations of springls.h without what only a C compiler understands."""
    with open(os.path.join(_HERE, 'springls.h'), encoding='utf-8') as file:
        text = file.read().split('#endif /* SPRINGLS_H */')[0]
    text = re.sub(r'/\*.*?\*/', '', text, flags=re.S)
    text = re.sub(r'^\s*#.*(\\\n.*)*$', '', text, flags=re.M)
    return re.sub(r'extern "C" \{|^\}$|SPRINGLS_API', '', text, flags=re.M)


_ffi.cdef(_declarations())
_lib = _ffi.dlopen(os.environ.get('SPRINGLS_LIBRARY', os.path.join(_HERE, 'libspringls.so')))
_threads = _lib.springls_threads_create(0)   # of all models, until the process ends; they sleep when no model works


class Error(RuntimeError):
    """Reports a call that failed: `status` is the name of the springls_status.

    >>> try: Model((2, 2, 2))
    ... except Error as error: error.status
    'SPRINGLS_INVALID_ARGUMENT'
    """

    def __init__(self, status, sentence):
        super().__init__(sentence)
        self.status = _ffi.string(_ffi.cast('springls_status', status))


def version():
    """Returns the version of the library, "major.minor.patch"."""
    return _ffi.string(_lib.springls_version_string()).decode()


def params(base='default', **members):
    """Returns springls_params: the 'default' or the 'paper' set with some members changed.

    >>> params(split_edge=2.5).split_edge
    2.5
    """
    if base not in ('default', 'paper'):
        raise ValueError(f"params: 'default' or 'paper', not {base!r}")
    return _fill(getattr(_lib, f'springls_{base}_params')(), members)


def _fill(struct, members):
    for name, value in members.items():
        if not hasattr(struct, name):
            raise TypeError(f'there is no member {name}')
        try:
            setattr(struct, name, value)
        except (TypeError, OverflowError) as error:
            raise type(error)(f'{name}: {error}') from None
    return struct


def _constant(group, name):
    try:
        return getattr(_lib, f'SPRINGLS_{group}_{name.upper()}')
    except AttributeError:
        raise ValueError(f'{group.lower()}: there is no {name!r}') from None


def _array(values, dtype, shape, order='C', name='array'):
    """Returns `values` as an array of that shape, where -1 stands for any length; copies only what has to be converted."""
    given = np.asarray(values)
    if given.ndim != len(shape) or any(want not in (-1, have) for want, have in zip(shape, given.shape)):
        raise ValueError(f'{name} has the shape {given.shape}, not {shape}' + ' (-1: any)' * (-1 in shape))
    array = np.require(given, dtype, requirements=order)
    if array.dtype.kind in 'iu' and not np.array_equal(array, given):
        raise ValueError(f'{name} has numbers that are not {array.dtype}')
    return array


def _pointer(array, kind='float[]'):
    """Points to the numbers of an array, which lives at least as long as the pointer."""
    return _ffi.from_buffer(kind, array.ravel(order='K'))


def _view(pointer, count, dtype, shape=(), stride=None, writeable=False):
    """Shows `count` rows at a pointer of the library as an array, without a copy."""
    row = np.dtype(dtype).itemsize * int(np.prod(shape, dtype=int))
    if count == 0 or pointer == _ffi.NULL:
        return np.empty((0,) + shape, dtype)
    stride = stride or row
    bytes_ = _ffi.buffer(_ffi.cast('char *', pointer), stride * (count - 1) + row)
    rows = np.ndarray((count,) + shape, dtype, bytes_, strides=(stride,) + np.empty(shape, dtype).strides)
    rows.flags.writeable = writeable
    return rows


_MATERIAL = np.dtype([('triangle', 'i4'), ('barycentric', 'f4', 3)])
_PLACE = np.dtype([('place', 'f4', 3), ('error', 'f4'), ('springl', 'i4'), ('id', 'u4')])
_PROVENANCE = np.dtype([('kind', 'i4'), ('age', 'i4'), ('generation', 'u4'), ('parent', 'u4')])
_ERRORS = np.dtype([('place', 'f4'), ('correspondence', 'f4')])
_HOLD = np.dtype([('label', 'i4'), ('target', 'f8'), ('volume', 'f8'), ('pressure', 'f8'), ('drift', 'f8')], align=True)
_WALL_HIT = np.dtype([('point', 'f4', 3), ('distance', 'f4'), ('labels', 'i4', 2)])
_BODY_MEASURES = np.dtype([('label', 'i4'), ('springls', 'i4'), ('voxels', 'i8'), ('volume', 'f8'), ('area', 'f8')])


def interpolate_material(materials, values, triangles=None):
    """Interpolates values of the original surface at material coordinates: values (3 corners a triangle, channels), or (vertices,
    channels) with the triangles (n, 3) of the mesh."""
    materials = np.require(materials, _MATERIAL, 'C')
    values = _array(values, 'f4', (-1, -1), name='values')
    corners = _ffi.NULL if triangles is None else _pointer(_array(triangles, 'i4', (-1, 3), name='triangles'), 'int[]')
    count = len(values) // 3 if triangles is None else len(triangles)
    out = np.empty((len(materials), values.shape[1]), 'f4')
    status = _lib.springls_interpolate_material(_ffi.from_buffer('springls_material[]', materials), len(materials), _pointer(values),
                                                values.shape[1], corners, count, _pointer(out))
    if status != _lib.SPRINGLS_OK:
        raise Error(status, 'interpolate_material: a place lies on no triangle of the values')
    return out


def _describe(size, spacing, origin, direction, affine, params, members):
    """Returns a springls_desc, the size of its grid, and what it borrows."""
    if affine is not None:
        affine = _array(affine, float, (4, 4), name='affine')
        spacing = np.linalg.norm(affine[:3, :3], axis=0)
        direction, origin = affine[:3, :3] / spacing, affine[:3, 3]
    desc, size = _ffi.new('springls_desc *'), tuple(operator.index(n) for n in size)
    desc.grid.size = size
    desc.grid.spacing = np.broadcast_to(spacing, 3).tolist()
    desc.grid.origin = np.broadcast_to(origin, 3).tolist()
    desc.grid.direction = np.zeros(9).tolist() if direction is None else np.ravel(direction).tolist()
    desc.params = chosen = _ffi.new('springls_params *', params or _lib.springls_default_params())
    _fill(chosen, members)
    desc.tasks = _lib.springls_threads_tasks(_threads)
    return desc, size, chosen


def _create(desc, kind, create, destroy):
    """Creates a model or a tiling; returns it, and its logger, which the library calls as long as it lives."""
    reasons = []

    @_ffi.callback('void(void *, int, const char *)')
    def log(_, level, message):
        if level == 1:
            reasons.append(_ffi.string(message).decode())

    desc.logger.log = log
    out = _ffi.new(kind)
    status = create(desc, out)
    if status != _lib.SPRINGLS_OK:
        raise Error(status, reasons[-1] if reasons else _ffi.string(_lib.springls_status_string(status)).decode())
    return _ffi.gc(out[0], destroy), log


class Model:
    """A deformable surface on a grid of `size` voxels.

    size: three numbers of voxels. spacing, origin: world units, one number or three. direction: 3x3, its columns are the axes
    of the grid. affine: 4x4 as nibabel has it, instead of these three. follow: the grid is a window that moves with the model
    (`window_offset`). params: springls.params(...); other keywords change members of it. One thread a processor works on
    it, all models have the same ones, and they change no bit of the results. progress(fraction): called in long calls; what is not
    false cancels the call, and what it raises is raised by that call. It cannot use the model.

    >>> Model((32, 32, 32), spacing=0.5, keep_edges=0).count
    0
    """

    def __init__(self, size, spacing=1, origin=0, direction=None, affine=None, follow=False, params=None, progress=None, **members):
        self._busy, self._raised, self._other = False, None, None
        desc, self.size, self._kept = _describe(size, spacing, origin, direction, affine, params, members)
        desc.follow = bool(follow)
        if progress:
            self._report = desc.progress.report = self._wrap_progress(progress)
        self._handle, self._log = _create(desc, 'springls_context **', _lib.springls_create, _lib.springls_destroy)

    @property
    def _ctx(self):
        if self._busy:
            raise RuntimeError('a function that the model calls cannot use the model')
        self._raised = None   # a call begins
        return self._handle

    def _wrap_progress(self, progress):
        model = weakref.proxy(self)   # no cycle: the library's model ends with the last name for this one

        def report(_, fraction):
            busy, model._busy = model._busy, True
            try:
                return bool(progress(fraction))
            except BaseException as error:
                model._raised = error
                return True
            finally:
                model._busy = busy
        return _ffi.callback('int(void *, float)', report, error=1)

    @property
    def window_offset(self):
        """How many voxels the grid has moved from where `origin` placed it: zeros without `follow`.

        >>> model = Model((32, 32, 32), follow=True)
        >>> model.set_implicit(lambda points: np.linalg.norm(points - 16, axis=1) - 6)
        >>> for _ in range(12): model.step(dt=1, velocity=lambda points, time: np.full_like(points, (1, 0, 0)))
        >>> offset = model.window_offset
        >>> offset[0] > 0 and offset[0] % 8 == 0 and offset[1:] == (0, 0)
        True
        """
        offset = _ffi.new('int[3]')
        _lib.springls_window_offset(self._ctx, offset)
        return tuple(offset)

    def _check(self, status):
        raised, self._raised = self._raised, None
        if raised is not None:
            raise raised
        if status != _lib.SPRINGLS_OK:
            raise Error(status, _ffi.string(_lib.springls_last_error(self._ctx)).decode())

    # ---- input ----

    def set_mesh(self, positions, triangles):
        """Sets the model from a triangle mesh, and returns what was found in it, a springls_mesh_report.

        >>> corners = np.array([(x, y, z) for x in (9, 23) for y in (9, 23) for z in (9, 23)], 'f4')
        >>> quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
        >>> cube = Model((32, 32, 32))
        >>> report = cube.set_mesh(corners, [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])
        >>> report.closed, report.components, round(report.volume)
        (True, 1, 2744)
        """
        positions = _array(positions, 'f4', (-1, 3), name='positions')
        triangles = _array(triangles, 'i4', (-1, 3), name='triangles')
        report = _ffi.new('springls_mesh_report *')
        self._check(_lib.springls_set_mesh(self._ctx, _pointer(positions), len(positions), 0,
                                           _pointer(triangles, 'int[]'), len(triangles), report))
        return report

    def set_level_set(self, phi):
        """Sets the model from a volume whose zero level is the surface, negative inside.

        >>> x, y, z = np.indices((32, 32, 32)) - 16.0
        >>> model = Model((32, 32, 32))
        >>> model.set_level_set(np.sqrt(x ** 2 + y ** 2 + z ** 2) - 8)
        >>> abs(model.level_set()[16, 16, 23] + 1) < 0.01
        True
        """
        self._check(_lib.springls_set_level_set(self._ctx, _pointer(_array(phi, 'f4', self.size, 'F', 'phi'))))

    def set_labels(self, labels, label=-1):
        """Sets the model from the voxels of a volume that equal `label`; -1: all that are not 0.

        >>> labels = np.zeros((32, 32, 32), 'i4'); labels[8:24, 8:24, 8:24] = 3
        >>> model = Model(labels.shape)
        >>> model.set_labels(labels, 3)
        >>> abs(model.measure().volume / 16 ** 3 - 1) < 0.03
        True
        """
        labels = _array(labels, 'i4', self.size, 'F', 'labels')
        self._check(_lib.springls_set_labels(self._ctx, _pointer(labels, 'int32_t[]'), label))

    def set_threshold(self, image, low, high=np.inf):
        """Sets the model from the voxels of a volume with low <= value <= high."""
        image = _array(image, 'f4', self.size, 'F', 'image')
        self._check(_lib.springls_set_threshold(self._ctx, _pointer(image), low, min(high, np.finfo('f4').max)))

    def set_implicit(self, distance):
        """Sets the model from a function that gives the signed distance at points (n, 3) in world units, negative inside."""
        with _Calls(self) as calls:
            evaluate = calls.wrap('void(void *, const float *, int, float *)', distance, (),
                                  lambda u, x, n, out: ((_points(x, n),), n, out))
            status = _lib.springls_set_implicit(calls.context, evaluate, _ffi.NULL)
        self._check(status)

    def set_springls(self, vertices, particles=None, correspondences=None):
        """Sets the model from springls in voxels: vertices (n, 3, 3), and (n, 3) each of particles and correspondences."""
        vertices = _array(vertices, 'f4', (-1, 3, 3), name='vertices')
        rest = [_ffi.NULL if a is None else _pointer(_array(a, 'f4', (len(vertices), 3))) for a in (particles, correspondences)]
        self._check(_lib.springls_set_springls(self._ctx, _pointer(vertices), *rest, len(vertices)))

    def set_reference(self):
        """Makes the present model the original surface."""
        self._check(_lib.springls_set_reference(self._ctx))

    def set_reference_mesh(self, positions, triangles):
        """Makes a mesh the original surface of the present model, and returns what was found in it."""
        positions = _array(positions, 'f4', (-1, 3), name='positions')
        triangles = _array(triangles, 'i4', (-1, 3), name='triangles')
        report = _ffi.new('springls_mesh_report *')
        self._check(_lib.springls_set_reference_mesh(self._ctx, _pointer(positions), len(positions), 0, _pointer(triangles, 'int[]'),
                                                     len(triangles), report))
        return report

    def write(self, first, vertices=None, particles=None):
        """Moves springls from number `first` on: vertices (n, 3, 3) and particles (n, 3) in voxels, or one of them.

        >>> ball = Model((32, 32, 32))
        >>> ball.set_implicit(lambda points: np.linalg.norm(points - 16, axis=1) - 8)
        >>> ball.write(0, ball.vertices() + 0.5, ball.particles() + 0.5)
        >>> ball.step()
        >>> ball.extract_mesh().positions.mean(axis=0).round(1).tolist()
        [16.5, 16.5, 16.5]
        """
        count = len(vertices if vertices is not None else particles)
        q = _ffi.NULL if vertices is None else _pointer(_array(vertices, 'f4', (count, 3, 3), name='vertices'))
        p = _ffi.NULL if particles is None else _pointer(_array(particles, 'f4', (count, 3), name='particles'))
        self._check(_lib.springls_write(self._ctx, first, count, q, p))

    def set_keep_mask(self, mask=None):
        """Sets which springls are kept as they are, (n,); None: none."""
        self._check(_lib.springls_set_keep_mask(self._ctx, _ffi.NULL if mask is None else
                                                _pointer(_array(mask, 'u1', (self.count,), name='mask'), 'uint8_t[]')))

    def reset(self):
        """Empties the model."""
        self._check(_lib.springls_reset(self._ctx))

    # ---- parameters ----

    @property
    def params(self):
        """The parameters in use, a springls_params."""
        return _lib.springls_get_params(self._ctx)

    def set_params(self, params=None, **members):
        """Replaces the parameters, and changes members of them.

        >>> model = Model((32, 32, 32))
        >>> model.set_params(split_edge=2.5)
        >>> model.params.split_edge
        2.5
        """
        chosen = _ffi.new('springls_params *', params or self.params)
        self._check(_lib.springls_set_params(self._ctx, _fill(chosen, members)))

    # ---- motion ----

    def step(self, dt=0, max_displacement=0, velocity=None, pressure=None, affine=None, velocity_field=None, pressure_field=None,
             curvature=0, mode='fluid', one_to_one=False, stop_at_topology=False, integrator='rk4', voxel_units=False, region=None):
        """Moves the surface for a time `dt` (0: as long as the fastest point takes for `max_displacement`).

        max_displacement: voxels; `dt` is divided into sub-steps in which no point moves further. 0: what suits the parameters, two
        voxels with the default set; negative: never divided.

        velocity(points, time) -> (n, 3), pressure(points, normals, time) -> (n,),
        affine(points, correspondences, time) -> (n, 3, 4):
        functions of places of the world, world units a unit of time. velocity_field: array (nx, ny, nz, 3), pressure_field:
        (nx, ny, nz), samples at the voxels. curvature: motion towards the centre of curvature, world units^2 a unit of time. mode:
        'fluid', 'elastic' or 'advect_only'. region: (lower, upper), the box of the world outside which nothing moves. voxel_units:
        places, normals, velocities, curvature and the region are in voxels of the lattice instead. An exception in a function ends
        the step and is raised again.

        >>> ball = Model((32, 32, 32))
        >>> ball.set_implicit(lambda points: np.linalg.norm(points - 16, axis=1) - 8)
        >>> field = np.zeros((32, 32, 32, 3), 'f4'); field[..., 0] = 0.5
        >>> ball.step(dt=4, velocity_field=field)
        >>> ball.extract_mesh().positions.mean(axis=0).round(1).tolist()
        [18.0, 16.0, 16.0]
        >>> ball.step(dt=1, pressure=lambda points, normals, time: np.ones(len(points)), region=((22, 0, 0), (32, 32, 32)))
        >>> measures = ball.measure()
        >>> bool(measures.lower[0] > 9.9), bool(measures.upper[0] > 26.5)
        (True, True)
        """
        self._drive(_lib.springls_step, **_without(locals(), 'self'))

    def run(self, steps, stop_at_rest=False, **forces):
        """Runs `steps` steps; the keywords are those of `step`, and rest_steps, rest_share, rest_displacement of springls_step_desc.
        stop_at_rest: ends when hardly a springl moves."""
        self._drive(lambda ctx, desc: _lib.springls_run(ctx, desc, steps), stop_at_rest=stop_at_rest, **forces)

    def _drive(self, call, dt=0, max_displacement=0, velocity=None, pressure=None, affine=None, velocity_field=None,
               pressure_field=None, curvature=0, mode='fluid', integrator='rk4', voxel_units=False, region=None, **members):
        forces = _ffi.new('springls_forces *')
        forces.curvature_weight = curvature
        forces.voxel_units = voxel_units
        forces.integrator = _constant('INTEGRATOR', integrator)
        if region is not None:
            forces.region_lower, forces.region_upper = (list(map(float, corner)) for corner in region)
        with _Calls(self) as calls:
            if velocity:
                forces.velocity = calls.wrap('springls_velocity_fn', velocity, (3,),
                                             lambda u, x, n, t, out: ((_points(x, n), t), n, out))
            if pressure:
                forces.pressure = calls.wrap('springls_pressure_fn', pressure, (),
                                             lambda u, x, m, n, t, out: ((_points(x, n), _points(m, n), t), n, out))
            if affine:
                forces.affine = calls.wrap('springls_affine_fn', affine, (3, 4),
                                           lambda u, x, a, n, t, out: ((_points(x, n), _points(a, n), t), n, out))
            if velocity_field is not None:
                samples = _array(np.transpose(velocity_field, (2, 1, 0, 3)), 'f4', self.size[::-1] + (3,), name='velocity_field')
                forces.velocity_grid.data = calls.keep(_pointer(samples), samples)
            if pressure_field is not None:
                samples = _array(pressure_field, 'f4', self.size, 'F', 'pressure_field')
                forces.pressure_grid.data = calls.keep(_pointer(samples), samples)
            desc = _fill(_ffi.new('springls_step_desc *'), dict(members, forces=forces, dt=dt, max_displacement=max_displacement,
                                                                mode=_constant('MODE', mode)))
            status = call(calls.context, desc)
        self._check(status)

    def settle(self, steps=100):
        """Runs steps in which no time passes until the model is at rest.

        >>> ball = Model((32, 32, 32))
        >>> ball.set_implicit(lambda points: np.linalg.norm(points - 16, axis=1) - 8)
        >>> ball.settle(); ball.at_rest
        True
        """
        self._check(_lib.springls_settle(self._ctx, steps))

    def stage(self, name):
        """Runs one stage alone: 'relax', 'contract', 'resample', 'evolve', 'rebuild', 'fill_gaps', 'unsigned_to_signed', 'track'."""
        self._check(_lib.springls_run_stage(self._ctx, _constant('STAGE', name)))

    # ---- reading ----

    at_rest = property(lambda self: _lib.springls_at_rest(self._ctx), doc='Whether all of the model sleeps.')
    stats = property(lambda self: _lib.springls_get_stats(self._ctx), doc='What has happened since the model was set.')

    def _convert(self, call, points):
        points = _array(points, 'f4', (-1, 3), name='points')
        out = np.empty_like(points)
        call(self._handle, _pointer(points), len(points), _pointer(out))   # also in a function that the model calls
        return out

    def to_voxel(self, points):
        """Converts places of the world, (n, 3), to voxels. Functions that the model calls may use it, but not while a tiling steps."""
        return self._convert(_lib.springls_to_voxel, points)

    def to_world(self, points):
        """Converts places in voxels, (n, 3), to the world. Functions that the model calls may use it, but not while a tiling steps."""
        return self._convert(_lib.springls_to_world, points)

    def _each(self, call, dtype, kind):
        """Returns what a call writes for each springl."""
        out = np.empty(self.count, dtype)
        self._check(call(self._ctx, _ffi.from_buffer(kind, out)))
        return out

    def _each_vertex(self, call, dtype, kind):
        """Returns what a call writes for each vertex of extract_mesh()."""
        mesh, ctx = _ffi.new('springls_mesh *'), self._ctx
        self._check(_lib.springls_extract_mesh(ctx, mesh))
        out = np.empty(mesh.vertex_count, dtype)
        status = call(ctx, mesh, _ffi.from_buffer(kind, out))
        _lib.springls_mesh_free(ctx, mesh)
        self._check(status)
        return out

    def errors(self):
        """Estimates the errors of place and correspondence of the springls, world units: records (n,)."""
        return self._each(_lib.springls_springl_errors, _ERRORS, 'springls_error_estimate[]')

    def mesh_errors(self):
        """Estimates the errors of the vertices of extract_mesh(): records (vertices,)."""
        return self._each_vertex(_lib.springls_mesh_errors, _ERRORS, 'springls_error_estimate[]')

    def provenance(self):
        """Returns kind, age, generation and parent of the springls: records (n,)."""
        return self._each(_lib.springls_get_provenance, _PROVENANCE, 'springls_provenance[]')

    def materials(self):
        """Returns the material coordinates of the particles: records (n,) of triangle and barycentric."""
        return self._each(_lib.springls_springl_materials, _MATERIAL, 'springls_material[]')

    def mesh_materials(self):
        """Returns the material coordinates of the vertices of extract_mesh(): records (vertices,)."""
        return self._each_vertex(_lib.springls_mesh_materials, _MATERIAL, 'springls_material[]')

    def surfels(self):
        """Returns surfels of the springls, world units: centre, normal and radius, (n, 7)."""
        return self._each(_lib.springls_extract_surfels, np.dtype(('f4', 7)), 'float[]')

    def index_of(self, ids):
        """Returns the indices of springls by their ids, (n,); -1: there is none any more.

        >>> ball = Model((32, 32, 32))
        >>> ball.set_implicit(lambda points: np.linalg.norm(points - 16, axis=1) - 8)
        >>> ball.index_of(ball.ids()[[5, 2]]).tolist()
        [5, 2]
        """
        ids = _array(ids, 'u4', (-1,), name='ids')
        out = np.empty(len(ids), 'i4')
        self._check(_lib.springls_index_of(self._ctx, _pointer(ids, 'uint32_t[]'), len(ids), _pointer(out, 'int[]')))
        return out

    def place_now(self, points):
        """Finds where points of the original surface are now: records (n,) of place, error, springl and id.

        >>> ball = Model((32, 32, 32))
        >>> ball.set_implicit(lambda points: np.linalg.norm(points - 16, axis=1) - 8)
        >>> ball.step(dt=4, velocity=lambda points, time: np.full_like(points, 0.5))
        >>> ball.place_now([(16, 16, 24)])['place'].round(1).tolist()
        [[18.0, 18.0, 26.0]]
        """
        points = _array(points, 'f4', (-1, 3), name='points')
        out = np.empty(len(points), _PLACE)
        self._check(_lib.springls_place_now(self._ctx, _pointer(points), len(points), _ffi.from_buffer('springls_material_place[]', out)))
        return out

    def gradient(self, points):
        """Samples the gradient of the distance at points of the world, (n, 3)."""
        points = _array(points, 'f4', (-1, 3), name='points')
        out = np.empty_like(points)
        self._check(_lib.springls_sample_gradient(self._ctx, _pointer(points), len(points), _pointer(out)))
        return out

    # ---- components: with components=1 ----

    def components(self):
        """Lists the bodies and cavities: objects with id, cavity, volume, area, center, correction.

        >>> ball = Model((32, 32, 32), components=1)
        >>> ball.set_implicit(lambda points: np.linalg.norm(points - 16, axis=1) - 8)
        >>> [(c.id, c.cavity, round(c.volume / 100)) for c in ball.components()]
        [(1, False, 21)]
        """
        out, count = _ffi.new('springls_component **'), _ffi.new('int *')
        self._check(_lib.springls_components(self._ctx, _ffi.cast('const springls_component **', out), count))
        return [_component(out[0][i]) for i in range(count[0])]

    def component_ids(self):
        """Returns the bodies that the springls belong to, (n,); 0: none."""
        pointer = _lib.springls_component_ids(self._ctx)
        return _view(pointer, self.count if pointer != _ffi.NULL else 0, 'u4').copy()

    def component_of(self, points):
        """Returns the bodies at points of the world, (n,); 0: none."""
        points = _array(points, 'f4', (-1, 3), name='points')
        out = np.empty(len(points), 'u4')
        self._check(_lib.springls_component_of(self._ctx, _pointer(points), len(points), _pointer(out, 'uint32_t[]')))
        return out

    def events(self):
        """Lists what has happened to components: objects with time, place, step, kind, cavity, before, after."""
        out, count = _ffi.new('springls_event **'), _ffi.new('int *')
        self._check(_lib.springls_events(self._ctx, _ffi.cast('const springls_event **', out), count))
        names = ('birth', 'split', 'merge', 'death')
        return [SimpleNamespace(time=e.time, place=tuple(e.place), step=e.step, kind=names[e.kind], cavity=e.cavity,
                                before=[_component(e.before[k]) for k in range(e.before_count)],
                                after=[_component(e.after[k]) for k in range(e.after_count)])
                for e in (out[0][i] for i in range(count[0]))]

    count = property(lambda self: _lib.springls_count(self._ctx), doc='Number of springls.')
    time = property(lambda self: _lib.springls_time(self._ctx), lambda self, t: _lib.springls_set_time(self._ctx, t), doc='Time.')
    state_hash = property(lambda self: _lib.springls_state_hash(self._ctx), doc='Hash of the state: equal states have equal ones.')
    memory_used = property(lambda self: _lib.springls_memory_used(self._ctx), doc='Bytes held.')

    def measure(self):
        """Measures the closed surface: volume, area, coverage, components, euler, and the corners lower and upper of its box, (3,)."""
        out = _ffi.new('springls_measures *')
        self._check(_lib.springls_measure(self._ctx, out))
        return SimpleNamespace(volume=out.volume, area=out.area, coverage=out.coverage, lower=np.array(list(out.lower), 'f4'),
                               upper=np.array(list(out.upper), 'f4'), components=out.components, euler=out.euler)

    def _rows(self, view, shape, copy):
        rows = _view(view.data, view.count, 'f4', shape, view.stride)
        return rows.copy() if copy else rows

    def vertices(self, copy=True):
        """Returns the corners of the springls in voxels, (n, 3, 3). copy=False: a view that the next change of the model ends."""
        return self._rows(_lib.springls_view_vertices(self._ctx), (3, 3), copy)

    def particles(self, copy=True):
        """Returns the particles of the springls in voxels, (n, 3); `copy` as in `vertices`."""
        return self._rows(_lib.springls_view_particles(self._ctx), (3,), copy)

    def correspondences(self, copy=True):
        """Returns where the particles come from on the original surface, in voxels, (n, 3); `copy` as in `vertices`."""
        return self._rows(_lib.springls_view_correspondences(self._ctx), (3,), copy)

    def ids(self):
        """Returns the numbers of the springls that no other springl of the model ever gets, (n,)."""
        return _view(_lib.springls_ids(self._ctx), self.count, 'u4').copy()

    def extract_mesh(self, soup=False):
        """Extracts the closed surface; soup: the springls. Arrays positions, normals, correspondences, springls, triangles."""
        mesh = _ffi.new('springls_mesh *')
        self._check((_lib.springls_extract_soup if soup else _lib.springls_extract_mesh)(self._ctx, mesh))
        n, points = mesh.vertex_count, ('positions', 'normals', 'correspondences')
        out = SimpleNamespace(springls=_view(mesh.springls, n, 'i4').copy(),
                              triangles=_view(mesh.triangles, mesh.triangle_count, 'i4', (3,)).copy(),
                              **{name: _view(getattr(mesh, name), n, 'f4', (3,)).copy() for name in points})
        _lib.springls_mesh_free(self._ctx, mesh)
        return out

    def level_set(self):
        """Returns phi as a volume (nx, ny, nz): the signed distance in voxels, clamped beyond the narrow band."""
        phi = np.empty(self.size, 'f4', 'F')
        self._check(_lib.springls_copy_level_set(self._ctx, _pointer(phi)))
        return phi

    def _sample(self, function, points, dtype, shape, kind):
        points = _array(points, 'f4', (-1, 3), name='points')
        out = np.empty((len(points),) + shape, dtype)
        self._check(function(self._ctx, _pointer(points), len(points), _pointer(out, kind)))
        return out

    def distance(self, points):
        """Samples the signed distance at world points."""
        return self._sample(_lib.springls_sample_distance, points, 'f4', (), 'float[]')

    def inside(self, points):
        """Finds whether world points are inside.

        >>> ball = Model((32, 32, 32))
        >>> ball.set_implicit(lambda points: np.linalg.norm(points - 16, axis=1) - 8)
        >>> ball.inside([(16, 16, 16), (1, 1, 1)]).tolist()
        [True, False]
        """
        return self._sample(_lib.springls_sample_inside, points, 'u1', (), 'uint8_t[]').astype(bool)

    def _hits(self, count, find):
        hits = _ffi.new('springls_hit[]', max(count, 1))
        self._check(find(hits))
        stride, columns = _ffi.sizeof('springls_hit'), {}
        for name, field in _ffi.typeof('springls_hit').fields:
            item = field.type.item if field.type.kind == 'array' else field.type
            dtype = np.dtype({'float': 'f4', 'int': 'i4', 'uint32_t': 'u4'}[item.cname])
            shape = (field.type.length,) if field.type.kind == 'array' else ()
            start = _ffi.cast('char *', hits) + field.offset
            columns[name] = _view(start, count, dtype, shape, stride).copy()
        return SimpleNamespace(**columns)

    def closest(self, points, soup=False):
        """Finds the closest place of the surface to world points. Arrays named as the members of springls_hit.

        >>> ball = Model((32, 32, 32))
        >>> ball.set_implicit(lambda points: np.linalg.norm(points - 16, axis=1) - 8)
        >>> hit = ball.closest([(16, 16, 30), (4, 16, 16)])
        >>> hit.distance.round(1).tolist(), hit.point.round(1).tolist()
        ([6.0, 4.0], [[16.0, 16.0, 24.0], [8.0, 16.0, 16.0]])
        """
        points = _array(points, 'f4', (-1, 3), name='points')
        return self._hits(len(points), lambda hits: _lib.springls_closest(self._ctx, int(soup), _pointer(points), len(points),
                                                                          hits))

    def raycast(self, origins, directions, max_distance=0, soup=False):
        """Finds the first place along rays within max_distance (0: any). Members as for `closest`; springl is -1 where nothing is
        hit.

        >>> ball = Model((32, 32, 32))
        >>> ball.set_implicit(lambda points: np.linalg.norm(points - 16, axis=1) - 8)
        >>> hit = ball.raycast([(16, 16, 0), (0, 0, 0)], [(0, 0, 1), (0, 0, 1)])
        >>> hit.point[0].round(1).tolist(), (hit.springl >= 0).tolist()
        ([16.0, 16.0, 8.0], [True, False])
        """
        origins = _array(origins, 'f4', (-1, 3), name='origins')
        directions = _array(directions, 'f4', origins.shape, name='directions')
        return self._hits(len(origins), lambda hits: _lib.springls_raycast(self._ctx, int(soup), _pointer(origins),
                                                                           _pointer(directions), len(origins), max_distance, hits))

    # ---- attributes: values that springls carry ----

    def add_attribute(self, name, values, policy='blend'):
        """Adds values that springls carry, (n,) or (n, channels). policy: 'copy', 'blend' or 'share' where springls come and go, or
        three of these: where they are split, filled in and merged.

        >>> ball = Model((32, 32, 32))
        >>> ball.set_implicit(lambda points: np.linalg.norm(points - 16, axis=1) - 8)
        >>> ball.add_attribute('height', ball.particles()[:, 2])
        >>> bool(abs(ball.mesh_attribute('height')[:, 0] - ball.extract_mesh().positions[:, 2]).max() < 0.1)
        True
        """
        values = np.asarray(values, 'f4')
        values = _array(values[:, None] if values.ndim == 1 else values, 'f4', (self.count, -1), name='values')
        if '\0' in name:
            raise ValueError('name has a null character')
        rules = [_constant('POLICY', rule) for rule in ([policy] * 3 if isinstance(policy, str) else policy)]
        text = _ffi.new('char[]', name.encode())
        desc = _ffi.new('springls_attribute_desc *', (text, values.shape[1], *rules))
        self._check(_lib.springls_add_attribute(self._ctx, desc, _pointer(values), _ffi.NULL))

    def _index(self, name):
        index = _lib.springls_find_attribute(self._ctx, name.encode())
        if index < 0:
            raise KeyError(name)
        return index

    def attribute(self, name):
        """Returns the values of an attribute, (n, channels).

        >>> ball = Model((32, 32, 32))
        >>> ball.set_implicit(lambda points: np.linalg.norm(points - 16, axis=1) - 8)
        >>> ball.add_attribute('height', ball.particles()[:, 2])
        >>> ball.step(dt=4, velocity=lambda points, time: np.full_like(points, 0.5))
        >>> bool(abs(ball.attribute('height')[:, 0] + 2 - ball.particles()[:, 2]).max() < 0.5)
        True
        """
        index, desc = self._index(name), _ffi.new('springls_attribute_desc *')
        self._check(_lib.springls_describe_attribute(self._ctx, index, desc))
        return self._rows(_lib.springls_view_attribute(self._ctx, index), (desc.channels,), True)

    def set_attribute(self, name, values):
        """Replaces the values of an attribute, (n,) or (n, channels)."""
        index, desc = self._index(name), _ffi.new('springls_attribute_desc *')
        self._check(_lib.springls_describe_attribute(self._ctx, index, desc))
        values = np.asarray(values, 'f4')
        values = _array(values[:, None] if values.ndim == 1 else values, 'f4', (self.count, desc.channels), name='values')
        self._check(_lib.springls_set_attribute(self._ctx, index, _pointer(values)))

    def remove_attribute(self, name):
        """Removes an attribute."""
        self._check(_lib.springls_remove_attribute(self._ctx, self._index(name)))

    def attributes(self):
        """Lists the names of the attributes."""
        desc, names = _ffi.new('springls_attribute_desc *'), []
        for index in range(_lib.springls_attribute_count(self._ctx)):
            self._check(_lib.springls_describe_attribute(self._ctx, index, desc))
            names.append(_ffi.string(desc.name).decode())
        return names

    def mesh_attribute(self, name):
        """Returns the values of an attribute at the vertices of extract_mesh(), (vertices, channels)."""
        index, desc, mesh = self._index(name), _ffi.new('springls_attribute_desc *'), _ffi.new('springls_mesh *')
        ctx = self._ctx
        self._check(_lib.springls_describe_attribute(ctx, index, desc))
        self._check(_lib.springls_extract_mesh(ctx, mesh))
        out = np.empty((mesh.vertex_count, desc.channels), 'f4')
        status = _lib.springls_mesh_attribute(ctx, mesh, index, _pointer(out))
        _lib.springls_mesh_free(ctx, mesh)
        self._check(status)
        return out

    # ---- tools ----

    def combine(self, operation, other):
        """Combines the solid with another model of the same grid: 'union', 'intersection' or 'difference'."""
        self._check(_lib.springls_combine(self._ctx, _constant('OPERATION', operation), other._ctx))

    def combine_begin(self, operation, other):
        """Begins what `combine` does; `combine_continue` does it. The other model is kept, and must not change until then."""
        self._check(_lib.springls_combine_begin(self._ctx, _constant('OPERATION', operation), other._ctx))
        self._other = other

    def combine_continue(self, seconds):
        """Goes on with a combination for about so long, and returns whether it is complete.

        >>> model, other = Model((32, 32, 32)), Model((32, 32, 32))
        >>> model.set_implicit(lambda points: np.linalg.norm(points - 16, axis=1) - 9)
        >>> other.set_implicit(lambda points: np.linalg.norm(points - (16, 16, 24), axis=1) - 5)
        >>> model.combine_begin('difference', other)
        >>> calls = 1
        >>> while not model.combine_continue(0): calls += 1
        >>> calls > 10
        True
        """
        done = _ffi.new('bool *')
        status = _lib.springls_combine_continue(self._ctx, seconds, done)
        if done[0]:
            self._other = None
        self._check(status)
        return done[0]

    @property
    def combine_in_progress(self):
        """Whether a combination has begun and is not complete."""
        return _lib.springls_combine_in_progress(self._ctx)

    def combine_implicit(self, operation, distance):
        """Combines the solid with a function as `set_implicit` takes it."""
        self._combine_implicit(_lib.springls_combine_implicit, operation, distance)

    def combine_implicit_begin(self, operation, distance):
        """Begins what `combine_implicit` does, and samples the function; `combine_continue` does the rest."""
        self._combine_implicit(_lib.springls_combine_implicit_begin, operation, distance)

    def _combine_implicit(self, call, operation, distance):
        with _Calls(self) as calls:
            evaluate = calls.wrap('void(void *, const float *, int, float *)', distance, (),
                                  lambda u, x, n, out: ((_points(x, n),), n, out))
            status = call(calls.context, _constant('OPERATION', operation), evaluate, _ffi.NULL)
        self._check(status)

    def follow_level_set(self, distance, reach=0.0, tolerance=0.0):
        """Replaces the level set by a function as `set_implicit` takes it, or by a volume, and keeps the springls near it."""
        desc = _ffi.new('springls_follow_desc *', {'reach': reach, 'tolerance': tolerance})
        with _Calls(self) as calls:
            if callable(distance):
                desc.fn = calls.wrap('void(void *, const float *, int, float *)', distance, (),
                                     lambda u, x, n, out: ((_points(x, n),), n, out))
            else:
                volume = _array(distance, 'f4', self.size, 'F', 'distance')
                desc.phi = _pointer(volume)
            status = _lib.springls_follow_level_set(calls.context, desc)
        self._check(status)

    def offset(self, distance):
        """Grows (distance > 0) or shrinks the solid, world units."""
        self._check(_lib.springls_offset(self._ctx, distance))

    def smooth(self, length, keep_volume=False):
        """Smooths away features smaller than `length`, world units."""
        self._check(_lib.springls_smooth(self._ctx, length, keep_volume))

    def remesh(self):
        """Makes springls of even size everywhere."""
        self._check(_lib.springls_remesh(self._ctx))

    def snapshot(self):
        """Returns the whole state as bytes, for `restore`.

        >>> ball = Model((32, 32, 32))
        >>> ball.set_implicit(lambda points: np.linalg.norm(points - 16, axis=1) - 8)
        >>> before, saved = ball.state_hash, ball.snapshot()
        >>> ball.step(dt=1, velocity=lambda points, time: points - 16)
        >>> ball.restore(saved)
        >>> ball.state_hash == before
        True
        """
        size = _ffi.new('size_t *')
        self._check(_lib.springls_snapshot(self._ctx, _lib.SPRINGLS_SNAPSHOT_KIND_ALL, _ffi.NULL, 0, size))
        block = bytearray(size[0])
        self._check(_lib.springls_snapshot(self._ctx, _lib.SPRINGLS_SNAPSHOT_KIND_ALL, _ffi.from_buffer(block), len(block), size))
        return bytes(block)

    def snapshot_delta(self, base, snapshot):
        """Returns the difference from one snapshot to another as bytes, for `snapshot_patch`: for undo of many strokes.

        >>> ball = Model((32, 32, 32))
        >>> ball.set_implicit(lambda points: np.linalg.norm(points - 16, axis=1) - 8)
        >>> before = ball.snapshot()
        >>> ball.step(dt=1, velocity=lambda points, time: points - 16)
        >>> delta = ball.snapshot_delta(ball.snapshot(), before)
        >>> ball.snapshot_patch(ball.snapshot(), delta) == before
        True
        """
        size = _ffi.new('size_t *')
        out = bytearray(len(snapshot) + 64)
        self._check(_lib.springls_snapshot_delta(self._ctx, _ffi.from_buffer(base), len(base), _ffi.from_buffer(snapshot),
                                                 len(snapshot), _ffi.from_buffer(out), len(out), size))
        return bytes(out[:size[0]])

    def snapshot_patch(self, base, delta):
        """Returns the snapshot that `snapshot_delta` was given, from its base and the difference."""
        size = _ffi.new('size_t *')
        base_, delta_ = _ffi.from_buffer(base), _ffi.from_buffer(delta)
        self._check(_lib.springls_snapshot_patch(self._ctx, base_, len(base), delta_, len(delta), _ffi.NULL, 0, size))
        out = bytearray(size[0])
        self._check(_lib.springls_snapshot_patch(self._ctx, base_, len(base), delta_, len(delta), _ffi.from_buffer(out), len(out), size))
        return bytes(out)

    def restore(self, snapshot):
        """Replaces the model by a snapshot."""
        self._check(_lib.springls_restore(self._ctx, _ffi.from_buffer(snapshot), len(snapshot)))


class _Body(Model):
    """A model that belongs to a tiling."""

    def __init__(self, tiling, label):
        self.size, self._tiling, self._label = tiling.size, tiling, label
        self._raised, self._other = None, None

    @property
    def _busy(self):
        """A tiling and its bodies are busy together: a call of one may free what another one's call works on."""
        return self._tiling._busy

    @_busy.setter
    def _busy(self, busy):
        self._tiling._busy = busy

    @property
    def _handle(self):
        context = _lib.springls_tiling_body(self._tiling._ctx, self._label)
        if context == _ffi.NULL:
            raise KeyError(self._label)
        return context


class Tiling:
    """Holds bodies that fill a space without gap or overlap, each under a label from 1 to 65,535; label 0 is what is around them.

    The arguments are those of Model. Each body is a Model: `tiling.body(label)`.

    >>> labels = np.zeros((32, 32, 32), 'i4'); labels[8:16, 8:24, 8:24] = 3; labels[16:24, 8:24, 8:24] = 7
    >>> tiling = Tiling(labels.shape)
    >>> tiling.set_labels(labels, smooth=2)
    >>> tiling.labels, bool((tiling.copy_labels() == labels).all())
    ([3, 7], True)
    >>> walls = tiling.extract()
    >>> sorted(set(map(tuple, walls.labels.tolist())))[:3]
    [(0, 3), (0, 7), (3, 0)]
    >>> tiling.closest_wall([(15, 16, 16)]).labels.tolist()
    [[3, 7]]
    >>> tiling.sample_labels([(12, 16, 16), (2, 2, 2)]).tolist()
    [3, 0]
    """

    def __init__(self, size, spacing=1, origin=0, direction=None, affine=None, params=None, **members):
        self._busy = False
        desc, self.size, self._kept = _describe(size, spacing, origin, direction, affine, params, members)
        self._handle, self._log = _create(desc, 'springls_tiling **', _lib.springls_tiling_create, _lib.springls_tiling_destroy)

    @property
    def _ctx(self):
        if self._busy:
            raise RuntimeError('a function that the tiling calls cannot use the tiling')
        return self._handle

    def _check(self, status):
        if status != _lib.SPRINGLS_OK:
            raise Error(status, _ffi.string(_lib.springls_tiling_last_error(self._ctx)).decode())

    def set_labels(self, labels, smooth=0):
        """Replaces all bodies by those of a label map (nx, ny, nz); smooth: passes of a filter, every voxel keeps its label."""
        labels = _array(labels, 'i4', self.size, 'F', 'labels')
        self._check(_lib.springls_tiling_set_labels(self._ctx, _pointer(labels, 'int32_t[]'), smooth))

    def add_implicit(self, label, distance):
        """Adds the body where a function of points (n, 3) in world units is negative, a signed distance."""
        with _Calls(self) as calls:
            evaluate = calls.wrap('void(void *, const float *, int, float *)', distance, (),
                                  lambda u, x, n, out: ((_points(x, n),), n, out))
            status = _lib.springls_tiling_add_implicit(calls.context, label, evaluate, _ffi.NULL)
        self._check(status)

    def add_mesh(self, label, positions, triangles):
        """Adds the body that a triangle mesh bounds, and returns what was found in it, a springls_mesh_report."""
        positions = _array(positions, 'f4', (-1, 3), name='positions')
        triangles = _array(triangles, 'i4', (-1, 3), name='triangles')
        report = _ffi.new('springls_mesh_report *')
        self._check(_lib.springls_tiling_add_mesh(self._ctx, label, _pointer(positions), len(positions), 0,
                                                  _pointer(triangles, 'int[]'), len(triangles), report))
        return report

    @property
    def labels(self):
        """The labels of the bodies, ascending."""
        return [_lib.springls_tiling_label(self._ctx, i) for i in range(_lib.springls_tiling_count(self._ctx))]

    def body(self, label):
        """Returns the model of a label, 0: that of all bodies together. KeyError, now or later: there is none."""
        body = _Body(self, label)
        return body if body._handle else None

    def facing(self, label):
        """Finds the label that each springl of a body faces; -1: not known."""
        out = np.empty(self.body(label).count, 'i4')
        self._check(_lib.springls_tiling_facing(self._ctx, label, _pointer(out, 'int32_t[]')))
        return out

    def step(self, dt=0, velocity=None, pressure=None, tension_of=None, film=None, held=None, integrator='rk4', **members):
        """Moves all bodies for a time `dt`; 0: walls settle. Returns what the step did.

        velocity(points, time, label, facing) -> (n, 3), pressure(points, normals, time, label, facing) -> (n,): of springls of one
        label, which face `facing` (n,); all in world units, or in voxels with voxel_units. tension: surface tension;
        tension_of(low, high): its factor between two labels. film(low, high) -> ('part' or 'join', thickness in voxels): what becomes
        of two that come near each other. held: the array of `hold`, whose volumes are held. Other keywords: members of
        springls_tiling_step_desc, as region_lower and region_upper, the box outside which velocity and pressure move nothing.

        >>> tiling = Tiling((32, 32, 32))
        >>> def half(side): return lambda x: np.maximum(np.linalg.norm(x - 16, axis=1) - 8, side * (x[:, 0] - 16))
        >>> tiling.add_implicit(1, half(1)); tiling.add_implicit(2, half(-1))
        >>> held = tiling.hold(1, 2)
        >>> for _ in range(9): report = tiling.step(dt=0.5, tension=1, held=held, integrator='euler')
        >>> bool(abs(held['volume'] / held['target'] - 1).max() < 0.01), report.joined
        (True, [])
        >>> report = tiling.step(film=lambda low, high: ('join', 0.5), wall_period=1)
        >>> report.joined, tiling.labels
        ([(1, 2)], [1])
        """
        desc = _ffi.new('springls_tiling_step_desc *', _lib.springls_default_tiling_step_desc())
        report = _ffi.new('springls_tiling_report *')
        with _Calls(self) as calls:
            if velocity:
                desc.velocity = calls.wrap('springls_tiling_fn', velocity, (3,), lambda u, b, out: (
                    (_points(b.batch.points, b.batch.count), b.batch.time, b.label, _view(b.facing, b.batch.count, 'i4')),
                    b.batch.count, out))
            if pressure:
                desc.pressure = calls.wrap('springls_tiling_fn', pressure, (), lambda u, b, out: (
                    (_points(b.batch.points, b.batch.count), _points(b.batch.normals, b.batch.count), b.batch.time, b.label,
                     _view(b.facing, b.batch.count, 'i4')), b.batch.count, out))
            if tension_of:
                desc.tension_of = calls.plain('springls_tension_fn', lambda u, low, high: tension_of(low, high), np.nan)
            if film:
                def film_of(u, low, high, thickness):
                    thickness[0] = np.nan   # refused, where the function fails: an enum of C has no number that is sure to be
                    kind, out = film(low, high)
                    kind = _constant('FILM', kind)
                    thickness[0] = out
                    return kind
                desc.film = calls.plain('springls_film_fn', film_of, 0)
            if held is not None:
                held = np.asarray(held)
                if held.dtype != _HOLD or held.ndim != 1 or not held.flags.c_contiguous or not held.flags.writeable:
                    raise ValueError('held is no array of Tiling.hold')
                desc.held, desc.held_count = calls.keep(_ffi.from_buffer('springls_tiling_hold[]', held), held), len(held)
            _fill(desc, dict(members, dt=dt, integrator=_constant('INTEGRATOR', integrator)))
            status = _lib.springls_tiling_step(calls.context, desc, report)
        self._check(status)

        def pairs(pointer, count):
            return [tuple(pair) for pair in _view(pointer, count, 'i4', (2,)).tolist()]
        return SimpleNamespace(vanished=_view(report.vanished, report.vanished_count, 'i4').tolist(),
                               met=pairs(report.met, report.met_count), parted=pairs(report.parted, report.parted_count),
                               joined=pairs(report.joined, report.joined_count),
                               **{name: getattr(report, name) for name in ('mirrored', 'faced', 'mean_gap', 'rms_gap', 'largest_gap')})

    @staticmethod
    def hold(*labels):
        """Returns an array for `step`, one entry a label: target (0: the volume at the next step), volume, pressure, drift."""
        held = np.zeros(len(labels), _HOLD)
        held['label'] = labels
        return held

    def join(self, label, other):
        """Makes one body, of the first label, of two that share a wall."""
        self._check(_lib.springls_tiling_join(self._ctx, label, other))

    def _sample(self, function, points, dtype, kind):
        points = _array(points, 'f4', (-1, 3), name='points')
        out = np.empty(len(points), dtype)
        self._check(function(self._ctx, _pointer(points), len(points), _ffi.from_buffer(kind, out)))
        return out

    def sample_labels(self, points):
        """Finds the labels of world points."""
        return self._sample(_lib.springls_tiling_sample_labels, points, 'i4', 'int32_t[]')

    def closest_wall(self, points):
        """Finds the closest place of any wall to world points: point, distance, and the two labels of that wall."""
        hits = self._sample(_lib.springls_tiling_closest_wall, points, _WALL_HIT, 'springls_wall_hit[]')
        return SimpleNamespace(**{name: hits[name].copy() for name in _WALL_HIT.names})

    def copy_labels(self):
        """Returns the label of every voxel (nx, ny, nz)."""
        labels = np.empty(self.size, 'i4', 'F')
        self._check(_lib.springls_tiling_copy_labels(self._ctx, _pointer(labels, 'int32_t[]')))
        return labels

    def measure(self):
        """Returns an array with label, springls, voxels, volume and area of each body."""
        out = np.zeros(len(self.labels), _BODY_MEASURES)
        self._check(_lib.springls_tiling_measure(self._ctx, _ffi.from_buffer('springls_tiling_measures[]', out)))
        return out

    def extract(self):
        """Returns all walls as one mesh: positions, triangles, two labels a triangle, edges where three or more meet, corners."""
        walls = _ffi.new('springls_walls *')
        self._check(_lib.springls_tiling_extract(self._ctx, walls))
        out = SimpleNamespace(positions=_points(walls.positions, walls.vertex_count).copy(),
                              triangles=_view(walls.triangles, walls.triangle_count, 'i4', (3,)).copy(),
                              labels=_view(walls.labels, walls.triangle_count, 'i4', (2,)).copy(),
                              edges=_view(walls.edges, walls.edge_count, 'i4', (2,)).copy(),
                              corners=_view(walls.corners, walls.corner_count, 'i4').copy())
        _lib.springls_walls_free(self._ctx, walls)
        return out

    def snapshot(self):
        """Returns all bodies as bytes, for `restore`."""
        size, kind = _ffi.new('size_t *'), _lib.SPRINGLS_SNAPSHOT_KIND_ALL
        self._check(_lib.springls_tiling_snapshot(self._ctx, kind, _ffi.NULL, 0, size))
        block = bytearray(size[0])
        self._check(_lib.springls_tiling_snapshot(self._ctx, kind, _ffi.from_buffer(block), len(block), size))
        return bytes(block)

    def restore(self, snapshot):
        """Replaces all bodies by those of a snapshot."""
        self._check(_lib.springls_tiling_restore(self._ctx, _ffi.from_buffer(snapshot), len(snapshot)))

    @property
    def state_hash(self):
        """A hash of all bodies."""
        return _lib.springls_tiling_state_hash(self._ctx)

    @property
    def memory_used(self):
        """Bytes that the tiling holds."""
        return _lib.springls_tiling_memory_used(self._ctx)


def _without(names, *left_out):
    return {name: value for name, value in names.items() if name not in left_out}


def _component(c):
    return SimpleNamespace(id=c.id, cavity=c.cavity, volume=c.volume, area=c.area, center=tuple(c.center), correction=c.correction)


def _points(pointer, count):
    return _view(pointer, count, 'f4', (3,))


class _Calls:
    """Holds what the library borrows during a call: callbacks, samples, and the first exception that a function raised."""

    def __init__(self, model):
        self.kept, self.error, self.model, self.context = [], None, model, model._ctx

    def __enter__(self):
        self.model._busy = True
        return self

    def __exit__(self, *_):
        self.model._busy = False
        if self.error is not None:
            raise self.error

    def keep(self, pointer, owner):
        self.kept.append(owner)
        return pointer

    def wrap(self, kind, function, shape, arguments):
        """Makes a C function of one that takes arrays and returns one row of `shape` a point. NaN ends a step that it fails in."""
        def called(*given):
            values, count, out = arguments(*given)
            rows = _view(out, count, 'f4', shape, writeable=True)
            try:
                rows[...] = _array(function(*values), 'f4', rows.shape, name='what the function returns')
            except BaseException as error:
                self.error = self.error or error
                rows[...] = np.nan
        callback = _ffi.callback(kind, called)
        return self.keep(callback, callback)

    def plain(self, kind, function, failed):
        """Makes a C function of one that takes and returns numbers; `failed` is what it returns where the function fails."""
        def called(*given):
            try:
                return function(*given)
            except BaseException as error:
                self.error = self.error or error
                return failed
        callback = _ffi.callback(kind, called)
        return self.keep(callback, callback)
