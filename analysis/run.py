"""A coupled run of a vehicle and a track, from Python."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

import xarray as xr

from railcosim.analysis.pair.contact import NONLINEAR, Parameters, contact_of
from railcosim.analysis.pair.judged import judged
from railcosim.analysis.pair.numbering import files_of
from railcosim.analysis.pair.pair import Journey
from railcosim.analysis.pair.roles import moves_aside, owners
from railcosim.analysis.pair.standing import Position
from railcosim.analysis.pair.time_run import run_pair
from railcosim.analysis.schemes.choice import choice_of, usual_step
from railcosim.analysis.schemes.choice import scheme as scheme_of
from railcosim.master.course import Course
from railcosim.master.progress import Progress, unheard
from railcosim.master.schemes import Scheme
from railcosim.track.irregularity import Profile
from railcosim.track.irregularity.defects import Defect
from railcosim.track.irregularity.named import irregularity as named
from railcosim.track.irregularity.named_defects import defects_of
from railcosim.track.travel import Travel
from railcosim.track.travel_files import travel_of

HERTZ: Parameters = {NONLINEAR: True}


def run(
    vehicle: str | Path | Sequence[str | Path],
    track: str | Path,
    *,
    scheme: Scheme | str | None = None,
    contact: float | Parameters = HERTZ,
    step: float | None = None,
    time: float = 1.0,
    speed: float | str | Path | Travel = 250 / 3.6,
    irregularity: Profile | str | Path = "german-low",
    defects: Iterable[str | Defect] = (),
    held: bool = False,
    position: Position = None,
    tolerance: float | None = None,
    progress: Progress = unheard,
) -> xr.Dataset:
    """Run a vehicle FMU and a track FMU coupled in time, from the static equilibrium of both.

    Parameters
    ----------
    vehicle, track : str or Path
        FMUs; of vehicles also several, from the front. If none owns the contact springs, the
        master does.
    scheme : Scheme or str, optional
        How to couple, or its name; the usual one of the owner of the contact if not given.
    contact : float or mapping
        Stiffness, N/m, or parameters of the contact; Hertz's law if not given.
    step : float, optional
        Communication step, s; the longest one with a tolerance.
    time : float
        How long, s.
    speed : float, str, Path or Travel
        m/s; or a CSV file of a speed that changes, see `read_travel`.
    irregularity : Profile, str or Path
        Or the name of a class, or a CSV file.
    defects : iterable of Defect or str
        Of rails and wheels, such as ``"dip:depth=1e-3,length=1,at=30"`` or
        ``"flat:length=0.05,wheel=1.left"``; see `railcosim.track.irregularity.defects`.
    held : bool
        Hold the wheels and move the irregularity instead.
    position : float or sequence of float, optional
        Where the last wheelset (of each vehicle) stands at first, m; as the FMU has it if None.
    tolerance : float, optional
        Choose steps by an error estimate.
    progress : callable
        Given the time and the end, s, now and then.

    Returns
    -------
    Dataset
        All outputs at all communication points; the verdict in the attributes.

    Raises
    ------
    NotBelievedError
        If the run shows signs of an unstable coupling and shorter steps do not confirm them.
    Divergence, ComponentError
        What stopped the run.

    Notes
    -----
    What was recorded by a run that failed is the attribute ``dataset`` of the exception.
    """
    pair = files_of(vehicle), Path(track)
    name = scheme if isinstance(scheme, str) else None
    chosen, owner = choice_of(name, None, owners(*pair))
    travel = travel_of(speed)
    travel.check_covers(time)
    if not isinstance(irregularity, Profile):
        way = float(travel.gone(time))
        irregularity = named(irregularity, way, spatial=moves_aside(pair[1]))
    journey = Journey(
        speed=float(travel.speed(0.0)), held=held, profile=irregularity, position=position,
        defects=defects_of(defects), travel=travel,
    )  # fmt: skip
    course = Course(
        scheme=scheme_of(chosen) if scheme is None or isinstance(scheme, str) else scheme,
        step=usual_step(chosen, owner) if step is None else step,
        stop=time,
        tolerance=tolerance,
    )
    made = *pair, contact_of(contact), journey
    return judged(lambda change: run_pair(*made, change(course), progress))
