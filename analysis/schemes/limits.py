"""Largest stable steps of many schemes, owners and stiffnesses, predicted on all cores."""

from __future__ import annotations

import math
import pickle
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import TypeAlias

import numpy as np
import xarray as xr

from railcosim.analysis.pair.contact import Parameters, Stiffness
from railcosim.analysis.pair.linear_contact import LinearLaw
from railcosim.analysis.pair.linear_pair import Part, linear_parts
from railcosim.analysis.pair.numbering import files_of
from railcosim.analysis.pair.owner import Owner
from railcosim.analysis.pair.standing import Position
from railcosim.analysis.pair.static_load import SPEED, static_stiffness
from railcosim.master.parallel import CORES, Task, Workers
from railcosim.master.progress import Progress, Tell, foretold, unheard, unsaid
from railcosim.master.schemes import Scheme
from railcosim.parameters import ArgumentError

from .catalogue import Member, members
from .stability import Coupling, Limit, SprungPair, Window
from .usual import PREDICTED

Found: TypeAlias = dict[tuple[str, Owner], list[Limit]]
NOWHERE = Window(begin=math.nan, end=math.nan, fast=math.nan, growth=math.nan)
LINEARISING = 0.2  # of the time that all takes


@dataclass(frozen=True)
class StabilityTable:
    """What was predicted.

    Attributes
    ----------
    limits : dict
        By scheme and owner, one for each contact.
    stiffness : list of float
        Of the contacts, at the static load, N/m; the largest where wheelsets differ.
    growth : list of float
        Rates (1/s) at which something grows at each contact where vehicle and track are coupled
        exactly; negative or zero if both are passive and no wheel hunts.
    """

    limits: Found
    stiffness: list[float]
    growth: list[float]
    refused: dict[str, str] = field(default_factory=dict)

    def to_dataset(self) -> xr.Dataset:
        """Steps and windows of each scheme and owner over the stiffness."""
        return _dataset(self.limits, self.stiffness)


def stability(
    vehicle: str | Path | Sequence[str | Path],
    track: str | Path,
    contacts: Sequence[float | Parameters] = (0.1e9, 1e9, 8e9),
    schemes: Sequence[str] = PREDICTED,
    progress: Progress = unheard,
    *,
    position: Position = None,
    speed: float = SPEED,
    tell: Tell = unsaid,
) -> StabilityTable:
    """Predict the largest stable step of every scheme, owner of the contact and contact.

    Parameters
    ----------
    vehicle, track : str or Path
        FMUs that take contact forces; of vehicles also several, from the front.
    contacts : sequence of float or mapping
        Stiffness k_H, N/m, or parameters of the contact, such as ``{"contact.nonlinear": True}``
        for Hertz's law, which is linearised at the static load.
    schemes : sequence of str
        Names of the catalogue, or how they begin.
    progress : callable
        Told what is done and the total.
    position : float or sequence of float, optional
        Where the last wheelset (of each vehicle) stands, m; where it starts if not given.
    speed : float, optional
        At which wheels roll that move aside, too, m/s: then `contacts` are stiffnesses at the
        static load.
    tell : callable, optional
        Told how much there is to be done, and, by what the first of it takes, for how long.

    Raises
    ------
    ArgumentError
        If a scheme cannot be predicted, or none suits the contacts.
    """
    names = predictable(schemes)
    tell(f"{counted(names, len(contacts))} of largest stable steps")
    pair = files_of(vehicle), Path(track)
    k_H = [static_stiffness(*pair, contact, position, speed) for contact in contacts]
    parts = linear_parts(*pair, lambda a, b: progress(LINEARISING * a / b, 1.0), position)
    found, refused = _all_limits(
        parts, k_H, names,
        foretold(
            lambda a, b: progress(LINEARISING + (1 - LINEARISING) * a / b, 1.0), tell, CORES - 1
        ),
    )  # fmt: skip
    if not found:
        raise ArgumentError("schemes", ",".join(schemes), next(iter(refused.values())))
    stiffness = [largest(k) for k in k_H]
    return StabilityTable(found, stiffness, [exact_growth(parts, k) for k in k_H], refused)


def predictable(words: Sequence[str], known: Mapping[str, Member] | None = None) -> list[str]:
    """Names of the schemes that can be predicted and begin with one of several words."""
    known = members() if known is None else known
    names = [name for name, member in known.items() if member.linear]
    learning = [name for name, member in known.items() if not member.linear]
    chosen = dict[str, None]()
    text = ",".join(words)
    for word in words:
        matching = [name for name in names if name.startswith(word)] if word else []
        if not matching and word and any(name.startswith(word) for name in learning):
            raise ArgumentError(
                "schemes",
                text,
                f"{word} cannot be predicted, as it learns within a step; railcosim study runs it",
            )
        if not matching:
            raise ArgumentError(
                "schemes",
                text,
                f"no scheme begins with {word!r}; there are {', '.join(names)}",
            )
        chosen |= dict.fromkeys(matching)
    return list(chosen)


def counted(names: Sequence[str], contacts: int) -> str:
    """How many searches there are, of which schemes and owners that suit."""
    catalogue = members()
    pairs = sum(owner in catalogue[name].owners for name in names for owner in Owner)
    each = f"{pairs} schemes and owners" + (f" at {contacts} contacts" if contacts > 1 else "")
    return f"{pairs * contacts} searches on {CORES} cores ({each})"


def largest(contact: Stiffness) -> float:
    """The largest normal stiffness of contacts, N/m; see `static_stiffness`."""
    return float(np.max(np.asarray(contact)[..., 0, 0] if np.ndim(contact) == 3 else contact))


def exact_growth(parts: Sequence[Part], k_H: Stiffness) -> float:
    """Rate (1/s) at which something grows if vehicle and track are coupled exactly."""
    return max(LinearLaw(part, k_H).growth() for part in parts)


def _all_limits(
    parts: tuple[Part, ...],
    k_H: list[Stiffness],
    names: list[str],
    update: Progress,
) -> tuple[Found, dict[str, str]]:
    """By scheme and owner, one for each stiffness, and what is refused; on all cores."""
    catalogue = members()
    tasks = []
    for owner in Owner:
        suiting = {n: catalogue[n].scheme for n in names if owner in catalogue[n].owners}
        for i, k in enumerate(k_H):
            side = pickle.dumps((parts, owner, k))
            tasks += [
                Task(name=f"{owner.value} {i} {n}", function=_limit, arguments=(side, s), cost=1.0)
                for n, s in suiting.items()
            ]
    results: dict[tuple[str, str, str], Limit] = {}
    refused: dict[str, str] = {}
    with Workers(update, len(tasks)) as workers:
        for task, limit in workers.completed(tasks, float(len(tasks))):
            owner_name, i_k, name = task.split()
            if isinstance(limit, Limit):
                results[owner_name, i_k, name] = limit
            else:
                refused[name] = limit
    return {
        (name, owner): [results[owner.value, str(i), name] for i in range(len(k_H))]
        for name in names
        for owner in Owner
        if owner in catalogue[name].owners and name not in refused
    }, refused


@lru_cache(maxsize=1)
def _ready(side: bytes) -> SprungPair:
    """A pair with its contacts on one side: made once for all schemes that follow each other."""
    return SprungPair(*pickle.loads(side))


def _limit(side: bytes, scheme: Scheme, progress: Progress) -> Limit | str:
    """The largest stable step of a scheme, or why there is none.

    `side` is a pickle of what `SprungPair` takes, by which it is known again.
    """
    try:
        coupling = Coupling(_ready(side), scheme)
    except ValueError as error:  # it does not suit the contacts
        return str(error)
    return coupling.limit(progress=progress)


def _dataset(found: Found, k_H: list[float]) -> xr.Dataset:
    """Variables for each scheme and owner over the stiffness; windows it has not are NaN."""
    order = np.argsort(k_H)
    columns = {}
    for (name, owner), row in found.items():
        stem, who = f"{name}.{owner.value}", f"{name}, contact in {owner.value}"
        limits = [row[i] for i in order]
        columns[stem] = [limit.step for limit in limits], "s", f"largest stable step of {who}"
        for w in range(max(len(limit.windows) for limit in limits)):
            some = [limit.windows[w] if w < len(limit.windows) else NOWHERE for limit in limits]
            text = f"of window {w + 1}, in which something grows, of {who}"
            columns |= {
                f"{stem}.window[{w + 1}].begin": ([s.begin for s in some], "s", f"begin {text}"),
                f"{stem}.window[{w + 1}].end": ([s.end for s in some], "s", f"end {text}"),
                f"{stem}.window[{w + 1}].growth": ([s.growth for s in some], "1/s", f"rate {text}"),
            }
    variables = {
        name: ("k_H", np.array(values, dtype=float), {"units": unit, "long_name": text})
        for name, (values, unit, text) in columns.items()
    }
    axis = ("k_H", np.array(k_H)[order], {"units": "N/m", "long_name": "contact stiffness"})
    return xr.Dataset(variables, coords={"k_H": axis}, attrs={"title": "largest stable step"})
