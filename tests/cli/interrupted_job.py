"""Run for test_keeping.py: ``FOLDER MOMENTS ARGUMENT...``, a command, asked to end.

In a fork for each moment, so that modules are imported once. A moment is ``SIGNAL@saving``: results
take half a second to write, and three signals come then; or ``SIGNAL@0.3``: it comes after that
part of the processor's time that the command takes, however busy the machine is.
"""

import atexit
import os
import signal
import sys
import time
from pathlib import Path

from railcosim.cli import main
from railcosim.master import files


def later(number, seconds):
    """Have the signal come after so much time of the processor."""
    signal.signal(signal.SIGPROF, lambda *_: os.kill(os.getpid(), signal.Signals[number]))
    signal.setitimer(signal.ITIMER_PROF, seconds)


def command(folder, arguments):
    os.chdir(folder)
    descriptor = os.open("said", os.O_CREAT | os.O_WRONLY)
    for stream in (1, 2):
        os.dup2(descriptor, stream)
    sys.argv = ["railcosim", *arguments]
    main.run()


def fork(folder, arguments, *alarm):
    folder.mkdir()
    child = os.fork()
    if child == 0:
        try:
            if alarm:
                later(*alarm)
            command(folder, arguments)
            status = 0
        except SystemExit as stop:
            status = stop.code
        atexit._run_exitfuncs()  # what a process does that is no fork
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(status)
    return child


def wait(child, folder):
    """Until it ends; the processor's time that it took (s)."""
    _, status, used = os.wait4(child, 0)
    (folder / "status").write_text(str(os.waitstatus_to_exitcode(status)))
    return used.ru_utime + used.ru_stime


really = files.save


def slow_save(dataset, path):
    Path("saving").touch()
    time.sleep(0.5)
    really(dataset, path)


def work(folder, moments, *arguments):
    folder = Path(folder)
    taken = wait(fork(folder / "whole", arguments), folder / "whole")
    for k, moment in enumerate(moments.split(",")):
        number, when = moment.split("@")
        here = folder / str(k)
        files.save = slow_save if when == "saving" else really
        alarm = () if when == "saving" else (number, taken * float(when))
        child = fork(here, arguments, *alarm)
        if when == "saving":
            while not (here / "saving").exists():
                time.sleep(0.01)
            for _ in range(3):
                os.kill(child, signal.Signals[number])
                time.sleep(0.05)
        wait(child, here)


work(*sys.argv[1:])
