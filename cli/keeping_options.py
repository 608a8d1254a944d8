"""Options that guard a run and what it has computed."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from .options import UsageError, positive
from .results import claim
from .resuming import check_agreement, options_in, resumed

if TYPE_CHECKING:
    from railcosim.analysis.pair.several import Load
    from railcosim.master.course import Keeping

EVERY = 0.1  # s


@dataclass(frozen=True, kw_only=True)
class KeepingOptions:
    """What is kept of a run, and what is made of a result that is in doubt."""

    checkpoint: Annotated[
        Path | None,
        typer.Option("--checkpoint", help="File from which the run can be resumed.", metavar="F"),
    ] = None
    every: Annotated[
        float | None,
        typer.Option("--every", help=f"Simulated time between checkpoints, s; {EVERY:g}."),
    ] = None
    resume: Annotated[
        Path | None,
        typer.Option(
            "--resume",
            help="Go on from a checkpoint, with its options; a longer --time may be given.",
            metavar="F",
            is_eager=True,
            callback=resumed,
        ),
    ] = None
    isolate: Annotated[
        bool,
        typer.Option(
            "--isolate", help="Run each FMU in a process of its own: it may crash or hang."
        ),
    ] = False
    energy: Annotated[
        bool, typer.Option("--energy", help="Record the energy that the coupling creates.")
    ] = False
    believe: Annotated[
        bool,
        typer.Option(
            "--believe",
            help="Take a result that shows signs of an unstable coupling as it is, without "
            "repeating the run with shorter steps.",
        ),
    ] = False

    def keeping(self, context: typer.Context, out: Path) -> Keeping:
        """What is kept of the run; its files are there to be written."""
        from railcosim.master.checkpoint import CheckpointError, Checkpoints, results_of
        from railcosim.master.course import Keeping

        checkpoint, every = self.checkpoint, self.every
        if every is not None and checkpoint is None:
            raise UsageError(f"--every {every:g}: of what? Give --checkpoint FILE as well")
        if checkpoint is not None and results_of(checkpoint).absolute() == out.absolute():
            raise UsageError(
                f"--out {out}: is where --checkpoint {checkpoint} keeps its rows; take another name"
            )
        if self.energy and (checkpoint or self.resume):
            raise UsageError("--energy: is not kept in checkpoints; leave out one of the two")
        interval = EVERY if every is None else positive("--every", every, "s")
        checkpoints = None
        if self.resume is not None:
            check_agreement(context, self.resume)
        if checkpoint is not None:
            checkpoints = Checkpoints(checkpoint, interval, options_in(context))
            try:
                claim(checkpoints.claimed())
            except CheckpointError as error:
                raise UsageError(f"--checkpoint {error}") from error
        return Keeping(checkpoints=checkpoints, resume=self.resume, energy=self.energy)

    @property
    def load(self) -> Load:
        """How FMUs are loaded."""
        from railcosim.master.fmi.fmu import FmuComponent
        from railcosim.master.fmi.isolation import IsolatedComponent

        return IsolatedComponent.load if self.isolate else FmuComponent.load
