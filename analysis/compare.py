"""Coupled FMUs against one monolithic system of the same vehicle and track."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from railcosim.analysis.pair.contact import Stiffness, contact_of
from railcosim.analysis.pair.owner import FMUS, Owner
from railcosim.analysis.pair.pair import Journey
from railcosim.analysis.pair.time_run import run_pair
from railcosim.analysis.pair.verdict import DISAGREE, NotBelievedError
from railcosim.analysis.response.frequency import coupled, response
from railcosim.analysis.response.models import Models, linear_models
from railcosim.analysis.schemes.choice import choice_of
from railcosim.analysis.schemes.choice import scheme as scheme_of
from railcosim.master.component import FloatArray
from railcosim.master.course import Course
from railcosim.master.linear.realisation import ComplexArray
from railcosim.master.progress import Progress, unheard
from railcosim.master.schemes import Scheme
from railcosim.mechanics.law import LinearContact
from railcosim.mechanics.ports import FORCE, Layout
from railcosim.reference.agreement import near, relative_rms
from railcosim.reference.contacts import Contacts, Pressing
from railcosim.reference.frequency import frequency_response, linearised
from railcosim.reference.monolithic import Monolithic, assemble
from railcosim.reference.newmark import newmark
from railcosim.track.irregularity import Profile
from railcosim.track.irregularity.defects import Defect
from railcosim.track.irregularity.met import Wheels
from railcosim.track.irregularity.named import irregularity as named
from railcosim.track.irregularity.named_defects import defects_of
from railcosim.track.parameters import Track
from railcosim.track.travel import Steady
from railcosim.vehicle.parameters import Vehicle
from railcosim.vehicle.train import Train

Stage = Callable[[str], AbstractContextManager[Progress]]
REFINEMENT = (
    4  # Newmark's steps in a communication step: its error is then a hundredth of a per cent
)
FINE = 6000  # frequencies on which antiresonances are looked for
WEAK = 1e-3  # of the largest displacement (or force) at that frequency
# Excitation and output to errors and whether the response is not weak, by frequency.
Errors: TypeAlias = dict[str, dict[str, tuple[FloatArray, NDArray[np.bool_]]]]


@contextmanager
def _unseen(text: str) -> Iterator[Progress]:
    """A block of work that nobody watches."""
    yield unheard


@dataclass(frozen=True)
class Comparison:
    """How far coupled FMUs are from the monolithic system.

    Attributes
    ----------
    scheme : Scheme
        How they were coupled in time.
    in_time : float
        RMS error of the contact forces, relative to that of their dynamic part.
    in_frequency : dict
        See `frequency_errors`.
    """

    scheme: Scheme
    in_time: float
    in_frequency: Errors

    def check(self) -> None:
        """Raise NotBelievedError if the forces in time are not those of the system."""
        if not self.in_time <= DISAGREE:
            raise NotBelievedError(
                "the coupled run is not to be believed: its contact forces are wrong by "
                f"{self.in_time:.0%} of their dynamic part. Take a shorter --step or another "
                "--scheme"
            )


def compare(
    vehicle: Vehicle | Train,
    track: Track,
    fmus: Mapping[str, Path],
    frequency: FloatArray,
    *,
    contact_stiffness: float = 1e9,
    owner: Owner = Owner.TRACK,
    scheme: Scheme | None = None,
    step: float = 1e-4,
    time: float = 0.3,
    speed: float = 250 / 3.6,
    irregularity: Profile | str | Path = "german-low",
    defects: Iterable[str | Defect] = (),
    position: float | None = None,
    stage: Stage = _unseen,
) -> Comparison:
    """Hold coupled FMUs, wheels held, against one system of the same vehicle and track.

    Parameters
    ----------
    vehicle, track : Vehicle or Train, Track
        Parameters.
    fmus : mapping of str to Path
        What `export` made of them.
    frequency : array, shape (n,)
        Hz.
    contact_stiffness : float
        k_H, N/m.
    owner : Owner
        Of the contact springs, in time.
    scheme : Scheme, optional
        How to couple in time; the usual one of the owner if not given.
    step, time : float
        Communication step and how long, s.
    speed : float
        m/s.
    irregularity : Profile, str or Path
        Or the name of a class, or a CSV file.
    defects : iterable of Defect or str
        See `railcosim.run`.
    position : float, optional
        Where the last wheelset stands, m; where it starts if not given.
    stage : callable, optional
        Opens a block of the work by a few words; gives what is told what is done and the total.

    Raises
    ------
    Divergence, ComponentError
        If the coupled run stopped.
    """
    if not isinstance(irregularity, Profile):
        irregularity = named(irregularity, speed * time)
    journey = Journey(
        speed=speed, held=True, profile=irregularity, position=position,
        defects=defects_of(defects),
    )  # fmt: skip
    chosen = scheme_of(choice_of(None, owner)[0]) if scheme is None else scheme
    course, k_H = Course(scheme=chosen, step=step, stop=time), contact_stiffness
    with stage("linearising") as update:
        models = linear_models(fmus["Vehicle"], fmus["Track"], update, position)
    mono = assemble(vehicle, track, models.positions)
    steps = round(time / step)
    with stage(f"coupled FMUs in time, {steps} steps") as update:
        cars, rails = (fmus[name] for name in FMUS[owner])
        run, stopped = run_pair(cars, rails, contact_of(k_H), journey, course, update)
    if stopped is not None:
        raise stopped
    ours = np.stack([run[name].values for name in Layout(len(models.positions)).names(FORCE)], 1)
    with stage(f"Newmark, monolithic, {REFINEMENT * steps} steps") as update:
        springs = Pressing(LinearContact(k_H=k_H))
        theirs = newmark_forces(mono, models.positions, springs, journey, course, update)
    with stage(f"direct solves, monolithic, {frequency.size} frequencies") as update:
        errors = frequency_errors(models, mono, k_H, frequency, update)
    return Comparison(chosen, relative_rms(ours, theirs, mono.load), errors)


def newmark_forces(
    mono: Monolithic,
    positions: FloatArray,
    contacts: Contacts,
    journey: Journey,
    course: Course,
    progress: Progress,
) -> FloatArray:
    """Forces on rails (n, n_ports) of the monolithic system at the course's points."""
    radii = np.array([wheel.radius for wheel in mono.body.wheels])
    heights = journey.under(Wheels(positions, radii), contacts.rough)
    way = Steady(0.0) if journey.held else journey.way
    steps, step = round(course.stop / course.step) * REFINEMENT, course.step / REFINEMENT
    forces = []
    march = newmark(mono, contacts, lambda t: positions + way.gone(t), heights, step, steps)
    for k, instant in enumerate(march):
        if k % REFINEMENT == 0:
            forces.append(instant.force)
            progress(k, steps)
    return np.array(forces)


def frequency_errors(
    models: Models, mono: Monolithic, k_H: Stiffness, frequency: FloatArray, progress: Progress
) -> Errors:
    """Relative errors, NaN within 1 % of an antiresonance, and where the response is not weak."""
    fine = np.geomspace(frequency[0], frequency[-1], FINE)
    stiffness = np.resize(k_H, len(mono.load))
    rails, positions = mono.rails(models.positions), models.positions
    last = len(positions)
    on_wheelset = np.asarray(mono.wheels[[last - 1]].toarray().T)
    on_rails = np.asarray(rails[[last - 1, 2 * last - 1]].sum(axis=0))[:, None]
    solved = frequency_response(
        mono,
        2 * np.pi * frequency,
        linearised(mono, Pressing(LinearContact(k_H=stiffness)), positions),
        np.hstack([on_wheelset, on_rails]),
        progress,
    )
    compression = (mono.wheels - rails).toarray()
    found: Errors = {}
    for column, what in enumerate(("force_z", "rail_force_z")):
        excitation = f"wheelset[{last}].{what}"
        system, dense = (coupled(models, 2 * np.pi * f, k_H) for f in (frequency, fine))
        ours, curve = (response(s, excitation, positions, 1.0) for s in (system, dense))
        direct = solved[:, :, column]
        references: dict[str, ComplexArray] = {
            output: direct[:, mono.coordinate(name)]
            for output, name in _observed(mono, last).items()
        }
        rail_z = direct @ rails.toarray().T
        force = stiffness * (direct @ compression.T)
        for i in sorted({1, last}):
            references[f"track.wheelset[{i}].left.rail_z"] = rail_z[:, i - 1]
            references[f"wheelset[{i}].left.force_z"] = force[:, i - 1]
        found[excitation] = {}
        for output, expected in references.items():
            row = system.rows([output])[0]
            error = np.abs(ours[:, row] / expected - 1)
            error[near(frequency, fine, curve[:, row])] = np.nan
            like = [r for name, r in references.items() if is_force(name) == is_force(output)]
            strong = np.abs(expected) > WEAK * np.abs(like).max(axis=0)
            found[excitation][output] = (error, strong)
    return found


def _observed(mono: Monolithic, last: int) -> dict[str, str]:
    """Outputs of the coupled FMUs, and the monolithic coordinates that are the same."""
    names = mono.body.coordinates
    bodies = [c for c in names if c.endswith(".z") and not c.startswith("wheelset")]
    wheels = {f"vehicle.wheelset[{i}].left.wheel_z": f"wheelset[{i}].z" for i in (1, last)}
    return {**{f"vehicle.{name}": name for name in bodies}, **wheels}


def is_force(output: str) -> bool:
    """Whether an output is a contact force."""
    return output.endswith(".force_z")
