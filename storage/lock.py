"""A file for one process at a time. The lock goes with the process, however that ends."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

if sys.platform == "win32":
    import msvcrt

    def _lock(descriptor: int) -> None:
        msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
else:
    import fcntl

    def _lock(descriptor: int) -> None:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)


_NO_LINKS = getattr(os, "O_NOFOLLOW", 0)


class HeldError(OSError):
    """Another run holds a file; the message names it."""


@contextmanager
def held(target: Path) -> Iterator[None]:
    """Hold a file by a lock beside it, ``.NAME.lock``, as long as the block lasts.

    Where the file system has no locks, nothing is held.

    Raises
    ------
    HeldError
        At once, if another block or process holds it.
    OSError
        If there can be no file beside it.
    """
    target = target.resolve()
    beside = target.with_name(f".{target.name}.lock")
    descriptor = take(beside)
    if descriptor is None:
        raise HeldError(f"{target}: another run is writing it; take another name, or wait")
    try:
        yield
    finally:
        with suppress(OSError):  # on Windows not while it is open: then it stays, unlocked
            beside.unlink()
        os.close(descriptor)


def take(path: Path) -> int | None:
    """Lock a file, made if it is not there; None if another holds it.

    Where the file system has no locks, nothing is held.

    Returns
    -------
    int
        A descriptor: closing it frees the lock.
    """
    return _take(path, os.O_CREAT, without_locks=True)


def take_left(path: Path) -> int | None:
    """Lock a file that is there; None if another holds it, or nobody can know.

    Raises
    ------
    FileNotFoundError
    """
    return _take(path, 0, without_locks=False)


def _take(path: Path, flags: int, *, without_locks: bool) -> int | None:
    while True:
        descriptor = os.open(path, os.O_RDWR | _NO_LINKS | flags, 0o644)
        try:
            _lock(descriptor)
        except OSError as error:
            is_held = isinstance(error, (BlockingIOError, PermissionError))
            if without_locks and not is_held:  # no locks here
                return descriptor
            os.close(descriptor)
            return None
        with suppress(FileNotFoundError):
            if os.path.samestat(os.fstat(descriptor), path.stat()):
                return descriptor
        os.close(descriptor)  # it was thrown away before it was ours
