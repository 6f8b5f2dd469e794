"""step.py STEP.json ATTEMPT ATTEMPTS MINUTES COMMAND... - runs COMMAND FOLDER for one scan, FOLDER being that of STEP.json, which gets how
it ended.

A program that refuses its scan, or does not trust its result, has done its work: that is for the table, and no reason to stop the others.
One that was killed is run again, by failing here; what kills it in the last attempt too is for the table, and so is what takes longer than
MINUTES. A wrong option is no scan's fault, and never done."""
import json
import os
import re
import resource
import shutil
import signal
import subprocess
import sys
import time

WRONG_USAGE = 2
# The last line of atlas segment and of register that have written all there is to write, and doubt it.
DOUBT = re.compile(r'atlas: .*: not to be trusted: |register: the result is not to be trusted: ')


def last_line(path):
    with open(path, errors='replace') as log:
        lines = [line.strip() for line in log if line.strip()]
    return lines[-1] if lines else ''


def signal_name(number):
    try:
        return signal.Signals(number).name
    except ValueError:   # those of real time have no names
        return f'signal {number}'


def run(command, log, minutes):
    """Returns a program's exit status, None where it takes too long. It has a minute less than the job, which a cluster ends then: time to
    write what came of it."""
    try:
        return subprocess.run(command, stdout=log, stderr=log, timeout=60 * max(minutes - 1, minutes / 2)).returncode
    except subprocess.TimeoutExpired:
        return None


def outcome(status, folder, minutes):
    """Returns in a word how a program ended, and why."""
    if status is None:
        return 'failed', f'longer than {minutes:g} minutes'
    if status < 0:
        return 'failed', f'ended by {signal_name(-status)}'
    if status == 0:
        return 'trusted', ''
    said = last_line(os.path.join(folder, 'log.txt'))
    return 'not trusted' if DOUBT.match(said) else 'failed', said or f'exit status {status}'


def main():
    path, attempt, attempts, minutes, *command = sys.argv[1:]
    minutes = float(minutes)
    folder = os.path.dirname(path)
    shutil.rmtree(folder, ignore_errors=True)
    os.makedirs(folder, exist_ok=True)
    begin = time.monotonic()
    with open(os.path.join(folder, 'log.txt'), 'w') as log:
        status = run([*command, folder], log, minutes)
    if status == WRONG_USAGE:
        sys.exit(last_line(os.path.join(folder, 'log.txt')))
    result, reason = outcome(status, folder, minutes)
    if status is not None and status < 0 and int(attempt) < int(attempts):
        sys.exit(f'{folder}: {reason} in attempt {attempt} of {attempts}')
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
