"""gltf_check.py FILE.glb ...: what Khronos' glTF-Validator would complain of in binary glTF 2.0 files, and this program's own
demand that nothing is unused. Asks the validator itself where build/npm has it (.ci/deps.sh judges). Prints one line a problem and
ends with 1; with 77 where numpy is missing, or without files where the validator is."""
import json, os, shutil, struct, subprocess, sys
try:
    import numpy as np
except ImportError:
    sys.exit(77)

COMPONENTS = {5121: 'u1', 5123: '<u2', 5125: '<u4', 5126: '<f4'}
WIDTHS = {'SCALAR': 1, 'VEC2': 2, 'VEC3': 3, 'VEC4': 4, 'MAT4': 16}
NPM = os.path.join(os.path.dirname(os.path.abspath(__file__)), '..', '..', 'build', 'npm', 'node_modules')
VALIDATE = """
const v = require(process.argv[1] + '/gltf-validator'), f = process.argv[2];
v.validateBytes(new Uint8Array(require('fs').readFileSync(f)), {maxIssues: 20}).then(r => r.issues.messages.forEach(m =>
  m.severity > 1 || console.log(m.code + ' ' + m.pointer + ': ' + m.message)));
"""


class File:
    def __init__(self, path):
        self.problems, self.used = [], set()
        data = open(path, 'rb').read()
        magic, version, length = struct.unpack_from('<4sII', data)
        self.expect(magic == b'glTF' and version == 2 and length == len(data), 'header')
        chunks, at = [], 12
        while at < len(data):
            size, kind = struct.unpack_from('<I4s', data, at)
            self.expect(size % 4 == 0 and at + 8 + size <= len(data), 'chunk %d' % len(chunks))
            chunks.append((kind, data[at + 8:at + 8 + size]))
            at += 8 + size
        self.expect([k for k, _ in chunks] == [b'JSON', b'BIN\0'], 'chunks')
        self.json, self.bin = json.loads(chunks[0][1]), chunks[1][1]
        self.arrays = {}

    def expect(self, good, what):
        if not good:
            self.problems.append(what)
        return good

    def items(self, name):
        return self.json.get(name, [])

    def use(self, name, index, where):
        """Follows a reference; None and a problem where it leads nowhere."""
        if not self.expect(isinstance(index, int) and 0 <= index < len(self.items(name)), '%s: %s %s is not there' % (where, name, index)):
            return None
        self.used.add((name, index))
        return self.items(name)[index]

    def view(self, index, where):
        view = self.use('bufferViews', index, where)
        start, size = view.get('byteOffset', 0), view['byteLength']
        self.expect(view['buffer'] == 0 and size > 0 and start + size <= self.items('buffers')[0]['byteLength'],
                    where + ': view beyond the buffer')
        return self.bin[start:start + size], start

    def array(self, index, where, kind=None, components=None):
        """Reads an accessor as rows; checks its place, finiteness and bounds."""
        accessor = self.use('accessors', index, where)
        if accessor is None:
            return np.zeros((0, 1))
        self.expect(kind in (None, accessor['type']) and (not components or accessor['componentType'] in components), where + ': type')
        if index not in self.arrays:
            data, start = self.view(accessor['bufferView'], where)
            dtype, width, count = np.dtype(COMPONENTS[accessor['componentType']]), WIDTHS[accessor['type']], accessor['count']
            offset = accessor.get('byteOffset', 0)
            self.expect((start + offset) % dtype.itemsize == 0, where + ': alignment')
            self.expect(count > 0 and offset + count * width * dtype.itemsize <= len(data), where + ': beyond the view')
            rows = np.frombuffer(data, dtype, count * width, offset).reshape(count, width)
            self.expect(np.isfinite(rows).all(), where + ': not finite')
            for bound, found in (('min', rows.min(0)), ('max', rows.max(0))):
                self.expect(bound not in accessor or np.array_equal(np.array(accessor[bound], dtype), found), '%s: %s' % (where, bound))
            self.arrays[index] = rows
        return self.arrays[index]

    def bounded(self, index):
        return all(k in self.items('accessors')[index] for k in ('min', 'max'))


def unit(rows):
    return np.abs(np.linalg.norm(rows.astype(float), axis=1) - 1).max(initial=0) < 5e-4


def check_materials(f):
    for i, view in enumerate(f.items('images')):
        data, _ = f.view(view['bufferView'], 'image %d' % i)
        sign = {'image/png': b'\x89PNG\r\n\x1a\n', 'image/jpeg': b'\xff\xd8\xff'}.get(view.get('mimeType'))
        f.expect(sign and data.startswith(sign), 'image %d: mimeType' % i)
    for i, texture in enumerate(f.items('textures')):
        f.use('images', texture.get('source'), 'texture %d' % i)
    for i, material in enumerate(f.items('materials')):
        pbr = material.get('pbrMetallicRoughness', {})
        numbers = pbr.get('baseColorFactor', [1] * 4) + [pbr.get('metallicFactor', 1), pbr.get('roughnessFactor', 1),
                                                           material.get('alphaCutoff', 0.5)]
        f.expect(len(numbers) == 7 and all(0 <= n <= 1 for n in numbers), 'material %d: factors' % i)
        f.expect('alphaCutoff' not in material or material.get('alphaMode') == 'MASK', 'material %d: alphaCutoff' % i)
        if 'baseColorTexture' in pbr:
            f.use('textures', pbr['baseColorTexture']['index'], 'material %d' % i)


def check_primitive(f, p, where, bones):
    a = p['attributes']
    rows = f.array(a['POSITION'], where + ' POSITION', 'VEC3', [5126])
    f.expect(f.bounded(a['POSITION']), where + ': POSITION without bounds')
    f.expect(all(len(f.array(i, where + ' ' + n)) == len(rows) for n, i in a.items()), where + ': counts differ')
    if 'NORMAL' in a:
        f.expect(unit(f.array(a['NORMAL'], where, 'VEC3', [5126])), where + ': a normal is not of length 1')
    material = f.use('materials', p['material'], where)
    f.expect(('TEXCOORD_0' in a) == any('baseColorTexture' in m.get('pbrMetallicRoughness', {}) for m in f.items('materials'))
             or 'baseColorTexture' not in material.get('pbrMetallicRoughness', {}), where + ': TEXCOORD_0')
    corners = f.array(p['indices'], where + ' indices', 'SCALAR', [5123, 5125]).reshape(-1)
    f.expect(len(corners) % 3 == 0 and corners.max() < len(rows) and corners.max() != np.iinfo(corners.dtype).max, where + ': indices')
    t = corners[:len(corners) // 3 * 3].reshape(-1, 3)
    f.expect(not ((t[:, 0] == t[:, 1]) | (t[:, 1] == t[:, 2]) | (t[:, 2] == t[:, 0])).any(), where + ': a degenerate triangle')
    f.expect(('JOINTS_0' in a) == ('WEIGHTS_0' in a) == (bones is not None), where + ': skin')
    if 'JOINTS_0' in a and bones is not None:
        joints, weights = f.array(a['JOINTS_0'], where, 'VEC4', [5121, 5123]), f.array(a['WEIGHTS_0'], where, 'VEC4', [5126])
        f.expect(joints.max() < bones, where + ': a joint beyond the skin')
        f.expect((weights >= 0).all() and np.abs(weights.astype(float).sum(1) - 1).max() < 8e-7, where + ': weights do not sum to 1')
        f.expect(not joints[weights == 0].any(), where + ': a joint without weight')
        named = np.sort(np.where(weights > 0, joints.astype(int), -1 - np.arange(4)), axis=1)
        f.expect((np.diff(named, axis=1) > 0).all(), where + ': a joint twice')


def check_nodes(f):
    nodes, parent = f.items('nodes'), {}
    bones = {}
    for i, node in enumerate(nodes):
        for child in node.get('children', []):
            f.expect(child not in parent, 'node %d has two parents' % child)
            f.use('nodes', child, 'node %d' % i)
            parent[child] = i
        f.expect(abs(np.linalg.norm(node.get('rotation', [1])) - 1) < 5e-4, 'node %d: rotation' % i)
        f.expect(node.get('children', 1) != [], 'node %d: empty children' % i)
        if 'mesh' in node:
            f.use('meshes', node['mesh'], 'node %d' % i)
            skin = f.use('skins', node['skin'], 'node %d' % i) if 'skin' in node else None
            bones[node['mesh']] = len(skin['joints']) if skin else None
            f.expect(not skin or i not in parent, 'node %d: a skinned mesh that is not a root' % i)

    def path(i):
        way = [i]
        while way[-1] in parent and len(way) <= len(nodes):
            way.append(parent[way[-1]])
        f.expect(len(way) <= len(nodes), 'node %d is in a circle' % i)
        return way

    for s, scene in enumerate(f.items('scenes')):
        for i in scene['nodes']:
            f.use('nodes', i, 'scene %d' % s)
            f.expect(i not in parent, 'scene %d: node %d is not a root' % (s, i))
    for s, skin in enumerate(f.items('skins')):
        joints = skin['joints']
        f.expect(len(set(joints)) == len(joints) > 0, 'skin %d: joints' % s)
        f.expect(len({path(i)[-1] for i in joints}) == 1, 'skin %d: no common root' % s)
        matrices = f.array(skin['inverseBindMatrices'], 'skin %d' % s, 'MAT4', [5126])
        f.expect(len(matrices) == len(joints) and (matrices[:, 3::4] == [0, 0, 0, 1]).all(), 'skin %d: matrices' % s)
    return bones


def check_animations(f):
    width = {'translation': 3, 'rotation': 4, 'scale': 3}
    for i, animation in enumerate(f.items('animations')):
        where, targets = 'animation %d' % i, set()
        f.expect(animation['channels'] and len(animation['samplers']) == len({c['sampler'] for c in animation['channels']}),
                 where + ': samplers')
        for channel in animation['channels']:
            target, sampler = (channel['target']['node'], channel['target']['path']), animation['samplers'][channel['sampler']]
            f.use('nodes', target[0], where)
            f.expect(target not in targets, where + ': a target twice')
            targets.add(target)
            times = f.array(sampler['input'], where, 'SCALAR', [5126]).reshape(-1)
            f.expect(f.bounded(sampler['input']) and times[0] >= 0 and (np.diff(times) > 0).all(), where + ': key times')
            values = f.array(sampler['output'], where, components=[5126])
            f.expect(values.shape == (len(times), width[target[1]]), where + ': values')
            f.expect(target[1] != 'rotation' or unit(values), where + ': a rotation is not of length 1')


def check(path):
    f = File(path)
    f.expect(f.json.get('asset', {}).get('version') == '2.0' and len(f.items('buffers')) == 1, 'asset')
    f.expect(0 <= len(f.bin) - f.items('buffers')[0]['byteLength'] < 4, 'length of the buffer')
    f.expect(all(v != [] for v in f.json.values()), 'an empty list')
    check_materials(f)
    bones = check_nodes(f)
    for m, mesh in enumerate(f.items('meshes')):
        f.expect(mesh['primitives'], 'mesh %d is empty' % m)
        for n, primitive in enumerate(mesh['primitives']):
            check_primitive(f, primitive, 'mesh %d primitive %d' % (m, n), bones.get(m))
    check_animations(f)
    for name in ('accessors', 'bufferViews', 'images', 'textures', 'materials', 'meshes', 'skins', 'nodes'):
        f.problems += ['%s %d is not used' % (name, i) for i in range(len(f.items(name))) if (name, i) not in f.used]
    return f.problems


def has_validator():
    return shutil.which('node') is not None and os.path.isdir(os.path.join(NPM, 'gltf-validator'))


def validate(path):
    if not has_validator():
        return []
    run = subprocess.run(['node', '-e', VALIDATE, NPM, path], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, universal_newlines=True)
    return run.stdout.splitlines() + (["Khronos' validator ended with %d" % run.returncode] if run.returncode else [])


failed = False
for name in sys.argv[1:]:
    try:
        problems = check(name) + validate(name)
    except (KeyError, IndexError, ValueError, TypeError, struct.error, OSError) as e:
        problems = ['cannot be read: %r' % e]
    for problem in problems[:20]:
        print('%s: %s' % (os.path.basename(name), problem))
    failed = failed or bool(problems)
sys.exit(failed if len(sys.argv) > 1 or has_validator() else 77)
