"""The C runtime as shared libraries: those that came with railcosim, or compiled and kept."""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
import tempfile
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path

import fmpy

from railcosim.compiling.compilers import (
    FLAGS,
    Compiler,
    CompilerMissing,
    compiler_for,
    is_own_choice,
    zig,
)
from railcosim.compiling.kept import CacheRefused, cache, digest, find, keep
from railcosim.compiling.platforms import Platform, local_platform
from railcosim.storage.temporary import scratch

__all__ = ["CacheRefused", "CompilationFailed", "CompilerMissing", "build", "headers", "sources"]

SOURCES = Path(__file__).parent / "c"
COMPILED = "compiled"  # folder beside the sources: libraries that an installed railcosim brings
LINES = 8  # of a compiler's complaints that we pass on


class CompilationFailed(RuntimeError):  # noqa: N818 (it says what happened)
    """A compiler refused the sources, or could not be run, or its result not be kept."""


def sources(fmi: int, folder: Path | None = None) -> list[Path]:
    """The C files of the runtime for FMI version 2 or 3: its front, and what is common to both."""
    return sorted(
        path
        for path in (folder or SOURCES).glob("*.c")
        if path.name.startswith(f"fmi{fmi}") or not path.name.startswith("fmi")
    )


def headers(fmi: int) -> list[Path]:
    """The headers they include: ours, and FMI's own, which FMPy brings."""
    return sorted(SOURCES.glob("*.h")) + _of_the_standard(fmi)


def build(
    fmi: int,
    platforms: Sequence[Platform] | None = None,
    progress: Callable[[str], None] = lambda text: None,
) -> dict[Platform, Path]:
    """The runtime's libraries: as installed with railcosim, else compiled, platforms side by side.

    What has been compiled before is taken from the user's cache (`kept.cache`). A library that is
    not what its name says is made again. Several processes may do this at once. With `$CC` set, the
    one for this machine is compiled by that.

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
    CompilerMissing, CompilationFailed, CacheRefused, UnknownPlatform
        See there.
    """
    wanted = (local_platform(),) if platforms is None else tuple(platforms)
    places = {p: None if is_own_choice(p) else installed(fmi, p) for p in wanted}
    compilers = {p: compiler_for(p) for p, place in places.items() if place is None}
    if compilers:
        folder = _writable_cache()
        stems = {p: stem_of(fmi, p, *_more_in_cache(fmi, c)) for p, c in compilers.items()}
        places |= {p: find(folder, stem, p.suffix) for p, stem in stems.items()}
    waiting = {p for p, place in places.items() if place is None}
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        tasks = {
            pool.submit(make, fmi, p, compilers[p], folder, *_more_in_cache(fmi, compilers[p])): p
            for p in waiting
        }
        done, begun, first = as_completed(tasks), time.monotonic(), len(waiting)
        while waiting:
            told = "compiling for " + ", ".join(sorted(p.fmi2 for p in waiting))
            if made := first - len(waiting):
                spent = time.monotonic() - begun
                told += (
                    f" ({made} took {spent:.0f} s: about {spent * len(waiting) / made:.0f} more)"
                )
            progress(told)
            task = next(done)
            places[tasks[task]] = task.result()
            waiting.remove(tasks[task])
    return {p: place for p, place in places.items() if place is not None}


def installed(fmi: int, platform: Platform) -> Path | None:
    """The library that came with this installation, if one did."""
    return find(SOURCES.parent / COMPILED, stem_of(fmi, platform), platform.suffix)


def compile_for_wheel(platforms: Sequence[Platform], folder: Path) -> None:
    """Compile for both versions of FMI, by zig, into a folder: what `installed` finds later.

    Raises
    ------
    CompilerMissing, CompilationFailed
        See there.
    """
    compilers = {p: zig(p) for p in platforms}

    def compiled(fmi: int, platform: Platform) -> Path:
        if (compiler := compilers[platform]) is None:
            raise CompilerMissing("zig is not installed where the wheel is built")
        return make(fmi, platform, compiler, folder)

    with ThreadPoolExecutor(os.cpu_count()) as pool:  # each takes zig 7 s
        tasks = [pool.submit(compiled, fmi, p) for fmi in (2, 3) for p in platforms]
        for task in tasks:
            task.result()


def stem_of(fmi: int, platform: Platform, *more: str | Path, folder: Path | None = None) -> str:
    """Beginning of a library's name, from our sources (or a copy), our flags, and `more`."""
    parts = [text.encode() for text in (platform.target, *FLAGS)]
    parts += [
        f"{path.name} ".encode() + path.read_bytes()
        for path in [*sources(fmi, folder), *sorted((folder or SOURCES).glob("*.h"))]
    ]
    parts += [part.read_bytes() if isinstance(part, Path) else part.encode() for part in more]
    whole = b"".join(f"{len(part)} ".encode() + part for part in parts)
    return f"fmi{fmi}-{platform.fmi3}-{digest(whole)}"


def make(fmi: int, platform: Platform, compiler: Compiler, folder: Path, *more: str | Path) -> Path:
    """Compile, and keep the library in a folder under a name that begins with its `stem_of`.

    A copy of the sources is compiled and named: they may change meanwhile.

    Raises
    ------
    CompilationFailed
        If the compiler complains, or the library cannot be kept.
    """
    folders = sorted({str(path.parent) for path in _of_the_standard(fmi)})
    try:
        with tempfile.TemporaryDirectory(dir=scratch()) as work:
            ours = Path(shutil.copytree(SOURCES, Path(work, "c")))
            stem = stem_of(fmi, platform, *more, folder=ours)
            made = Path(work) / f"runtime{platform.suffix}"
            command = [
                *compiler.command, *FLAGS, *(f"-I{f}" for f in folders), "-o", str(made),
                *(str(path) for path in sources(fmi, ours)), "-lm",
            ]  # fmt: skip
            told = subprocess.run(command, capture_output=True, text=True, check=False)
            if told.returncode != 0:
                # Of our files, not of their copies, which are gone when it is read.
                there = [part.replace(str(ours), str(SOURCES)) for part in command]
                words = (told.stderr + told.stdout).replace(str(ours), str(SOURCES))
                raise CompilationFailed(_complaint(there, words))
            return keep(folder, stem, platform.suffix, made.read_bytes())
    except OSError as error:
        raise _not_kept(folder, error) from None


def _of_the_standard(fmi: int) -> list[Path]:
    return sorted((Path(fmpy.__file__).parent / "c-code").glob(f"fmi{fmi}*.h"))


def _more_in_cache(fmi: int, compiler: Compiler) -> list[str | Path]:
    """What a library in the cache depends on beside us."""
    return [compiler.identity, *_of_the_standard(fmi)]


def _writable_cache() -> Path:
    try:
        return cache()
    except OSError as error:
        raise _not_kept("the user's cache", error) from None


def _not_kept(folder: Path | str, error: OSError) -> CompilationFailed:
    return CompilationFailed(
        f"the compiled runtime cannot be kept in {folder} ({error.strerror}); "
        "set XDG_CACHE_HOME to a folder that can be written"
    )


def _complaint(command: list[str], words: str) -> str:
    lines = words.strip().splitlines()[:LINES]
    return "\n".join([f"the native runtime does not compile: {shlex.join(command)}", *lines])
