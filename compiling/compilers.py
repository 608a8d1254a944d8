"""C compilers: which one makes a library for a platform, and how it is called."""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
import sys
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version

from .platforms import Platform, UnknownPlatform, local_platform

NAMES = ("cc", "gcc", "clang")
# No -ffast-math: the order of sums is ours, and a repeated step gives the same bits. No
# contraction: processors and compilers differ in what they fuse. Without it Linux, Windows and ARM
# have the same bits but where libm differs; with it a step is a twentieth cheaper.
FLAGS = ("-std=c99", "-O3", "-ffp-contract=off", "-fvisibility=hidden", "-fPIC", "-shared", "-s")


class CompilerMissing(ValueError):  # noqa: N818 (it says what happened)
    """There is no compiler for what is asked for."""


@dataclass(frozen=True)
class Compiler:
    """How to call a compiler for one platform.

    Attributes
    ----------
    command : tuple of str
        Program and first arguments.
    identity : str
        Program and version: a new one compiles anew.
    """

    command: tuple[str, ...]
    identity: str


def is_own_choice(platform: Platform) -> bool:
    """Whether the user names the compiler: `$CC`, which is for this machine."""
    return bool(os.environ.get("CC")) and platform == _local()


def compiler_for(platform: Platform) -> Compiler:
    """For this machine `$CC` if set, then zig, then the system's compiler; for others zig.

    Zig first, because what it makes also runs on systems older than this one: it asks for glibc
    2.17 at most. The system's compiler asks for what the system has, for instance for the exp() of
    glibc 2.29.

    Raises
    ------
    CompilerMissing
        If there is none.
    """
    if is_own_choice(platform):
        return _system(_words(os.environ["CC"]))
    if (found := zig(platform)) is not None:
        return found
    if platform != _local():
        raise CompilerMissing(
            f"a binary for {platform.fmi2} is made by zig, which is not installed: "
            f'pip install "railcosim[native]", or leave {platform.fmi2} out'
        )
    if (local := _on_path()) is not None:
        return local
    raise CompilerMissing(
        "a native FMU needs a C compiler, and there is none (no cc, gcc or clang on the PATH, no "
        "zig in this Python), nor a compiled runtime in this installation. Four ways out: install "
        "railcosim anew, which brings one where there is no compiler; or install a compiler "
        '(Debian, Ubuntu: apt install gcc libc6-dev); or pip install "railcosim[native]"; or '
        "export with --runtime python"
    )


def of_system() -> Compiler:
    """For this machine `$CC` if set, else the system's, for what needs nothing of a system.

    Raises
    ------
    CompilerMissing
        If there is none.
    """
    if named := os.environ.get("CC"):
        return _system(_words(named))
    if (found := _on_path()) is None:
        raise CompilerMissing(f"no {', '.join(NAMES)} on the PATH")
    return found


def zig(platform: Platform) -> Compiler | None:
    """Zig's C compiler, if this Python has it."""
    try:
        found = version("ziglang")
    except PackageNotFoundError:
        return None
    command = (sys.executable, "-m", "ziglang", "cc", "-target", platform.target)
    return Compiler(command, f"ziglang {found}")


def _on_path() -> Compiler | None:
    return next((_system([name]) for name in NAMES if shutil.which(name)), None)


def _local() -> Platform | None:
    try:
        return local_platform()
    except UnknownPlatform:
        return None


def _words(named: str) -> list[str]:
    try:
        return shlex.split(named)
    except ValueError as error:
        raise CompilerMissing(
            f"the variable CC = {named!r} is no command ({error}); correct or unset it"
        ) from None


def _system(command: list[str]) -> Compiler:
    try:
        told = subprocess.run([*command, "--version"], capture_output=True, text=True, check=False)
    except OSError as error:
        raise CompilerMissing(
            f"the C compiler {shlex.join(command)!r} cannot be run ({error.strerror}); "
            "is the variable CC right?"
        ) from None
    return Compiler(tuple(command), shlex.join(command) + told.stdout)
