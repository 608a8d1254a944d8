"""railcosim view."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .options import UsageError
from .results import Suffixes
from .terminal import console

PAGES = Suffixes("--out", (".html",))
RUNS = (".nc", ".csv")


def view(
    run: Annotated[
        Path, typer.Argument(help="What railcosim run recorded: .nc or .csv.", metavar="RUN")
    ],
    out: Annotated[
        Path | None,
        typer.Option("--out", help="Page: .html; beside the run if not given.", metavar="FILE"),
    ] = None,
) -> None:
    """Write a page that plays a run: vehicle and rail from the side, contact forces.

    Open it in any browser, without a network. It plays as many points as a screen can show, and
    forces with all their peaks.
    """
    from railcosim.master.files import load
    from railcosim.plots.view import NothingToViewError, write_view

    page = out or run.with_suffix(".html")
    PAGES.check(page)
    if run.suffix not in RUNS:
        raise UsageError(f"{run}: must end in {' or '.join(RUNS)}")
    try:
        frames = write_view(load(run), page)
    except NothingToViewError as error:
        raise UsageError(f"{run}: {error}") from error
    except (OSError, ValueError) as error:
        raise UsageError(
            f"{run}: cannot be read: {getattr(error, 'strerror', None) or error}"
        ) from error
    console.print(f"{page}: {frames} frames; open it in a browser")
