"""What a command writes: tried before anything is computed, and kept whatever happens then."""

from __future__ import annotations

import atexit
import os
import tempfile
import warnings
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from railcosim.storage.interruption import finishing
from railcosim.storage.lock import HeldError, held
from railcosim.storage.whole import TargetError, check_folder, check_target, why

from .options import UsageError
from .terminal import console

if TYPE_CHECKING:
    import xarray as xr

    from railcosim.plots.chart import Chart

_claimed = ExitStack()
"""Files that are this command's until it ends."""
atexit.register(_claimed.close)


def claim(files: AbstractContextManager[None]) -> None:
    """Hold files until the command ends."""
    _claimed.enter_context(files)


class ResultError(OSError):
    """A result is not where it was asked for; exit status 1."""


@dataclass(frozen=True)
class Suffixes:
    """What a file may be called."""

    option: str
    allowed: tuple[str, ...]

    def check(self, path: Path | None) -> None:
        """Raise UsageError if the file cannot be written, or another command is to write it."""
        if path is None:
            return
        if path.suffix not in self.allowed:
            raise UsageError(f"{self.option} {path}: must end in {' or '.join(self.allowed)}")
        try:
            check_target(path)
            claim(held(path))
        except (TargetError, HeldError) as error:
            raise UsageError(f"{self.option} {error}") from error


RESULTS = Suffixes("--out", (".nc", ".csv"))
PICTURES = Suffixes("--plot", (".png", ".svg", ".pdf"))


def folder_of(option: str, path: Path) -> Path:
    """A folder that an option names, made; UsageError if it cannot be written to."""
    try:
        check_folder(path)
    except TargetError as error:
        raise UsageError(f"{option} {error}") from error
    return path


def keep(
    result: xr.Dataset,
    out: Path | None,
    told: str = "",
    plot: Path | None = None,
    chart: Callable[[xr.Dataset], Chart] | None = None,
) -> None:
    """Save and draw a result and say so; what cannot be saved where it belongs is elsewhere.

    Ctrl-C waits for it.

    Parameters
    ----------
    result : Dataset
        What was computed.
    out, plot : Path or None
        Where it goes.
    told : str
        What of it is told.
    chart : callable, optional
        Makes the picture's chart of it.

    Raises
    ------
    ResultError
        If a file is not where it belongs. A note has said where it is.
    """
    from railcosim.master.files import save

    missing = []
    with finishing():
        if out is not None:
            try:
                save(result, out)
                console.print(f"{out}: {told}" if told else str(out))
            except (OSError, ValueError, MemoryError) as error:
                _keep_elsewhere(result, out, error)
                missing.append(out)
        if plot is not None and chart is not None:
            try:
                draw(chart(result), plot)
            except OSError as error:
                warnings.warn(f"{plot}: cannot be written ({why(error)})", stacklevel=2)
                missing.append(plot)
    if missing:
        raise ResultError(f"{' and '.join(map(str, missing))}: not written")


def draw(chart: Chart, path: Path) -> None:
    """Draw a picture, and say where it is."""
    # Here, since most commands run without a picture, and it loads matplotlib.
    from railcosim.plots.picture import save_picture

    save_picture(chart, path)
    console.print(str(path))


def _keep_elsewhere(result: xr.Dataset, out: Path, error: Exception) -> None:
    """Save where there is room, and say where."""
    from railcosim.master.files import save

    for place in _places():
        other = place / f"railcosim-{out.stem[:40]}-{os.getpid()}.nc"
        try:
            save(result, other)
        except (OSError, ValueError, MemoryError):
            continue
        found = f"the result is in {other}"
        break
    else:
        found = "nor could the result be kept in any other place"
    warnings.warn(f"{out}: cannot be written ({why(error)}); {found}", stacklevel=3)


def _places() -> Iterator[Path]:
    """Folders that most people can write to."""
    for find in (Path.cwd, Path.home, lambda: Path(tempfile.gettempdir())):
        try:
            yield find()
        except (OSError, RuntimeError):
            continue
