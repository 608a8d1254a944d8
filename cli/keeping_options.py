"""Options that guard a run and what it has computed."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from railcosim.analysis.pair import Load
from railcosim.analysis.recorded_run import Keeping
from railcosim.master.checkpoint import Checkpoints
from railcosim.master.fmi.fmu import FmuComponent
from railcosim.master.fmi.isolation import IsolatedComponent

from .options import UsageError, positive

EVERY = 0.1  # s

CheckpointOption = Annotated[
    Path | None,
    typer.Option("--checkpoint", help="File from which the run can be resumed.", metavar="F"),
]
EveryOption = Annotated[
    float | None,
    typer.Option("--every", help=f"Simulated time between checkpoints, s; {EVERY:g}."),
]
ResumeOption = Annotated[
    Path | None,
    typer.Option("--resume", help="Go on from a checkpoint; all else as before.", metavar="F"),
]
IsolateOption = Annotated[
    bool,
    typer.Option("--isolate", help="Run each FMU in a process of its own: it may crash or hang."),
]
EnergyOption = Annotated[
    bool, typer.Option("--energy", help="Record the energy that the coupling creates.")
]


def keeping_of(
    checkpoint: Path | None, every: float | None, resume: Path | None, energy: bool
) -> Keeping:
    """What is kept of a run, from the options."""
    if every is not None and checkpoint is None:
        raise UsageError(f"--every {every:g}: of what? Give --checkpoint FILE as well")
    if checkpoint is not None and not checkpoint.parent.is_dir():
        raise UsageError(f"--checkpoint {checkpoint}: there is no folder {checkpoint.parent}")
    if energy and (checkpoint or resume):
        raise UsageError("--energy: is not kept in checkpoints; leave out one of the two")
    interval = EVERY if every is None else positive("--every", every, "s")
    checkpoints = None if checkpoint is None else Checkpoints(checkpoint, interval)
    return Keeping(checkpoints=checkpoints, resume=resume, energy=energy)


def loader_of(isolate: bool) -> Load:
    """How FMUs are loaded."""
    return IsolatedComponent.load if isolate else FmuComponent.load
