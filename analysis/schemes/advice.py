"""Owner, scheme and step that reach an accuracy at the least cost, predicted on all cores."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from railcosim.analysis.pair.contact import NONLINEAR, Parameters, Stiffness
from railcosim.analysis.pair.linear_pair import Part, linear_parts
from railcosim.analysis.pair.numbering import files_of
from railcosim.analysis.pair.owner import Owner
from railcosim.analysis.pair.standing import Position
from railcosim.analysis.pair.static_load import acting_on, static_stiffness
from railcosim.analysis.response.models import wheelset_positions
from railcosim.master.parallel import CORES, Task, Workers
from railcosim.master.progress import Progress, Tell, foretold, unheard, unsaid
from railcosim.master.schemes import Scheme
from railcosim.track.irregularity import Spectrum
from railcosim.track.irregularity.synthesis import spectra_of

from .advised import STEPS, Advice, Option, cheapest_first, check_accuracy, longest_step
from .catalogue import members
from .force_error import Excitation, ForceError, excitation
from .limits import LINEARISING, counted, exact_growth, largest, predictable
from .stability import Coupling, SprungPair
from .usual import PREDICTED

TOGETHER = 4
"""Schemes of one task."""
HERTZ: Parameters = {NONLINEAR: True}


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
    about = {"accuracy": accuracy, "contact_stiffness": largest(k_H), "speed": speed}
    return cheapest_first(found, STEPS, exact_growth(parts, k_H), about)


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
        progress(i, len(schemes))
        try:
            coupling = Coupling(pair, scheme)
        except ValueError:  # it does not suit the contacts
            continue
        option = longest_step(name, owner, coupling, accuracy, error)
        found += [option] if option is not None else []
    progress(len(schemes), len(schemes))
    return found
