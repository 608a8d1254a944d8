"""How much memory can be had, and whether it is enough: said before it is taken."""

from __future__ import annotations

import math
import os
from pathlib import Path

_LIMITS = {  # of a container: what it may have, and what it has
    "/sys/fs/cgroup/memory.max": "/sys/fs/cgroup/memory.current",
    "/sys/fs/cgroup/memory/memory.limit_in_bytes": "/sys/fs/cgroup/memory/memory.usage_in_bytes",
}


class TooLargeError(ValueError):
    """What is asked for needs more memory, or more steps, than can be had."""


def afford(size: float, what: str, instead: str) -> None:
    """Refuse what does not fit into memory.

    Parameters
    ----------
    size : float
        Bytes needed at once.
    what, instead : str
        For the message: what needs them, with its numbers, and what to do.

    Raises
    ------
    TooLargeError
        With how much is needed and can be had.
    """
    free = available()
    if size > free:
        raise TooLargeError(
            f"{what} need {size / 1e9:.3g} GB of memory, and {free / 1e9:.3g} GB can be had: "
            f"{instead}"
        )


def available() -> float:
    """Bytes that this process can still have, infinite where the system does not say.

    The least of what the machine has free and what the container allows. Where neither can be read
    it is all of the machine's memory; Windows does not promise what it has not, so that there a
    refused allocation is found in time.
    """
    found = [_free(), *(_number(most) - _number(used) for most, used in _LIMITS.items())]
    return min((size for size in found if math.isfinite(size)), default=math.inf)


def _free() -> float:
    """Free memory of the machine, bytes; what caches hold is as good as free."""
    try:
        for line in Path("/proc/meminfo").read_text(encoding="ascii").splitlines():
            if line.startswith("MemAvailable:"):
                return 1024.0 * float(line.split()[1])
    except OSError:
        pass
    try:
        return float(os.sysconf("SC_PHYS_PAGES")) * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):
        return math.inf


def _number(file: str) -> float:
    """The number in a file, infinite if there is none."""
    try:
        return float(Path(file).read_text(encoding="ascii"))
    except (OSError, ValueError):  # not there, or the word max
        return math.inf
