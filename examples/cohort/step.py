"""step.py STEP.json ATTEMPT ATTEMPTS COMMAND... - runs COMMAND FOLDER for one scan, FOLDER being that of STEP.json, which gets how it ended.

A program that refuses its scan, or does not trust its result, has done its work: that is for the table, and no reason to stop the others.
One that was killed is run again, by failing here; what kills it in the last attempt too is for the table. A wrong option is no scan's fault,
and never done."""
import json
import os
import resource
import shutil
import signal
import subprocess
import sys
import time

WRONG_USAGE = 2


def last_line(path):
    with open(path, errors='replace') as log:
        lines = [line.strip() for line in log if line.strip()]
    return lines[-1] if lines else ''


def outcome(status, folder):
    """Returns in a word how a program ended, and why."""
    if status < 0:
        return 'failed', f'ended by {signal.Signals(-status).name}'
    if status == 0:
        return 'trusted', ''
    wrote = os.path.exists(os.path.join(folder, 'report.json'))
    return 'not trusted' if wrote else 'failed', last_line(os.path.join(folder, 'log.txt')) or f'exit status {status}'


def main():
    path, attempt, attempts, *command = sys.argv[1:]
    folder = os.path.dirname(path)
    shutil.rmtree(folder, ignore_errors=True)
    os.makedirs(folder)
    begin = time.monotonic()
    with open(os.path.join(folder, 'log.txt'), 'w') as log:
        status = subprocess.run([*command, folder], stdout=log, stderr=log).returncode
    if status == WRONG_USAGE:
        sys.exit(last_line(os.path.join(folder, 'log.txt')))
    if status < 0 and int(attempt) < int(attempts):
        sys.exit(f'{folder}: {outcome(status, folder)[1]} in attempt {attempt} of {attempts}')
    result, reason = outcome(status, folder)
    if reason:
        print(f'{folder}: {result}: {reason}', file=sys.stderr)
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    step = {'result': result, 'reason': reason, 'attempt': int(attempt), 'seconds': time.monotonic() - begin,
            'processor_seconds': used.ru_utime + used.ru_stime, 'mib': used.ru_maxrss / 1024}
    # At once or not at all: what is there counts as done.
    with open(path + '.new', 'w') as file:
        json.dump(step, file, indent=1)
    os.replace(path + '.new', path)


if __name__ == '__main__':
    try:
        main()
    except KeyboardInterrupt:
        sys.exit(130)
