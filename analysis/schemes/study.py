"""A grid of schemes, owners, contacts and steps: what is finished is kept, and never run again."""

from __future__ import annotations

import hashlib
import itertools
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from importlib.metadata import version
from pathlib import Path
from typing import Any

from railcosim.analysis.pair.owner import Owner
from railcosim.storage.whole import write_whole

from .catalogue import Member
from .study_point import INTERNAL_STEP, Contact, Measurement, Point, Ride

SETTINGS = "study.json"


class StudyError(ValueError):
    """The folder cannot take this study; the message says why."""


@dataclass(frozen=True, kw_only=True)
class Grid:
    """All combinations of these, but for owners that a scheme does not allow.

    Attributes
    ----------
    schemes : mapping of str to Member
        From the catalogue.
    owners : sequence of Owner
        Of the contact.
    contacts : sequence of Contact
        Contact laws.
    steps : sequence of float
        Communication steps, s.
    """

    schemes: Mapping[str, Member]
    owners: Sequence[Owner]
    contacts: Sequence[Contact]
    steps: Sequence[float]

    def points(self) -> list[Point]:
        """The runs, the longest steps first, so that something is seen early."""
        return [
            Point(name=name, scheme=member.scheme, owner=owner, contact=contact, step=step)
            for step in sorted(self.steps, reverse=True)
            for contact, (name, member), owner in itertools.product(
                self.contacts, self.schemes.items(), self.owners
            )
            if owner in member.owners
        ]


class Folder:
    """Where a study keeps what is finished: one small file a point, written whole or not at all.

    Parameters
    ----------
    path : Path
        Made if it is not there.
    settings : mapping
        From `settings_of`: what all points have in common.

    Raises
    ------
    StudyError
        If the folder holds points of other settings.
    """

    def __init__(self, path: Path, settings: Mapping[str, Any]) -> None:
        self.path, self._settings = path, dict(settings)
        (path / "points").mkdir(parents=True, exist_ok=True)
        there = _read(path / SETTINGS)
        if there is None:
            _write(path / SETTINGS, self._settings)
        elif there != self._settings:
            key = next(k for k in {**there, **settings} if there.get(k) != settings.get(k))
            raise StudyError(
                f"{path}: holds points of another study: {key} was {there.get(key)}, now it is "
                f"{settings.get(key)}; take another folder, or delete this one"
            )

    def find(self, point: Point) -> Measurement | None:
        """Give what is known of a point, or None."""
        there = _read(self._file(point))
        if there is None or set(there) != {"point", *(f.name for f in fields(Measurement))}:
            return None
        del there["point"]
        return Measurement(**there)

    def keep(self, point: Point, found: Measurement) -> None:
        """Write down a finished point."""
        _write(self._file(point), {"point": str(point), **asdict(found)})

    def _file(self, point: Point) -> Path:
        what = [
            self._settings, point.name, point.scheme.describe(), point.owner,
            dict(point.contact.parameters), point.step,
        ]  # fmt: skip
        digest = hashlib.sha256(json.dumps(what, sort_keys=True).encode()).hexdigest()
        return self.path / "points" / f"{digest[:24]}.json"


def settings_of(ride: Ride, fmus: Mapping[str, Path]) -> dict[str, Any]:
    """What all points of a study have in common, for people and for telling studies apart."""
    return {
        "railcosim": version("railcosim"),
        "time": ride.stop,
        "speed": ride.speed,
        "internal_step": INTERNAL_STEP,
        "irregularity": f"{ride.profile.name}, sha256 {ride.profile.digest[:16]}",
        **{f"{name}.fmu": f"sha256 {_digest(path.read_bytes())}" for name, path in fmus.items()},
    }


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()[:16]


def _read(path: Path) -> dict[str, Any] | None:
    """Read a file of ours; what is not there, or is none, is not finished."""
    try:
        there = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return there if isinstance(there, dict) else None


def _write(path: Path, content: Mapping[str, Any]) -> None:
    write_whole(path, json.dumps(content, indent=1))
