"""railcosim modes and critical-speed as a user meets them."""

import pytest

from railcosim.master.files import load


def test_modes(railcosim, tmp_path):
    done = railcosim("modes", "vehicle", "--out", "modes.csv")
    assert done.status == 0, done.err
    assert "car body lower sway" in done.out
    lines = (tmp_path / "modes.csv").read_text().splitlines()
    assert (
        lines[0] == "# units: name -, undamped_frequency Hz, damped_frequency Hz, damping_ratio 1"
    )
    assert lines[1] == "name,undamped_frequency,damped_frequency,damping_ratio"
    assert lines[2].startswith("car body lower sway,0.31")


def test_modes_of_wheels_that_creep_too_fast(railcosim):
    """The paper's vehicle at its 250 km/h: said in words, for it is the first thing to know."""
    done = railcosim(
        "modes", "vehicle", "--wheels", "contact", "--speed", 250, "--conicity", 0.1
    )  # fmt: skip
    assert done.status == 0, done.err
    assert "damping below 0: what is displaced so grows" in done.out
    assert "bogie hunting" in done.out


def test_critical_speed_and_its_picture(railcosim, tmp_path):
    done = railcosim(
        "critical-speed", "--rigid-track", "--conicity", 0.2, "--out", "c.csv", "--plot", "c.png"
    )  # fmt: skip
    assert done.status == 0, done.err
    lines = (tmp_path / "c.csv").read_text().splitlines()
    assert lines[1] == "conicity,critical_speed,frequency"
    assert (tmp_path / "c.png").stat().st_size > 10_000
    found = load(tmp_path / "c.csv")
    assert float(found["critical_speed"][0]) == pytest.approx(84.0, abs=0.05)
    assert found["critical_speed"].attrs["units"] == "km/h"


def test_sensitivity(railcosim, tmp_path):
    done = railcosim("sensitivity", "vehicle", "--out", "s.nc")
    assert done.status == 0, done.err
    found = load(tmp_path / "s.nc")
    bounce = found.sel(name="car body bounce")
    assert float(bounce["frequency_slope"].sel(parameter="carbody.mass")) < 0
    done = railcosim("sensitivity", "vehicle", "--track", "paper")
    assert done.status == 2
    assert "--track: is of a track" in done.err
    done = railcosim("sensitivity", "track", "--out", "s.csv")
    assert done.status == 2
    assert "must end in .nc" in done.err
