"""railcosim run."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from railcosim.analysis.pair.owner import FMUS, Owner
from railcosim.analysis.pair.pair import Journey
from railcosim.analysis.pair.roles import owners
from railcosim.analysis.pair.time_run import run_pair
from railcosim.analysis.schemes.choice import choice_of, maker_of, usual_step
from railcosim.master.course import Course, count_steps
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
    errors,
    speed_of,
)
from .results import PICTURES, RESULTS
from .resuming import keep_fmus, told_how_to_resume
from .run_system_command import check_course, run_system
from .scheme_options import (
    ContactOption,
    InputsOption,
    SchemeOption,
)

TIME = 1.0  # s
OF_THE_PAIR = (
    "vehicle_fmu", "track_fmu", "contact", "contact_stiffness", "speed", "irregularity", "seed",
    "fade", "repeat", "held", "fresh",
)  # fmt: skip


def run(
    out: Out,
    system: Annotated[
        Path | None,
        typer.Argument(help="A system: see run-system.", metavar="F.ssp", hidden=True),
    ] = None,
    vehicle_fmu: VehicleFmu = None,
    track_fmu: TrackFmu = None,
    fresh: FreshOption = False,
    scheme: SchemeOption = None,
    first: Annotated[
        str | None,
        typer.Option(help="Who steps first in gauss-seidel: vehicle or track."),
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
    time: Annotated[float | None, typer.Option(help="How long, s; 1.")] = None,
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
    """Run a vehicle FMU and a track FMU coupled in time.

    They start from their static equilibrium. With the contact in the track, steps of
    0.1 ms are stable up to 8 GN/m; with the contact in the vehicle they must be shorter. Loss of
    contact can hide an unstable coupling: a run in which a wheel leaves the rail is repeated with
    shorter steps, and fails if they do not confirm it.
    """
    if system is not None:
        _refuse(context, system, OF_THE_PAIR)
        errors.print(f"note: a system has a command of its own: railcosim run-system {system}")
        run_system(
            system, out, scheme, first, inputs, step, time, tolerance, checkpoint, every, resume,
            isolate, energy, believe, plot, context,
        )  # fmt: skip
        return
    RESULTS.check(out)
    PICTURES.check(plot)
    check_course(step, time, tolerance)
    keeping = keeping_of(context, out, checkpoint, every, resume, energy)
    chosen, owner = choice_of(scheme, contact, owners(vehicle_fmu, track_fmu))
    make_scheme = maker_of(chosen, inputs, first)
    if first not in {None, Owner.VEHICLE, Owner.TRACK}:
        raise UsageError(f"--first {first}: must be {Owner.VEHICLE} or {Owner.TRACK}")
    v = speed_of(speed)
    stop = TIME if time is None else time
    step = usual_step(chosen, owner) if step is None else step
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
        load = loader_of(isolate)
        with told_how_to_resume(context, checkpoint):
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
