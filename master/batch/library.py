"""`c/batch.c` as a shared library: installed with railcosim, or compiled and kept, or none."""

from __future__ import annotations

import ctypes
import subprocess
import tempfile
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path

from railcosim.compiling.compilers import FLAGS, Compiler, CompilerMissing, of_system, zig
from railcosim.compiling.kept import CacheRefused, digest, find, keep
from railcosim.compiling.kept import cache as users_cache
from railcosim.compiling.platforms import Platform, UnknownPlatform, local_platform
from railcosim.storage.temporary import scratch

SOURCE = Path(__file__).parent / "c" / "batch.c"
COMPILED = "compiled"  # folder beside the sources: libraries that an installed railcosim brings


@cache
def in_c() -> Callable[..., int] | None:
    """What makes a list of calls; None where there is no library, and no compiler to make one.

    Then Python makes them, to the same bits. Nobody is asked for a compiler, and nothing is said:
    it is a matter of microseconds a step.
    """
    try:
        library = ctypes.CDLL(str(_library()))
    except (CacheRefused, CompilerMissing, UnknownPlatform, OSError, subprocess.CalledProcessError):
        return None
    found = library["railcosim_make"]
    found.restype = ctypes.c_size_t
    return found


def compile_for_wheel(platforms: Sequence[Platform], folder: Path) -> None:
    """Compile by zig, into a folder of which `in_c` takes it later.

    Raises
    ------
    CompilerMissing
        Without zig.
    CalledProcessError
        If it complains.
    """
    for platform in platforms:
        if (compiler := zig(platform)) is None:
            raise CompilerMissing("zig is not installed where the wheel is built")
        _make(platform, compiler, folder)


def _library() -> Path:
    platform = local_platform()
    stem = _stem(platform)
    installed = find(SOURCE.parents[1] / COMPILED, stem, platform.suffix)
    if installed is not None:
        return installed
    folder = users_cache()
    return find(folder, stem, platform.suffix) or _make(platform, of_system(), folder)


def _stem(platform: Platform) -> str:
    """Beginning of its name: of nothing of the compiler, for it needs nothing of a system."""
    parts = (platform.target.encode(), *(flag.encode() for flag in FLAGS), SOURCE.read_bytes())
    return f"batch-{platform.fmi3}-{digest(b' '.join(parts))}"


def _make(platform: Platform, compiler: Compiler, folder: Path) -> Path:
    """Compile, and keep it in a folder."""
    with tempfile.TemporaryDirectory(dir=scratch()) as work:
        made = Path(work) / f"batch{platform.suffix}"
        command = [*compiler.command, *FLAGS, "-o", str(made), str(SOURCE)]
        subprocess.run(command, capture_output=True, check=True)
        return keep(folder, _stem(platform), platform.suffix, made.read_bytes())
