"""Makes the wheel: setuptools does, and this adds the compiled runtime for who has no compiler.

pip asks what a build needs (`get_requires_for_build_wheel`, PEP 517) and has it made. A wheel holds
the runtime for the platforms named by ``--config-settings platforms=all`` (or a list such as
linux64,win64), made by zig; if none are named, for this machine if it has no C compiler.
"""

from __future__ import annotations

import sys

if sys.version_info < (3, 11):  # noqa: UP036 - pip asks for the build before it compares
    sys.exit("railcosim needs Python 3.11 or newer, and this is " + sys.version.split()[0])

import os
import shlex
import shutil
import subprocess
import tempfile
import tomllib
from pathlib import Path
from types import ModuleType

from setuptools import build_meta
from setuptools.build_meta import *  # noqa: F403 - the rest of the interface
from setuptools.command.build_py import build_py

ROOT = Path(__file__).parent
# `railcosim` is the folders here, as in the wheel, whatever is installed.
sys.modules["railcosim"] = ModuleType("railcosim")
sys.modules["railcosim"].__path__ = [str(ROOT)]

from railcosim.compiling.compilers import NAMES  # noqa: E402
from railcosim.compiling.platforms import (  # noqa: E402
    Platform,
    UnknownPlatform,
    local_platform,
    platforms_named,
)

Settings = dict[str, str | list[str]] | None
TRIAL = "#include <math.h>\n#include <stdlib.h>\ndouble f(double x) { return exp(x); }\n"


def get_requires_for_build_wheel(config_settings: Settings = None) -> list[str]:
    """Zig, and FMPy for FMI's headers, if something is to be compiled."""
    needed = build_meta.get_requires_for_build_wheel(config_settings)
    if not wanted(config_settings):
        return needed
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    headers = [text for text in project["dependencies"] if text.startswith("fmpy")]
    return [*needed, *project["optional-dependencies"]["native"], *headers]


def build_wheel(
    wheel_directory: str,
    config_settings: Settings = None,
    metadata_directory: str | None = None,
) -> str:
    """Build it, and say its name."""
    BuildPy.platforms = wanted(config_settings)
    return build_meta.build_wheel(wheel_directory, config_settings, metadata_directory)


def wanted(settings: Settings) -> tuple[Platform, ...]:
    """What to compile for."""
    if named := (settings or {}).get("platforms"):
        return platforms_named(named if isinstance(named, str) else ",".join(named))
    try:
        return () if has_compiler() else (local_platform(),)
    except UnknownPlatform:
        return ()


def has_compiler() -> bool:
    """Whether there is a C compiler, with headers and a library."""
    named = os.environ.get("CC")
    commands = [shlex.split(named)] if named else [[name] for name in NAMES]
    return any(_compiles(command) for command in commands)


def _compiles(command: list[str]) -> bool:
    if shutil.which(command[0]) is None:
        return False
    with tempfile.TemporaryDirectory() as folder:
        source, library = Path(folder, "trial.c"), Path(folder, "trial.so")
        source.write_text(TRIAL)
        told = subprocess.run(
            [*command, "-shared", "-fPIC", "-o", str(library), str(source), "-lm"],
            capture_output=True,
            check=False,
        )
        return told.returncode == 0 and library.is_file()


class BuildPy(build_py):
    """Copies the modules, and compiles."""

    platforms: tuple[Platform, ...] = ()

    def run(self) -> None:
        """Do it. In an editable installation nothing is compiled: its sources may change."""
        super().run()
        whole = Path(self.build_lib, "railcosim")
        runtime = whole / "fmus" / "native_runtime" / "compiled"
        batch = whole / "master" / "batch" / "compiled"
        for folder in (runtime, batch):
            shutil.rmtree(folder, ignore_errors=True)  # what an earlier build has left
        if not self.platforms or self.editable_mode:
            return
        # Here, since it needs what only such a build has.
        from railcosim.fmus.native_runtime.compile import compile_for_wheel  # noqa: PLC0415
        from railcosim.master.batch import library  # noqa: PLC0415

        for folder in (runtime, batch):
            folder.mkdir(parents=True)
        compile_for_wheel(self.platforms, runtime)
        library.compile_for_wheel(self.platforms, batch)
