"""Files that are there whole or not at all: the one way in which railcosim writes them."""

from __future__ import annotations

import os
import secrets
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

_KINDS = {
    stat.S_IFDIR: "a folder",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
    stat.S_IFIFO: "a pipe",
    stat.S_IFSOCK: "a socket",
}
_TRIAL = bytes(4096)
"""What `check_target` writes: a block of most file systems."""


class TargetError(OSError):
    """A file cannot be written, or is none; the message names it and says why."""


@contextmanager
def written_whole(target: Path) -> Iterator[Path]:
    """A new file beside `target`, which takes its place at the end; on any error nothing changes.

    What was written is on the disk before the name changes, and so is the name afterwards.

    Parameters
    ----------
    target : Path
        A file, replaced if it is there; through a link, what it points to.

    Yields
    ------
    Path
        Where to write; of the same suffix.

    Raises
    ------
    TargetError
        If `target` is there and no regular file. (Root could replace a device.)
    OSError
        If it cannot be written.
    """
    target = target.resolve()
    check_regular(target)
    partial = _beside(target)
    try:
        yield partial
        with partial.open("r+b") as file:
            os.fsync(file.fileno())
        partial.replace(target)
    finally:
        partial.unlink(missing_ok=True)
    _name_to_disk(target.parent)


def write_whole(target: Path, data: bytes | str) -> None:
    """Write all of a file by `written_whole`; text as UTF-8, its line ends as they are."""
    with written_whole(target) as partial:
        partial.write_bytes(data.encode() if isinstance(data, str) else data)


def check_regular(path: Path) -> None:
    """Raise TargetError for what is there and no regular file: endless, or not to be replaced."""
    try:
        mode = path.stat().st_mode
    except FileNotFoundError:
        return
    if not stat.S_ISREG(mode):
        raise TargetError(f"{path}: is {_KINDS.get(stat.S_IFMT(mode), 'no regular file')}")


def check_target(target: Path) -> None:
    """See, before anything is computed, that a file can be written: by writing a bit beside it.

    Raises
    ------
    TargetError
        If not.
    """
    try:
        folder = target.resolve().parent
        if not folder.is_dir():
            raise TargetError(f"{target}: there is no folder {target.parent}")
        check_regular(target)
        if target.exists() and not os.access(target, os.W_OK):
            raise TargetError(f"{target}: is write-protected")
        _try(_beside(target.resolve()))
    except TargetError:
        raise
    except (OSError, RuntimeError) as error:  # RuntimeError: links in a circle
        raise TargetError(f"{target}: cannot be written ({why(error)})") from error


def check_folder(folder: Path) -> None:
    """Make a folder, with those above it, and see that files can be written in it.

    Raises
    ------
    TargetError
        If not.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        _try(_beside(folder / "trial"))
    except (OSError, RuntimeError) as error:
        raise TargetError(f"{folder}: cannot be written to ({why(error)})") from error


def why(error: Exception) -> str:
    """What the system says of an error, without number and file."""
    return getattr(error, "strerror", None) or str(error)


def _try(trial: Path) -> None:
    """Write a new file, and remove it."""
    try:
        with trial.open("xb") as file:
            file.write(_TRIAL)
            file.flush()
            os.fsync(file.fileno())
    finally:
        trial.unlink(missing_ok=True)


def _beside(target: Path) -> Path:
    """A name of its own: only within one file system a replacement is atomic."""
    mark = f"{os.getpid()}-{secrets.token_hex(4)}"
    return target.with_name(f".{target.stem[:40]}.{mark}.partial{target.suffix[:40]}")


def _name_to_disk(folder: Path) -> None:
    """See that a new name is on the disk, where folders can be opened for that (not on Windows)."""
    if not hasattr(os, "O_DIRECTORY"):
        return
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
