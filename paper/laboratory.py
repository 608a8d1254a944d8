"""What the figures are made from: the FMUs, their linear models, and runs in time."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from fmpy import read_model_description

from railcosim.analysis.pair.contact import HERTZ
from railcosim.analysis.pair.judged import judged
from railcosim.analysis.pair.pair import Journey
from railcosim.analysis.pair.time_run import run_pair
from railcosim.analysis.response.frequency import Contact, coupled, on_rigid_track
from railcosim.analysis.response.models import (
    Models,
    linear_track,
    linear_vehicle,
    wheelset_positions,
)
from railcosim.analysis.response.rolling_pair import (
    contacts_told,
    loads_of,
    told_wheels,
)
from railcosim.fmus.export import WITH_STATES, export
from railcosim.master.component import FloatArray
from railcosim.master.course import Course
from railcosim.master.files import load, save
from railcosim.master.linear.receptance import Response
from railcosim.master.parallel import Task, Workers
from railcosim.master.progress import Progress
from railcosim.master.schemes.jacobi import jacobi
from railcosim.mechanics.law import coefficient_for
from railcosim.mechanics.ports import FORCE, Layout
from railcosim.track.irregularity import Profile, synthesise
from railcosim.track.parameters import Track
from railcosim.vehicle.parameters import Vehicle

FORCES = Layout().names(FORCE)

SPEED = 250 / 3.6  # m/s, figure 3
K_H = 0.3e9  # N/m, of the paper's figures without another one (eq. 19)
SPECTRUM = "german-low"  # the paper does not name its spectrum
WAVELENGTHS = (0.2, 150.0)  # m: 0.46 to 347 Hz at that speed
STEP = 1e-4  # s
PAIR = ("Vehicle", "TrackWithContact")
FOLDERS = {"vertical": "fmus", "spatial": "fmus-in-space"}
STIFFEST = 1e13
"""N/m, of a spring that rolls: a hundred thousandth of what a rail gives way by, and no more digits
are lost."""
KEPT = ["carbody.az", *FORCES]


@dataclass(frozen=True, kw_only=True)
class Run:
    """One run in time with nonlinear contact."""

    k_H: float
    seed: int
    rolling: bool = False

    @property
    def name(self) -> str:
        """Of its file."""
        motion = "_rolling" if self.rolling else ""
        return f"run_{self.k_H / 1e9:g}GN_seed{self.seed}{motion}"


@dataclass(frozen=True, kw_only=True)
class Effort:
    """How much of everything: in full, or for a quick look.

    Attributes
    ----------
    runs : tuple of Run
        For figure 3.
    duration, settling : float
        Of a run, and what of its beginning is left out, s.
    points : int
        Wavelengths and speeds of a map; ten times as many frequencies of a curve.
    """

    runs: tuple[Run, ...]
    duration: float
    settling: float
    points: int


STIFFNESSES = (0.1e9, 1e9, 8e9)
FULL = Effort(
    runs=(
        *(Run(k_H=k_H, seed=seed) for k_H in STIFFNESSES for seed in (1, 2)),
        Run(k_H=1e9, seed=1, rolling=True),
    ),
    duration=12.0,
    settling=2.0,
    points=400,
)
QUICK = Effort(
    runs=tuple(Run(k_H=k_H, seed=1) for k_H in STIFFNESSES),
    duration=0.7,
    settling=0.2,
    points=120,
)


@dataclass(frozen=True, kw_only=True, eq=False)
class Laboratory:
    """Everything a figure may need; see `prepare`.

    Attributes
    ----------
    effort : Effort
        How fine.
    models : Models
        Linear models, wheelset 4 above a railseat.
    midspan : Models or None
        The same with wheelset 4 between two railseats, if asked for.
    runs : dict
        Runs in time, if asked for.
    vehicle, track : Vehicle, Track
        What the FMUs were made from.
    contact : callable
        Wheels on rails whose normal stiffness at the static load is k_H, N/m.
    """

    effort: Effort
    models: Models
    vehicle: Vehicle
    track: Track
    midspan: Models | None = None
    runs: dict[Run, xr.Dataset] = field(default_factory=dict)
    contact: Callable[[float], Contact] = float

    @property
    def positions(self) -> FloatArray:
        """Of the wheelsets, m."""
        return self.models.positions

    def frequencies(self, low: float, high: float) -> FloatArray:
        """For a curve, Hz."""
        return np.geomspace(low, high, 10 * self.effort.points)

    def coupled(
        self, k_H: float = K_H, models: Models | None = None
    ) -> Callable[[FloatArray], Response]:
        """Vehicle on flexible track, of omega; above a railseat if not given other models."""
        return lambda omega: coupled(models or self.models, omega, self.contact(k_H))

    def rigid(self, k_H: float = K_H) -> Callable[[FloatArray], Response]:
        """Vehicle on rigid track, of omega."""
        return lambda omega: on_rigid_track(self.models, omega, self.contact(k_H))


def prepare(
    out: Path,
    effort: Effort,
    *,
    midspan: bool,
    runs: bool,
    workers: Workers,
    dimension: str = "vertical",
) -> Laboratory:
    """Export the FMUs, linearise them and run them, on all cores.

    Runs are kept in the folder and not repeated.

    Parameters
    ----------
    out : Path
        Folder for FMUs and runs.
    effort : Effort
        How much.
    midspan, runs : bool
        Whether these are needed.
    workers : Workers
        Who does it.
    dimension : str
        Of the FMUs: vertical, or spatial, whose wheels roll.
    """
    vehicle, track = Vehicle(), Track()
    fmus = export(
        vehicle, track, out / FOLDERS[dimension], dimension=dimension, runtime=WITH_STATES
    )
    positions = wheelset_positions(fmus["Vehicle"])
    places = {"railseat": positions}
    if midspan:
        places["midspan"] = positions + track.fastening.spacing / 2
    tasks = [Task(name="vehicle", function=linear_vehicle, arguments=(fmus["Vehicle"],), cost=1.0)]
    tasks += [
        Task(name=name, function=linear_track, arguments=(fmus["Track"], at), cost=2.0)
        for name, at in places.items()
    ]
    wanted = effort.runs if runs else ()
    files = {run: _file(out, run, effort, fmus) for run in wanted}
    tasks += [
        Task(
            name=run.name,
            function=_run,
            arguments=(fmus, run, effort.duration, vehicle.wheel_load, files[run]),
            cost=effort.duration * (14.0 if run.rolling else 7.0),
        )
        for run in wanted
        if not files[run].exists()
    ]
    tasks.sort(key=lambda task: -task.cost)
    found = dict(workers.completed(tasks, sum(task.cost for task in tasks)))
    models = {name: _models(found, name, at) for name, at in places.items()}
    return Laboratory(
        effort=effort,
        models=models["railseat"],
        midspan=models.get("midspan"),
        runs={run: load(file) for run, file in files.items()},
        vehicle=vehicle,
        track=track,
        contact=CONTACTS[dimension](fmus["Vehicle"], models["railseat"]),
    )


def _rolling(fmu: Path, models: Models) -> Callable[[float], Contact]:
    """Wheels that roll at `SPEED`, on springs along their cones' normals."""
    wheels, loads = told_wheels(fmu), loads_of(fmu, models.vehicle)

    @cache
    def contact(k_H: float) -> Contact:
        C = coefficient_for(np.full_like(loads, min(k_H, STIFFEST)), loads)
        pressed = [wheel | {HERTZ: one} for wheel, one in zip(wheels, C.tolist(), strict=True)]
        return contacts_told(pressed, loads).at(SPEED)

    return contact


CONTACTS: Mapping[str, Callable[[Path, Models], Callable[[float], Contact]]] = {
    "vertical": lambda fmu, models: float,
    "spatial": _rolling,
}


def _models(found: dict[str, Any], name: str, positions: FloatArray) -> Models:
    (cars, cars_sha), (rails, rails_sha) = found["vehicle"], found[name]
    return Models(cars, rails, positions, {"vehicle_fmu": cars_sha, "track_fmu": rails_sha})


def _file(out: Path, run: Run, effort: Effort, fmus: dict[str, Path]) -> Path:
    """Name of a run's file: another FMU, irregularity or duration is another."""
    guids = "".join(read_model_description(fmus[name]).guid for name in PAIR)
    profile = _profile(run, effort.duration)
    mark = hashlib.sha256(f"{guids}{effort.duration}{STEP}{profile.digest}".encode())
    return out / "runs" / f"{run.name}_{mark.hexdigest()[:8]}.nc"


def _profile(run: Run, duration: float) -> Profile:
    """The irregularity of a run."""
    return synthesise(SPECTRUM, SPEED * duration, run.seed, wavelengths=WAVELENGTHS)


def _run(
    fmus: dict[str, Path],
    run: Run,
    duration: float,
    wheel_load: float,
    file: Path,
    progress: Progress,
) -> None:
    """Run the pair with Hertz's law that has the tangent k_H at the static load, and save it.

    Raises
    ------
    NotBelievedError
        If the run shows signs of an unstable coupling and shorter steps do not confirm them.
    """
    law = {
        "contact.nonlinear": True,
        "contact.hertz_coefficient": coefficient_for(run.k_H, wheel_load),
    }
    journey = Journey(speed=SPEED, held=not run.rolling, profile=_profile(run, duration))
    course = Course(scheme=jacobi(degree=1), step=STEP, stop=duration)
    vehicle, track = (fmus[name] for name in PAIR)
    recorded = judged(
        lambda change: run_pair(vehicle, track, law, journey, change(course), progress)
    )
    file.parent.mkdir(exist_ok=True)
    save(recorded[KEPT], file)
