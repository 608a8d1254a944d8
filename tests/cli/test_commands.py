"""The command line as a user meets it: results, pictures, and one line for a mistake."""

import os
import signal
import subprocess
import sys
import time

import fmpy
import numpy as np
import pytest

from railcosim.cli.options import UsageError, frequencies_of
from railcosim.cli.pair_charts import run_chart
from railcosim.master.checkpoint import results_of
from railcosim.master.files import load
from railcosim.parameters import write_toml
from railcosim.plots.picture import save_picture

COARSE = "[mesh]\ncells = 4\nhighest_slab_frequency = 300\nhighest_frequency = 1000\n"
COMMAND = [sys.executable, "-c", "from railcosim.cli.main import run; run()"]


@pytest.mark.parametrize(
    ("text", "first", "last", "count"),
    [
        ("1:200:0.5", 1, 200, 399),
        ("1:2:0.3", 1, 2, 5),  # the stop is included even where the step does not meet it
        ("5:5:1", 5, 5, 1),
        ("0.3:2000:300@log", 0.3, 2000, 300),
    ],
)
def test_frequencies(text, first, last, count) -> None:
    grid = frequencies_of(text)
    assert grid.size == count
    assert (grid[0], grid[-1]) == (pytest.approx(first), pytest.approx(last))
    assert (np.diff(grid) > 0).all()


@pytest.mark.parametrize(
    "text", ["", "1:2", "a:b:c", "0:5:1", "5:1:1", "1:5:0", "1:nan:1", "1:1e9:1e-9", "1:5:2.5@log"]
)
def test_frequencies_that_are_none(text) -> None:
    with pytest.raises(UsageError, match="--frequencies"):
        frequencies_of(text)


def test_run_and_its_picture(exported, railcosim, tmp_path) -> None:
    done = railcosim(
        "run", "--vehicle-fmu", exported["Vehicle"], "--track-fmu", exported["TrackWithContact"],
        "--time", 0.01, "--out", "run.csv", "--plot", "run.png",
    )  # fmt: skip
    assert done.status == 0, done.err
    lines = (tmp_path / "run.csv").read_text().splitlines()
    assert lines[0].startswith("#")
    assert "time s" in lines[0]
    assert lines[1].split(",")[0] == "time"
    run = load(tmp_path / "run.csv")
    assert run.sizes["time"] == 101
    assert run["wheelset[4].left.force_z"].attrs["units"] == "N"
    assert (tmp_path / "run.png").read_bytes().startswith(b"\x89PNG")


def test_a_run_that_diverges_keeps_what_it_had(exported, railcosim, tmp_path) -> None:
    """Contact in the vehicle, 8 GN/m and constant inputs at 1 ms: unstable by far."""
    done = railcosim(
        "run", "--vehicle-fmu", exported["VehicleWithContact"], "--track-fmu", exported["Track"],
        "--contact-stiffness", 8e9, "--inputs", "constant", "--step", 1e-3, "--time", 0.5,
        "--out", "run.nc",
    )  # fmt: skip
    assert done.status == 1
    assert "Traceback" not in done.err
    for word in ("t = ", "Jacobi", "0.001 s", "Try"):
        assert word in done.err
    kept = load(tmp_path / "run.nc")
    assert 2 < kept.sizes["time"] < 501
    assert "diverged" in kept.attrs["stopped"]


def test_an_interrupted_run_keeps_what_it_had(exported, tmp_path) -> None:
    """Ctrl-C lands inside an FMU's Python most of the time; it must not take the run with it."""
    arguments = ["run", "--vehicle-fmu", exported["Vehicle"], "--track-fmu",
                 exported["TrackWithContact"], "--time", "60", "--out", "run.nc",
                 "--checkpoint", "c", "--every", "0.005"]  # fmt: skip
    process = subprocess.Popen(
        [*COMMAND, *map(str, arguments)], cwd=tmp_path, stderr=subprocess.PIPE, text=True,
        env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},
    )  # fmt: skip
    rows, seen = results_of(tmp_path / "c"), 0
    while seen <= 10 and process.poll() is None:  # of 600,000: it has begun
        seen = load(rows).sizes["time"] if rows.exists() else 0
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=1800)
    assert process.returncode == 1
    assert "interrupted" in said
    assert "Traceback" not in said
    kept = load(tmp_path / "run.nc")
    assert kept.sizes["time"] >= seen > 10
    assert kept.attrs["stopped"] == "interrupted"


def test_loss_of_contact_is_told(exported, railcosim, tmp_path) -> None:
    """Contact in the vehicle at 0.1 ms is unstable, but hammering wheels keep the forces finite."""
    done = railcosim(
        "run", "--vehicle-fmu", exported["VehicleWithContact"], "--track-fmu", exported["Track"],
        "--contact", "vehicle", "--step", 1e-4, "--time", 0.05, "--out", "run.nc",
    )  # fmt: skip
    assert done.status == 1
    assert "off the rail" in done.err
    assert "not to be believed" in done.err


def test_ride(exported, railcosim, tmp_path) -> None:
    """All that it promises is there, and forces swing about a tenth of the static load."""
    done = railcosim(
        "ride", "--vehicle-fmu", exported["Vehicle"], "--track-fmu", exported["Track"],
        "--frequencies", "0.5:40:40@log", "--out", "ride.nc", "--plot", "ride.png",
    )  # fmt: skip
    assert done.status == 0, done.err
    found = load(tmp_path / "ride.nc")
    names = ["carbody.az", "bogie[2].az", "wheelset[3].az", "wheelset[4].right.force_z"]
    assert set(names) < set(found.data_vars)
    assert 1e3 < found["wheelset[4].right.force_z"].attrs["standard_deviation"] < 2e4
    assert 0 < found["carbody.az"].attrs["iso_2631"] < 1


def test_gauss_seidel_and_rolling_wheels(exported, railcosim, tmp_path) -> None:
    done = railcosim(
        "run", "--vehicle-fmu", exported["Vehicle"], "--track-fmu", exported["TrackWithContact"],
        "--scheme", "gauss-seidel", "--first", "track", "--time", 0.01, "--speed", 300,
        "--irregularity", "none", "--out", "run.nc",
    )  # fmt: skip
    assert done.status == 0, done.err
    run = load(tmp_path / "run.nc")
    travelled = run["wheelset[1].position"].values[[0, -1]]
    assert np.diff(travelled)[0] == pytest.approx(300 / 3.6 * 0.01)
    assert run.attrs["scheme"].startswith("Gauss-Seidel, track first")


def test_track_receptance_of_own_parameters(railcosim, tmp_path) -> None:
    printed = railcosim("parameters", "--track", "--set", "mesh.cells=6")
    assert printed.status == 0
    text = railcosim("parameters", "--track").out.replace("cells = 20", "cells = 6")
    data = [line for line in text.splitlines() if not line.startswith("#")]
    assert [line for line in printed.out.splitlines() if not line.startswith("#")] == data
    (tmp_path / "my.toml").write_text(printed.out)
    done = railcosim(
        "track-receptance", "--track", "my.toml", "--at", "midspan", "--load", "single",
        "--frequencies", "50:55:1", "--out", "r.csv", "--plot", "r.png",
    )  # fmt: skip
    assert done.status == 0, done.err
    header = (tmp_path / "r.csv").read_text().splitlines()[1]
    assert header == "frequency,receptance.re,receptance.im"
    assert load(tmp_path / "r.csv")["receptance"].dtype == complex


def test_track_receptance_in_other_directions(railcosim, tmp_path) -> None:
    """Lateral force, roll: with units; and nothing moves down, which is told apart from a fault."""
    for response, unit in (("roll", "rad/N"), ("z", "m/N")):
        done = railcosim(
            "track-receptance", "--direction", "y", "--response", response,
            "--frequencies", "50:52:1", "--out", "r.csv", "--plot", "r.png",
        )  # fmt: skip
        assert done.status == 0, done.err
        found = load(tmp_path / "r.csv")["receptance"]
        assert found.attrs["units"] == unit
        assert bool((found == 0).all()) == (response == "z")
    assert "none: upright rails" in done.out


def test_track_receptance_knows_the_error_of_the_ring(railcosim, tmp_path) -> None:
    """Endless by default, whatever the number of cells; the ring on request, and what it errs."""
    found = {}
    for cells in (4, 20):
        mesh = f"cells = {cells}\nhighest_slab_frequency = 300\nhighest_frequency = 1000\n"
        (tmp_path / "my.toml").write_text(f"[mesh]\n{mesh}")
        for option in ((), ("--ring",)):
            done = railcosim(
                "track-receptance", "--track", "my.toml", "--frequencies", "55:70:1", *option,
                "--out", "r.nc",
            )  # fmt: skip
            assert done.status == 0, done.err
            found[cells, option] = load(tmp_path / "r.nc")["receptance"].values
        error = np.abs(found[cells, ("--ring",)] / found[cells, ()] - 1)
        assert load(tmp_path / "r.nc").attrs["ring_error"] == pytest.approx(error.max())
        assert f"by at most {error.max():.1e}, at {55 + np.argmax(error)} Hz" in done.out
    assert np.array_equal(found[4, ()], found[20, ()])
    # 0.62 a cell is the slowest wave here; measured 0.3 and 1e-4.
    assert error.max() < 1e-3
    assert np.abs(found[4, ("--ring",)] / found[4, ()] - 1).max() > 0.1


def test_receptance_of_any_fmu(exported, railcosim, tmp_path) -> None:
    """Vehicle.fmu, wheel 4: at high frequency the mass of the wheelset, -1 / (m omega^2)."""
    done = railcosim(
        "receptance", exported["Vehicle"], "--input", "wheelset[4].left.force_z",
        "--output", "wheelset[4].left.wheel_z", "--frequencies", "500:1000:5@log", "--step", 1e-4,
        "--steps", 13000, "--out", "r.nc",
    )  # fmt: skip
    assert done.status == 0, done.err
    r = load(tmp_path / "r.nc")
    omega = 2 * np.pi * r["frequency"].values
    # The primary suspension still adds c / (m omega) = 2.5 % at 500 Hz, at a right angle.
    assert (r["receptance"].values * -(1680 * omega**2)).real == pytest.approx(-1, rel=3e-3)


def test_a_pair_without_a_contact_is_coupled_by_the_master(exported, railcosim, tmp_path) -> None:
    """With the scheme that can: its step is ten times what the others bear."""
    done = railcosim(
        "run", "--vehicle-fmu", exported["Vehicle"], "--track-fmu", exported["Track"],
        "--step", 1e-3, "--time", 0.1, "--out", "r.nc",
    )  # fmt: skip
    assert done.status == 0, done.err
    run = load(tmp_path / "r.nc")
    assert run.attrs["scheme"] == "interface Jacobian, average hold"
    assert run.sizes["time"] == 101
    force = run["wheelset[1].left.force_z"]
    # A good track changes the wheel load by a tenth or so; a coupling gone wrong by all of it.
    assert 0.6 < float(force.min() / force[0]) < float(force.max() / force[0]) < 1.4


def test_the_fmu_variable_is_named(exported, railcosim, tmp_path) -> None:
    done = railcosim(
        "receptance", exported["Vehicle"], "--input", "wheelset[4].force", "--output", "carbody.z",
        "--out", "r.nc",
    )  # fmt: skip
    assert done.status == 2
    assert "wheelset[4].force" in done.err
    assert "wheelset[4].left.force_z" in done.err


def test_plot_of_a_run_that_stopped_at_once(tmp_path) -> None:
    """One point is a picture without curves, not an error."""
    import xarray as xr  # noqa: PLC0415 (only here)

    run = xr.Dataset({"carbody.az": ("time", [0.0])}, {"time": [0.0]}, {"title": "stopped"})
    save_picture(run_chart(run), tmp_path / "one.png")
    assert (tmp_path / "one.png").exists()


@pytest.mark.slow  # three exports
def test_export_over_other_fmus(railcosim, short_track, tmp_path) -> None:
    """Those that change are named; those that stay the same are not."""
    (tmp_path / "t.toml").write_text(write_toml(short_track, "Track"))
    same = ["--out", "fmus", "--track", "t.toml", "--model-exchange"]
    (tmp_path / "v.toml").write_text("[wheelset]\nmass = 1300.0\n")
    for options, note in (
        (same, ""),
        (same, ""),
        ([*same, "--vehicle", "v.toml"],
         "note: Vehicle.fmu, Track.fmu, VehicleWithContact.fmu, TrackWithContact.fmu in fmus: "
         "replaced; they were other FMUs"),
    ):  # fmt: skip
        done = railcosim("export", *options)
        assert done.status == 0, done.err
        assert note in done.err
        assert ("replaced" in done.err) == bool(note)


def test_export_with_a_compiler_that_is_not_there(railcosim, tmp_path, monkeypatch) -> None:
    monkeypatch.setenv("CC", "/nowhere/cc")
    done = railcosim("export", "--out", "fmus")
    assert done.status == 1
    assert "'/nowhere/cc' cannot be run" in done.err
    assert not list((tmp_path / "fmus").glob("*"))


def test_export_of_fmi_3(railcosim, tmp_path) -> None:
    (tmp_path / "coarse.toml").write_text(COARSE)
    track = ["--track", "coarse.toml", "--wheelsets", 1]  # small, and no vehicle
    done = railcosim("export", "--out", "f", "--fmi", 3, *track)
    assert done.status == 0, done.err
    assert "Track.fmu" in done.out
    assert fmpy.read_model_description(str(tmp_path / "f" / "Track.fmu")).fmiVersion == "3.0"


def test_vehicle_and_track_that_do_not_fit(railcosim, tmp_path) -> None:
    """122 m of vehicle on a ring of 100 m: no FMUs, but what to do."""
    (tmp_path / "long.toml").write_text("[geometry]\nbogie_half_distance = 59.75\n")
    (tmp_path / "ring.toml").write_text("[mesh]\ncells = 20\n")  # said, so not made longer
    done = railcosim("export", "--vehicle", "long.toml", "--track", "ring.toml", "--out", "fmus")
    assert done.status == 2
    assert "122 m" in done.err
    assert "100 m ([mesh] cells = 20)" in done.err
    assert "cells = 34 (170 m)" in done.err
    assert not (tmp_path / "fmus" / "Track.fmu").exists()


@pytest.mark.slow  # a monolithic solution
def test_a_ring_that_is_short_is_said_once(railcosim, tmp_path) -> None:
    """18 m on 20 m."""
    (tmp_path / "short.toml").write_text(COARSE)
    done = railcosim(
        "compare", "--track", "short.toml", "--time", 1e-3, "--frequencies", "10:20:10"
    )  # fmt: skip
    assert done.status == 0, done.err
    assert done.err.count("ring of 20 m") == 1
