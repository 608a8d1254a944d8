"""railcosim run-system."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .conclusion import concluded
from .keeping_options import KeepingOptions
from .option_types import LawOption, Out, PlotFile
from .options import UsageError
from .results import PICTURES, RESULTS
from .resuming import told_how_to_resume
from .scheme_options import CourseOptions

USUAL = "jacobi"


def run_system(
    *,
    system: Annotated[
        Path,
        typer.Argument(
            help="A system of FMUs, SSP 1.0 or 2.0. Their code is run.", metavar="F.ssp"
        ),
    ],
    out: Out,
    variant: Annotated[
        str | None,
        typer.Option(help="Which of several system structures in the file, by its name."),
    ] = None,
    law: LawOption = None,
    course: CourseOptions,
    keeping: KeepingOptions,
    plot: PlotFile = None,
    context: typer.Context,
) -> None:
    """Run any system of FMUs, from an SSP file, coupled in time.

    A run with signs of an unstable coupling is repeated with shorter steps, and fails if they do
    not confirm it.
    """
    from railcosim.analysis.pair.ring import check_rings_of
    from railcosim.analysis.schemes.choice import maker_of
    from railcosim.master.schemes.catalogue import CATALOGUE
    from railcosim.master.system_run import run_ssp
    from railcosim.plots.outputs import outputs_chart

    RESULTS.check(out)
    PICTURES.check(plot)
    course.check()
    kept = keeping.keeping(context, out)
    chosen = course.scheme or USUAL
    if CATALOGUE[chosen].solves_law and law is None:
        raise UsageError(
            f"--scheme {chosen}: solves a law in the master, and a system in a file has none; give "
            "it one by --law, or take another"
        )
    make_scheme = maker_of(chosen, course.inputs, course.first)
    with told_how_to_resume(context, keeping.checkpoint):
        concluded(
            lambda update, change, held: run_ssp(
                system, make_scheme, update, step=course.step, time=course.time,
                load=keeping.load, keeping=kept, tolerance=course.tolerance,
                tolerance_fmu=course.tolerance_fmu, limit=course.largest, change=change,
                check=check_rings_of, held=held, variant=variant, law=law,
            ),
            out, plot, outputs_chart, believe=keeping.believe,
        )  # fmt: skip
