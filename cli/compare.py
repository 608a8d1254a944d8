"""railcosim compare: coupled FMUs against one monolithic system."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, TypeAlias

import numpy as np
import typer
from numpy.typing import NDArray
from rich.table import Table

from railcosim.analysis.catalogue import FMUS, Owner
from railcosim.analysis.frequency import Models, coupled, linear_models, response
from railcosim.analysis.pair import FORCES, Journey
from railcosim.analysis.ring import check_frequencies_of
from railcosim.analysis.time_run import run_pair
from railcosim.analysis.verdict import DISAGREE, NotBelievedError
from railcosim.master.component import FloatArray
from railcosim.master.course import Course, count_steps
from railcosim.master.linear.realisation import ComplexArray
from railcosim.reference.agreement import near, relative_rms
from railcosim.reference.monolithic import Monolithic, assemble, frequency_response
from railcosim.reference.newmark import newmark
from railcosim.track.irregularity.named import irregularity as named
from railcosim.vehicle.contact import LinearContact

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
    choice_of,
    maker_of,
)
from .uncoupled import compare_uncoupled

Progress = Callable[[float, float], None]
REFINEMENT = (
    4  # Newmark's steps in a communication step: its error is then a hundredth of a per cent
)
FINE = 6000  # frequencies on which antiresonances are looked for
WEAK = 1e-3  # of the largest displacement (or force) at that frequency
# Excitation and output to errors and whether the response is not weak, by frequency.
Errors: TypeAlias = dict[str, dict[str, tuple[FloatArray, NDArray[np.bool_]]]]
OBSERVED = {  # outputs of the coupled FMUs, and their rows among the monolithic unknowns
    "vehicle.carbody.z": "carbody.z",
    "vehicle.bogie[1].z": "bogie[1].z",
    "vehicle.bogie[2].z": "bogie[2].z",
    "vehicle.wheelset[1].left.wheel_z": "wheelset[1].z",
    "vehicle.wheelset[4].left.wheel_z": "wheelset[4].z",
}


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
    ours = np.stack([run[name].values for name in FORCES], axis=1)
    with progress("Newmark, monolithic") as update:
        reference = newmark_forces(mono, models.positions, k_H, journey, course, update)
    still = np.full(8, cars.wheel_load)
    wrong = relative_rms(ours, reference, still)
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


def newmark_forces(
    mono: Monolithic,
    positions: FloatArray,
    k_H: float,
    journey: Journey,
    course: Course,
    progress: Progress,
) -> FloatArray:
    """Contact forces (n, 8) of the monolithic system at the course's communication points."""
    heights = journey.profile.under(positions, journey.speed)
    steps = round(course.stop / course.step) * REFINEMENT
    forces = []
    march = newmark(
        mono, LinearContact(k_H=k_H), lambda t: positions, heights, course.step / REFINEMENT, steps
    )
    for k, instant in enumerate(march):
        if k % REFINEMENT == 0:
            forces.append(instant.force)
            progress(k, steps)
    return np.array(forces)


def frequency_errors(
    models: Models, mono: Monolithic, k_H: float, frequency: FloatArray, progress: Progress
) -> Errors:
    """Relative errors, NaN within 1 % of an antiresonance, and where the response is not weak."""
    fine = np.geomspace(frequency[0], frequency[-1], FINE)
    rails, positions = mono.rails(models.positions), models.positions
    on_wheelset = np.asarray(mono.wheels[[3]].toarray().T)
    on_rails = np.asarray(rails[[3, 7]].sum(axis=0))[:, None]
    solved = frequency_response(
        mono, 2 * np.pi * frequency, k_H, positions, np.hstack([on_wheelset, on_rails]), progress
    )
    compression = (mono.wheels - rails).toarray()
    found: Errors = {}
    for column, excitation in enumerate(("wheelset[4].force_z", "wheelset[4].rail_force_z")):
        system, dense = (coupled(models, 2 * np.pi * f, k_H) for f in (frequency, fine))
        ours, curve = (response(s, excitation, positions, 1.0) for s in (system, dense))
        direct = solved[:, :, column]
        references: dict[str, ComplexArray] = {
            output: direct[:, mono.coordinate(name)] for output, name in OBSERVED.items()
        }
        rail_z = direct @ rails.toarray().T
        force = k_H * direct @ compression.T
        for i in (1, 4):
            references[f"track.wheelset[{i}].left.rail_z"] = rail_z[:, i - 1]
            references[f"wheelset[{i}].left.force"] = force[:, i - 1]
        found[excitation] = {}
        for output, expected in references.items():
            row = system.rows([output])[0]
            error = np.abs(ours[:, row] / expected - 1)
            error[near(frequency, fine, curve[:, row])] = np.nan
            like = [r for name, r in references.items() if _is_force(name) == _is_force(output)]
            strong = np.abs(expected) > WEAK * np.abs(like).max(axis=0)
            found[excitation][output] = (error, strong)
    return found


def _short(output: str) -> str:
    """Without the component in front, which a contact force does not have."""
    return output if _is_force(output) else output.partition(".")[2]


def _is_force(output: str) -> bool:
    return output.endswith(".force")


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
