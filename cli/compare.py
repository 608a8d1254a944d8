"""railcosim compare: coupled FMUs against one monolithic system."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.table import Table

from railcosim.analysis.compare import (
    FINE,
    WEAK,
    Errors,
    frequency_errors,
    is_force,
    time_error,
)
from railcosim.analysis.pair.owner import FMUS, Owner
from railcosim.analysis.pair.pair import Journey
from railcosim.analysis.pair.ring import check_frequencies_of
from railcosim.analysis.pair.time_run import run_pair
from railcosim.analysis.pair.verdict import DISAGREE, NotBelievedError
from railcosim.analysis.response.frequency import linear_models
from railcosim.analysis.schemes.choice import choice_of, maker_of
from railcosim.master.component import FloatArray
from railcosim.master.course import Course, count_steps
from railcosim.mechanics.law import LinearContact
from railcosim.reference.monolithic import assemble
from railcosim.track.irregularity.named import irregularity as named

from .fmus import FreshOption, made
from .irregularity_options import (
    FadeOption,
    Irregularity,
    RepeatOption,
    SeedOption,
)
from .options import (
    ContactStiffness,
    Frequencies,
    Speed,
    TrackFile,
    VehicleFile,
    Vehicles,
    console,
    contact_parameters,
    doubted,
    frequencies_of,
    positive,
    progress,
    speed_of,
    stiffness_of,
    track_of,
    vehicle_of,
)
from .results import folder_of
from .scheme_options import (
    ContactOption,
    InputsOption,
    SchemeOption,
)
from .uncoupled import compare_uncoupled


def compare(
    vehicle: VehicleFile = None,
    vehicles: Vehicles = 1,
    track: TrackFile = None,
    fresh: FreshOption = False,
    contact_stiffness: ContactStiffness = "1e9",
    frequencies: Frequencies = "0.3:1500:60@log",
    scheme: SchemeOption = None,
    inputs: InputsOption = None,
    contact: ContactOption = None,
    step: Annotated[float, typer.Option(help="Communication step, s.")] = 1e-4,
    time: Annotated[float, typer.Option(help="How long, s.")] = 0.3,
    speed: Speed = 250.0,
    irregularity: Irregularity = "german-low",
    seed: SeedOption = None,
    fade: FadeOption = None,
    repeat: RepeatOption = False,
    uncoupled: Annotated[
        bool,
        typer.Option(
            "--uncoupled",
            help="Compare with simpler models instead: rigid track, no phase lag, rigid contact, "
            "no vehicle. Uses --frequencies, --speed and --contact-stiffness.",
        ),
    ] = False,
    out: Annotated[
        Path, typer.Option("--out", help="Folder for the page of --uncoupled.", metavar="DIR")
    ] = Path("railcosim-uncoupled"),
) -> None:
    """Compare coupled FMUs with the monolithic solution, in time and in frequency.

    Time: Newmark with steps four times shorter, wheels held, irregularity moving. Frequency: one
    direct solve of everything at each frequency.

    With --uncoupled: what each part of the coupling changes, and where it may be neglected.
    """
    if uncoupled:
        folder_of("--out", out)
    k_H = stiffness_of(contact_stiffness)
    chosen, owner = choice_of(scheme, contact)
    v = speed_of(speed)
    count_steps(
        0.0, positive("--time", time, "s"), doubted("--step", positive("--step", step, "s"))
    )
    profile = named(irregularity, v * time, seed=seed, fade=fade, repeat=repeat)
    frequency = frequencies_of(frequencies)
    cars = vehicle_of(vehicle, vehicles)
    rails = track_of(track, cars)
    with made(cars, rails, fresh=fresh) as fmus:
        with progress("linearising") as update:
            models = linear_models(fmus["Vehicle"], fmus["Track"], update)
        if uncoupled:
            check_frequencies_of(fmus["Track"], float(frequency[-1]))
            compare_uncoupled(models, _fine(frequency), k_H, v, out)
            return
        mono = assemble(cars, rails, models.positions)
        with progress("coupled FMUs in time") as update:
            names = FMUS[owner]
            pair = fmus[names[0]], fmus[names[1]], contact_parameters(contact_stiffness)
            journey = Journey(speed=v, held=True, profile=profile)
            course = Course(scheme=maker_of(chosen, inputs)(Owner.VEHICLE), step=step, stop=time)
            run, stopped = run_pair(*pair, journey, course, update)
            if stopped is not None:
                raise stopped
    with progress("Newmark, monolithic") as update:
        wrong = time_error(
            run, mono, models.positions, LinearContact(k_H=k_H), journey, course, update
        )
    console.print(
        f"contact force in time, {course.scheme.describe()}, step {step:g} s: relative RMS error "
        f"{wrong:.2e} of its dynamic part"
    )
    with progress("direct solves, monolithic") as update:
        errors = frequency_errors(models, mono, k_H, frequency, update)
    console.print(
        error_table(errors, f"Relative error of the coupled FRF, k_H = {k_H / 1e9:g} GN/m")
    )
    if not wrong <= DISAGREE:
        raise NotBelievedError(
            f"the coupled run is not to be believed: its contact forces are wrong by {wrong:.0%} "
            "of their dynamic part. Take a shorter --step or another --scheme"
        )


def _fine(frequency: FloatArray) -> FloatArray:
    """The same range as finely as resonances and third octaves need."""
    return np.geomspace(frequency[0], frequency[-1], max(FINE, frequency.size))


def _short(output: str) -> str:
    """Without the component in front, which a contact force does not have."""
    return output if is_force(output) else output.partition(".")[2]


def error_table(errors: Errors, title: str) -> Table:
    """Show the worst error of every output."""
    table = Table(
        title=f"{title}\nworst outside 1 % of antiresonances; in brackets: where the response is "
        f"above {WEAK:g} of the largest of its kind"
    )
    table.add_column("output", no_wrap=True)
    for excitation in errors:
        table.add_column(excitation, justify="right", no_wrap=True)
    for output in next(iter(errors.values())):
        cells = []
        for by_output in errors.values():
            error, strong = by_output[output]
            cells.append(
                f"{np.nanmax(error):.1e} ({np.nanmax(error, where=strong, initial=0):.1e})"
            )
        table.add_row(_short(output), *cells)
    return table
