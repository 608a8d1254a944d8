"""Options that guard a run and what it has computed."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from railcosim.analysis.pair.pair import Load
from railcosim.master.checkpoint import CheckpointError, Checkpoints, results_of
from railcosim.master.course import Keeping
from railcosim.master.fmi.fmu import FmuComponent
from railcosim.master.fmi.isolation import IsolatedComponent

from .options import UsageError, positive
from .results import claim
from .resuming import check_agreement, options_in, resumed

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
    typer.Option(
        "--resume",
        help="Go on from a checkpoint, with its options; a longer --time may be given.",
        metavar="F",
        is_eager=True,
        callback=resumed,
    ),
]
IsolateOption = Annotated[
    bool,
    typer.Option("--isolate", help="Run each FMU in a process of its own: it may crash or hang."),
]
EnergyOption = Annotated[
    bool, typer.Option("--energy", help="Record the energy that the coupling creates.")
]


def keeping_of(
    context: typer.Context,
    out: Path,
    checkpoint: Path | None,
    every: float | None,
    resume: Path | None,
    energy: bool,
) -> Keeping:
    """What is kept of a run, from the options; its files are there to be written."""
    if every is not None and checkpoint is None:
        raise UsageError(f"--every {every:g}: of what? Give --checkpoint FILE as well")
    if checkpoint is not None and results_of(checkpoint).absolute() == out.absolute():
        raise UsageError(
            f"--out {out}: is where --checkpoint {checkpoint} keeps its rows; take another name"
        )
    if energy and (checkpoint or resume):
        raise UsageError("--energy: is not kept in checkpoints; leave out one of the two")
    interval = EVERY if every is None else positive("--every", every, "s")
    checkpoints = None
    if resume is not None:
        check_agreement(context, resume)
    if checkpoint is not None:
        checkpoints = Checkpoints(checkpoint, interval, options_in(context))
        try:
            claim(checkpoints.claimed())
        except CheckpointError as error:
            raise UsageError(f"--checkpoint {error}") from error
    return Keeping(checkpoints=checkpoints, resume=resume, energy=energy)


def loader_of(isolate: bool) -> Load:
    """How FMUs are loaded."""
    return IsolatedComponent.load if isolate else FmuComponent.load
