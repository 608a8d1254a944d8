"""One point of a study: a coupled run held against the converged forces. Works in any process."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from railcosim.analysis.pair.owner import FMUS, Owner
from railcosim.analysis.pair.pair import Journey, open_pair
from railcosim.master.component import ComponentError, FloatArray
from railcosim.master.cosimulation import Cosimulation, Divergence, FallbackWarning, cosimulate
from railcosim.master.law import Law
from railcosim.master.progress import Progress, unheard
from railcosim.master.schemes import Scheme
from railcosim.master.system import System
from railcosim.mechanics.ports import FORCE, IRREGULARITY, Layout
from railcosim.reference.agreement import relative_rms

from .coupled_reference import ContactForces, converged_forces, motion_model
from .pairs_at_rest import AT_REST, Fmus, files_of_content, told_before

INTERNAL_STEP = 2.5e-5
"""Of FMUs that own the contact (s). Their own error, of fourth order in it, changes what is
measured, the coupling's, by 5 parts in a thousand at most: at 8 GN/m and 0.1 ms 1.980e-4 with 5e-6
becomes 1.970e-4, at 1 GN/m and 0.05 ms 1.677e-6 becomes 1.679e-6. It takes a third of the time."""

OFTEN = 100  # points between words of progress


@dataclass(frozen=True, kw_only=True)
class ContactCase:
    """A contact law, by a label and as parameters of the FMUs."""

    label: str
    parameters: Mapping[str, float | bool]


@dataclass(frozen=True, kw_only=True)
class Point:
    """One run: a scheme, by its name in the catalogue, with an owner, a law and a step (s)."""

    name: str
    scheme: Scheme
    owner: Owner | str
    contact: ContactCase
    step: float

    def __str__(self) -> str:
        return f"{self.name}, contact in {self.owner}, {self.contact.label}, step {self.step:g} s"


class Reference(Protocol):
    """What runs are held against: `ContactForces`, or `Sampled` of a system."""

    @property
    def rest(self) -> FloatArray:
        """What deviations count from."""

    @property
    def error(self) -> float:
        """Estimate, relative."""

    def at(self, times: ArrayLike) -> FloatArray:
        """Values at some times (s), shape (n_times, n_columns)."""


class Subject(Protocol):
    """What a study runs, in any process: `PairStudied`, or `SystemStudied`."""

    @property
    def compared(self) -> str:
        """What of the runs, in words."""

    @property
    def held_to(self) -> str:
        """And with what."""

    def reference(self, contact: ContactCase, progress: Progress = ...) -> Any:
        """What all runs with a contact are held against."""

    def measure(self, point: Point, held: Any, progress: Progress = ...) -> Measurement:
        """Make one run."""


@dataclass(frozen=True, kw_only=True)
class Measurement:
    """What a run was like.

    Attributes
    ----------
    error : float
        RMS of all contact forces' error over the RMS of their deviation from rest, or of a system
        of all that is exchanged, each over its own; infinite if the run did not come to its end.
    reference_error : float
        Likewise, of the reference; an estimate.
    growth : float
        Factor by which the error grew a step, beyond what the motion did: above 1 if unstable.
        NaN in runs of less than 8 steps.
    evaluations : float
        How often each component was stepped, a step.
    wall : float
        Time for a simulated second, s; of this machine, with whatever else it did.
    steps : int
        Steps made.
    open_steps : int
        Steps in which the scheme did not reach what it aims at.
    fallbacks : str
        Components that could not do what the scheme asks for.
    stopped : str
        Why the run ended early; empty if it did not.
    """

    error: float
    reference_error: float
    growth: float
    evaluations: float
    wall: float
    steps: int
    open_steps: int
    fallbacks: str
    stopped: str


def reference(
    journey: Journey,
    stop: float,
    contact: ContactCase,
    vehicle: bytes,
    track: bytes,
    progress: Progress = unheard,
) -> ContactForces:
    """Converged contact forces.

    Parameters
    ----------
    journey : Journey
        Speed and irregularity; the wheels are held.
    stop : float
        How long, s.
    contact : ContactCase
        The contact law.
    vehicle, track : bytes
        The FMUs without contact.
    progress : callable, optional
        Told what is done and the total; may raise to stop it.
    """
    fmus = dict(zip(FMUS[Owner.MASTER], (vehicle, track), strict=True))
    with files_of_content(fmus) as (cars, rails):
        with (
            told_before(),
            open_pair(cars, rails, dict(contact.parameters), journey) as pair,
        ):
            pair.system.exchange()
            system, layout = pair.system, pair.layout
            (law,) = (one for one in system.components if isinstance(one, Law))
            rest = law.S @ system.gather(system.index(law.name))
        model = motion_model(cars, rails, pair.wheels.start, law, layout)
    surface = layout.surface
    asked = [v.name for v in law.inputs]
    taken = -law.S[:, [asked.index(name) for name in surface.names(IRREGULARITY)]]
    lies = journey.under(pair.wheels, surface.directions)
    told = [v.name for v in law.outputs]
    # What pulls and turns wheels along the track nothing balances at rest: the rail does not know.
    along = {*layout.names(FORCE)} - {*layout.rails.names(FORCE)}
    held = np.array([0.0 if name in along else F for name, F in zip(told, law.y, strict=True)])
    found = converged_forces(
        model, law.law, rest.reshape(law.contacts, -1),
        lambda t: taken @ lies(t), stop, progress, held=held,
    )  # fmt: skip
    return found.of([told.index(name) for name in surface.names(FORCE)])


def measure(
    journey: Journey,
    stop: float,
    point: Point,
    vehicle: bytes,
    track: bytes,
    forces: ContactForces,
    progress: Progress = unheard,
) -> Measurement:
    """Make one run.

    Parameters
    ----------
    journey : Journey
        Speed and irregularity; the wheels are held.
    stop : float
        How long, s.
    point : Point
        How it is coupled.
    vehicle, track : bytes
        The FMUs for the point's owner of the contact.
    forces : ContactForces
        From `reference`.
    progress : callable, optional
        Told the time and the end (s), now and then; may raise to stop the run.
    """
    fmus = dict(zip(FMUS[Owner(point.owner)], (vehicle, track), strict=True))
    parameters = {**point.contact.parameters, "internal_step": INTERNAL_STEP}
    system = AT_REST.system(journey, parameters, fmus)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FallbackWarning)  # kept in the result
        run = cosimulate(system, point.scheme, point.step, stop)
    columns = _columns(system)
    found = watched(run, lambda outputs: outputs[columns], forces, progress)
    if found.stopped:  # an FMU that has refused a call may be of no use any more
        AT_REST.forget()
    return found


@dataclass(frozen=True, kw_only=True)
class PairStudied:
    """A pair on a journey; a `Subject`.

    Attributes
    ----------
    journey : Journey
        Speed and irregularity; the wheels are held.
    stop : float
        How long each run is, s.
    fmus : mapping of str to bytes
        Content of the FMU files, by name.
    """

    journey: Journey
    stop: float
    fmus: Fmus
    compared = "the contact forces"
    held_to = "the monolithic solution"

    def reference(self, contact: ContactCase, progress: Progress = unheard) -> ContactForces:
        """Converged contact forces."""
        vehicle, track = (self.fmus[name] for name in FMUS[Owner.MASTER])
        return reference(self.journey, self.stop, contact, vehicle, track, progress)

    def measure(
        self, point: Point, held: ContactForces, progress: Progress = unheard
    ) -> Measurement:
        """Make one run."""
        vehicle, track = (self.fmus[name] for name in FMUS[Owner(point.owner)])
        return measure(self.journey, self.stop, point, vehicle, track, held, progress)


def watched(
    run: Cosimulation,
    compared: Callable[[FloatArray], FloatArray],
    reference: Reference,
    progress: Progress,
) -> Measurement:
    """Run to the end, or to where it fails, and hold what is compared against a reference."""
    times, found, reports, stopped = [], [], [], ""
    begun = time.perf_counter()
    try:
        for point in run:
            times.append(point.time)
            found.append(compared(point.outputs))
            reports.append(point.report)
            if len(times) % OFTEN == 0:
                progress(point.time, run.stop)
    except (Divergence, ComponentError) as error:
        stopped = str(error)
    wall = time.perf_counter() - begun
    ours, theirs = np.array(found), reference.at(times)
    made = [report for report in reports if report is not None]
    return Measurement(
        error=np.inf if stopped else relative_rms(ours, theirs, reference.rest),
        reference_error=reference.error,
        growth=_growth(ours - theirs, theirs - reference.rest),
        evaluations=float(np.mean([r.evaluations for r in made])) if made else np.nan,
        wall=wall / (times[-1] - run.start) if made else np.nan,
        steps=len(made),
        open_steps=sum(not r.converged for r in made),
        fallbacks=" ".join(run.stepper.fallbacks),
        stopped=stopped,
    )


def _growth(error: FloatArray, motion: FloatArray) -> float:
    """From the third to the last quarter of a run, a step."""
    quarter = len(error) // 4
    if quarter < 2:
        return np.nan
    rms = [
        np.sqrt(np.mean(part[-2 * quarter :].reshape(2, -1) ** 2, axis=1))
        for part in (error, motion)
    ]
    with np.errstate(divide="ignore", invalid="ignore"):  # an error or a motion of nothing
        (before, after) = rms[0] / rms[1]
        return float((after / before) ** (1.0 / quarter))


def _columns(system: System) -> list[int]:
    """Where the contact forces are among the outputs."""
    names = [variable.name for variable in system.variables]
    layout = Layout.among(names)
    assert layout is not None  # a pair has wheels
    return [names.index(force) for force in layout.surface.names(FORCE)]
