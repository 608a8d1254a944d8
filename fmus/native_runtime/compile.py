"""The C runtime compiled into shared libraries, each made once and kept in the user's cache."""

from __future__ import annotations

import hashlib
import os
import shlex
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import fmpy

from .platforms import Platform, UnknownPlatform, local_platform

SOURCES = Path(__file__).parent / "c"
# No -ffast-math: the order of sums is ours, and a repeated step gives the same bits. No
# contraction: processors and compilers differ in what they fuse. Without it Linux, Windows and ARM
# have the same bits but where libm differs; with it a step is a twentieth cheaper.
FLAGS = ("-std=c99", "-O3", "-ffp-contract=off", "-fvisibility=hidden", "-fPIC", "-shared", "-s")
LINES = 8  # of a compiler's complaints that we pass on


class CompilerMissing(ValueError):  # noqa: N818 (it says what happened)
    """There is no compiler for what is asked for."""


class CompilationFailed(RuntimeError):  # noqa: N818 (it says what happened)
    """A compiler refused the sources, or could not be run, or its result not be kept."""


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


def sources(fmi: int) -> list[Path]:
    """The C files of the runtime for FMI version 2 or 3: its front, and what is common to both."""
    return sorted(
        path
        for path in SOURCES.glob("*.c")
        if path.name.startswith(f"fmi{fmi}") or not path.name.startswith("fmi")
    )


def headers(fmi: int) -> list[Path]:
    """The headers they include: ours, and FMI's own, which FMPy brings."""
    theirs = (Path(fmpy.__file__).parent / "c-code").glob(f"fmi{fmi}*.h")
    return sorted(SOURCES.glob("*.h")) + sorted(theirs)


def build(
    fmi: int,
    platforms: Sequence[Platform] | None = None,
    progress: Callable[[str], None] = lambda text: None,
) -> dict[Platform, Path]:
    """Compile the runtime; platforms side by side.

    What has been compiled before is taken from `$XDG_CACHE_HOME/railcosim` (`~/.cache/railcosim`).
    Several processes may do this at once.

    Parameters
    ----------
    fmi : int
        Version of FMI, 2 or 3.
    platforms : sequence of Platform, optional
        This machine if not given.
    progress : callable
        Told what is being done.

    Returns
    -------
    dict
        Platform to shared library.

    Raises
    ------
    CompilerMissing, CompilationFailed, UnknownPlatform
        See there.
    """
    wanted = (local_platform(),) if platforms is None else tuple(platforms)
    compilers = {platform: compiler_for(platform) for platform in wanted}
    places = {p: _place(fmi, p, compiler) for p, compiler in compilers.items()}
    waiting = {p for p, place in places.items() if not place.is_file()}
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        tasks = {pool.submit(_compile, fmi, compilers[p], places[p]): p for p in waiting}
        done = as_completed(tasks)
        while waiting:
            progress("compiling for " + ", ".join(sorted(p.fmi2 for p in waiting)))
            task = next(done)
            task.result()
            waiting.remove(tasks[task])
    return places


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
    local = platform == _local()
    if local and (named := os.environ.get("CC")):
        return _system(_words(named))
    try:
        zig = version("ziglang")
    except PackageNotFoundError:
        pass
    else:
        command = (sys.executable, "-m", "ziglang", "cc", "-target", platform.target)
        return Compiler(command, f"ziglang {zig}")
    if not local:
        raise CompilerMissing(
            f"a binary for {platform.fmi2} is made by zig, which is not installed: "
            f'pip install "railcosim[native]", or leave {platform.fmi2} out'
        )
    for name in ("cc", "gcc", "clang"):
        if shutil.which(name):
            return _system([name])
    raise CompilerMissing(
        "a native FMU needs a C compiler, and there is none (no cc, gcc or clang on the PATH, no "
        "zig in this Python). Three ways out: install one (Debian, Ubuntu: apt install gcc "
        'libc6-dev); or pip install "railcosim[native]"; or export with --runtime python'
    )


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


def _place(fmi: int, platform: Platform, compiler: Compiler) -> Path:
    """Where the library is kept: named by all that goes into it."""
    digest = hashlib.sha256()
    for text in (platform.target, compiler.identity, *FLAGS):
        digest.update(text.encode() + b"\0")
    for path in sources(fmi) + headers(fmi):
        content = path.read_bytes()
        digest.update(f"{path.name} {len(content)}\0".encode() + content)
    return _cache() / f"fmi{fmi}-{platform.fmi3}-{digest.hexdigest()[:32]}{platform.suffix}"


def _cache() -> Path:
    try:
        return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "railcosim"
    except RuntimeError:
        raise CompilationFailed(
            "there is no home folder to keep the compiled runtime in; set XDG_CACHE_HOME to a "
            "folder that can be written"
        ) from None


def _compile(fmi: int, compiler: Compiler, place: Path) -> None:
    """Compile in a folder of our own, then move: others see the whole library or none."""
    folders = sorted({str(path.parent) for path in headers(fmi)})
    try:
        place.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=place.parent, prefix="building-") as folder:
            made = Path(folder) / place.name
            command = [
                *compiler.command, *FLAGS, *(f"-I{f}" for f in folders), "-o", str(made),
                *(str(path) for path in sources(fmi)), "-lm",
            ]  # fmt: skip
            told = subprocess.run(command, capture_output=True, text=True, check=False)
            if told.returncode != 0:
                raise CompilationFailed(_complaint(command, told))
            made.replace(place)
    except OSError as error:
        raise CompilationFailed(
            f"the compiled runtime cannot be kept in {place.parent} ({error.strerror}); "
            "set XDG_CACHE_HOME to a folder that can be written"
        ) from None


def _complaint(command: list[str], told: subprocess.CompletedProcess[str]) -> str:
    lines = (told.stderr + told.stdout).strip().splitlines()[:LINES]
    return "\n".join([f"the native runtime does not compile: {shlex.join(command)}", *lines])
