"""A grid of schemes, owners, contacts and steps: what is finished is kept, and never run again."""

from __future__ import annotations

import fnmatch
import hashlib
import itertools
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from importlib.metadata import version
from pathlib import Path
from typing import Any

from railcosim.analysis.pair.contact import contact_of
from railcosim.analysis.pair.owner import Owner
from railcosim.analysis.pair.pair import Journey
from railcosim.master.course import count_steps
from railcosim.master.memory import afford
from railcosim.master.suggest import suggest
from railcosim.parameters import ArgumentError
from railcosim.storage.whole import write_whole

from .catalogue import Member, members
from .study_point import INTERNAL_STEP, ContactCase, Measurement, Point

SETTINGS = "study.json"
EVERY = ("*",)
STEPS = (2e-4, 1e-4, 5e-5)  # s
BYTES = 500  # that a step of a run takes: its forces, its report, and what holds them


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
    contacts : sequence of ContactCase
        Contact laws.
    steps : sequence of float
        Communication steps, s.
    """

    schemes: Mapping[str, Member]
    owners: Sequence[Owner]
    contacts: Sequence[ContactCase]
    steps: Sequence[float]

    @classmethod
    def of(
        cls,
        schemes: Sequence[str] = EVERY,
        owners: Sequence[Owner | str] = tuple(Owner),
        contacts: Sequence[float | ContactCase] = (1e9,),
        steps: Sequence[float] = STEPS,
    ) -> Grid:
        """Choose by names.

        Parameters
        ----------
        schemes : sequence of str
            Names of the catalogue, or patterns such as ``jacobi-*``.
        owners : sequence of Owner or str
            Of the contact.
        contacts : sequence of float or ContactCase
            Stiffnesses, N/m, or laws.
        steps : sequence of float
            s.

        Raises
        ------
        ArgumentError
            If there is no such scheme or owner, or none of the schemes allows an owner.
        """
        for name in owners:
            if name not in list(Owner):
                must = f"must be {', '.join(Owner)}{suggest(name, Owner)}"
                raise ArgumentError("owners", name, must)
        grid = cls(
            schemes=matching(schemes, members()),
            owners=[Owner(name) for name in owners],
            contacts=[
                contact if isinstance(contact, ContactCase)
                else ContactCase(label=f"{contact:g}", parameters=contact_of(contact))
                for contact in contacts
            ],
            steps=steps,
        )  # fmt: skip
        if not grid.points():
            raise ArgumentError("owners", ",".join(owners), "none of the schemes allows it")
        return grid

    def check(self, time: float) -> None:
        """Raise TooLargeError if a step does not suit runs of some length (s), or memory."""
        for step in self.steps:
            steps = count_steps(0.0, time, step)
            afford(
                BYTES * steps, f"step {step:g} s: {steps} steps", "take longer steps, or less time"
            )

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


def matching(patterns: Sequence[str], known: Mapping[str, Member]) -> dict[str, Member]:
    """Schemes by names and patterns, in the order of the catalogue."""
    chosen: set[str] = set()
    for pattern in patterns:
        fitting = fnmatch.filter(known, pattern)
        if not fitting:
            raise ArgumentError(
                "schemes", pattern,
                f"no such scheme{suggest(pattern, known)}; there are {', '.join(known)}",
            )  # fmt: skip
        chosen.update(fitting)
    return {name: member for name, member in known.items() if name in chosen}


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


def settings_of(journey: Journey, stop: float, fmus: Mapping[str, Path]) -> dict[str, Any]:
    """What all points of a study have in common, for people and for telling studies apart."""
    where: dict[str, Any] = {} if journey.position is None else {"position": journey.position}
    if journey.defects:
        where["defects"] = " ".join(map(str, journey.defects))
    return {
        "railcosim": version("railcosim"),
        "time": stop,
        "speed": journey.speed,
        **where,
        "internal_step": INTERNAL_STEP,
        "irregularity": f"{journey.profile.name}, sha256 {journey.profile.digest[:16]}",
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
