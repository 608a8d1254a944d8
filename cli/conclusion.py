"""The end of a run: what was computed is kept and judged, and the exit status says the verdict."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from railcosim.storage.interruption import finishing

from .progress import progress
from .results import ResultError, keep

if TYPE_CHECKING:
    import xarray as xr

    from railcosim.analysis.pair.judged import Change
    from railcosim.master.progress import Progress
    from railcosim.master.recorded_run import Stopped
    from railcosim.plots.chart import Chart

    Run: TypeAlias = Callable[[Progress, Change, ExitStack], tuple[xr.Dataset, Stopped]]
    """Makes the run, or makes it once more with a course that differs; what is to be closed after
    the results are kept goes to the stack."""

CURE = (
    "Take a shorter --step, another --scheme or another owner of the contact (railcosim advise "
    "names them before running); --believe takes the result as it is"
)


def concluded(
    run: Run,
    out: Path,
    plot: Path | None,
    chart: Callable[[xr.Dataset], Chart],
    *,
    believe: bool = False,
) -> None:
    """Run, save and draw what was recorded, also of a run that failed; then say what it is worth.

    Raises
    ------
    NotBelievedError
        If the run shows signs of an unstable coupling and shorter steps do not confirm them.
    """
    from railcosim.analysis.pair.judged import judged
    from railcosim.analysis.pair.verdict import NotBelievedError

    kept = 0
    held = ExitStack()  # FMUs: one that crashes when it is closed takes no results with it

    def make(change: Change) -> tuple[xr.Dataset, Stopped]:
        held.close()
        with progress("with shorter steps" if kept else "running") as update:
            return run(update, change, held)

    def put(dataset: xr.Dataset) -> None:
        nonlocal kept
        kept += 1
        if kept > 1:
            keep(dataset, out, dataset.attrs["verdict"])
            return
        # Of a run that failed, why it did is what is said in the end.
        with suppress(*([ResultError] if dataset.attrs["stopped"] != "no" else [])):
            keep(dataset, out, f"{dataset.sizes['time']} communication points", plot, chart)

    def doubt(text: str) -> None:
        warnings.warn(text, stacklevel=4)

    with finishing(), held:
        try:
            judged(make, believe=believe, keep=put, doubt=doubt)
        except NotBelievedError as error:
            said = str(error).removeprefix("the run ")
            raise NotBelievedError(f"{out} {said}. {CURE}") from error
