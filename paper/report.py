"""The figures as one page to look at, and their numbers as one table."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from jinja2 import Environment, PackageLoader
from markupsafe import Markup

from railcosim.plots.chart import Chart
from railcosim.plots.screen import interactive, plotly_script
from railcosim.storage.whole import write_whole, written_whole

from .finding import Finding

COLUMNS = ["figure", "quantity", "paper", "ours", "unit", "relative_difference", "note"]
VERDICTS = {True: "agrees", False: "differs", None: "nothing to compare with"}


@dataclass(frozen=True, kw_only=True)
class Section:
    """One part of a page.

    Attributes
    ----------
    heading, text : str
        What it is; one or two sentences on what is seen.
    chart : Chart or None
        Interactive.
    findings : sequence of Finding
        The table under it.
    files : sequence of str
        Beside the page, to be linked.
    """

    heading: str
    text: str
    chart: Chart | None = None
    findings: Sequence[Finding] = ()
    files: Sequence[str] = ()


def write_report(
    sections: Sequence[Section],
    path: Path,
    *,
    title: str,
    intro: str,
    about: Mapping[str, str],
    columns: tuple[str, str] = ("paper", "ours"),
) -> None:
    """Write a self-contained page: nothing in it is fetched from elsewhere.

    Parameters
    ----------
    sections : sequence of Section
        In the order of the page.
    path : Path
        The ``.html`` file.
    title, intro : str
        Its heading and first sentences.
    about : mapping of str to str
        What it was made from.
    columns : tuple of str
        Headings of the tables' two columns of values.
    """
    environment = Environment(
        loader=PackageLoader("railcosim.paper", "."), autoescape=True, trim_blocks=True,
        lstrip_blocks=True,
    )  # fmt: skip
    environment.filters["number"] = _number
    findings = [finding for section in sections for finding in section.findings]
    counts = {
        verdict: sum(finding.agrees is agrees for finding in findings)
        for agrees, verdict in VERDICTS.items()
    }
    # Charts are HTML made by plotly from our numbers; everything else is escaped.
    charts = [
        Markup(interactive(s.chart, f"chart-{k}")) if s.chart else ""
        for k, s in enumerate(sections)
    ]
    page = environment.get_template("report.html.j2").render(
        sections=list(zip(sections, charts, strict=True)), title=title, intro=intro, about=about,
        counts=counts, columns=columns, differing=[f for f in findings if f.agrees is False],
        script=Markup(plotly_script()),
    )  # fmt: skip
    write_whole(path, page)


def write_table(findings: Sequence[Finding], path: Path) -> None:
    """Write `COLUMNS` of all findings as CSV; numbers to six digits."""
    with (
        written_whole(path) as partial,
        partial.open("w", newline="", encoding="utf-8") as file,
    ):
        writer = csv.writer(file)
        writer.writerow(COLUMNS)
        for f in findings:
            writer.writerow(
                [f.figure, f.quantity, _number(f.paper), _number(f.ours, 6), f.unit,
                 _number(f.relative_difference, 3), f.note]
            )  # fmt: skip


def _number(value: float | str | None, digits: int = 4) -> str:
    if value is None:
        return ""
    return value if isinstance(value, str) else f"{value:.{digits}g}"
