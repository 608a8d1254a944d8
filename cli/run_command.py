"""railcosim run."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from railcosim.analysis.catalogue import FMUS, Owner
from railcosim.analysis.pair import Journey
from railcosim.analysis.ring import check_rings_of
from railcosim.analysis.roles import owners
from railcosim.analysis.time_run import run_pair
from railcosim.master.course import Course, count_steps
from railcosim.master.schemes.catalogue import CATALOGUE
from railcosim.master.system_run import run_ssp
from railcosim.plots.outputs import outputs_chart
from railcosim.track.irregularity.named import irregularity as named

from .conclusion import BelieveOption, concluded
from .fmus import FreshOption, fmus_of
from .irregularity_options import (
    FadeOption,
    Irregularity,
    RepeatOption,
    SeedOption,
)
from .keeping_options import (
    CheckpointOption,
    EnergyOption,
    EveryOption,
    IsolateOption,
    ResumeOption,
    keeping_of,
    loader_of,
)
from .options import (
    Out,
    PlotFile,
    Speed,
    TrackFmu,
    UsageError,
    VehicleFmu,
    contact_parameters,
    doubted,
    positive,
    speed_of,
)
from .results import PICTURES, RESULTS
from .resuming import keep_fmus, told_how_to_resume
from .scheme_options import (
    ContactOption,
    InputsOption,
    SchemeOption,
    choice_of,
    maker_of,
)

# Stable up to 8 GN/m and, with the contact in the vehicle, up to Hertz at the static load.
STEPS = {Owner.VEHICLE: 2e-5, Owner.TRACK: 1e-4, Owner.MASTER: 2e-5}


SOLVED = 1e-4  # stable at any step: this one for accuracy
TIME = 1.0  # s
OF_THE_PAIR = (
    "vehicle_fmu", "track_fmu", "contact", "contact_stiffness", "speed", "irregularity", "seed",
    "fade", "repeat", "held", "fresh",
)  # fmt: skip


def run(
    out: Out,
    system: Annotated[
        Path | None,
        typer.Argument(help="Any system of FMUs, SSP 1.0; our pair if not given.", metavar="F.ssp"),
    ] = None,
    vehicle_fmu: VehicleFmu = None,
    track_fmu: TrackFmu = None,
    fresh: FreshOption = False,
    scheme: SchemeOption = None,
    first: Annotated[
        str | None,
        typer.Option(help="Who steps first in gauss-seidel: vehicle, track, or as the SSP says."),
    ] = None,
    inputs: InputsOption = None,
    contact: ContactOption = None,
    contact_stiffness: Annotated[
        str,
        typer.Option(
            "--contact-stiffness",
            help="N/m: linear; hertz: nonlinear, may lose contact; hertz:N/m: tangent at rest.",
        ),
    ] = "hertz",
    step: Annotated[
        float | None,
        typer.Option(help="Communication step, s; else 1e-4 or 2e-5, by scheme and owner."),
    ] = None,
    time: Annotated[
        float | None, typer.Option(help="How long, s; 1, or what the SSP says.")
    ] = None,
    speed: Speed = 250.0,
    irregularity: Irregularity = "german-low",
    seed: SeedOption = None,
    fade: FadeOption = None,
    repeat: RepeatOption = False,
    held: Annotated[
        bool, typer.Option("--held", help="Hold the wheels and move the irregularity instead.")
    ] = False,
    tolerance: Annotated[
        float | None,
        typer.Option(help="Choose steps by an error estimate; --step is then the longest."),
    ] = None,
    checkpoint: CheckpointOption = None,
    every: EveryOption = None,
    resume: ResumeOption = None,
    isolate: IsolateOption = False,
    energy: EnergyOption = False,
    believe: BelieveOption = False,
    plot: PlotFile = None,
    context: typer.Context = None,  # type: ignore[assignment]  # typer gives it
) -> None:
    """Run a vehicle FMU and a track FMU coupled in time, or any system of FMUs in an SSP file.

    The pair starts from the static equilibrium of both. With the contact in the track, steps of
    0.1 ms are stable up to 8 GN/m; with the contact in the vehicle they must be shorter. Loss of
    contact can hide an unstable coupling: a run in which a wheel leaves the rail is repeated with
    shorter steps, and fails if they do not confirm it.
    """
    RESULTS.check(out)
    PICTURES.check(plot)
    for option, value in (("--step", step), ("--time", time)):
        if value is not None:
            positive(option, value, "s")
    if tolerance is not None and not 0.0 < tolerance < 1.0:
        raise UsageError(f"--tolerance {tolerance:g}: must be between 0 and 1, such as 1e-4")
    keeping = keeping_of(context, out, checkpoint, every, resume, energy)
    load = loader_of(isolate)
    if system is not None:
        _refuse(context, system, OF_THE_PAIR)
        chosen = scheme or "jacobi"
        if CATALOGUE[chosen].solves_law:
            raise UsageError(
                f"--scheme {chosen}: solves the contact of our pair, and a system in a file has "
                "none that the master owns; take another"
            )
        make_scheme = maker_of(chosen, inputs, first)
        with told_how_to_resume(checkpoint):
            concluded(
                lambda update, change: run_ssp(
                    system, make_scheme, update, step=step, time=time, load=load, keeping=keeping,
                    tolerance=tolerance, change=change, check=check_rings_of,
                ),
                out, plot, outputs_chart, believe=believe,
            )  # fmt: skip
        return
    chosen, owner = choice_of(scheme, contact, owners(vehicle_fmu, track_fmu))
    make_scheme = maker_of(chosen, inputs, first)
    if first not in {None, Owner.VEHICLE, Owner.TRACK}:
        raise UsageError(f"--first {first}: must be {Owner.VEHICLE} or {Owner.TRACK}")
    v = speed_of(speed)
    stop = TIME if time is None else time
    step = _step(chosen, owner) if step is None else step
    count_steps(0.0, stop, doubted("--step", step))
    parameters = contact_parameters(contact_stiffness)
    journey = Journey(
        speed=v,
        held=held,
        profile=named(irregularity, v * stop, seed=seed, fade=fade, repeat=repeat),
    )
    with fmus_of(vehicle_fmu, track_fmu, *FMUS[owner], fresh=fresh) as made:
        options = keeping.checkpoints.options if keeping.checkpoints else {}
        vehicle, track = keep_fmus(checkpoint, options, vehicle_fmu=made[0], track_fmu=made[1])
        course = Course(
            scheme=make_scheme(Owner.VEHICLE),
            step=step,
            stop=stop,
            tolerance=tolerance,
            keeping=keeping,
        )
        with told_how_to_resume(checkpoint):
            concluded(
                lambda update, change: run_pair(
                    vehicle, track, parameters, journey, change(course), update, load
                ),
                out,
                plot,
                believe=believe,
            )


def _refuse(context: typer.Context | None, system: Path, options: tuple[str, ...]) -> None:
    """Refuse options given on the command line that say nothing of a system in a file."""
    for name in options:
        source = context and context.get_parameter_source(name)
        if source and source.name == "COMMANDLINE":
            option = "--" + name.replace("_", "-")
            raise UsageError(f"{option}: is of our pair; {system} has its own FMUs. Leave it out")


def _step(scheme: str, owner: Owner) -> float:
    """The step (s) where the user gives none."""
    return SOLVED if CATALOGUE[scheme].solves_law else STEPS[owner]
