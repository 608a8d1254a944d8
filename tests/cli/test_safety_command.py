"""What is told of a run's safety, and of files that are no runs."""

import numpy as np
import pytest
import xarray as xr

from railcosim.master.files import load, save


def made_up(path):
    """Wheels pushed to the right by 8 and 16 kN, under 80 kN each."""
    time = 1e-3 * np.arange(501)
    forces = {
        f"wheelset[1].{side}.{what}": ("time", np.full(time.size, value))
        for side, across in (("left", 8e3), ("right", 16e3))
        for what, value in (("force_y", across), ("force_z", 80e3))
    }
    save(xr.Dataset(forces, {"time": time}, {"speed": 50.0, "title": "made up"}), path)


def test_safety_of_a_run(railcosim, tmp_path):
    made_up(tmp_path / "run.nc")
    done = railcosim("safety", "run.nc", "--out", "s.csv", "--plot", "s.png")
    assert done.status == 0, done.err
    rows = {line.split("│")[1].strip(): line.split("│")[2:5] for line in done.out.splitlines()
            if line.startswith("│")}  # fmt: skip
    told = {name: [cell.strip() for cell in cells] for name, cells in rows.items()}
    assert told["wheelset[1].left.derailment_quotient"] == ["-0.100", "-0.100", "0.800"]
    assert told["wheelset[1].guiding_force_sum"] == ["24.000 kN", "24.000 kN", "63.333 kN"]
    assert told["wheelset[1].right.unloading"] == ["0.000", "0.000", ""]
    assert (tmp_path / "s.png").stat().st_size > 1000
    kept = load(tmp_path / "s.csv")
    quotient = kept["wheelset[1].right.derailment_quotient"].values
    assert quotient == pytest.approx(0.2)
    assert quotient.size == 47  # 25 m: middles from 1 to 24 m


def test_what_is_no_run(railcosim, tmp_path):
    (tmp_path / "x.csv").write_text("x,left\n0,0\n")
    for file, says in (("x.csv", "units"), ("none.nc", "cannot be read"), ("run.txt", "end in")):
        done = railcosim("safety", file)
        assert done.status == 2
        assert f"{file}: " in done.err
        assert says in done.err
    save(xr.Dataset({"a": ("time", [1.0])}, {"time": [0.0]}), tmp_path / "a.nc")
    done = railcosim("safety", "a.nc", "--speed", "100")
    assert done.status == 2
    assert "a.nc: the run has no wheelset[1].left.force_z" in done.err
