"""The four FMUs as an importing tool sees them."""

import json
import os
import subprocess
import sys
import textwrap
import zipfile

import fmpy
import numpy as np
import pytest
from fmpy import read_model_description

from railcosim.analysis.response.models import way_to
from railcosim.fmus.export import NATIVE, WITH_STATES, PythonRuntime, export
from railcosim.fmus.start import contact_defaults
from railcosim.master.component import ComponentError, Hold
from railcosim.master.fmi.archive import FmuError
from railcosim.master.fmi.fmu import FmuComponent
from railcosim.master.linear.model_exchange import linear_model
from railcosim.mechanics.law import HertzContact, LinearContact, Pressed
from railcosim.mechanics.motion import FromOutside, Inputs, Mover, OwnContact
from railcosim.mechanics.ports import Layout
from railcosim.vehicle.modal import vehicle_body
from railcosim.vehicle.multibody import build_multibody
from railcosim.vehicle.parameters import Vehicle

NAMES = ["Vehicle", "Track", "VehicleWithContact", "TrackWithContact"]
LOAD = Vehicle().wheel_load
HERTZ = HertzContact(C=contact_defaults(Vehicle()).C[0])
STATIC_COMPRESSION = (LOAD / HERTZ.C) ** (2 / 3)
WHEELS = [f"wheelset[{i}].{side}" for side in ("left", "right") for i in (1, 2, 3, 4)]
STEP = 1e-3


@pytest.fixture(scope="module", params=[WITH_STATES, PythonRuntime()], ids=["native", "python"])
def runtime(request):
    return request.param


@pytest.fixture(scope="module")
def made(runtime, packed_by):
    """The four FMUs by name, with either runtime."""
    return packed_by(runtime)


@pytest.fixture
def started(made):
    """Instances by name, initialised; parameters and inputs as given."""
    opened = []

    def start(name, parameters=None, **inputs):
        component = FmuComponent.load(made[name])
        opened.append(component)
        component.set_parameters(parameters or {})
        component.enter_initialization(0.0)
        component.set_inputs(values(component, **inputs))
        component.exit_initialization()
        return component

    yield start
    for component in opened:
        component.close()


def names(variables):
    return [v.name for v in variables]


def values(component, **quantities):
    """Start values of the inputs; `force_z=[...]` sets that of the 8 wheels, or 4 wheelsets."""
    u = {v.name: v.start for v in component.inputs}
    for quantity, given in quantities.items():
        owners = WHEELS if len(given) == 8 else [f"wheelset[{i}]" for i in (1, 2, 3, 4)]
        for owner, value in zip(owners, given, strict=True):
            assert f"{owner}.{quantity}" in u
            u[f"{owner}.{quantity}"] = value
    return np.array(list(u.values()))


def wheel_outputs(component, quantity):
    y = dict(zip(names(component.outputs), component.get_outputs(), strict=True))
    return np.array([y[f"{wheel}.{quantity}"] for wheel in WHEELS])


def shaken(component, seed):
    """Inputs away from the start values by some per cent of their nominal size."""
    random = np.random.default_rng(seed)
    size = np.array([0.05 if v.unit == "m" and "position" in v.name else v.nominal * 0.1
                     for v in component.inputs])  # fmt: skip
    return values(component) + size * random.uniform(-1, 1, len(size))


# --- the files --------------------------------------------------------------------------------


@pytest.mark.parametrize("name", NAMES)
def test_description(made, name):
    described = fmpy.read_model_description(str(made[name]))
    assert described.fmiVersion == "2.0"
    assert described.modelName == name
    units = {u.name: u for u in described.unitDefinitions}
    for v in described.modelVariables:
        if v.causality == "local":  # a state or its derivative
            continue
        if v.type == "Real" and v.causality != "independent":
            assert v.unit in units, v.name
        assert v.description, v.name
        assert (v.start is not None) == (v.causality in {"input", "parameter"}), v.name
    newton, metre = units["N"].baseUnit, units["m"].baseUnit
    assert (newton.kg, newton.m, newton.s, newton.factor) == (1, 1, -2, 1.0)
    assert (metre.m, metre.kg) == (1, 0)
    assert described.coSimulation.canGetAndSetFMUstate
    assert described.coSimulation.canSerializeFMUstate
    assert described.coSimulation.canHandleVariableCommunicationStepSize


def dependencies(path):
    """Inputs by output; native FMUs depend on states as well."""
    described = fmpy.read_model_description(str(path))
    return {
        u.variable.name: {d.name for d in u.dependencies if d.causality == "input"}
        for u in described.outputs
    }


@pytest.mark.parametrize("i", [1, 4])
@pytest.mark.parametrize("side", ["left", "right"])
def test_dependencies_are_declared(made, i, side):
    wheelset, wheel = f"wheelset[{i}]", f"wheelset[{i}].{side}"
    track, with_contact = (dependencies(made[n]) for n in ("Track", "TrackWithContact"))
    assert track[f"{wheel}.rail_z"] == {f"{wheelset}.position"}
    assert with_contact[f"{wheel}.rail_z"] == {f"{wheelset}.position"}
    assert with_contact[f"{wheel}.force_z"] == {
        f"{wheelset}.position", f"{wheel}.wheel_z", f"{wheel}.irregularity_z"
    }  # fmt: skip
    vehicle, with_contact = (dependencies(made[n]) for n in ("Vehicle", "VehicleWithContact"))
    assert vehicle[f"{wheel}.wheel_z"] == with_contact[f"{wheel}.wheel_z"] == set()
    assert vehicle[f"{wheelset}.az"] == {f"{wheelset}.left.force_z", f"{wheelset}.right.force_z"}
    assert with_contact[f"{wheel}.force_z"] == {f"{wheel}.rail_z", f"{wheel}.irregularity_z"}
    assert vehicle["carbody.az"] == set()


@pytest.mark.parametrize("name", NAMES)
def test_declared_dependencies_are_the_real_ones(started, name):
    """Every input changed alone, far enough to show, at a time when everything moves."""
    contact = {"wheel_z": [STATIC_COMPRESSION] * 8} if name == "TrackWithContact" else {}
    contact = {"rail_z": [-STATIC_COMPRESSION] * 8} if name == "VehicleWithContact" else contact
    component = started(name, **contact)
    base = values(component, **contact)
    component.set_inputs(base + 0.01 * (shaken(component, 1) - values(component)))
    component.do_step(0.0, STEP)
    component.set_inputs(base)
    y = component.get_outputs()
    found = np.zeros(component.feedthrough.shape, dtype=bool)
    for j, variable in enumerate(component.inputs):
        u = base.copy()
        u[j] += 1e-2 * variable.nominal
        component.set_inputs(u)
        found[:, j] = component.get_outputs() != y
    unexpected = found & ~component.feedthrough
    assert not unexpected.any(), np.argwhere(unexpected)
    missing = component.feedthrough & ~found
    assert not missing.any(), [
        (component.outputs[i].name, component.inputs[j].name) for i, j in np.argwhere(missing)
    ]


@pytest.mark.slow  # made twice by every runtime
def test_the_same_parameters_make_the_same_fmu(made, runtime, short_track, tmp_path):
    again = export(Vehicle(), short_track, tmp_path, runtime=runtime)
    for name in NAMES:
        guids = [fmpy.read_model_description(str(p[name])).guid for p in (made, again)]
        assert guids[0] == guids[1]
        # A checkpoint knows its FMUs by their digest.
        assert made[name].read_bytes() == again[name].read_bytes()


def test_runtime_modules_are_named_by_their_content(made, runtime):
    """Two FMUs with different code must not share modules in one host process."""
    if not isinstance(runtime, PythonRuntime):
        pytest.skip("a native FMU has no modules")
    packages = set()
    for path in made.values():
        with zipfile.ZipFile(path) as archive:
            packages |= {
                n.split("/")[1] for n in archive.namelist()
                if n.startswith("resources/railcosim_") and n.count("/") > 1
            }  # fmt: skip
    assert len(packages) == 1
    assert len(packages.pop()) == len("railcosim_") + 12


def test_an_interrupted_export_leaves_the_older_file(short_contents, tmp_path, monkeypatch):
    target, content = tmp_path / "Vehicle.fmu", short_contents["Vehicle"]
    target.write_bytes(b"an older one")
    write = zipfile.ZipFile.writestr

    def interrupted(archive, entry, data, *options):
        if entry.filename.startswith("documentation/"):
            raise KeyboardInterrupt
        write(archive, entry, data, *options)

    monkeypatch.setattr(zipfile.ZipFile, "writestr", interrupted)
    with pytest.raises(KeyboardInterrupt):
        NATIVE.pack(content, target, str)
    assert target.read_bytes() == b"an older one"
    assert list(tmp_path.iterdir()) == [target]


def test_a_plain_track_is_small(short_contents, exported, tmp_path):
    """A tool that lists variables and draws what depends on what sees the interface alone."""
    track, content = tmp_path / "Track.fmu", short_contents["Track"]
    NATIVE.pack(content, track, str)
    small, large = (read_model_description(str(p)) for p in (track, exported["Track"]))
    assert len(small.modelVariables) == len(content.table) + 1  # derivatives_of_step
    assert small.modelExchange is None
    assert large.modelExchange is not None
    assert len(large.modelVariables) > 20 * len(small.modelVariables)
    assert small.guid != large.guid  # who knows one by it does not know the other
    with pytest.raises(FmuError, match=r"no Model Exchange in it; .* export --model-exchange"):
        linear_model(track)
    with pytest.warns(
        UserWarning, match=r"linearised by pulses; .*export --model-exchange\) it is"
    ):
        way_to(track, Layout())


# --- the start --------------------------------------------------------------------------------


def test_vehicle_starts_in_equilibrium(started):
    vehicle = started("Vehicle")
    y = dict(zip(names(vehicle.outputs), vehicle.get_outputs(), strict=True))
    accelerations = [value for name, value in y.items() if name.endswith(".az")]
    # 94 m/s2 for a wheelset without a contact force.
    assert np.abs(accelerations).max() < 1e-9
    for _ in range(10):
        vehicle.do_step(0.0, 0.1)
    assert np.abs(wheel_outputs(vehicle, "wheel_z")).max() < 1e-12


def test_track_starts_with_its_static_deflection(started, short_reduced):
    force = LOAD * np.linspace(0.5, 1.5, 8)
    position = np.array([21.0, 18.5, 5.3, 2.8])
    track = started("Track", force_z=force, position=position)
    body = short_reduced.under(Layout())
    expected = body.at(position).static_compliance() @ force
    start = wheel_outputs(track, "rail_z")
    assert start == pytest.approx(expected, rel=1e-12)  # the same numbers in another order
    assert 5e-4 < start.min() < start.max() < 3e-3  # about a millimetre under a wheel
    for k in range(20):
        track.do_step(k * STEP, STEP)
    assert wheel_outputs(track, "rail_z") == pytest.approx(start, rel=1e-10)  # rounding


def test_start_heights(started):
    """All wheelsets 1 mm down: the whole vehicle is, and the forces are the static ones."""
    height = {f"wheelset[{i}].start_z": 1e-3 for i in (1, 2, 3, 4)}
    vehicle = started("VehicleWithContact", height, rail_z=[1e-3 - STATIC_COMPRESSION] * 8)
    y = dict(zip(names(vehicle.outputs), vehicle.get_outputs(), strict=True))
    assert y["carbody.z"] == pytest.approx(1e-3, rel=1e-12)
    assert y["bogie[2].z"] == pytest.approx(1e-3, rel=1e-12)
    assert wheel_outputs(vehicle, "force_z") == pytest.approx(np.full(8, LOAD), rel=1e-9)
    assert max(abs(y[f"wheelset[{i}].az"]) for i in (1, 2, 3, 4)) < 1e-6


def test_positions_advance_with_the_speed(started):
    vehicle = started("Vehicle", {"speed": 50.0, "start_position": 3.0})
    for k in range(4):
        vehicle.do_step(k * 0.25, 0.25)
    y = dict(zip(names(vehicle.outputs), vehicle.get_outputs(), strict=True))
    found = [y[f"wheelset[{i}].position"] for i in (1, 2, 3, 4)]
    # 2 L_t = 2.5 m in a bogie, 2 L_c = 15.7 m from bogie to bogie.
    assert found == pytest.approx(np.array([18.2, 15.7, 2.5, 0.0]) + 3.0 + 50.0)


# --- steps against the runtime, and the three holds -------------------------------------------


@pytest.mark.parametrize("hold", list(Hold))
def test_holds_of_the_vehicle(started, hold):
    first, second, third = (LOAD * (1 + 0.1 * np.random.default_rng(s).normal(size=8))
                            for s in (1, 2, 3))  # fmt: skip
    vehicle = started("Vehicle", force_z=first)
    vehicle.set_hold(hold)
    body = vehicle_body(build_multibody(Vehicle()))
    mover, state = Mover(body, FromOutside(), np.inf), body.on(np.zeros(4))

    def inputs(force):
        return Inputs(np.zeros(4), force)

    set_at = [second, third]
    for k, force in enumerate(set_at):
        vehicle.set_inputs(values(vehicle, force_z=force))
        vehicle.do_step(k * STEP, STEP)
    # Before a first step nothing is known to extrapolate from: held.
    lines = {
        Hold.CONSTANT: [(second, second), (third, third)],
        Hold.EXTRAPOLATE: [(second, second), (third, 2 * third - second)],
        Hold.INTERPOLATE: [(first, second), (second, third)],
    }[hold]
    for begin, end in lines:
        state = mover.step(state, inputs(begin), inputs(end), STEP)
    expected = body.at(np.zeros(4)).motion(state)
    assert np.abs(expected).max() > 1e-8  # something happened
    # The same arithmetic: rounding of extrapolated inputs only.
    assert wheel_outputs(vehicle, "wheel_z") == pytest.approx(expected, rel=1e-10, abs=1e-20)


def test_extrapolation_over_steps_of_different_length(started):
    force = [LOAD * (1 + 0.1 * np.random.default_rng(s).normal(size=8)) for s in (1, 2)]
    vehicle = started("Vehicle", force_z=force[0])
    vehicle.set_hold(Hold.EXTRAPOLATE)
    vehicle.do_step(0.0, 2e-3)
    vehicle.set_inputs(values(vehicle, force_z=force[1]))
    vehicle.do_step(2e-3, 5e-4)
    body = vehicle_body(build_multibody(Vehicle()))
    mover, state = Mover(body, FromOutside(), np.inf), body.on(np.zeros(4))
    after = force[1] + (force[1] - force[0]) * 0.5 / 2
    for begin, end, h in ((force[0], force[0], 2e-3), (force[1], after, 5e-4)):
        state = mover.step(state, Inputs(np.zeros(4), begin), Inputs(np.zeros(4), end), h)
    expected = body.at(np.zeros(4)).motion(state)
    assert wheel_outputs(vehicle, "wheel_z") == pytest.approx(expected, rel=1e-10, abs=1e-20)


def test_holds_may_change_during_a_run(started):
    """Inputs on one line in time are that line for either hold, so also for any mixture."""
    steps = [1e-3, 2e-3, 5e-4, 1e-3, 1e-3, 2e-3, 5e-4, 5e-4]
    mixed = [2, 2, 1, 1, 2, 1, 2, 2]  # 1 has no line before it has seen a step
    places, forces = np.array([21.0, 18.5, 5.3, 2.8]), LOAD * np.linspace(0.8, 1.2, 8)
    ends = []
    for holds in ([2] * len(steps), mixed):
        track, t = started("Track", position=places, force_z=forces), 0.0
        for hold, h in zip(holds, steps, strict=True):
            at = t + (h if hold == 2 else 0.0)  # what a value set with this hold is that of
            line = {"position": places + 70.0 * at, "force_z": forces * (1 + 20.0 * at)}
            track.set_hold(Hold(hold))
            track.set_inputs(values(track, **line))
            track.do_step(t, h)
            t += h
        ends.append(wheel_outputs(track, "rail_z"))
    assert ends[1] == pytest.approx(ends[0], rel=1e-10)  # rounding of where the line is


def test_outputs_stay_when_a_parameter_is_set(started):
    """They are for where the step took the inputs, not for the values it began with."""
    places = np.array([21.0, 18.5, 5.3, 2.8])
    track = started("Track", position=places)
    track.set_hold(Hold.EXTRAPOLATE)
    for k in range(2):
        track.set_inputs(values(track, position=places + 0.07 * k))
        track.do_step(k * STEP, STEP)
    y = track.get_outputs()
    track.set_hold(Hold.INTERPOLATE)
    assert np.array_equal(track.get_outputs(), y)
    track.set_inputs(values(track, position=places + 0.07))
    assert np.abs(track.get_outputs() - y).max() > 1e-6  # it would have shown


@pytest.mark.parametrize("linear", [False, True])
def test_track_with_contact_against_the_runtime(started, short_reduced, linear):
    """Interpolated wheel heights less irregularity, positions moving."""
    position, wheel = np.array([21.0, 18.5, 5.3, 2.8]), np.linspace(6e-4, 8e-4, 8)
    parameters = {"internal_step": 2e-4}
    law = HERTZ
    if linear:
        parameters |= {"contact.nonlinear": False, "contact.stiffness": 1.1e9}
        law = LinearContact(k_H=1.1e9)
    track = started("TrackWithContact", parameters, position=position, wheel_z=wheel)
    track.set_hold(Hold.INTERPOLATE)
    rough = 1e-5 * np.arange(8)
    track.set_inputs(
        values(track, position=position + 0.07, wheel_z=1.1 * wheel, irregularity_z=rough)
    )
    track.do_step(0.0, STEP)
    body = short_reduced.under(Layout())
    mover = Mover(body, OwnContact(Pressed(law, -1)), 2e-4)
    # At rest first: the balance is checked by its residual.
    shapes = body.at(position)
    force = HERTZ.force(wheel) if not linear else 1e8 * wheel
    G = shapes.static_compliance()
    for _ in range(600):
        force = 0.95 * force + 0.05 * law.force(wheel - G @ force)
    state = mover.step(
        shapes.rest(force), Inputs(position, wheel),
        Inputs(position + 0.07, 1.1 * wheel - rough), STEP,
    )  # fmt: skip
    expected = body.at(position + 0.07).motion(state)
    # The fixed-point iteration of the start: 0.95^600, and rounding.
    assert wheel_outputs(track, "rail_z") == pytest.approx(expected, rel=1e-9)
    compression = 1.1 * wheel - rough - expected
    assert wheel_outputs(track, "force_z") == pytest.approx(law.force(compression), rel=1e-7)


def test_irregularity_and_rail_enter_a_vehicles_contact_alike(started):
    """Lowering the rail's surface by irregularity is as lowering the rail."""
    dip = 1e-5 * np.arange(8)  # less than the static compression, 88e-6 m
    outputs = []
    for rail, rough in ((dip, np.zeros(8)), (np.zeros(8), dip)):
        vehicle = started("VehicleWithContact", rail_z=-STATIC_COMPRESSION + 0 * dip)
        vehicle.set_inputs(values(vehicle, rail_z=rail - STATIC_COMPRESSION, irregularity_z=rough))
        at_once = wheel_outputs(vehicle, "force_z")
        assert at_once[0] == pytest.approx(LOAD, rel=1e-9)
        assert np.all(np.diff(at_once) < 0)  # the lower the rail, the less it carries
        vehicle.do_step(0.0, STEP)
        outputs.append(vehicle.get_outputs())
    assert outputs[0] == pytest.approx(outputs[1], rel=1e-8, abs=1e-12)  # rounding of the sums


# --- state ------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("hold", [Hold.CONSTANT, Hold.EXTRAPOLATE])
def test_a_restored_step_gives_the_same_bits(started, name, hold):
    component = started(name)
    component.set_hold(hold)
    component.set_inputs(shaken(component, 1))
    component.do_step(0.0, STEP)
    component.set_inputs(shaken(component, 2))
    state = component.save_state()
    runs = []
    for _ in range(2):
        component.restore_state(state)
        component.set_inputs(shaken(component, 3))
        component.do_step(STEP, STEP)
        component.set_inputs(shaken(component, 4))
        component.do_step(2 * STEP, 0.5 * STEP)
        runs.append(component.get_outputs())
    component.restore_state(state)
    component.set_inputs(shaken(component, 5))
    component.do_step(STEP, STEP)
    assert np.array_equal(runs[0], runs[1])
    assert not np.array_equal(runs[0], component.get_outputs())


@pytest.mark.parametrize("name", NAMES)
def test_a_serialised_state_goes_on_in_another_instance(started, name):
    component, fresh = started(name), started(name)
    component.set_hold(Hold.EXTRAPOLATE)
    component.set_inputs(shaken(component, 1))
    component.do_step(0.0, STEP)
    data = component.serialize_state(component.save_state())
    fresh.restore_state(fresh.deserialize_state(data))
    for c in (component, fresh):
        c.set_inputs(shaken(c, 2))
        c.do_step(STEP, STEP)
    assert np.array_equal(component.get_outputs(), fresh.get_outputs())


# --- refusals ---------------------------------------------------------------------------------


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_an_input_that_is_no_number_is_refused_by_name(started, name, bad):
    component, twin = started(name), started(name)
    for c in (component, twin):
        c.set_inputs(shaken(c, 1))
        c.do_step(0.0, STEP)
    u = shaken(component, 2)
    u[5] = bad
    component.set_inputs(u)
    with pytest.raises(ComponentError) as refused:
        component.do_step(STEP, STEP)
    assert component.inputs[5].name in str(refused.value)
    assert str(bad) in str(refused.value)
    for c in (component, twin):  # nothing was lost
        c.set_inputs(shaken(c, 3))
        c.do_step(STEP, STEP)
    assert np.array_equal(component.get_outputs(), twin.get_outputs())


@pytest.mark.parametrize("name", ["Vehicle", "TrackWithContact"])
@pytest.mark.parametrize("step", [0.0, -1e-3, np.nan])
def test_a_step_that_does_not_go_forward_is_refused(started, name, step):
    component = started(name)
    before = component.get_outputs()
    with pytest.raises(ComponentError, match="step size"):
        component.do_step(0.0, step)
    assert np.array_equal(component.get_outputs(), before)


# --- several instances ------------------------------------------------------------------------


def test_two_instances_at_once_do_not_meet(started):
    one, other = started("Track"), started("Track")
    alone = started("Track")
    for k in range(3):
        one.set_inputs(shaken(one, k))
        other.set_inputs(shaken(other, 10 + k))
        one.do_step(k * STEP, STEP)
        other.do_step(k * STEP, STEP)
    for k in range(3):
        alone.set_inputs(shaken(alone, k))
        alone.do_step(k * STEP, STEP)
    assert np.array_equal(one.get_outputs(), alone.get_outputs())
    assert not np.array_equal(one.get_outputs(), other.get_outputs())


def test_instance_after_instance(made):
    outputs = []
    for name in ("Vehicle", "Track", "Vehicle", "Track"):
        with FmuComponent.load(made[name]) as component:
            component.enter_initialization(0.0)
            component.exit_initialization()
            component.set_inputs(shaken(component, 1))
            component.do_step(0.0, STEP)
            outputs.append(component.get_outputs())
    assert np.array_equal(outputs[0], outputs[2])
    assert np.array_equal(outputs[1], outputs[3])


ALONE = """
    import json, sys
    import fmpy  # what FMPy itself needs is its own affair

    HIDDEN = {"railcosim", "scipy"}

    class Hidden:
        def find_spec(self, name, path=None, target=None):
            if name.split(".")[0] in HIDDEN:
                raise ImportError(name + " is hidden")

    def loaded():
        return sorted({n.split(".")[0] for n in sys.modules} & HIDDEN)

    for name in [n for n in sys.modules if n.split(".")[0] in HIDDEN]:
        del sys.modules[name]
    sys.meta_path.insert(0, Hidden())
    for name in HIDDEN:
        try:
            __import__(name)
        except ImportError:
            continue
        raise AssertionError("not hidden")
    result = fmpy.simulate_fmu(sys.argv[1], stop_time=0.01, output_interval=1e-3)
    last = [float(v) for v in result[-1]]
    print(json.dumps({"time": last[0], "rows": len(result), "loaded": loaded(),
                      "finite": all(abs(v) < 1e9 for v in last)}))
"""


@pytest.mark.parametrize("name", NAMES)
def test_runs_where_only_numpy_is(made, name):
    """pythonfmu's loader is in the FMU; its Python part is in the FMU's resources."""
    result = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(ALONE), str(made[name])],
        capture_output=True, text=True, timeout=1800, check=False,
        env=os.environ | {"OPENBLAS_NUM_THREADS": "1"},
    )  # fmt: skip
    assert result.returncode == 0, result.stdout + result.stderr
    told = json.loads(result.stdout.splitlines()[-1])
    assert told == {"time": pytest.approx(0.01), "loaded": [], "finite": True, "rows": 11}
