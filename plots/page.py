"""A page to look at: charts to play with, a table under each; nothing is fetched from elsewhere."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from jinja2 import Environment, PackageLoader
from markupsafe import Markup, escape

from railcosim.storage.whole import write_whole

from .chart import Chart
from .screen import interactive, plotly_script
from .style import on_screen


class Judged(Protocol):
    """What may agree, differ, or have nothing to be compared with."""

    @property
    def agrees(self) -> bool | None:
        """None where there is nothing to judge."""


VERDICTS = {True: "agrees", False: "differs", None: "nothing to compare with"}


@dataclass(frozen=True, kw_only=True)
class Row:
    """Two values side by side, or three.

    Attributes
    ----------
    place : str
        Where it belongs.
    quantity : str
        What it is.
    first, second : float or str
        A number, or words where there is none.
    unit : str
        Of both; "1" for a ratio.
    note : str
        A reason, or how it was found.
    agrees : bool or None
        None where there is nothing to judge.
    third : float or str or None
        Another value of the second's kind, if there is one.
    """

    place: str
    quantity: str
    first: float | str
    second: float | str
    unit: str
    note: str = ""
    agrees: bool | None = None
    third: float | str | None = None

    @property
    def relative_difference(self) -> float | None:
        """(second - first) / first, of two numbers."""
        return _change(self.first, self.second)

    @property
    def change(self) -> float | None:
        """(third - second) / second, of two numbers."""
        return _change(self.second, self.third)


def _change(first: float | str, second: float | str | None) -> float | None:
    if second is None or isinstance(first, str) or isinstance(second, str):
        return None
    return (second - first) / first


@dataclass(frozen=True, kw_only=True)
class Section:
    """One part of a page.

    Attributes
    ----------
    heading, text : str
        What it is; one or two sentences on what is seen.
    chart : Chart or None
        Interactive.
    rows : sequence of Row
        The table under it.
    files : sequence of str
        Beside the page, to be linked.
    """

    heading: str
    text: str
    chart: Chart | None = None
    rows: Sequence[Row] = ()
    files: Sequence[str] = ()


def write_page(
    sections: Sequence[Section],
    path: Path,
    *,
    title: str,
    intro: str,
    about: Mapping[str, str],
    place: str,
    columns: tuple[str, ...],
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
    place : str
        Heading of where rows belong.
    columns : tuple of str
        Headings of the tables' two or three columns of values.
    """
    environment = Environment(
        loader=PackageLoader("railcosim.plots", "."), autoescape=True, trim_blocks=True,
        lstrip_blocks=True,
    )  # fmt: skip
    environment.filters["number"] = number
    environment.filters["symbols"] = symbols
    rows = [row for section in sections for row in section.rows]
    counts = counted(rows)
    # Charts are HTML made by plotly from our numbers; everything else is escaped.
    charts = [
        Markup(interactive(s.chart, f"chart-{k}")) if s.chart else ""
        for k, s in enumerate(sections)
    ]
    page = environment.get_template("page.html.j2").render(
        sections=list(zip(sections, charts, strict=True)), title=title, intro=intro, about=about,
        counts=counts, columns=columns, place=place,
        differing=[row for row in rows if verdict(row) == VERDICTS[False]],
        script=Markup(plotly_script()),
    )  # fmt: skip
    write_whole(path, page)


def counted(rows: Iterable[Judged]) -> dict[str, int]:
    """How many there are of each verdict: the one count, wherever it is told."""
    found = Counter(map(verdict, rows))
    return {word: found[word] for word in VERDICTS.values()}


def verdict(row: Judged) -> str:
    """One of `VERDICTS`, also where numpy said it: its True is not Python's."""
    return VERDICTS[None if row.agrees is None else bool(row.agrees)]


def symbols(text: str) -> Markup:
    """Words, escaped, with symbols and units set as in charts."""
    return Markup(on_screen(str(escape(text))))


def number(value: float | str | None, digits: int = 4) -> str:
    """A value for people; words as they are."""
    if value is None:
        return ""
    return value if isinstance(value, str) else f"{value:.{digits}g}"
