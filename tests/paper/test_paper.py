"""The paper as a user reproduces it, and the numbers that come out."""

import csv
import importlib.util
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from railcosim.cli.options import UsageError
from railcosim.cli.paper import figures_of
from railcosim.master.files import load
from railcosim.paper.reproduce import FIGURES

COMMAND = [sys.executable, "-c", "from railcosim.cli.main import run; run()"]
spec = importlib.util.spec_from_file_location("browser", Path(__file__).parent / "browser.py")
browser = importlib.util.module_from_spec(spec)
spec.loader.exec_module(browser)


def test_all_figures_are_there() -> None:
    assert sorted(FIGURES) == list(range(3, 24))


@pytest.mark.parametrize(
    ("text", "numbers"), [("3", [3]), ("7-9, 13", [7, 8, 9, 13]), ("", list(range(3, 24)))]
)
def test_figures_option(text, numbers) -> None:
    assert figures_of(text) == numbers


@pytest.mark.parametrize("text", ["2", "24", "x", "9-7", "3-", "3,,4"])
def test_figures_that_are_none(text) -> None:
    with pytest.raises(UsageError, match="--figures"):
        figures_of(text)


@pytest.fixture(scope="module")
def out(tmp_path_factory):
    folder = tmp_path_factory.mktemp("paper")
    done = subprocess.run(
        [*COMMAND, "paper", "--out", str(folder), "--quick"], env={**os.environ, "COLUMNS": "160"},
        capture_output=True, text=True, timeout=1800, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    (folder / "said.txt").write_text(done.stdout)
    return folder


@pytest.fixture(scope="module")
def table(out):
    with (out / "table.csv").open(newline="") as file:
        return {(row["figure"], row["quantity"]): row for row in csv.DictReader(file)}


# A minute: everything that `railcosim paper` does, once, for all tests below.
@pytest.mark.slow
def test_every_figure_has_its_files(out) -> None:
    for number in range(3, 24):
        for suffix in ("png", "svg", "nc"):
            assert (out / f"figure_{number}.{suffix}").stat().st_size > 1000
    data = load(out / "figure_7.nc")
    assert data["carbody.z_flexible"].dims == ("wavelength", "speed")
    assert data["carbody.z_flexible"].attrs["units"] == "m/m"


COUNTED = re.compile(r"(\d+)(?: of its numbers| numbers)? agree, (\d+) do not")


def test_documents_count_alike() -> None:
    root = Path(__file__).parents[2]
    counts = [COUNTED.findall((root / page).read_text()) for page in ("README.md", "docs/paper.md")]
    assert counts[0] == counts[1] != []


@pytest.mark.slow
def test_terminal_and_page_count_alike_and_say_that_it_was_quick(out) -> None:
    ((agree, differ),) = COUNTED.findall((out / "said.txt").read_text())
    page = (out / "report.html").read_text()
    assert f"<b>{agree}</b>agree" in page
    assert f'<b class="differs">{differ}</b>differ' in page
    assert page.index("Quick look") < page.index("<nav>")


# PAPER numbers that an independent model of the same parameters gives, with its spread.
@pytest.mark.slow
@pytest.mark.parametrize(
    ("figure", "quantity", "independent", "relative"),
    [
        ("4", "car body bounce, rigid track", 0.70, 0.01),
        ("4", "car body pitch, rigid track", 0.92, 0.01),
        ("4", "wheel on contact spring, rigid track", 93.5, 0.01),
        ("4", "wheel on track, f_w", 32.2, 0.02),
        ("5", "front bogie vertical, first peak", 0.76, 0.01),
        ("6", "rear bogie pitch, second peak, rigid track", 4.6, 0.01),
        ("6", "rear bogie pitch, second peak, flexible track", 5.3, 0.02),
        ("13", "rail, first peak, without vehicle", 53.0, 0.01),
        ("13", "rail, first peak, with vehicle", 32.1, 0.02),
        ("13", "rail, antiresonance, with vehicle", 95.0, 0.01),
        ("13", "pinned-pinned, mid-span, without vehicle", 1056.0, 0.005),
        ("22", "rail antiresonance, k_H 0.1 GN/m", 55.0, 0.01),
        ("22", "rail antiresonance, k_H 8 GN/m", 491.0, 0.005),
        ("23", "first resonance, k_H 0.1 GN/m", 27.9, 0.02),
        ("23", "first resonance, k_H 8 GN/m", 34.4, 0.02),
        ("text", "eq. 18: k_H at 79 kN", 1.298, 0.002),
        ("8", "critical speed, car body pitch, n = 1, rigid track", 105.1, 0.015),
    ],
)
def test_numbers(table, figure, quantity, independent, relative) -> None:
    """Within the independent model's last digit, or two per cent where the tracks' meshes differ.

    The last one is undamped there: damping lowers the peak by one per cent. Equation 18's 1.298
    comes from a coefficient of three digits, 3.02e7.
    """
    assert float(table[figure, quantity]["ours"]) == pytest.approx(independent, rel=relative)


@pytest.mark.slow
def test_time_and_frequency_domain_agree(table) -> None:
    """Half a second of nonlinear run: with four averages' worth of scatter, 2 to 4 dB."""
    for k_H in ("0.1", "1", "8"):
        row = table["3", f"wheel-rail force, time against frequency, {k_H} GN/m"]
        assert float(row["ours"]) < 5


@pytest.mark.slow
def test_disagreements_are_reported(table) -> None:
    """Force normalisation: higher, not lower; irregularity: the same."""
    forced = table["4", "bounce, flexible over rigid at the first peak, force"]
    assert float(forced["ours"]) == pytest.approx(6.4, rel=0.02)  # README's, from the demo
    irregular = table["4", "bounce, flexible over rigid at the first peak, irregularity"]
    assert float(irregular["ours"]) == pytest.approx(1.0, abs=0.01)
    assert "critically damped" in table["6", "rear bogie pitch, second peak, rigid track"]["note"]


@pytest.mark.slow
@pytest.mark.skipif(browser.CHROMIUM is None, reason="chromium is not installed")
def test_report_in_a_browser(out) -> None:
    dom, complaints = browser.render(out / "report.html")
    assert complaints == []
    assert dom.count('class="main-svg"') >= 21
    for number in range(3, 24):
        assert f"Figure {number}: " in dom
