"""All figures of the paper: prepared, drawn, saved and put on one page."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path

from railcosim.master.files import save
from railcosim.master.parallel import Task, Workers
from railcosim.master.progress import Progress
from railcosim.plots.chart import Chart
from railcosim.plots.page import Section, write_page
from railcosim.plots.picture import save_picture

from . import maps, rail, random, stiffness, text, vehicle
from .figure import Figure
from .finding import Finding
from .laboratory import QUICK, Effort, Laboratory, prepare
from .report import write_table

FIGURES: dict[int, Callable[[Laboratory], Figure]] = {
    number: make
    for module in (random, vehicle, maps, rail, stiffness)
    for number, make in module.FIGURES.items()
}
TITLE = "Xu & Lu (2021) from two FMUs"
QUICK_LOOK = "quick look, with coarser maps, short runs in time, shorter pulses"
INTRO = (
    "Influence of track flexibility and spatial coherence of track irregularity on vehicle-slab "
    "track interaction, Int. J. Rail Transportation 9(4), 342-367, doi "
    "10.1080/23248378.2020.1811170. Every figure is made from a vehicle FMU and a track FMU: "
    "linearised and coupled in frequency, or run coupled in time. Hover for values, drag to zoom, "
    "double-click to return."
)


def reproduce(
    out: Path,
    numbers: Collection[int],
    effort: Effort,
    progress: Progress,
    tell: Callable[[str], None],
    *,
    in_space: bool = False,
) -> list[Finding]:
    """Reproduce figures of the paper into a folder.

    Each figure's files are complete before the next one is begun.

    Parameters
    ----------
    out : Path
        Folder, made if need be: ``figure_N.png``, ``.svg``, ``.nc``, ``table.csv``,
        ``report.html``, and the FMUs and runs they are made from.
    numbers : collection of int
        Figures wanted, keys of `FIGURES`.
    effort : Effort
        How fine.
    progress : callable
        Told what is done and the total, in s.
    tell : callable
        Told what was finished.
    in_space : bool
        Put the numbers of the spatial model beside ours, of all figures but those of runs in time.

    Returns
    -------
    list of Finding
        What was compared.
    """
    out.mkdir(parents=True, exist_ok=True)
    figures: list[Figure] = []

    def drawings(lab: Laboratory) -> Iterator[Task]:
        """Figures are computed here while others are drawn by the workers."""
        for number in sorted(numbers):
            figure = FIGURES[number](lab)
            _save_data(figure, out)
            figures.append(figure)
            arguments = (figure.chart, out, number)
            yield Task(name=figure.title, function=_draw, arguments=arguments, cost=1.0)

    with Workers(progress) as workers:
        lab = prepare(out, effort, midspan=13 in numbers, runs=3 in numbers, workers=workers)
        tell("FMUs linearised" + (" and run in time" if 3 in numbers else ""))
        for _ in workers.completed(drawings(lab), total=len(numbers)):
            pass
        tell("figures drawn")
        if in_space:
            spatial = prepare(
                out, effort, midspan=13 in numbers, runs=False, workers=workers, dimension="spatial"
            )
            figures = [_beside(figure, spatial) for figure in figures]
            tell("the same from the spatial model")
    general = text.findings(lab)
    findings = [*general, *(finding for figure in figures for finding in figure.findings)]
    write_table(findings, out / "table.csv")
    sections = [_section(figure, out) for figure in figures]
    sections.append(
        Section(
            heading="Text: contact stiffness",
            text="Numbers that the paper prints beside its figures.",
            rows=[finding.row for finding in general],
            files=("table.csv",),
        )
    )
    write_page(
        sections, out / "report.html",
        title=TITLE, intro=(f"{QUICK_LOOK.capitalize()}. " if effort is QUICK else "") + INTRO,
        about=_about(lab), place="figure",
        columns=("paper", "ours", "in space") if in_space else ("paper", "ours"),
    )  # fmt: skip
    tell("report written")
    return findings


def _beside(figure: Figure, spatial: Laboratory) -> Figure:
    """A figure whose findings have the spatial model's values; one of runs in time as it is."""
    if figure.number in random.FIGURES:
        return figure
    others = {one.quantity: one.ours for one in FIGURES[figure.number](spatial).findings}
    beside = [replace(one, spatial=others.get(one.quantity)) for one in figure.findings]
    return replace(figure, findings=tuple(beside))


def _draw(chart: Chart, out: Path, number: int, progress: Progress) -> None:
    save_picture(chart, *(out / f"figure_{number}.{suffix}" for suffix in ("png", "svg")))


def _save_data(figure: Figure, out: Path) -> None:
    save(figure.data, out / f"figure_{figure.number}.nc")
    if len(figure.data.dims) == 1:
        save(figure.data, out / f"figure_{figure.number}.csv")


def _section(figure: Figure, out: Path) -> Section:
    files = (f"figure_{figure.number}.{s}" for s in ("png", "svg", "nc", "csv"))
    return Section(
        heading=f"Figure {figure.number}: {figure.title}",
        text=figure.text,
        chart=figure.chart,
        rows=[finding.row for finding in figure.findings],
        files=tuple(name for name in files if (out / name).exists()),
    )


def _about(lab: Laboratory) -> dict[str, str]:
    return {
        "railcosim": version("railcosim"),
        "effort": QUICK_LOOK if lab.effort is QUICK else "full",
        "contact stiffness": "0.3 GN/m where the paper gives no other",
        "wheelset 4": "above a railseat (figure 13: also at mid-span)",
        **lab.models.attributes,
    }
