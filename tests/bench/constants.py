#!/usr/bin/env python3
"""constants.py parts FOLDER | check FOLDER | measure FOLDER [ONLY]: what half and twice the values of the library's tuned constants do.

parts changes the copies of src and kernels_embed in FOLDER, so that each constant below comes from the environment (SPRINGLS_CONSTANT=I=X:
the I-th of the list is X), and all are measured with one compilation. check says whether the list fits the parts in FOLDER. measure runs
the programs of FOLDER, which are linked with what these parts make, and prints docs/constants.md.
"""
import math
import os
import re
import subprocess
import sys

# Cases: the program's arguments, the figures that are printed of it, and what they are.
CASES = {
    'leveque': ('leveque --grid 64 --quiet --threads 1 --json -', "LeVeque's flow on a grid of 64^3",
                {'tracking': 'tracking_mean', 'at half time': 'halfway_mean', 'volume, %': 'volume_change_percent',
                 'covered': 'covered_mean'}),
    'zalesak': ('zalesak --grid 64 --quiet --threads 1 --json -', "Zalesak's notched ball, which has sharp edges",
                {'tracking': 'tracking_mean', 'largest': 'tracking_max', 'volume, %': 'volume_change_percent',
                 'covered': 'covered_mean'}),
    'paper': ('leveque --params paper --grid 64 --period 1.25 --quiet --threads 1 --json -',
              "half of LeVeque's flow, with the paper's parameters",
              {'tracking': 'tracking_mean', 'at half time': 'halfway_mean', 'volume, %': 'volume_change_percent',
               'covered': 'covered_mean'}),
    'corner': ('csg difference box:0,0,0,1 ball:1,1,1,0.6 --grid 48 --quiet --threads 1 --out {out} --json -',
               'a ball of radius .6 taken from a corner of a box of side 2: volume 7.8869, area 23.717',
               {'volume': 'result.volume', 'area': 'result.area', 'springls': 'springls', 'triangles': 'triangles'}),
    'smooth': ('csg smooth box:0,0,0,1 --amount 0.2 --keep-volume --grid 48 --quiet --threads 1 --out {out} --json -',
               'a box smoothed by curvature, its volume held at 8',
               {'volume': 'result.volume', 'area': 'result.area', 'springls': 'springls', 'triangles': 'triangles'}),
    'foam': ('foam --cells 12 --steps 16 --grid 32 --threads 1', 'a foam of 12 bubbles comes to rest; films meet at 120 degrees',
             {'angle': r'three films meet: mean ([\d.]+)', 'deviation': r'standard deviation ([\d.]+)',
              'volumes off, %': r'off by ([\d.]+) %', 'area': r'area of all films: ([\d.]+)'}),
}

# Where a constant is measured whose own case it does not change.
ELSEWHERE = ('corner', 'zalesak', 'leveque')

# Constants: name, value as it stands in the source, file, kind (number, cosine, count), and the case that is measured first.
CONSTANTS = """
SPRINGLS__LAZY_TURN             0.18f   src/solver/algorithm_tables.h        number  leveque
opposed_limit                   0.15f   src/solver/algorithm_tables.h        number  leveque
margin                          0.5f    src/solver/algorithm_tables.h        number  leveque
enough                          3       src/solver/algorithm_tables.h        count   leveque
even                            0.995f  src/solver/algorithm_tables.h        number  leveque
enough                          0.75f   src/solver/algorithm_tables.h        number  leveque
growth                          1.5f    src/solver/algorithm_tables.h        number  leveque
usual                           2.0f    src/solver/algorithm_tables.h        number  leveque
rounding                        0.45f   src/solver/algorithm_tables.h        number  leveque
SPRINGLS__FACING_AGAINST        (-0.5f) kernels_embed/model/neighborhood.h   cosine  leveque
SPRINGLS__FIT_RADIUS            2.5f    kernels_embed/model/fit.h            number  leveque
SPRINGLS__FIT_SHEET_HEIGHT      0.4f    kernels_embed/model/fit.h            number  leveque
SPRINGLS__FIT_SHEET_FACING      0.4f    kernels_embed/model/fit.h            cosine  leveque
SPRINGLS__FIT_SINGULAR          1e-5f   kernels_embed/model/fit.h            number  leveque
SPRINGLS__CORRESPONDENCE_RADIUS 2.0f    kernels_embed/model/correspondence_fit.h number leveque
SPRINGLS__NEAR                  0.577f  kernels_embed/stages/rebuild.h       number  paper
SPRINGLS__SAME_SIDE             0.3f    kernels_embed/stages/contract.h      cosine  leveque
SPRINGLS__PROJECT_RADIUS        1.6f    kernels_embed/stages/project.h       number  leveque
SPRINGLS__SAME_SHEET            0.4f    kernels_embed/stages/project.h       cosine  leveque
SPRINGLS__MIN_WEIGHT            1e-3f   kernels_embed/stages/project.h       number  leveque
SPRINGLS__BESIDE_ZERO           1.2f    kernels_embed/stages/project_brick.h number  leveque
sure                            0.5f    src/stages/project.h                 number  leveque
SPRINGLS__FILLED_PHI            (-0.05f) kernels_embed/stages/specks.h       number  leveque
SPRINGLS__JOIN_PHI              0.6f    kernels_embed/stages/specks.h        number  leveque
SPRINGLS__PUNCTURE_PHI          0.5f    kernels_embed/stages/specks.h        number  leveque
SPRINGLS__AROUND_PUNCTURE       3.0f    kernels_embed/stages/specks.h        number  leveque
SPRINGLS__SEED_DISTANCE         0.7f    kernels_embed/stages/fill_from_springls.h number leveque
SPRINGLS__SEED_RANGE            1.85f   kernels_embed/stages/fill_from_springls.h number leveque
covered                         0.75f   src/stages/fill_gaps.h               number  leveque
on_sheets                       1.5f    src/stages/fill_gaps.h               number  leveque
range                           1.0f    src/stages/events.h                  number  leveque
alike                           0.3f    src/model/interpolation.h            cosine  leveque
radius                          2.5f    src/stages/surface_parts.h           number  leveque
SPRINGLS__MOVING2               1e-4f   kernels_embed/stages/advect.h        number  leveque
SPRINGLS__STIRRING2             1e-6f   kernels_embed/stages/advect.h        number  smooth
SPRINGLS__REST                  1e-3f   kernels_embed/stages/sleep.h         number  smooth
SPRINGLS__CURVATURE_SPAN        1.5f    kernels_embed/stages/advect.h        number  smooth
max_offset                      0.25    src/stages/volume_lock.h             number  smooth
SPRINGLS__APART                 0.64f   kernels_embed/stages/keep_edges.h    cosine  zalesak
SPRINGLS__TOGETHER              0.95f   kernels_embed/stages/keep_edges.h    cosine  zalesak
SPRINGLS__NARROW                0.35f   kernels_embed/stages/keep_edges.h    number  zalesak
SPRINGLS__AWAY                  -0.5f   kernels_embed/stages/keep_edges.h    cosine  zalesak
SPRINGLS__TRIES                 6       kernels_embed/stages/keep_edges.h    count   zalesak
tolerance                       0.02f   src/input/initial_edges.h            number  zalesak
depth                           1.8f    src/input/initial_edges.h            number  zalesak
on_surface                      0.25f   src/input/initial_edges.h            number  zalesak
out                             0.1f    src/input/initial_edges.h            number  zalesak
radius                          2.5f    src/input/initial_edges.h            number  zalesak
slack                           0.4f    src/input/initial_edges.h            number  zalesak
least                           0.06f   src/input/initial_edges.h            number  zalesak
reach                           5.0f    src/stages/surface_table.h           number  corner
SPRINGLS__HIT_RADIUS            1.6f    kernels_embed/output/crossings.h     number  corner
SPRINGLS__LARGEST_HIT_RADIUS    2.5f    kernels_embed/output/crossings.h     number  corner
SPRINGLS__HIT_SHARE             0.65f   kernels_embed/output/crossings.h     number  corner
SPRINGLS__TRIM_RADIUS           1.6f    kernels_embed/output/crossings.h     number  corner
SPRINGLS__CREASE_COSINE         0.77f   kernels_embed/output/crossings.h     cosine  corner
SPRINGLS__OPPOSED_COSINE        (-0.5f) kernels_embed/output/crossings.h     cosine  corner
SPRINGLS__CROSSING_COST         0.45f   kernels_embed/output/crossings.h     number  corner
SPRINGLS__CHANGE_COST           1.5f    kernels_embed/output/crossings.h     number  corner
SPRINGLS__RUN_LENGTH            0.6f    kernels_embed/output/crossings.h     number  corner
SPRINGLS__PHI_WEIGHT            0.1f    kernels_embed/output/crossings.h     number  corner
SPRINGLS__EDGE_MARGIN           0.15f   kernels_embed/output/crossings.h     number  corner
SPRINGLS__LEAST_WEIGHT          0.02f   kernels_embed/output/crossings.h     number  corner
SPRINGLS__SHARP_COSINE          0.8f    kernels_embed/output/faces.h         cosine  corner
SPRINGLS__RIM_COSINE            (-0.7f) kernels_embed/output/faces.h         cosine  corner
SPRINGLS__FACE_REACH            0.03f   kernels_embed/output/faces.h         number  corner
SPRINGLS__MATERIAL_RADIUS       1.0f    kernels_embed/output/isosurface.h    number  corner
SPRINGLS__ON_SURFACE            0.05f   src/tools/combine.h                  number  corner
SPRINGLS__TRIANGLE_GAP          0.3f    src/tools/combine.h                  number  corner
SPRINGLS__PHI_ERROR             1.0f    src/tools/combine.h                  number  corner
SPRINGLS__PARALLEL              0.7f    src/tools/combine.h                  cosine  corner
SPRINGLS__FILM_REACH            1.5f    src/tiling/films.h                   number  foam
learned                         0.1     src/tiling/films.h                   number  foam
largest                         0.003   src/tiling/films.h                   number  foam
rounds                          50      src/tiling/films.h                   count   foam
SPRINGLS__WALL_REACH            0.9f    src/tiling/sheets.h                  number  foam
SPRINGLS__WALL_SLACK            0.15f   src/tiling/sheets.h                  number  foam
SPRINGLS__WALL_STILL            0.004f  src/tiling/sheets.h                  number  foam
SPRINGLS__WALL_TOUCH            0.06f   src/tiling/sheets.h                  number  foam
SPRINGLS__WALL_OPPOSED          0.4f    src/tiling/sheets.h                  cosine  foam
error                           0.3f    src/tiling/sheets.h                  number  foam
push                            0.4f    src/tiling/join.h                    number  foam
drawn                           0.2     src/tiling/join.h                    number  foam
reach                           2.0f    src/tiling/tiling_rest.h             number  foam
SPRINGLS__MIRROR_PERIOD         8       src/tiling/tiling_step.h             count   foam
kept                            0.02f   src/tiling/set_labels.h              number  foam
trusted                         0.6f    src/tiling/walls.h                   number  foam
margin                          0.01    src/tiling/walls.h                   number  foam
margin                          0.02f   src/tiling/walls.h                   number  foam
"""


class Constant:
    def __init__(self, line):
        self.name, self.text, self.file, self.kind, self.case = line.split(None, 4)
        self.value = float(self.text.strip('()f'))

    def times(self, factor):
        """The value for half or twice the length, count or angle."""
        if self.kind == 'cosine':
            return math.cos(min(math.pi, factor * math.acos(self.value)))
        return max(1, round(factor * self.value)) if self.kind == 'count' else factor * self.value

    def replace(self, part, number):
        """Replaces the value in the text of the file; it has to stand there once."""
        pattern = r'(\b%s(?: *= *| +))%s(?![\w.])' % (self.name, re.escape(self.text))
        kind = {'count': 'int'}.get(self.kind, 'float' if 'f' in self.text else 'double')
        if self.name.startswith('SPRINGLS__') and re.search(r'\b%s *=' % self.name, part):  # of an enum
            part, found = re.subn(pattern, r'SPRINGLS__unused_\g<1>' + self.text, part)
            define = '\n#define %s ((%s)springls__tuned[%d])\n' % (self.name, kind, number)
            return part.replace('\nenum', define + 'enum', 1), found
        return re.subn(pattern, r'\g<1>((%s)springls__tuned[%d])' % (kind, number), part)


def constants():
    return [Constant(line) for line in CONSTANTS.strip().split('\n')]


def make_parts(folder, write):
    """Changes the copies of src and kernels_embed in the folder, or only checks that all constants stand where they are said to."""
    for number, c in enumerate(constants()):
        path = os.path.join(folder, c.file)
        with open(path, encoding='utf-8') as file:
            text, found = c.replace(file.read(), number)
        if found != 1:
            sys.exit('constants: %s = %s stands %d times in %s, and once in the list of %s' % (c.name, c.text, found, c.file, __file__))
        if not write:
            continue
        with open(path, 'w', encoding='utf-8') as file:
            file.write(text)
    if write:
        with open(os.path.join(folder, 'src/interface/api.h'), 'a', encoding='utf-8') as file:
            file.write(TUNED % ', '.join('%.9g' % c.value for c in constants()))


def figures(output, wanted):
    found = {}
    for name, key in wanted.items():
        if '(' in key:
            match = re.search(key, output)
        else:
            place = output
            for word in key.split('.')[:-1]:
                place = place[place.index('"%s"' % word):]
            match = re.search(r'"%s": *(-?[\d.e+-]+)' % key.split('.')[-1], place)
        found[name] = float(match.group(1)) if match else math.nan
    return found


def run(folder, case, override=None):
    """The case's figures and the seconds of the processor, or the program's last line if it fails."""
    arguments, _, wanted = CASES[case]
    words = arguments.format(out=folder).split()
    environment = dict(os.environ, **({'SPRINGLS_CONSTANT': override} if override else {}))
    before = os.times()
    try:
        result = subprocess.run([os.path.join(folder, words[0])] + words[1:], env=environment, capture_output=True, text=True, timeout=120)
    except subprocess.TimeoutExpired:
        return 'more than 120 s', None, None
    after = os.times()
    seconds = after.children_user - before.children_user
    if result.returncode:
        return (result.stderr or result.stdout).strip().split('\n')[-1] or 'status %d' % result.returncode, None, None
    state = re.search(r'"state_hash": "(\w+)"', result.stdout)
    found = figures(result.stdout, wanted)
    return found, seconds, (state and state.group(1), tuple(found.values()))


def cell(result, base):
    values, seconds, exact = result
    if isinstance(values, str):
        return 'fails: ' + values.split(': ')[-1].replace('|', '/')
    if base and exact == base[2]:
        return 'same'
    return ' / '.join('%.*g' % (6 if abs(v) >= 1.0 else 4, v) for v in values.values()) + ' / %.1f s' % seconds


TUNED = """
#ifdef SPRINGLS_IMPLEMENTATION
#include <stdio.h>
#include <stdlib.h>
double springls__tuned[] = {%s};
__attribute__((constructor)) static void springls__tune(void)
{
    int number;
    double value;
    const char *text = getenv("SPRINGLS_CONSTANT");
    if (text && sscanf(text, "%%d=%%lf", &number, &value) == 2) springls__tuned[number] = value;
}
#endif
"""

PAGE = """<!-- written by: make constants PAGE=docs/constants.md -->

# Tuned constants

What half and twice the value of each constant does to a case that shows it, where the library leaves a choice. Parameters that a user
sets have their own tables (`make ablation`, `make accuracy`). Constants that are no choice are not here: sizes of arrays, layouts, limits
of memory, bounds that follow from others, and tolerances of rounding. Of a cosine the angle is halved and doubled. "same": the figures
are those of the value as it is. `leveque` and `zalesak` print the hash of the state too, which is then the same; in the cases of `csg` and
`foam` only the printed figures are compared. A constant stands at a case in which it changes something. One thread; seconds are the
processor's, of a machine that does other things too: differences below a third mean nothing. Nor do small differences of the foam and of
Zalesak's ball: a foam's last bits decide which walls vanish first, and a few springls at the notch make the largest error.

`make constants ONLY=NAME` measures the constants of that name and those whose file's name has NAME in it.
"""

UNSEEN = """## Without effect here

Half and twice the value change nothing in three cases, the corner, Zalesak's ball and LeVeque's flow, nor in the case that is named
behind the value. The other cases were not run.
"""


def measure_constant(folder, number, constant, bases):
    """The case in which half or twice the value changes something, the constant's own or one of those that show most, and what it does
    there; or None."""
    for case in [constant.case] + [case for case in ELSEWHERE if case != constant.case]:
        if case not in bases:
            bases[case] = run(folder, case)
        cells = [cell(run(folder, case, '%d=%.9g' % (number, constant.times(f))), bases[case]) for f in (0.5, 2.0)]
        if cells != ['same', 'same']:
            return case, cells
    return None


def measure(folder, only):
    chosen = [(number, c) for number, c in enumerate(constants()) if not only or only == c.name or only in os.path.basename(c.file)]
    if not chosen:
        print("constants: '%s' is the name of no constant and in the name of no file that has one" % only, file=sys.stderr)
        sys.exit(2)
    bases, rows, unseen = {}, {case: [] for case in CASES}, []
    for number, c in chosen:
        name = '`%s` (%s)' % (c.name, os.path.basename(c.file))
        found = measure_constant(folder, number, c, bases)
        if found:
            rows[found[0]].append('| %s | %s | %s | %s |' % ((name, c.text.strip('()f')) + tuple(found[1])))
        else:
            unseen.append('%s, %s%s' % (name, c.text.strip('()f'), '' if c.case in ELSEWHERE else ', ' + c.case))
        print(name, found, file=sys.stderr, flush=True)
    print(PAGE)
    for case, lines in rows.items():
        if lines:
            arguments, title, wanted = CASES[case]
            print('## %s\n\n`build/%s`\n\n%s, seconds. As it is: %s.\n' % (
                title[0].upper() + title[1:], arguments.format(out='build'), ', '.join(wanted).capitalize(), cell(bases[case], None)))
            print('\n'.join(['| Constant | Value | Half | Twice |', '|---|---|---|---|'] + lines) + '\n')
    if unseen:
        print(UNSEEN)
        print('\n'.join('- ' + line for line in unseen))


if __name__ == '__main__':
    if sys.argv[1] in ('parts', 'check'):
        make_parts(sys.argv[2], sys.argv[1] == 'parts')
    else:
        measure(sys.argv[2], sys.argv[3] if len(sys.argv) > 3 else '')
