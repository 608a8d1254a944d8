"""Run for test_checkpoint.py in a process that is killed: ``FILE`` or ``FOLDER CALLS``.

A checkpoint at every point; if there is one already, from there on. With CALLS, so many runs are
made, each in a fork that kills itself in the call of that number that makes something lasting
(fsync or rename): before the call if the number is even, behind it if it is odd.
"""

import itertools
import os
import signal
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

from oscillator import make_system

from railcosim.master.checkpoint import Checkpoints, resume
from railcosim.master.cosimulation import cosimulate
from railcosim.master.recording import Recorder
from railcosim.master.schemes.jacobi import jacobi


def run_job(path):
    about = {"speed": 250 / 3.6, "irregularity": "none"}
    system = make_system()
    recorder = Recorder(system)
    run = cosimulate(system, jacobi(degree=2), 0.01, 1.0)
    if path.exists():
        resume(path, run, recorder, about)
    for point in Checkpoints(path, 1e-9).watch(run, recorder, about):
        recorder.add(point)
        print("point".ljust(4095), flush=True)  # test_killed_at_random: a page


def die_in(last):
    moments = itertools.count()

    def count():
        if next(moments) == last:
            os.kill(os.getpid(), signal.SIGKILL)

    def dying(call):
        def wrapped(*arguments):
            count()
            result = call(*arguments)
            count()
            return result

        return wrapped

    os.fsync, Path.replace = dying(os.fsync), dying(Path.replace)


def main(path, calls=0):
    if not calls:
        run_job(Path(path))
    else:
        run_job(Path(path) / "whole")  # imports what every fork would import by itself
    for call in range(int(calls)):
        child = os.fork()
        if child == 0:
            die_in(call)
            run_job(Path(path) / str(call))
        assert os.WTERMSIG(os.waitpid(child, 0)[1]) == signal.SIGKILL


main(*sys.argv[1:])
