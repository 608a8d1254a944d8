"""What is made of curves of several results, against answers by hand."""

import numpy as np
import pytest
import xarray as xr

from railcosim.analysis.overlay import (
    WAYS,
    InterpolatedWarning,
    difference,
    itself,
    lines_of,
    ratio,
    spectrum,
    third_octaves,
)
from railcosim.cli.plot_command import Way
from railcosim.parameters import ArgumentError

STEP = 1e-3


def run(name="force", unit="N", size=1.0, frequency=40.0, n=8000, step=STEP):
    t = step * np.arange(n)
    y = size * np.sin(2 * np.pi * frequency * t)
    return xr.Dataset({name: ("time", y, {"units": unit})}, {"time": ("time", t, {"units": "s"})})


def response(values, f, unit="m/N"):
    return xr.Dataset(
        {"rail": ("frequency", values, {"units": unit})},
        {"frequency": ("frequency", f, {"units": "Hz"})},
    )


def test_a_spectrum_holds_the_mean_square():
    """A sine of 3 N has 4.5 N^2, all of it at its frequency."""
    (line,) = spectrum(lines_of({"a": run(size=3.0)}, ["force"]))
    assert (line.unit, line.axis, line.x_unit) == ("N²/Hz", "frequency", "Hz")
    assert np.trapezoid(line.y, line.x) == pytest.approx(4.5, rel=1e-3)
    assert line.x[np.argmax(line.y)] == pytest.approx(40.0)
    assert "Welch" in line.words


def test_third_octaves_of_a_record_are_rms():
    (line,) = third_octaves(lines_of({"a": run(size=3.0)}, ["force"]))
    at = np.argmin(np.abs(line.x - 40.0))
    assert (line.unit, line.words) == ("N", "RMS in third octaves")
    assert line.y[at] == pytest.approx(np.sqrt(4.5), rel=1e-3)
    assert line.y[at - 3] < 1e-3 * line.y[at]


def test_third_octaves_of_a_response_are_quadratic_means_and_of_a_density_rms():
    f = np.linspace(1, 400, 4000)
    flat = response(np.full(f.size, 3 + 4j), f)
    (line,) = third_octaves(lines_of({"a": flat}, ["rail"]))
    assert line.y == pytest.approx(np.full(line.y.size, 5.0), rel=1e-4)
    assert line.unit == "m/N"
    density = response(np.full(f.size, 2.0), f, "(m/s2)2/Hz")
    (line,) = third_octaves(lines_of({"a": density}, ["rail"]))
    width = line.x * (10**0.05 - 10**-0.05)
    assert line.y == pytest.approx(np.sqrt(2 * width), rel=1e-4)
    assert line.unit == "m/s2"


def test_a_difference_is_on_the_first_one_s_places_and_says_so():
    """A ramp at other places is the same ramp; only what both cover is left."""
    x = {"a": np.linspace(0, 10, 41), "b": np.linspace(2, 14, 100)}
    results = {k: response(2 * f + (k == "b"), f) for k, f in x.items()}
    with pytest.warns(
        InterpolatedWarning, match="b is interpolated to the places of a, 2 to 10 Hz"
    ):
        (line,) = difference(lines_of(results, ["rail"]))
    assert (line.x[0], line.x[-1], line.x.size) == (2.0, 10.0, 33)
    assert line.y == pytest.approx(np.ones(33))
    assert line.words == "less a"


def test_results_that_do_not_meet_have_no_difference():
    results = {k: response(f, f) for k, f in (("a", np.arange(5.0)), ("b", np.arange(6.0, 9.0)))}
    with pytest.raises(ArgumentError, match="0 to 4 Hz in a and 6 to 8 Hz in b: they do not meet"):
        difference(lines_of(results, ["rail"]))
    with pytest.raises(ArgumentError, match="needs two results"):
        difference(lines_of({"a": results["a"]}, ["rail"]))


@pytest.mark.parametrize(("unit", "level"), [("m/N", 20.0), ("N2/Hz", 10.0)])
def test_a_ratio_is_a_level(unit, level):
    """Ten times as much: 20 dB of a size, 10 dB of a density; nowhere infinite."""
    f = np.linspace(1, 9, 9)
    a, b = np.ones(9), np.full(9, 10.0)
    a[4] = 0.0
    (line,) = ratio(lines_of({"a": response(a, f, unit), "b": response(b, f, unit)}, ["rail"]))
    assert line.unit == "dB"
    assert line.y[[0, 8]] == pytest.approx(level)
    assert np.isnan(line.y[4])


def test_steps_that_differ_are_made_even_and_it_is_said():
    one = run(size=3.0).isel(time=np.r_[0:4000, 4000:8000:2])
    with pytest.warns(InterpolatedWarning, match="steps differ"):
        (line,) = spectrum(lines_of({"a": one}, ["force"]))
    assert np.trapezoid(line.y, line.x) == pytest.approx(4.5, rel=2e-2)  # lines between samples


def test_points_of_a_sweep_are_curves():
    """Of many, eight, the first and the last among them."""
    f = np.linspace(1, 9, 9)
    values = np.arange(20.0)[:, None] * f
    swept = xr.Dataset(
        {"rail": (("stiffness", "frequency"), values, {"units": "m"})},
        {"frequency": ("frequency", f, {"units": "Hz"}), "stiffness": np.arange(20.0)},
    )
    with pytest.warns(UserWarning, match="8 of 20 curves"):
        lines = itself(lines_of({"a": swept}, ["rail"]))
    assert [lines[0].part, lines[-1].part] == ["stiffness 0", "stiffness 19"]
    assert lines[-1].y == pytest.approx(19 * f)


@pytest.mark.parametrize(
    ("results", "output", "message"),
    [
        ({"a": run(), "b": run(unit="kN")}, "force", "is in N in a and in kN in b"),
        ({"a": run(), "b": run()}, "forse", "forse: is not in a; all of them have force"),
        ({"a": run(), "b": run("other")}, "force", "is not in b; all of them have none"),
        (
            {"a": run("rail", "m/N"), "b": response(np.ones(3), np.arange(3.0))},
            "rail", "is over time in a and over frequency in b",
        ),
    ],
)  # fmt: skip
def test_what_does_not_go_together_is_refused(results, output, message):
    with pytest.raises(ArgumentError, match=message):
        lines_of(results, [output])


@pytest.mark.parametrize("way", [ratio, third_octaves, spectrum])
def test_a_level_has_a_difference_and_nothing_else(way):
    """40 dB over 20 dB are 20 dB more, not 6."""
    f = np.linspace(1, 9, 9)
    results = {"a": response(np.full(9, 20.0), f, "dB"), "b": response(np.full(9, 40.0), f, "dB")}
    lines = lines_of(results, ["rail"])
    assert difference(lines)[0].y == pytest.approx(20.0)
    if way is spectrum:
        lines = lines_of({"a": run(unit="dB")}, ["force"])
    with pytest.raises(ArgumentError, match="only a difference"):
        way(lines)


def test_third_octaves_are_not_taken_twice():
    centres = 10 ** (np.arange(10, 26) / 10)
    with pytest.raises(ArgumentError, match="in third octaves already"):
        third_octaves(lines_of({"a": response(np.ones(16), centres)}, ["rail"]))


def test_an_axis_that_goes_down_is_the_same_curve():
    f = np.linspace(1, 9, 9)
    up, down = response(f, f), response(2 * f[::-1], f[::-1])
    (line,) = difference(lines_of({"a": up, "b": down}, ["rail"]))
    assert line.y == pytest.approx(f)


@pytest.mark.parametrize("spoil", [
    lambda one: one.assign_coords(time=one["time"] * np.nan),
    lambda one: one.assign_coords(time=one["time"] * 0.0),
    lambda one: one.isel(time=slice(0, 0)),
    lambda one: one.where(one["time"] != 0.5),
])  # fmt: skip
def test_a_record_that_is_none_is_refused(spoil):
    with pytest.raises(ArgumentError, match="finite"):
        third_octaves(lines_of({"a": spoil(run())}, ["force"]))


def test_the_command_names_all_ways():
    assert list(Way) == list(WAYS)
