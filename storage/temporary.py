"""One temporary folder a process, gone when the process is: however it ends."""

from __future__ import annotations

import atexit
import os
import shutil
import tempfile
from pathlib import Path

from railcosim.storage.lock import take, take_left

_PREFIX = "railcosim_"
_LOCK = "lock"
_made: dict[tuple[int, str], Path] = {}


def scratch() -> Path:
    """Folder for all temporary files of this process: ``TemporaryDirectory(dir=scratch())``.

    It is removed at the process's end. A process that is killed cannot; so the first call in a
    process removes what dead ones have left: folders of ours, of this user, that nobody holds.
    """
    parent = tempfile.gettempdir()
    key = os.getpid(), parent  # a fork is another process
    if key not in _made or not _made[key].is_dir():
        _sweep(Path(parent))
        _made[key] = _new(Path(parent))
    return _made[key]


def _new(parent: Path) -> Path:
    """A folder that is held from the beginning."""
    while True:
        folder = Path(tempfile.mkdtemp(prefix=_PREFIX, dir=parent))
        try:
            descriptor = take(folder / _LOCK)
        except FileNotFoundError:
            descriptor = None
        if descriptor is not None:
            atexit.register(_remove, folder, descriptor, os.getpid())
            return folder
        # Another process took it for a dead one's before it was held.


def _remove(folder: Path, descriptor: int, owner: int) -> None:
    if os.getpid() == owner:
        os.close(descriptor)
        shutil.rmtree(folder, ignore_errors=True)


def _sweep(parent: Path) -> None:
    """Remove the folders of dead processes. A folder without a lock is not known to be one."""
    for folder in parent.glob(f"{_PREFIX}*"):
        try:
            if folder.is_symlink() or not _is_ours(folder):
                continue
            descriptor = take_left(folder / _LOCK)
        except OSError:
            continue
        if descriptor is not None:
            shutil.rmtree(folder, ignore_errors=True)
            os.close(descriptor)


def _is_ours(folder: Path) -> bool:
    return not hasattr(os, "getuid") or folder.stat().st_uid == os.getuid()
