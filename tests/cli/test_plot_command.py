"""Pictures of several results, on the command line."""

import numpy as np
import pytest
import xarray as xr

from railcosim.analysis.overlay import lines_of
from railcosim.cli.overlay_chart import overlay_chart
from railcosim.master.files import save


@pytest.fixture
def two(tmp_path):
    """Frequency responses a.nc and sub/a.nc, one twice the other."""
    f = np.geomspace(1, 100, 80)
    for factor, path in ((1, tmp_path / "a.nc"), (2, tmp_path / "sub" / "a.nc")):
        path.parent.mkdir(exist_ok=True)
        rail = factor / (1 - (f / 30) ** 2 + 0.1j)
        save(
            xr.Dataset(
                {"wheelset[1].left.rail_z": ("frequency", rail, {"units": "m/N"})},
                {"frequency": ("frequency", f, {"units": "Hz"})},
            ),
            path,
        )
    return "a.nc", "sub/a.nc"


def test_two_files_of_one_name_in_one_picture(two, railcosim, tmp_path):
    name = "wheelset[1].left.rail_z"
    done = railcosim("plot", *two, "--output", name, "--as", "third-octaves", "--as", "ratio",
                     "--out", "p.png")  # fmt: skip
    assert (done.status, done.out, done.err) == (0, "p.png\n", "")
    assert (tmp_path / "p.png").stat().st_size > 5000


@pytest.mark.parametrize(
    ("more", "message"),
    [
        (("--output", "rail"), "--output rail: is not in "),
        (("--output", "wheelset[1].left.rail_z", "--as", "spectrum"), "no record in time"),
        (("--output", "wheelset[1].left.rail_z", "--out", "p.txt"), "--out p.txt: must end in"),
    ],
)
def test_mistakes(two, railcosim, more, message):
    done = railcosim("plot", *two, "--out", "p.pdf", *more)
    assert done.status == 2
    assert message in done.err
    assert len(done.err.splitlines()) == 1


def test_files_are_named_in_the_legend_and_complex_ones_have_a_phase():
    f = np.geomspace(1, 100, 80)
    results = {
        name: xr.Dataset(
            {"carbody.z": ("frequency", k * np.exp(1j * f), {"units": "m/N"})},
            {"frequency": ("frequency", f, {"units": "Hz"})},
        )
        for k, name in ((1, "soft.nc"), (2, "stiff.nc"))
    }
    ((size,), (phase,)) = overlay_chart(lines_of(results, ["carbody.z"])).rows
    assert [c.name for c in size.curves] == ["soft.nc", "stiff.nc"]
    assert size.y_label == "|car body, down| (m/N)"
    assert phase.y_label == "phase of car body, down (°)"
    assert size.curves[1].y == pytest.approx(2.0)


def test_what_a_name_does_not_say_its_result_does():
    t = np.arange(9.0)
    told = {1: "left fastening at 3.4 m: force, compression positive", 2: "a" * 80}
    run = xr.Dataset(
        {f"sensor[{k}].force_z": ("time", t, {"units": "N", "long_name": text})
         for k, text in told.items()}, {"time": t},
    )  # fmt: skip
    ((panel,),) = overlay_chart(lines_of({"a.nc": run}, list(run.data_vars))).rows
    assert [c.name for c in panel.curves] == [
        "a.nc, left fastening at 3.4 m, force", "a.nc, sensor[2].force_z"
    ]  # fmt: skip
    assert panel.y_label == "force / sensor[2].force_z (N)"


def test_a_phase_that_turns_over_too_often_is_left_out_and_said():
    f = np.linspace(1, 100, 800)
    of = {
        name: xr.Dataset(
            {"carbody.z": ("frequency", np.exp(2j * np.pi * f * lag), {"units": "m/N"})},
            {"frequency": ("frequency", f, {"units": "Hz"})},
        )
        for lag, name in ((0.2, "near.nc"), (0.6, "far.nc"))  # 19.8 turns, 59.4
    }
    near = overlay_chart(lines_of({"near.nc": of["near.nc"]}, ["carbody.z"]))
    both = overlay_chart(lines_of(of, ["carbody.z"]))
    assert (len(near.rows), len(both.rows)) == (2, 1)
    assert "turns over 59 times" in both.rows[0][0].title  # from 0.6 turns at 1 Hz to 60 at 100
