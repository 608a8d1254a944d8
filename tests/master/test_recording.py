"""Recording and files."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
import xarray as xr

from railcosim.master.component import Variable
from railcosim.master.cosimulation import cosimulate
from railcosim.master.files import load, save
from railcosim.master.recording import Recorder, record
from railcosim.master.schemes.jacobi import jacobi
from railcosim.master.signals import Signal
from railcosim.master.system import System

from .oscillator import make_system

FORCE = "wheelset[1].left.force_z"


def make_signals():
    a = Signal(
        "a",
        [
            Variable(name=FORCE, unit="N", description="contact force"),
            Variable(name="shared", unit="kg m2, roughly"),
        ],
        lambda t: [np.sin(t) / 3.0, t],
    )
    return System([a, Signal("b", [Variable(name="shared")], lambda t: [-t])], [])


def recorded(system, n_steps=4, **options):
    recorder = Recorder(system, **options)
    assert record(cosimulate(system, jacobi(), 0.1, 0.1 * n_steps), recorder) is None
    return recorder.to_dataset({"scheme": "Jacobi", "step": 0.1})


def test_dataset():
    data = recorded(make_signals())
    assert set(data.data_vars) == {FORCE, "a.shared", "b.shared"}
    assert data.sizes == {"time": 5}
    assert data.time.attrs["units"] == "s"
    assert data[FORCE].attrs == {"units": "N", "long_name": "contact force", "component": "a"}
    assert data.attrs == {"scheme": "Jacobi", "step": 0.1}
    np.testing.assert_array_equal(data["b.shared"], -data["a.shared"])
    np.testing.assert_array_equal(data["a.shared"], data.time)


def test_every():
    assert recorded(make_signals(), 7, every=3).time.values == pytest.approx([0.0, 0.3, 0.6])
    with pytest.raises(ValueError, match="at least 1"):
        Recorder(make_signals(), every=0)


def test_choice_of_variables():
    data = recorded(make_signals(), variables=["b.shared", FORCE, f"a.{FORCE}"])
    assert list(data.data_vars) == ["b.shared", FORCE]
    with pytest.raises(ValueError, match=r"no output 'wheelset\[1\].left.force'.*did you mean"):
        Recorder(make_signals(), variables=["wheelset[1].left.force"])


def test_buffers_grow():
    system = make_system()
    recorder, points = Recorder(system), []
    for point in cosimulate(system, jacobi(), 1e-3, 2.5):  # more than two first buffers
        recorder.add(point)
        points.append(point.outputs.copy())
        point.outputs[:] = np.nan  # whoever has asked for them may do so
    data = recorder.to_dataset()
    np.testing.assert_array_equal(np.array(points), data.to_dataarray().values.T)


def test_interruption_keeps_what_was_recorded():
    def value(t):
        if t > 0.25:
            raise KeyboardInterrupt
        return [t]

    system = System([Signal("s", [Variable(name="y")], value)], [])
    recorder = Recorder(system)
    stopped = record(cosimulate(system, jacobi(), 0.1, 1.0), recorder)
    assert isinstance(stopped, KeyboardInterrupt)
    assert recorder.to_dataset().y.values == pytest.approx([0.0, 0.1, 0.2])


@pytest.mark.parametrize("suffix", [".nc", ".csv"])
def test_time_round_trip(tmp_path, suffix):
    data = recorded(make_signals())
    save(data, tmp_path / f"run{suffix}")
    back = load(tmp_path / f"run{suffix}")
    xr.testing.assert_equal(back, data)  # bit for bit: both formats keep all digits
    assert {n: v.attrs.get("units", "") for n, v in back.variables.items()} == {
        n: v.attrs["units"] for n, v in data.variables.items()
    }


def test_netcdf_keeps_attributes(tmp_path):
    data = recorded(make_signals()).assign_attrs(
        parameters={"gain": [1, 2]}, every=3, moving=True, nothing=None
    )
    save(data, tmp_path / "run.nc")
    back = load(tmp_path / "run.nc")
    assert back[FORCE].attrs == data[FORCE].attrs
    assert back.attrs == {
        "scheme": "Jacobi",
        "step": 0.1,
        "parameters": '{"gain": [1, 2]}',
        "every": 3,
        "moving": "true",
        "nothing": "null",
    }
    assert data.attrs["parameters"] == {"gain": [1, 2]}  # saving changes nothing of yours


@pytest.mark.parametrize("suffix", [".nc", ".csv"])
def test_complex_round_trip(tmp_path, suffix):
    frequency = ("frequency", np.linspace(1.0, 2.0, 7), {"units": "Hz"})
    h = np.exp(1j * np.arange(7.0)) * 1e-9
    h[3] = complex(0.0, np.pi)
    variables = {
        FORCE: ("frequency", h, {"units": "m/N"}),
        "x.re": ("frequency", np.arange(7.0), {"units": "m"}),  # looks like a part, is none
    }
    data = xr.Dataset(variables, {"frequency": frequency})
    save(data, tmp_path / f"frf{suffix}")
    back = load(tmp_path / f"frf{suffix}")
    xr.testing.assert_identical(back, data)


def test_complex_of_two_dimensions(tmp_path):
    values = np.arange(6.0).reshape(2, 3) + 1j
    data = xr.Dataset({"H": (("frequency", "output"), values)}, {"output": ["a", "b", "c"]})
    save(data, tmp_path / "frf.nc")
    xr.testing.assert_identical(load(tmp_path / "frf.nc"), data)
    with pytest.raises(ValueError, match=r"one dimension .* frequency, output; save it as \.nc"):
        save(data, tmp_path / "frf.csv")
    with pytest.raises(ValueError, match=r"one dimension for all, here are time"):
        save(recorded(make_signals()).assign(scalar=1.0), tmp_path / "run.csv")


def test_csv_layout(tmp_path):
    save(recorded(make_signals(), variables=[FORCE, "b.shared"]), tmp_path / "run.csv")
    lines = (tmp_path / "run.csv").read_text().splitlines()
    assert lines[0] == f"# units: time s, {FORCE} N, b.shared -"
    assert lines[1] == f"time,{FORCE},b.shared"
    assert lines[2] == "0,0,-0"
    assert len(lines) == 7


def test_foreign_csv(tmp_path):
    (tmp_path / "x.csv").write_text("time,y\n0,1\n")
    with pytest.raises(ValueError, match="first line must start with '# units: '"):
        load(tmp_path / "x.csv")


@pytest.mark.parametrize("use", [lambda p: save(xr.Dataset(), p), load])
def test_unknown_suffix(tmp_path, use):
    with pytest.raises(ValueError, match=r"must be \.nc or \.csv, got '\.mat'"):
        use(tmp_path / "run.mat")


@pytest.mark.parametrize("suffix", [".nc", ".csv"])
def test_failed_save_leaves_the_old_file(tmp_path, suffix):
    path = tmp_path / f"run{suffix}"
    save(recorded(make_signals()), path)
    before = path.read_bytes()
    broken = xr.Dataset({"y": ("time", np.array([object(), object()]))}, {"time": [0.0, 1.0]})
    with pytest.raises((TypeError, ValueError)):
        save(broken, path)
    assert path.read_bytes() == before
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


def test_names_with_a_slash(tmp_path):
    """FMI allows them; HDF5 takes them for a path."""
    time = {"time": [0.0, 1.0]}
    parts = {"a/b": ("time", [1.0, 2.0], {"units": "m"}), "c/d": ("time", [1j, 2.0])}
    dataset = xr.Dataset(parts, time)
    for path in (tmp_path / "x.nc", tmp_path / "x.csv"):
        save(dataset, path)
        found = load(path)
        assert set(found.data_vars) == {"a/b", "c/d"}
        for name in dataset.data_vars:
            assert found[name].values.tolist() == dataset[name].values.tolist()
        assert found["a/b"].attrs == {"units": "m"}
        assert "complex_part" not in found["c/d"].attrs


FULL = """
import resource, sys, numpy, xarray
from railcosim.master.files import save
resource.setrlimit(resource.RLIMIT_FSIZE, (200_000, resource.RLIM_INFINITY))
columns = {f"v{i}": ("time", numpy.arange(3000) / 7) for i in range(30)}
try:
    save(xarray.Dataset(columns), sys.argv[1])
except OSError as error:
    print(error.strerror)
"""


@pytest.mark.parametrize("suffix", [".nc", ".csv"])
def test_no_room(tmp_path, suffix):
    """An error, and not the end of the process (as HDF5 has it). A limit stands for a full disk."""
    path = tmp_path / f"run{suffix}"
    path.write_text("old")
    command = [sys.executable, "-c", FULL, path]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "File too large\n", "")
    assert [p.name for p in tmp_path.iterdir()] == [path.name]
    assert path.read_text() == "old"
