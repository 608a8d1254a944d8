"""railcosim paper."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from .options import UsageError
from .progress import progress
from .results import folder_of
from .terminal import console

VISIBLE = 1e-3  # of a number: what a table of four digits shows

if TYPE_CHECKING:
    from railcosim.paper.finding import Finding


def paper(
    out: Annotated[Path, typer.Option("--out", help="Folder for everything.", metavar="DIR")],
    figures: Annotated[
        str, typer.Option("--figures", help="For instance 3,4,7-12; all of 3 to 23 if not given.")
    ] = "",
    quick: Annotated[
        bool, typer.Option("--quick", help="In half the time: coarser, short runs.")
    ] = False,
    in_space: Annotated[
        bool,
        typer.Option("--in-space", help="What the spatial model says beside it; twice the time."),
    ] = False,
) -> None:
    """Reproduce figures 3 to 23 of Xu & Lu (2021): pictures, data, table.csv and report.html.

    Runs in time (figure 3) are kept in the folder and not repeated.
    """
    from railcosim.paper.laboratory import FULL, QUICK
    from railcosim.paper.reproduce import reproduce

    begun = time.perf_counter()
    numbers = figures_of(figures)
    folder_of("--out", out)

    def tell(text: str) -> None:
        console.print(f"{time.perf_counter() - begun:5.0f} s  {text}")

    with progress("reproducing") as update:
        findings = reproduce(
            out, numbers, QUICK if quick else FULL, update, tell, in_space=in_space
        )
    console.print(_differences(findings))
    if in_space:
        console.print(_changes(findings))
    console.print(f"open {out / 'report.html'}")


def figures_of(text: str) -> list[int]:
    """Read ``3,4,7-12``; all if empty."""
    from railcosim.paper.reproduce import FIGURES

    if not text:
        return sorted(FIGURES)
    wanted: set[int] = set()
    for part in text.split(","):
        ends = part.split("-", 1)
        try:
            first, last = int(ends[0]), int(ends[-1])
        except ValueError as error:
            raise UsageError(f"--figures {text}: {part!r} is no number and no range") from error
        least, most = min(FIGURES), max(FIGURES)
        if not least <= first <= last <= most:
            raise UsageError(f"--figures {text}: there are figures {least} to {most}")
        wanted |= set(range(first, last + 1))
    return sorted(wanted)


def _differences(findings: list[Finding]) -> Table:
    """What does not agree, and how much does."""
    from railcosim.plots.page import VERDICTS, counted, verdict

    differing = [finding for finding in findings if verdict(finding) == VERDICTS[False]]
    n = counted(findings)
    table = Table(
        title=f"{n['agrees']} numbers agree, {n['differs']} do not, {n['nothing to compare with']} "
        "have none to compare with; these do not agree (reasons: report.html)"
    )
    table.add_column("figure")
    table.add_column("quantity")
    for name in ("paper", "ours", "unit"):
        table.add_column(name, justify="right")
    for f in differing:
        values = [v if isinstance(v, str) else f"{v:.4g}" for v in (f.paper, f.ours)]
        table.add_row(f.figure, f.quantity, *values, f.unit)
    return table


def _changes(findings: list[Finding]) -> Table:
    """What the spatial model changes."""
    told = [finding for finding in findings if finding.spatial is not None]
    moved = [one for one in told if abs(one.change_in_space or 0.0) > VISIBLE]
    moved += [one for one in told if one.change_in_space is None and one.spatial != one.ours]
    table = Table(
        title=f"In space {len(moved)} of {len(told)} numbers change by more than {VISIBLE:.1%}"
    )
    table.add_column("figure")
    table.add_column("quantity")
    for name in ("paper", "vertical", "spatial", "change", "unit"):
        table.add_column(name, justify="right")
    for f in moved:
        values = [v if isinstance(v, str) else f"{v:.4g}" for v in (f.paper, f.ours, f.spatial)]
        change = "" if f.change_in_space is None else f"{f.change_in_space:+.2%}"
        table.add_row(f.figure, f.quantity, *values, change, f.unit)
    return table
