"""Charts on paper and on screens."""

import json
import re
import warnings
from dataclasses import replace

import numpy as np
import pytest

from railcosim.plots.chart import Chart, Curve, Map, Mark, Panel
from railcosim.plots.picture import save_picture
from railcosim.plots.screen import POINTS, interactive, thinned
from railcosim.plots.style import looks, shown_range

X = np.geomspace(1, 1000, 400)


def panel(**more):
    curves = (
        Curve(name="one", x=X, y=1 / X),
        Curve(name="<two>", x=X, y=2 / X, dashed=True),
    )
    return Panel(x_label="frequency (Hz)", y_label="receptance (m/N)", curves=curves, **more)


@pytest.fixture
def chart():
    x, y = np.linspace(0.1, 20, 300), np.linspace(10, 400, 500)
    plane = Map(
        x=x, y=y, z=np.outer(y, x) ** 2, x_label="wavelength (m)", y_label="speed (km/h)",
        z_label="bounce (m/m)", curves=(Curve(name="0.7 Hz", x=x, y=2.5 * x + 10),),
        marks=(Mark(label="n = 1", x=15.7, y=40.0),),
    )  # fmt: skip
    marked = panel(x_log=True, y_log=True, marks=(Mark(label="here", x=30.0),), title="left")
    second = panel(second_x=("frequency (Hz)", 0.5))
    return Chart(title="everything", rows=((plane,), (marked, second)))


@pytest.mark.parametrize("suffix", ["png", "svg", "pdf"])
def test_pictures_are_drawn_without_a_warning(chart, tmp_path, suffix) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        save_picture(chart, tmp_path / f"a.{suffix}")
    assert (tmp_path / f"a.{suffix}").stat().st_size > 5000
    # The map's 150 000 cells are a picture inside, not 150 000 shapes.
    assert (tmp_path / f"a.{suffix}").stat().st_size < 1_000_000


def test_text_in_svg_is_text_and_the_file_reproducible(chart, tmp_path) -> None:
    save_picture(chart, tmp_path / "a.svg", tmp_path / "b.png")
    save_picture(chart, tmp_path / "c.svg")
    text = (tmp_path / "a.svg").read_text()
    assert "wavelength (m)" in text
    assert "&lt;two&gt;" in text
    assert text == (tmp_path / "c.svg").read_text()
    assert (tmp_path / "b.png").exists()


def test_stacked_panels_line_up_under_one_legend(monkeypatch, tmp_path) -> None:
    """Columns of the grid have the same edges, however wide numbers and legends beside them are."""
    kept = []
    monkeypatch.setattr("railcosim.plots.picture.plt.close", kept.append)
    curve = Curve(name="large", x=X, y=1e6 * X)
    large = Panel(x_label="frequency (Hz)", y_label="receptance (m/N)", curves=(curve, curve))
    rows = ((panel(), panel()), (panel(), panel()), (large, panel()))
    save_picture(Chart(title="stack", rows=rows, share_x=True), tmp_path / "a.png")
    (figure,) = kept
    axes = np.array(figure.axes).reshape(3, 2)
    edges = np.array([[(a.bbox.x0, a.bbox.x1) for a in row] for row in axes])
    np.testing.assert_allclose(edges, edges[[0, 0, 0]], atol=0.01)  # of a pixel
    legends = [[a.get_legend() is not None for a in row] for row in axes]
    assert legends == [[False, True], [False, False], [False, True]]  # the last has a third name


def test_roll_off_is_not_shown() -> None:
    steep = Curve(name="steep", x=X, y=X**-8.0)
    low, high = shown_range(Panel(x_label="", y_label="", curves=(steep,), y_log=True))
    assert low == pytest.approx(1e-6)  # of the top, which is 1
    assert high == pytest.approx(2)
    assert shown_range(panel()) is None


@pytest.mark.parametrize("log", [False, True])
def test_thinning_keeps_peaks(log) -> None:
    """Of 200 000 points some thousand stay, among them the one that sticks out."""
    x = np.linspace(0, 100, 200_001)
    y = np.sin(x)
    y[123_457] = 9.0
    x2, y2 = thinned(x, y, log=log)
    assert y2.max() == 9
    assert x2[np.argmax(y2)] == x[123_457]
    assert x2.size <= POINTS + 2
    assert (np.diff(x2) > 0).all()
    if log:  # as fine at the low end as the data is
        assert np.isin(x[1:20], x2).all()


def test_interactive_chart_holds_all_curves(chart) -> None:
    html = interactive(chart, "chart-1")
    assert 'id="chart-1"' in html
    assert "<script src" not in html
    names = set(re.findall(r'"name":("(?:[^"\\]|\\.)*")', html))
    assert {"one", "<two>", "0.7 Hz"} <= {json.loads(name) for name in names}
    assert "here" in html
    assert "n = 1" in html
    assert len(html) < 2_000_000


def test_of_more_curves_than_colours_no_two_look_alike() -> None:
    """Eight wheelsets of a train: the first and the eighth have one colour."""
    many = replace(panel(), curves=tuple(Curve(name=f"{k}", x=X, y=X) for k in range(30)))
    found = looks(Chart(title="", rows=((many,),))).values()
    assert len({(look.color, look.dash) for look in found}) == 30
    assert len({(look.grey, look.dash) for look in found}) == 30  # on paper without colours
    first = list(found)[:7]
    assert len({look.dash for look in first}) == 7
    greys = np.array([look.grey for look in first])
    assert np.abs(np.diff(greys)).min() > 0.03  # and neighbours in the legend
