"""test_pages.py - README.md and docs/*.md: the quick figures are those that the commands print, what the commands name exists, and
docs/pages.py finds figures that have changed."""
import contextlib
import importlib.util
import io
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

sys.dont_write_bytecode = True
ROOT = pathlib.Path(__file__).resolve().parents[2]


def load_tool():
    spec = importlib.util.spec_from_file_location('pages', ROOT / 'docs/pages.py')
    tool = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(tool)
    return tool


pages = load_tool()
PAGES = [ROOT / 'README.md', *sorted((ROOT / 'docs').glob('*.md'))]

PAGE = '''# A page

    A=5   # a comment
    echo not shown
    echo \\
        $A

<!-- figures, test
above six
-->
old
<!-- end of figures -->

<!-- figures, times: Seconds; CPU, s
printf '| | Seconds | CPU, s | Steps |\\n|---|---|---|---|\\n| one | 1.5 | 7 | 12 |\\n'
-->

| | Seconds | CPU, s | Steps |
|---|---|---|---|
| one | 22.5 | 8 | 12 |

<!-- end of figures -->

<!-- figures
echo $SPRINGLS_DATA
-->
needs the collection
<!-- end of figures -->
'''


class Tool(unittest.TestCase):
    """docs/pages.py on a page of its own."""

    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.tool = load_tool()
        self.tool.ROOT = pathlib.Path(self.folder.name)
        self.page = self.tool.ROOT / 'docs/page.md'
        self.page.parent.mkdir()
        (self.tool.ROOT / 'examples').mkdir()
        self.page.write_text(PAGE)
        data = os.environ.pop('SPRINGLS_DATA', None)
        if data is not None:
            self.addCleanup(os.environ.__setitem__, 'SPRINGLS_DATA', data)

    def run_page(self, check, only=None):
        self.said = io.StringIO()
        with contextlib.redirect_stdout(self.said):
            return self.tool.do_page(self.page, None, check, only)

    def test_a_changed_figure_is_found(self):
        self.assertEqual(self.run_page(check=True), (1, 1, 1))
        self.assertIn('FAIL docs/page.md:8', self.said.getvalue())
        self.assertEqual(self.page.read_text(), PAGE)

    def test_a_page_is_made_anew(self):
        self.assertEqual(self.run_page(check=False), (2, 0, 1))
        text = self.page.read_text()
        self.assertIn('\n-->\n\n5 six\n\n<!-- end', text)
        self.assertIn('| one | 1.5 | 7 | 12 |', text)
        self.assertIn('needs the collection', text)
        self.assertEqual(self.run_page(check=True), (2, 0, 1))

    def test_only_quick_blocks(self):
        self.assertEqual(self.run_page(check=True, only='test'), (0, 1, 0))

    def test_times_alone_may_differ(self):
        self.page.write_text(PAGE.replace('| 8 | 12 |', '| 8 | 13 |'))
        self.assertEqual(self.run_page(check=True), (0, 2, 1))

    def test_a_command_that_fails(self):
        self.page.write_text(PAGE.replace('above six', 'echo why >&2; false'))
        self.assertEqual(self.run_page(check=False)[1], 1)
        self.assertIn('why', self.said.getvalue())
        self.assertIn('old\n', self.page.read_text())

    def test_rows(self):
        report = self.tool.members({'name': 'x', 'list': [{'value': 1.25}, {'value': None}]})
        self.assertEqual(self.tool.rows('{name} {"a" + "b"} {list[0].value:.1f}', [report]), ['x ab 1.2'])
        self.assertEqual(self.tool.rows('{i} {value} {n}', [report], 'list', ['n=len(list)']), ['0 1.25 2', '1 None 2'])
        self.assertEqual(self.tool.rows('{a.name}{b.name}', [report, report]), ['xx'])


def commands(path):
    """Yields the commands of a page that begin with build/ or make, in code blocks and between backquotes."""
    text = path.read_text()
    for block in pages.CODE.finditer(text):
        for line in re.sub(r'\\\n', ' ', block.group()).splitlines():
            yield from re.findall(r'^\s*((?:build/|make ).*)', re.sub(r'\s# .*', '', line))
    yield from re.findall(r'`((?:build/|make )[^`]*)`', pages.CODE.sub('', text).replace('\n', ' '))


def collection_files(path):
    """Yields the files of SPRINGLS_DATA that the commands of a page name, patterns among them, and those of the page of data."""
    text = path.read_text()
    for block in pages.CODE.finditer(text):
        commands = block.group()
        for name, value in re.findall(r'\b([A-Z]+)=(\$SPRINGLS_DATA\S*)', commands):
            commands = re.sub(rf'\$({name}\b|{{{name}}})', lambda _: value, commands.replace(f'{name}={value}', ''))
        for name in re.findall(r'\$SPRINGLS_DATA/([^\s:;"\')]*)', commands):
            if '$' not in name:
                yield name.rstrip('/')
    if path.name == 'data.md':
        yield from re.findall(r'`((?:ct|labels|4d|shapes|meshes|rigged|bad)/[^`]*[^`/])`', text)


class Commands(unittest.TestCase):
    def setUp(self):
        makefiles = [ROOT / 'Makefile', ROOT / 'examples/examples.mk', ROOT / 'tests/tests.mk', ROOT / 'tests/bench/bench.mk']
        self.programs = {p.stem for folder in ('examples', 'examples/engines') for p in (ROOT / folder).iterdir()}
        self.targets = {name for m in makefiles for name in re.findall(r'^([\w.-]+):.*##', m.read_text(), re.M)}

    def check_program(self, name):
        place = ROOT / name.replace('build/', 'tests/', 1).replace('tests/test/', 'tests/')
        known = name[len('build/'):] in self.programs or list(place.parent.glob(place.name + '.*'))
        self.assertTrue(known, f'nothing makes {name}')

    def check_options(self, program, words):
        folder = ROOT / 'examples' / program
        sources = [*folder.glob('*.c*'), *(ROOT / 'examples').glob(program + '.c*'), *(ROOT / 'examples/engines').glob(program + '.c*')]
        sources += (ROOT / 'examples/common').glob('*/*.[ch]')
        text = ''.join(s.read_text() for s in sources)
        for word in words:
            if re.match(r'--[a-z]', word):
                self.assertTrue(f'"{word[2:]}"' in text or f'"{word}"' in text or word == '--help', f'{program} has no option {word}')

    def test_what_they_name_exists(self):
        for path in PAGES:
            for command in commands(path):
                with self.subTest(page=path.name, command=command):
                    first, *rest = command.split()
                    if first == 'make':
                        for word in rest:
                            if re.fullmatch(r'[a-z][a-z-]*', word):
                                self.assertTrue(word in self.targets | self.programs, f'make has no target {word}')
                    elif self.is_program(first):
                        self.check_program(first)
                        self.check_options(first[len('build/'):], rest)

    @staticmethod
    def is_program(word):
        """Files and folders of results, such as build/demo/, are none."""
        folders = ('', 'test', 'demo', 'python', 'web', 'imaging', 'fuzz', 'cover', 'ci', 'docs')
        return re.fullmatch(r'build/[\w/]*\w', word) and (word.count('/') > 1 or word[len('build/'):] not in folders) \
            and word.split('/')[1] not in folders[2:]


class Pages(unittest.TestCase):
    def test_links_lead_somewhere(self):
        for path in PAGES:
            text = path.read_text()
            for link in re.findall(r'\]\(([^)#:]+)(?:#[^)]*)?\)', text):
                with self.subTest(page=path.name, link=link):
                    self.assertTrue((path.parent / link).exists())

    def test_files_of_the_collection_exist(self):
        data = os.environ.get('SPRINGLS_DATA')
        if not data:
            self.skipTest('SPRINGLS_DATA is not set')
        for path in PAGES:
            for name in collection_files(path):
                with self.subTest(page=path.name, file=name):
                    self.assertTrue(list(pathlib.Path(data).glob(name)))

    def test_quick_figures(self):
        """Bits are the same at every level of optimisation; the sample is compiled quickly."""
        done = subprocess.run([sys.executable, ROOT / 'docs/pages.py', '--check', '--only', 'test'], capture_output=True, text=True,
                              env=dict(os.environ, PAGES_CFLAGS='-O1'))
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertRegex(done.stdout, r'[1-9]\d* passed, 0 failed')


if __name__ == '__main__':
    result = unittest.main(exit=False).result
    failed = len(result.failures) + len(result.errors)
    print(f'Pass: {max(0, result.testsRun - failed - len(result.skipped))}, fail: {failed}, skip: {len(result.skipped)}.')
    sys.exit(failed > 0)
