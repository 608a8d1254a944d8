"""railcosim demo: the main job on built-in data."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from .conclusion import concluded
from .export import exported
from .progress import progress
from .results import folder_of, keep
from .terminal import console

if TYPE_CHECKING:
    from railcosim.analysis.response.models import Models
    from railcosim.master.linear.realisation import ComplexArray
    from railcosim.master.linear.receptance import Response
    from railcosim.paper.finding import Finding


SPEED, STOP = 250 / 3.6, 1.0
NUMBERS = (4, 5, 6, 13)  # figures of the paper whose resonances are printed


def demo(
    out: Annotated[
        Path, typer.Option("--out", help="Folder for everything.", metavar="DIR")
    ] = Path("railcosim-demo"),
) -> None:
    """The whole job on the paper's vehicle and slab track, in half a minute to a minute.

    Exports the FMUs, runs them coupled at 250 km/h over a random irregularity, linearises each,
    couples them in the frequency domain, and prints the paper's resonances.
    """
    from railcosim.analysis.pair.pair import Journey
    from railcosim.analysis.pair.time_run import run_pair
    from railcosim.analysis.response.models import linear_models
    from railcosim.fmus.export import WITH_STATES
    from railcosim.master.course import Course
    from railcosim.master.schemes.jacobi import jacobi
    from railcosim.paper.laboratory import FULL, Laboratory
    from railcosim.paper.report import write_table
    from railcosim.paper.reproduce import FIGURES
    from railcosim.track.irregularity import synthesise
    from railcosim.track.parameters import Track
    from railcosim.vehicle.parameters import Vehicle

    from .pair_charts import run_chart

    begun = time.perf_counter()
    folder_of("--out", out)
    vehicle, track = Vehicle(), Track()
    fmus = exported(vehicle, track, out, WITH_STATES)
    _say(begun, f"four FMUs in {out}")
    pair = fmus["Vehicle"], fmus["TrackWithContact"], {"contact.nonlinear": True}
    journey = Journey(speed=SPEED, held=False, profile=synthesise("german-low", SPEED * STOP))
    course = Course(scheme=jacobi(degree=1), step=1e-4, stop=STOP)
    concluded(
        lambda update, change, held: run_pair(*pair, journey, change(course), update, held=held),
        out / "run.nc",
        out / "run.png",
        run_chart,
    )
    _say(begun, "coupled in time")
    with progress("linearising both FMUs") as update:
        models = linear_models(fmus["Vehicle"], fmus["Track"], update)
    _say(begun, "linearised")
    _frequency_results(models, out)
    lab = Laboratory(effort=FULL, models=models, vehicle=vehicle, track=track)
    findings = [f for number in NUMBERS for f in FIGURES[number](lab).findings if f.unit == "Hz"]
    write_table(findings, out / "table.csv")
    console.print(_table(findings))
    _say(begun, f"done; pictures, results and table are in {out}")


def _frequency_results(models: Models, out: Path) -> None:
    import numpy as np

    from railcosim.analysis.response.frequency import (
        apart,
        coupled,
        dataset,
        on_rigid_track,
        response,
    )
    from railcosim.paper.figure import RAIL, WHEEL
    from railcosim.paper.laboratory import K_H
    from railcosim.plots.picture import save_picture
    from railcosim.plots.results import receptance_chart

    from .pair_charts import response_chart

    frequency = np.geomspace(0.3, 1500, 1500)
    omega = 2 * np.pi * frequency
    systems = {
        "rigid track": on_rigid_track(models, omega, K_H),
        "coupled": coupled(models, omega, K_H),
        "apart": apart(models, omega),
    }
    values = {
        name: response(system, "wheelset[4].force_z", models.positions, SPEED)
        for name, system in systems.items()
    }
    on_rails = {
        name: response(systems[name], "wheelset[4].rail_force_z", models.positions, SPEED)
        for name in ("coupled", "apart")
    }
    frf = dataset(
        systems["coupled"], values["coupled"], models, "wheelset[4].force_z",
        contact_stiffness=K_H, title=f"unit force on wheelset 4, k_H {K_H / 1e9:g} GN/m",
    )  # fmt: skip
    keep(frf, out / "frf.nc", plot=out / "frf.png", chart=response_chart)
    curves = {
        "rail, without vehicle": (frequency, _of(systems["apart"], on_rails["apart"], RAIL)),
        "rail, with vehicle": (frequency, _of(systems["coupled"], on_rails["coupled"], RAIL)),
    }
    title = "rail at a railseat, unit force on each rail"
    save_picture(receptance_chart(curves, "receptance (m/N)", title), out / "rail.png")
    curves = {
        name: (frequency, _of(systems[name], values[name], WHEEL))
        for name in ("rigid track", "coupled")
    }
    title = "wheelset 4, unit force on it"
    save_picture(receptance_chart(curves, "receptance (m/N)", title), out / "wheel.png")


def _of(system: Response, values: ComplexArray, output: str) -> ComplexArray:
    column: ComplexArray = values[:, system.rows([output])[0]]
    return column


def _table(findings: list[Finding]) -> Table:
    noted = [finding for finding in findings if finding.note and not finding.agrees]
    notes = dict.fromkeys(f"* {finding.note}" for finding in noted)
    table = Table(
        title="Resonances from the FMUs (Hz), Xu & Lu 2021",
        caption="\n".join(
            [*notes, "railcosim paper holds all its figures and numbers against ours"]
        ),
    )
    table.add_column("quantity")
    for name in ("paper", "ours", "diff."):
        table.add_column(name, justify="right", no_wrap=True)
    for f in findings:
        ours = f.ours if isinstance(f.ours, str) else f"{f.ours:.3g}"
        relative = f.relative_difference
        difference = "" if relative is None else f"{100 * relative:+.1f} %"
        table.add_row(f.quantity + (" *" if f in noted else ""), str(f.paper), ours, difference)
    return table


def _say(begun: float, text: str) -> None:
    console.print(f"{time.perf_counter() - begun:5.0f} s  {text}")
