"""Table and page: complete, self-contained, and rendered by a real browser."""

import csv
import importlib.util
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

from railcosim.paper.finding import Finding
from railcosim.paper.report import write_table
from railcosim.plots.chart import Chart, Curve, Map, Panel
from railcosim.plots.page import Section, counted, write_page

HERE = Path(__file__).parent
spec = importlib.util.spec_from_file_location("browser", HERE / "browser.py")
browser = importlib.util.module_from_spec(spec)
spec.loader.exec_module(browser)

FINDINGS = [
    Finding(figure="4", quantity="bounce", paper=0.7, ours=0.6975, unit="Hz", agrees=True,
            spatial=0.71145),
    Finding(figure="6", quantity="pitch <b> at k_H", paper=6.2, ours="no peak", unit="Hz",
            agrees=False, note="critically damped, a & b"),
    Finding(figure="23", quantity="plotted", paper="not printed", ours=33.0, unit="Hz"),
]  # fmt: skip
ROWS = [finding.row for finding in FINDINGS]


def charts():
    x = np.geomspace(1, 100, 50)
    curve = Panel(
        x_label="f (Hz)", y_label="y (m)", curves=(Curve(name="c", x=x, y=x),), x_log=True
    )
    plane = Map(x=x, y=x, z=np.outer(x, x), x_label="x (m)", y_label="y (m)", z_label="z (m)")
    return Chart(title="curves", rows=((curve, curve),)), Chart(title="map", rows=((plane,),))


@pytest.fixture
def page(tmp_path):
    first, second = charts()
    sections = [
        Section(heading="Figure 4: x < y", text="Seen.", chart=first, rows=ROWS[:2],
                files=("figure_4.png",)),
        Section(heading="Figure 7: map", text="Seen & said.", chart=second, rows=ROWS[2:]),
    ]  # fmt: skip
    path = tmp_path / "report.html"
    write_page(
        sections, path, title="T", intro="I", about={"mode": "<quick>"}, place="figure",
        columns=("paper", "ours", "in space"),
    )  # fmt: skip
    return path


def test_table(tmp_path) -> None:
    write_table(FINDINGS, tmp_path / "table.csv")
    with (tmp_path / "table.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == [
        "figure", "quantity", "paper", "ours", "unit", "relative_difference", "spatial",
        "spatial_difference", "note",
    ]  # fmt: skip
    assert rows[0]["relative_difference"] == "-0.00357"  # (0.6975 - 0.7) / 0.7 by hand
    assert rows[1]["relative_difference"] == ""
    assert (rows[0]["spatial"], rows[0]["spatial_difference"]) == ("0.71145", "0.02")  # 2 %
    assert rows[1]["spatial"] == ""
    assert rows[1]["note"] == "critically damped, a & b"


class Links(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []

    def handle_starttag(self, tag, attrs) -> None:
        self.found += [v for k, v in attrs if k in ("src", "href") and v]


def test_the_page_fetches_nothing(page) -> None:
    text = page.read_text()
    links = Links()
    links.feed(re.sub(r"<script.*?</script>", "", text, flags=re.DOTALL))
    assert "figure_4.png" in links.found
    assert not [link for link in links.found if "//" in link]
    assert not re.search(r"<script[^>]+src=", text)


def test_numpy_s_verdicts_count_as_well() -> None:
    """Six of 57 numbers that agree were told of in the terminal, and not on the page."""
    agrees = (True, np.bool_(True), np.bool_(False), None)
    rows = [replace(ROWS[0], agrees=one) for one in agrees]
    assert list(counted(rows).values()) == [2, 1, 1]


def test_text_is_escaped_and_disagreement_is_in_words(page) -> None:
    text = page.read_text()
    assert "Figure 4: x &lt; y" in text
    assert "pitch &lt;b&gt; at <i>k</i><sub>H</sub>" in text
    assert "&lt;quick&gt;" in text
    assert text.count("differs</span>") == 2  # under its figure, and among the differences
    assert "agrees</span>" in text
    assert "<th>in space</th>" in text
    assert "+2.00 %" in text


# 11 s of a browser.
@pytest.mark.slow
@pytest.mark.skipif(browser.CHROMIUM is None, reason="chromium is not installed")
def test_a_browser_shows_all_charts_and_has_no_complaint(page, tmp_path) -> None:
    dom, complaints = browser.render(page)
    assert complaints == []
    assert dom.count("js-plotly-plot") >= 2
    assert len(re.findall(r'<svg class="main-svg"', dom)) >= 2
    assert "<h2>Figure 7: map</h2>" in dom
    browser.screenshot(page, tmp_path / "page.png")
    from matplotlib.image import imread  # noqa: PLC0415 (only here)

    assert imread(tmp_path / "page.png").std() > 0.05  # not blank
