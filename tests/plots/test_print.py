"""Pictures that can be printed: read in grey, with words that people use and that can be read."""

import itertools
import json
import re

import numpy as np
import pytest
import xarray as xr

from railcosim.plots.chart import Chart, Curve, Map, Mark, Panel
from railcosim.plots.names import called, owner, words_of
from railcosim.plots.outputs import outputs_chart
from railcosim.plots.picture import plt, save_picture
from railcosim.plots.results import receptance_chart
from railcosim.plots.screen import interactive
from railcosim.plots.stability import stability_chart
from railcosim.plots.style import looks, on_paper

X = np.geomspace(1, 1000, 200)


@pytest.fixture
def drawn(monkeypatch):
    """Draw a chart without a file; gives the figure."""
    kept = []
    monkeypatch.setattr("railcosim.plots.picture.plt.close", kept.append)

    def draw(chart):
        save_picture(chart)
        return kept[-1]

    yield draw
    monkeypatch.undo()
    plt.close("all")


def boxes(figure, axes):
    """Words written into axes, with where they stand (px)."""
    renderer = figure.canvas.get_renderer()
    return {t.get_text(): t.get_window_extent(renderer) for t in axes.texts if t.get_text()}


def check_apart(figure, axes):
    inside = axes.get_window_extent(figure.canvas.get_renderer())
    found = boxes(figure, axes)
    for (a, box_a), (b, box_b) in itertools.combinations(found.items(), 2):
        assert not box_a.overlaps(box_b), (a, b)
    for words, box in found.items():
        assert inside.x0 <= box.x0 <= box.x1 <= inside.x1, words
        assert inside.y0 <= box.y0 <= box.y1 <= inside.y1, words
    return found


def test_labels_do_not_overprint(drawn) -> None:
    """Critical points n = 2 and 3 of a map and its line's name; lines at 0.7 and 0.74 Hz."""
    x, y = np.linspace(0.1, 20, 60), np.linspace(10, 140, 60)
    plane = Map(
        x=x, y=y, z=np.outer(y, x), x_label="x (m)", y_label="y (km/h)", z_label="z (m)",
        curves=(Curve(name="0.71 Hz", x=x, y=2.5 * x + 12),),
        marks=tuple(
            Mark(label=f"n = {n}", x=x, y=12 + 2.5 * x)
            for n, x in enumerate((15.7, 7.85, 5.23, 3.93), 1)
        ),
    )  # fmt: skip
    marks = tuple(Mark(label=f"at {f} Hz", x=f) for f in (0.7, 0.74, 0.78, 198.0))
    line = Panel(
        x_label="f (Hz)", y_label="y", curves=(Curve(name="a", x=X, y=X),), marks=marks,
        x_log=True, x_range=(0.5, 200.0),
    )  # fmt: skip
    figure = drawn(Chart(title="", rows=((plane,), (line,))))
    of_map, of_line = (a for a in figure.axes if a.texts)
    assert set(check_apart(figure, of_map)) == {"0.71 Hz", *(f"n = {n}" for n in (1, 2, 3, 4))}
    assert len(check_apart(figure, of_line)) == 4


def test_legends_show_each_line_s_own_look_in_colour_and_in_grey(drawn) -> None:
    """One look for a name, in all panels; on paper and on the page."""
    names = [f"wheelset {k}, left" for k in range(1, 9)]

    def panel(some):
        curves = tuple(Curve(name=n, x=X, y=X) for n in some)
        return Panel(x_label="x (m)", y_label="y (m)", curves=curves)

    chart = Chart(title="", rows=((panel(names[:2]),), (panel(names[5:7]),), (panel(names),)))
    given = looks(chart)
    figure = drawn(chart)
    for axes, some in zip(figure.axes, (names[:2], names[5:7], names), strict=True):
        seen = {
            text.get_text(): line
            for text, line in zip(
                axes.get_legend().get_texts(), axes.get_legend().get_lines(), strict=True
            )
        }
        assert list(seen) == some
        greys = {(given[n].grey, given[n].dash) for n in some}
        assert len(greys) == len(some)
        for line in axes.lines:
            (name,) = (
                n
                for n, shown in seen.items()
                if shown.get_color() == line.get_color()
                and shown.get_linestyle() == line.get_linestyle()
                and shown._dash_pattern == line._dash_pattern
            )
            assert given[name].color == line.get_color()
    traces = re.findall(r'"line":\{"color":"(#\w+)","dash":"([^"]+)".*?"name":"([^"]+)"',
                        interactive(chart, "c"))  # fmt: skip
    assert len(traces) == 12
    for color, dash, name in traces:
        assert given[name].color == color
        assert (dash == "solid") == (not given[name].dash)


@pytest.mark.parametrize(
    ("name", "whose", "what"),
    [
        ("wheelset[1].left.force_z", "wheelset 1, left", "force, down"),
        ("track.wheelset[4].right.rail_y", "wheelset 4, right: rail", "to the right"),
        ("wheelset[2].left.wheel_vz", "wheelset 2, left: wheel", "velocity down"),
        ("vehicle[2].carbody.az", "vehicle 2, car body", "acceleration down"),
        ("vehicle.bogie[1].pitch", "bogie 1", "pitch"),
        ("wheelset[3].left.moment_x", "wheelset 3, left", "moment, roll"),
    ],
)
def test_names_of_things(name, whose, what) -> None:
    assert words_of(name) == (whose, what)


def test_what_is_none_of_ours_is_called_as_its_file_says() -> None:
    assert words_of("mass.x") is None
    assert words_of("wheelset[1].left.temperature") is None
    assert owner("wheelset[1].left") == "wheelset 1, left"
    about = {"long_name": "height of the mass"}
    both = xr.Dataset({"a.x": ("t", [0.0], about), "b.x": ("t", [0.0], about), "c": ("t", [0.0])})
    assert list(called(both, ["a.x"]).values()) == ["height of the mass"]
    assert list(called(both, ["a.x", "b.x", "c"]).values()) == [
        "height of the mass (a.x)", "height of the mass (b.x)", "c"
    ]  # fmt: skip


def test_phases_have_ticks_at_ninety_degrees_and_no_line_where_they_turn_over(drawn) -> None:
    turning = 1 / (1 - (X / 30) ** 2 + 0.1j) * np.exp(-1j * X / 50)
    chart = receptance_chart({"rail": (X, turning)}, "receptance (m/N)", "k_H")
    figure = drawn(chart)
    size, phase = figure.axes
    assert size.get_ylabel() == "|receptance| (m/N)"
    assert phase.get_ylabel() == "phase of receptance (°)"
    assert [t.get_text() for t in phase.get_yticklabels()] == ["−180", "−90", "0", "90", "180"]
    y = phase.lines[0].get_ydata()
    assert np.isnan(y).sum() >= 3
    assert np.nanmax(np.abs(np.diff(y))) <= 180
    assert figure.get_suptitle() == r"$k_\mathrm{H}$"


@pytest.mark.parametrize(("low", "high"), [(20, 55), (2e-5, 9e-5), (1, 1500), (1e-11, 1e-7)])
def test_labels_of_logarithmic_axes_are_enough_and_apart(drawn, low, high) -> None:
    x = np.geomspace(low, high, 50)
    panel = Panel(
        x_label="f (Hz)", y_label="y (m)", curves=(Curve(name="a", x=x, y=x),), x_log=True,
        y_log=True, x_range=(low, high), y_range=(low, high),
    )  # fmt: skip
    figure = drawn(Chart(title="", rows=((panel,),)))
    figure.draw_without_rendering()
    renderer = figure.canvas.get_renderer()
    for axis in (figure.axes[0].xaxis, figure.axes[0].yaxis):
        view = axis.get_view_interval()
        ticks = [t for t in axis.get_major_ticks() + axis.get_minor_ticks()
                 if t.label1.get_text() and view[0] <= t.get_loc() <= view[1]]  # fmt: skip
        assert len(ticks) >= 2
        seen = [tick.label1.get_window_extent(renderer) for tick in ticks]
        assert not any(a.overlaps(b) for a, b in itertools.combinations(seen, 2))


def test_a_value_that_a_logarithmic_axis_has_no_place_for_is_a_gap(drawn) -> None:
    y = np.where((X > 10) & (X < 20), 0.0, X)
    panel = Panel(x_label="", y_label="", curves=(Curve(name="a", x=X, y=y),), y_log=True)
    (axes,) = drawn(Chart(title="", rows=((panel,),))).axes
    placed = axes.yaxis.get_transform().transform(y)
    assert not np.isfinite(placed[y == 0]).any()


def test_outputs_of_far_sizes_have_panels_of_their_own() -> None:
    """A position of 30 m would make a line of a deflection of 1.5 mm."""
    metres = {"units": "m"}
    run = xr.Dataset(
        {
            "wheelset[1].position": ("time", [0.0, 30.0], metres),
            "wheelset[1].left.rail_z": ("time", [1.5e-3, 1.4e-3], metres),
            "wheelset[1].left.wheel_z": ("time", [1.9e-3, 0.0], metres),
            "at.rest": ("time", [0.0, 0.0], metres),
        },
        {"time": [0.0, 1.0]},
    )
    panels = [[c.name for c in row[0].curves] for row in outputs_chart(run).rows]
    assert panels == [
        ["wheelset 1, position"],
        ["wheelset 1, left: rail, down", "wheelset 1, left: wheel, down", "at.rest"],
    ]


def test_steps_at_one_stiffness_are_bars(drawn) -> None:
    """It drew empty axes: a curve through one point is none."""
    found = xr.Dataset(
        {
            "jacobi.track": ("k_H", [2e-4], {"units": "s"}),
            "jacobi.track.window[1].begin": ("k_H", [4e-4]),
            "jacobi.track.window[1].end": ("k_H", [6e-4]),
            "never.track": ("k_H", [0.0]),
            "always.track": ("k_H", [np.inf]),
        },
        {"k_H": [1e9]},
    )
    chart = stability_chart(found, longest=1e-2)
    ((panel,),) = chart.rows
    assert [words for _, words in panel.y_ticks] == ["never: none", "jacobi", "always"]
    stable, grows = panel.curves
    assert stable.x[np.isfinite(stable.x)][1::2] == pytest.approx([0.2, 10.0])  # ms
    assert grows.x[:2] == pytest.approx([0.4, 0.6])
    (axes,) = drawn(chart).axes
    assert len(axes.lines) == 2


def test_what_a_file_calls_its_variables_is_no_mathematics(drawn) -> None:
    assert on_paper("((m/s2)2/Hz)") == "((m/s²)²/Hz)"
    assert on_paper("at k_H 3 GN/m for $5 and $6") == r"at $k_\mathrm{H}$ 3 GN/m for \$5 and \$6"
    odd = "a$b$ \\frac _ ^ {"
    panel = Panel(x_label=odd, y_label=odd, curves=(Curve(name=odd, x=X, y=X),), title=odd)
    figure = drawn(Chart(title=odd, rows=((panel, panel),)))
    figure.draw_without_rendering()
    assert json.dumps(odd)[1:-1] in interactive(Chart(title=odd, rows=((panel,),)), "c")
