"""What POSIX alone has stays off the way of the commands: they load on Windows too.

Tried there: the FMUs' binaries (by wine, tests/native/test_foreign.py). Not tried: the commands.
"""

import subprocess
import sys

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
for name in ("SIGKILL", "SIGHUP", "SIGALRM", "setitimer", "pthread_sigmask"):
    if hasattr(signal, name):
        delattr(signal, name)
sys.platform = "win32"
class Locking:  # of Windows' C library
    LK_NBLCK, LK_UNLCK = 2, 0
    locking = staticmethod(lambda descriptor, mode, size: None)
sys.modules["msvcrt"] = Locking
import railcosim.cli.main
sys.argv = ["railcosim", *sys.argv[1:]]
sys.platform = "linux"  # whose FMUs are to be made
railcosim.cli.main.run()
"""


def test_commands_without_what_posix_alone_has(tmp_path):
    """Export, run and frf are loaded, and parameters go out and FMUs are made."""
    (tmp_path / "t.toml").write_text(
        "[mesh]\ncells = 8\nhighest_slab_frequency = 400\nhighest_frequency = 800\n"
    )
    command = [sys.executable, "-c", WITHOUT_POSIX, "export", "--out", "fmus", "--track", "t.toml"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert {p.suffix for p in (tmp_path / "fmus").iterdir()} == {".fmu", ".ssp"}
