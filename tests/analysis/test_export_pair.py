"""Pair.ssp: valid, wired as the FMUs are, and at rest when it starts."""

import io
import warnings
import zipfile
from dataclasses import replace
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.ssp import ssd as fmpy_ssd
from lxml import etree

from railcosim.analysis.pair.export_pair import export_pair
from railcosim.analysis.response.models import wheelset_positions
from railcosim.fmus.export import BARE
from railcosim.master.connections import connect_by_name
from railcosim.master.cosimulation import cosimulate
from railcosim.master.fmi.fmu import FmuComponent
from railcosim.master.schemes.jacobi import jacobi
from railcosim.master.ssp import initialise, open_ssp
from railcosim.master.system import System
from railcosim.mechanics.ports import FORCE, Layout
from railcosim.parameters import ParameterError
from railcosim.track.decay import RingWarning
from railcosim.track.parameters import Mesh, Track
from railcosim.vehicle.files import read_stock
from railcosim.vehicle.multibody import build_multibody
from railcosim.vehicle.parameters import Coupler, Vehicle
from railcosim.vehicle.train import Train, TrainVehicle

SSD = "{http://ssp-standard.org/SSP1/SystemStructureDescription}"
SSC = "{http://ssp-standard.org/SSP1/SystemStructureCommon}"
SSV = "{http://ssp-standard.org/SSP1/SystemStructureParameterValues}"
WHEELS = [f"wheelset[{i}].{side}" for side in ("left", "right") for i in (1, 2, 3, 4)]


@pytest.fixture(scope="module")
def pair(exported):
    """Written by `export_pair`, beside the FMUs."""
    return exported["Vehicle"].with_name("Pair.ssp")


@pytest.fixture(scope="module")
def structure(pair):
    with zipfile.ZipFile(pair) as archive:
        return etree.fromstring(archive.read("SystemStructure.ssd"))


@pytest.fixture(scope="module")
def unpacked(pair, tmp_path_factory):
    """FMU files of the SSP by the component's name."""
    folder = tmp_path_factory.mktemp("unpacked")
    with zipfile.ZipFile(pair) as archive:
        archive.extractall(folder)
    ssd = etree.parse(folder / "SystemStructure.ssd")
    return {c.get("name"): folder / c.get("source") for c in ssd.iter(f"{SSD}Component")}


def schema(name):
    return etree.XMLSchema(file=str(Path(fmpy_ssd.__file__).parent / "schema" / name))


def test_structure_is_valid(structure):
    schema("SystemStructureDescription.xsd").assertValid(structure)


def test_the_schema_can_refuse(structure):
    """What makes the test above worth something."""
    bad = etree.fromstring(etree.tostring(structure))
    del bad.find(f".//{SSD}Connector").attrib["kind"]
    assert not schema("SystemStructureDescription.xsd").validate(bad)


def test_parameter_values_are_valid(structure):
    """A schema of their own: the system's passes over what is in a binding."""
    (values,) = structure.iter(f"{SSV}ParameterSet")
    document = etree.parse(io.BytesIO(etree.tostring(values)))
    schema("SystemStructureParameterValues.xsd").assertValid(document)


def test_every_variable_is_in_the_fmus(structure, unpacked):
    described = {
        name: {v.name: v for v in fmpy.read_model_description(str(path)).modelVariables}
        for name, path in unpacked.items()
    }
    assert set(described) == {"vehicle", "track"}
    for component in structure.iter(f"{SSD}Component"):
        variables = described[component.get("name")]
        for connector in component.iter(f"{SSD}Connector"):
            variable = variables[connector.get("name")]
            assert variable.causality == connector.get("kind")
            assert variable.unit == connector.find(f"{SSC}Real").get("unit")
        for parameter in component.iter(f"{SSV}Parameter"):
            variable = variables[parameter.get("name")]
            assert variable.causality == "parameter"
            assert variable.unit == parameter.find(f"{SSV}Real").get("unit")
    units = {u.get("name") for u in structure.iter(f"{SSC}Unit")}
    assert units >= {r.get("unit") for r in structure.iter(f"{SSC}Real", f"{SSV}Real")}


def test_connections_are_those_by_name(structure, unpacked):
    """Every wheel and every position; both ends are connectors of their components."""
    found = {
        tuple(c.get(k) for k in ("startElement", "startConnector", "endElement", "endConnector"))
        for c in structure.iter(f"{SSD}Connection")
    }
    expected = {("vehicle", f"{w}.wheel_z", "track", f"{w}.wheel_z") for w in WHEELS}
    expected |= {("track", f"{w}.force_z", "vehicle", f"{w}.force_z") for w in WHEELS}
    positions = [f"wheelset[{i}].position" for i in (1, 2, 3, 4)]
    expected |= {("vehicle", p, "track", p) for p in positions}
    assert found == expected
    ends = {
        (component.get("name"), connector.get("name"), connector.get("kind"))
        for component in structure.iter(f"{SSD}Component")
        for connector in component.iter(f"{SSD}Connector")
    }
    for source, output, target, input_ in found:
        assert (source, output, "output") in ends
        assert (target, input_, "input") in ends


def test_every_input_connector_is_fed(structure):
    """FMPy 0.3.32 feeds an input connector without a connection from the connection before it."""
    fed = {(c.get("endElement"), c.get("endConnector")) for c in structure.iter(f"{SSD}Connection")}
    for component in structure.iter(f"{SSD}Component"):
        for connector in component.iter(f"{SSD}Connector"):
            if connector.get("kind") == "input":
                assert (component.get("name"), connector.get("name")) in fed


def test_it_starts_at_rest(structure, unpacked):
    """The FMUs out of the SSP, its parameters set: nothing is accelerated, and nothing moves."""
    start = {
        p.get("name"): float(p.find(f"{SSV}Real").get("value"))
        for p in structure.iter(f"{SSV}Parameter")
    }
    with (
        FmuComponent.load(unpacked["vehicle"], name="vehicle") as vehicle,
        FmuComponent.load(unpacked["track"], name="track") as track,
    ):
        vehicle.set_parameters({**start, "speed": 0.0})
        system = System([vehicle, track], connect_by_name([vehicle, track]))
        for fmu in (vehicle, track):
            fmu.enter_initialization(0.0)
        system.exchange()
        az = [k for k, name in enumerate(system.names) if name.endswith(".az")]
        # The contact solves its compression to 1e-12, and k_H times that of 1e-4 m is 1e-7 N on
        # a wheelset of 1.7 t: 1e-10 m/s2. A height 1e-9 m off would give 1e-4 m/s2.
        assert np.abs(system.outputs[az]).max() < 1e-9
        forces = system.outputs[[system.names.index(f"track.{w}.force_z") for w in WHEELS]]
        assert forces == pytest.approx(np.full(8, Vehicle().wheel_load), rel=1e-9)  # see above
        for fmu in (vehicle, track):
            fmu.exit_initialization()
        before = system.outputs.copy()
        for k in range(20):
            for fmu in (vehicle, track):
                fmu.do_step(k * 1e-3, 1e-3)
        system.begin(0.0)
        system.exchange()
        moved = np.abs(system.outputs - before)[[n.endswith("_z") for n in system.names]]
        nominal = [v.nominal for v in system.variables if v.name.endswith("_z")]
        assert (moved < 1e-9 * np.array(nominal)).all()  # 1e-12 m, see above


def test_fmpy_reads_it(pair):
    """Validated, with 20 connections between different components."""
    described = fmpy_ssd.read_ssd(str(pair))
    assert len(described.system.connections) == 20
    assert len(fmpy_ssd.get_connections(described.system)) == 20


PAPER, WAGON = read_stock(Path("paper")), read_stock(Path("wagon"))
TRAIN = Train(
    vehicles=(TrainVehicle(vehicle=WAGON, reversed=True), TrainVehicle(vehicle=PAPER)),
)


@pytest.fixture(scope="module")
def apart(tmp_path_factory):
    """The folder of a wagon and the paper's vehicle as an FMU each, and of both as one."""
    folder = tmp_path_factory.mktemp("apart")
    mesh = Mesh(cells=8, elements_per_bay=2, highest_slab_frequency=200, highest_frequency=1000)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RingWarning)  # as coarse as it can be
        export_pair(TRAIN, Track(mesh=mesh), folder, separate=True, runtime=BARE)
        export_pair(TRAIN, Track(mesh=mesh), folder / "one", runtime=BARE)
    return folder


def recorded(system):
    """Forces of a system from an SSP file, 5 ms of rolling."""
    with open_ssp(system) as loaded:
        joined = System(loaded.components, loaded.connections)
        initialise(joined, loaded.fmus, 0.0)
        points = list(cosimulate(joined, jacobi(degree=1), 1e-4, 5e-3))
        columns = [joined.names.index(f"track.{name}") for name in Layout(6).names(FORCE)]
        return joined.names, np.array([p.outputs for p in points]), columns


@pytest.mark.slow  # ten FMUs
@pytest.mark.filterwarnings("ignore::railcosim.track.decay.RingWarning")
def test_one_component_a_vehicle(apart) -> None:
    """At rest, and rolling as the same train in one FMU does: wheelsets are numbered through."""
    assert {p.stem for p in apart.glob("*.fmu")} == {
        "Vehicle1", "Vehicle2", "VehicleWithContact1", "VehicleWithContact2", "Track",
        "TrackWithContact",
    }  # fmt: skip
    with zipfile.ZipFile(apart / "Pair.ssp") as archive:
        structure = etree.fromstring(archive.read("SystemStructure.ssd"))
    schema("SystemStructureDescription.xsd").assertValid(structure)
    assert len(fmpy_ssd.read_ssd(str(apart / "Pair.ssp")).system.connections) == 6 + 2 * 12
    names, ours, columns = recorded(apart / "Pair.ssp")
    still = [k for k, name in enumerate(names) if name.endswith(".az")]
    assert len(still) == 10  # two car bodies, two bogies, six wheelsets
    assert np.abs(ours[0, still]).max() < 1e-9  # see `test_it_starts_at_rest`
    _, theirs, there = recorded(apart / "one" / "Pair.ssp")
    forces, same = ours[:, columns], theirs[:, there]
    loads = build_multibody(TRAIN).wheel_load
    assert forces[0] == pytest.approx(np.tile(loads, 2), rel=1e-9)
    assert np.ptp(forces, axis=0).min() > 1.0  # N: the rail's shape over sleepers
    assert np.abs(forces - same).max() < 1e-11 * loads.max()


@pytest.mark.slow  # the same
@pytest.mark.filterwarnings("ignore::railcosim.track.decay.RingWarning")
def test_vehicles_stand_where_the_train_has_them(apart) -> None:
    """So nobody need say where, and each is its own parameters."""
    fmus = [apart / f"Vehicle{number}.fmu" for number in (1, 2)]
    expected = wheelset_positions(apart / "one" / "Vehicle.fmu")
    assert wheelset_positions(fmus) == pytest.approx(expected, abs=1e-12)


def test_couplers_are_of_one_fmu(tmp_path) -> None:
    coupled = replace(TRAIN, coupler=Coupler(damping=1e3))
    with pytest.raises(ParameterError, match=r"damping = 1000 N.s/m: must be 0 where"):
        export_pair(coupled, Track(), tmp_path, separate=True)
