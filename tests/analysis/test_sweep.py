"""A sweep's dataset, its folder and its picture, of a function that costs nothing."""

import numpy as np
import pytest
import xarray as xr

from railcosim.analysis import sweep as module
from railcosim.analysis.joined import JoinError
from railcosim.analysis.sweep import sweep
from railcosim.cli.commands import loaded
from railcosim.cli.options import UsageError
from railcosim.cli.sweep_command import _axes
from railcosim.cli.sweep_point import blanks_in, filled, measured
from railcosim.parameters import ArgumentError
from railcosim.plots.sweep import sweep_chart

AXES = {"stiffness": [2.0, 4.0], "kind": ["soft", "stiff"]}
KNOWN = {"speed", "track", "contact-stiffness"}
called = []


def measure(stiffness, kind):
    called.append((stiffness, kind))
    if (stiffness, kind) == (4.0, "soft"):
        raise ValueError("too soft")
    f = np.array([1.0, 2.0]) if kind == "soft" else np.array([2.0, 3.0])
    H = xr.Variable("frequency", (1 + 1j) * stiffness * f, {"units": "m/N"})
    return xr.Dataset({"H": H, "n": 3}, {"frequency": f}, {"load": "both", "of": kind})


@pytest.fixture(autouse=True)
def here(monkeypatch):
    """In this process."""

    def measured(measure, names, points, scheduler, progress):
        return ((point, module._attempt(measure, names, point)) for point in points)

    called.clear()
    monkeypatch.setattr(module, "_measured", measured)


def test_is_one_dataset_with_nan_where_nothing_is(tmp_path):
    found = sweep(measure, AXES, tmp_path)
    H = found.dataset["H"]
    assert H.dims == ("stiffness", "kind", "frequency")
    assert found.failed == ["stiffness = 4, kind = soft: too soft"]
    assert np.isnan(H.sel(stiffness=4.0, kind="soft")).all()
    assert H.sel(stiffness=2.0, kind="stiff", frequency=3.0) == (1 + 1j) * 6.0
    assert np.isnan(H.sel(stiffness=2.0, kind="stiff", frequency=1.0))  # only the other has it
    assert H.attrs == {"units": "m/N"}
    assert found.dataset.attrs == {"load": "both"}
    assert found.dataset["n"].dims == ("stiffness", "kind")


def test_goes_on_with_what_is_missing(tmp_path):
    told = []
    sweep(measure, AXES, tmp_path)
    called.clear()
    more = sweep(measure, {**AXES, "stiffness": [2.0, 3.0]}, tmp_path, tell=told.append)
    assert called == [(3.0, "soft"), (3.0, "stiff")]
    assert "2 of 4 points are finished" in told[0]
    assert not more.failed
    called.clear()
    sweep(measure, AXES, tmp_path, about={"arguments": ["other"]})  # nothing is taken for it
    assert len(called) == 4


def told_by_each(stiffness):
    z = xr.Variable("t", np.ones(2), {"units": "m", "deviation": stiffness})
    more = {"late": 1j} if stiffness > 1 else {}
    return xr.Dataset({"z": z, **more}, attrs={"critical": 3 * stiffness, "of": f"{stiffness}"})


def test_a_number_that_differs_is_a_variable(tmp_path):
    told, axes = [], {"stiffness": [1.0, 2.0]}
    found = sweep(told_by_each, axes, tmp_path, tell=told.append).dataset
    assert found["z"].attrs == {"units": "m"}
    assert list(found["z.deviation"].values) == [1.0, 2.0]
    assert list(found["critical"].values) == [3.0, 6.0]
    assert np.isnan(found["late"][0])
    assert found["late"][1] == 1j
    assert told[-1].endswith(": of")
    with pytest.raises(ArgumentError, match="only none: must be one of z"):
        sweep(told_by_each, axes, tmp_path, only=["none"])  # all are kept
    chosen = sweep(told_by_each, axes, tmp_path, only=["z"]).dataset
    assert list(chosen.data_vars) == ["z", "z.deviation"]


def bands(n):
    return xr.Dataset({"z": 1.0}, attrs={"stop_bands": np.arange(2 * n)})


def test_numbers_that_differ_in_number_end_with_nan(tmp_path):
    """One of one number comes back from a file as a number."""
    found = sweep(bands, {"n": [0.5, 1.0, 2.0]}, tmp_path).dataset["stop_bands"]
    assert found.dims == ("n", "stop_bands.index")
    nan = np.nan
    np.testing.assert_array_equal(found, [[0, nan, nan, nan], [0, 1, nan, nan], [0, 1, 2, 3]])


def test_switches_are_axes():
    swept = {"ring": "true", "position": "midspan"}
    assert filled("track-receptance", [], swept) == ["--ring", "--position", "midspan"]
    assert filled("track-receptance", [], {"ring": "false"}) == []
    with pytest.raises(UsageError, match="must be true or false"):
        filled("track-receptance", [], {"ring": "yes"})


def test_what_an_option_has_in_braces_is_an_axis():
    """A defect's depth, say, or how much of a fastening is left."""
    given = ["--defect", "dip:depth={d},length=1,at={x}", "--local=fastening@railseat={left}"]
    assert blanks_in(given) == {"d": {"defect"}, "x": {"defect"}, "left": {"local"}}
    assert filled("run", given, {"x": 30.0, "left": 0.0, "d": 1e-3, "speed": 200.0}) == [
        "--defect", "dip:depth=0.001,length=1,at=30", "--local=fastening@railseat=0",
        "--speed", "200",
    ]  # fmt: skip
    same = ["--frequencies", "100:200:100", "--load", "single"]
    local = ["--local", "fastening@2.8125={left}", *same]
    some, none, all_of_it = (
        measured("track-receptance", local, {}, True, left=x)["receptance"].values
        for x in (0.3, 0.0, 1.0)
    )
    equal = measured("track-receptance", same, {}, True)["receptance"].values
    np.testing.assert_allclose(all_of_it, equal, rtol=1e-9)  # of rounding
    assert (np.abs(none / equal) > np.abs(some / equal)).all()


def test_refuses_braces_without_values(tmp_path):
    words = ["run", "--defect", "dip:depth={depth},length=1,at=30", "--set", "speed=100,200"]
    with pytest.raises(UsageError, match=r"\{depth\}: has no values; give --set depth="):
        loaded("sweep").main([*words, "--out", str(tmp_path / "s.nc")], standalone_mode=False)


def uneven(n):
    return xr.Dataset({"z": ("k", np.ones(int(n)))})


def test_points_that_do_not_fit_are_told(tmp_path):
    with pytest.raises(JoinError, match=r"dimension k has no coordinates.* 2 at n = 2, 3 at n = 3"):
        sweep(uneven, {"n": [2.0, 3.0]}, tmp_path)


def test_takes_no_point_of_a_file_that_has_changed(tmp_path):
    file = tmp_path / "a.toml"
    for content, count in (("1", 2), ("1", 0), ("2", 1)):
        file.write_text(content)
        called.clear()
        sweep(measure, {"stiffness": [2.0], "kind": [str(file), "stiff"]}, tmp_path / "points")
        assert len(called) == count


def test_words_are_kept_as_written():
    axes = _axes("frf", ["slab.present=true,false", "contact-stiffness=hertz:1e9,hertz:8e9"], KNOWN)
    assert list(axes.values()) == [["true", "false"], ["hertz:1e9", "hertz:8e9"]]
    assert _axes("frf", ["contact-stiffness=hertz:1e9"], KNOWN)["contact-stiffness"] == [
        "hertz:1e9"
    ]
    with pytest.raises(UsageError, match="given twice"):
        _axes("frf", ["speed=1,2", "speed=3,4"], KNOWN)


def test_an_axis_is_not_given_besides(tmp_path):
    words = ["frf", "--set", "speed=100,200", "--speed", "90", "--out", str(tmp_path / "s.nc")]
    with pytest.raises(UsageError, match="--speed: is an axis"):
        loaded("sweep").main(words, standalone_mode=False)


def test_refuses_axes_that_are_none(tmp_path):
    with pytest.raises(ArgumentError, match="has a value twice"):
        sweep(measure, {"stiffness": [1.0, 1.0]}, tmp_path)
    with pytest.raises(ArgumentError, match="at most 100000"):
        sweep(measure, {"a": [*map(float, range(400))], "b": [*map(float, range(400))]}, tmp_path)


def test_picture(tmp_path):
    found = sweep(measure, AXES, tmp_path).dataset
    chart = sweep_chart(found, list(AXES), "H")
    assert [row[0].title for row in chart.rows] == ["kind soft", "kind stiff"]
    assert [c.name for c in chart.rows[0][0].curves] == [f"stiffness = {x}" for x in (2, 4)]
    assert chart.rows[1][0].curves[0].y == pytest.approx(
        [np.nan, 4 * 2**0.5, 6 * 2**0.5], nan_ok=True
    )
    assert chart.rows[0][0].y_label == "|H| (m/N)"
    plain = sweep_chart(found, list(AXES), "n").rows[0][0]
    assert (plain.x_label, [c.name for c in plain.curves]) == (
        "stiffness",
        ["kind soft", "kind stiff"],
    )
    found["stiffness"].attrs["units"] = "N/m"
    with_units = sweep_chart(found, list(AXES), "H").rows[0][0].curves
    assert [c.name for c in with_units] == [f"stiffness = {x} N/m" for x in (2, 4)]


def test_axes_of_the_command_line():
    axes = _axes(
        "frf", ["fastening.stiffness=2e7:6e7:3", "speed=100,300", "track=paper,booted"], KNOWN
    )
    assert axes == {"fastening.stiffness": [2e7, 4e7, 6e7], "speed": [100.0, 300.0],
                    "track": ["paper", "booted"]}  # fmt: skip
    assert _axes("frf", ["speed=1:100:3@log"], KNOWN)["speed"] == pytest.approx([1, 10, 100])
    first = {key: values[0] for key, values in axes.items()}
    assert filled("frf", [], first) == [
        "--set", "fastening.stiffness=20000000", "--speed", "100", "--track", "paper"
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("text", "said"),
    [("speed", "must be KEY= and start:stop:N"), ("speed=1:2", "must be KEY="),
     ("speed=1:2:1", "N must be from 2"), ("speed=0:2:3@log", "both ends > 0"),
     ("sped=1,2", "frf has no option --sped, nor such a number")],
)  # fmt: skip
def test_refuses_axes(text, said):
    with pytest.raises(UsageError, match=said):
        _axes("frf", [text], KNOWN)
