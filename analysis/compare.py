"""Coupled FMUs against one monolithic system of the same vehicle and track."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from railcosim.analysis.comparison.held import Errors, Held
from railcosim.analysis.comparison.in_time import REFINEMENT, newmark_forces
from railcosim.analysis.comparison.springs import Springs
from railcosim.analysis.comparison.wheels import RollingWheels
from railcosim.analysis.pair.contact import layout_of
from railcosim.analysis.pair.owner import FMUS, Owner
from railcosim.analysis.pair.pair import Journey
from railcosim.analysis.pair.time_run import run_pair
from railcosim.analysis.pair.verdict import DISAGREE, NotBelievedError
from railcosim.analysis.response.models import linear_models
from railcosim.analysis.schemes.choice import choice_of
from railcosim.analysis.schemes.choice import scheme as scheme_of
from railcosim.master.component import FloatArray
from railcosim.master.course import Course
from railcosim.master.progress import Progress, unheard
from railcosim.master.schemes import Scheme
from railcosim.mechanics.ports import FORCE, Layout
from railcosim.reference.agreement import relative_rms
from railcosim.reference.monolithic import assemble
from railcosim.track.irregularity import Profile
from railcosim.track.irregularity.defects import Defect
from railcosim.track.irregularity.named import irregularity as named
from railcosim.track.irregularity.named_defects import defects_of
from railcosim.track.parameters import Track
from railcosim.vehicle.parameters import Vehicle
from railcosim.vehicle.train import Train

Stage = Callable[[str], AbstractContextManager[Progress]]


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
    title : str
        Of what contacts.
    of_forces : dict of str to float
        RMS error of the contact forces in time in each direction, by the last part of their names,
        relative to that of what they change by from rest.
    in_frequency : dict
        Relative errors of outputs, NaN within 1 % of an antiresonance or where there is to be
        nothing, and whether the response is not weak, by excitation and output.
    """

    scheme: Scheme
    title: str
    of_forces: dict[str, float]
    in_frequency: Errors

    @property
    def in_time(self) -> float:
        """The worst of the forces' errors in time."""
        return max(self.of_forces.values())

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
        k_H of springs, N/m; in space wheels press by Hertz's law and roll.
    owner : Owner
        Of the contact springs, in time.
    scheme : Scheme, optional
        How to couple in time; the usual one of the owner if not given.
    step, time : float
        Communication step and how long, s.
    speed : float
        m/s; in space wheels creep at it in their places.
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
    course = Course(scheme=chosen, step=step, stop=time)
    with stage("linearising") as update:
        models = linear_models(fmus["Vehicle"], fmus["Track"], update, position)
    layout = layout_of((fmus["Vehicle"], models.vehicle.inputs))
    ways: dict[str, Callable[[], Held]] = {
        "vertical": lambda: Springs(contact_stiffness),
        "spatial": lambda: RollingWheels(vehicle, speed, fmus["Vehicle"]),
    }
    held = ways[layout.dimension]()
    mono = assemble(vehicle, track, models.positions, held.dimension)
    steps = round(time / step)
    with stage(f"coupled FMUs in time, {steps} steps") as update:
        cars, rails = (fmus[name] for name in FMUS[owner])
        run, stopped = run_pair(cars, rails, held.parameters, journey, course, update)
    if stopped is not None:
        raise stopped
    with stage(f"Newmark, monolithic, {REFINEMENT * steps} steps") as update:
        contacts = held.contacts(mono)
        theirs = newmark_forces(mono, models.positions, contacts, journey, course, update)
    with stage(f"direct solves, monolithic, {frequency.size} frequencies") as update:
        errors = held.errors(models, mono, frequency, update)
    ports = Layout(layout.wheelsets, directions=mono.directions).names(FORCE)
    of_forces = {}
    for effort in held.efforts:
        at = [k for k, name in enumerate(ports) if name.endswith(f".{effort}")]
        ours = np.stack([run[ports[k]].values for k in at], axis=1)
        of_forces[effort] = relative_rms(ours, theirs[:, at], theirs[0, at])
    return Comparison(chosen, held.title, of_forces, errors)
