"""test_cohort.py - examples/cohort on some of the collection's hippocampi: interrupted and continued on this machine, and as jobs of a
Slurm that is started for it, where a program is killed. The table is the same. What else may happen to a program is played by another one.

    COHORT_ALL=1 tests/examples/test_cohort.py      all 40 subjects: a few minutes"""
import csv
import json
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest

try:
    import nibabel
    import numpy
except ImportError:   # missing() says so
    pass

ROOT = pathlib.Path(__file__).resolve().parents[2]
COHORT = ROOT / 'examples/cohort'
DATA = pathlib.Path(os.environ.get('SPRINGLS_DATA', ''), 'shapes/hippocampus')
ALL = bool(os.environ.get('COHORT_ALL'))
SLURM = ('munged', 'slurmctld', 'slurmd', 'sbatch')


def missing():
    """Returns what there has to be and is not, as a sentence; empty: nothing."""
    lacking = [command for command in ('snakemake', *SLURM) if not shutil.which(command)]
    lacking += [f'build/{name}' for name in ('atlas', 'register') if not (ROOT / 'build' / name).exists()]
    if subprocess.run(['/usr/bin/python3', '-c', 'import nibabel, PIL'], stderr=subprocess.DEVNULL).returncode:
        lacking.append('nibabel or PIL')
    if lacking:
        return 'there is no ' + ', no '.join(lacking)
    if os.geteuid() != 0:
        return 'Slurm is started by root alone'
    return '' if DATA.is_dir() else 'SPRINGLS_DATA is not set'


def wait_for(what, seconds=120):
    end = time.monotonic() + seconds
    while not (found := what()):
        if time.monotonic() > end:
            raise TimeoutError('waited in vain')
        time.sleep(0.1)
    return found


class Slurm:
    """A controller and a node on this machine, with a munge of their own, in a folder."""

    def __init__(self, folder):
        self.folder, self.daemons = folder, []
        (folder / 'munge').mkdir(mode=0o700)
        for name in ('state', 'spool'):
            (folder / name).mkdir()
        (folder / 'munge/key').write_bytes(os.urandom(128))
        (folder / 'munge/key').chmod(0o400)
        host = os.uname().nodename.split('.')[0]
        mib = os.sysconf('SC_PAGE_SIZE') * os.sysconf('SC_PHYS_PAGES') >> 20
        (folder / 'slurm.conf').write_text(f'''ClusterName=here
SlurmctldHost={host}(127.0.0.1)
SlurmUser=root
AuthType=auth/munge
AuthInfo=socket={folder}/munge/socket
CredType=cred/munge
SlurmctldPort=26817
SlurmdPort=26818
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.log
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
ProctrackType=proctrack/pgid
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
MpiDefault=none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SchedulerParameters=batch_sched_delay=0,sched_interval=1
ReturnToService=2
MailProg=/bin/true
NodeName={host} NodeAddr=127.0.0.1 CPUs={os.cpu_count()} RealMemory={mib * 9 // 10} State=UNKNOWN
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
''')
        self.environment = dict(os.environ, SLURM_CONF=str(folder / 'slurm.conf'))
        munge = folder / 'munge'
        self.start('munged', '--foreground', '--force', '--key-file', munge / 'key', '--socket', munge / 'socket',
                   '--pid-file', munge / 'pid',
                   '--log-file', munge / 'log', '--seed-file', munge / 'seed')
        try:
            wait_for((munge / 'socket').exists)
            self.start('slurmctld', '-D', '-i')
            self.start('slurmd', '-D')
            wait_for(lambda: 'idle' in self.ask('sinfo', '-h', '-o', '%T'))
        except TimeoutError:   # as where a container lets no daemon be
            self.stop()
            raise unittest.SkipTest('Slurm does not start on this machine')

    def start(self, *command):
        self.daemons.append(subprocess.Popen(command, env=self.environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL))

    def ask(self, *command):
        return subprocess.run(command, env=self.environment, capture_output=True, text=True).stdout

    def stop(self):
        for daemon in reversed(self.daemons):
            daemon.terminate()
        for daemon in reversed(self.daemons):
            try:
                daemon.wait(20)
            except subprocess.TimeoutExpired:
                daemon.kill()


def process(*words):
    """Returns a process of this machine whose command line has all these words, None: there is none."""
    for path in pathlib.Path('/proc').glob('[0-9]*/cmdline'):
        try:
            said = path.read_bytes().decode(errors='replace').split('\0')
        except OSError:   # it has ended
            continue
        if said[0] == words[0] and all(any(word in part for part in said) for word in words[1:]):
            return int(path.parent.name)
    return None


class Folder(unittest.TestCase):
    """A test in a folder of its own, whose programs have a blank in their path."""

    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name).resolve()
        self.programs = self.folder / 'the programs'

    def write(self, path, text=''):
        path = self.folder / path
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
        return path

    def command(self, profile, out, *more, **settings):
        settings = dict(dict(out=out, programs=self.programs), **settings)
        return ['snakemake', '-s', COHORT / 'Snakefile', '--profile', COHORT / profile, *more, '--config',
                *(f'{name}={value}' for name, value in settings.items())]

    def run_to_end(self, command, **more):
        done = subprocess.run(command, cwd=self.folder, capture_output=True, text=True, **more)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        return done.stdout + done.stderr

    def rows(self, out):
        with open(self.folder / out / 'table.csv') as table:
            return {row['name']: row for row in csv.DictReader(table)}


REPORT = '{"confidence": {"volume_ml": 2, "predicted_dice": 0.5, "predicted_dice_error": 0.1}, "image_warning": "odd"}'
# Does what the scan's name says, after writing a report; builds an atlas, and says so.
PROGRAM = f'''#!/bin/sh
for folder; do :; done
echo '{REPORT}' > "$folder/report.json"
[ "$1" != build ] || {{ echo built >&2; exec touch "$folder/atlas.json"; }}
case $2 in
    *done*) ;;
    *doubted*) echo "atlas: $2: not to be trusted: too big" >&2; exit 1 ;;
    *full*)
        echo '{{"confi' > "$folder/report.json"
        echo no picture > "$folder/slices.png"
        echo "atlas: $folder/report.json: No space left on device" >&2; exit 1 ;;
    *killed*) kill -40 $$ ;;
    *long*) exec sleep 60 ;;
esac
'''


class Programs(Folder):
    def setUp(self):
        super().setUp()
        self.write('the programs/atlas', PROGRAM).chmod(0o755)
        self.write('atlas.json')

    def test_how_programs_end(self):
        for name in ('done', 'doubted', 'full', 'killed'):
            self.write(f'scans/{name}.nii')
        command = self.command('local', 'an out', '--cores', '2', atlas='atlas.json', scans='scans', per_sheet=2)
        self.write('an out/scans_003.png')
        said = self.run_to_end(command)
        self.assertEqual(said.count('Trying to restart job'), 2, said)
        expected = {'done': ('trusted', '2.000', 'odd'),
                    'doubted': ('not trusted', '2.000', 'atlas: scans/doubted.nii: not to be trusted: too big; odd'),
                    'full': ('failed', '', 'atlas: an out/scans/full/report.json: No space left on device'),
                    'killed': ('failed', '', 'ended by signal 40')}
        self.assertEqual(expected, {name: (row['result'], row['volume_ml'], row['warnings']) for name, row in self.rows('an out').items()})
        self.assertEqual(['scans_001.png', 'scans_002.png'], sorted(path.name for path in (self.folder / 'an out').glob('*.png')))

    def test_what_takes_too_long(self):
        path = self.folder / 'long/step.json'
        self.run_to_end([sys.executable, COHORT / 'step.py', path, '1', '3', '0.02', self.programs / 'atlas', 'segment', 'long'])
        step = json.loads(path.read_text())
        self.assertEqual((step['result'], step['reason']), ('failed', 'longer than 0.02 minutes'))

    def test_what_is_done_anew(self):
        """The atlas is built of its subjects, whatever else lies beside their images."""
        for path in ('labels/a.nii', 'images/a.nii', 'scans/done.nii'):
            self.write(path)
        command = self.command('local', 'out', '--cores', '1', subjects='labels', images='images', scans='scans')
        self.assertEqual(self.run_to_end(command).count('built\n'), 1)
        self.write('images/b.nii')
        self.assertIn('Nothing to be done', self.run_to_end(command))
        self.write('labels/b.nii')
        self.assertEqual(self.run_to_end(command).count('built\n'), 1)

    def test_frames_of_a_series(self):
        (self.folder / 'series').mkdir()
        nibabel.Nifti1Image(numpy.zeros((2, 2, 2, 3), numpy.float32), numpy.eye(4)).to_filename(self.folder / 'series/heart.nii')
        self.write('labels/heart.nii')
        said = self.run_to_end(self.command('local', 'out', '-n', '-p', series='series', series_labels='labels'))
        for frame in ('1', '2'):
            self.assertIn(f'--fixed-frame 0 --moving-frame {frame} --inverse-labels labels/heart.nii', said)

    def test_jobs_that_ran_short_of_memory(self):
        """They have succeeded if their log says that all is done."""
        self.write('the programs/scontrol', '#!/bin/sh\necho "JobId=$4 JobState=OUT_OF_MEMORY Reason=OutOfMemory"\n').chmod(0o755)
        self.write('.snakemake/slurm/1.log', 'Finished job 0.\n1 of 1 steps (100%) done\n')
        self.write('.snakemake/slurm/2.log', 'Exiting because a job execution failed.\n')
        path = dict(os.environ, PATH=f'{self.programs}:{os.environ["PATH"]}')
        for job, expected in (('1', 'success'), ('2', 'failed'), ('3', 'failed')):
            self.assertTrue(self.run_to_end(['sh', COHORT / 'slurm/status.sh', job], env=path).startswith(expected))

    def test_settings_that_are_refused(self):
        for path in ('scans/a.nii', 'twice/a.nii', 'twice/a.mha', 'labels/a.nii', 'labels/b.nii', 'images/a.nii', 'single/a.nrrd',
                     'visits/a/1.nii', 'visits/a/2.nii', 'same/a/1.nii', 'same/a/2.nii', 'same/a.nii'):
            self.write(path)
        cases = (('there is no setting scan;', dict(scan='scans')), ('scan_mib is a whole number', dict(scan_mib='much')),
                 ('have the same name', dict(atlas='atlas.json', scans='twice')), ('have the same name', dict(series='same')),
                 ('either atlas, or subjects', dict(atlas='atlas.json', subjects='labels', images='images')),
                 ('missing: images/b.nii', dict(subjects='labels', images='images')), ('missing: a.nii, b.nii', dict(subjects='labels')),
                 ('single/a.nrrd: a series is', dict(series='single')),
                 ('of no series: labels/b.nii', dict(series='visits', series_labels='labels')),
                 ('007: no images here', dict(atlas='atlas.json', scans='007')))
        for expected, settings in cases:
            done = subprocess.run(self.command('local', 'out', '-n', **settings), cwd=self.folder, capture_output=True, text=True)
            self.assertEqual(done.returncode, 1, settings)
            self.assertIn(expected, done.stdout + done.stderr)


class Cohort(Folder):
    def setUp(self):
        super().setUp()
        self.programs.symlink_to(ROOT / 'build')
        for name in ('labels', 'scans', 'series/visits'):
            (self.folder / name).mkdir(parents=True)
        names = sorted(path.name for path in (DATA / 'labels').iterdir())
        for name in names[:17 if ALL else 4]:
            (self.folder / 'labels' / name).symlink_to(DATA / 'labels' / name)
        for name in names if ALL else names[7:9]:
            (self.folder / 'scans' / name).symlink_to(DATA / 'images' / name)
        (self.folder / 'scans/a label map.nii.gz').symlink_to(DATA / 'labels' / names[9])
        (self.folder / 'scans/cut.nii.gz').write_bytes((DATA / 'images' / names[9]).read_bytes()[:2000])
        for visit, name in enumerate(names[7:9]):
            (self.folder / f'series/visits/{visit}.nii.gz').symlink_to(DATA / 'images' / name)

    def command(self, profile, out, *more, **settings):
        return super().command(profile, out, *more, **dict(dict(scans='scans', segment_options='' if ALL else '--steps 1'), **settings))

    def steps(self, out):
        return {path: path.stat().st_mtime_ns for path in (self.folder / out).glob('*/**/step.json')}

    def assert_all_is_done(self, profile, out, **settings):
        self.assertIn('Nothing to be done', self.run_to_end(self.command(profile, out, '-n', **settings)))

    def local(self):
        """Runs on this machine, and is interrupted after the first scan."""
        settings = dict(subjects='labels', images=DATA / 'images', series='series',
                        atlas_options=f'--rounds 1 --templates {3 if ALL else 1}')
        log = self.folder / 'here.out'
        with open(log, 'w') as out:
            begun = subprocess.Popen(self.command('local', 'here', '--cores', '1', **settings), cwd=self.folder, start_new_session=True,
                                     stdout=out, stderr=out)

        def first_scan():
            """Returns what is done once a scan is, when Snakemake knows of all."""
            done = self.steps('here')
            scans = [path for path in done if path.parent.name.startswith('hippocampus')]
            return done if scans and log.read_text().count('Finished job') == 1 + len(done) else None
        before = wait_for(first_scan, 3600)
        os.killpg(begun.pid, signal.SIGINT)
        self.assertNotEqual(begun.wait(60), 0)
        self.assertFalse((self.folder / 'here/table.csv').exists())
        said = self.run_to_end(self.command('local', 'here', '--cores', '2', **settings))
        self.assertNotIn('rule atlas:', said)
        self.assertIn('cut: failed: atlas: scans/cut.nii.gz: cut off', said)
        self.assertEqual(before, {path: when for path, when in self.steps('here').items() if path in before})
        self.assert_all_is_done('local', 'here', **settings)
        wrong = subprocess.run(self.command('local', 'wrong', '--cores', '1', atlas='here/atlas/atlas.json', segment_options='--no-such'),
                               cwd=self.folder, capture_output=True, text=True)
        self.assertNotEqual(wrong.returncode, 0)
        self.assertIn('no-such', wrong.stderr)
        self.assertEqual(self.steps('wrong'), {})

    def on_slurm(self):
        """Runs as jobs, and kills the first program that segments a scan: its job fails, and there is another."""
        slurm = Slurm(self.folder)
        self.addCleanup(slurm.stop)
        command = self.command('slurm', 'there', atlas='here/atlas/atlas.json', series='series')
        with open(self.folder / 'slurm.out', 'w') as log:
            begun = subprocess.Popen(command, cwd=self.folder, env=slurm.environment, stdout=log, stderr=log)
        self.addCleanup(begun.kill)
        program = wait_for(lambda: process(str(self.programs / 'atlas'), 'segment', 'scans/hippocampus', 'there/scans'))
        os.kill(program, signal.SIGKILL)
        status, log = begun.wait(3600), (self.folder / 'slurm.out').read_text()
        self.assertEqual(status, 0, log)
        self.assertEqual(log.count('Trying to restart job'), 1, log)
        self.assertEqual(sorted(json.loads(path.read_text())['attempt'] for path in self.steps('there'))[-2:], [1, 2])
        self.assert_all_is_done('slurm', 'there', atlas='here/atlas/atlas.json', series='series')

    def test_the_table_is_the_same_here_and_on_slurm(self):
        self.local()
        self.on_slurm()
        here, there = ((self.folder / out / 'table.csv').read_text() for out in ('here', 'there'))
        self.assertEqual(here.replace('here/', ''), there.replace('there/', ''))
        rows = self.rows('here')
        self.assertEqual(len(rows), 43 if ALL else 5)
        self.assertEqual({name for name, row in rows.items() if row['result'] == 'failed'}, {'cut', 'a label map'})
        self.assertGreaterEqual(sum(row['result'] == 'trusted' and float(row['confidence']) > 0.8 for row in rows.values()),
                                38 if ALL else 3)
        for out in ('here', 'there'):
            for sheet in ('scans_001.png', 'frames_001.png'):
                self.assertTrue((self.folder / out / sheet).read_bytes().startswith(b'\x89PNG'))
        if ALL:
            print(here, (self.folder / 'here/times.csv').read_text(), (self.folder / 'there/times.csv').read_text())


if __name__ == '__main__':
    why = missing()
    if why:
        print(f'{why}\nPass: 0, fail: 0, skip: 1.')
        sys.exit()
    result = unittest.main(exit=False).result
    failed = len(result.failures) + len(result.errors)
    print(f'Pass: {max(0, result.testsRun - failed - len(result.skipped))}, fail: {failed}, skip: {len(result.skipped)}.')
    sys.exit(failed > 0)
