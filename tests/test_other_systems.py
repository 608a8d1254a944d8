"""What POSIX alone has stays off the way of the commands: they load on Windows too.

Tried there: the FMUs' binaries (by wine, tests/native/test_foreign.py). Not tried: the commands.
"""

import subprocess
import sys

import pytest

# Gone before anything is loaded: modules and functions that Python on Windows does not have.
# What the standard library itself needs here to start is loaded first.
WITHOUT_POSIX = """import sys, os, signal, subprocess, multiprocessing, tempfile, socket, asyncio
import ctypes, concurrent.futures.process, zipfile, http.server, webbrowser, uuid, getpass
import numpy, scipy.sparse.linalg, xarray, h5netcdf, matplotlib.figure, finufft, fmpy, pythonfmu
import typer, rich.progress, rich.console, plotly, jinja2, pythonfmu.builder
for name in ("fcntl", "resource", "pwd", "grp", "termios", "pty", "syslog"):
    sys.modules[name] = None
for name in ("fork", "getuid", "geteuid", "killpg", "setsid", "sched_getaffinity", "statvfs",
             "O_DIRECTORY", "O_NOFOLLOW"):
    if hasattr(os, name):
        delattr(os, name)
os.process_cpu_count = os.cpu_count  # of 3.13; on POSIX it asks sched_getaffinity
for name in ("SIGKILL", "SIGHUP", "SIGALRM", "setitimer", "pthread_sigmask"):
    if hasattr(signal, name):
        delattr(signal, name)
sys.platform = "win32"
class Locking:  # of Windows' C library
    LK_NBLCK, LK_UNLCK = 2, 0
    locking = staticmethod(lambda descriptor, mode, size: None)
sys.modules["msvcrt"] = Locking
import railcosim.cli.main, railcosim.cli.export, railcosim.cli.run_command, railcosim.cli.frf
import railcosim.analysis.run, railcosim.analysis.response.frf  # what commands load when they work
import railcosim.analysis.pair.export_pair, railcosim.analysis.pair.kept_fmus
sys.argv = ["railcosim", *sys.argv[1:]]
sys.platform = "linux"  # whose FMUs are to be made
railcosim.cli.main.run()
"""


@pytest.mark.slow  # three commands, an export among them
def test_commands_without_what_posix_alone_has(tmp_path):
    """Export, run and frf do their work."""
    (tmp_path / "t.toml").write_text(
        "[mesh]\ncells = 8\nhighest_slab_frequency = 400\nhighest_frequency = 800\n"
    )
    given = ["--vehicle-fmu", "fmus/Vehicle.fmu", "--track-fmu"]
    for command in (
        ["export", "--out", "fmus", "--track", "t.toml", "--model-exchange"],
        ["run", "--out", "r.nc", *given, "fmus/TrackWithContact.fmu", "--time", "0.002"],
        ["frf", "--out", "f.nc", *given, "fmus/Track.fmu", "--frequencies", "10:50:10"],
    ):
        done = subprocess.run(
            [sys.executable, "-c", WITHOUT_POSIX, *command],
            cwd=tmp_path, capture_output=True, text=True, check=False,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
    made = {p.name for p in tmp_path.iterdir()}
    assert {"r.nc", "f.nc", "fmus"} <= made
