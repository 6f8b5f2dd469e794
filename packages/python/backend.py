#!/usr/bin/env python3
"""backend.py - builds the wheel of Python's module, and the archive of its sources, by Python and a C compiler alone (PEP 517).

    backend.py wheel FOLDER      backend.py sdist FOLDER      prints the name of the file that it has made in the folder

pip and build run the functions build_wheel and build_sdist. CC and CFLAGS are those of the environment. The library is not for one
version of Python, so that one wheel serves all of a platform."""
import base64
import hashlib
import io
import os
import pathlib
import re
import shlex
import subprocess
import sys
import sysconfig
import tarfile
import tempfile
import zipfile

HERE = pathlib.Path(__file__).resolve().parent
SOURCES = ('springls.h', 'examples/python/springls.py', 'LICENSE', 'packages/python/pyproject.toml', 'packages/python/backend.py')
METADATA = '''Metadata-Version: 2.1
Name: springls
Version: {version}
Summary: Spring Level Sets: deformable surfaces that are meshes, level sets and tracked points at once
License-File: LICENSE
Requires-Python: >=3.8
Requires-Dist: numpy
Requires-Dist: cffi
'''
WHEEL = '''Wheel-Version: 1.0
Generator: springls
Root-Is-Purelib: false
Tag: {tag}
'''


def read(source):
    """Returns the bytes of a source: of the repository, or of the archive, in which all lie in one folder."""
    flat = HERE / pathlib.PurePath(source).name
    return (flat if flat.exists() else HERE.parents[1] / source).read_bytes()


def version():
    numbers = re.findall(r'^#define SPRINGLS_VERSION_[A-Z]+ (\d+)$', read('springls.h').decode(), re.M)
    return '.'.join(numbers)


def compiled():
    """Returns the bytes of the shared library."""
    with tempfile.TemporaryDirectory() as folder:
        header, library = pathlib.Path(folder, 'springls.h'), pathlib.Path(folder, 'libspringls.so')
        header.write_bytes(read('springls.h'))
        subprocess.run([*shlex.split(os.environ.get('CC', 'cc')), '-std=c99', '-O3', '-ffp-contract=off', '-fno-math-errno', '-fPIC', '-shared',
                        '-s', '-DSPRINGLS_IMPLEMENTATION', '-DSPRINGLS_THREADS', *shlex.split(os.environ.get('CFLAGS', '')),
                        '-x', 'c', header, '-o', library, '-lm', '-pthread'], check=True)
        return library.read_bytes()


def record_of(files):
    """Returns the list of files, with their digests, that installers check a wheel by."""
    lines = []
    for name, data in files.items():
        digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).decode().rstrip('=')
        lines.append(f'{name},sha256={digest},{len(data)}\n')
    return ''.join(lines)


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    """Makes the wheel, and returns its name."""
    tag = 'py3-none-' + re.sub(r'[^A-Za-z0-9]', '_', sysconfig.get_platform())
    info = f'springls-{version()}.dist-info'
    files = {'springls/__init__.py': read('examples/python/springls.py'), 'springls/springls.h': read('springls.h'),
             'springls/libspringls.so': compiled(), f'{info}/LICENSE': read('LICENSE'),
             f'{info}/METADATA': METADATA.format(version=version()).encode(), f'{info}/WHEEL': WHEEL.format(tag=tag).encode()}
    files[f'{info}/RECORD'] = f'{record_of(files)}{info}/RECORD,,\n'.encode()
    name = f'springls-{version()}-{tag}.whl'
    with zipfile.ZipFile(pathlib.Path(wheel_directory, name), 'w', zipfile.ZIP_DEFLATED) as wheel:
        for path, data in files.items():
            entry = zipfile.ZipInfo(path)   # of 1980: equal sources make equal wheels
            entry.external_attr = 0o644 << 16
            wheel.writestr(entry, data, zipfile.ZIP_DEFLATED)
    return name


def build_sdist(sdist_directory, config_settings=None):
    """Makes the archive of what the wheel is built from, and returns its name."""
    folder = f'springls-{version()}'
    files = {pathlib.PurePath(source).name: read(source) for source in SOURCES}
    files['PKG-INFO'] = METADATA.format(version=version()).encode()
    with tarfile.open(pathlib.Path(sdist_directory, folder + '.tar.gz'), 'w:gz', format=tarfile.PAX_FORMAT) as archive:
        for name, data in files.items():
            entry = tarfile.TarInfo(f'{folder}/{name}')
            entry.size, entry.mode = len(data), 0o644
            archive.addfile(entry, io.BytesIO(data))
    return folder + '.tar.gz'


if __name__ == '__main__':
    build = {'wheel': build_wheel, 'sdist': build_sdist}.get(sys.argv[1] if len(sys.argv) == 3 else '')
    if not build:
        sys.exit(__doc__)
    print(build(sys.argv[2]))
