"""Directional derivatives and Model Exchange of the native FMUs, through FMPy alone."""

import ctypes
import runpy
import shutil
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Model, FMU2Slave

from railcosim.fmus.export import NativeRuntime
from railcosim.mechanics.ports import Layout
from railcosim.mechanics.stepping import State
from railcosim.vehicle.multibody import build_multibody
from railcosim.vehicle.parameters import Vehicle

EXAMPLE = Path(__file__).parents[2] / "examples" / "linear_track.py"
WHEELS = [f"wheelset[{i}].{side}" for side in ("left", "right") for i in (1, 2, 3, 4)]
FORCES = [f"{wheel}.force_z" for wheel in WHEELS]
POSITIONS = [f"wheelset[{i}].position" for i in (1, 2, 3, 4)]
FREQUENCY = np.geomspace(0.5, 2000, 60)  # Hz
RESTS = {"TrackWithContact": ("wheel_z", 1.3e-3), "VehicleWithContact": ("rail_z", -88e-6)}


class Importer:
    """An FMU in FMPy, by names; initialised under its start values, or `start`."""

    def __init__(self, path, kind, start=None, *, linear=False):
        self.description = fmpy.read_model_description(str(path), validate=False)
        self.folder = fmpy.extract(str(path))
        part = {FMU2Slave: "coSimulation", FMU2Model: "modelExchange"}[kind]
        self.fmu = kind(
            guid=self.description.guid, unzipDirectory=self.folder, instanceName="it",
            modelIdentifier=getattr(self.description, part).modelIdentifier,
        )  # fmt: skip
        variables = self.description.modelVariables
        self.reference = {v.name: v.valueReference for v in variables}
        self.inputs = [v.name for v in variables if v.causality == "input"]
        self.outputs = [v.name for v in variables if v.causality == "output"]
        self.start = {
            v.name: float(v.start) for v in variables
            if v.causality in {"input", "parameter"} and v.type == "Real"
        }  # fmt: skip
        self.start |= start or {}
        self.fmu.instantiate()
        if "contact.nonlinear" in self.reference:
            self.fmu.setBoolean([self.reference["contact.nonlinear"]], [not linear])
        self.fmu.setupExperiment(startTime=0.0)
        self.fmu.enterInitializationMode()
        self.set(self.start)
        self.time = 0.0

    def set(self, values):
        self.fmu.setReal([self.reference[n] for n in values], list(values.values()))

    def get(self, names):
        return np.array(self.fmu.getReal([self.reference[n] for n in names]))

    def step(self, h, **more):
        self.fmu.doStep(self.time, h, **more)
        self.time += h

    def derivative(self, unknowns, seed):
        return np.array(
            self.fmu.getDirectionalDerivative(
                [self.reference[n] for n in unknowns],
                [self.reference[n] for n in seed],
                list(seed.values()),
            )
        )

    def close(self):
        self.fmu.freeInstance()
        shutil.rmtree(self.folder, ignore_errors=True)


@pytest.fixture
def importer(exported):
    opened = []

    def load(name, kind=FMU2Slave, *, linear=False):
        quantity, value = RESTS.get(name, ("", 0.0))
        rest = {f"{wheel}.{quantity}": value for wheel in WHEELS} if quantity else {}
        opened.append(Importer(exported[name], kind, rest, linear=linear))
        return opened[-1]

    yield load
    for one in opened:
        one.close()


# --- Model Exchange: the linear model, exactly --------------------------------------------------


def carried(body, position):
    """Receptance at the 8 contacts from the modes of the Python model, (n_omega, 8, 8)."""
    shapes, none = body.at(position), np.empty(0)
    out = np.empty((FREQUENCY.size, 8, 8), dtype=complex)
    for j in range(8):
        b = shapes.drive(np.eye(8)[j]).s
        for k, w in enumerate(2 * np.pi * FREQUENCY):
            plus, minus = b / (1j * w - body.poles), b / (-1j * w - body.poles)
            out[k, :, j] = shapes.motion(State((plus + minus) / 2, none, none))
            out[k, :, j] += 1j * shapes.motion(State(1j * (minus - plus) / 2, none, none))
    return out


def receptance(path, quantity):
    """From the FMU by the example's code, which knows FMPy and SciPy only."""
    model = runpy.run_path(str(EXAMPLE))["LinearFmu"](path)
    try:
        return model.receptance(FREQUENCY, FORCES, [f"{wheel}.{quantity}" for wheel in WHEELS])
    finally:
        model.close()


def test_receptance_of_the_track_from_model_exchange(exported, importer, short_reduced):
    found = receptance(exported["Track"], "rail_z")
    start = importer("Track").start
    position = np.array([start[name] for name in POSITIONS])
    exact = carried(short_reduced.under(Layout()), position)
    # Of the largest at that frequency. Near resonance i omega - A loses as many digits as the
    # peak is high: measured 8e-13 near the pinned-pinned resonance, which nothing damps.
    error = np.abs(found - exact).max(axis=(1, 2)) / np.abs(exact).max(axis=(1, 2))
    assert error.max() < 1e-12


def test_receptance_of_the_vehicle_from_model_exchange(exported):
    """Against M, C and K themselves."""
    found = receptance(exported["Vehicle"], "wheel_z")
    body = build_multibody(Vehicle())
    omega = 2 * np.pi * FREQUENCY[:, None, None]
    direct = np.linalg.inv(-(omega**2) * body.M + 1j * omega * body.C + body.K)
    wheelsets = body.wheelsets
    exact = -np.tile(direct[:, wheelsets[:, None], wheelsets], (1, 2, 2))  # a contact force lifts
    error = np.abs(found - exact).max(axis=(1, 2)) / np.abs(exact).max(axis=(1, 2))
    # Rounding of the eigenproblem and of stiffness against inertia at 2 kHz: measured 2e-11.
    assert error.max() < 1e-9


@pytest.mark.parametrize("name", ["Track", "Vehicle"])
def test_states_and_rates_of_model_exchange(importer, name):
    """At rest nothing moves; a state set is the state got; a rate is linear in the states."""
    model = importer(name, FMU2Model)
    model.fmu.exitInitializationMode()
    model.fmu.enterContinuousTimeMode()
    n = len(model.description.derivatives)
    x, rate, again = (np.zeros(n) for _ in range(3))
    pointer = ctypes.POINTER(ctypes.c_double)
    given = [a.ctypes.data_as(pointer) for a in (x, rate, again)]
    model.fmu.getContinuousStates(given[0], n)
    model.fmu.getDerivatives(given[1], n)
    fastest = 2 * np.pi * 1500
    assert np.abs(rate).max() < 1e-9 * max(fastest * np.abs(x).max(), 1e-3)  # rounding
    rest = rate.copy()
    dx = np.random.default_rng(1).normal(size=n)
    x += dx
    model.fmu.setContinuousStates(given[0], n)
    model.fmu.getContinuousStates(given[2], n)
    assert np.array_equal(x, again)
    model.fmu.getDerivatives(given[1], n)
    names = [u.variable for u in model.description.derivatives]
    seed = {v.derivative.name: d for v, d in zip(names, dx, strict=True)}
    change = model.derivative([v.name for v in names], seed)
    assert rate - rest == pytest.approx(change, abs=1e-12 * np.abs(change).max())  # rounding


@pytest.fixture(scope="module")
def third(packed_by):
    """FMI 3.0."""
    return packed_by(NativeRuntime(fmi=3, documented=False))


@pytest.mark.parametrize("fmi", [2, 3])
def test_a_solver_follows_the_exact_steps(exported, third, fmi):
    """CVode on Model Exchange against Co-Simulation: wheels that are loaded more at once."""
    path = str((exported if fmi == 2 else third)["Vehicle"])
    output = [f"{wheel}.wheel_z" for wheel in WHEELS] + ["carbody.z", "carbody.pitch"]
    start = {name: 80e3 + 1e3 * k for k, name in enumerate(FORCES)}
    by_kind = [
        fmpy.simulate_fmu(
            path, fmi_type=kind, stop_time=0.5, output_interval=0.01, start_values=start,
            relative_tolerance=1e-10, output=output,
        )
        for kind in ("ModelExchange", "CoSimulation")
    ]  # fmt: skip
    for name in output:
        solved, stepped = (np.asarray(result[name]) for result in by_kind)
        # The solver's tolerance, over some thousand steps.
        assert solved == pytest.approx(stepped, abs=1e-6 * float(np.abs(stepped).max())), name
        assert np.abs(stepped).max() > 1e-6, name


# --- Co-Simulation: at the communication point, and over the last step ---------------------------


def moving(fmu, k, h, speed=60.0):
    """Inputs at communication point k: wheels roll, everything else swings."""
    values = {}
    for j, name in enumerate(fmu.inputs):
        value = fmu.start[name]
        if name.endswith("position"):
            values[name] = value + speed * k * h
        else:
            size = {"force_z": 2e4, "wheel_z": 2e-5, "rail_z": 2e-5}.get(name.split(".")[-1], 1e-5)
            values[name] = value + size * np.sin(0.7 * k + j)
    return values


STEPS_OF_INPUTS = {"position": 5e-5, "force_z": 1e3}


def alike(fmu, found, difference, what, tolerance=2e-5):
    """Outputs of one kind are alike in size; their derivatives agree.

    Central differences are good to (step / scale)^2, and position's shapes have small kinks at
    nodes, 1e-4 m from which none of these is.
    """
    for kind in ("_z", "_vz", ".z", ".vz", ".az", ".pitch", "position"):
        rows = [j for j, output in enumerate(fmu.outputs) if output.endswith(kind)]
        if rows:
            largest = np.abs(difference[rows]).max()
            assert found[rows] == pytest.approx(difference[rows], abs=tolerance * largest), (
                what, kind,
            )  # fmt: skip


@pytest.mark.parametrize("name", ["Vehicle", "Track", "VehicleWithContact", "TrackWithContact"])
def test_derivative_at_the_communication_point(importer, name):
    """Against outputs for inputs set a little more and less, and zero where nothing is declared.

    What PyFMI and others take for what passes straight through: that of a step is a thousand times
    as large, and a master that corrects its inputs by it makes meganewtons.
    """
    fmu, h = importer(name), 2e-4
    fmu.fmu.exitInitializationMode()
    for k in range(3):
        fmu.set(moving(fmu, k, h))
        fmu.step(h)
    declared = {u.variable.name: {d.name for d in u.dependencies} for u in fmu.description.outputs}
    now, size = moving(fmu, 3, h), 0.0
    for known in fmu.inputs[:: max(1, len(fmu.inputs) // 6)]:
        step = STEPS_OF_INPUTS.get(known.split(".")[-1], 1e-7)
        ends = []
        for sign in (1, -1):
            fmu.set({**now, known: now[known] + sign * step})
            ends.append(fmu.get(fmu.outputs))
        fmu.set(now)
        found = fmu.derivative(fmu.outputs, {known: 1.0})
        alike(fmu, found, (ends[0] - ends[1]) / (2 * step), known)
        assert not found[[known not in declared[output] for output in fmu.outputs]].any()
        size = max(size, np.abs(found).max())
    assert size > 0  # something passes straight through each of them


@pytest.mark.parametrize("hold", [0, 1, 2], ids=["held", "extrapolated", "interpolated"])
@pytest.mark.parametrize("name", ["Vehicle", "Track", "VehicleWithContact", "TrackWithContact"])
def test_derivative_of_the_last_step(importer, name, hold):
    """Against repeated steps with inputs a little more and a little less."""
    fmu, h = importer(name), 2e-4
    fmu.fmu.setInteger([fmu.reference["input_hold"]], [hold])
    fmu.fmu.setBoolean([fmu.reference["derivatives_of_step"]], [True])
    fmu.fmu.exitInitializationMode()
    for k in range(3):
        fmu.set(moving(fmu, k, h))
        fmu.step(h)
    now, time = moving(fmu, 3, h), fmu.time
    state = fmu.fmu.getFMUState()

    def after(values):
        fmu.fmu.setFMUState(state)
        fmu.time = time
        fmu.set(values)
        fmu.step(h)
        return fmu.get(fmu.outputs)

    for known in fmu.inputs[:: max(1, len(fmu.inputs) // 6)]:
        step = STEPS_OF_INPUTS.get(known.split(".")[-1], 1e-7)
        more, less = (after({**now, known: now[known] + sign * step}) for sign in (1, -1))
        difference = (more - less) / (2 * step)
        after(now)
        found = fmu.derivative(fmu.outputs, {known: 1.0})
        alike(fmu, found, difference, known)
    fmu.fmu.freeFMUState(state)


STEPS = {  # of central differences
    "position": 1e-4, "force_z": 1e3, "stiffness": 1e5, "hertz_coefficient": 1e7, "speed": 1e-3,
    "start_position": 1e-3,
}  # fmt: skip


@pytest.mark.parametrize("linear", [False, True])
@pytest.mark.parametrize("name", ["Vehicle", "Track", "VehicleWithContact", "TrackWithContact"])
def test_derivative_at_rest(importer, exported, name, linear):
    """In initialisation: what is at rest by inputs and parameters, against other starts."""
    fmu = importer(name, linear=linear)
    parameters = [
        v.name for v in fmu.description.modelVariables
        if v.causality == "parameter" and v.type == "Real" and v.name != "internal_step"
    ]  # fmt: skip
    moved = 0
    for known in fmu.inputs[::5] + parameters:
        step, ends = STEPS.get(known.split(".")[-1], 1e-7), []
        for sign in (1, -1):
            changed = {known: fmu.start[known] + sign * step}
            other = Importer(exported[name], FMU2Slave, {**fmu.start, **changed}, linear=linear)
            ends.append(other.get(fmu.outputs))
            other.close()
        difference = (ends[0] - ends[1]) / (2 * step)
        found = fmu.derivative(fmu.outputs, {known: 1.0})
        for quantity in {output.split(".")[-1] for output in fmu.outputs}:
            rows = [j for j, output in enumerate(fmu.outputs) if output.endswith(quantity)]
            if quantity == "rail_vz":  # zero at rest: rounding of modes of up to 1500 Hz
                deflection = [output.endswith("rail_z") for output in fmu.outputs]
                size = 2 * np.pi * 1500 * np.abs(found[deflection]).max()
                assert np.abs(found[rows]).max() <= 1e-9 * size, known
                continue
            largest = np.abs(difference[rows]).max()
            moved += largest > 0
            # Central differences of a contact force, step / compression = 1e-3 squared.
            assert found[rows] == pytest.approx(difference[rows], abs=2e-5 * largest), known
    assert moved


@pytest.mark.parametrize("name", RESTS)
def test_a_wheel_in_the_air_feels_nothing(importer, name):
    """No force, and none by what changes there; its neighbours' forces do change."""
    fmu, (quantity, rest) = importer(name), RESTS[name]
    lifted, resting = f"{WHEELS[1]}.{quantity}", f"{WHEELS[0]}.{quantity}"
    apart = -5e-3 if quantity == "wheel_z" else 5e-3  # m; the rail follows by 1 mm at most
    fmu.set({lifted: rest + apart})
    force = fmu.get(FORCES)
    assert force[1] == 0.0
    assert (np.delete(force, 1) > 1e4).all()
    assert not fmu.derivative(FORCES, {lifted: 1.0}).any()
    found = fmu.derivative(FORCES, {resting: 1.0})
    assert abs(found[0]) > 1e7  # N/m; of the track alone, 5e7
    assert found[1] == 0.0


def test_the_ring_closes(importer, short_track):
    """The same under wheels that have gone around, forwards or backwards."""
    fmu = importer("Track")
    fmu.set({name: 1e4 * (k + 1) for k, name in enumerate(FORCES)})
    rails = [f"{wheel}.rail_z" for wheel in WHEELS]
    places = dict(zip(POSITIONS, (18.5, 16.0, 2.8, 0.3), strict=True))
    found = []
    for turns in (0, 1, -1, -3):
        fmu.set({name: x + turns * 5.0 * short_track.mesh.cells for name, x in places.items()})
        found.append(fmu.get(rails))
    assert (found[0] > 0).all()
    for other in found[1:]:  # rounding of positions, 1e-14 m, on shapes of 0.6 m
        assert other == pytest.approx(found[0], rel=1e-10)


def test_position_by_time(importer):
    vehicle = importer("Vehicle")
    vehicle.fmu.exitInitializationMode()
    vehicle.step(1e-3)
    assert vehicle.derivative([POSITIONS[2]], {"time": 1.0}) == pytest.approx([250 / 3.6])


# --- derivatives of inputs and outputs in time ----------------------------------------------------


@pytest.mark.parametrize("name", ["Vehicle", "Track"])
def test_quadratic_inputs_are_stepped_exactly(importer, name):
    """One step over a parabola is two steps over its halves, with derivatives of each."""
    whole, halves, h = importer(name), importer(name), 4e-3
    slope, curve = 3e6, -2e9  # N/s, N/s2: some 10 kN over the step

    def given(fmu, t):
        for force in FORCES[:3]:
            ref = fmu.reference[force]
            fmu.set({force: fmu.start[force] + slope * t + curve * t**2 / 2})
            fmu.fmu.setRealInputDerivatives([ref, ref], [1, 2], [slope + curve * t, curve])

    for fmu in (whole, halves):
        fmu.fmu.exitInitializationMode()
    given(whole, 0.0)
    whole.step(h)
    for k in range(2):
        given(halves, k * h / 2)
        halves.step(h / 2)
    one, other = (fmu.get(fmu.outputs) for fmu in (whole, halves))
    assert one == pytest.approx(other, rel=1e-9, abs=1e-12 * np.abs(one).max())  # rounding
    straight = importer(name)
    straight.fmu.exitInitializationMode()
    straight.set({name: straight.start[name] for name in FORCES})
    straight.step(h)
    assert np.abs(straight.get(straight.outputs) - one).max() > 1e-6  # it did matter


def test_a_ramp_of_inputs(importer):
    """Derivatives of order one, and the same ramp as `input_hold` = 2 has it."""
    fmu, other, h = importer("Vehicle"), importer("Vehicle"), 3e-3
    other.fmu.setInteger([other.reference["input_hold"]], [2])
    for one in (fmu, other):
        one.fmu.exitInitializationMode()
    end = {name: fmu.start[name] + 1e4 * (k - 3) for k, name in enumerate(FORCES)}
    for name, value in end.items():
        fmu.fmu.setRealInputDerivatives([fmu.reference[name]], [1], [(value - fmu.start[name]) / h])
    other.set(end)
    for one in (fmu, other):
        one.step(h)
    # Rounding of the line; a car body that has moved 1e-9 m in 3 ms is a difference of larger ones.
    assert fmu.get(fmu.outputs) == pytest.approx(other.get(other.outputs), rel=1e-10, abs=1e-15)


def test_input_derivatives_are_set_all_or_none(importer):
    fmu, twin = importer("Track"), importer("Track")
    for one in (fmu, twin):
        one.fmu.exitInitializationMode()
    good, bad = fmu.reference[FORCES[0]], fmu.reference["wheelset[1].left.rail_z"]
    with pytest.raises(FMICallException):
        fmu.fmu.setRealInputDerivatives([good, bad], [1, 1], [1e9, 1.0])
    for one in (fmu, twin):
        one.step(1e-3)
    assert np.array_equal(fmu.get(fmu.outputs), twin.get(twin.outputs))


def output_slopes(fmu, names):
    references, found = [fmu.reference[n] for n in names], np.zeros(len(names))
    count = len(references)
    fmu.fmu.fmi2GetRealOutputDerivatives(
        fmu.fmu.component, (ctypes.c_uint * count)(*references), count,
        (ctypes.c_int * count)(*[1] * count), found.ctypes.data_as(ctypes.POINTER(ctypes.c_double)),
    )  # fmt: skip
    return found


@pytest.mark.parametrize("name", ["Vehicle", "Track", "VehicleWithContact", "TrackWithContact"])
def test_derivatives_of_outputs(importer, name):
    """Against the outputs a little later, inputs going on as they went."""
    fmu, h, little = importer(name), 2e-4, 1e-7
    fmu.fmu.setInteger([fmu.reference["input_hold"]], [1])
    fmu.fmu.exitInitializationMode()
    for k in range(4):
        fmu.set(moving(fmu, k, h))
        fmu.step(h)
    before, last = moving(fmu, 2, h), moving(fmu, 3, h)
    found = output_slopes(fmu, fmu.outputs)
    # Displacements alone are seen in another way.
    moved = [j for j, output in enumerate(fmu.outputs) if output.endswith("_z")]
    alone = output_slopes(fmu, [fmu.outputs[j] for j in moved])
    assert alone == pytest.approx(found[moved], abs=1e-9 * np.abs(found[moved]).max(initial=0.0))
    now = fmu.get(fmu.outputs)
    slope = {n: (last[n] - before[n]) / h for n in last}
    fmu.set({n: last[n] + slope[n] * h for n in last})
    for n, value in slope.items():
        fmu.fmu.setRealInputDerivatives([fmu.reference[n]], [1], [value])
    fmu.step(little)
    difference = (fmu.get(fmu.outputs) - now) / little
    for kind in ("_z", "_vz", ".z", ".vz", ".az", ".pitch", "position"):
        rows = [j for j, output in enumerate(fmu.outputs) if output.endswith(kind)]
        if rows:
            largest = np.abs(found[rows]).max()
            # One-sided: little times the second derivative, 1e-7 s x 2 pi 1500 Hz = 1e-3.
            assert found[rows] == pytest.approx(difference[rows], abs=3e-3 * largest), kind
