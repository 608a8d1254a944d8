"""What a wheel is made with: `build_backend.py`, in a process of its own, as pip runs it."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from railcosim.compiling.platforms import PLATFORMS, local_platform

pytest.importorskip("setuptools", reason="no setuptools here: pip brings it for a build")
ROOT = Path(__file__).parents[2]
HERE, ALL = local_platform().fmi2, " ".join(p.fmi2 for p in PLATFORMS)
ASK = """import sys; sys.path.insert(0, sys.argv[1]); import build_backend
print(*(p.fmi2 for p in build_backend.wanted({"platforms": sys.argv[2]} if sys.argv[2:] else None)))
"""


def wanted(path, *named, **more):
    """Platforms that a wheel is compiled for where PATH is this folder."""
    environment = {k: v for k, v in os.environ.items() if k != "CC"} | {"PATH": str(path)} | more
    told = subprocess.run(
        [sys.executable, "-c", ASK, str(ROOT), *named],
        env=environment, capture_output=True, text=True, check=True,
    )  # fmt: skip
    return told.stdout.strip()


def fake(folder, name, script):
    """A program of this name in the folder; the folder."""
    program = folder / name
    program.write_text(f"#!/bin/sh\n{script}\n")
    program.chmod(0o755)
    return folder


def test_no_compiler(tmp_path):
    assert wanted(tmp_path) == HERE


@pytest.mark.parametrize("name", ["cc", "gcc", "clang"])
def test_a_compiler_without_headers(tmp_path, name):
    """As Debian's gcc without libc6-dev, or Apple's cc that only asks to install the tools."""
    script = 'case "$*" in *--version*) echo 12.2;; *) echo "no stdlib.h" >&2; exit 1;; esac'
    assert wanted(fake(tmp_path, name, script)) == HERE


def test_a_compiler_that_makes_nothing(tmp_path):
    assert wanted(fake(tmp_path, "cc", "exit 0")) == HERE


def test_a_compiler(tmp_path):
    """Then nothing: it is compiled when needed, for exactly this machine."""
    if (cc := shutil.which("cc")) is None:
        pytest.skip("no C compiler: apt install gcc libc6-dev")
    assert wanted(fake(tmp_path, "clang", f'PATH={os.environ["PATH"]} exec {cc} "$@"')) == ""
    assert wanted(tmp_path, CC="cc") == HERE  # the one that is named is not there


@pytest.mark.parametrize(
    ("named", "expected"), [("all", ALL), ("win64, darwin64", "win64 darwin64")]
)
def test_platforms_named(tmp_path, named, expected):
    assert wanted(tmp_path, named) == expected
