"""Our FMUs, made once: kept in the user's cache by what they are made from."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import sys
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from functools import cache as once
from importlib.metadata import version
from pathlib import Path
from tempfile import TemporaryDirectory, mkdtemp
from time import time
from typing import Any

from railcosim.compiling.kept import CacheRefused, cache, digest
from railcosim.parameters import UnusualWarning
from railcosim.storage.archive import digest_of
from railcosim.storage.temporary import scratch
from railcosim.track.closed_line import ClosedLine
from railcosim.track.decay import RingWarning
from railcosim.track.local import LocalChange
from railcosim.track.parameters import Track
from railcosim.vehicle.parameters import Vehicle
from railcosim.vehicle.rolling import profile_files
from railcosim.vehicle.train import Train

NO_MAKERS = {"analysis", "cli", "master", "paper", "plots", "reference"}
"""Our packages whose content does not decide what an FMU is."""
LIBRARIES = ("numpy", "scipy")
MOST = 8
"""Pairs that are kept: those used last; some 6 MB each."""
BEGUN, ABANDONED = ".making-", 86400.0
"""How the folder of one that is being made is called, and its age (s) if nobody does so."""


SAID = "said.json"
NOTES = {kind.__name__: kind for kind in (RingWarning, UnusualWarning)}
"""Kinds of warnings given where FMUs are made, which hold each time they are used."""


@dataclass(frozen=True)
class Made:
    """The four FMUs of a pair.

    Attributes
    ----------
    files : dict
        FMU name to file.
    kept : Path or None
        The folder they are kept in; None if they are gone when the block ends.
    found : bool
        Whether they had been made before.
    """

    files: dict[str, Path]
    kept: Path | None
    found: bool


_keeping = [True]


@contextmanager
def none_kept() -> Iterator[None]:
    """Where many different pairs are used, each once: in the block none is kept."""
    _keeping[0] = False
    try:
        yield
    finally:
        _keeping[0] = True


@contextmanager
def fmus_of_pair(
    vehicle: Vehicle | Train,
    track: Track,
    progress: Callable[[str], None] = lambda text: None,
    *,
    dimension: str = "vertical",
    fresh: bool = False,
    changes: Sequence[LocalChange] = (),
    line: ClosedLine | None = None,
) -> Iterator[Made]:
    """Our FMUs for as long as the block lasts: kept ones, or made now and kept.

    Where the user's cache cannot be used, they are in a temporary folder.

    Parameters
    ----------
    vehicle, track : Vehicle or Train, Track
        Parameters.
    progress : callable
        Told what is being done.
    dimension : str
        ``vertical``, or ``spatial``: of these there are only those that take contact forces.
    fresh : bool
        Make them anew.
    changes : sequence of LocalChange
        What is different at single places of the track.
    line : ClosedLine or None
        Kinds of track that follow, the first of which is `track`.

    Warns
    -----
    RingWarning, UnusualWarning
        As whoever makes them; of kept ones what was said when they were made.
    """
    try:
        if not _keeping[0]:
            raise CacheRefused("none is kept")
        folder = cache() / "fmus"
        folder.mkdir(mode=0o700, exist_ok=True)
        key = key_of(vehicle, track, dimension, changes, line)
        place = None if fresh else find(folder, key)
        made = place is None
        place = place or _make(vehicle, track, dimension, changes, line, folder, key, progress)
        said = [] if made else json.loads((place / SAID).read_text(encoding="utf-8"))
    except (CacheRefused, OSError):
        with TemporaryDirectory(dir=scratch()) as temporary:
            files = _export(vehicle, track, dimension, changes, line, Path(temporary), progress)
            yield Made(files, None, found=False)
        return
    for kind, text in said:
        warnings.warn(text, NOTES[kind], stacklevel=3)
    os.utime(place)
    _forget(folder)
    yield Made({path.stem: path for path in sorted(place.glob("*.fmu"))}, place, found=not made)


def key_of(
    vehicle: Vehicle | Train,
    track: Track,
    dimension: str = "vertical",
    changes: Sequence[LocalChange] = (),
    line: ClosedLine | None = None,
) -> str:
    """What the FMUs are made from: parameters, our code, the libraries and the compiler wanted."""
    parts = {
        "vehicle": asdict(vehicle),
        "track": asdict(track),
        "profiles": [digest_of(file) for file in profile_files(vehicle)],
        "dimension": dimension,
        "changes": [repr(change) for change in changes],
        "line": repr(line),
        "code": _code(),
        "libraries": [version(name) for name in LIBRARIES],
        "compiler": os.environ.get("CC", ""),
    }
    return digest(json.dumps(parts, sort_keys=True, default=_plain).encode())


def find(folder: Path, key: str) -> Path | None:
    """The folder kept under `key` whose content is what was kept; none if it is damaged."""
    for place in sorted(folder.glob(f"{key}-*")):
        if place.name == f"{key}-{_content(place)}" and (place / SAID).exists():
            return place
    return None


def _make(
    vehicle: Vehicle | Train,
    track: Track,
    dimension: str,
    changes: Sequence[LocalChange],
    line: ClosedLine | None,
    folder: Path,
    key: str,
    progress: Callable[[str], None],
) -> Path:
    """Make them in a folder of their own, which then gets its name: whole or not at all."""
    work = Path(mkdtemp(prefix=BEGUN, dir=folder))
    try:
        with _heard() as said:
            _export(vehicle, track, dimension, changes, line, work, progress)
        (work / SAID).write_text(json.dumps(said), encoding="utf-8")
        place = folder / f"{key}-{_content(work)}"
        if find(folder, key) != place:  # the same are as good, and may be in use
            shutil.rmtree(place, ignore_errors=True)
            work.rename(place)
        return place
    finally:
        shutil.rmtree(work, ignore_errors=True)


def _export(
    vehicle: Vehicle | Train,
    track: Track,
    dimension: str,
    changes: Sequence[LocalChange],
    line: ClosedLine | None,
    out: Path,
    progress: Callable[[str], None],
) -> dict[str, Path]:
    # Here, since they load what draws icons and documentation.
    from railcosim.fmus.export import BARE  # noqa: PLC0415

    from .export_pair import export_pair  # noqa: PLC0415

    return export_pair(
        vehicle, track, out, progress, runtime=BARE, dimension=dimension, changes=changes, line=line
    )


@contextmanager
def _heard() -> Iterator[list[tuple[str, str]]]:
    """Collect kind and text of the `NOTES` that are given in a block; they are given at its end."""
    said: list[tuple[str, str]] = []
    caught: list[warnings.WarningMessage] = []
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            yield said
    finally:
        for one in caught:
            if one.category in NOTES.values():
                said.append((one.category.__name__, str(one.message)))
            warnings.warn_explicit(one.message, one.category, one.filename, one.lineno)


def _content(place: Path) -> str:
    """Digest of what is in a folder."""
    files = sorted(path for path in place.glob("*") if path.is_file())
    return digest("".join(f"{path.name} {digest_of(path)}\n" for path in files).encode())


@once
def _code() -> str:
    """Digest of the code that makes FMUs: a version alone says nothing of a checkout."""
    found = hashlib.sha256()
    roots = sys.modules["railcosim"].__path__
    packages = sorted(path for root in roots for path in Path(root).iterdir())
    for package in packages:
        if package.name in NO_MAKERS:
            continue
        for path in sorted(package.rglob("*")):
            if path.is_file() and "__pycache__" not in path.parts:
                place = Path(package.name, path.relative_to(package))
                found.update(f"{place} ".encode() + path.read_bytes())
    return found.hexdigest()


def _forget(folder: Path) -> None:
    """Remove the pairs that have not been used for longest, and what a killed process has left."""
    used = {place: place.stat().st_mtime for place in folder.iterdir()}
    old = [p for p, t in used.items() if p.name.startswith(BEGUN) and t < time() - ABANDONED]
    kept = sorted(used.keys() - {p for p in used if p.name.startswith(BEGUN)}, key=used.__getitem__)
    for place in (*old, *kept[:-MOST]):
        shutil.rmtree(place, ignore_errors=True)


def _plain(value: Any) -> Any:
    """Arrays for JSON."""
    return value.tolist()
