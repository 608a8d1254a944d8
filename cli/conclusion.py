"""The end of a run: what was computed is kept and judged, and the exit status says the verdict."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, TypeAlias

import typer
import xarray as xr

from railcosim.analysis.pair.verdict import NotBelievedError, Signs, Verdict, confirmed, signs_of
from railcosim.master.recorded_run import Progress, Stopped
from railcosim.master.system_run import Change
from railcosim.plots.chart import Chart
from railcosim.storage.interruption import finishing

from .options import progress
from .pair_charts import run_chart
from .results import ResultError, keep

CURE = (
    "Take a shorter --step, another --scheme or another owner of the contact (railcosim advise "
    "names them before running); --believe takes the result as it is"
)
Run: TypeAlias = Callable[[Progress, Change], tuple[xr.Dataset, Stopped]]
"""Makes the run, or makes it once more with a course that differs."""

BelieveOption = Annotated[
    bool,
    typer.Option(
        "--believe",
        help="Take a result that shows signs of an unstable coupling as it is, without repeating "
        "the run with shorter steps.",
    ),
]


def concluded(
    run: Run,
    out: Path,
    plot: Path | None,
    chart: Callable[[xr.Dataset], Chart] = run_chart,
    *,
    believe: bool = False,
) -> None:
    """Run, save and draw what was recorded, also of a run that failed; then say what it is worth.

    Raises
    ------
    NotBelievedError
        If the run shows signs of an unstable coupling and shorter steps do not confirm them.
    """
    with finishing():
        with progress("running") as update:
            dataset, stopped = run(update, lambda course: course)
        signs = signs_of(dataset)
        dataset.attrs["verdict"] = str(signs) or "no sign of an unstable coupling"
        if stopped is not None:
            dataset.attrs["verdict"] = f"stopped before its end; {dataset.attrs['verdict']}"
        try:
            keep(dataset, out, f"{dataset.sizes['time']} communication points", plot, chart)
        except ResultError:
            if stopped is None:
                raise
        if stopped is not None:
            raise stopped
        if not signs.texts:
            return
        if believe:
            warnings.warn(f"{signs}: not checked (--believe)", stacklevel=2)
            return
        warnings.warn(f"{signs}: repeating the run with shorter steps", stacklevel=2)
        verdict = _confirmed(dataset, signs, run)
        dataset.attrs["verdict"] = str(verdict)
        keep(dataset, out, str(verdict))
    if not verdict.believed:
        raise NotBelievedError(f"{out} is {verdict}. {CURE}")


def _confirmed(dataset: xr.Dataset, signs: Signs, run: Run) -> Verdict:
    """The verdict; what a repetition warns of has been said."""
    with progress("with shorter steps") as update, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return confirmed(
            dataset,
            signs,
            lambda factor, until: run(update, lambda course: course.again(factor, until)),
        )
