"""A vehicle that is met in five directions: names, both runtimes, and the vertical one.

Receptances, with directions, signs and sides, against mass, damping and stiffness by kinematics
written apart (`tests/vehicle/test_spatial_body.py`).
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fmpy import simulate_fmu
from scipy.linalg import eigh

from railcosim.analysis.pair.export_pair import PAIR, export_pair
from railcosim.analysis.response.choices import Gravity
from railcosim.analysis.response.frf import Assembly, frequency_response
from railcosim.analysis.response.hunting import critical_speed
from railcosim.analysis.response.map import response_map
from railcosim.analysis.response.models import linear_models
from railcosim.analysis.response.ride import ride
from railcosim.analysis.response.rolling_pair import told_wheels
from railcosim.fmus.content import Content, contents
from railcosim.fmus.export import WITH_STATES, NativeRuntime, PythonRuntime, export, packed
from railcosim.fmus.interface import interface
from railcosim.fmus.start import start_of
from railcosim.master.component import Hold
from railcosim.master.connections import CouplingError
from railcosim.master.fmi.fmu import FmuComponent
from railcosim.master.linear.model_exchange import differences, linear_model
from railcosim.mechanics.ports import DIMENSIONS, FORCE, OF_WHEELS, WHEEL, Layout
from railcosim.paper.figure import FORCE as PUSH
from railcosim.paper.figure import peak, sizes
from railcosim.paper.laboratory import CONTACTS, QUICK, Laboratory
from railcosim.parameters import ArgumentError, UnusualWarning
from railcosim.track.irregularity import QUALITIES
from railcosim.track.parameters import Mesh, Track
from railcosim.vehicle.files import read_stock
from railcosim.vehicle.modal import vehicle_body
from railcosim.vehicle.multibody import MODELS, SPATIAL, build_multibody
from railcosim.vehicle.parameters import (
    Geometry,
    PrimarySuspension,
    SecondarySuspension,
    Vehicle,
)
from railcosim.vehicle.properties import Rolling
from railcosim.vehicle.train import train_of

from ..fmpy_problems import problems_of
from ..vehicle.test_spatial_body import LEVEL, by_hand
from .test_any_wheelsets import table
from .test_spatial_fmus import inputs_of

pytestmark = pytest.mark.filterwarnings("ignore:a ring of")  # as short as it can be
LAYOUT = Layout(4, directions=OF_WHEELS["spatial"])
RUNTIMES = {"native": WITH_STATES, "FMI 3": NativeRuntime(fmi=3), "python": PythonRuntime()}
SHORT = Track(
    mesh=Mesh(cells=6, elements_per_bay=2, highest_slab_frequency=150, highest_frequency=200)
)
STEP = 1e-4  # s
# With dampers in all directions.
DAMPED = Vehicle(
    primary_suspension=PrimarySuspension(damping_x=3e3, damping_y=5e3),
    secondary_suspension=SecondarySuspension(
        damping_y=3e4, yaw_damper=4e5, roll_stiffness=9.4e5
    ),
)  # fmt: skip


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """FMUs by runtime."""
    both = [c for c in contents(DAMPED, SHORT, dimension="spatial") if not c.has_contact]
    files = {}
    for name, runtime in RUNTIMES.items():
        folder = tmp_path_factory.mktemp("vehicle")
        with packed(both, folder, runtime=runtime) as files[name]:
            pass
    return files


def alone(stock, folder, dimension="spatial"):
    """The native FMU of a vehicle, without a track."""
    body = vehicle_body(build_multibody(stock, MODELS[dimension]))
    start = start_of(stock, [18.5, 16.0, 2.8, 0.3], dimension=dimension)
    content = Content(
        name="Vehicle", model="vehicle", text="Moves.", parameters="", annotations={},
        table=interface(body, start, with_contact=False), body=body,
    )  # fmt: skip
    path = folder / f"{dimension}.fmu"
    RUNTIMES["native"].pack(content, path, lambda text: None)
    return path


@pytest.fixture(scope="module")
def vehicle(made):
    return made["native"]["Vehicle"]


def driven(path, force, hold=Hold.CONSTANT, steps=40, start=None):
    """Outputs by name after each step under forces (ports,), a function of time."""
    with FmuComponent.load(path) as fmu:
        fmu.set_parameters(start or {})
        fmu.enter_initialization(0.0)
        fmu.set_inputs(force(0.0))
        fmu.exit_initialization()
        fmu.set_hold(hold)
        rows, t = [fmu.get_outputs()], 0.0
        for k in range(steps):
            h = STEP if k % 5 else 0.6 * STEP
            fmu.set_inputs(force(t + (h if hold is Hold.INTERPOLATE else 0.0)))
            fmu.do_step(t, h)
            t += h
            rows.append(fmu.get_outputs())
        return dict(zip((v.name for v in fmu.outputs), np.array(rows).T, strict=True))


def pushed(t, size=(2e3, 1e3, 300.0, 1e3, 300.0)):
    """Loads of all wheels near the static ones, each otherwise."""
    k = np.arange(40)
    static = np.tile([79e3, 0, 0, 0, 0], 8)
    return static + np.tile(size, 8) * np.sin(300.0 * t * np.sqrt(1 + k) + k)


# --- names ----------------------------------------------------------------------------------------


def test_names_and_units(made):
    """What is exchanged at a wheel, and what is told of bodies, written out."""
    assert list(made["native"]) == ["Vehicle", "Track"]
    with FmuComponent.load(made["native"]["Vehicle"]) as fmu:
        inputs = {v.name: v.unit for v in fmu.inputs}
        outputs = {v.name: v.unit for v in fmu.outputs}
    forces = {"force_z": "N", "force_y": "N", "moment_x": "N.m", "force_x": "N", "moment_z": "N.m"}
    at = "wheelset[3].right."
    assert {n.removeprefix(at): u for n, u in inputs.items() if n.startswith(at)} == forces
    assert list(inputs) == list(LAYOUT.names(FORCE))
    motions = {"z": "m", "y": "m", "roll": "rad", "x": "m", "yaw": "rad"}
    assert {n.removeprefix(at): u for n, u in outputs.items() if n.startswith(at)} == {
        f"wheel_{rate}{name}": unit + ("/s" if rate else "")
        for name, unit in motions.items()
        for rate in ("", "v")
    }
    of_bodies = motions | {"pitch": "rad"}
    del of_bodies["x"]
    for body in ("carbody", "bogie[1]", "bogie[2]"):
        assert {n.removeprefix(f"{body}."): u for n, u in outputs.items() if body in n} == {
            f"{rate}{name}": unit + per
            for name, unit in of_bodies.items()
            for rate, per in (("", ""), ("v", "/s"), ("a", "/s2"))
        }
    assert outputs["wheelset[4].az"] == outputs["wheelset[4].ay"] == "m/s2"
    assert Layout.among([*inputs, *outputs]) == LAYOUT


def test_a_spatial_track_beside_it(made):
    with FmuComponent.load(made["native"]["Track"]) as fmu:
        names = [v.name for v in (*fmu.inputs, *fmu.outputs)]
    assert Layout.among(names) == Layout(4, directions=DIMENSIONS["spatial"])


@pytest.mark.parametrize("runtime", RUNTIMES)
def test_descriptions_are_valid(made, runtime):
    assert problems_of(made[runtime]["Vehicle"]) == []


def bounded_unlike():
    """Two vehicles, whose contacts no FMU knows."""
    wagon = read_stock(Path("wagon"))
    train = train_of(wagon)
    other = train_of(replace(wagon, rolling=Rolling(creep="fastsim")))
    return replace(train, vehicles=(*train.vehicles, *other.vehicles))


def test_no_pair_without_an_owner_of_the_contact(tmp_path):
    """Friction bounds the creep of one vehicle in another way than that of the other."""
    stock = bounded_unlike()
    with pytest.warns(UnusualWarning, match=r"creep: must be bounded alike.*left out"):
        files = export_pair(stock, SHORT, tmp_path, dimension="spatial")
    assert list(files) == ["Vehicle", "Track"]
    assert not (tmp_path / PAIR).exists()


# --- both runtimes --------------------------------------------------------------------------------


@pytest.mark.parametrize("runtime", RUNTIMES)
def test_runtimes_repeat_the_reference_run(made, runtime):
    """Of 200 steps with forces in all directions; a rounding apart."""
    path = made[runtime]["Vehicle"]
    _, given = table(path, "in")
    wanted, expected = table(path, "ref")
    run = simulate_fmu(
        path, fmi_type="CoSimulation", stop_time=200 * STEP, step_size=STEP, output_interval=STEP,
        input=inputs_of(path), output=wanted,
    )  # fmt: skip
    found, size = np.array([run[name] for name in wanted]).T, np.abs(expected[:, 1:]).max(axis=0)
    assert np.ptp(given[:, 1:], axis=0).min() > 100  # every force and moment acts
    assert np.ptp(expected[:, 1:], axis=0).min() > 0
    assert (np.abs(found - expected[:, 1:]) / size).max() < 1e-9


@pytest.mark.parametrize("hold", list(Hold), ids=lambda hold: hold.name.lower())
def test_native_against_python(made, hold):
    """Steps of two lengths, wheelsets that start at heights of their own."""
    start = {f"wheelset[{i}].start_z": 1e-3 + 1e-4 * i * (-1) ** i for i in (1, 2, 3, 4)}
    native, python = (
        driven(made[name]["Vehicle"], pushed, hold, start=start) for name in ("native", "python")
    )
    for name, expected in python.items():
        assert np.ptp(expected) > 0 or name.endswith("position"), name
        off = np.abs(native[name] - expected).max()
        assert off < 1e-9 * np.abs(expected).max(), name


def test_it_starts_at_rest(vehicle):
    """On wheelsets at one height, under its own weight, nothing moves."""
    heights = {f"wheelset[{i}].start_z": 1.2e-3 for i in (1, 2, 3, 4)}
    static = np.tile([build_multibody(DAMPED, SPATIAL).wheel_load[0], 0, 0, 0, 0], 8)
    found = driven(vehicle, lambda t: static, start=heights)
    for name, values in found.items():
        kind = name.rpartition(".")[2]
        rests = kind in ("z", "wheel_z")
        if kind != "position":
            assert values == pytest.approx(1.2e-3 if rests else 0.0, abs=1e-12), name


def test_rates_are_derivatives(vehicle):
    """Of every motion its rate, of every rate its acceleration: central differences."""
    found = driven(vehicle, pushed, Hold.INTERPOLATE, steps=41)
    # Of forces of up to 1900 rad/s differences over 0.1 ms err by 6e-3, of a rate's largest more.
    for name, values in found.items():
        owner, _, kind = name.rpartition(".")
        rate = next(
            (n for n in (f"{owner}.{kind.replace('wheel_', 'wheel_v')}", f"{owner}.v{kind}")
             if n in found and n != name), None,
        )  # fmt: skip
        if rate is None or kind.startswith(("v", "a", "wheel_v")):
            continue
        t = slice(11, 16)  # of equal steps
        slope = (values[13] - values[11]) / (2 * STEP)
        size = np.abs(found[rate][t]).max()
        assert slope == pytest.approx(found[rate][12], abs=3e-2 * size), name


# --- against mass, damping and stiffness ----------------------------------------------------------


@pytest.fixture(scope="module")
def linear(vehicle):
    return linear_model(vehicle)


@pytest.mark.parametrize("hertz", [0.05, 0.6, 4.0, 30.0, 200.0])
def test_receptances(linear, hertz):
    """Every port by every port, and bodies, straight from the matrices."""
    m, s = build_multibody(DAMPED, SPATIAL), 2j * np.pi * hertz
    P = by_hand(m)
    moved = -np.linalg.solve(s**2 * m.M + s * m.C + m.K, P.T)
    expected = dict(zip(LAYOUT.names(WHEEL.motion), P @ moved, strict=True))
    expected |= {n: s * r for n, r in zip(LAYOUT.names(WHEEL.rate), P @ moved, strict=True)}
    for name, row in zip(m.coordinates, moved, strict=True):
        owner, _, direction = name.rpartition(".")
        expected |= {name: row, f"{owner}.v{direction}": s * row}
        expected[f"{owner}.a{direction}"] = s**2 * row
    H = linear.frequency_response(np.array([2 * np.pi * hertz]))[0]
    assert tuple(v.name for v in linear.inputs) == LAYOUT.names(FORCE)
    for name, row in zip((v.name for v in linear.outputs), H, strict=True):
        if not name.endswith("position"):
            size = np.abs(expected[name]).max()
            assert row == pytest.approx(expected[name], abs=1e-7 * size), name


def test_derivatives_against_differences(vehicle, linear):
    """Exact ones against the same FMU's derivatives and outputs, differenced."""
    other = linear_model(vehicle, slope=differences)
    for name in "ABCD":
        exact, differenced = (
            getattr(one, name).toarray() if name == "A" else getattr(one, name)
            for one in (linear, other)
        )
        size = np.abs(exact).max(axis=1, keepdims=True)
        assert (np.abs(exact - differenced) <= 1e-6 * size).all(), name


def test_step_derivatives(vehicle):
    """Of a step in co-simulation, by forces in every direction: a second step, for it is linear."""
    rng = np.random.default_rng(3)
    with FmuComponent.load(vehicle) as fmu:
        fmu.enter_initialization(0.0)
        fmu.set_inputs(pushed(0.0))
        fmu.exit_initialization()
        fmu.do_step(0.0, STEP)
        before = fmu.save_state()
        ends = []
        change = rng.normal(size=40) * 1e3
        for by in (0.0, 1.0):
            fmu.restore_state(before)
            fmu.set_inputs(pushed(0.1) + by * change)
            fmu.do_step(STEP, STEP)
            ends.append(fmu.get_outputs())
        found = fmu.step_derivative() @ change
    moved = ends[1] - ends[0]
    assert (np.abs(found - moved) <= 1e-9 * np.abs(ends[0]).max() + 1e-6 * np.abs(moved)).all()


def test_a_saved_state_goes_on_as_it_did(vehicle):
    with FmuComponent.load(vehicle) as fmu:
        fmu.enter_initialization(0.0)
        fmu.set_inputs(pushed(0.0))
        fmu.exit_initialization()
        for k in range(4):
            fmu.set_inputs(pushed(k * STEP))
            fmu.do_step(k * STEP, STEP)
        kept, ends = fmu.save_state(), []
        for _ in range(2):
            fmu.restore_state(kept)
            fmu.set_inputs(pushed(1.0))
            fmu.do_step(4 * STEP, STEP)
            ends.append(fmu.get_outputs())
    np.testing.assert_array_equal(*ends)


# --- against the vertical one ---------------------------------------------------------------------


def test_mirrored_excitation_gives_the_vertical_answers(tmp_path):
    """Where both models are the same: springs along the track act at no height."""
    level = replace(DAMPED, geometry=LEVEL)
    paths = [alone(level, tmp_path, name) for name in ("vertical", "spatial")]
    mirror = np.array([1, 1, 1, 1, -1, -1, -1, -1])[:, None]  # of what is odd: to the right etc.

    def down(t):
        return np.tile(79e3 + 3e3 * np.sin(500 * t + np.arange(4)), 2)

    def spatial(t):
        force = np.zeros((8, 5))
        force[:, 0] = down(t)
        k = np.tile(np.arange(4), 2)[:, None]
        aside = np.array([2e3, 100.0, 0.0, 100.0]) * np.sin(400 * t + k)
        force[:, 1:] = mirror * aside
        return force.ravel()

    expected, found = driven(paths[0], down), driven(paths[1], spatial)
    moves = [n for n, values in expected.items() if np.ptp(values) > 0 and "position" not in n]
    assert len(moves) >= 8 * 2 + 3 * 4
    for name in moves:
        size = np.abs(expected[name]).max()
        assert found[name] == pytest.approx(expected[name], abs=1e-9 * size), name
    for name in ("carbody.y", "bogie[1].roll", "bogie[2].yaw", "wheelset[1].ay"):
        assert np.abs(found[name]).max() < 1e-12, name


def test_the_other_way_it_leans(vehicle):
    """One side pushed harder from below: the car body rolls away from it, and so do axles."""

    def force(t):
        of_wheels = np.tile([79e3, 0, 0, 0, 0], 8).reshape(8, 5)
        of_wheels[:4, 0] += 5e3  # left
        return of_wheels.ravel()

    found = driven(vehicle, force)
    for name in ("bogie[1].roll", "bogie[2].roll", "wheelset[2].left.wheel_roll"):
        assert found[name][-1] > 0, name
    assert found["wheelset[1].left.wheel_z"][-1] < found["wheelset[1].right.wheel_z"][-1]
    assert found["carbody.vroll"][-1] > 0
    # Axles roll about their middle, so what is below goes to the left.
    assert found["wheelset[1].left.wheel_y"][-1] < 0


def test_toppling_is_no_error(tmp_path):
    """A free vehicle that weights topple grows, slowly."""
    toppling = replace(DAMPED, geometry=Geometry(toppling=True))
    poles = np.linalg.eigvals(linear_model(alone(toppling, tmp_path)).A.toarray())
    assert 0.1 < poles.real.max() < 10


def test_a_dimension_that_is_none(tmp_path):
    with pytest.raises(ValueError, match="dimension = lateral: must be one of vertical, spatial"):
        export(Vehicle(), SHORT, tmp_path, dimension="lateral")


def test_it_hunts_as_its_parameters_do(made):
    """The critical speed from the linearised FMU, on rigid rails."""
    on_rails = {"stock": DAMPED, "conicity": [0.2], "rigid_track": True}
    of_fmu = critical_speed(**on_rails, vehicle_fmu=made["native"]["Vehicle"])
    of_file = critical_speed(**on_rails)
    assert of_file["critical_speed"][0] > 0
    for name in ("critical_speed", "frequency"):
        # Halving ends at 1e-9; the static loads are rounded in the description.
        np.testing.assert_allclose(of_fmu[name], of_file[name], rtol=1e-6)


# 7 s: a spatial track is linearised.
@pytest.mark.slow
def test_it_answers_in_space_and_is_refused_where_it_hunts(made):
    """From both FMUs by the one door; slowly, wheelsets go where an alignment goes."""
    fmus = made["native"]
    pair = fmus["Vehicle"], fmus["Track"], np.array([0.01, 5.0])
    found = frequency_response(*pair, excitation="alignment", stock=DAMPED, speed=15.0)
    # A wave of 1.5 km, 18 m long vehicles.
    assert abs(found["wheelset[1].left.wheel_y"].values[0] - 1.0) < 0.02
    assert found["wheelset[4].right.rail_moment_x"].attrs["units"] == "N.m/m"
    with pytest.raises(ArithmeticError, match=r"hunts.*it does from \d+\.\d km/h on.*--believe"):
        frequency_response(*pair, excitation="alignment", stock=DAMPED, speed=150.0)
    with pytest.raises(ArgumentError, match="roll"):
        frequency_response(*pair, contact_stiffness=1e9)


# 5 s: a spatial track is linearised, once for all.
@pytest.mark.slow
def test_maps_and_random_responses_in_space_are_its_responses(made, monkeypatch):
    """Aside: of one irregularity on the plane, of all of a class by their densities."""
    files = [made["native"][name] for name in ("Vehicle", "Track")]
    models = linear_models(*files, lambda done, total: None)
    for module in ("frf", "map", "ride"):
        place = f"railcosim.analysis.response.{module}.linear_models"
        monkeypatch.setattr(place, lambda *_: models)
    fmus, speed, wave = (made["native"][n] for n in ("Vehicle", "Track")), 15.0, 3.0
    pair = tuple(fmus)
    f = np.array([0.5 * speed / wave, speed / wave])  # of two wavelengths, or at two speeds
    of = {
        name: frequency_response(*pair, f, excitation=name, speed=speed)
        for name in ("vertical", "cross_level", "alignment", "gauge")
    }
    found = response_map(
        *pair, np.array([wave, 2 * wave]), np.array([0.9, 1.0]) * speed, irregularity="alignment"
    )
    assert found.critical == []
    for name in (
        "carbody.y",
        "bogie[2].yaw",
        "wheelset[3].left.wheel_y",
        "wheelset[1].left.rail_y",
    ):
        on_map, alone_ = found.dataset[name].values[::-1, 1], of["alignment"][name].values
        np.testing.assert_allclose(on_map, alone_, rtol=1e-9)
    assert found.dataset["bogie[2].yaw"].attrs["units"] == "rad/m"
    quality = QUALITIES["german-low"]
    riding = ride(*pair, f, speed=speed)
    waves = 2 * np.pi * f / speed
    psd = sum(
        np.abs(of[name]["carbody.y"].values) ** 2 * s.density(waves) * 2 * np.pi / speed
        for name, s in quality.spectra.items()
    )
    np.testing.assert_allclose(riding["carbody.ay"], psd * (2 * np.pi * f) ** 4, rtol=1e-9)
    assert riding["carbody.ay"].attrs["weighting"] == "W_d"
    with pytest.raises(ArithmeticError, match=r"hunts.*it does from"):
        ride(*pair, f, speed=150.0)
    with pytest.raises(ArithmeticError, match=r"at 540 km/h.*hunts"):
        response_map(*pair, np.array([100.0]), np.array([10.0, 150.0]), irregularity="alignment")


@pytest.mark.slow  # critical speeds of three vehicles: 9 s
def test_wheels_are_those_that_the_fmu_tells(tmp_path) -> None:
    """Radius, distance, cone, patch, and the axle's inertia, which spins tell: as of parameters."""
    other = replace(
        DAMPED,
        rolling=replace(DAMPED.rolling, conicity=0.2),
        wheelset=replace(DAMPED.wheelset, radius=0.5, inertia_spin=140.0),
        contact=replace(DAMPED.contact, half_distance=0.7, rail_radius=0.25),
    )
    fmu = alone(other, tmp_path)
    told = {"conicity": [0.2], "rigid_track": True, "vehicle_fmu": fmu}
    given = replace(other, rolling=DAMPED.rolling)  # the default: else it is for runs in time
    for gravity in Gravity:
        of_fmu, of_file, of_paper = (
            critical_speed(stock, gravity=gravity, **told)["critical_speed"][0]
            for stock in (None, given, DAMPED)
        )
        # Start values are written in full; what differs is rounding, and where halving ends.
        np.testing.assert_allclose(of_fmu, of_file, rtol=1e-8)
        assert abs(of_paper / of_file - 1) > 0.01
    on_rails = {"excitation": "alignment", "speed": 10.0, "assembly": Assembly.RIGID_TRACK}
    ours, theirs = (
        frequency_response(fmu, "", np.array([0.5, 20.0]), stock=stock, **on_rails)
        for stock in (None, other)
    )
    for name in ("wheelset[1].left.wheel_y", "wheelset[4].right.force_y", "carbody.roll"):
        np.testing.assert_allclose(ours[name], theirs[name], rtol=1e-7)


def test_wheels_that_nobody_tells_are_asked_for(tmp_path) -> None:
    """There is no law of all of them."""
    with pytest.raises(CouplingError, match=r"contact\.wheel_radius.*give its.*--vehicle"):
        told_wheels(alone(bounded_unlike(), tmp_path))


def test_the_papers_pitch_rises_in_space_by_what_acts_through_heights(tmp_path) -> None:
    """Undamped, of parameters, from 0.946 to 0.953 Hz; the peaks of FMUs that roll as much."""
    stock, ratio, peaks = Vehicle(), [], []
    for name in ("vertical", "spatial"):
        body = build_multibody(stock, MODELS[name])
        held = body.above  # wheelsets stand
        found, modes = eigh(body.K[held, held], body.M[held, held])
        pitch = np.abs(modes[body.at("carbody", "pitch")]).argmax()
        ratio.append(np.sqrt(found[pitch]))
        fmu = alone(stock, tmp_path, name)
        models = linear_models(fmu, None, lambda done, total: None)
        lab = Laboratory(
            effort=QUICK, models=models, vehicle=stock, track=SHORT,
            contact=CONTACTS[name](fmu, models),
        )  # fmt: skip
        frequency = np.linspace(0.8, 1.1, 301)
        system = lab.rigid()(2 * np.pi * frequency)
        (size,) = sizes(system, PUSH, lab.positions, ["vehicle.carbody.pitch"])
        peaks.append(peak(frequency, size, 0.8, 1.1))
    assert np.array(ratio) / (2 * np.pi) == pytest.approx([0.946, 0.953], abs=5e-4)
    # Damping lowers both peaks, by 2.7 %.
    assert peaks[1] / peaks[0] == pytest.approx(ratio[1] / ratio[0], abs=1e-3)


def test_wheels_that_roll_are_as_stiff_as_the_paper_asks(tmp_path) -> None:
    fmu = alone(Vehicle(), tmp_path)
    contact = CONTACTS["spatial"](fmu, linear_models(fmu, None, lambda done, total: None))
    for k_H in (0.1e9, 8e9):
        stiffness = contact(k_H).K[:, 0, 0]  # the wheel's z; along the normals of cones of 0.05
        assert stiffness == pytest.approx(k_H, rel=3e-3)
