"""The C compiler for FMUs that tests make themselves."""

from __future__ import annotations

import importlib.util
import os
import shlex
import shutil
import sys

import pytest


def c_compiler() -> list[str]:
    """Its command: $CC, the system's, or zig; without any the test is skipped, and says so."""
    if named := os.environ.get("CC"):
        return shlex.split(named)
    for name in ("cc", "gcc", "clang"):
        if shutil.which(name):
            return [name]
    if importlib.util.find_spec("ziglang") is not None:
        return [sys.executable, "-m", "ziglang", "cc"]
    return pytest.skip('no C compiler for the FMU of this test: apt install gcc, or ".[native]"')
