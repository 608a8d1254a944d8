"""One run in time of a system of anyone's FMUs, read from an SSP file."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path

import xarray as xr

from railcosim.master.cosimulation import LIMIT
from railcosim.master.course import OUTPUTS_ONLY, Course, Keeping
from railcosim.master.fmi.archive import FmuError
from railcosim.master.fmi.fmu import FmuComponent
from railcosim.master.fmi.loaded_fmu import LoadedFmu
from railcosim.master.progress import Progress
from railcosim.master.recorded_run import Stopped, recorded_run
from railcosim.master.schemes import Scheme
from railcosim.master.ssp import LoadedSystem, initialise, open_ssp
from railcosim.master.system import System

Change = Callable[[Course], Course]
"""In what a run that is made once more differs."""


def _nothing(fmus: Sequence[LoadedFmu]) -> None:
    """No further check."""


def run_ssp(
    path: Path,
    make_scheme: Callable[[str], Scheme],
    progress: Progress,
    *,
    step: float | None = None,
    time: float | None = None,
    load: Callable[..., LoadedFmu] = FmuComponent.load,
    keeping: Keeping = OUTPUTS_ONLY,
    tolerance: float | None = None,
    tolerance_fmu: float | None = None,
    limit: float = LIMIT,
    change: Change = lambda course: course,
    check: Callable[[Sequence[LoadedFmu]], None] = _nothing,
    held: ExitStack | None = None,
    variant: str | None = None,
    law: Path | None = None,
) -> tuple[xr.Dataset, Stopped]:
    """Run a system; also a run that stops early returns what was recorded, and why it stopped.

    What of the file is not in the system is told by warnings.

    Parameters
    ----------
    path : Path
        The ``.ssp`` file. The code in it is run.
    make_scheme : callable
        From the name of the file's first component, where the scheme asks who steps first.
    progress : callable
        Given the time and the end, s, now and then.
    step : float, optional
        Communication step, s; the file's if not given.
    time : float, optional
        How long from the file's start, s; to the file's end if not given.
    load : callable, optional
        Makes an FMU from a file and, by keyword, a name.
    keeping : Keeping, optional
        What is kept beyond outputs.
    tolerance : float, optional
        For steps chosen by an error estimate; `step` is then the longest.
    tolerance_fmu : float, optional
        Relative error that FMUs are asked to keep; that of their default experiments if not given.
    limit : float, optional
        Largest output, in its nominal values, that does not count as divergence.
    change : callable, optional
        Gives the course that is taken, from that of the options and the file.
    check : callable, optional
        Given all FMUs, initialised; may raise, or warn.
    held : ExitStack, optional
        Closes the FMUs when its owner wants; else they are closed before the results are returned.
    variant : str, optional
        Which of several system structures in the file, see `open_ssp`.
    law : Path, optional
        Between its FMUs, in the master; see `railcosim.master.law_file`.

    Returns
    -------
    Dataset
        All outputs but Strings at all communication points.
    exception or None
        What stopped the run early.

    Raises
    ------
    FmuError
        If the file is refused, or neither it nor the caller says step and end.
    CouplingError
        If the system cannot be coupled, or the law is wrong.
    """
    with ExitStack() as own:
        loaded = (held or own).enter_context(open_ssp(path, load=load, variant=variant, law=law))
        for note in loaded.notes:
            warnings.warn(f"{path}: {note}", stacklevel=2)
        start, stop, step = _experiment(path, loaded, step, time)
        system = System(loaded.components, loaded.connections)
        scheme = make_scheme(loaded.fmus[0].name)
        course = change(
            Course(
                scheme=scheme,
                step=step,
                start=start,
                stop=stop,
                tolerance=tolerance,
                tolerance_fmu=tolerance_fmu,
                limit=limit,
                keeping=keeping,
            )
        )
        if not initialise(system, loaded.fmus, *course.told):
            warnings.warn(
                f"{path}: initial values did not settle: outputs depend on each other in a circle "
                "in initialisation; the run begins with the last ones",
                stacklevel=2,
            )
        check(loaded.fmus)
        about: dict[str, str | float] = {"title": loaded.name}
        if law is not None:
            about["law"] = law.read_text(encoding="utf-8")
        for fmu in loaded.fmus:
            for name, value in loaded.starts[fmu.name].items():
                about[f"start {fmu.name}.{name}"] = (
                    value if isinstance(value, str) else float(value)
                )
            for key, text in fmu.description.as_attributes().items():
                about[f"{fmu.name} {key}"] = text
        return recorded_run(system, course, progress, about)


def _experiment(
    path: Path, loaded: LoadedSystem, step: float | None, time: float | None
) -> tuple[float, float, float]:
    """Start, stop and step, s: the caller's, else the file's."""
    if not loaded.fmus:
        raise FmuError(f"{path}: has no component in it")
    start = loaded.start or 0.0
    stop = loaded.stop if time is None else start + time
    step = loaded.step if step is None else step
    if stop is None:
        raise FmuError(f"{path}: does not say when to stop; give --time")
    if step is None:
        raise FmuError(f"{path}: does not say a communication step (SSP cannot); give --step")
    if not stop > start or not step > 0:
        raise FmuError(
            f"{path}: stops at {stop:g} s, with a step of {step:g} s; it must stop after its start "
            f"at {start:g} s, with a step > 0: give --time and --step"
        )
    return start, stop, step
