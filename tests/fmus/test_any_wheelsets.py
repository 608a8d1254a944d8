"""Tracks under any number of wheelsets: FMUs against the numpy twin, valid, with their names."""

import csv
import io
import zipfile
from dataclasses import replace

import numpy as np
import pytest

from railcosim.fmus import content
from railcosim.fmus.description.drawing import vehicle_icon
from railcosim.fmus.description.kind import VEHICLE
from railcosim.fmus.export import BARE, PythonRuntime, Start, export_track
from railcosim.fmus.interface import interface
from railcosim.fmus.start import contact_defaults
from railcosim.master.fmi.fmu import FmuComponent
from railcosim.mechanics.ports import FORCE, RAIL, SIDES, Layout
from railcosim.parameters import ParameterError, UnusualWarning
from railcosim.track.parameters import Mesh, Track
from railcosim.vehicle.files import read_stock
from railcosim.vehicle.modal import vehicle_body
from railcosim.vehicle.multibody import build_multibody
from railcosim.vehicle.parameters import Geometry, Vehicle
from railcosim.vehicle.properties import Rolling

from ..fmpy_problems import problems_of

pytestmark = pytest.mark.filterwarnings("ignore:a ring of")  # as short as it can be
TINY = Track(mesh=Mesh(cells=6, elements_per_bay=2, highest_slab_frequency=200,
                       highest_frequency=400))  # fmt: skip
CASES = [(1, SIDES), (2, SIDES[:1]), (11, SIDES)]  # fewest; one rail; two digits


def start_of(layout):
    """Loads that tell every wheel from every other."""
    n = layout.wheelsets
    return Start(
        loads=(7e4 + 1e3 * np.arange(len(layout.ports))).tolist(),
        positions=(0.3 + 22.0 * np.arange(n)[::-1] / n).tolist(),
        contact=contact_defaults(Vehicle()),
    )


@pytest.fixture(scope="module", params=CASES, ids=lambda case: f"{case[0]}-{len(case[1])}")
def made(request, tmp_path_factory):
    layout = Layout(*request.param)
    folder = tmp_path_factory.mktemp("tracks")
    return layout, export_track(TINY, start_of(layout), folder, sides=layout.sides)


def table(path, kind):
    with zipfile.ZipFile(path) as archive:
        rows = archive.read(f"documentation/{path.stem}_{kind}.csv").decode()
    names, *values = csv.reader(io.StringIO(rows))
    return names[1:], np.array(values, dtype=float)


@pytest.mark.parametrize("name", ["Track", "TrackWithContact"])
def test_the_runtime_against_its_twin(made, name):
    """The run that the FMU carries, of 200 steps with rolling wheels; a rounding apart."""
    layout, files = made
    names, given = table(files[name], "in")
    wanted, expected = table(files[name], "ref")
    with FmuComponent.load(files[name]) as fmu:
        assert [v.name for v in fmu.inputs] == names
        assert [v.name for v in fmu.outputs] == wanted
        fmu.enter_initialization(0.0)
        fmu.set_inputs(given[0, 1:])
        fmu.exit_initialization()
        rows = [fmu.get_outputs()]
        for k, row in enumerate(given[:-1]):
            fmu.set_inputs(row[1:])
            fmu.do_step(row[0], given[k + 1, 0] - row[0])
            rows.append(fmu.get_outputs())
    found, size = np.array(rows), np.abs(expected[:, 1:]).max(axis=0)
    assert set(layout.names(RAIL.motion)) <= set(wanted)
    assert size.min() > 0
    # As any pair of runtimes: 1e-9 of a column's largest value.
    assert (np.abs(found - expected[:, 1:]) / size).max() < 1e-9


def test_the_description_is_valid_and_names_every_port(made):
    layout, files = made
    for path in files.values():
        assert problems_of(path) == []
    with FmuComponent.load(files["Track"]) as fmu:
        about = fmu.description
    assert [v.name for v in about.inputs] == [
        *layout.of_axles("position"), *layout.names(FORCE)
    ]  # fmt: skip
    assert [v.start for v in about.inputs][layout.wheelsets :] == start_of(layout).loads


def test_wheels_that_are_not_loaded_are_not_there(tmp_path):
    """A wheelset of three without force changes nothing under the other two."""
    three, two = Layout(3), Layout(2)
    positions = [12.0, 9.0, 3.0]
    force = np.array([[8e4, 0.0, 6e4], [7e4, 0.0, 5e4]])
    seen = []
    for layout, kept in ((three, [0, 1, 2]), (two, [0, 2])):
        folder = tmp_path / str(layout.wheelsets)
        start = Start(
            loads=force[:, kept].ravel().tolist(),
            positions=[positions[k] for k in kept],
            contact=contact_defaults(Vehicle()),
        )
        with FmuComponent.load(export_track(TINY, start, folder, runtime=BARE)["Track"]) as fmu:
            fmu.enter_initialization(0.0)
            fmu.exit_initialization()
            y = dict(zip((v.name for v in fmu.outputs), fmu.get_outputs(), strict=True))
        z = np.array([y[name] for name in layout.names(RAIL.motion)]).reshape(2, -1)
        seen.append(z[:, [0, -1]])
    # The same sum with zeros in it.
    assert seen[0] == pytest.approx(seen[1], rel=1e-13)
    assert seen[0].min() > 1e-4


def test_in_python_too(tmp_path):
    layout = Layout(2)
    files = export_track(TINY, start_of(layout), tmp_path, runtime=PythonRuntime())
    _, expected = table(files["Track"], "ref")
    with FmuComponent.load(files["Track"]) as fmu:
        fmu.enter_initialization(0.0)
        fmu.set_inputs(table(files["Track"], "in")[1][0, 1:])
        fmu.exit_initialization()
        assert fmu.get_outputs() == pytest.approx(expected[0, 1:], rel=1e-12, abs=1e-15)


@pytest.mark.parametrize(
    ("name", "count", "wheelsets", "bogies", "carbodies"),
    [("paper", 1, 4, 2, 1), ("wagon", 1, 2, 0, 1), ("wagon", 3, 6, 0, 3), ("paper", 2, 8, 4, 2)],
)
def test_the_icon_is_of_the_train(name, count, wheelsets, bogies, carbodies):
    train = read_stock(name, count)
    body = vehicle_body(build_multibody(train))
    table = interface(
        body, content.start_of(train, np.arange(wheelsets, 0.0, -1.0)), with_contact=False
    )
    drawn = VEHICLE.icon(table, body)["svg"]
    asked = {"wheelsets": wheelsets, "bogies": bogies, "carbodies": carbodies}
    assert drawn == vehicle_icon(with_contact=False, **asked)["svg"]
    without = vehicle_icon(with_contact=False, **asked | {"wheelsets": 1, "bogies": 0})["svg"]
    patches = drawn.count(b'id="patch_') - without.count(b'id="patch_')
    assert patches == 2 * (wheelsets - 1) + bogies  # a wheel is two circles


def test_what_a_vehicle_says_of_rolling_is_not_passed_over_in_silence():
    long = Geometry(bogie_half_distance=60.0)  # so that nothing else is made
    vehicle = replace(Vehicle(), rolling=Rolling(conicity=0.3), geometry=long)
    with (
        pytest.warns(UnusualWarning, match=r"\[rolling\] is left out: these FMUs are vertical"),
        pytest.raises(ParameterError, match=r"122\.5 m long"),
    ):
        content.contents(vehicle, Track(mesh=Mesh(cells=20)))
