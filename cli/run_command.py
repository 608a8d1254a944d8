"""railcosim run."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from railcosim.analysis.pair.owner import FMUS, Owner

from .conclusion import concluded
from .irregularity_options import IrregularityOptions
from .keeping_options import KeepingOptions
from .option_types import (
    DimensionName,
    DimensionOption,
    LocalOption,
    Out,
    PlotFile,
    PositionsOption,
    ThenOption,
)
from .options import UsageError, contact_parameters, doubted, positions_of
from .results import PICTURES, RESULTS
from .resuming import keep_fmus, told_how_to_resume
from .run_system_command import run_system
from .scheme_options import ContactOption, CourseOptions
from .sensor_options import ObservedFmus
from .speed_option import SpeedOrFile, travel_of
from .system_options import refuse_of_pair
from .terminal import errors

if TYPE_CHECKING:
    from railcosim.master.course import Course, Keeping

TIME = 1.0  # s
OF_THE_PAIR = (
    "vehicle_fmu", "track_fmu", "vehicle", "vehicles", "track", "set_", "sensor", "contact",
    "contact_stiffness", "dimension", "local", "then", "position", "speed", "irregularity", "seed",
    "quantities", "fade", "repeat", "defect", "held", "fresh",
)  # fmt: skip


def run(
    *,
    out: Out,
    system: Annotated[
        Path | None,
        typer.Argument(help="A system: see run-system.", metavar="F.ssp", hidden=True),
    ] = None,
    given: ObservedFmus,
    course: CourseOptions,
    contact: ContactOption = None,
    contact_stiffness: Annotated[
        str,
        typer.Option(
            "--contact-stiffness",
            help="N/m: linear; hertz: nonlinear, may lose contact; hertz:N/m: tangent at rest.",
        ),
    ] = "hertz",
    dimension: DimensionOption = DimensionName.VERTICAL,
    local: LocalOption = None,
    then: ThenOption = None,
    position: PositionsOption = None,
    speed: SpeedOrFile = "250",
    rough: IrregularityOptions,
    held: Annotated[
        bool, typer.Option("--held", help="Hold the wheels and move the irregularity instead.")
    ] = False,
    keeping: KeepingOptions,
    plot: PlotFile = None,
    context: typer.Context,
) -> None:
    """Run a vehicle FMU and a track FMU coupled in time.

    They start from their static equilibrium. With the contact in the track, steps of
    0.1 ms are stable up to 8 GN/m; with the contact in the vehicle they must be shorter. Loss of
    contact can hide an unstable coupling: a run in which a wheel leaves the rail is repeated with
    shorter steps, and fails if they do not confirm it.
    """
    if system is not None:
        refuse_of_pair(context, system, OF_THE_PAIR)
        errors.print(f"note: a system has a command of its own: railcosim run-system {system}")
        run_system(
            system=system, out=out, course=course, keeping=keeping, plot=plot, context=context
        )
        return
    from railcosim.analysis.pair.numbering import files_of
    from railcosim.analysis.pair.pair import Journey
    from railcosim.analysis.pair.roles import moves_aside
    from railcosim.analysis.pair.time_run import run_pair

    from .pair_charts import run_chart

    RESULTS.check(out)
    PICTURES.check(plot)
    course.check()
    kept = keeping.keeping(context, out)
    aside = moves_aside(given.track_fmu) if given.track_fmu else dimension is DimensionName.SPATIAL
    fmus = given.vehicle_fmu or None, given.track_fmu
    owner, taken = _taken(course, contact, kept, fmus, aside=aside)
    travel = travel_of(speed, taken.stop)
    parameters = contact_parameters(contact_stiffness)
    journey = Journey(
        speed=float(travel.speed(0.0)),
        held=held,
        profile=rough.profile(float(travel.gone(taken.stop)), spatial=aside),
        position=positions_of(position, given),
        defects=rough.defects(),
        travel=travel,
    )
    journey.check_dimension(aside=aside)
    with given.fmus(*FMUS[owner], dimension=dimension, local=local, then=then) as made:
        options = kept.checkpoints.options if kept.checkpoints else {}
        cars, rails = keep_fmus(keeping.checkpoint, options, vehicle_fmu=made[0], track_fmu=made[1])
        vehicle, (track,) = files_of(cars), files_of(rails)
        with told_how_to_resume(context, keeping.checkpoint):
            concluded(
                lambda update, change, held: run_pair(
                    vehicle, track, parameters, journey, change(taken), update, keeping.load,
                    held,
                ),
                out, plot, run_chart, believe=keeping.believe,
            )  # fmt: skip


def _taken(
    options: CourseOptions,
    contact: Owner | None,
    keeping: Keeping,
    fmus: tuple[list[Path] | None, Path | None],
    *,
    aside: bool,
) -> tuple[Owner, Course]:
    """Who owns the contact, and how the run goes."""
    from railcosim.analysis.pair.roles import owners
    from railcosim.analysis.schemes.choice import choice_of, maker_of, usual_step
    from railcosim.analysis.schemes.usual import ASIDE, USUAL
    from railcosim.master.course import Course, count_steps

    usual = ASIDE if aside else USUAL
    chosen, owner = choice_of(options.scheme, contact, owners(*fmus), usual)
    make_scheme = maker_of(chosen, options.inputs, options.first)
    if options.first not in {None, Owner.VEHICLE, Owner.TRACK}:
        raise UsageError(f"--first {options.first}: must be {Owner.VEHICLE} or {Owner.TRACK}")
    step = usual_step(chosen, owner) if options.step is None else options.step
    stop = TIME if options.time is None else options.time
    count_steps(0.0, stop, doubted("--step", step))
    return owner, Course(
        scheme=make_scheme(Owner.VEHICLE), step=step, stop=stop,
        tolerance=options.tolerance, tolerance_fmu=options.tolerance_fmu,
        limit=options.largest, keeping=keeping,
    )  # fmt: skip
