"""Owner, scheme and step that reach an accuracy at the least cost, predicted on all cores."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from railcosim.analysis.pair.contact import NONLINEAR, Parameters, Stiffness
from railcosim.analysis.pair.linear_pair import Part, linear_parts
from railcosim.analysis.pair.numbering import files_of
from railcosim.analysis.pair.owner import Owner
from railcosim.analysis.pair.standing import Position
from railcosim.analysis.pair.static_load import acting_on, static_stiffness
from railcosim.analysis.response.models import wheelset_positions
from railcosim.master.component import FloatArray
from railcosim.master.parallel import CORES, Task, Workers
from railcosim.master.progress import Progress, Tell, foretold, unheard, unsaid
from railcosim.master.schemes import Scheme
from railcosim.parameters import ArgumentError
from railcosim.track.irregularity import Spectrum
from railcosim.track.irregularity.synthesis import spectra_of

from .catalogue import members
from .force_error import Excitation, ForceError, excitation
from .limits import LINEARISING, counted, exact_growth, largest, predictable
from .stability import Coupling, SprungPair
from .usual import PREDICTED

FINEST = 1e-12  # accuracy: below it is rounding
TOGETHER = 4
"""Schemes of one task."""
HERTZ: Parameters = {NONLINEAR: True}
STEPS = np.sort(np.outer(10.0 ** np.arange(-5, -2), [1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0,
                                                      8.0]).ravel())  # fmt: skip
"""Steps that are tried, s: round numbers up to 8 ms."""
MARGIN, REACH = 1.1, 2.0
"""Parts of the step advised up to which nothing may grow, and up to which that is looked for."""


@dataclass(frozen=True, kw_only=True)
class Option:
    """One way to couple that reaches the accuracy.

    Attributes
    ----------
    scheme : str
        Name in the catalogue.
    owner : Owner
        Of the contact springs.
    step : float
        The longest of the steps tried that does, `MARGIN` below the first unstable one, s.
    limit : float
        Largest stable step, s; infinite if nothing grows up to `REACH` times the step.
    evaluations : int
        How often each component is stepped in a step.
    error : float
        Predicted RMS of the error of the contact forces, relative to that of their dynamic part.
    errors : array, shape (len(STEPS),)
        The same over all steps tried; NaN for the others.
    """

    scheme: str
    owner: Owner
    step: float
    limit: float
    evaluations: int
    error: float
    errors: FloatArray

    @property
    def cost(self) -> float:
        """Evaluations of each component a second of time simulated."""
        return self.evaluations / self.step


@dataclass(frozen=True)
class Advice:
    """What reaches an accuracy.

    Attributes
    ----------
    options : list of Option
        Cheapest first; at least one.
    accuracy, stiffness, speed : float
        What was asked for; N/m (the largest where wheelsets differ), m/s.
    growth : float
        See `StabilityTable`.
    """

    options: list[Option]
    accuracy: float
    stiffness: float
    speed: float
    growth: float

    def to_dataset(self) -> xr.Dataset:
        """Columns over the options, cheapest first."""
        return _dataset(self.options, self.accuracy, self.stiffness, self.speed)


def advise(
    vehicle: str | Path | Sequence[str | Path],
    track: str | Path,
    accuracy: float = 1e-3,
    *,
    contact: float | Parameters = HERTZ,
    schemes: Sequence[str] = PREDICTED,
    speed: float = 250 / 3.6,
    irregularity: str | Spectrum = "german-low",
    position: Position = None,
    progress: Progress = unheard,
    tell: Tell = unsaid,
) -> Advice:
    """Name owner, scheme and step that reach an accuracy at the least cost, before running.

    Parameters
    ----------
    vehicle, track : str or Path
        FMUs that take contact forces; of vehicles also several, from the front.
    accuracy : float
        Error allowed: RMS of the contact force's, relative.
    contact : float or mapping
        Stiffness, N/m, or parameters of the contact; see `stability`.
    schemes : sequence of str
        Names of the catalogue, or how they begin.
    speed : float
        m/s.
    irregularity : str or Spectrum
        A class of track, or the density of the mean height of both rails. Of a class, pairs in
        space meet all quantities that it has, and the error is that of the worse of the forces down
        and aside.
    position : float or sequence of float, optional
        Where the last wheelset (of each vehicle) stands, m; where it starts if not given.
    progress : callable
        Told what is done and the total.
    tell : callable, optional
        Told how much there is to be done, and, by what the first of it takes, for how long.

    Raises
    ------
    ArgumentError
        If no scheme reaches it, or one cannot be predicted.
    """
    check_accuracy(accuracy)
    pair = files_of(vehicle), Path(track)
    names = predictable(schemes)
    tell(f"{counted(names, 1)} of the longest step that is exact enough")
    positions = wheelset_positions(pair[0], position)
    spectra = (
        spectra_of(irregularity, acting_on(pair[0]))
        if isinstance(irregularity, str)
        else irregularity
    )
    source = excitation(spectra, speed, positions)
    k_H = static_stiffness(*pair, contact, position, speed)
    parts = linear_parts(*pair, lambda a, b: progress(LINEARISING * a / b, 1.0), position)
    tasks = _tasks(parts, k_H, names, accuracy, source)
    total = sum(task.cost for task in tasks)
    update = foretold(
        lambda a, b: progress(LINEARISING + (1 - LINEARISING) * a / b, 1.0), tell, CORES - 1
    )
    with Workers(update) as workers:
        found = [option for _, some in workers.completed(tasks, total) for option in some]
    if not found:
        raise ArgumentError(
            "accuracy", accuracy,
            "no scheme reaches it with steps of 0.01 ms or more; ask for less, or for other "
            "--schemes",
        )  # fmt: skip
    found.sort(key=lambda option: option.cost)
    return Advice(found, accuracy, largest(k_H), speed, exact_growth(parts, k_H))


def check_accuracy(accuracy: float) -> None:
    """Raise ArgumentError if no scheme could have it."""
    if not FINEST <= accuracy < 1.0:
        must = f"must be from {FINEST:g} to below 1, such as 1e-3"
        raise ArgumentError("accuracy", accuracy, must)


def _tasks(
    parts: tuple[Part, ...],
    k_H: Stiffness,
    names: list[str],
    accuracy: float,
    source: Excitation,
) -> list[Task]:
    """Some schemes of one owner each."""
    catalogue = members()
    tasks = []
    for owner in Owner:
        suiting = [name for name in names if owner in catalogue[name].owners]
        for i in range(0, len(suiting), TOGETHER):
            some = {name: catalogue[name].scheme for name in suiting[i : i + TOGETHER]}
            tasks.append(
                Task(
                    name=f"{owner.value} {i}",
                    function=_options,
                    arguments=(parts, owner, k_H, some, accuracy, source),
                    cost=float(len(some)),
                )
            )
    return tasks


def _options(
    parts: tuple[Part, ...],
    owner: Owner,
    k_H: Stiffness,
    schemes: dict[str, Scheme],
    accuracy: float,
    source: Excitation,
    progress: Progress,
) -> list[Option]:
    """Of every scheme the longest step that reaches an accuracy; see `Option`."""
    pair, error = SprungPair(parts, owner, k_H), ForceError(parts, k_H, source)
    found = []
    for i, (name, scheme) in enumerate(schemes.items()):
        option = longest_step(name, owner, Coupling(pair, scheme), accuracy, error)
        found += [option] if option is not None else []
        progress(i + 1, len(schemes))
    return found


def longest_step(
    name: str, owner: Owner, coupling: Coupling, accuracy: float, error: ForceError
) -> Option | None:
    """Find the longest of `STEPS` that is exact and stable enough, or None.

    Parameters
    ----------
    name : str
        Of the scheme.
    owner : Owner
        Of the contact springs.
    coupling : Coupling
        The scheme at the contact.
    accuracy : float
        Largest error allowed.
    error : ForceError
        At the same contact.
    """
    errors, limit = np.full(len(STEPS), np.nan), math.inf
    for j in range(len(STEPS))[::-1]:
        h = float(STEPS[j])
        if MARGIN * h > limit:
            continue
        errors[j] = error.of(coupling, h)
        if errors[j] > accuracy or not coupling.is_stable(h):
            continue
        # Stable between unstable steps is no advice, nor is a step just below one: another FMU
        # may shift it.
        limit = coupling.limit(REACH * h).step
        if MARGIN * h <= limit:
            return Option(
                scheme=name, owner=owner, step=h, limit=limit, error=float(errors[j]),
                errors=errors, evaluations=coupling.evaluations,
            )  # fmt: skip
    return None


def _dataset(found: list[Option], accuracy: float, k_H: float, speed: float) -> xr.Dataset:
    """Columns over the options, cheapest first."""
    columns = {
        "step": ([o.step for o in found], "s", "longest step that reaches the accuracy"),
        "evaluations": ([o.evaluations for o in found], "1", "evaluations a step"),
        "cost": ([o.cost for o in found], "1/s", "evaluations a second of time simulated"),
        "error": ([o.error for o in found], "1", "predicted relative RMS error of contact forces"),
        "stable_to": (
            [o.limit for o in found],
            "s",
            "largest stable step; infinite beyond twice the step",
        ),
    }
    variables: dict[str, Any] = {
        name: ("option", np.array(values, dtype=float), {"units": unit, "long_name": text})
        for name, (values, unit, text) in columns.items()
    }
    variables["errors"] = (
        ("option", "tried"),
        np.array([o.errors for o in found]),
        {"units": "1", "long_name": "predicted relative RMS error at the steps tried"},
    )
    return xr.Dataset(
        variables,
        coords={
            "option": [f"{o.scheme}, contact in {o.owner.value}" for o in found],
            "tried": ("tried", STEPS, {"units": "s", "long_name": "step"}),
        },
        attrs={"accuracy": accuracy, "contact_stiffness": k_H, "speed": speed},
    )
