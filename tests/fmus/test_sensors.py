"""Sensors as outputs of tracks: both runtimes, both versions of FMI, a run and a response."""

import zipfile
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import xarray as xr

from railcosim.analysis.pair.sensors import check_seen, marked, sensors_of
from railcosim.analysis.response.models import linear_track
from railcosim.cli.options import UsageError
from railcosim.cli.sensor_options import ObservedPair, sensor_of
from railcosim.fmus.export import BARE, NativeRuntime, PythonRuntime, Start, export_track
from railcosim.fmus.start import contact_defaults
from railcosim.master.fmi.fmu import FmuComponent
from railcosim.parameters import ArgumentError
from railcosim.track.parameters import Mesh, Sensor, Track
from railcosim.vehicle.parameters import Vehicle

from ..fmpy_problems import problems_of
from .test_any_wheelsets import table

pytestmark = pytest.mark.filterwarnings("ignore:a ring of")  # as short as it can be
TINY = Track(
    mesh=Mesh(cells=6, elements_per_bay=2, highest_slab_frequency=200, highest_frequency=400),
    sensor=(
        Sensor(at=12.5), Sensor(of="fastening", side="right", at=14.0625),
        Sensor(of="slab", side="middle", at=13.0, quantities=("pressure", "az", "stress")),
    ),
)  # fmt: skip
NAMES = ["z", "vz", "az", "bending_moment", "stress"]
PLACES = [14.0, 11.0]
START = Start(loads=[7e4, 7.1e4, 7.2e4, 7.3e4], positions=PLACES,
              contact=contact_defaults(Vehicle()))  # fmt: skip


# In space 5 s more.
@pytest.fixture(
    scope="module", params=["vertical", pytest.param("spatial", marks=pytest.mark.slow)]
)
def made(request, tmp_path_factory):
    folder, dimension = tmp_path_factory.mktemp("sensors"), request.param
    return {
        name: export_track(TINY, START, folder / name, dimension=dimension, runtime=runtime)
        for name, runtime in (
            ("native", NativeRuntime(model_exchange=True)),
            ("fmi3", NativeRuntime(fmi=3)), ("python", PythonRuntime())
        )
    }  # fmt: skip


def run(path, names, given):
    with FmuComponent.load(path) as fmu:
        assert [v.name for v in fmu.inputs] == names
        fmu.enter_initialization(0.0)
        fmu.set_inputs(given[0, 1:])
        fmu.exit_initialization()
        rows = [fmu.get_outputs()]
        for row, after in pairwise(given):
            fmu.set_inputs(row[1:])
            fmu.do_step(row[0], after[0] - row[0])
            rows.append(fmu.get_outputs())
        return np.array(rows), list(fmu.outputs)


def test_runtimes_and_versions_tell_the_same(made):
    """Rolling wheels over 200 steps; the native runtimes against numpy's, a rounding apart."""
    for name, path in made["native"].items():
        names, given = table(path, "in")
        wanted, expected = table(path, "ref")
        found, outputs = run(path, names, given)
        seen = [v.name for v in outputs if v.name.startswith("sensor[")]
        assert [n.partition(".")[2] for n in seen if n.startswith("sensor[1]")][:3] == NAMES[:3]
        assert [v.name for v in outputs] == wanted
        assert {"sensor[2].force_z", "sensor[3].pressure"} <= set(seen)
        size = np.abs(expected[:, 1:]).max(axis=0)
        rows = [k for k, n in enumerate(wanted) if n in seen]
        # What is nothing in the mirror is rounding of what is something.
        size = np.maximum(size, 1e-9 * size[rows].max())
        assert (np.abs(found - expected[:, 1:]) / size)[:, rows].max() < 1e-9
        assert size[[wanted.index(n) for n in seen if n.endswith(".z")]].min() > 1e-6
        third, _ = run(made["fmi3"][name], names, given[:20])
        assert np.array_equal(third, found[:20])
    names, given = table(made["python"]["Track"], "in")
    found, outputs = run(made["python"]["Track"], names, given[:3])
    assert found == pytest.approx(
        table(made["python"]["Track"], "ref")[1][:3, 1:], rel=1e-9, abs=1e-15
    )


def test_descriptions_are_valid_and_say_where_sensors_are(made):
    for runtime in made.values():
        for path in runtime.values():
            assert problems_of(path) == []
    path = made["native"]["Track"]
    first, second, third = sensors_of(path)
    assert (first.of, first.side, first.at, first.ring) == ("rail", "left", 12.5, 30.0)
    assert third.outputs == ("sensor[3].az", "sensor[3].pressure", "sensor[3].stress")
    assert second.what == "right fastening at 14.0625 m"
    with zipfile.ZipFile(path) as archive:
        terminals = archive.read("terminalsAndIcons/terminalsAndIcons.xml").decode()
    assert 'name="sensor[2]"' in terminals
    with FmuComponent.load(path) as fmu:
        about = {v.name: v for v in fmu.outputs}
    assert about["sensor[3].pressure"].unit == "N/m2"
    assert "compression positive" in about["sensor[2].force_z"].description


def test_without_sensors_nothing_is_there(tmp_path):
    files = export_track(replace(TINY, sensor=()), START, tmp_path, runtime=BARE)
    assert sensors_of(files["Track"]) == []


def test_derivatives_and_response(made):
    """Exact derivatives of a step, and a linear model whose sensors answer wheels as rails do."""
    path = made["native"]["Track"]
    names, given = table(path, "in")
    with FmuComponent.load(path) as fmu:
        fmu.enter_initialization(0.0)
        fmu.set_inputs(given[0, 1:])
        fmu.exit_initialization()
        force, kept = names.index("wheelset[1].left.force_z"), fmu.save_state()
        ends = []
        for change in (-1e3, 1e3):
            fmu.restore_state(kept)
            fmu.set_inputs(given[0, 1:] + change * np.eye(len(names))[force])
            fmu.do_step(0.0, 1e-3)
            ends.append(fmu.get_outputs())
        J = fmu.step_derivative()[:, force]
        found = (ends[1] - ends[0]) / 2e3
    assert pytest.approx(found, rel=1e-6, abs=1e-9 * np.abs(found).max()) == J  # it is linear
    model, _ = linear_track(path, np.array(PLACES), lambda a, b: None)
    outputs = [v.name for v in model.outputs]
    H = model.frequency_response(2 * np.pi * np.array([0.1, 80.0]))
    load = [v.name for v in model.inputs].index("wheelset[1].left.force_z")
    z, vz, az, moment, stress = (H[:, outputs.index(f"sensor[1].{n}"), load] for n in NAMES)
    s = 2j * np.pi * np.array([0.1, 80.0])
    assert vz == pytest.approx(s * z, rel=1e-6)
    assert az == pytest.approx(s**2 * z, rel=1e-2)  # of velocity, what modes jump by is left out
    assert stress == pytest.approx(moment / TINY.rail.section_modulus_foot, rel=1e-12)


def test_what_the_ring_repeats_is_not_told(made):
    """Within half a ring of every wheelset; beyond, NaN, or refused."""
    path, x = made["native"]["Track"], np.linspace(0.0, 40.0, 9)
    names = [name for sensor in sensors_of(path) for name in sensor.outputs]
    told = {name: ("time", np.ones(9)) for name in names}
    places = {f"wheelset[{i}].position": ("time", x - 3.0 * (i - 1)) for i in (1, 2)}
    shown = marked(xr.Dataset(told | places), path)
    there = np.isfinite(shown["sensor[1].z"])
    assert np.array_equal(there, (x <= 27.5) & (x - 3.0 >= -2.5))
    assert shown["sensor[1].z"].attrs["at"] == 12.5
    with pytest.warns(UserWarning, match="sensor 1, left rail at 12.5 m: no moment of this run"):
        marked(xr.Dataset(told | {n: (d, v + 100) for n, (d, v) in places.items()}), path)
    with pytest.raises(ArgumentError, match=r"rail.left@12.5: is over half of the ring \(30 m\)"):
        check_seen(path, np.array([40.0, 37.0]))


@pytest.mark.parametrize(
    ("text", "sensor"),
    [
        ("rail.left@50.3", Sensor(at=50.3)),
        ("fastening.right@railseat+2:force_z",
         Sensor(of="fastening", side="right", at=0.3125 + 6 * 0.625, quantities=("force_z",))),
        ("slab.middle@-1:z,stress",
         Sensor(of="slab", side="middle", at=-1.0, quantities=("z", "stress"))),
    ],
)  # fmt: skip
def test_options_are_read_once(text, sensor):
    assert sensor_of(TINY, text) == sensor


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("rail.left", "--sensor rail.left: must be WHAT.SIDE@PLACE"),
        ("rail.left@here", "must be WHAT.SIDE@PLACE"),
        ("rail.left@nan", "--sensor rail.left@nan: at: is missing"),
        ("rail.middle@50", "--sensor rail.middle@50: there is no middle of a rail; must be one of"),
        ("fastening.left@50", "--sensor fastening.left@50: there is none; railseats beside it"),
    ],
)
def test_options_that_cannot_be(text, said):
    with pytest.raises(UsageError, match=said):
        ObservedPair(sensor=[text]).rails()
