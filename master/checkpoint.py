"""A run that survives the end of its process: written now and then, continued in another one."""

from __future__ import annotations

import math
import os
import warnings
from collections.abc import Generator, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from railcosim.master.checkpoint_file import CheckpointError, Content, read_checkpoint
from railcosim.master.component import ComponentError
from railcosim.master.cosimulation import CommunicationPoint, Cosimulation
from railcosim.master.journal import Journal, is_journal, read_journal
from railcosim.master.recording import Recorder
from railcosim.master.run_identity import About, difference, digest_of, identity_of
from railcosim.storage.lock import held
from railcosim.storage.whole import check_target

__all__ = [
    "CheckpointError", "CheckpointWarning", "Checkpoints", "options_of", "results_of", "resume",
]  # fmt: skip


class CheckpointWarning(UserWarning):
    """A checkpoint could not be written; the run goes on."""


@dataclass(frozen=True)
class Checkpoints:
    """Where and how often a run is written.

    Attributes
    ----------
    path : Path
        The file of the last checkpoint. What is recorded until then is beside it in
        ``PATH.nc``, which grows and can be opened at any time.
    every : float
        Simulated seconds between checkpoints, which are at communication points: not of the
        clock, so a run writes the same files each time.
    options : dict of str to what JSON can hold
        What whoever makes the run needs to make it again; see `options_of`.
    """

    path: Path
    every: float
    options: dict[str, Any] = field(default_factory=dict)
    _claims: list[Path] = field(default_factory=list, init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        if not (math.isfinite(self.every) and self.every > 0.0):
            raise ValueError(f"every must be positive and finite, got {self.every!r} s")

    def watch(
        self, run: Cosimulation, recorder: Recorder, about: About
    ) -> Generator[CommunicationPoint, None, None]:
        """Pass on the points of a run, and write a checkpoint at the first one and then `every` s.

        Both files are complete whenever the process is killed, and what came since the last
        checkpoint is all that is lost. They are held until the points end or are closed.

        Parameters
        ----------
        run : Cosimulation
            From the beginning, or after `resume`.
        recorder : Recorder
            To which each point is added before the next one is asked for.
        about : mapping of str to str or float
            As will be given to `resume`.

        Raises
        ------
        CheckpointError
            If a component cannot write its state, or as `claimed`.

        Warns
        -----
        CheckpointWarning
            If the files cannot be written, for instance on a full disk.
        """
        _check_able(run)
        identity = identity_of(run, about)
        with self.claimed():
            yield from self._watch(run, recorder, about, identity)

    @contextmanager
    def claimed(self) -> Iterator[None]:
        """Hold both files, as `watch` does while it lasts; it may be in such a block.

        Raises
        ------
        CheckpointError
            If another run holds them, they cannot be written, or are there and something else.
        """
        if self._claims:
            yield
            return
        results = results_of(self.path)
        with ExitStack() as stack:
            try:
                for path in (self.path, results):
                    check_target(path)
                if self.path.exists() and self.path.stat().st_size:
                    read_checkpoint(self.path)
                if results.exists() and not is_journal(results):
                    raise CheckpointError(f"{results}: not rows of a checkpoint")
                stack.enter_context(held(self.path))
            except CheckpointError as error:
                raise CheckpointError(
                    f"{error}; it is not replaced: take another name, or delete it"
                ) from error
            except OSError as error:
                raise CheckpointError(str(error)) from error
            self._claims.append(self.path)
            stack.callback(self._claims.clear)
            yield

    def _watch(
        self, run: Cosimulation, recorder: Recorder, about: About, identity: dict[str, str]
    ) -> Iterator[CommunicationPoint]:
        """Do what `watch` says."""
        journal: Journal | None = None
        due = -math.inf
        for point in run:
            yield point
            # Never at the end: the last step may be shorter, so a run to a later one differs.
            if point.time < due or point.time == run.stop:
                continue
            due = self.every * (math.floor(point.time / self.every) + 1)
            system = _system_state(run)
            try:
                if journal is None:
                    columns = recorder.to_dataset(about).isel(time=slice(0))
                    journal = Journal(
                        results_of(self.path), columns, digest_of(identity), recorder.rows()
                    )
                journal.append(recorder.rows(len(journal)))
                Content(
                    time=run.time,
                    seen=recorder.seen,
                    n_rows=len(recorder),
                    identity=identity,
                    system=system,
                    stepper=run.stepper.memory,
                    walk=run.walk.memory,
                    options=self.options,
                    threads=_threads(),
                    seals=journal.seals,
                ).write(self.path)
            except OSError as error:
                warnings.warn(
                    f"{self.path}: no checkpoint at t = {point.time:.9g} s ({error}); "
                    "the run goes on",
                    CheckpointWarning,
                    stacklevel=2,
                )


def results_of(path: Path) -> Path:
    """File of what was recorded up to the checkpoint `path`: netCDF 3."""
    return path.with_name(f"{path.name}.nc")


def options_of(path: Path) -> dict[str, Any]:
    """What was given as `Checkpoints.options`; CheckpointError as `resume` has it."""
    return dict(read_checkpoint(path).options)


def resume(path: Path, run: Cosimulation, recorder: Recorder, about: About) -> None:
    """Put a run where a checkpoint was written; it then goes on with the same bits.

    Parameters
    ----------
    path : Path
        Written by `Checkpoints`, with its results beside it.
    run : Cosimulation
        Made as it was then, not begun; its components initialised. It may have another end.
        (A pace that adapts its steps to the end gives the same bits only for the same one.)
    recorder : Recorder
        Made as it was then; it gets what was recorded before.
    about : mapping of str to str or float
        As it was then.

    Raises
    ------
    CheckpointError
        If a file is missing or damaged, or of a run that differs: in what.

    Warns
    -----
    CheckpointWarning
        If it was written with another number of BLAS threads.
    """
    there, here = read_checkpoint(path), identity_of(run, about)
    if there.identity != here:
        raise CheckpointError(f"{path}: of another run: {difference(there.identity, here)}")
    if not there.time < run.stop:
        raise CheckpointError(
            f"{path}: written at t = {there.time:.9g} s, but the run ends at {run.stop:.9g} s"
        )
    results = results_of(path)
    try:
        rows = read_journal(
            results, recorder.to_dataset(), digest_of(here), there.n_rows, there.seals
        )
    except (OSError, ValueError) as error:
        raise CheckpointError(f"{results}: cannot be used: {error}") from error
    try:
        run.system.restore_state(run.system.deserialize_state(there.system))
        run.stepper.memory, run.walk.memory = there.stepper, there.walk
    except (ComponentError, TypeError, ValueError, IndexError) as error:
        raise CheckpointError(f"{path}: does not fit the run: {error}") from error
    if there.threads != _threads():
        warnings.warn(
            f"{path}: written with BLAS threads: {there.threads}; here: {_threads()}. Sums may be "
            "rounded differently, so the bits of an uninterrupted run are not promised",
            CheckpointWarning,
            stacklevel=2,
        )
    recorder.resume(there.seen, rows)
    run.time = there.time


def _check_able(run: Cosimulation) -> None:
    """Refuse components whose state cannot be trusted: going on would give wrong results."""
    for component in run.system.components:
        fault = component.rollback_fault
        if fault is not None:
            raise CheckpointError(
                f"no checkpoint of this run is possible: {component.name} cannot go back to a "
                f"saved state: {fault}"
            )


def _system_state(run: Cosimulation) -> Any:
    """State of the components and of the exchange."""
    try:
        return run.system.serialize_state(run.system.save_state())
    except (ComponentError, ValueError) as error:  # FmuError is a ValueError
        raise CheckpointError(f"no checkpoint of this run is possible: {error}") from error


def _threads() -> str:
    """How many threads sums of BLAS are cut into, as far as its variables say."""
    names = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS")
    return next((os.environ[name] for name in names if os.environ.get(name)), "as many as cores")
