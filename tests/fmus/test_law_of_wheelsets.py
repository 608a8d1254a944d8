"""A vehicle whose wheelsets have different wheels: a contact law of each, in either runtime."""

from dataclasses import replace
from pathlib import Path

import fmpy
import numpy as np
import pytest

from railcosim.fmus.content import contents
from railcosim.fmus.export import NativeRuntime, PythonRuntime, packed
from railcosim.fmus.start import start_of
from railcosim.master.fmi.fmu import FmuComponent
from railcosim.parameters import ParameterError
from railcosim.track.parameters import Mesh, Track
from railcosim.vehicle.files import read_stock
from railcosim.vehicle.parameters import AxlePlace

WAGON = read_stock(Path("wagon"))
# One wheelset with other wheels, and farther from the middle: other laws, other loads.
MIXED = replace(
    WAGON,
    axles=(AxlePlace(x=4.5), AxlePlace(x=-3.5, wheelset=replace(WAGON.wheelset, radius=0.3))),
)
RADII = np.array([0.46, 0.3])
WEIGHT = 42e3 * 9.81 / 2  # of the car body, on a side, N
LOADS = 1500 * 9.81 / 2 + WEIGHT * np.array([3.5, 4.5]) / 8.0
C = 2 / 3 * 2.059e11 / (1 - 0.3**2) * (RADII * 0.3) ** 0.25
NAMES = [f"wheelset[{i}].contact.hertz_coefficient" for i in (1, 2)]
OWNERS = {"TrackWithContact": ("wheel_z", 2e-3), "VehicleWithContact": ("rail_z", -1e-4)}
RUNTIMES = {
    "native": NativeRuntime(documented=False),
    "python": PythonRuntime(documented=False),
    "fmi3": NativeRuntime(fmi=3, documented=False),
}

pytestmark = pytest.mark.filterwarnings("ignore::railcosim.track.decay.RingWarning")


@pytest.fixture(scope="module")
def fmus(tmp_path_factory):
    track = Track(mesh=Mesh(cells=6, highest_slab_frequency=300, highest_frequency=500))
    made, files = contents(MIXED, track), {}
    for name, runtime in RUNTIMES.items():
        runtime.prepare(print)
        with packed(made, tmp_path_factory.mktemp(name), runtime=runtime) as files[name]:
            pass
    return files


@pytest.mark.parametrize("runtime", RUNTIMES)
@pytest.mark.parametrize("name", [*OWNERS, "Vehicle"])
def test_parameters_of_every_wheelset(fmus, runtime, name):
    """Its own coefficient (Johnson) and, where it owns the contact, the tangent at its own load."""
    variables = fmpy.read_model_description(str(fmus[runtime][name])).modelVariables
    start = {v.name: v.start for v in variables}
    assert "contact.hertz_coefficient" not in start
    assert [float(start[n]) for n in NAMES] == pytest.approx(C, rel=1e-12)
    if name in OWNERS:
        told = [float(start[f"wheelset[{i}].contact.stiffness"]) for i in (1, 2)]
        assert told == pytest.approx(1.5 * C ** (2 / 3) * LOADS ** (1 / 3), rel=1e-9)


def run(path, name, parameters):
    """Outputs of a run under inputs that move, (steps, n_outputs), and their names."""
    quantity, pressed = OWNERS[name]
    with FmuComponent.load(path) as fmu:
        fmu.set_parameters(parameters)
        fmu.enter_initialization(0.0)
        start = np.array(
            [pressed if v.name.endswith(quantity) else v.start for v in fmu.inputs], dtype=float
        )
        fmu.set_inputs(start)
        fmu.exit_initialization()
        size = 0.02 * np.array([v.nominal * v.name.endswith("_z") for v in fmu.inputs])
        rolls = np.array([v.name.endswith("position") for v in fmu.inputs])
        rows = [fmu.get_outputs()]
        for k in range(20):
            wave = np.sin(0.02 * k * (1 + np.arange(start.size)))
            fmu.set_inputs(start + size * wave + 7e-3 * k * rolls)
            fmu.do_step(1e-4 * k, 1e-4)
            rows.append(fmu.get_outputs())
        return np.array(rows), [v.name for v in fmu.outputs]


@pytest.mark.parametrize("linear", [False, True])
@pytest.mark.parametrize("name", OWNERS)
def test_both_runtimes_agree(fmus, name, linear):
    parameters = {"contact.nonlinear": not linear}
    native, names = run(fmus["native"][name], name, parameters)
    other, _ = run(fmus["python"][name], name, parameters)
    size = np.abs(other).max(axis=0)
    error = np.abs(native - other).max(axis=0)[size > 0] / size[size > 0]
    # As for one law: the order of the sums over modes.
    assert error.max() < 1e-9
    # Both are pressed alike at first: the law of each tells.
    force = [names.index(f"wheelset[{i}].left.force_z") for i in (1, 2)]
    if name == "VehicleWithContact":
        number = 1.5 * C ** (2 / 3) * LOADS ** (1 / 3) if linear else C
        expected = number * 1e-4 ** (1.0 if linear else 1.5)
        assert native[0, force] == pytest.approx(expected, rel=1e-9)
    assert native[0, force[0]] != pytest.approx(native[0, force[1]], rel=1e-3)


@pytest.mark.parametrize("name", OWNERS)
def test_either_version_of_fmi(fmus, name):
    """The same bits, also with one wheelset's number set to another."""
    quantity, pressed = OWNERS[name]
    start = {NAMES[1]: 5e10} | {
        f"wheelset[{i}].{side}.{quantity}": pressed for i in (1, 2) for side in ("left", "right")
    }
    found = []
    for version, given in (
        ("native", start),
        ("fmi3", start),
        ("native", dict(list(start.items())[1:])),
    ):
        outputs = [f"wheelset[{i}].left.force_z" for i in (1, 2)]
        rows = fmpy.simulate_fmu(
            str(fmus[version][name]), start_values=given, output=outputs, stop_time=2e-3,
            output_interval=1e-4, fmi_type="CoSimulation",
        )  # fmt: skip
        found.append(np.array([rows[o] for o in outputs]))
    assert np.array_equal(found[0], found[1])
    assert found[0][1, 0] < 0.99 * found[2][1, 0]  # softer
    if name == "VehicleWithContact":  # whose wheelsets are held at rest
        assert found[0][0, 0] == found[2][0, 0]


@pytest.mark.parametrize("name", OWNERS)
def test_derivative_by_the_law_of_a_wheelset(fmus, name):
    """In initialisation, against central differences; a step of 1e-4 squares to rounding."""
    path, (quantity, pressed) = str(fmus["native"][name]), OWNERS[name]
    description = fmpy.read_model_description(path)
    reference = {v.name: v.valueReference for v in description.modelVariables}
    unknowns = [
        reference[f"wheelset[{i}].{side}.force_z"] for i in (1, 2) for side in ("left", "right")
    ]
    at = {r: pressed for n, r in reference.items() if n.endswith(quantity)}
    folder = fmpy.extract(path)
    made = []

    def opened(value):
        fmu = fmpy.fmi2.FMU2Slave(
            guid=description.guid, unzipDirectory=folder, instanceName="it",
            modelIdentifier=description.coSimulation.modelIdentifier,
        )  # fmt: skip
        made.append(fmu)
        fmu.instantiate()
        fmu.setupExperiment(startTime=0.0)
        fmu.enterInitializationMode()
        fmu.setReal([*at, reference[NAMES[1]]], [*at.values(), value])
        return fmu

    here, less, more = (opened(C[1] * (1 + d)) for d in (0.0, -1e-4, 1e-4))
    difference = np.subtract(more.getReal(unknowns), less.getReal(unknowns)) / (2e-4 * C[1])
    found = np.array(here.getDirectionalDerivative(unknowns, [reference[NAMES[1]]], [1.0]))
    assert np.abs(found[2:]).min() > 0
    assert found == pytest.approx(difference, abs=1e-6 * np.abs(difference).max())
    for fmu in made:
        fmu.freeInstance()


def test_a_track_for_other_wheelsets_needs_one_law():
    with pytest.raises(ParameterError, match="vehicle has 2 whose wheels have different"):
        start_of(MIXED, [10.0, 5.0, 0.0])
    start = start_of(MIXED, [10.0, 0.0], ("left",))
    assert start.loads == pytest.approx(LOADS)
    many = start_of(WAGON, [10.0, 5.0, 0.0])
    assert len(many.contact.C) == len(many.contact.k_H) == 1
    assert many.loads == pytest.approx([1500 * 9.81 / 2 + WEIGHT / 2] * 6)
