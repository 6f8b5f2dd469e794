#!/usr/bin/env python3
"""pages.py - makes the figures and pictures of the pages, README.md and docs/*.md, by the commands that stand in them.

    docs/pages.py [--check] [--only test|check] [PAGE...]     PAGE: README, morph, docs/morph.md, morph:2 (its second block); none: all
    docs/pages.py row [--let NAME=VALUE] [--each LIST] TEMPLATE [FILE...]      rows of a table from JSON

A block of a page is

    <!-- figures[, test|check][, times[: COLUMN; COLUMN]]
    COMMANDS
    -->
    what they print, as it is
    <!-- end of figures -->

COMMANDS are lines for the shell. `above ARGUMENTS` are the commands of the code block above, the last one with ARGUMENTS more;
what the others print is not shown. `picture FILE KEPT CAPTION` keeps a picture and shows it on the page. `program FILE.c` shows a
program, compiles it with the library, runs it and shows what it prints. They run in a folder of
their own, build/docs/PAGE, in which everything of the repository is at hand; what is named build/NAME is built before. Blocks
that use $SPRINGLS_DATA are skipped where it is not set. Blocks with `test` are quick and run in `make test`, those with `check`
in `make docs-check`. Of blocks with `times` the numbers, or those of the columns named, differ from run to run.

A page that begins with <!-- written by: COMMAND --> is written by that command as a whole.

A row's TEMPLATE is what Python's f-strings are. It has the members of the object that is read, or with several FILEs the objects
a, b, c ... With --each it makes a row for each element `e` of the list, whose members it has too, and `i`, its number."""
import argparse
import json
import os
import pathlib
import re
import shlex
import subprocess
import sys
import types

ROOT = pathlib.Path(__file__).resolve().parent.parent
LEVELS = ('test', 'check', '')
BLOCK = re.compile(r'^<!-- figures(?P<flags>[^\n]*)\n(?P<commands>.*?)\n-->\n(?P<text>.*?)^<!-- end of figures -->$', re.M | re.S)
WHOLE = re.compile(r'<!-- written by: (.*?) -->')
CODE = re.compile(r'^```(?:.*\n)*?```\n|^ {4}\S.*\n(?: {4}.*\n)*', re.M)


class Failure(Exception):
    pass


# ---- rows of tables from JSON ----

def members(value):
    """Makes the members of objects attributes, all the way down."""
    if isinstance(value, dict):
        return types.SimpleNamespace(**{key: members(item) for key, item in value.items()})
    return [members(item) for item in value] if isinstance(value, list) else value


def rows(template, objects, each=None, let=()):
    names = dict(vars(objects[0])) if len(objects) == 1 else {}
    names.update(zip('abcdefgh', objects))
    for name, _, value in (text.partition('=') for text in let):
        names[name] = eval(value, names)
    code = compile(f"f'''{template} '''", '<row>', 'eval')
    elements = eval(each, names) if each else [None]
    return [eval(code, {**names, **vars_of(element), 'e': element, 'i': i})[:-1] for i, element in enumerate(elements)]


def vars_of(value):
    return vars(value) if isinstance(value, types.SimpleNamespace) else {}


def row_main(arguments):
    parser = argparse.ArgumentParser(prog='pages.py row')
    parser.add_argument('--each')
    parser.add_argument('--let', action='append', default=[])
    parser.add_argument('template')
    parser.add_argument('files', nargs='*')
    options = parser.parse_args(arguments)
    texts = [pathlib.Path(f).read_text() for f in options.files] or [sys.stdin.read()]
    print('\n'.join(rows(options.template, [members(json.loads(text)) for text in texts], options.each, options.let)))
    return 0


# ---- blocks ----

def commands_above(page, end):
    """Returns the commands of the last code block before `end`, without comments, each on one line."""
    blocks = [m.group() for m in CODE.finditer(page, 0, end) if not inside_block(page, m.start())]
    blocks = [b for b in blocks if not b.startswith('```') or b.startswith('```sh\n')]
    if not blocks:
        raise Failure('there is no code block above')
    lines = [line.strip() for line in blocks[-1].replace('\\\n', ' ').splitlines() if not line.startswith('```')]
    return [line for line in (re.sub(r'(^|\s+)# .*', '', line) for line in lines) if line]


def inside_block(page, place):
    return any(m.start() <= place < m.end() for m in BLOCK.finditer(page))


def script_of(page, block):
    """Returns the text that the shell runs for a block."""
    commands = block['commands']
    above = ''
    if re.search(r'\babove\b', commands):
        *first, last = commands_above(page, block.start())
        above = 'above() {\n' + ''.join(f'{{ {line}\n}} >&2\n' for line in first) + last + ' "$@"\n}\n'
    return f'''set -e
cc() {{ command "${{CC:-cc}}" "$@" $PAGES_CFLAGS; }}
row() {{ /usr/bin/env python3 {shlex.quote(str(ROOT / "docs/pages.py"))} row "$@"; }}
picture() {{
    kept={shlex.quote(str(ROOT))}/$2
    if [ "$CHECK" ]; then cmp "$1" "$kept" >&2; else cp "$1" "$kept"; fi
    echo "![$3]($UP$2)"
}}
program() {{
    [ springls.o -nt springls.h ] || cc -std=c99 -O3 -DSPRINGLS_IMPLEMENTATION -c -o springls.o -x c springls.h
    cc -std=c99 -Wall -Wextra -O2 -I. -o recipe "$1" springls.o -lm -pthread
    printf '```c\n%s\n```\n\nIt prints:\n\n' "$(cat "$1")"
    ./recipe | sed 's/^/    /'
}}
{above}{commands}
'''


def programs_of(script):
    """The programs that a script runs, as make knows them."""
    names = set(re.findall(r'\bbuild/((?:bench/)?[a-z0-9_]+)(?=\s|$)', script, re.M))
    examples = {p.stem for p in (ROOT / 'examples').iterdir()} - {'common', 'pictures', 'python', 'web', 'engines', 'recipes', 'cohort'}
    measuring = {f'bench/{p.stem}' for p in (ROOT / 'tests/bench').glob('*.c*')}
    return sorted('build/' + n for n in names & (examples | measuring))


def folder_of(path):
    """Makes the folder in which a page's commands run: the repository as it is, and what they write stays there."""
    folder = ROOT / 'build/docs' / path.stem
    folder.mkdir(parents=True, exist_ok=True)
    for entry in ROOT.iterdir():
        link = folder / entry.name
        if not entry.name.startswith('.git') and not link.is_symlink():
            link.symlink_to(entry)
    return folder


def run(script, path, check):
    """Returns what a block's commands print."""
    programs = programs_of(script)
    if programs:
        done = subprocess.run(['make', '--no-print-directory', *programs], cwd=ROOT, stdout=sys.stderr)
        if done.returncode != 0:
            raise Failure(f'make {" ".join(programs)} failed')
    names = dict(os.environ, CHECK='1' if check else '', UP='' if path.parent == ROOT else '../')
    done = subprocess.run(['/bin/sh', '-c', script], cwd=folder_of(path), env=names, capture_output=True, text=True)
    if done.returncode != 0:
        raise Failure(f'its commands end with {done.returncode}: ' + '; '.join((done.stderr or done.stdout).splitlines()[-3:]))
    return done.stdout


# ---- comparing ----

def flags_of(block):
    """Returns a block's level, and the columns whose numbers are times: None: none has such; []: all numbers."""
    before, times, columns = block['flags'].partition('times')
    level = next((level for level in LEVELS if level and re.search(rf'\b{level}\b', before)), '')
    return level, [c.strip() for c in columns.lstrip(':').split(';') if c.strip()] if times else None


def without_times(text, columns):
    """Replaces numbers that are times, so that what remains can be compared."""
    if columns is None:
        return text
    number = re.compile(r'\d+(\.\d+)?')
    if not columns:
        return number.sub('#', text)
    lines, timed = [], set()
    for line in text.splitlines():
        cells = [cell.strip() for cell in line.split('|')]
        named = {i for i, cell in enumerate(cells) if cell in columns}
        timed = named or (timed if line.startswith('|') else set())
        lines.append('|'.join(number.sub('#', c) if i in timed and not named else c for i, c in enumerate(cells)))
    return '\n'.join(lines)


def first_difference(old, new):
    for before, after in zip(old.strip().splitlines() + [''], new.strip().splitlines() + ['']):
        if before != after:
            return f'    page: {before}\n    now:  {after}'
    return '    lines are missing'


# ---- pages ----

def page_of(argument):
    """Returns the page that an argument names, and the number of the block: None: all."""
    name, _, number = argument.partition(':')
    for path in (ROOT / name, ROOT / 'docs' / f'{name}.md', ROOT / f'{name}.md'):
        if path.suffix == '.md' and path.is_file():
            return path, int(number) if number.isdigit() else None
    raise Failure(f'there is no page {name}')


def wanted(block, only):
    return not only or LEVELS.index(flags_of(block)[0]) <= LEVELS.index(only)


def do_block(path, page, block, check):
    """Returns a block's new text and whether it differs from the old one in more than times. The text is None where it is skipped."""
    script = script_of(page, block)
    if re.search(r'\$\{?SPRINGLS_DATA', script) and not os.environ.get('SPRINGLS_DATA'):
        return None, False
    text = '\n' + run(script, path, check).strip('\n') + '\n\n'
    times = flags_of(block)[1]
    return text, without_times(text.strip(), times) != without_times(block['text'].strip(), times)


def put(path, block, text):
    """Writes a block's new text. The page is read anew: it may have been edited while the commands ran."""
    page = path.read_text()
    now = next((b for b in BLOCK.finditer(page) if b['commands'] == block['commands']), None)
    if not now:
        raise Failure('is no longer there')
    path.write_text(page[:now.start('text')] + text + page[now.end('text'):])


def do_page(path, number, check, only):
    """Runs a page's blocks, or one; returns how many are as the page has them, differ, and are skipped."""
    good = bad = skipped = 0
    page = path.read_text()
    for n, block in enumerate(BLOCK.finditer(page), 1):
        if not wanted(block, only) or number not in (None, n):
            continue
        line = page.count('\n', 0, block.start()) + 1
        where = f'{path.relative_to(ROOT)}:{line}'
        try:
            text, differs = do_block(path, page, block, check)
            if text is not None and not check:
                put(path, block, text)
        except Failure as failure:
            print(f'FAIL {where}: {failure}', flush=True)
            bad += 1
            continue
        if text is None:
            print(f'     {where}: skipped, SPRINGLS_DATA is not set', flush=True)
            skipped += 1
        elif differs and check:
            print(f'FAIL {where}: the page has other figures\n{first_difference(block["text"], text)}', flush=True)
            bad += 1
        else:
            print(f'{"new " if differs else "ok  "} {where}', flush=True)
            good += 1
    return good, bad, skipped


def main():
    if sys.argv[1:2] == ['row']:
        return row_main(sys.argv[2:])
    for name in ('MAKEFLAGS', 'MAKELEVEL', 'PAGE'):   # `make docs` and the makes of the blocks have nothing to do with each other
        os.environ.pop(name, None)
    os.environ.setdefault('OMP_WAIT_POLICY', 'passive')
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--check', action='store_true', help='changes no page; ends with 1 where one has other figures')
    parser.add_argument('--only', choices=LEVELS[:2], help='blocks of this kind and quicker ones')
    parser.add_argument('pages', nargs='*')
    options = parser.parse_args()
    good = bad = skipped = 0
    try:
        paths = [page_of(name) for name in options.pages] or \
            [(path, None) for path in (ROOT / 'README.md', *sorted((ROOT / 'docs').glob('*.md')))]
    except Failure as failure:
        sys.exit(f'pages.py: {failure}')
    for path, number in paths:
        whole = WHOLE.match(path.read_text())
        if whole and not options.check and not options.only:
            print(f'     {path.relative_to(ROOT)}: {whole[1]}', flush=True)
            bad += subprocess.run(whole[1], shell=True, cwd=ROOT).returncode != 0
        counts = do_page(path, number, options.check, options.only)
        good, bad, skipped = good + counts[0], bad + counts[1], skipped + counts[2]
    if skipped:
        print(f'{skipped} skipped')
    print(f'{good} passed, {bad} failed')
    return bad > 0


if __name__ == '__main__':
    sys.exit(main())
