"""What tells that something of some seconds is being done: bars, and a line."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

from railcosim.storage.interruption import noting

from .terminal import errors


@contextmanager
def progress(text: str) -> Iterator[Callable[[float, float], None]]:
    """A progress bar on standard error; the callable takes what is done and the total.

    Ctrl-C is obeyed at the next call; see `noting`.
    """
    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn())
    bar = Progress(
        *columns, TimeRemainingColumn(), console=errors, transient=True,
        disable=not errors.is_terminal,  # else it leaves an empty line
    )  # fmt: skip
    with noting() as obey, bar:
        task = bar.add_task(text, total=None)

        def update(done: float, total: float) -> None:
            obey()
            bar.update(task, completed=done, total=total)

        yield update


@contextmanager
def foretelling(text: str) -> Iterator[Callable[[float, float], None]]:
    """A progress bar of work of some seconds: it is told before, and soon for how long."""
    from railcosim.master.progress import foretold

    errors.print(text)
    with progress(text) as update:
        yield foretold(update, lambda more: errors.print(f"{text}: {more}"))


@contextmanager
def status(text: str) -> Iterator[Callable[[str], None]]:
    """A line that tells what is being done."""
    with errors.status(text) as line:
        yield lambda now: line.update(f"{text}: {now}")
