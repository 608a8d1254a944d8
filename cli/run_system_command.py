"""railcosim run-system."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from railcosim.analysis.pair.ring import check_rings_of
from railcosim.analysis.schemes.choice import maker_of
from railcosim.master.schemes.catalogue import CATALOGUE
from railcosim.master.system_run import run_ssp
from railcosim.plots.outputs import outputs_chart

from .conclusion import BelieveOption, concluded
from .keeping_options import (
    CheckpointOption,
    EnergyOption,
    EveryOption,
    IsolateOption,
    ResumeOption,
    keeping_of,
    loader_of,
)
from .options import Out, PlotFile, UsageError, positive
from .results import PICTURES, RESULTS
from .resuming import told_how_to_resume
from .scheme_options import InputsOption, SchemeOption

USUAL = "jacobi"


def run_system(
    system: Annotated[
        Path, typer.Argument(help="A system of FMUs, SSP 1.0. Their code is run.", metavar="F.ssp")
    ],
    out: Out,
    scheme: SchemeOption = None,
    first: Annotated[
        str | None,
        typer.Option(help="Who steps first in gauss-seidel; the first in the file if not given."),
    ] = None,
    inputs: InputsOption = None,
    step: Annotated[
        float | None, typer.Option(help="Communication step, s; or what the SSP says.")
    ] = None,
    time: Annotated[float | None, typer.Option(help="How long, s; or what the SSP says.")] = None,
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
    """Run any system of FMUs, from an SSP file, coupled in time.

    A run with signs of an unstable coupling is repeated with shorter steps, and fails if they do
    not confirm it.
    """
    RESULTS.check(out)
    PICTURES.check(plot)
    check_course(step, time, tolerance)
    keeping = keeping_of(context, out, checkpoint, every, resume, energy)
    chosen = scheme or USUAL
    if CATALOGUE[chosen].solves_law:
        raise UsageError(
            f"--scheme {chosen}: solves the contact of our pair, and a system in a file has none "
            "that the master owns; take another"
        )
    make_scheme, load = maker_of(chosen, inputs, first), loader_of(isolate)
    with told_how_to_resume(context, checkpoint):
        concluded(
            lambda update, change: run_ssp(
                system, make_scheme, update, step=step, time=time, load=load, keeping=keeping,
                tolerance=tolerance, change=change, check=check_rings_of,
            ),
            out, plot, outputs_chart, believe=believe,
        )  # fmt: skip


def check_course(step: float | None, time: float | None, tolerance: float | None) -> None:
    """Raise UsageError if one of them cannot be."""
    for option, value in (("--step", step), ("--time", time)):
        if value is not None:
            positive(option, value, "s")
    if tolerance is not None and not 0.0 < tolerance < 1.0:
        raise UsageError(f"--tolerance {tolerance:g}: must be between 0 and 1, such as 1e-4")
