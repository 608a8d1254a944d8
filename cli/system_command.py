"""railcosim run SYSTEM.ssp."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from railcosim.analysis.system_run import run_ssp
from railcosim.master.files import save
from railcosim.master.schemes import Scheme
from railcosim.plots.outputs import outputs_chart
from railcosim.plots.picture import save_picture

from .options import PICTURES, RESULTS, console, positive, progress


def run_system(
    path: Path,
    make_scheme: Callable[[str], Scheme],
    out: Path,
    *,
    first: str | None = None,
    step: float | None = None,
    time: float | None = None,
    plot: Path | None = None,
) -> None:
    """Run a system of FMUs, save and draw its outputs, also those of a run that failed.

    Parameters
    ----------
    path : Path
        The ``.ssp`` file.
    make_scheme : callable
        From the name of the component that steps first.
    out : Path
        Result.
    first : str, optional
        That name; the first component of the file if not given.
    step, time : float, optional
        Communication step, and how long, s; as the file says if not given.
    plot : Path, optional
        Picture.

    Raises
    ------
    UsageError, FmuError, CouplingError
        For what is wrong with the options, the file, the system.
    Divergence, ComponentError
        If the run failed; what it recorded has been saved.
    """
    RESULTS.check(out)
    PICTURES.check(plot)
    for option, value in (("--step", step), ("--time", time)):
        if value is not None:
            positive(option, value, "s")
    with progress("running") as update:
        dataset, stopped = run_ssp(path, make_scheme, update, first=first, step=step, time=time)
    save(dataset, out)
    console.print(f"{out}: {dataset.sizes['time']} communication points", highlight=False)
    if plot is not None:
        save_picture(outputs_chart(dataset), plot)
        console.print(str(plot), highlight=False)
    if stopped is not None:
        raise stopped
