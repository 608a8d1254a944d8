"""Libraries kept in a folder, each under a name that says what went into it and what came out."""

from __future__ import annotations

import hashlib
import os
import stat
from pathlib import Path

from railcosim.storage.whole import write_whole

DIGITS = 32  # of a SHA-256, in file names


class CacheRefused(RuntimeError):  # noqa: N818 (it says what happened)
    """The user's cache cannot be used, or others may write in it."""


def digest(content: bytes) -> str:
    """Of a library, or of what it is made of; as in file names."""
    return hashlib.sha256(content).hexdigest()[:DIGITS]


def keep(folder: Path, stem: str, suffix: str, library: bytes) -> Path:
    """Write a library, whole and on the disk, whoever else does so at the same time."""
    place = folder / f"{stem}-{digest(library)}{suffix}"
    write_whole(place, library)
    return place


def find(folder: Path, stem: str, suffix: str) -> Path | None:
    """The library kept under `stem` whose content is what was kept; none if it is damaged."""
    for place in sorted(folder.glob(f"{stem}-*{suffix}")):
        if place.is_file() and place.name == f"{stem}-{digest(place.read_bytes())}{suffix}":
            return place
    return None


def cache() -> Path:
    """The user's folder for compiled libraries: `$XDG_CACHE_HOME/railcosim`, or in `~/.cache`.

    Whoever can write there can have code run: it is the user's alone, or not used.

    Raises
    ------
    CacheRefused
        If there can be no such folder, it is another user's, or others may write in it.
    """
    try:
        home = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    except RuntimeError:
        raise CacheRefused(
            "there is no home folder to keep the compiled runtime in; set XDG_CACHE_HOME to a "
            "folder that can be written"
        ) from None
    folder = home / "railcosim"
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    if hasattr(os, "getuid"):  # on Windows a profile is its user's
        _claim(folder, os.getuid())
    return folder


def _claim(folder: Path, user: int) -> None:
    found = folder.stat()
    others = found.st_mode & (stat.S_IWGRP | stat.S_IWOTH)
    if found.st_uid != user or others:
        whose = "others may write in it" if others else f"it belongs to user {found.st_uid}"
        raise CacheRefused(
            f"{folder}: {whose}, so what is in it may be anyone's code; remove it, or set "
            "XDG_CACHE_HOME to a folder of your own"
        )
    if stat.S_IMODE(found.st_mode) != 0o700:
        folder.chmod(0o700)
